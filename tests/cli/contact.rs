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
    let longest = summary["solver"]["longest_limited"].as_u64().unwrap();
    assert!((1..10).contains(&longest), "{summary}");
    assert_eq!(seldom["summary"]["least_gap"], *least);
    let ended = bench.pliant(["run", "scene.toml", "--force"]).succeeded();
    ended.prints(&[
        "contact   smallest gap ",
        " between block and floor at t = ",
        "J to friction",
        "Newton iterations in a row",
    ]);
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
    assert!(warnings.contains("contact of `block` and `floor` was compressed to"), "{warnings}");
    let advised: f64 = warnings
        .split("a [contact] `stiffness` of ")
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
        .prints(&["explicit contact is a penalty", "stops approaches of up to"]);
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
    assert!(warnings.contains("`block` and `floor` interpenetrate by"), "{warnings}");
    let ended = bench.pliant(["run", "scene.toml", "--force"]).succeeded();
    ended.prints(&["overlap   block and floor, ", "approach  "]);
}

/// The lightest vertex is the corner of one triangle, 0.4167 kg on 0.05 m^2: its contact lasts `pi sqrt(m
/// dhat / (8 kappa w))`.
#[test]
fn a_check_says_how_long_contact_lasts_and_where_its_numbers_come_from() {
    let bench = Bench::new(DROP);
    let report = bench.pliant(["check", "scene.toml", "--json"]).succeeded().json()["report"].clone();
    let contact = &report["contact"];
    let vertex = &contact["impacts"]["vertex"];
    let expected = std::f64::consts::PI * (0.05_f64 * 0.05 / 6.0 * 1000.0 / 0.05 * 1e-3 / (8.0 * 1e6)).sqrt();
    let time = vertex["time"].as_f64().unwrap();
    assert!((time / expected - 1.0).abs() < 1e-12, "{time}, not {expected}");
    assert!((vertex["steps"].as_f64().unwrap() * 5e-3 / expected - 1.0).abs() < 1e-12, "{vertex}");
    // Waves of sqrt(E / rho) = 31.6 m/s through 0.1 m and back.
    let body = contact["impacts"]["body"]["time"].as_f64().unwrap();
    assert!((body / (0.2 / 1000f64.sqrt()) - 1.0).abs() < 1e-12, "{body}");
    assert!((contact["start"]["least"]["gap"].as_f64().unwrap() - 0.05).abs() < 1e-12, "{contact}");
    let size = report["size"].as_array().unwrap();
    assert_eq!(size.len(), 2);
    let checked = bench.pliant(["check", "scene.toml"]).succeeded();
    checked.prints(&[
        "activation distance 0.001 m, given",
        "block-block, block-floor: 1e6 Pa, given, mu 0.3",
        "sticking contacts creep at up to 1.414e-4 m/s, 7.071e-7 m per step",
        "contact of the lightest vertex, of `block`, lasts 1.01e-4 s, 0.02 steps",
        "0 pairs are candidates at the start; smallest gap 0.05 m, between vertex 0 of `block` and",
    ]);
    let by_modulus = DROP.replace("stiffness = \"1 MPa\"\n", "").replace("distance = \"1 mm\"\n", "");
    Bench::new(&by_modulus).pliant(["check", "scene.toml"]).succeeded().prints(&[
        "a thousandth of the size of `block`",
        "block-block, block-floor: 1e6 Pa, Young's modulus of `block`",
    ]);
}

