//! `pliant stress` and `pliant stability`: what they print, write and return. What they find is tested in
//! the library.

use std::path::Path;

use pliant_lab::stress::CaseFilter;

use super::{Bench, SPRING};

#[test]
fn a_row_of_the_suite_is_a_table_json_csv_and_a_page() {
    let bench = Bench::new(SPRING);
    let ended = bench.pliant(["stress", "--only", "D2,D8", "-o", "out"]).succeeded();
    ended.says(&["wrote stress.html"]);
    let csv = std::fs::read_to_string(bench.path("out/stress.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 + 4, "{csv}");
    assert!(csv.lines().skip(1).all(|line| line.contains(",pass,")), "{csv}");
    let html = std::fs::read_to_string(bench.path("out/stress.html")).unwrap();
    assert!(html.starts_with("<!doctype html>") && html.contains("6 cases: 6 passed"), "{html}");
    let json = bench.pliant(["stress", "--only", "d7", "--quick", "--json"]).succeeded().json();
    assert_eq!((&json["status"], &json["counts"]["pass"]), (&"done".into(), &12.into()));
    assert!(json["cases"][0]["error"].as_f64().unwrap() < 1e-12);
    let markdown =
        bench.pliant(["stress", "--only", "torture", "--materials", "stvk", "--markdown", "page.md"]);
    markdown.succeeded();
    let page = std::fs::read_to_string(bench.path("page.md")).unwrap();
    assert!(
        page.contains("inverted: 72 elements have J <= 0") && page.contains("page/starts-2d.svg"),
        "{page}"
    );
    assert!(bench.path("page/starts-3d.svg").is_file());
}

#[test]
fn long_cases_are_cut_short_by_a_budget_and_taken_from_an_earlier_run() {
    let bench = Bench::new(SPRING);
    let name = "an arch of 25 stones 1 mm apart stands";
    let arguments = ["stress", "--only", name, "--budget", "500 ms", "-o", "out", "--json"];
    let first = bench.pliant(arguments).succeeded().json();
    let case = &first["cases"][0];
    assert_eq!((&case["verdict"], &case["cut_short"]), (&"flagged".into(), &true.into()), "{case}");
    assert!(case["notes"][0].as_str().unwrap().starts_with("cut short: arch with mu = 0.5, sound for "));
    let again = [&arguments[..], &["--resume", "--markdown", "page.md"]].concat();
    let second = bench.pliant(again.clone()).succeeded().json();
    assert_eq!(second["cases"], first["cases"], "the seconds too");
    let page = std::fs::read_to_string(bench.path("page.md")).unwrap();
    assert!(page.contains("Printed by `pliant stress --long --resume -o results --markdown"), "{page}");
    assert!(
        page.contains("Every step must be solved") && page.contains("| worst step | least gap |"),
        "{page}"
    );
    let file = bench.path("out/stress.json");
    let other = std::fs::read_to_string(&file).unwrap().replace("\"commit\": \"", "\"commit\": \"not ");
    std::fs::write(&file, other).unwrap();
    bench.pliant(again).ended_with(1).says(&["stress.json", "they are of commit", "leave out --resume"]);
    bench.pliant(["stress", "--resume"]).ended_with(2).says(&["--output"]);
}

#[test]
fn a_choice_of_nothing_is_a_mistake() {
    let bench = Bench::new(SPRING);
    bench.pliant(["stress", "--only", "D99"]).ended_with(2).says(&["no case is of these rows"]);
    bench
        .pliant(["stability", "scene.toml", "--integrators", "rk5"])
        .ended_with(2)
        .says(&["there is no dynamic integrator `rk5`"]);
}

/// A block of a material that has no inverted states, in steps that are too long for Verlet.
const BLOCK: &str = "dimension = 2
time = { integrator = 'velocity-verlet', step = 0.02, duration = 1.0, allow_unstable = true }
world = { gravity = [0, -9.81] }
[[body]]
mesh = { grid = { cells = [3, 2], spacing = 0.3 } }
elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ half_space = { normal = [1, 0], offset = 0 } }]
";

