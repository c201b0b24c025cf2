//! The Gauss-Radau method of order 15 against solutions in 40 and 55 digits.

use pliant::control::StepControl;
use pliant::integrator::estimate::Tolerances;
use pliant::simulation::{Simulation, StepError};

use crate::support::oscillator::oscillator;
use crate::support::particles::{FIGURE_EIGHT_PERIOD, figure_eight, kepler, pythagorean, three_bodies};
use crate::support::{advance, distance, largest_difference, method};

/// Lets the scheme choose its steps.
fn free(mut simulation: Simulation) -> Simulation {
    // For the first step alone.
    let tolerances = Tolerances { position: 1e-6, velocity: 1e-6, relative: 1e-6 };
    simulation.set_step_control(StepControl { tolerances, first: None, smallest: 0.0, largest: 10.0 });
    simulation
}

fn go_to(simulation: &mut Simulation, time: f64) {
    while simulation.state().time < time {
        simulation.step_towards(time).unwrap();
    }
    assert_eq!(simulation.state().time, time);
}

// A4: Taylor series in 40 and 55 digits, which agree in all digits.
const PYTHAGOREAN: [(f64, [f64; 4]); 6] = [
    (
        1.0,
        [
            0.949_550_134_839_484_25,
            2.773_231_694_945_563_1,
            -1.666_229_065_913_728_9,
            -0.949_442_409_147_773_13,
        ],
    ),
    (
        10.0,
        [
            0.778_480_410_138_085_49,
            0.141_392_300_290_086_16,
            -2.025_092_477_978_198_6,
            0.097_219_384_146_058_397,
        ],
    ),
    (
        20.0,
        [
            3.004_292_636_696_399_2,
            0.511_925_235_024_685_87,
            -1.388_626_537_510_895_4,
            -0.470_476_050_252_722_17,
        ],
    ),
    (
        40.0,
        [
            -0.622_003_691_801_097_12,
            1.858_318_157_899_772_8,
            0.173_544_556_816_439_8,
            -2.368_410_443_283_164_2,
        ],
    ),
    (
        60.0,
        [
            0.743_807_500_118_082_92,
            1.939_947_951_094_863_3,
            0.264_010_334_686_254_36,
            -0.731_624_394_869_963_72,
        ],
    ),
    (
        70.0,
        [6.933_463_599_011_887_3, 20.261_804_305_951_714, -2.003_006_002_605_984_1, -6.872_463_435_824_544_8],
    ),
];

// lecture 8; A4: through the encounter at 4e-4 to t = 70. Errors of rounding grow by ten orders of magnitude
// on the way; with those that positions of 1 make in a distance of 4e-4, one would be off by 1e-2.
#[test]
fn the_pythagorean_problem_is_solved_to_the_escape() {
    let mut simulation = free(pythagorean(method("ias15"), 1.0));
    let start = simulation.diagnostics().total;
    assert!((start + 12.816_666_666_666_667).abs() < 1e-14);
    for (time, expected) in PYTHAGOREAN {
        go_to(&mut simulation, time);
        let error = largest_difference(&simulation.state().x()[..4], &expected);
        let bar = if time <= 20.0 { 1e-11 } else { 1e-3 };
        assert!(error < bar, "off by {error:e} at t = {time}");
        let energy = (simulation.diagnostics().total / start - 1.0).abs();
        assert!(energy < 1e-12, "energy off by {energy:e} at t = {time}");
    }
    let work = simulation.work();
    assert!(work.steps < 20_000 && work.rejected_steps.unwrap() * 10 < work.steps, "{work:?}");
}

