//! `pliant study`.

use std::path::Path;

use super::{Bench, SPRING};

const STUDY: [&str; 6] =
    ["study", "scene.toml", "--integrators", "velocity-verlet,rk4", "--steps", "10ms,5 ms"];

#[test]
fn a_study_leaves_a_table_charts_and_reports_and_says_what_to_take() {
    let bench = Bench::new(SPRING);
    let ended = bench.pliant(STUDY.iter().chain(&["--repeats", "2", "-o", "out", "--json"])).succeeded();
    let document = ended.json();
    assert_eq!(document["status"], "done");
    let rows = document["studies"][0]["variants"][0]["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    assert_eq!(rows[0]["row"]["integrator"], "velocity-verlet");
    assert_eq!(rows[0]["row"]["repeats"], 2);
    assert!(rows[1]["row"]["obs_order"].as_f64().unwrap() > 1.9);
    let read = |name: &str| std::fs::read_to_string(bench.path("out").join(name)).unwrap();
    let table = read("rows.csv");
    assert_eq!(table.lines().count(), 5);
    assert!(table.starts_with("schema,case,commit,"));
    let page = read("report.md");
    assert!(page.contains("error in time, on this mesh"), "{page}");
    // Of the whole build: the level of one crate says nothing about the kernels.
    assert!(page.contains("dev profile") && !page.contains("-O"), "{page}");
    let in_checkout = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.git").exists();
    assert!(!in_checkout || !page.contains("commit unknown"), "{page}");
    assert!(page.contains("![") && page.contains("scene-time.svg"), "{page}");
    assert!(page.trim_end().ends_with("```"), "the recommendation is last");
    assert!(page.contains("[time]\nintegrator = \""), "{page}");
    assert!(read("report.html").contains("<svg"));
    for chart in ["time", "step", "forces", "energy"] {
        assert!(read(&format!("scene-{chart}.svg")).contains("velocity-verlet"), "{chart}");
    }
    // The same again takes the rows that are there: their times are the same to the last digit.
    bench.pliant(STUDY.iter().chain(&["--repeats", "2", "-o", "out"])).succeeded().prints(&[
        "velocity-verlet",
        "for 1 % error take",
        "report.html",
    ]);
    assert_eq!(read("rows.csv"), table);
}

#[test]
fn a_study_that_makes_no_sense_is_refused_with_what_would_be_right() {
    let bench = Bench::new(SPRING);
    let study = |more: &[&str]| bench.pliant(["study", "scene.toml"].iter().chain(more)).ended_with(2);
    study(&["--integrators", "rk5"]).says(&["unknown choice `rk5`", "rk4"]);
    study(&["--integrators", "quasi-static"]).says(&["no order"]);
    let to_statics = "--set=time.integrator=quasi-static";
    study(&[to_statics, "--integrators", "rk4"]).says(&["quasi-static", "--set time.integrator="]);
    study(&["--steps=-1"]).says(&["must be positive"]);
    study(&["--times", "5"]).says(&["must be 20 or more"]);
    study(&["--budget", "soon"]).says(&["it must be a time"]);
    study(&["--vary", "body.0.mass"]).says(&["gives no values"]);
    study(&["--vary", "body.3.order=1,2", "--steps", "0.01"]).says(&["there is no `body.3`"]);
    // What a study compares anyway is not varied.
    study(&["--vary", "time.integrator=rk4,bdf2"]).says(&["`time.integrator` is what", "by `--integrators`"]);
    study(&["--vary", "time.step=0.01,0.02"]).says(&["by `--steps`"]);
    study(&["--vary", "time.adaptive.tolerance=1e-3,1e-4"]).says(&["by `--tolerances`"]);
    let pinned = "--set=body.0.position={ affine = { matrix = [[1.0, 0.1], [0.0, 1.0]] } }";
    study(&[
        "--reference",
        "exact",
        "--steps",
        "0.01",
        pinned,
        "--set",
        "world.gravity=[0, -1]",
        "--set",
        "body.0.pin=[{ vertices = [0] }]",
    ])
    .says(&["no exact solution"]);
}

#[test]
fn whoever_reads_of_errors_is_told_that_they_are_errors_in_time() {
    let sentence = "error in time, on this mesh";
    Bench::new(SPRING).pliant(["study", "--help"]).succeeded().prints(&[sentence]);
    for page in ["accuracy.md", "scene-format.md", "guide/commands.md", "guide/how-to/integrator.md"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(page);
        let text = std::fs::read_to_string(path).unwrap().replace('\n', " ").replace("errors in", "error in");
        assert!(text.contains(sentence), "{page}");
    }
}

/// A beam that falls for a tenth of a second, with a probe.
const FALLING: &str = r#"dimension = 2
time = { integrator = "velocity-verlet", step = 1e-3, duration = 0.2 }
world = { gravity = [0.0, -9.81] }
[[body]]
mesh = { grid = { cells = [4, 2], size = [4.0, 1.0] } }
elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ name = "left", half_space = { normal = [1.0, 0.0], offset = 0.0 } }]
[[probe]]
name = "tip"
at = [4.0, 0.5]
"#;

