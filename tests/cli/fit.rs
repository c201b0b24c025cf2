//! `pliant fit`: what it prints, writes and returns. What it finds is tested in the library.

use super::{Bench, SPRING};

/// A beam that falls and swings, and its tip.
const BEAM: &str = r#"
dimension = 2
[time]
integrator = "implicit-euler"
step = "10 ms"
duration = "0.3 s"
solver = { tolerance = 1e-12 }
[world]
gravity = [0, -9.81]
[output]
rate = 50
[[body]]
name = "beam"
mesh = { grid = { cells = [4, 1], size = [0.4, 0.1] } }
elastic = { neo-hookean = { young = "50 kPa", poisson = 0.3 } } # of the sheet
mass = { density = 1000 }
pin = [{ half_space = { normal = [1, 0], offset = 0 } }]
[[probe]]
name = "tip"
vertex = 9
"#;

const KEYS: &str = "body.beam.elastic.young,body.beam.elastic.poisson";
/// Other values than those that were filmed.
const AWAY: &str = "body.0.elastic.neo-hookean={ young = 80e3, poisson = 0.2 }";

/// A folder with the film of the beam.
fn filmed() -> Bench {
    let bench = Bench::new(BEAM);
    bench.pliant(["run", "scene.toml", "--no-record", "--probes", "film.csv"]).succeeded();
    bench
}

#[test]
fn a_film_of_a_beam_gives_its_constants_a_plot_and_a_scene() {
    let bench = filmed();
    let fit = ["fit", "scene.toml", "--to", "film.csv", "--set", AWAY, "--parameters", KEYS];
    let outputs = ["-o", "fit.svg", "--fitted", "fitted.toml"];
    let ended = bench.pliant(fit.into_iter().chain(outputs)).succeeded();
    ended
        .prints(&[
            "body.0.elastic.neo-hookean.young ",
            "2 parameters fitted to 64 numbers of film.csv",
            "[[body]] # number 0\nelastic = { neo-hookean = { poisson = 0.",
            "correlation of",
        ])
        .says(&["warning: columns not used, since the positions imply them: tip.ux, tip.uy", "fitted.toml"]);
    let svg = std::fs::read_to_string(bench.path("fit.svg")).unwrap();
    assert!(roxmltree::Document::parse(&svg).is_ok() && svg.contains("tip.y, measured"));
    let scene = std::fs::read_to_string(bench.path("fitted.toml")).unwrap();
    assert!(scene.contains("# of the sheet"), "comments stay: {scene}");
    bench.pliant(["check", "fitted.toml"]).succeeded();

    bench.pliant(fit.into_iter().chain(outputs)).ended_with(2).says(&["fit.svg exists", "--force"]);
    let json = bench.pliant(fit.into_iter().chain(["--json"])).succeeded().json();
    assert_eq!((json["status"].as_str(), json["measured"].as_u64()), (Some("done"), Some(64)));
    for (i, (expected, start)) in [(50e3, 80e3), (0.3, 0.2)].into_iter().enumerate() {
        let parameter = &json["parameters"][i];
        assert_eq!(parameter["start"].as_f64(), Some(start));
        let value = parameter["value"].as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < 1e-6, "{value}, not {expected}");
        assert!(parameter["standard_deviation"].as_f64().unwrap() < 1e-6 * expected);
    }
}

#[test]
fn curves_of_rubber_take_forces_and_displacements() {
    let bench = Bench::new(BEAM);
    // Hooke's law at small strains: E = 40 kPa, of a piece of 2 cm with 4 mm^2.
    let rows: String =
        (1..=5).map(|i| format!("{},{}\n", 0.002 * f64::from(i), 16e-6 * f64::from(i))).collect();
    std::fs::write(bench.path("pull.csv"), format!("displacement [mm],uniaxial [N]\n{rows}")).unwrap();
    let fit = ["fit", "scene.toml", "--to", "pull.csv", "--parameters", "body.0.elastic.young"];
    bench.pliant(fit).ended_with(2).says(&["pull.csv", "--length"]);
    let json = bench
        .pliant(fit.into_iter().chain(["--length", "2cm", "--area", "4 mm^2", "--json"]))
        .succeeded()
        .json();
    let young = json["parameters"][0]["value"].as_f64().unwrap();
    assert!((young / 40e3 - 1.0).abs() < 2e-3, "{young}");
    assert_eq!(json["axis"].as_str(), Some("stretch"));
}

#[test]
fn mistakes_end_with_2_and_say_what_would_be_right() {
    let bench = filmed();
    let fit = |more: &[&str]| {
        let arguments = ["fit", "scene.toml"].into_iter().chain(more.iter().copied());
        bench.pliant(arguments).ended_with(2)
    };
    fit(&["--to", "film.csv", "--parameters", "body.0.elastic.yuong"]).says(&[
        "`body.0.elastic.yuong`",
        "these can be fitted: ",
        "body.0.elastic.young,",
    ]);
    fit(&["--to", "none.csv", "--parameters", KEYS]).says(&["cannot read none.csv"]);
    fit(&["--to", "film.csv"]).says(&["--parameters"]);
    fit(&["--to", "film.csv", "--parameters", KEYS, "--bounds", "body.0.elastic.young=1"])
        .says(&["KEY=LOW..HIGH"]);
    fit(&["--to", "film.csv", "--parameters", KEYS, "-o", "scene.toml"]).says(&["scene.toml is an input"]);
    fit(&["--to", "film.csv", "--parameters", KEYS, "-o", "fit.pdf"]).says(&["must end in .svg"]);
    let json = fit(&["--to", "film.csv", "--parameters", "time.integrator", "--json"]).json();
    assert_eq!(json["problems"][0]["kind"].as_str(), Some("usage"));
    assert_eq!(bench.files(), ["film.csv"]);
    // Without a probe there is nothing that a film could be of.
    let bench = Bench::new(SPRING);
    std::fs::write(bench.path("film.csv"), "time [s],tip.x [m]\n0.1,1\n0.2,1\n").unwrap();
    let arguments = ["fit", "scene.toml", "--to", "film.csv", "--parameters", "body.0.springs.stiffness"];
    bench.pliant(arguments).ended_with(2).says(&["no [[probe]]"]);
}

#[test]
fn a_run_that_fails_from_the_start_ends_with_1() {
    let bench = filmed();
    let impossible = "time.solver={ tolerance = 1e-12, iterations = 1, retries = 0 }";
    let fit = ["fit", "scene.toml", "--to", "film.csv", "--parameters", KEYS, "--set", impossible];
    bench.pliant(fit).ended_with(1).says(&["there is nothing to compare with"]);
}