/// Contact of a body with itself comes with the motion: a prediction that leaves it out says so.
#[test]
fn memory_is_said_to_grow_where_a_body_folds_onto_itself() {
    let said = "more where a body folds onto itself";
    let check = |scene: &str| {
        let text = Bench::new(scene).pliant(["check", "scene.toml"]).succeeded().stdout;
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert!(check(DROP).contains(said));
    let apart = DROP.replace("velocity =", "contact = { self = false }\nvelocity =");
    assert!(!check(&apart).contains(said));
    assert!(
        !check(&DROP.replace("implicit-euler", "velocity-verlet").replace("5e-3", "5e-6")).contains(said)
    );
}

/// Schemes that gain energy where steps are long beside an impact are told before, and named after.
#[test]
fn a_scheme_that_gains_energy_in_impacts_is_named() {
    let of = |command: &str, scheme: &str, step: &str| {
        let text = DROP.replace("\"implicit-euler\"", scheme).replace("5e-3", step);
        let ended = Bench::new(&text).pliant([command, "scene.toml", "--json"]).succeeded().json();
        let document = if command == "check" { &ended["report"] } else { &ended };
        document["warnings"].to_string()
    };
    for scheme in ["\"sdirk4\"", "\"trapezoid\""] {
        let before = of("check", scheme, "1e-3");
        assert!(before.contains("may gain energy in impacts") && before.contains("0.1 steps"), "{before}");
        let after = of("run", scheme, "1e-3");
        assert!(after.contains("gains energy in impacts that last few steps"), "{after}");
        assert!(after.contains("implicit-euler and generalised-alpha"), "{after}");
        // A quarter of the contact of a vertex.
        assert!(!of("check", scheme, "2.5e-5").contains("may gain energy"));
    }
    for command in ["check", "run"] {
        let told = of(command, "\"implicit-euler\"", "1e-3");
        assert!(!told.contains("gain energy") && !told.contains("gains energy"), "{told}");
    }
    // Half of the time that waves take through the block and back.
    assert!(of("check", "\"tr-bdf2\"", "4e-3").contains("an impact of `block`, lasts 0.00632 s"));
    assert!(!of("check", "\"tr-bdf2\"", "2.5e-3").contains("may gain energy"));
}

/// Energy that an obstacle brings in at a constant velocity does not hide what the scheme takes. Where it
/// strikes, its power at the ends of steps is not all that it does, and that is told.
#[test]
fn what_a_scheme_takes_beside_a_moving_obstacle_is_the_scheme_s() {
    let told = |step: &str| {
        let text = DROP
            .replace("[0.0, -9.81]", "[0.0, 0.0]")
            .replace("linear = [0.4, 0.0]", "linear = [0.0, 0.0]")
            .replace("5e-3", step)
            .replace("offset = 0.0 } }", "offset = 0.0 } }\nmotion = { velocity = [0.0, 0.5] }");
        let document = Bench::new(&text).pliant(["run", "scene.toml", "--json"]).succeeded().json();
        let summary = &document["summary"];
        let total = |when: &str| summary[when]["total"].as_f64().unwrap();
        assert!(total("end") > total("start") + 1.0, "the floor takes the block along: {summary}");
        document["warnings"].to_string()
    };
    let (long, short) = (told("1e-2"), told("2e-3"));
    assert!(long.contains("numerical damping: implicit-euler removed up to"), "{long}");
    assert!(short.contains("misses impacts shorter than a step"), "{short}");
}

/// Two blocks that fly through each other: boxes that meet at the start are told then, on the way at the end.
#[test]
fn bodies_that_meet_under_way_without_contact_are_told() {
    let block = |name: &str, x: f64, v: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmesh = {{ grid = {{ cells = [2, 2], size = [0.1, 0.1], origin = \
             [{x}, 0] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e6, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
             velocity = {{ rigid = {{ linear = [{v}, 0] }} }}\n"
        )
    };
    let head = "dimension = 2\ntime = { integrator = \"velocity-verlet\", step = 5e-4, duration = 0.1 }\n\
                output = { rate = 100, channels = [\"energy\"] }\n";
    let warned = |text: &str, arguments: &[&str]| {
        let bench = Bench::new(text);
        let ended = bench.pliant([&["run", "scene.toml", "--json"], arguments].concat()).succeeded();
        ended.json()["warnings"].to_string()
    };
    // 0.1 m apart at 2 m/s: together after 0.05 s.
    let flies = format!("{head}{}{}", block("still", 0.0, 0.0), block("flies", 0.2, -2.0));
    let told = warned(&flies, &[]);
    assert!(told.contains("the bounding boxes of `still` and `flies` meet from t = 0.05 s on"), "{told}");
    // Noted at checkpoints.
    let bench = Bench::new(&flies);
    bench.pliant(["run", "scene.toml", "--until", "0.07", "--checkpoint", "1e-9"]).succeeded();
    let rest = bench.pliant(["resume", "scene.checkpoint", "--until", "0.1", "--json"]).succeeded().json();
    assert!(rest["warnings"].to_string().contains("meet from t = 0.05 s on"), "{rest}");
    let beside = format!("{head}{}{}", block("still", 0.0, 0.0), block("flies", 0.2, 2.0));
    assert!(!warned(&beside, &[]).contains("meet"));
    assert!(!warned(&format!("{head}{}", block("still", 0.0, 0.0)), &[]).contains("meet"));
    let through = format!("{head}{}{}", block("still", 0.0, 0.0), block("flies", 0.05, 2.0));
    let told = warned(&through, &[]);
    assert!(told.contains("`flies` meet, and nothing") && !told.contains("meet from"), "{told}");
    let touches = flies.replace("dimension = 2", "dimension = 2\ncontact = {}");
    let touches = touches.replace("velocity-verlet", "implicit-euler").replace("step = 5e-4", "step = 5e-3");
    assert!(!warned(&touches, &[]).contains("meet"));
}

/// Penalty and barrier are two laws, with two answers.
#[test]
fn the_law_of_contact_is_said_before_and_after_a_run() {
    let explicit = DROP.replace("implicit-euler", "velocity-verlet").replace("5e-3", "1e-4");
    let explicit = explicit.replace("1 MPa", "0.1 MPa");
    for (scene, law) in
        [(DROP, "implicit steps have a barrier"), (&explicit, "explicit steps have a penalty")]
    {
        let bench = Bench::new(scene);
        bench.pliant(["check", "scene.toml"]).succeeded().prints(&[law]);
        bench.pliant(["run", "scene.toml", "--until", "0.02"]).succeeded().prints(&[law]);
    }
}

/// A particle slides to rest: what implicit Euler takes beside friction is said to be the scheme's.
#[test]
fn damping_of_the_scheme_is_told_from_friction() {
    let slide = r#"
dimension = 2
contact = { distance = "1 mm", stiffness = "10 MPa", friction = 0.45, threshold_speed = "2 mm/s" }
time = { integrator = "implicit-euler", step = 0.02, duration = 0.7, solver = { tolerance = 1e-13 } }
world = { gravity = [0, -9.81] }
output = { channels = ["state", "energy"] }
[[body]]
name = "p"
mesh = { inline = { points = [[0.0, 0.000993601]] } }
mass = { per_vertex = 1.0 }
velocity = { per_vertex = [[2.3, 0.0]] }
[[obstacle]]
name = "f"
shape = { half_space = { normal = [0, 1], offset = 0 } }
"#;
    let ended = Bench::new(slide).pliant(["run", "scene.toml", "--json"]).succeeded().json();
    let friction = ended["summary"]["end"]["balance"]["friction"].as_f64().unwrap();
    // Less than the 2.645 J that it has: it goes 0.02 * 2.3 / 2 m less far than Coulomb says.
    assert!((friction - 2.544).abs() < 2e-3, "{friction}");
    let warnings = ended["warnings"].to_string();
    assert!(warnings.contains("numerical damping: implicit-euler removed up to"), "{warnings}");
}

/// Between two half-spaces that close, an element is left with little of its volume.
#[test]
fn elements_that_have_all_but_collapsed_are_told() {
    let press = r#"
dimension = 2
contact = { distance = "1 mm" }
time = { integrator = "quasi-static", step = 0.02, duration = 1.0 }
[[body]]
name = "cube"
mesh = { grid = { cells = [1, 1], size = [0.1, 0.1], origin = [0, 0.002] } }
elastic = { neo-hookean = { young = 1e6, poisson = 0.0 } }
mass = { density = 1000 }
pin = [{ box = { min = [0, 0], max = [1, 1] }, axes = ["x"] }]
[[obstacle]]
shape = { half_space = { normal = [0, 1], offset = 0 } }
[[obstacle]]
shape = { half_space = { normal = [0, -1], offset = -0.104 } }
motion = { displacement = ["0", "-0.1005*t"] }
"#;
    let of = |press: &str| {
        Bench::new(press).pliant(["run", "scene.toml", "--json"]).succeeded().json()["warnings"].to_string()
    };
    let told = of(press);
    assert!(told.contains("of its volume left at the end"), "{told}");
    let told = of(&press.replace("-0.1005", "-0.05"));
    assert!(!told.contains("of its volume left at the end"), "{told}");
}

/// Nothing is missing from the balance of a run that took no step.
#[test]
fn a_run_of_one_frame_has_its_channels() {
    let still = DROP.replace("duration = 0.3", "duration = 0.0");
    let ended = Bench::new(&still).pliant(["run", "scene.toml"]).succeeded();
    assert!(!ended.stdout.contains("among the channels"), "{}", ended.stdout);
    let unread = DROP.replace("\"energy\", ", "");
    Bench::new(&unread).pliant(["run", "scene.toml"]).succeeded().prints(&["among the channels"]);
}
