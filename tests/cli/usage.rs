//! The command line itself.

use super::{Bench, SPRING};

#[test]
fn help_and_version_are_results() {
    let bench = Bench::new(SPRING);
    bench.pliant(["--help"]).succeeded().prints(&["pliant [run] [OPTIONS] SCENE", "recover", "Exit codes"]);
    bench.pliant(["run", "--help"]).succeeded().prints(&["--until <SECONDS>"]);
    bench.pliant(["--version"]).succeeded().prints(&["pliant 0."]);
}

#[test]
fn mistakes_on_the_command_line_end_with_2() {
    let bench = Bench::new(SPRING);
    let cases: &[(&[&str], &str)] = &[
        (&[], "Usage: pliant"),
        (&["-q"], "<SCENE>"),
        (&["scene.toml", "--untill", "1"], "--until"),
        (&["scene.toml", "--until", "0"], "positive number of seconds"),
        (&["scene.toml", "--until", "-1"], "positive number of seconds"),
        (&["scene.toml", "--until", "inf"], "positive number of seconds"),
        (&["scene.toml", "--until", "soon"], "a number of seconds"),
        (&["scene.toml", "--threads", "0"], "--threads"),
        (&["scene.toml", "--threads", "many"], "--threads"),
        (&["scene.toml", "--no-record", "-o", "x.mcap"], "cannot be used with"),
        (&["scene.toml", "-q", "-v"], "cannot be used with"),
        (&["scene.toml", "other.toml"], "unexpected argument"),
        (&["scene.toml", "--color", "sometimes"], "auto"),
        (&["chekc", "scene.toml"], "`pliant check`"),
        (&["recovr"], "`pliant recover`"),
        (&["list", "integrator"], "integrators"),
        (&["scene.toml", "check", "scene.toml"], "come after its name"),
        (&["--force", "check", "scene.toml"], "come after its name"),
        (&["bench", "--row", "tets"], "tet-corotated, tri-corotated"),
        (&["bench", "--threads", "0"], "--threads"),
        (&["run"], "<SCENE>"),
        (&["recover"], "<FILE>"),
    ];
    for (arguments, expected) in cases {
        bench.pliant(*arguments).ended_with(2).says(&[expected]);
    }
    assert!(bench.files().is_empty(), "{:?}", bench.files());
}

#[test]
fn what_was_likely_meant_is_named() {
    let bench = Bench::new(SPRING);
    bench.pliant(["scene.toml"]).succeeded();
    let cases: &[(&[&str], &str)] = &[
        (&["rn", "scene.toml"], "`pliant run`"),
        (&["scene"], "`pliant run scene.toml`"),
        (&["run", "scne.toml"], "did you mean scene.toml?"),
        (&["run", "scene"], "did you mean scene.toml?"),
        (&["scene.toml", "--duration", "1"], "--until"),
        (&["run", "scene.toml", "--duration=1"], "--until"),
        (&["view", "scene.toml"], "`pliant run scene.toml --view`"),
        (&["view", "scne.mcap"], "did you mean scene.mcap?"),
        (&["live", "scene.mcap"], "`pliant view scene.mcap`"),
        (&["check", "scene.mcap"], "a recording, not a scene"),
        (&["run", "scene.toml", "--set", "body.pair.springs.stifness=1"], "`body.0.springs.stiffness`"),
    ];
    for (arguments, expected) in cases {
        bench.pliant(*arguments).ended_with(2).says(&[expected]);
    }
    // What is far from everything is not guessed at.
    let far = bench.pliant(["run", "elsewhere.toml"]).ended_with(2);
    assert!(!far.stderr.contains("did you mean"), "{}", far.stderr);
}

#[test]
fn mistakes_are_json_too() {
    let bench = Bench::new(SPRING);
    for arguments in [
        &["--json", "scene.toml", "--untill", "1"][..],
        &["--json"],
        &["check", "--json"],
        &["scene.toml", "--json", "--set", "time.step"],
        &["scene.toml", "--json", "-o", "."],
        &["info", "nothing.mcap", "--json"],
        &["recover", "nothing.mcap.part", "--json"],
    ] {
        let json = bench.pliant(arguments).ended_with(2).json();
        assert_eq!(json["status"], "invalid", "{arguments:?}");
        assert!(json["problems"][0]["message"].as_str().is_some_and(|m| !m.is_empty()), "{json}");
    }
}

#[test]
fn common_options_stand_anywhere() {
    let bench = Bench::new(SPRING);
    for arguments in [["--json", "check", "scene.toml"], ["check", "--json", "scene.toml"]] {
        assert_eq!(bench.pliant(arguments).succeeded().json()["status"], "done");
    }
    bench.pliant(["--color", "never", "check", "scene.toml"]).succeeded();
}

#[test]
fn colours_only_where_wanted() {
    let bench = Bench::new(&SPRING.replace("step", "stepp"));
    let plain = bench.pliant(["scene.toml"]).ended_with(2);
    assert!(!plain.stderr.contains('\x1b'), "standard error is no terminal here");
    let never = bench.pliant(["scene.toml", "--color", "never"]).ended_with(2);
    assert!(!never.stderr.contains('\x1b'));
    bench.pliant(["scene.toml", "--color", "always"]).ended_with(2).says(&["\x1b["]);
}
