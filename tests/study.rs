//! Studies of the standard scenes against the verification plan, and the committed report against studies.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, OnceLock};

use pliant::integrator::IntegratorSpec;
use pliant_lab::study::{Provenance, Results, Row, Study, StudyPlan, TimeGrid, WallClock, cheapest, fit};
use pliant_scene::Source;
use tempfile::TempDir;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn source(name: &str) -> Source {
    Source::from_path(root().join(format!("scenes/study/{name}.toml"))).unwrap()
}

fn spec(name: &str) -> IntegratorSpec {
    let mut all = IntegratorSpec::ALL.iter();
    *all.find(|spec| spec.method().documentation.name == name)
        .unwrap_or_else(|| panic!("no scheme is called {name}"))
}

/// References of all tests, so that each is found once.
fn folder() -> &'static Mutex<TempDir> {
    static FOLDER: OnceLock<Mutex<TempDir>> = OnceLock::new();
    FOLDER.get_or_init(|| Mutex::new(TempDir::new().unwrap()))
}

/// A study of these schemes and steps, each run twice: once watched, once timed.
fn study(source: &Source, schemes: &[&str], steps: &[f64]) -> Results {
    let folder = folder().lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let plan = StudyPlan::of(&source.scene().unwrap()).unwrap();
    let contenders = schemes.iter().map(|name| spec(name).into()).collect();
    let plan = StudyPlan {
        contenders,
        steps: steps.to_vec(),
        tolerances: vec![],
        repeats: Some(1),
        axes: vec![],
        ..plan
    };
    made(source, &plan, folder.path())
}

fn made(source: &Source, plan: &StudyPlan, folder: &Path) -> Results {
    let study = Study {
        source,
        name: "standard",
        plan,
        folder: Some(folder),
        provenance: &Provenance::here("", "", ""),
        clock: &WallClock::default(),
        interrupt: &AtomicBool::new(false),
    };
    study.run(&mut |_| {}).unwrap()
}

/// The rms error at the end [m], of a scheme at a step.
fn error_at_end(results: &Results, scheme: &str, step: f64) -> f64 {
    let mut records = results.variants[0].of(scheme);
    let record = records.find(|record| (record.row.dt / step - 1.0).abs() < 1e-9).unwrap();
    assert_eq!(record.row.t_end, record.errors.last().unwrap().time);
    record.errors.last().unwrap().q_rms
}

/// Checks errors at the end of runs in so many steps, which the study has divided by `part`.
fn errors_are(source: &Source, duration: f64, rows: &[(&str, &[(f64, f64)])], part: f64) {
    for (scheme, expected) in rows {
        let steps: Vec<f64> = expected.iter().map(|(count, _)| duration / count).collect();
        let results = study(source, &[scheme], &steps);
        for (count, expected) in *expected {
            let error = error_at_end(&results, scheme, duration / count) / part;
            assert!(
                (error / expected - 1.0).abs() < 0.02,
                "{scheme} in {count} steps: {error:e} instead of {expected:e}"
            );
        }
    }
}

// A2: errors at e = 0.6, t = 10, of independent implementations, to 2 %.
#[test]
fn errors_on_keplers_ellipse_are_those_of_the_plan() {
    let rows: [(&str, &[(f64, f64)]); 8] = [
        ("velocity-verlet", &[(2000.0, 1.952e-3), (4000.0, 4.881e-4)]),
        ("implicit-midpoint", &[(2000.0, 2.592e-3)]),
        ("tr-bdf2", &[(2000.0, 1.481e-3)]),
        ("rk4", &[(500.0, 2.068e-5), (1000.0, 1.113e-6), (2000.0, 6.40e-8)]),
        ("yoshida4", &[(500.0, 3.053e-4), (1000.0, 1.921e-5), (2000.0, 1.203e-6)]),
        ("gauss2", &[(500.0, 5.324e-6), (1000.0, 3.334e-7)]),
        ("sdirk4", &[(500.0, 5.735e-6), (1000.0, 3.303e-7)]),
        ("radau-iia3", &[(200.0, 3.386e-5), (400.0, 1.064e-6), (800.0, 3.324e-8)]),
    ];
    errors_are(&source("kepler"), 10.0, &rows, 1.0);
}

