//! `salp verify`: one table or document, exit 1 where a line fails.

use std::process::Command;

use serde_json::Value;

fn verify(arguments: &[&str]) -> (i32, Value) {
    let output = Command::new(env!("CARGO_BIN_EXE_salp"))
        .args(["verify", "--json"])
        .args(arguments)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let document = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{text}"));
    (output.status.code().unwrap(), document)
}

#[test]
fn one_problem_on_one_element_passes() {
    let (code, document) = verify(&["--only", "retraced", "--element", "quad9"]);
    assert_eq!(code, 0, "{document}");
    assert_eq!(document["status"], "ok");
    let lines = document["lines"].as_array().unwrap();
    assert_eq!(lines.len(), 2);
    for line in lines {
        assert_eq!(line["problem"], "retraced-channel");
        assert_eq!(line["element"], "quad9");
        assert_eq!(line["passed"], true);
        assert!(line["error"].as_f64().unwrap() <= line["bound"].as_f64().unwrap());
    }
}

#[test]
fn a_line_that_fails_exits_1_and_an_unknown_name_2() {
    let tight = [
        "--only",
        "retraced",
        "--element",
        "quad4",
        "--tighten",
        "1e12",
    ];
    let (code, document) = verify(&tight);
    assert_eq!(code, 1, "{document}");
    assert_eq!(document["status"], "failed");
    assert!(document["failed"].as_u64().unwrap() > 0);
    let (code, document) = verify(&["--only", "no-such-problem"]);
    assert_eq!(code, 2, "{document}");
    assert_eq!(document["faults"][0]["path"], "only");
}