#[test]
fn a_scene_is_told_what_it_does_not_survive_and_what_would_have_worked() {
    let bench = Bench::new(BLOCK);
    let json = bench.pliant(["stress", "scene.toml", "--json", "--quick"]).ended_with(1).json();
    let cases = json["cases"].as_array().unwrap();
    let of = |name: &str, integrator: &str| {
        cases.iter().find(|c| c["name"] == name && c["integrator"] == integrator).unwrap()
    };
    assert_eq!(of("as it is", "implicit-euler")["verdict"], "pass");
    assert_eq!(of("as it is", "implicit-euler")["step_size"], 0.02);
    assert_eq!(of("100 times the step", "tr-bdf2")["step_size"], 2.0);
    // An explicit scheme does not go in the step of another.
    let limited = &of("100 times the step", "velocity-verlet")["step_size"];
    assert!(limited.as_f64().unwrap() < 0.02, "{limited}");
    // The scene allows a step above the limit: its detection is expected.
    let above = of("as it is", "velocity-verlet");
    assert_eq!(above["verdict"], "flagged");
    let note = above["notes"][0].as_str().unwrap();
    assert!(note.starts_with("above the limit: ") && note.ends_with(", as expected"), "{note}");
    let advice = above["advice"].as_str().unwrap();
    assert!(advice.contains("a step of 1") && advice.contains("implicit-euler"), "{advice}");
    let inverted = of("inverted", "implicit-euler");
    assert_eq!(inverted["verdict"], "flagged");
    assert!(inverted["advice"].as_str().unwrap().contains("the material stable-neo-hookean"), "{inverted}");
    let arguments = ["stress", "scene.toml", "--quick", "--integrators", "implicit-euler"];
    // What is flagged is not said to survive.
    let ended = bench.pliant(arguments).prints(&["implicit-euler, auto: passes ", "; flagged at "]);
    let ended = ended.prints(&["implicit-euler at 20 ms", "implicit-euler at 2 s"]);
    assert!(!ended.stdout.contains("survives everything"), "{}", ended.stdout);
    let nothing = ["stress", "scene.toml", "--quick", "--budget", "1 ns"];
    bench.pliant(nothing).succeeded().says(&[
        "the time budget is used up: ",
        " cases were omitted",
        "--budget",
    ]);
    let arguments = ["stress", "scene.toml", "--quick", "--json", "--solvers", "cg,multigrid"];
    let json = bench.pliant(arguments).json();
    let solvers: Vec<&str> =
        json["cases"].as_array().unwrap().iter().map(|c| c["solver"].as_str().unwrap()).collect();
    assert!(solvers.contains(&"cg") && solvers.contains(&"multigrid"), "{solvers:?}");
    assert!(solvers.iter().all(|s| ["cg", "multigrid"].contains(s)), "{solvers:?}");
    bench
        .pliant(["stress", "--solvers", "lu"])
        .ended_with(2)
        .says(&["the linear solvers are auto, cholesky, cg"]);
}

// A limit is one thing in the list of integrators and in a survey.
#[test]
fn a_scheme_without_a_limit_has_none_in_the_list_and_in_a_survey() {
    let bench = Bench::new(BLOCK);
    bench.pliant(["list", "integrators"]).succeeded().prints(&["none: gains energy at any step"]);
    let arguments = ["stability", "scene.toml", "--quick", "--integrators", "forward-euler"];
    let remark = "forward-euler: none, it gains energy at any step; at ";
    let verdict = "no step is stable (forward-euler): at ";
    let ended = bench.pliant(arguments).succeeded().prints(&[verdict, remark]);
    assert!(ended.stdout.starts_with(verdict), "{}", ended.stdout);
    let row = ended.stdout.lines().find(|line| line.starts_with("forward-euler ")).unwrap();
    assert_eq!(row.split_whitespace().nth(1), Some("none"), "{row}");
    let to_statics = "--set=time.integrator=quasi-static";
    bench.pliant(["stability", "scene.toml", to_statics]).ended_with(2).says(&["quasi-static", "adaptive"]);
}

