//! `pliant bench`: what it prints, not how fast anything is.

use serde_json::Value;

use super::{Bench, SPRING};

const ROWS: [&str; 23] = [
    "tet-stable-neo-hookean",
    "tet-corotated",
    "tri-corotated",
    "springs",
    "nbody-direct",
    "svd",
    "autodiff",
    "expression",
    "solve",
    "solve-growth",
    "threads",
    "hessian-stable-neo-hookean",
    "implicit-euler",
    "cloth-implicit",
    "contact-kernels",
    "contact-cloth",
    "contact-bars",
    "contact-stack",
    "contact-bunny",
    "contact-apart",
    "gradient-explicit",
    "gradient-implicit",
    "recording",
];

#[test]
fn an_unknown_row_is_told_the_names_of_all() {
    let bench = Bench::new(SPRING);
    let ended = bench.pliant(["bench", "--row", "svd", "--row", "tet-corotatde"]).ended_with(2);
    ended.says(&["there is no row `tet-corotatde`", &ROWS.join(", ")]);
    let json = bench.pliant(["bench", "--row", "x", "--json"]).ended_with(2).json();
    assert_eq!(json["problems"][0]["kind"], "usage");
}

#[test]
fn rows_are_json_too() {
    let bench = Bench::new(SPRING);
    // In the order of the table, whatever the order of the options.
    let arguments = ["bench", "--quick", "--json", "--row", "svd", "--row", "tri-corotated"];
    let json = bench.pliant(arguments).succeeded().says(&["measuring svd: 512 matrices"]).json();
    let keys: Vec<&String> = json.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["machine", "rows"]);
    assert!(!json["machine"]["processor"].as_str().unwrap().is_empty());
    assert!(json["machine"]["cores"].as_u64().unwrap() >= 1);
    let rows = json["rows"].as_array().unwrap();
    let names: Vec<&Value> = rows.iter().map(|row| &row["name"]).collect();
    assert_eq!(names, ["tri-corotated", "svd"]);
    let [triangles, svd] = [&rows[0], &rows[1]];
    assert_eq!((&triangles["size"], &triangles["unit"]), (&Value::from(114), &Value::from("us/step")));
    assert_eq!((&svd["size"], &svd["unit"], &svd["threads"]), (&512.into(), &"M/s".into(), &1.into()));
    for row in rows {
        let [value, best] = ["value", "best"].map(|key| row[key].as_f64().unwrap());
        // Time is better the less there is of it, a rate the more.
        let ordered = if row["unit"] == "us/step" { best <= value } else { value <= best };
        assert!(value > 0.0 && ordered, "{row}");
        assert!(row["rounds"].as_u64().unwrap() >= 3 && row["reference"]["value"].is_number(), "{row}");
    }
}

#[test]
fn a_table_names_the_machine_and_the_threads() {
    let bench = Bench::new(SPRING);
    let ended = bench.pliant(["bench", "--quick", "--threads", "3", "--row", "tri-corotated"]).succeeded();
    let line = ended.stdout.lines().find(|line| line.contains("20 x 4 vertices")).unwrap();
    // The reference is for one thread, and so there is none here.
    let end: Vec<&str> = line.split_whitespace().rev().take(2).collect();
    assert_eq!(end, ["3", "us/step"], "{line}");
    ended.prints(&["kernels on", "pliant 0.", "tri-corotated"]);
    assert!(bench.files().is_empty());
}

#[cfg(unix)]
#[test]
fn an_interrupted_measurement_prints_the_rows_so_far() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let mut command = Command::new(super::PLIANT);
    command.args(["bench", "--quick", "--json"]);
    // Behind the row that is interrupted there is one that takes seconds to assemble: the signal does not
    // come too late.
    for row in ["tri-corotated", "nbody-direct", "svd", "autodiff"] {
        command.args(["--row", row]);
    }
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    lines.by_ref().find(|line| line.starts_with("measuring nbody-direct")).unwrap();
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert_eq!(lines.last().unwrap(), "interrupted: these are the rows so far");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let names: Vec<&Value> = json["rows"].as_array().unwrap().iter().map(|row| &row["name"]).collect();
    assert_eq!(names[0], "tri-corotated");
    assert!(!names.contains(&&Value::from("autodiff")), "{names:?}");
}