// lecture 8; A2, e = 0.9: some two hundred steps a revolution, and as exact as rounding allows.
#[test]
fn an_eccentric_orbit_is_exact_to_rounding_in_steps_of_its_own() {
    let rows = [
        (
            10.0,
            [
                -1.853_853_709_405_579_2,
                -0.130_885_404_839_925_55,
                0.161_569_452_558_431_34,
                -0.223_719_276_791_897_1,
            ],
        ),
        (
            100.0,
            [
                -0.750_633_333_029_645_2,
                -0.431_000_027_577_321_34,
                1.142_347_674_435_413_7,
                0.075_219_128_096_267_15,
            ],
        ),
    ];
    for (time, expected) in rows {
        let mut simulation = free(kepler(method("ias15"), 0.9, 1.0));
        go_to(&mut simulation, time);
        let state = simulation.state();
        let error = distance(&[&state.x()[2..], &state.v()[2..]].concat(), &expected);
        // One unit in the last place of the energy shifts the phase by 3 pi eps a revolution.
        assert!(error < 2e-13 * time, "off by {error:e} at t = {time}");
        assert!(simulation.work().steps < 45 * time as u64, "{:?}", simulation.work());
    }
}

// lecture 8; A3: the orbit closes to rounding, the state at t = 20 is the known one.
#[test]
fn the_figure_eight_returns_to_rounding() {
    let mut simulation = free(figure_eight(method("ias15"), 1.0));
    let start = simulation.state().x().to_vec();
    go_to(&mut simulation, FIGURE_EIGHT_PERIOD);
    let error = largest_difference(simulation.state().x(), &start);
    assert!(error < 1e-13, "off by {error:e} after a period");
    go_to(&mut simulation, 20.0);
    let expected = [
        -0.035_748_430_765_979_085,
        0.019_599_399_448_157_258,
        0.899_124_736_113_422_15,
        0.461_488_831_645_681_12,
    ];
    let error = distance(&simulation.state().x()[..4], &expected);
    assert!(error < 1e-12, "off by {error:e} at t = 20");
}

// A1: in steps of 3.2 and 4.4 rad the error of a step grows with the 16th power, fewer terms in the
// polynomial would show as fewer powers.
#[test]
fn the_error_of_a_step_grows_with_the_sixteenth_power() {
    let error = |z: f64| {
        let mut simulation = oscillator(method("ias15"), 1.0, 1.0, z);
        advance(&mut simulation, 1);
        let state = simulation.state();
        (state.x()[2] - z.cos()).hypot(state.v()[2] + z.sin())
    };
    let measured = (error(4.4) / error(3.2)).ln() / (4.4f64 / 3.2).ln();
    assert!((measured - 16.0).abs() < 1.0, "{measured}: {:e}, {:e}", error(3.2), error(4.4));
}

// Promise 2: a step at which the iteration does not converge is not taken.
#[test]
fn a_step_too_large_to_converge_is_an_error() {
    let mut simulation = oscillator(method("ias15"), 1.0, 1.0, 8.0);
    let before = simulation.state().x().to_vec();
    let error = simulation.step().unwrap_err();
    assert!(matches!(error, StepError::Unsolved { .. }), "{error}");
    assert!(error.to_string().contains("does not converge at this step"), "{error}");
    assert_eq!(simulation.state().x(), before);
}

// Nothing stiffens where two masses are at one place: what helps is named.
#[test]
fn masses_at_one_place_are_told_of_softening() {
    let x = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut simulation = three_bodies(method("velocity-verlet"), [1.0; 3], x, [0.0; 6], 0.1);
    let said = simulation.step().unwrap_err().to_string();
    assert!(said.contains("`softening`") && said.contains("`ias15`"), "{said}");
}

