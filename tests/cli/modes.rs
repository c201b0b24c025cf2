//! `pliant modes` with its files.

use serde_json::Value;

use super::{Bench, logged};

/// A bar of steel, 0.5 m x 2 cm, clamped at one end.
const BAR: &str = r#"
title = "A bar of steel"
dimension = 2
[time]
integrator = "implicit-midpoint"
step = 1e-4
duration = 1e-3
[world]
gravity = [0.0, -9.81]
[[body]]
name = "bar"
mesh = { grid = { cells = [10, 1], size = [0.5, 0.02] } }
elastic = { linear = { preset = "steel" } }
order = 2
mass = { preset = "steel" }
pin = [{ half_space = { normal = [1.0, 0.0], offset = 0.0 } }]
"#;

// What `pliant new` writes starts stretched: there it has no modes, and the advice gives them.
#[test]
fn a_body_that_starts_out_of_shape_is_told_how_to_start_in_it() {
    let bench = Bench::new(BAR);
    bench.pliant(["new", "jelly"]).succeeded();
    let remedy = "body.0.position.affine.matrix=[[1,0,0],[0,1,0],[0,0,1]]";
    let advice = ["moves `jelly` away from its reference configuration", &format!("`--set {remedy}`")];
    bench.pliant(["modes", "jelly.toml"]).ended_with(1).says(&advice);
    bench.pliant(["modes", "jelly.toml", "--set", remedy]).succeeded();
}

/// The magnitude of `samples` at `frequency` [Hz]; Goertzel 1958.
fn magnitude(samples: &[f64], frequency: f64) -> f64 {
    let turn = 2.0 * (std::f64::consts::TAU * frequency / 48_000.0).cos();
    let (mut a, mut b) = (0.0, 0.0);
    for sample in samples {
        (a, b) = (sample + turn * a - b, a);
    }
    (a * a + b * b - turn * a * b).sqrt()
}

const STRUCK: [&str; 8] =
    ["modes", "scene.toml", "--sound", "bar.wav", "--strike", "0.5,0.01", "--direction", "0,-1"];

// lecture 2: the tones of a bar, as a reader of WAV files that is not ours finds them.
#[test]
fn the_sound_of_a_struck_bar_has_its_frequencies() {
    let bench = Bench::new(BAR);
    for (bits, depth) in [("16", 16), ("24", 24)] {
        let more =
            ["--rayleigh", "1,0", "--bits", bits, "--seconds", "1", "--count", "4", "--force", "--json"];
        let ended = bench.pliant(STRUCK.into_iter().chain(more)).succeeded();
        let sound = ended.json()["sound"].clone();
        let mut reader = hound::WavReader::open(bench.path("bar.wav")).unwrap();
        let spec = reader.spec();
        let format = std::fs::read(bench.path("bar.wav")).unwrap()[20..22].to_vec();
        assert_eq!(format, [1, 0], "WAVE_FORMAT_PCM, which every reader knows");
        assert_eq!((spec.channels, spec.sample_rate, spec.bits_per_sample), (1, 48_000, depth));
        let full = f64::from((1i32 << (depth - 1)) - 1);
        let samples: Vec<f64> = reader.samples::<i32>().map(|s| f64::from(s.unwrap()) / full).collect();
        assert_eq!(samples.len(), 48_000);
        let largest = samples.iter().fold(0.0f64, |m, s| m.max(s.abs()));
        assert!((largest - 0.891_250_938).abs() < 1e-4, "normalised to {largest}");
        // Euler and Bernoulli, plane strain: 1.8751^2 / (2 pi L^2) t sqrt(E' / (12 rho)); shear and depth
        // take off a little.
        let first = sound["partials"][0]["frequency"].as_f64().unwrap();
        let expected = 1.875_104f64.powi(2) / (std::f64::consts::TAU * 0.25)
            * 0.02
            * (210e9 / (1.0 - 0.09) / (12.0 * 7850.0f64)).sqrt();
        assert!((first / expected - 1.0).abs() < 1e-2, "{first} Hz for {expected} Hz");
        for partial in sound["partials"].as_array().unwrap() {
            let frequency = partial["frequency"].as_f64().unwrap();
            // A second resolves 1 Hz.
            let loudest = (-20..=20).map(|k| frequency + f64::from(k) * 0.5);
            let peak = loudest.max_by(|a, b| magnitude(&samples, *a).total_cmp(&magnitude(&samples, *b)));
            assert!((peak.unwrap() - frequency).abs() <= 0.5, "{peak:?} Hz for {frequency} Hz");
        }
    }
}

