//! Scenes to begin with, completions and the manual.

use super::{Bench, SPRING};

/// Every kind that the list has is written, understood without a warning, and run.
#[test]
fn every_kind_of_scene_runs() {
    let bench = Bench::new(SPRING);
    let list = bench.pliant(["new", "--list", "--json"]).succeeded().json();
    let kinds = list["kinds"].as_array().unwrap();
    assert!(kinds.len() >= 5);
    for kind in kinds {
        let (name, summary) = (kind["kind"].as_str().unwrap(), kind["summary"].as_str().unwrap());
        assert!(summary.ends_with('.') && summary.len() > 20, "{name}: {summary}");
        let file = format!("{name}.toml");
        bench
            .pliant(["new", name, "--kind", name])
            .succeeded()
            .prints(&[&format!("pliant run {file} --view")]);
        let text = std::fs::read_to_string(bench.directory.path().join(&file)).unwrap();
        assert!(text.starts_with("# ") && text.contains("What one should see: "), "{file}");
        let check = bench.pliant(["check", &file]).succeeded();
        assert!(!check.stderr.contains("warning"), "{}", check.stderr);
        let duration: f64 =
            toml::from_str::<toml::Table>(&text).unwrap()["time"]["duration"].as_float().unwrap();
        let until = (duration / 50.0).to_string();
        bench.pliant([&file, "--until", &until, "-o", &format!("{name}.mcap")]).succeeded();
    }
}

#[test]
fn a_new_scene_replaces_none_unasked() {
    let bench = Bench::new(SPRING);
    bench.pliant(["new", "first"]).succeeded();
    let text = || std::fs::read_to_string(bench.directory.path().join("first.toml")).unwrap();
    let jelly = text();
    bench
        .pliant(["new", "first.toml", "--kind", "cloth"])
        .ended_with(2)
        .says(&["first.toml exists", "--force"]);
    assert_eq!(text(), jelly);
    bench.pliant(["new", "first.toml", "--kind", "cloth", "--force"]).succeeded();
    assert!(text().contains("cloth = {") && text() != jelly);
    bench.pliant(["new", "other", "--kind", "jely"]).ended_with(2).says(&["`jely`", "jelly, cloth, beam"]);
    bench.pliant(["new"]).ended_with(2).says(&["NAME"]);
    bench.pliant(["new", ".."]).ended_with(2).says(&["no name of a file"]);
    assert_eq!(bench.files(), ["first.toml"]);
}

#[test]
fn shells_and_man_know_every_command() {
    let bench = Bench::new(SPRING);
    let commands = ["run", "check", "study", "live", "new", "completions"];
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let script = bench.pliant(["completions", shell]).succeeded().stdout;
        assert!(commands.iter().all(|command| script.contains(command)), "{shell}: {script}");
        // Without dashes: fish writes `-l no-record`.
        assert!(script.contains("no-record"), "{shell}");
    }
    bench.pliant(["completions", "tcsh"]).ended_with(2).says(&["tcsh"]);
    let page = bench.pliant(["man"]).succeeded().stdout;
    assert!(page.contains(".TH") && page.contains("pliant"), "{page}");
    bench.pliant(["man", "-o", "pages"]).succeeded();
    for command in commands {
        let page = bench.directory.path().join(format!("pages/pliant-{command}.1"));
        assert!(std::fs::read_to_string(&page).unwrap().contains(".SH OPTIONS"), "{command}");
    }
    bench.pliant(["man", "-o", "pages"]).ended_with(2).says(&["pages/pliant.1 exists"]);
}
