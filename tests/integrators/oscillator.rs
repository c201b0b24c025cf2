//! One mass, one spring: what a scheme does to it is known in closed form.

use std::sync::atomic::AtomicBool;

use pliant::integrator::amplification;
use pliant::integrator::bdf2::{Bdf2Parameters, Bdf2Start};
use pliant::integrator::generalised_alpha::GeneralisedAlphaParameters;
use pliant::integrator::newmark::NewmarkParameters;
use pliant::run::{Outcome, Plan, run};
use pliant::simulation::{Simulation, StepError};

use crate::support::oscillator::{from_rest, oscillator};
use crate::support::{advance, largest_difference, method, methods, methods_of_measurable_order};

/// `(x_10, v_10 / omega)` from `(1, 0)`.
fn after_ten(simulation: &mut Simulation, omega: f64) -> [f64; 2] {
    advance(simulation, 10);
    let state = simulation.state();
    [state.x()[2], state.v()[2] / omega]
}

/// Reference vectors at `z = 0.1` and `z = 1`, from powers of amplification matrices in 40 digits.
const VECTORS: [(&str, [f64; 2], [f64; 2]); 24] = [
    ("forward-euler", [0.5707904499, -0.88250801], [0.0, -32.0]),
    ("rk2-midpoint", [0.538_970_697_569_425_6, -0.842_472_916_649_788_7], [0.231_445_312_5, 3.042_968_75]),
    (
        "rk4",
        [0.540_302_967_116_884_2, -0.841_470_477_800_274_4],
        [-0.816_618_156_599_970_4, 0.466_949_881_766_836_3],
    ),
    (
        "bogacki-shampine3",
        [0.540_277_067_223_060_53, -0.841_437_839_760_861_73],
        [-0.479_351_894_189_571_37, 0.578_664_012_091_652_7],
    ),
    (
        "dormand-prince5",
        [0.540_302_303_984_503_42, -0.841_470_982_753_364_05],
        [-0.837_118_653_233_074_41, 0.547_046_742_549_709_8],
    ),
    // The exact solution: the error of order 15 is 5e-17 of an amplitude a step at z = 1.
    (
        "ias15",
        [0.540_302_305_868_139_72, -0.841_470_984_807_896_51],
        [-0.839_071_529_076_452_45, 0.544_021_110_889_369_81],
    ),
    ("symplectic-euler", [0.497_813_731_513_215_3, -0.842_750_388_405_864_2], [0.0, 1.0]),
    ("velocity-verlet", [0.539_951_250_933_508_5, -0.840_643_512_434_849_5], [-0.5, 0.75]),
    (
        "yoshida4",
        [0.540_307_880_889_840_6, -0.841_470_629_569_782_2],
        [-0.973_132_446_514_624_3, -0.248_246_751_931_800_9],
    ),
    ("implicit-euler", [0.516_729_148_157_808_8, -0.798_922_988_865_064_8], [0.0, -0.031_25]),
    ("linearised-implicit-euler", [0.516_729_148_157_808_8, -0.798_922_988_865_064_8], [0.0, -0.031_25]),
    (
        "implicit-midpoint",
        [0.541_002_294_600_359, -0.841_021_115_809_315_7],
        [-0.988_496_588_8, -0.151_243_161_6],
    ),
    ("trapezoid", [0.541_002_294_600_359, -0.841_021_115_809_315_7], [-0.988_496_588_8, -0.151_243_161_6]),
    ("newmark", [0.541_002_294_600_359, -0.841_021_115_809_315_7], [-0.988_496_588_8, -0.151_243_161_6]),
    (
        "generalised-alpha",
        [0.541_040_186_907_516_2, -0.840_983_166_111_178_2],
        [-0.977_594_693_112_473_5, -0.184_533_805_706_698_1],
    ),
    (
        "bdf2",
        [0.542_611_597_442_863_5, -0.839_769_384_362_382_8],
        [-0.273_236_924_169_303_9, -0.492_068_361_843_661_8],
    ),
    (
        "tr-bdf2",
        [0.540_640_290_152_024, -0.841_249_505_192_186_3],
        [-0.949_722_364_181_229, 0.193_205_915_181_161_5],
    ),
    (
        "sdirk2",
        [0.540_640_290_152_024, -0.841_249_505_192_186_3],
        [-0.949_722_364_181_229, 0.193_205_915_181_161_5],
    ),
    (
        "sdirk3",
        [0.540_289_665_134_688_7, -0.841_448_459_903_761_4],
        [-0.746_686_108_495_991_9, 0.379_670_640_060_723_9],
    ),
    (
        "crouzeix3",
        [0.540_262_559_037_837_6, -0.841_391_131_485_963_2],
        [-0.693_896_733_517_349_2, 0.108_060_191_285_083_9],
    ),
    (
        "sdirk4",
        [0.540_302_376_918_394_2, -0.841_470_938_866_082_3],
        [-0.843_327_663_171_047_2, 0.537_066_927_002_149_8],
    ),
    (
        "gauss2",
        [0.540_302_422_669_538_6, -0.841_470_909_810_569_3],
        [-0.846_107_653_269_778_3, 0.533_012_044_027_439_1],
    ),
    (
        "radau-iia2",
        [0.540_295_121_587_995_4, -0.841_459_110_749_782_1],
        [-0.758_027_230_241_798_3, 0.454_525_158_751_057_8],
    ),
    (
        "radau-iia3",
        [0.540_302_305_138_196_7, -0.841_470_983_627_028_9],
        [-0.838_099_674_134_749_1, 0.543_119_059_176_041_7],
    ),
];