#[test]
fn the_shapes_of_modes_are_an_animation_that_other_commands_read() {
    let bench = Bench::new(BAR);
    let arguments =
        ["modes", "scene.toml", "--count", "3", "-o", "modes.mcap", "--amplitude", "0.2", "--json"];
    let found = bench.pliant(arguments).succeeded().json();
    assert_eq!(found["recording"]["frames"], 181);
    let info = bench.info("modes.mcap");
    assert_eq!(info["frames"], 181, "{info}");
    let log = logged(&bench.path("modes.mcap")).join(" ");
    assert!(log.contains("mode 1: ") && log.contains("mode 3: "), "{log}");
    // The largest swing of the second mode: a fifth of the size of the bar, up and down.
    let swing = |frame: usize| {
        let file = format!("{frame}.obj");
        let frame = frame.to_string();
        bench.pliant(["export", "modes.mcap", "--to", &file, "--frames", &frame]).succeeded();
        let text = std::fs::read_to_string(bench.path(&file)).unwrap();
        let rows: Vec<Vec<f64>> = text
            .lines()
            .filter_map(|line| line.strip_prefix("v "))
            .map(|row| row.split(' ').map(|word| word.parse().unwrap()).collect())
            .collect();
        rows
    };
    let (rest, there) = (swing(60), swing(60 + 7));
    let moved = rest.iter().zip(&there).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
    let size = 0.5f64.hypot(0.02);
    let expected = 0.2 * size * (std::f64::consts::TAU * 7.0 / 30.0).sin();
    assert!((moved / expected - 1.0).abs() < 1e-4, "{moved} m for {expected} m");
    bench.pliant(arguments).ended_with(2).says(&["modes.mcap exists", "--force"]);
}

/// Pulled along, a bar sounds higher: its first frequency grows with the tension.
#[test]
fn prestress_changes_the_frequencies() {
    let bench = Bench::new(&BAR.replace("linear", "stable-neo-hookean"));
    let first = |more: &[&str]| -> f64 {
        let arguments = ["modes", "scene.toml", "--count", "1", "--json"];
        let ended = bench.pliant(arguments.iter().chain(more)).succeeded();
        ended.json()["modes"]["modes"][0]["frequency"].as_f64().unwrap()
    };
    let free = first(&["--set", "world.gravity=[0.0, 0.0]"]);
    // Within 1e-6: without a load it is in equilibrium where it starts.
    let still = first(&["--equilibrium", "--set", "world.gravity=[0.0, 0.0]"]);
    assert!((still / free - 1.0).abs() < 1e-6, "{free} Hz, {still} Hz");
    // In steps that follow the error, too: of statics there is none.
    let bench =
        Bench::new(&BAR.replace("linear", "stable-neo-hookean").replace("step = 1e-4", "adaptive = {}"));
    let adaptive = ["time.integrator=dormand-prince5", "world.gravity=[0.0, 0.0]"].map(|set| ["--set", set]);
    let arguments = ["modes", "scene.toml", "--count", "1", "--json", "--equilibrium"];
    let ended = bench.pliant(arguments.iter().chain(adaptive.as_flattened())).succeeded();
    let again = ended.json()["modes"]["modes"][0]["frequency"].as_f64().unwrap();
    assert!((again / still - 1.0).abs() < 1e-9, "{still} Hz, {again} Hz");
    // Hung by its clamped end, gravity g adds to the square of omega what a hanging chain has: more than 0
    // and, for a first mode like (x/L)^2 (Rayleigh's quotient with the weight below x as tension), 1.57 g /
    // L.
    let g = 1e5;
    let hung = first(&["--equilibrium", "--set", "world.gravity=[1e5, 0.0]"]);
    let gained = (std::f64::consts::TAU).powi(2) * (hung * hung - free * free) / (g / 0.5);
    assert!((gained / 1.57 - 1.0).abs() < 0.05, "{free} Hz to {hung} Hz: {gained} g/L");
}

