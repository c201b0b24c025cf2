//! Fits with known results: trajectories computed by the program itself, rubber with known constants,
//! frequencies; and V11 of the verification plan, computed independently.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pliant::material::{Isotropic, MaterialSpec, OgdenTerms};
use pliant::probe::Table;
use pliant::run::run;
use pliant_scene::Source;
use pliant_scene::assembly::UnstableStep;

use super::curves::{MaterialTest, nominal_stress};
use super::{FitError, FitOptions, SceneFit};

const YOUNG_AND_POISSON: [&str; 2] = ["body.beam.elastic.young", "body.beam.elastic.poisson"];

/// Beam of V4 and V11: 3 x 1 cells of half a metre, stretched and thrown.
fn beam(integrator: &str, young: f64, poisson: f64) -> Source {
    let velocity: Vec<String> = (0..8)
        .map(|i| (0.5 * f64::from(i / 2), 0.5 * f64::from(i % 2)))
        .map(
            |(x, y)| {
                if x == 0.0 { "[0, 0]".into() } else { format!("[{:?}, {:?}]", 0.5 * y - 0.3 * x, 0.8 * x) }
            },
        )
        .collect();
    let text = format!(
        "dimension = 2
        [time]
        integrator = '{integrator}'
        step = 0.01
        duration = 0.5
        solver = {{ tolerance = 1e-14 }}
        [world]
        gravity = [0.7, -9.81]
        [output]
        rate = 20
        [[body]]
        name = 'beam'
        mesh = {{ grid = {{ cells = [3, 1], spacing = 0.5 }} }}
        elastic = {{ neo-hookean = {{ young = {young:?}, poisson = {poisson:?} }} }}
        mass = {{ density = 1000 }}
        position = {{ affine = {{ matrix = [[1.02, 0.03], [-0.01, 0.98]] }} }}
        velocity = {{ per_vertex = [{}] }}
        pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }} }}]
        [[probe]]
        name = 'tip'
        vertex = 7",
        velocity.join(", ")
    );
    let text = if integrator == "implicit-euler" { text } else { text.replace("solver =", "# solver =") };
    Source::new("beam.toml", text)
}

/// Output of `run --probes`.
fn film(source: &Source) -> String {
    let scene = source.scene().unwrap();
    let mut assembly = scene.assemble(UnstableStep::Refuse).unwrap();
    let mut out = vec![];
    let mut table = Table::new(&assembly.probes, &mut out, "film");
    let summary = run(&mut assembly.simulation, &scene.plan(), &mut [&mut table], &AtomicBool::new(false));
    assert!(summary.frames > 10, "{summary:?}");
    String::from_utf8(out).unwrap()
}

/// Positions of a trajectory from its second row on, with number `j` (from 1) changed.
fn positions(film: &str, change: impl Fn(f64) -> f64) -> String {
    let mut out = "time [s],tip.x [m],tip.y [m]\n".to_owned();
    for (row, line) in film.lines().skip(2).enumerate() {
        let numbers: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
        let j = 2.0 * row as f64 + 1.0;
        out += &format!("{:?},{:?},{:?}\n", numbers[0], numbers[1] + change(j), numbers[2] + change(j + 1.0));
    }
    out
}

fn fit(source: &Source, data: &str, options: &FitOptions) -> Result<SceneFit, FitError> {
    SceneFit::of(source, ("data.csv", data), options, &Arc::new(AtomicBool::new(false)), &mut |_| {})
}

fn assert_close(found: f64, expected: f64, tolerance: f64) {
    let error = (found - expected).abs() / expected.abs();
    assert!(error < tolerance, "{found}, not {expected}: {error:e}");
}