// lecture 3 to 6; A1a
#[test]
fn ten_steps_on_the_oscillator_are_the_reference_vectors() {
    for method in methods() {
        let name = method.documentation.name;
        let (_, small, large) = VECTORS
            .iter()
            .find(|(n, ..)| *n == name)
            .unwrap_or_else(|| panic!("{name} has no reference vectors: compute them independently"));
        for (z, expected) in [(0.1, small), (1.0, large)] {
            // omega = sqrt(k / m) = 2: mass, stiffness and step enter as they should.
            let measured = after_ten(&mut oscillator(method, 3.0, 12.0, z / 2.0), 2.0);
            let scale = expected[0].hypot(expected[1]).max(1.0);
            let error = largest_difference(&measured, expected) / scale;
            assert!(error < 1e-13, "{name} at z = {z}: {measured:?} instead of {expected:?}");
            let closed = from_rest(name, z, 10);
            assert!(largest_difference(&closed, expected) / scale < 1e-13, "closed form of {name}");
        }
    }
}

// A1a: what the registry does not have by default.
#[test]
fn ten_steps_with_other_parameters_are_the_reference_vectors() {
    let rows = [
        (
            NewmarkParameters { beta: 1.0 / 6.0, gamma: 0.5 }.method(),
            [0.540_652_477_980_188_5, -0.840_895_446_714_693_3],
            [-0.979_921_384_191_788_1, 0.190_895_889_784_665_7],
        ),
        (
            NewmarkParameters { beta: 1.0 / 12.0, gamma: 0.5 }.method(),
            [0.540_302_130_491_954_4, -0.840_769_579_079_911_7],
            [-0.826_979_554_338_037_5, 0.513_245_244_097_839_3],
        ),
        (
            NewmarkParameters { beta: 0.3025, gamma: 0.6 }.method(),
            [0.542_515_747_484_607_1, -0.836_844_573_472_195_7],
            [-0.655_690_750_742_636_4, -0.112_302_654_694_295_9],
        ),
        (
            GeneralisedAlphaParameters { rho: 0.0 }.method(),
            [0.543_493_651_675_798_3, -0.838_128_889_616_970_8],
            [-0.069_662_483_699_977_98, -0.414_482_040_339_379_2],
        ),
        (
            GeneralisedAlphaParameters { rho: 0.5 }.method(),
            [0.541_326_411_114_938_7, -0.840_681_563_385_191],
            [-0.831_973_096_518_736_2, -0.353_674_959_380_258_2],
        ),
        (
            GeneralisedAlphaParameters { rho: 1.0 }.method(),
            [0.541_002_294_600_359, -0.841_021_115_809_315_7],
            [-0.988_496_588_8, -0.151_243_161_6],
        ),
        (
            Bdf2Parameters { start: Bdf2Start::ImplicitEuler }.method(),
            [0.538_550_380_127_002_7, -0.833_585_563_359_429_3],
            [-0.162_445_695_964_303, -0.329_308_658_633_271_6],
        ),
    ];
    for (method, small, large) in rows {
        for (z, expected) in [(0.1, small), (1.0, large)] {
            let measured = after_ten(&mut oscillator(method, 3.0, 12.0, z / 2.0), 2.0);
            let error = largest_difference(&measured, &expected);
            assert!(error < 1e-13, "{:?} at z = {z}: {measured:?} instead of {expected:?}", method.scheme);
        }
    }
}

