//! The reference page of the scene format says what the program reads.

use std::path::Path;

use serde_json::Value;

use super::{Bench, SPRING};

pub(super) fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_page_is_what_the_program_prints() {
    let printed = Bench::new(SPRING).pliant(["schema", "--format", "markdown"]).succeeded().stdout;
    let page = std::fs::read_to_string(root().join("docs/scene-format.md")).unwrap();
    let difference = page.lines().zip(printed.lines()).find(|(old, new)| old != new);
    assert!(
        page == printed,
        "docs/scene-format.md is out of date, first here: {difference:#?}\n\
         write it anew: cargo run -- schema --format markdown > docs/scene-format.md"
    );
}

/// The schema that the first line of a scene names for editors.
#[test]
fn the_schema_beside_the_scenes_is_what_the_program_prints() {
    let printed = Bench::new(SPRING).pliant(["schema"]).succeeded().stdout;
    let stored = std::fs::read_to_string(root().join("scenes/schema.json")).unwrap();
    assert!(
        stored == printed,
        "scenes/schema.json is out of date; write it anew: cargo run -- schema > scenes/schema.json"
    );
}

/// Every key and every choice of a definition of the schema.
fn names(definition: &Value) -> Vec<String> {
    let list = |key: &str| definition[key].as_array().cloned().unwrap_or_default();
    let keys = definition["properties"].as_object().into_iter().flatten().map(|(key, _)| key.clone());
    let words = list("enum").into_iter().chain([definition["const"].clone()]);
    let words = words.filter_map(|word| word.as_str().map(str::to_owned));
    keys.chain(words).chain(list("oneOf").iter().flat_map(names)).collect()
}

#[test]
fn every_key_is_in_the_page_as_often_as_in_the_schema() {
    let schema = Bench::new(SPRING).pliant(["schema"]).succeeded().json();
    let page = std::fs::read_to_string(root().join("docs/scene-format.md")).unwrap();
    let definitions = schema["$defs"].as_object().unwrap().values();
    let mut expected: Vec<String> = definitions.chain([&schema]).flat_map(names).collect();
    let mut shown: Vec<String> = page
        .lines()
        .flat_map(|line| match (line.strip_prefix("| `"), line.strip_prefix("One of ")) {
            (Some(row), _) => vec![row.split('`').next().unwrap().to_owned()],
            (_, Some(words)) => words.split('`').skip(1).step_by(2).map(str::to_owned).collect(),
            _ => vec![],
        })
        .collect();
    expected.sort();
    shown.sort();
    assert_eq!(shown, expected);
    assert!(expected.len() > 100);
}