#[test]
fn young_and_poisson_of_a_beam_are_found_again_from_its_film() {
    for integrator in ["velocity-verlet", "implicit-euler"] {
        let film = film(&beam(integrator, 5e4, 0.35));
        let found = fit(&beam(integrator, 8e4, 0.2), &film, &FitOptions::of(&YOUNG_AND_POISSON)).unwrap();
        assert_close(found.parameters[0].value, 5e4, 1e-9);
        assert_close(found.parameters[1].value, 0.35, 1e-9);
        assert_eq!(found.parameters[0].path, "body.0.elastic.neo-hookean.young");
        // The displacement repeats the position.
        let names: Vec<&str> = found.series.iter().map(|series| series.name.as_str()).collect();
        assert_eq!(names, ["tip.x", "tip.y", "tip.vx", "tip.vy"]);
        assert!(found.warnings[0].contains("tip.ux, tip.uy"), "{:?}", found.warnings);
        assert_eq!(found.scene.scene().unwrap().body[0].elastic, Some(material(&found)));
    }
}

fn material(found: &SceneFit) -> MaterialSpec {
    MaterialSpec::NeoHookean(Isotropic::new(found.parameters[0].value, found.parameters[1].value))
}

// V11: least squares of noisy data by exact derivatives and independent code, with a tolerance of 1e-7 on
// the parameters; the standard deviations have the error of central differences.
#[test]
fn noisy_films_have_the_fit_and_the_errors_of_independent_code() {
    let cases = [
        (
            "velocity-verlet",
            [50_273.842_648_804_04, 0.346_216_814_534_108_9],
            8.109_740_456_781_979e-6,
            [127.168_160_349_726_3, 2.062_237_758_057_529e-3, -0.741_966_681_736_701_9],
        ),
        (
            "implicit-euler",
            [50_376.149_944_559_47, 0.345_392_128_296_168_2],
            8.606_080_902_648_091e-6,
            [202.608_939_746_932_3, 3.159_405_395_830_213e-3, -0.830_696_724_679_837_3],
        ),
    ];
    for (integrator, parameters, sum_of_squares, [young, poisson, correlation]) in cases {
        let data = positions(&film(&beam(integrator, 5e4, 0.35)), |j| 1e-3 * (j * j).sin());
        let found = fit(&beam(integrator, 8e4, 0.2), &data, &FitOptions::of(&YOUNG_AND_POISSON)).unwrap();
        assert_close(found.parameters[0].value, parameters[0], 1e-7);
        assert_close(found.parameters[1].value, parameters[1], 1e-7);
        assert_close(found.sum_of_squares, sum_of_squares, 1e-9);
        assert_close(found.parameters[0].standard_deviation.unwrap(), young, 1e-6);
        assert_close(found.parameters[1].standard_deviation.unwrap(), poisson, 1e-6);
        assert_close(found.correlation[0][1].unwrap(), correlation, 1e-6);
        assert_eq!((found.measured, found.degrees_of_freedom), (20, 18));
        // Student's t of 18 degrees of freedom at 0.975: 2.1009; Abramowitz, Stegun 1964, table 26.10.
        let [low, high] = found.parameters[0].interval.unwrap();
        assert_close(0.5 * (high - low), 2.1009 * young, 1e-4);
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    }
}

// Free fall, y = v t - g t^2 / 2: Verlet's steps and the cubics between them are exact; linear
// interpolation would have an error of g h^2 / 8.
#[test]
fn measured_times_need_not_be_those_of_steps() {
    let scene = Source::new(
        "fall.toml",
        "dimension = 2
        time = { integrator = 'velocity-verlet', step = 0.1, duration = 1 }
        world = { gravity = [0, -5] }
        [[body]]
        mesh = { strand = { segments = 1, start = [0, 0], end = [1, 0] } }
        springs = { stiffness = 1 }
        mass = { per_vertex = 1 }
        velocity = { rigid = { linear = [0, 1] } }
        [[probe]]
        name = 'ball'
        vertex = 0",
    );
    let mut data = "time [ms],ball.uy [mm],ball.y [mm]\n".to_owned();
    for t in [0.05, 0.23, 0.27, 0.3, 0.68, 0.94] {
        data += &format!("{:?},,{:?}\n", 1e3 * t, 1e3 * (2.0 * t - 0.5 * 9.81 * t * t));
    }
    let keys = FitOptions::of(&["world.gravity.1", "body.0.velocity.rigid.linear.1"]);
    let found = fit(&scene, &data, &keys).unwrap();
    assert_close(found.parameters[0].value, -9.81, 1e-9);
    assert_close(found.parameters[1].value, 2.0, 1e-9);
    assert_eq!(
        found.toml,
        "[world]\ngravity = [0, VALUE]\n".replace("VALUE", &format!("{:?}", found.parameters[0].value))
            + &format!(
                "[[body]] # number 0\nvelocity = {{ rigid = {{ linear = [0, {:?}] }} }}\n",
                found.parameters[1].value
            )
    );
}

