//! Recordings as pages.

use super::{Bench, SPRING};

/// With a recording of eleven frames.
fn recorded() -> Bench {
    let bench = Bench::new(SPRING);
    bench.pliant(["scene.toml", "-q"]).succeeded();
    bench
}

#[test]
fn a_page_is_written_beside_the_recording() {
    let bench = recorded();
    bench.pliant(["view", "scene.mcap", "--no-open"]).succeeded().prints(&["wrote scene.html", "11 frames"]);
    let page = std::fs::read_to_string(bench.path("scene.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.contains("data-data=\"body0.position0\""));
    assert_eq!(bench.files(), ["scene.html", "scene.mcap"]);
    bench.pliant(["view", "scene.mcap", "--no-open"]).ended_with(2).says(&[
        "scene.html exists",
        "--force",
        "-o",
    ]);
    let json = bench.pliant(["view", "scene.mcap", "--no-open", "-o", "b.html", "--json"]).succeeded().json();
    assert_eq!((&json["view"]["page"], json["view"]["frames"].as_u64()), (&"b.html".into(), Some(11)));
    // The same recording gives the same page.
    assert_eq!(std::fs::read_to_string(bench.path("b.html")).unwrap(), page);
}

#[test]
fn what_is_no_recording_is_refused() {
    let bench = Bench::new(SPRING);
    let view = |file: &str| bench.pliant(["view", file, "--no-open"]);
    view("nothing.mcap").ended_with(2).says(&["cannot read nothing.mcap"]);
    view("scene.toml").ended_with(2).says(&["not an MCAP file"]);
    assert!(bench.files().is_empty());
}

#[test]
fn export_writes_the_same_page_and_names_what_it_can_write() {
    let bench = recorded();
    bench.pliant(["export", "scene.mcap", "--to", "a.html"]).succeeded().prints(&["wrote a.html"]);
    bench.pliant(["view", "scene.mcap", "--no-open", "-q"]).succeeded();
    let page = |name: &str| std::fs::read(bench.path(name)).unwrap();
    assert!(page("a.html") == page("scene.html"));
    bench.pliant(["export", "scene.mcap", "--to", "a.html"]).ended_with(2).says(&[
        "a.html exists",
        "`--to`",
        "`--force`",
    ]);
    bench
        .pliant(["export", "scene.mcap", "--to", "b.html", "--frames", "1"])
        .ended_with(2)
        .says(&["--frames"]);
    for to in ["a.gif", "a.stl", "a.xyz"] {
        let ending = &to[1..];
        let message = format!("{to} ends in {ending}, which is no format of exports");
        let possible = "name a file ending in .html, .pvd, .vtu, .obj, .glb, .npz or .csv, or a folder";
        bench.pliant(["export", "scene.mcap", "--to", to]).ended_with(2).says(&[&message, possible]);
    }
    assert_eq!(bench.files(), ["a.html", "scene.html", "scene.mcap"]);
    // A folder that is there may be called anything.
    std::fs::create_dir(bench.path("run.d")).unwrap();
    bench.pliant(["export", "scene.mcap", "--to", "run.d", "--frames", "0"]).succeeded();
}

#[test]
fn a_run_can_end_with_its_page() {
    let bench = Bench::new(SPRING);
    std::fs::write(bench.path("scene.html"), "mine").unwrap();
    bench.pliant(["run", "scene.toml", "--view"]).ended_with(2).says(&["scene.html exists"]);
    assert_eq!(bench.files(), ["scene.html"]);
    let json = bench.pliant(["run", "scene.toml", "--view", "--force", "--json"]).succeeded().json();
    assert_eq!((&json["file"], &json["view"]["page"]), (&"scene.mcap".into(), &"scene.html".into()));
    assert_eq!(json["view"]["frames"].as_u64(), Some(11));
    std::fs::remove_file(bench.path("scene.mcap")).unwrap();
    let run = bench.pliant(["run", "scene.toml"]).succeeded();
    let first = run.stdout.split("opens in\n").nth(1).unwrap().lines().next().unwrap();
    assert!(first.ends_with("pliant view scene.mcap"), "{first}");
}
