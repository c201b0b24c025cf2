//! Scenes that make no sense: each mistake is shown at its place, and ends with 2.

use super::{Bench, SPRING};

#[test]
fn an_unknown_key_is_underlined_and_corrected() {
    let bench = Bench::new(&SPRING.replace("duration", "durration"));
    for command in [&["scene.toml"][..], &["run", "scene.toml"], &["check", "scene.toml"]] {
        bench.pliant(command).ended_with(2).says(&[
            "unknown field `durration`",
            "scene.toml:6:1",
            "^^^^^^^^^",
            "did you mean `duration`?",
        ]);
    }
    let json = bench.pliant(["scene.toml", "--json"]).ended_with(2).json();
    assert_eq!(json["status"], "invalid");
    let problems = json["problems"].as_array().unwrap();
    let problem = problems.iter().find(|problem| problem["kind"] == "unknown_field").unwrap();
    assert_eq!((problem["line"].as_u64(), problem["column"].as_u64()), (Some(6), Some(1)));
    assert_eq!(problem["path"], "time.durration");
    assert!(bench.files().is_empty());
}

#[test]
fn all_mistakes_come_at_once() {
    let text = SPRING.replace("step = 0.002", "step = -0.002").replace("rate = 10.0", "rate = 0.0");
    let bench = Bench::new(&text);
    bench.pliant(["scene.toml"]).ended_with(2).says(&["scene.toml:5:8", "scene.toml:14:8"]);
    assert_eq!(
        bench.pliant(["check", "scene.toml", "--json"]).ended_with(2).json()["problems"]
            .as_array()
            .unwrap()
            .len(),
        2
    );
}

#[test]
fn what_only_the_assembly_finds_has_a_place_too() {
    let text = SPRING.replace("mass =", "pin = [{ group = \"left\" }]\nmass =");
    Bench::new(&text).pliant(["scene.toml"]).ended_with(2).says(&["scene.toml:11:", "left"]);
}

#[test]
fn files_that_are_no_scenes() {
    let bench = Bench::new("dimension = [");
    bench.pliant(["scene.toml"]).ended_with(2).says(&["scene.toml:1:"]);
    bench.pliant(["missing.toml"]).ended_with(2).says(&["cannot read missing.toml"]);
    bench.pliant(["."]).ended_with(2).says(&["cannot read ."]);
    std::fs::write(bench.path("binary.toml"), [b'a', 0xff, 0xfe]).unwrap();
    bench.pliant(["binary.toml"]).ended_with(2).says(&["not UTF-8"]);
    std::fs::write(bench.path("empty.toml"), "").unwrap();
    bench.pliant(["empty.toml"]).ended_with(2).says(&["missing field"]);
}

#[test]
fn a_scene_that_does_not_fit_into_memory() {
    let mesh = "grid = { cells = [100000, 100000], spacing = 0.1 }";
    let text = SPRING.replace("strand = { segments = 1, start = [0.0, 0.0], end = [1.0, 0.0] }", mesh);
    Bench::new(&text).pliant(["scene.toml"]).ended_with(2).says(&["scene.toml:"]);
}

#[test]
fn set_changes_values_and_is_named_in_errors() {
    let bench = Bench::new(SPRING);
    let set = |change: &str| bench.pliant(["check", "scene.toml", "--set", change]);
    let report = bench
        .pliant(["check", "scene.toml", "--json", "--set", "time.step=0.004", "--set", "time.integrator=rk4"])
        .succeeded()
        .json();
    assert_eq!(report["report"]["step"], 0.004);
    assert_eq!(report["report"]["integrator"], "rk4");
    set("time.step").ended_with(2).says(&["gives no value", "--set time.step=1e-3"]);
    set("time..step=1").ended_with(2).says(&["time..step"]);
    set("time.stepp=1").ended_with(2).says(&["did you mean `step`?", "from `--set time.stepp=1`"]);
    set("time.step=fast").ended_with(2).says(&["from `--set time.step=fast`"]);
    set("time.step=1e").ended_with(2).says(&["from `--set time.step=1e`"]);
    set("body.1.name=x").ended_with(2).says(&["`body` has 1 entry"]);
}