fn rubber(elastic: &str) -> Source {
    Source::new(
        "rubber.toml",
        format!(
            "dimension = 3
            time = {{ integrator = 'velocity-verlet', step = 1e-5, duration = 0 }}
            [[body]]
            mesh = {{ grid = {{ cells = [1, 1, 1], spacing = 1 }} }}
            elastic = {{ {elastic} }}
            mass = {{ density = 1000 }}"
        ),
    )
}

/// Stress-stretch curves at Treloar's stretches, of a known material.
fn curves(material: &MaterialSpec) -> String {
    let mut out = "stretch,uniaxial [MPa],equibiaxial [MPa],pure-shear [MPa]\n".to_owned();
    for i in 1..=25 {
        let l = 1.0 + 0.2 * f64::from(i);
        let stress = |(_, test): (&str, MaterialTest)| 1e-6 * nominal_stress(material, test, l).unwrap();
        let [uniaxial, equibiaxial, shear] = MaterialTest::ALL.map(stress);
        // Sheets burst at smaller stretches than threads.
        let equibiaxial = if l < 4.0 { format!("{equibiaxial:?}") } else { String::new() };
        out += &format!("{l:?},{uniaxial:?},{equibiaxial},{shear:?}\n");
    }
    out
}

// Ogden 1972 fitted Treloar's rubber with these exponents and moduli (of mu_p alpha_p); here the factor
// of a term is mu_p/alpha_p.
#[test]
fn constants_of_rubber_are_found_again_from_three_curves_at_once() {
    let (mu, alpha) = (vec![0.63e6, 0.0012e6, -0.01e6], vec![1.3, 5.0, -2.0]);
    let material = MaterialSpec::Ogden(OgdenTerms { young: None, poisson: 0.4999, mu, alpha });
    let start =
        rubber("ogden = { poisson = 0.4999, mu = [0.5e6, 0.002e6, -0.02e6], alpha = [1.5, 4.5, -1.5] }");
    let keys =
        ["mu.0", "mu.1", "mu.2", "alpha.0", "alpha.1", "alpha.2"].map(|key| format!("body.0.elastic.{key}"));
    let options = FitOptions { parameters: keys.to_vec(), ..FitOptions::default() };
    let found = fit(&start, &curves(&material), &options).unwrap();
    let expected = [0.63e6, 0.0012e6, -0.01e6, 1.3, 5.0, -2.0];
    for (parameter, expected) in found.parameters.iter().zip(expected) {
        assert_close(parameter.value, expected, 1e-6);
    }
    assert!(found.toml.contains("[[body]] # number 0\nelastic = { ogden = { "), "{}", found.toml);
}