#[test]
fn what_cannot_be_struck_or_has_no_modes_is_said() {
    let bench = Bench::new(BAR);
    let strike = |place: &str, direction: &str| {
        let arguments =
            ["modes", "scene.toml", "--sound", "bar.wav", "--strike", place, "--direction", direction];
        bench.pliant(arguments)
    };
    strike("900", "0,1").ended_with(2).says(&["no vertex 900", "0 to "]);
    strike("0", "0,1").ended_with(2).says(&["vertex 0 is pinned"]);
    strike("21", "0,0").ended_with(2).says(&["direction"]);
    strike("21", "0,0,1").ended_with(2).says(&["3 components", "needs 2"]);
    strike("0.1,3", "0,1").ended_with(2).says(&["m from the nearest vertex"]);
    strike("0.1,0,0", "0,1").ended_with(2).says(&["3 coordinates", "2D"]);
    strike("tip", "0,1").ended_with(2).says(&["`tip` is neither a vertex"]);
    bench.pliant(["modes", "scene.toml", "--sound", "bar.wav"]).ended_with(2).says(&["--strike"]);
    assert_eq!(bench.files(), Vec::<String>::new());
    // Undamped, and with modes above 24 kHz.
    let ended = bench.pliant(STRUCK.into_iter().chain(["--count", "60", "--json"])).succeeded();
    ended.says(&["at 24 kHz or above omitted", "nothing damps the tones"]);

    let particles = Bench::new(
        "dimension = 2
        [time]
        integrator = 'velocity-verlet'
        step = 1e-3
        duration = 1.0
        [world.nbody]
        constant = 1.0
        softening = 0.0
        [[body]]
        name = 'pair'
        mesh = { inline = { points = [[0.0, 0.0], [1.0, 0.0]] } }
        mass = { per_vertex = 1.0 }",
    );
    particles.pliant(["modes", "scene.toml"]).ended_with(1).says(&["attract each other"]);
}

// The scene's comment: a little below the 442 Hz of a clamped prong, after six modes of rigid motion.
#[test]
fn the_tuning_fork_rings_a_little_below_a_clamped_prong() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/tuning_fork.toml");
    let found = Bench::new(BAR).pliant(["modes", scene, "--count", "7", "--json"]).succeeded().json();
    let modes: Vec<f64> = found["modes"]["modes"].as_array().unwrap().iter().map(frequency).collect();
    assert!(modes[..6].iter().all(|f| *f == 0.0), "{modes:?}");
    let prong = 1.875_104f64.powi(2) / (std::f64::consts::TAU * 0.087f64.powi(2))
        * 0.004
        * (210e9 / (12.0 * 7850.0f64)).sqrt();
    assert!((prong - 442.0).abs() < 1.0 && modes[6] < prong && modes[6] > 0.93 * prong, "{modes:?}, {prong}");
}

fn frequency(mode: &Value) -> f64 {
    mode["frequency"].as_f64().unwrap()
}

/// Bodies that friction holds creep for ever, slower than its threshold speed.
#[test]
fn modes_about_an_equilibrium_that_friction_holds() {
    let scene = r#"
dimension = 2
time = { integrator = "implicit-euler", step = 2e-4, duration = 0.1 }
world = { gravity = [0.0, -9.81] }
contact = { distance = 1e-3, friction = 0.3 }
[[body]]
name = "block"
mesh = { grid = { cells = [2, 2], size = [0.2, 0.2], origin = [0.0, 0.0002] } }
elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
mass = { density = 1000.0 }
[[obstacle]]
name = "floor"
shape = { half_space = { normal = [0.0, 1.0], offset = 0.0 } }
"#;
    let lowest = |text: &str| {
        let arguments = ["modes", "scene.toml", "--count", "3", "--json", "--equilibrium"];
        let found = Bench::new(text).pliant(arguments).succeeded().json();
        found["modes"]["modes"][2]["frequency"].as_f64().unwrap()
    };
    let (held, free) = (lowest(scene), lowest(&scene.replace(", friction = 0.3", "")));
    assert!((held / free - 1.0).abs() < 0.05, "{held} Hz, {free} Hz without friction");
}