#[test]
fn refinement_answers_first_and_in_few_lines() {
    let bench = Bench::new(FALLING);
    let arguments = ["study", "scene.toml", "--refine", "--of", "tip.y", "--integrators", "velocity-verlet"];
    let done = bench.pliant(arguments).succeeded();
    let said = &done.stdout;
    assert!(said.lines().count() <= 24, "{said}");
    assert!(said.lines().all(|line| line.chars().count() <= 100), "{said}");
    for words in ["tip.y: -0.", "+-", "error below", "10 %", "observed orders", "scene-study/report.html"] {
        assert!(said.contains(words), "{words} is missing:\n{said}");
    }
    let read = |name: &str| std::fs::read_to_string(bench.path(name)).unwrap();
    let report = read("scene-study/report.html");
    assert!(report.contains("<svg") && report.contains("body.0.mesh.grid.cells=["), "{report}");
    let document: serde_json::Value = serde_json::from_str(&read("scene-study/study.json")).unwrap();
    let of = &document["refinement"]["quantities"][0];
    assert!(of["reference"]["agrees"].as_bool().unwrap(), "{of}");
    // What does not go together, and what is none.
    bench.pliant(["study", "scene.toml", "--of", "tip.y"]).ended_with(2).says(&["--refine"]);
    bench.pliant(["study", "scene.toml", "--refine", "--of", "top.y"]).ended_with(2).says(&["`top.y`"]);
    let cubic = ["study", "scene.toml", "--refine", "--elements", "cubic"];
    bench.pliant(cubic).ended_with(2).says(&["`cubic`", "quadratic-quadrilateral"]);
}

#[test]
fn an_accuracy_is_solved_for_and_proved() {
    let bench = Bench::new(&format!("{FALLING}\n[accuracy]\nof = \"tip.y\"\nerror = \"5 %\"\n"));
    let said = bench.pliant(["solve", "scene.toml"]).succeeded().stdout;
    assert!(said.contains("is kept") && said.contains("pliant run scene.toml"), "{said}");
    // The command that it prints is one.
    let command = said.split("pliant run ").nth(1).unwrap().replace('\\', "");
    let words: Vec<String> =
        command.split_whitespace().map(|word| word.trim_matches('\'').to_owned()).collect();
    let joined = words.join(" ").replace(", ", ",");
    let mut arguments = vec!["run"];
    arguments.extend(joined.split_whitespace());
    arguments.push("--quiet");
    bench.pliant(arguments).succeeded();
    let wish = ["solve", "scene.toml", "--accuracy", "5 pounds", "--of", "tip.y"];
    bench.pliant(wish).ended_with(2).says(&["`5 pounds`", "1 %"]);
    let never = ["solve", "scene.toml", "--accuracy", "1e-9", "--of", "tip.y", "--budget", "1ms"];
    bench.pliant(never).ended_with(1).says(&["not reached"]);
    let plain = Bench::new(FALLING);
    plain.pliant(["solve", "scene.toml"]).ended_with(2).says(&["--accuracy"]);
}
