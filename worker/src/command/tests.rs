//! Programs that answer, fail, hang and leave children.

use super::*;

const EXPECTED: Expected = Expected {
    variables: 1,
    constraints: 1,
    gradient: false,
};

fn python(script: &str) -> Program {
    let argv = ["python3".into(), "-uc".into(), script.into()];
    Program::new(&argv, Path::new("/"), Duration::from_secs(5), EXPECTED)
}

fn reason(outcome: &Outcome) -> String {
    match &outcome.status {
        OutcomeStatus::Failed { reason } => reason.clone(),
        other => format!("{other:?}"),
    }
}

const SQUARE: &str = "
import sys, json, os
for line in sys.stdin:
    x = json.loads(line)['x'][0]
    print(json.dumps({'objective': x * x, 'constraints': [os.getpid()]}))";

#[test]
fn a_program_is_kept_alive_and_its_folder_is_empty() {
    let mut program = python(&format!(
        "import os\nassert os.listdir('.') == []\n{SQUARE}"
    ));
    let first = program.evaluate(&[3.0], false, &|| false);
    let second = program.evaluate(&[0.1], false, &|| false);
    assert_eq!(first.objective, Some(9.0), "{}", reason(&first));
    assert_eq!(second.objective, Some(0.1 * 0.1));
    assert_eq!(first.constraints, second.constraints);
    assert!(first.cpu_s > 0.0);
}

#[test]
fn a_program_may_end_after_each_point_but_must_end_well() {
    let one = "import sys, json\njson.loads(input())\nprint('{\"objective\": 1, \"constraints\": [0]}')\n";
    let mut program = python(one);
    for _ in 0..2 {
        assert_eq!(
            program.evaluate(&[3.0], false, &|| false).objective,
            Some(1.0)
        );
    }
    let mut program = python(&format!("{one}sys.exit(3)"));
    let outcome = program.evaluate(&[3.0], false, &|| false);
    assert!(
        reason(&outcome).contains("exit status: 3"),
        "{}",
        reason(&outcome)
    );
}

#[test]
fn failures_say_why() {
    let cases = [
        (
            "import sys\ninput()\nprint('no', file=sys.stderr)\nsys.exit(2)",
            "exit status: 2 without an answer: no",
        ),
        ("input()", "without an answer"),
        (
            "input()\nprint('{\"objective\": NaN, \"constraints\": [0]}')",
            "cannot be read",
        ),
        (
            "input()\nprint('{\"objective\": 1e999, \"constraints\": [0]}')",
            "cannot be read",
        ),
        (
            "input()\nprint('{\"objective\": null, \"constraints\": [0]}')",
            "not a finite number",
        ),
        (
            "input()\nprint('{\"objective\": 1, \"constraints\": [0, 0]}')",
            "has 2 numbers, 1 are expected",
        ),
    ];
    for (script, expected) in cases {
        let outcome = python(script).evaluate(&[1.0], false, &|| false);
        assert!(
            reason(&outcome).contains(expected),
            "{script}: {}",
            reason(&outcome)
        );
    }
    let argv = ["/nowhere/program".to_owned()];
    let mut program = Program::new(&argv, Path::new("/"), Duration::from_secs(5), EXPECTED);
    let outcome = program.evaluate(&[1.0], false, &|| false);
    assert!(
        reason(&outcome).contains("cannot start"),
        "{}",
        reason(&outcome)
    );
}

#[test]
fn the_time_limit_and_a_cancellation_leave_no_process_behind() {
    let script = "
import subprocess, sys, time
child = subprocess.Popen(['sleep', '60'])
print(child.pid, file=sys.stderr)
time.sleep(60)";
    let mut program = python(script);
    program.time_limit = Duration::from_millis(400);
    let outcome = program.evaluate(&[1.0], false, &|| false);
    assert!(
        reason(&outcome).contains("no answer within 0.4 s"),
        "{}",
        reason(&outcome)
    );
    assert!(program.running.is_none());

    program.time_limit = Duration::from_mins(1);
    let started = Instant::now();
    let cancel = || started.elapsed() > Duration::from_millis(400);
    let outcome = program.evaluate(&[1.0], false, &cancel);
    assert_eq!(outcome.status, OutcomeStatus::Cancelled);
    assert!(started.elapsed() < Duration::from_secs(5));
}