#[test]
fn compressible_materials_are_told_by_their_width_under_force() {
    let material = MaterialSpec::Hencky(Isotropic::new(2e6, 0.3));
    let mut data = "displacement [mm],uniaxial [N],pure-shear [N]\n".to_owned();
    for u in [1.0, 2.0, 5.0, 10.0, 20.0] {
        let force = |test| 4e-6 * nominal_stress(&material, test, 1.0 + u / 20.0).unwrap();
        data += &format!("{u},{:?},{:?}\n", force(MaterialTest::Uniaxial), force(MaterialTest::PureShear));
    }
    let keys = FitOptions::of(&["body.0.elastic.young", "body.0.elastic.poisson"]);
    let options = FitOptions { length: Some(0.02), area: Some(4e-6), ..keys.clone() };
    let found = fit(&rubber("hencky = { young = '1 MPa', poisson = 0.1 }"), &data, &options).unwrap();
    assert_close(found.parameters[0].value, 2e6, 1e-8);
    assert_close(found.parameters[1].value, 0.3, 1e-8);
    for (options, missing) in [
        (FitOptions { area: Some(4e-6), ..keys.clone() }, "--length"),
        (FitOptions { length: Some(0.02), ..keys.clone() }, "--area"),
    ] {
        let message = fit(&rubber("hencky = { young = 1e6, poisson = 0.1 }"), &data, &options).unwrap_err();
        assert!(message.to_string().contains(missing), "{message}");
    }
}

// omega is proportional to sqrt(E/rho): frequencies determine only this ratio.
#[test]
fn frequencies_give_moduli_and_what_they_cannot_tell_is_said() {
    let mut simulation = beam("velocity-verlet", 5e4, 0.35)
        .varied(&[
            ("body.0.position".into(), "{ affine = {} }".into()),
            ("world.gravity".into(), "[0, 0]".into()),
        ])
        .and_then(|source| source.scene())
        .unwrap()
        .assemble(UnstableStep::Accept)
        .unwrap()
        .simulation;
    let modes = simulation.modes(4).unwrap();
    let mut data = "mode,frequency [Hz]\n".to_owned();
    for (i, mode) in modes.modes.iter().enumerate() {
        data += &format!("{},{:?}\n", i + 1, mode.frequency);
    }
    let start = beam("velocity-verlet", 8e4, 0.2)
        .varied(&[
            ("body.0.position".into(), "{ affine = {} }".into()),
            ("world.gravity".into(), "[0, 0]".into()),
        ])
        .unwrap();
    let found = fit(&start, &data, &FitOptions::of(&YOUNG_AND_POISSON)).unwrap();
    assert_close(found.parameters[0].value, 5e4, 1e-7);
    assert_close(found.parameters[1].value, 0.35, 1e-7);
    let alike = FitOptions::of(&["body.0.elastic.young", "body.0.mass.density"]);
    let found = fit(&start, &data, &alike).unwrap();
    assert!(found.warnings[0].contains("cannot be told apart"), "{:?}", found.warnings);
    assert_eq!(found.parameters[0].standard_deviation, None);
}

// Over four seconds a beam of four times the stiffness is at first out of phase with the data: least
// squares ends in another minimum.
#[test]
fn random_starts_find_what_one_does_not_and_are_the_same_each_time() {
    let long = |young, poisson| {
        let duration = [("time.duration".to_owned(), "4".to_owned())];
        beam("velocity-verlet", young, poisson).varied(&duration).unwrap()
    };
    let data = positions(&film(&long(5e4, 0.35)), |_| 0.0);
    let options = FitOptions {
        bounds: vec![
            ("body.0.elastic.young".into(), [1e4, 3e5]),
            ("body.0.elastic.poisson".into(), [0.0, 0.45]),
        ],
        starts: 3,
        seed: 2,
        ..FitOptions::of(&YOUNG_AND_POISSON)
    };
    let found = fit(&long(2e5, 0.35), &data, &options).unwrap();
    assert_eq!(found.starts.len(), 3);
    assert_close(found.parameters[0].value, 5e4, 1e-8);
    let sums: Vec<f64> = found.starts.iter().filter_map(|start| start.sum_of_squares).collect();
    assert!(sums[0] > 1.0 && found.sum_of_squares < 1e-15, "{sums:?}");
    assert!(found.starts.iter().all(|start| (1e4..=3e5).contains(&start.from[0])));
    assert_eq!(fit(&long(2e5, 0.35), &data, &options).unwrap(), found);
}

