//! What a run says of surfaces that touch.

use super::Bench;

/// A block of rubber that falls on a floor.
const DROP: &str = r#"
dimension = 2
[time]
integrator = "implicit-euler"
step = 5e-3
duration = 0.3
[world]
gravity = [0.0, -9.81]
[contact]
distance = "1 mm"
stiffness = "1 MPa"
friction = 0.3
[[body]]
name = "block"
mesh = { grid = { cells = [2, 2], size = [0.1, 0.1], origin = [0.0, 0.05] } }
elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
mass = { density = 1000.0 }
velocity = { rigid = { linear = [0.4, 0.0] } }
[[obstacle]]
name = "floor"
shape = { half_space = { normal = [0.0, 1.0], offset = 0.0 } }
[output]
rate = 200.0
channels = ["state", "energy", "contacts"]
"#;

#[test]
fn a_run_ends_with_the_least_gap_and_what_friction_took() {
    let bench = Bench::new(DROP);
    let ended = bench.pliant(["run", "scene.toml", "--json"]).succeeded();
    let summary = ended.json()["summary"].clone();
    let least = &summary["least_gap"];
    let relative = least["relative"].as_f64().unwrap();
    assert!((0.05..1.0).contains(&relative), "{least}");
    assert!((least["gap"].as_f64().unwrap() - 1e-3 * relative).abs() < 1e-12, "{least}");
    assert_eq!(least["bodies"], serde_json::json!(["block", "floor"]));
    // Three vertices of a side, once it lies.
    assert_eq!(least["most"].as_u64(), Some(3), "{least}");
    // That of the steps, whichever of them are recorded.
    let seldom = DROP.replace("rate = 200.0", "rate = 5.0");
    let seldom = Bench::new(&seldom).pliant(["run", "scene.toml", "--json"]).succeeded().json();
    assert_eq!(seldom["summary"]["least_gap"], *least);
    let ended = bench.pliant(["run", "scene.toml", "--force"]).succeeded();
    ended.prints(&["contact   least gap ", " between block and floor at t = ", "J to friction"]);
    let info = bench.pliant(["info", "scene.mcap"]).succeeded();
    info.prints(&["/contacts ", "pliant.Contacts"]);
}

#[test]
fn contact_that_is_far_too_soft_is_warned_of_with_what_would_do() {
    let soft = DROP.replace("1 MPa", "5 Pa");
    let bench = Bench::new(&soft);
    let ended = bench.pliant(["run", "scene.toml", "--json"]).succeeded();
    let document = ended.json();
    let warnings = document["warnings"].to_string();
    assert!(warnings.contains("contact of `block` and `floor` was pressed to"), "{warnings}");
    let advised: f64 = warnings
        .split("a `stiffness` of ")
        .nth(1)
        .and_then(|rest| rest.split(" Pa").next())
        .and_then(|number| number.parse().ok())
        .unwrap();
    let better = soft.replace("5 Pa", &format!("{advised} Pa"));
    let relative = Bench::new(&better).pliant(["run", "scene.toml", "--json"]).succeeded().json()["summary"]
        ["least_gap"]["relative"]
        .as_f64()
        .unwrap();
    assert!((0.1..0.9).contains(&relative), "with {advised} Pa: {relative}");
}

/// Noted at checkpoints: what a run that goes on says is what it would have said.
#[test]
fn the_least_gap_survives_an_interruption() {
    // Solvers forget at checkpoints.
    let always = ["--checkpoint", "1e-9", "--json"];
    let whole = Bench::new(DROP).pliant([&["run", "scene.toml"][..], &always].concat()).succeeded().json();
    let bench = Bench::new(DROP);
    bench.pliant(["run", "scene.toml", "--until", "0.2", "--checkpoint", "1e-9"]).succeeded();
    let rest = bench.pliant(["resume", "scene.checkpoint", "--until", "0.3", "--json"]).succeeded().json();
    assert_eq!(rest["summary"]["least_gap"], whole["summary"]["least_gap"]);
    assert!(whole["summary"]["least_gap"]["time"].as_f64().unwrap() < 0.2, "{whole}");
}

#[test]
fn contacts_are_not_recorded_where_nothing_touches() {
    let without = DROP.split("[contact]").next().unwrap().to_owned()
        + &format!(
            "[[body]]{}",
            DROP.split("[[body]]").nth(1).unwrap().split("[[obstacle]]").next().unwrap()
        )
        + "[output]\nrate = 20.0\nchannels = [\"contacts\"]\n";
    let ended = Bench::new(&without).pliant(["check", "scene.toml"]).ended_with(2);
    ended.says(&["channel `contacts` is about surfaces that touch, and the scene has no `[contact]`"]);
}

/// Explicit steps stop what is slow enough for the stiffness, and say what was not.
#[test]
fn an_explicit_run_says_its_hardest_approach_and_how_deep_it_went() {
    let explicit = DROP.replace("implicit-euler", "velocity-verlet").replace("5e-3", "1e-4");
    let stiff = explicit.replace("1 MPa", "0.1 MPa");
    let bench = Bench::new(&stiff);
    let checked = bench.pliant(["check", "scene.toml", "--json"]).succeeded().json();
    let explicit_contact = &checked["report"]["contact"]["explicit"];
    assert_eq!(explicit_contact["raises_threshold"], true, "{explicit_contact}");
    bench
        .pliant(["check", "scene.toml"])
        .succeeded()
        .prints(&["forces without a pole", "stop approaches up to"]);
    let document = bench.pliant(["run", "scene.toml", "--json"]).succeeded().json();
    let summary = &document["summary"];
    assert_eq!(summary["deepest_contact"], serde_json::Value::Null, "{summary}");
    let hardest = &summary["hardest_approach"];
    let (speed, stopped) = (hardest["speed"].as_f64().unwrap(), hardest["stopped"].as_f64().unwrap());
    // From 5 cm 0.98 m/s, and what the rest of the block stores in the contact of its lower vertices.
    assert!((0.98..2.0 * 0.98).contains(&speed) && speed < stopped, "{hardest}");
    assert_eq!(hardest["bodies"], serde_json::json!(["block", "floor"]));
    let bench = Bench::new(&explicit.replace("1 MPa", "5 kPa"));
    let document = bench.pliant(["run", "scene.toml", "--json"]).succeeded().json();
    let deepest = &document["summary"]["deepest_contact"];
    let depth = deepest["depth"].as_f64().unwrap();
    // The cubic law without an end: 5 mm at most, where it holds the weight and the fall.
    assert!((1e-5..2e-2).contains(&depth), "{deepest}");
    let warnings = document["warnings"].to_string();
    assert!(warnings.contains("`block` and `floor` entered each other"), "{warnings}");
    let ended = bench.pliant(["run", "scene.toml", "--force"]).succeeded();
    ended.prints(&["entered   block and floor, ", "approach  "]);
}