// A1: spectral radii of one step, at z = 1, 10 and 1000, in 16 digits.
#[test]
fn implicit_schemes_damp_fast_motion_as_theory_says() {
    let newmark = |beta, gamma| NewmarkParameters { beta, gamma }.method();
    let rows = [
        (
            method("implicit-euler"),
            [0.707_106_781_186_547_5, 0.099_503_719_020_998_91, 9.999_995_000_003_75e-4],
        ),
        (method("implicit-midpoint"), [1.0; 3]),
        (method("trapezoid"), [1.0; 3]),
        (newmark(0.25, 0.5), [1.0; 3]),
        (newmark(1.0 / 6.0, 0.5), [1.0, 3.363_026_114_082_257, 3.732_012_023_160_716]),
        (newmark(1.0 / 12.0, 0.5), [1.0, 8.597_979_316_799_256, 9.898_834_002_597_823]),
        (newmark(0.3025, 0.6), [0.960_845_756_684_284_8, 0.824_621_125_123_532_1, 0.818_182_486_014_716_5]),
        (method("tr-bdf2"), [0.996_873_936_515_610_4, 0.444_858_060_009_596_8, 0.004_828_384_912_014_319]),
        (method("sdirk2"), [0.996_873_936_515_610_4, 0.444_858_060_009_596_8, 0.004_828_384_912_014_319]),
        (method("sdirk3"), [0.982_442_773_531_724_4, 0.279_063_236_351_721_5, 0.002_870_090_423_645_774]),
        (method("crouzeix3"), [0.965_272_244_181_965_6, 0.741_935_818_280_497_5, 0.732_051_826_803_596_3]),
        (method("sdirk4"), [0.999_982_118_540_186_7, 0.745_006_950_358_933_2, 0.009_333_094_101_558_458]),
        (method("gauss2"), [1.0, 1.0, 1.0]),
        (method("radau-iia2"), [0.987_729_596_649_589_6, 0.204_397_796_416_112, 0.002_000_004_999_937_75]),
        (method("radau-iia3"), [0.999_869_306_671_336_3, 0.321_402_950_403_348_1, 0.003_000_022_499_989_114]),
    ];
    for (method, expected) in rows {
        for (z, expected) in [1.0, 10.0, 1000.0].into_iter().zip(expected) {
            let radius = amplification(&method, z, 0.0, 0.0).spectral_radius();
            assert!(
                (radius - expected).abs() < 1e-13,
                "{:?} at z = {z}: {radius} instead of {expected}",
                method.scheme
            );
        }
    }
}

// A1: these remember more than a state, so that one step has no matrix of two rows; at z = 10 they have to
// shrink by 0.3007 and 0.9298 a step in the end, at z = 1000 by 0.0231 and 0.8077.
#[test]
fn schemes_with_a_memory_damp_fast_motion_as_their_recurrences_do() {
    for name in ["bdf2", "generalised-alpha"] {
        for z in [10.0, 1000.0] {
            let mut simulation = oscillator(method(name), 3.0, 12.0, z / 2.0);
            for step in 1..=12 {
                advance(&mut simulation, 1);
                let measured = [simulation.state().x()[2], simulation.state().v()[2] / 2.0];
                let expected = from_rest(name, z, step);
                let scale = expected[0].hypot(expected[1]);
                let error = largest_difference(&measured, &expected) / scale;
                assert!(
                    error < 1e-11,
                    "{name} at z = {z}, step {step}: {measured:?} instead of {expected:?}"
                );
            }
        }
    }
}

/// Largest `|x|` over `steps` steps, infinite if one could not be taken.
fn largest_excursion(simulation: &mut Simulation, steps: usize) -> f64 {
    let mut largest: f64 = 0.0;
    for _ in 0..steps {
        if simulation.step().is_err() {
            return f64::INFINITY;
        }
        largest = largest.max(simulation.state().x()[2].abs());
    }
    largest
}

// lecture 7; A1b
#[test]
fn ten_thousand_steps_stay_bounded_below_the_documented_limit_and_not_above() {
    let newmark = [1.0 / 6.0, 1.0 / 12.0].map(|beta| NewmarkParameters { beta, gamma: 0.5 }.method());
    for method in methods().chain(newmark).filter(|m| m.documentation.stability_limit > 0.0) {
        let (name, limit) = (method.documentation.name, method.documentation.stability_limit);
        if limit == f64::INFINITY {
            for z in [1.0, 30.0, 1e4] {
                let largest = largest_excursion(&mut oscillator(method, 1.0, 1.0, z), 1000);
                assert!(largest < 1.0 + 1e-9, "{name} at z = {z} reaches {largest:e}");
            }
            continue;
        }
        let below = largest_excursion(&mut oscillator(method, 1.0, 1.0, 0.999 * limit), 10_000);
        assert!(below < 1e3, "{name} below its limit reaches {below:e}");
        // Dormand and Prince's pair grows by 5e-7 a step there.
        let grows =
            |f: &f64| amplification(&method, f * limit, 0.0, 0.0).spectral_radius().powi(10_000) > 1e7;
        let factor = [1.001, 1.5].into_iter().find(grows).unwrap();
        let above = largest_excursion(&mut oscillator(method, 1.0, 1.0, factor * limit), 10_000);
        assert!(above > 1e6, "{name} above its limit reaches {above:e}");
    }
}