#[test]
fn bounds_hold_and_what_is_at_one_is_said() {
    let data = positions(&film(&beam("velocity-verlet", 5e4, 0.35)), |_| 0.0);
    let options = FitOptions {
        bounds: vec![("body.0.elastic.poisson".into(), [0.0, 0.3])],
        ..FitOptions::of(&YOUNG_AND_POISSON)
    };
    let found = fit(&beam("velocity-verlet", 8e4, 0.2), &data, &options).unwrap();
    assert_eq!((found.parameters[1].value, found.parameters[1].at_bound), (0.3, true));
    assert_eq!(found.parameters[1].interval, None);
    assert!(found.warnings.iter().any(|warning| warning.contains("at a bound")), "{:?}", found.warnings);
}

#[test]
fn mistakes_are_answered_with_what_would_be_right() {
    let scene = beam("velocity-verlet", 8e4, 0.2);
    let young = FitOptions::of(&YOUNG_AND_POISSON[..1]);
    let of = |data: &str, options: &FitOptions| fit(&scene, data, options).unwrap_err().to_string();
    for (data, message) in [
        (
            "time,tipp.x\n1,2\n",
            "column `tipp.x` is none of a probe of the scene; those are tip.x, tip.y, tip.vx",
        ),
        ("time,tip.x [s]\n1,2\n", "a length [m]"),
        ("time [mm],tip.x\n1,2\n", "a time [s]"),
        ("time,tip.x\n-1,2\n", "line 2: the time -1"),
        ("time,tip.x\n0.1,2\n", "1 number cannot settle 1 parameter: at least 2"),
        ("time,tip.x\n", "no number was measured"),
        ("load,tip.x\n1,2\n", "one must be `time`"),
        ("mode,frequency\n0,2\n", "modes are counted from 1"),
        ("mode,freq\n1,2\n", "`frequency [Hz]`"),
        ("stretch,uniaxal\n1,2\n", "tests are `uniaxial`, `equibiaxial`, `pure-shear`"),
        ("stretch,uniaxial [m]\n1,2\n", "a pressure [Pa] or a force [N]"),
        ("strain,uniaxial\n-1,2\n", "it must be positive"),
    ] {
        let found = of(data, &young);
        assert!(found.contains(message) && found.contains("data.csv"), "{data}: {found}");
    }
    let density = of("stretch,uniaxial\n1,2\n", &FitOptions::of(&["body.0.mass.density"]));
    assert!(density.contains("must be of its `elastic`"), "{density}");
    let data = "time,tip.x\n0.1,1.5\n0.2,1.5\n";
    let with = |bounds: &str, ends| FitOptions { bounds: vec![(bounds.into(), ends)], ..young.clone() };
    for (options, message) in [
        (FitOptions::of(&["body.0.elastic.yuong"]), "these can be fitted: body.0.elastic"),
        (FitOptions::of(&["body.0.elastic.young", "body.beam.elastic.young"]), "asked for twice"),
        (with("body.0.mass.density", [1.0, 2.0]), "is not to be fitted"),
        (with("body.0.elastic.young", [2.0, 1.0]), "leave nothing between them"),
        (with("body.0.elastic.young", [1.0, 2.0]), "is 80000 in the scene, outside of its bounds"),
        (FitOptions { columns: vec!["tip.z".into()], ..young.clone() }, "there is no column `tip.z`"),
    ] {
        let found = of(data, &options);
        assert!(found.contains(message), "{found}");
    }
}

#[test]
fn a_chart_shows_every_measurement_and_its_residual() {
    let data = positions(&film(&beam("velocity-verlet", 5e4, 0.35)), |_| 0.0);
    let found = fit(&beam("velocity-verlet", 8e4, 0.2), &data, &FitOptions::of(&YOUNG_AND_POISSON)).unwrap();
    let svg = found.svg("a film").unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let circles = document.descendants().filter(|node| node.has_tag_name("circle")).count();
    // Ten marks of tip.x in each of the two charts, and one in each legend; those of tip.y are squares.
    assert_eq!(circles, 22, "{svg}");
    assert!(svg.contains("tip.x, fitted") && svg.contains("measured - fitted [m]"));
}