// C13 W1: mass-weighted rms errors at t = 1 of independent implementations on an independent finite element
// code.
#[test]
fn errors_of_the_beam_are_those_of_the_plan() {
    let rows: [(&str, &[(f64, f64)]); 7] = [
        ("velocity-verlet", &[(200.0, 8.83e-5), (400.0, 2.196e-5), (800.0, 5.477e-6)]),
        ("symplectic-euler", &[(200.0, 2.09e-3)]),
        ("yoshida4", &[(200.0, 1.06e-5), (400.0, 7.2e-7)]),
        ("rk4", &[(100.0, 1.53e-5), (200.0, 1.36e-6), (400.0, 8.86e-8)]),
        ("implicit-midpoint", &[(50.0, 2.319e-3), (100.0, 6.475e-4), (200.0, 1.715e-4)]),
        ("tr-bdf2", &[(25.0, 3.60e-3), (50.0, 1.148e-3), (100.0, 3.19e-4)]),
        ("sdirk4", &[(25.0, 2.45e-4), (50.0, 2.86e-5)]),
    ];
    // Those are over all coordinates, of which each vertex has two.
    errors_are(&source("beam"), 1.0, &rows, 2f64.sqrt());
}

/// Where a vertex is in the reference after `duration`, and how well that is known, relative.
fn reference(name: &str, duration: f64, vertex: usize) -> (Vec<f64>, f64) {
    let duration = ("time.duration".to_owned(), format!("{duration:?}"));
    let source = source(name).with_overrides(&[duration]).unwrap();
    let scene = source.scene().unwrap();
    let results = study(&source, &["implicit-euler"], &[scene.time.duration / 25.0]);
    let reference = &results.variants[0].reference;
    let place = &reference.trajectory.x.last().unwrap()[scene.dimension * vertex..][..scene.dimension];
    (place.to_vec(), reference.error)
}

/// Name, time, vertex, place, how well tests/verification.md knows it [m], how well the reference is to know
/// itself.
type Case<'a> = (&'a str, f64, usize, &'a [f64], f64, f64);

// A2, A5, C13: closed forms and references of other codes.
#[test]
fn references_of_the_cheap_standard_scenes_are_those_of_the_plan() {
    let cases: [Case<'_>; 5] = [
        ("kepler", 10.0, 1, &[-1.535_023_591_909_813_7, -0.283_668_406_499_780_86], 1e-13, 1e-13),
        ("chain", 1.0, 1, &[4.0 - 0.476_280_915_542_335_7, 0.0], 1e-12, 1e-12),
        ("stiff_chain", 0.1, 1, &[4.0 + 0.420_847_075_767_715_3, 0.0], 1e-12, 1e-11),
        ("beam", 1.0, 26, &[4.0 - 1.100_354_095_79, 1.0 - 3.429_259_839_75], 2e-11, 1e-11),
        (
            "twisted_bar",
            1.0,
            19,
            &[1.0 + 0.070_522_510_311_9, 1.0 - 0.079_217_193_69, 4.0 + 1.652_013e-5],
            2e-11,
            1e-11,
        ),
    ];
    for (name, duration, vertex, expected, tolerance, known) in cases {
        let (place, error) = reference(name, duration, vertex);
        assert!(error <= known, "{name}: known to {error:e}");
        for (x, expected) in place.iter().zip(expected) {
            assert!((x - expected).abs() <= tolerance, "{name}: {place:?} instead of {expected}");
        }
    }
}

/// Cells of a table by the name of their column.
fn committed() -> Vec<HashMap<String, String>> {
    let text = std::fs::read_to_string(root().join("docs/accuracy/rows.csv")).unwrap();
    let mut lines = text.lines();
    let header = cells(lines.next().unwrap());
    lines.map(|line| header.iter().cloned().zip(cells(line)).collect()).collect()
}

fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (vec![], String::new(), false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(std::mem::take(&mut cell)),
            c => cell.push(c),
        }
    }
    cells.push(cell);
    cells
}

/// The committed rows as a study has them.
fn committed_rows() -> Vec<Row> {
    const TEXTS: [&str; 16] = [
        "case",
        "commit",
        "host",
        "cpu",
        "rustc",
        "flags",
        "precision",
        "element",
        "material",
        "mass",
        "integrator",
        "lin_solver",
        "ref_id",
        "status",
        "variant",
        "message",
    ];
    let value = |(name, cell): (String, String)| {
        let value = match &cell[..] {
            "" if name != "material" && name != "variant" => serde_json::Value::Null,
            text if TEXTS.contains(&&name[..]) => text.into(),
            number => serde_json::from_str(number).unwrap(),
        };
        (name, value)
    };
    let row = |cells: HashMap<String, String>| {
        serde_json::from_value(serde_json::Value::Object(cells.into_iter().map(value).collect())).unwrap()
    };
    committed().into_iter().map(row).collect()
}

/// What the guide to integrators prints of the report: the fastest at each error, and an order that stiffness
/// reduces.
fn fastest_of_the_report() -> String {
    let rows = committed_rows();
    let mut problems: Vec<[&str; 2]> = vec![];
    for row in &rows {
        let problem = [row.case.as_str(), row.material.as_str()];
        if !problems.contains(&problem) {
            problems.push(problem);
        }
    }
    let implicit = |name: &str| spec(name.trim_end_matches(" (adaptive)")).method().documentation.solves > 0;
    let mut out = String::from("| problem | coordinates | 10 % | 1 % | 0.1 % | 0.01 % | 1e-6 | 1e-8 |\n");
    out += "|---|--:|---|---|---|---|---|---|\n";
    let (mut explicit, mut all) = (0, 0);
    for [case, material] in problems {
        let of = || rows.iter().filter(move |row| row.case == case && row.material == material);
        let name = if material.is_empty() { case.to_owned() } else { format!("{case}, {material}") };
        out += &format!("| {name} | {} |", of().next().unwrap().ndof);
        for error in [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8] {
            out += &match cheapest(of(), error).map(|row| row.integrator.as_str()) {
                Some(name) if implicit(name) => format!(" **{name}** |"),
                Some(name) => format!(" {name} |"),
                None => " - |".to_owned(),
            };
            all += usize::from(cheapest(of(), error).is_some());
            explicit += usize::from(cheapest(of(), error).is_some_and(|row| !implicit(&row.integrator)));
        }
        out.push('\n');
    }
    out +=
        &format!("\nAn explicit integrator is the fastest in {explicit} of {all} entries, in bold are the");
    let order = |case: &str| {
        let of = rows.iter().filter(|row| row.case == case && row.integrator == "radau-iia3");
        format!("{:.1} on `{case}`", fit(of).unwrap())
    };
    let [beam, chain, pendulum] = ["stiff_beam", "stiff_chain", "stiff_pendulum"].map(order);
    out + &format!(
        " others.\nThe observed order of `radau-iia3`, 5 in theory, is {beam}, {chain},\n{pendulum}.\n"
    )
}

// The guide advises by what was measured: its table is the committed report's.
#[test]
fn the_guide_to_integrators_says_what_the_report_measured() {
    let page = std::fs::read_to_string(root().join("docs/guide/how-to/integrator.md")).unwrap();
    let measured = fastest_of_the_report();
    assert!(page.contains(&measured), "integrator.md has to say:\n{measured}");
}

/// How much a row may cost to be computed again: evaluations of the force and, ten times as much each,
/// Newton iterations, as they are recorded. The dearest take a fifth of a second.
const CHEAP: f64 = 40_000.0;