// lecture 4 and 7; A1
#[test]
fn forward_euler_and_the_midpoint_rule_gain_energy_at_any_step_at_the_predicted_rate() {
    // Squared modulus of the eigenvalues of one step.
    let gain = |name: &str, z: f64| match name {
        "forward-euler" => 1.0 + z * z,
        "rk2-midpoint" => 1.0 + z.powi(4) / 4.0,
        _ => panic!("how fast does {name} gain energy?"),
    };
    // The gain of order 15 is below rounding here.
    for method in methods_of_measurable_order().filter(|m| m.documentation.stability_limit == 0.0) {
        for z in [1e-2, 0.1] {
            let mut simulation = oscillator(method, 1.0, 1.0, z);
            advance(&mut simulation, 1000);
            let energy = simulation.diagnostics().total;
            let expected = 0.5 * gain(method.documentation.name, z).powi(1000);
            assert!(expected > 0.5 + 1e-6);
            let error = (energy / expected - 1.0).abs();
            assert!(
                error < 1e-10,
                "{} at z = {z}: {energy} instead of {expected}",
                method.documentation.name
            );
        }
    }
}

// A1b
#[test]
fn exactly_at_the_limit_the_euler_and_verlet_oscillators_grow_linearly() {
    let mut euler = oscillator(method("symplectic-euler"), 1.0, 1.0, 2.0);
    advance(&mut euler, 101);
    assert_eq!(euler.state().x()[2], -203.0);
    let mut verlet = oscillator(method("velocity-verlet"), 1.0, 1.0, 2.0);
    verlet.state_mut().x_mut()[2] = 0.0;
    verlet.state_mut().v_mut()[2] = 1.0;
    advance(&mut verlet, 100);
    assert_eq!(verlet.state().x()[2], -200.0);
}

// lecture 5; A1
#[test]
fn symplectic_euler_and_velocity_verlet_conserve_their_modified_energies() {
    type Invariant = fn(f64, f64, f64) -> f64;
    let euler: Invariant = |z, x, v| x * x + v * v - z * x * v;
    let verlet: Invariant = |z, x, v| (1.0 - z * z / 4.0) * x * x + v * v;
    for (name, invariant) in [("symplectic-euler", euler), ("velocity-verlet", verlet)] {
        for z in [0.1, 1.0, 1.9] {
            let mut simulation = oscillator(method(name), 1.0, 1.0, z);
            let start = invariant(z, 1.0, 0.0);
            for _ in 0..10_000 {
                simulation.step().unwrap();
                let (x, v) = (simulation.state().x()[2], simulation.state().v()[2]);
                let change = (invariant(z, x, v) / start - 1.0).abs();
                assert!(change < 1e-11, "{name} at z = {z}: relative change {change:e}");
            }
        }
    }
}

// lecture 5 and 7; A1: from (1, 0), H/H_0 fills [1/(1+z/2), 1/(1-z/2)] and [1 - z^2/4, 1].
#[test]
fn the_energy_of_the_symplectic_schemes_oscillates_between_the_predicted_bounds() {
    let z: f64 = 0.1;
    let euler = (1.0 / (1.0 + z / 2.0), 1.0 / (1.0 - z / 2.0));
    let verlet = (1.0 - z * z / 4.0, 1.0);
    for (name, (low, high)) in [("symplectic-euler", euler), ("velocity-verlet", verlet)] {
        let mut simulation = oscillator(method(name), 1.0, 1.0, z);
        let start = simulation.diagnostics().total;
        let (mut lowest, mut highest) = (1.0f64, 1.0f64);
        for _ in 0..10_000 {
            simulation.step().unwrap();
            let ratio = simulation.diagnostics().total / start;
            (lowest, highest) = (lowest.min(ratio), highest.max(ratio));
        }
        let slack = 1e-3 * (high - low);
        assert!(lowest > low - 1e-12 && lowest < low + slack, "{name}: lowest {lowest}, predicted {low}");
        assert!(
            highest < high + 1e-12 && highest > high - slack,
            "{name}: highest {highest}, predicted {high}"
        );
    }
}

// lecture 7: a run looks at its energy also where frames that are not measured fall on the very steps it
// looks at.
#[test]
fn a_run_without_measured_frames_still_notices_that_it_blows_up() {
    let step = 2.001;
    let mut simulation = oscillator(method("velocity-verlet"), 1.0, 1.0, step);
    let plan = Plan { duration: 1e5 * step, rate: 1.0 / (128.0 * step) };
    let summary = run(&mut simulation, &plan, &mut [], &AtomicBool::new(false));
    let Outcome::Failed(StepError::Unstable { step, .. }) = summary.outcome else {
        panic!("it ends with {:?}", summary.outcome)
    };
    assert_eq!(step, 128);
}
