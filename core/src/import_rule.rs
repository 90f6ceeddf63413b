//! The inner import rule: which module may import which, read off the sources.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Each module with what it may import. Only modules further up may be named, so there are no circles.
const RULE: &[(&str, &[&str])] = &[
    ("fault", &[]),
    ("actuation", &[]),
    ("random", &[]),
    ("analysis", &["random"]),
    ("geometry", &["actuation", "random"]),
    ("reduced", &["actuation", "geometry"]),
    ("document", &["fault"]),
    ("optimiser", &["fault", "random"]),
    ("lane", &[]),
    ("material", &["fault", "lane", "random"]),
    (
        "scene",
        &["actuation", "document", "fault", "geometry", "material"],
    ),
    (
        "study",
        &[
            "actuation",
            "document",
            "fault",
            "geometry",
            "material",
            "optimiser",
            "random",
            "reduced",
            "scene",
        ],
    ),
    ("hierarchy", &["geometry", "reduced", "scene", "study"]),
    ("element", &["lane", "material"]),
    ("linear", &["lane"]),
    (
        "mesh",
        &["element", "fault", "geometry", "material", "scene"],
    ),
    ("picture", &["analysis", "geometry", "mesh", "reduced"]),
    ("force", &["geometry", "linear", "mesh"]),
    (
        "assembly",
        &["element", "force", "lane", "linear", "material", "mesh"],
    ),
    (
        "equilibrium",
        &["actuation", "assembly", "linear", "material", "mesh"],
    ),
    ("objective", &["element", "geometry", "mesh"]),
    ("constraint", &["assembly", "force", "mesh"]),
    (
        "adjoint",
        &["assembly", "equilibrium", "force", "objective"],
    ),
    (
        "evaluate",
        &[
            "actuation",
            "adjoint",
            "assembly",
            "constraint",
            "equilibrium",
            "fault",
            "force",
            "geometry",
            "linear",
            "material",
            "mesh",
            "objective",
            "reduced",
            "scene",
            "study",
        ],
    ),
    (
        "verify",
        &[
            "analysis",
            "assembly",
            "equilibrium",
            "evaluate",
            "fault",
            "geometry",
            "material",
            "mesh",
            "objective",
            "optimiser",
            "scene",
        ],
    ),
];

/// Files that are no modules of the science: the list of modules, and this test.
const EXEMPT: [&str; 2] = ["lib", "import_rule"];

#[test]
fn every_import_keeps_the_rule() {
    let allowed: BTreeMap<&str, BTreeSet<&str>> = RULE
        .iter()
        .map(|(module, imports)| (*module, imports.iter().copied().collect()))
        .collect();
    let mut seen = BTreeSet::new();
    let mut wrong = Vec::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for file in sources(&root) {
        let place = file.strip_prefix(&root).unwrap().to_string_lossy();
        let module = place.split(['/', '.']).next().unwrap();
        if EXEMPT.contains(&module) {
            continue;
        }
        let Some(allowed) = allowed.get(module) else {
            wrong.push(format!("{place}: the rule does not know {module}"));
            continue;
        };
        seen.insert(module.to_owned());
        for import in imports(&fs::read_to_string(&file).unwrap()) {
            if import != module && !allowed.contains(import.as_str()) {
                wrong.push(format!("{place}: {module} may not import {import}"));
            }
        }
    }
    for (module, _) in RULE {
        if !seen.contains(*module) {
            wrong.push(format!("the rule knows {module}, which does not exist"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_rule_has_no_circles() {
    for (place, (module, imports)) in RULE.iter().enumerate() {
        for import in *imports {
            assert!(
                RULE[..place].iter().any(|(above, _)| above == import),
                "{module} imports {import}, which is not above it"
            );
        }
    }
}

#[test]
fn imports_are_read_in_every_form() {
    let source = "
        use crate::mesh::{Mesh, Node};
        pub(crate) use crate::{force::edge, geometry::{Point, unit::Unit}};
        //! [`crate::study`] in a comment
        let x: crate::linear::Factor = $crate::fault::fault();
    ";
    let found: Vec<String> = imports(source).into_iter().collect();
    assert_eq!(found, ["fault", "force", "geometry", "linear", "mesh"]);
}

/// First segments of all `crate::` paths outside of comments.
fn imports(source: &str) -> BTreeSet<String> {
    let code: String = source
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .flat_map(|line| [line, "\n"])
        .collect();
    let mut found = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let path = &code[at + "crate::".len()..];
        if let Some(group) = path.strip_prefix('{') {
            found.extend(heads(group));
        } else {
            found.insert(word(path));
        }
    }
    found
}

/// First segments of the paths of a group, the text after its opening brace.
fn heads(group: &str) -> Vec<String> {
    let mut found = Vec::new();
    let (mut depth, mut is_head) = (0, true);
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => is_head = true,
            c if is_head && !c.is_whitespace() => {
                found.push(word(&group[at..]));
                is_head = false;
            }
            _ => {}
        }
    }
    found
}

fn word(text: &str) -> String {
    let letters = |c: &char| c.is_ascii_alphanumeric() || *c == '_';
    text.chars().take_while(letters).collect()
}

fn sources(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found
}