/// Computes those rows of a standard case again that are cheap, of every scheme, at the committed times of
/// comparison. Returns how many errors were compared.
fn holds(name: &str) -> usize {
    let rows = committed();
    let number = |row: &HashMap<String, String>, key: &str| row[key].parse::<f64>().ok();
    let cheap = |row: &&HashMap<String, String>| {
        let cost = number(row, "n_force").unwrap() + 10.0 * number(row, "n_newton").unwrap();
        // Steps that follow the error are of sizes that small changes decide.
        row["case"] == name && row["tol"].is_empty() && cost <= CHEAP
    };
    let mut runs: Vec<[&str; 2]> = vec![];
    for row in rows.iter().filter(cheap) {
        let run = [row["variant"].as_str(), row["integrator"].as_str()];
        if !runs.contains(&run) {
            runs.push(run);
        }
    }
    let folder = references();
    let (mut compared, mut schemes) = (0, vec![]);
    for [variant, scheme] in runs {
        let rows: Vec<_> = rows
            .iter()
            .filter(cheap)
            .filter(|row| [row["variant"].as_str(), row["integrator"].as_str()] == [variant, scheme])
            .collect();
        let changes = variant.split("; ").filter_map(|change| change.split_once('='));
        let changes: Vec<(String, String)> = changes.map(|(k, v)| (k.into(), v.into())).collect();
        let source = source(name).varied(&changes).unwrap();
        let scene = source.scene().unwrap();
        let plan = StudyPlan::of(&scene).unwrap();
        let plan = StudyPlan {
            contenders: vec![spec(scheme.trim_end_matches(" (adaptive)")).into()],
            times: TimeGrid::new(scene.time.duration, plan.times, &plan.steps).times,
            steps: rows
                .iter()
                .filter(|row| row["tol"].is_empty())
                .filter_map(|row| number(row, "dt"))
                .collect(),
            tolerances: rows.iter().filter_map(|row| number(row, "tol")).collect(),
            axes: vec![],
            repeats: Some(0),
            ..plan
        };
        let results = made(&source, &plan, folder.path());
        let found: Vec<_> = results.rows().collect();
        assert_eq!(found.len(), rows.len(), "{name}, {scheme}");
        for row in rows {
            let what = format!("{name}, {variant}, {scheme} at {} s, tolerance {}", row["dt"], row["tol"]);
            let same = |found: &&&Row| match number(row, "tol") {
                Some(_) => found.tol == number(row, "tol"),
                None => (number(row, "dt").unwrap() / found.dt - 1.0).abs() < 1e-9,
            };
            compared += compare(row, found.iter().find(same).unwrap(), &what);
            schemes.extend((row["status"] == "ok" && !schemes.contains(&scheme)).then_some(scheme));
        }
    }
    let all: std::collections::HashSet<_> =
        rows.iter().filter(|row| row["case"] == name).map(|row| row["integrator"].as_str()).collect();
    assert!(all.len() >= 10, "{name}: {all:?}");
    assert!(schemes.len() >= 8, "{name}: only {schemes:?} have rows that are cheap");
    compared
}

/// Compares the errors of a row with those committed; how many there are.
fn compare(committed: &HashMap<String, String>, row: &Row, what: &str) -> usize {
    let status = serde_json::to_value(row.status).unwrap();
    assert_eq!(committed["status"], status.as_str().unwrap(), "{what}");
    // The reference itself is known to so much.
    let slack = 2.0 * row.ref_err;
    let columns = [
        ("err_q_rms", row.err_q_rms),
        ("err_q_max", row.err_q_max),
        ("err_v_rms", row.err_v_rms),
        ("err_energy_max", row.err_energy_max),
        ("err_momentum", row.err_momentum),
        ("err_angmom", row.err_angmom),
    ];
    let mut compared = 0;
    for (column, value) in columns {
        match (committed[column].parse::<f64>().ok(), value) {
            (None, None) => {}
            (Some(old), Some(new)) => {
                assert!((old - new).abs() <= 1e-6 * old + slack, "{what}: {column} {new:e}, was {old:e}");
                compared += 1;
            }
            (old, new) => panic!("{what}: {column} is {new:?}, was {old:?}"),
        }
    }
    compared
}