fn page(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name)).unwrap()
}

// The page is printed by hours of runs; the number of its cases is that of the suite, and no other page has
// one.
#[test]
fn the_page_of_the_suite_has_all_cases_with_verdicts_by_one_definition() {
    let text = page("stress.md");
    let rows: Vec<Vec<&str>> = text
        .lines()
        .filter(|line| line.starts_with("| ") && !line.starts_with("| case "))
        .map(|line| line.split('|').map(str::trim).collect())
        .collect();
    let count = pliant_lab::stress::cases(&CaseFilter { long: true, ..CaseFilter::default() }).len();
    assert_eq!(rows.len(), count);
    let of = |verdict: &str| rows.iter().filter(|row| row[7] == verdict).count();
    let sums =
        format!("{count} cases: {} passed, {} flagged, {} failed", of("pass"), of("flagged"), of("FAIL"));
    assert!(text.contains(&sums), "{sums}");
    for row in &rows {
        let inverted = row[10].parse::<f64>().is_ok_and(|least| least <= 0.0);
        assert!(!inverted || row[7] != "pass", "inverted elements are flagged: {row:?}");
    }
    let compared = page("guide/compared.md");
    let after = compared.split("the robustness suite](../stress.md)").nth(1).unwrap();
    let sentence = after.split('.').next().unwrap();
    assert!(!sentence.contains(|c: char| c.is_ascii_digit()), "{sentence}");
}

// The committed map is what the program draws today: no cell is red below a limit that it does not have.
#[test]
fn the_map_of_the_guide_is_that_of_the_scene() {
    let bench = Bench::new(SPRING);
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/cantilever_fem_2d.toml");
    let scheme = "symplectic-euler";
    let arguments = ["--against", "young", "--integrators", scheme, "--budget", "1 h", "-o", "out"];
    bench.pliant(["stability", scene.to_str().unwrap()].iter().chain(&arguments)).succeeded();
    let drawn = std::fs::read_to_string(bench.path("out/map.svg")).unwrap();
    assert!(drawn == page("stability/map.svg"), "draw docs/stability/map.svg anew: `pliant stability`");
}

#[test]
fn limits_maps_and_charts_are_written() {
    let bench = Bench::new(BLOCK);
    let arguments = ["stability", "scene.toml", "--quick", "--integrators", "velocity-verlet,implicit-euler"];
    let json = bench
        .pliant([&arguments[..], &["--against", "poisson", "-o", "out", "--json"]].concat())
        .succeeded()
        .json();
    let limit = &json["limits"][0];
    let ratio = limit["measured"].as_f64().unwrap() / limit["predicted"].as_f64().unwrap();
    assert!(ratio > 0.5 && ratio < 1.1, "{limit}");
    assert_eq!(json["limits"][1]["predicted"], serde_json::Value::Null);
    assert_eq!(json["map"]["values"].as_array().unwrap().len(), 4);
    for name in
        ["stability.csv", "map.csv", "map.svg", "amplification.svg", "stability.html", "stability.json"]
    {
        assert!(bench.path(&format!("out/{name}")).is_file(), "{name}");
    }
    bench.pliant(arguments).succeeded().prints(&[". stable, x diverged", "measured and formula agree"]);
    // A page with tables, not what a terminal shows.
    let page = std::fs::read_to_string(bench.path("out/stability.html")).unwrap();
    assert!(
        page.contains("<td class=\"text\">velocity-verlet</td>") || page.contains("<td>velocity-verlet</td>")
    );
    assert!(!page.contains("<pre>") && page.contains("name=\"viewport\""), "for phones too");
}