// Steps that are taken back for ever come to an end: squares of distances overflow at 1e308, and no step is
// small enough.
#[test]
fn a_step_that_no_size_makes_right_is_an_error() {
    let x = [1e308, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut simulation = free(three_bodies(method("ias15"), [1.0; 3], x, [0.0; 6], 1.0));
    for _ in 0..1000 {
        if let Err(error) = simulation.step_towards(1.0) {
            assert!(matches!(error, StepError::StepTooSmall { step: 1, .. }), "{error}");
            return;
        }
    }
    panic!("a thousand steps were taken to {}", simulation.state().time);
}

// A step that is taken back leaves no trace: what comes after it is what would have come without it.
#[test]
fn a_step_that_is_taken_back_leaves_the_memory_of_the_scheme() {
    let build = || kepler(method("ias15"), 0.6, 0.05);
    let (mut simulation, mut undisturbed) = (build(), build());
    advance(&mut simulation, 7);
    advance(&mut undisturbed, 7);
    let (x, v) = (simulation.state().x().to_vec(), simulation.state().v().to_vec());
    let (mut far, mut fast) = (vec![0.0, 0.0, f64::NAN, 0.0], v.clone());
    assert!(simulation.advance(&mut far, &mut fast).is_err());
    simulation.state_mut().x_mut().copy_from_slice(&x);
    simulation.state_mut().v_mut().copy_from_slice(&v);
    advance(&mut simulation, 5);
    advance(&mut undisturbed, 5);
    assert_eq!(simulation.state().x(), undisturbed.state().x());
    assert_eq!(simulation.state().v(), undisturbed.state().v());
}

/// Rounding of positions is large beside the acceleration of a stiff body: steps below the limit that `check`
/// tells converge to it, and not to a part of the acceleration.
#[test]
fn an_elastic_beam_goes_on_in_steps_below_the_limit() {
    let build = |h: f64| {
        let text = format!(
            "dimension = 2\ntime = {{ integrator = {{ ias15 = {{}} }}, step = {h:?}, duration = 1.0 }}\n\
             world = {{ gravity = [0, -9.81] }}\n[[body]]\n\
             mesh = {{ grid = {{ cells = [8, 2], size = [1.6, 0.2], origin = [0.1, 0.6] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 3e6, poisson = 0.3 }} }}\nmass = {{ density = 1000.0 }}\n\
             pin = [{{ half_space = {{ normal = [1, 0], offset = 0.1 }} }}]\n"
        );
        let scene = pliant_scene::Scene::from_toml(&text).unwrap();
        scene.assemble(pliant_scene::assembly::UnstableStep::Refuse).unwrap().simulation
    };
    let limit = build(1e-6).stability_limit(1.0).unwrap().step;
    for part in [0.45, 0.95] {
        let mut simulation = build(part * limit);
        let start = simulation.diagnostics();
        advance(&mut simulation, 300);
        let end = simulation.diagnostics();
        let drift = (end.total - start.total).abs() / end.kinetic.max(end.elastic);
        assert!(end.elastic > 0.1 && drift < 1e-9, "{part} of {limit} s: {drift:e}, {end:?}");
    }
}

/// An acceleration that passes through zero, and one that dies down to the rounding of the forces that make
/// it, say nothing of the step by their last terms.
#[test]
fn steps_follow_no_rounding_where_nothing_accelerates() {
    let build = |duration: f64, more: &str| {
        let text = format!(
            "dimension = 2\ntime = {{ integrator = 'ias15', adaptive = {{}}, duration = {duration:?} \
             }}\n{more}"
        );
        let scene = pliant_scene::Scene::from_toml(&text).unwrap();
        scene.assemble(pliant_scene::assembly::UnstableStep::Refuse).unwrap().simulation
    };
    // Through the place without force once in each half of a period.
    let mut spring = build(
        10.0,
        "[[body]]\nmesh = { strand = { segments = 1, start = [0, 0], end = [1, 0] } }\n\
         springs = { stiffness = 100.0 }\nmass = { per_vertex = 1.0 }\npin = [{ vertices = [0] }]\n\
         velocity = { rigid = { linear = [0.4, 0.0] } }\n",
    );
    go_to(&mut spring, 10.0);
    let expected = 1.0 + 0.04 * (10.0f64 * 10.0).sin();
    assert!((spring.positions()[2] - expected).abs() < 1e-13, "{} for {expected}", spring.positions()[2]);
    // A step for each frame.
    assert!(spring.work().steps <= 600, "{:?}", spring.work());
    let mut beam = build(
        3.0,
        "world = { gravity = [0, -9.81], ether_drag = 5.0 }\n[[body]]\n\
         mesh = { grid = { cells = [4, 1], spacing = 0.25 } }\n\
         elastic = { neo-hookean = { young = 1e4, poisson = 0.3 } }\nmass = { density = 100.0 }\n\
         pin = [{ half_space = { normal = [1, 0], offset = 0 } }]\n",
    );
    go_to(&mut beam, 3.0);
    assert!(beam.work().steps < 2000, "{:?}", beam.work());
}