/// A folder with the references that are committed beside the report: those of stiff scenes take half a
/// minute.
fn references() -> TempDir {
    let folder = TempDir::new().unwrap();
    for entry in std::fs::read_dir(root().join("docs/accuracy")).unwrap().flatten() {
        let name = entry.file_name().into_string().unwrap();
        if name.starts_with("reference-") {
            std::fs::copy(entry.path(), folder.path().join(name)).unwrap();
        }
    }
    folder
}

// E: error columns hold to 1e-6 relative; times are those of a machine. The cases are those that E lists,
// two of them with a stiff twin.
macro_rules! the_committed_report_holds {
    ($($test:ident: $case:literal, $least:literal;)*) => {
        $(
            #[test]
            fn $test() {
                let compared = holds($case);
                assert!(compared >= $least, "{compared} errors compared");
            }
        )*

        #[test]
        fn every_standard_case_is_in_the_report_and_checked() {
            let mut checked = vec![$($case),*];
            checked.sort_unstable();
            let mut scenes: Vec<String> = std::fs::read_dir(root().join("scenes/study"))
                .unwrap()
                .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
                .collect();
            scenes.sort();
            assert_eq!(scenes, checked);
        }
    };
}

the_committed_report_holds! {
    the_report_on_keplers_ellipse_holds: "kepler", 100;
    the_report_on_the_chain_holds: "chain", 100;
    the_report_on_the_stiff_chain_holds: "stiff_chain", 100;
    the_report_on_the_stiff_pendulum_holds: "stiff_pendulum", 50;
    the_report_on_the_beam_holds: "beam", 200;
    the_report_on_the_stiff_beam_holds: "stiff_beam", 100;
    the_report_on_the_twisted_bar_holds: "twisted_bar", 100;
    the_report_on_the_impact_holds: "impact", 100;
}

// A6, C13: what the committed references of stiff scenes say, by other codes; the beam's is known to eight
// digits.
#[test]
fn references_of_the_stiff_standard_scenes_are_those_of_the_plan() {
    let cases: [(&str, usize, &[f64], f64); 2] = [
        ("stiff_pendulum", 1, &[-0.606_892_974_040_2, -0.794_806_384_269_31], 1e-10),
        ("stiff_beam", 26, &[4.0 + 2.047_497_4e-4, 1.0 - 2.448_129_8e-4], 1e-11),
    ];
    for (name, vertex, expected, tolerance) in cases {
        let source = source(name);
        let scene = source.scene().unwrap();
        let plan = StudyPlan::of(&scene).unwrap();
        let step = vec![scene.time.duration / 250.0];
        let times = TimeGrid::new(scene.time.duration, plan.times, &plan.steps).times;
        let plan = StudyPlan {
            contenders: vec![spec("implicit-euler").into()],
            times,
            steps: step,
            tolerances: vec![],
            repeats: Some(0),
            ..plan
        };
        let folder = references();
        let files = || {
            std::fs::read_dir(folder.path())
                .unwrap()
                .filter(|entry| {
                    entry.as_ref().unwrap().file_name().to_string_lossy().starts_with("reference-")
                })
                .count()
        };
        let committed = files();
        let results = made(&source, &plan, folder.path());
        assert_eq!(files(), committed, "{name}: the committed reference has another name");
        let reference = &results.variants[0].reference;
        let place = &reference.trajectory.x.last().unwrap()[scene.dimension * vertex..];
        for (x, expected) in place.iter().zip(expected) {
            assert!((x - expected).abs() <= tolerance, "{name}: {x} instead of {expected}");
        }
    }
}

#[test]
fn every_chart_of_the_committed_page_is_there_and_no_other() {
    let page = std::fs::read_to_string(root().join("docs/accuracy.md")).unwrap();
    let mut named: Vec<&str> =
        page.split("](accuracy/").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    named.sort_unstable();
    let folder = std::fs::read_dir(root().join("docs/accuracy")).unwrap();
    let mut there: Vec<String> =
        folder.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    there.retain(|name| name.ends_with(".svg"));
    there.sort();
    assert_eq!(named, there);
    assert!(there.len() >= 16, "two for each standard case: {there:?}");
}
