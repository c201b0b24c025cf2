//! Limits, maps and amplification against closed forms.

use std::sync::Arc;

use super::*;
use pliant_scene::Source;

/// A bar of two springs and two masses, fixed at one end.
fn scene(integrator: &str, step: f64) -> Scene {
    Scene::from_toml(&text(integrator, step)).unwrap()
}

fn text(integrator: &str, step: f64) -> String {
    format!(
        "dimension = 2\ntime = {{ integrator = '{integrator}', step = {step:?}, duration = 1.0, \
         allow_unstable = true }}\n\
         [[body]]\nmesh = {{ grid = {{ cells = [3, 1], size = [3.0, 1.0] }} }}\n\
         elastic = {{ linear = {{ young = 1e4, poisson = 0.3 }} }}\nmass = {{ density = 100.0 }}\n\
         pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }} }}]\nvelocity = {{ rigid = {{ linear = \
         [0.1, 0.2] }} }}\n"
    )
}

fn spec(name: &str) -> IntegratorSpec {
    *IntegratorSpec::ALL.iter().find(|s| s.method().documentation.name == name).unwrap()
}

// A1b, by bisection: for a linear body the measured limit is the predicted one.
#[test]
fn measured_limits_of_a_linear_body_are_those_predicted() {
    for name in ["symplectic-euler", "velocity-verlet", "yoshida4", "rk4"] {
        let found = measure_limit(&scene(name, 1e-3), spec(name), 1.0, &Arc::default()).unwrap().unwrap();
        let ratio = found.measured / found.predicted.unwrap();
        assert!((ratio - 1.0).abs() < 3e-3, "{name}: {found:?}");
        assert_eq!(found.above, Some(AttemptStatus::Diverged));
    }
    for name in ["implicit-euler", "tr-bdf2"] {
        let found = measure_limit(&scene(name, 1e-3), spec(name), 10.0, &Arc::default()).unwrap().unwrap();
        assert_eq!((found.predicted, found.measured, found.above), (None, 10.0, None), "{name}");
    }
}

// Statics has no stability limit, for which a survey would search for minutes.
#[test]
fn a_quasi_static_scene_is_refused() {
    let quasi_static = text("quasi-static", 0.1);
    let solver = quasi_static.replace("time = {", "time = { solver = { retries = 2 },");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/lees_frame_2d.toml");
    let arc_length = std::fs::read_to_string(path).unwrap();
    // The remedy is one that the scene accepts.
    for (text, remedy) in [
        (quasi_static, "add `--set time.integrator=velocity-verlet`"),
        (solver, "add `--set time.integrator=implicit-euler`"),
        (arc_length, "remove `arc_length`"),
    ] {
        let options = SurveyOptions { quick: true, ..SurveyOptions::default() };
        let source = Source::new("test", text);
        let error = StabilitySurvey::of(&source, &options, &Arc::default(), &mut |_| {}).unwrap_err();
        let said = error.to_string();
        assert!(matches!(error, SurveyError::Static { .. }) && said.contains(remedy), "{said}");
        assert!(said.contains("adaptive = {}"), "{said}");
    }
}

// A budget bounds every search; what it does not reach is named, in the order of the survey.
#[test]
fn a_survey_keeps_its_budget_and_names_what_it_did_not_reach() {
    let source = Source::new("test", text("velocity-verlet", 1e-3));
    let integrators = ["velocity-verlet", "implicit-euler"].map(str::to_owned).to_vec();
    let of = |budget: f64| {
        let options = SurveyOptions {
            integrators: integrators.clone(),
            quick: true,
            budget: Some(budget),
            ..SurveyOptions::default()
        };
        let mut seen = 0;
        let found = StabilitySurvey::of(&source, &options, &Arc::default(), &mut |_| seen += 1).unwrap();
        assert!(found.complete && seen == 2, "{seen}");
        assert_eq!((found.own_integrator, found.own_step), ("velocity-verlet", Some(1e-3)));
        found
    };
    let none = of(1e-9);
    assert_eq!(none.not_reached, ["velocity-verlet", "implicit-euler", "map"]);
    assert!(none.limits.is_empty() && none.drifts.is_empty() && none.map.is_none(), "{none:?}");
    let all = of(1e6);
    assert!(all.not_reached.is_empty() && all.map.is_some(), "{:?}", all.not_reached);
    assert!(all.limits.iter().all(|limit| !limit.cut_short && all.drift_of(&limit.integrator).is_some()));
}

// The first integrator is the one that a verdict is about.
#[test]
fn an_integrator_without_a_fixed_step_is_replaced_by_verlet() {
    let text = text("ias15", 1e-3).replace(", step = 0.001", ", adaptive = {}");
    let options = SurveyOptions { budget: Some(1e-9), ..SurveyOptions::default() };
    let source = Source::new("test", text);
    let found = StabilitySurvey::of(&source, &options, &Arc::default(), &mut |_| {}).unwrap();
    assert_eq!((found.own_integrator, found.own_step), ("ias15", None));
    assert_eq!(found.not_reached[0], "velocity-verlet");
    assert!(!found.not_reached.contains(&"ias15".to_owned()), "{:?}", found.not_reached);
}

// A search that is stopped keeps what it has: the prediction of an implicit integrator.
#[test]
fn a_search_that_is_stopped_is_cut_short() {
    let stopped = Arc::new(AtomicBool::new(true));
    let found = measure_limit(&scene("rk4", 1e-3), spec("implicit-euler"), 1.0, &stopped).unwrap().unwrap();
    assert_eq!((found.predicted, found.measured, found.above), (None, 0.0, None));
    assert!(found.cut_short, "{found:?}");
    assert_eq!(measure_limit(&scene("rk4", 1e-3), spec("rk4"), 1.0, &stopped).unwrap(), None);
}

#[test]
fn a_scheme_that_gains_energy_at_any_step_has_no_limit() {
    let found = measure_limit(&scene("forward-euler", 1e-3), spec("forward-euler"), 1.0, &Arc::default());
    let found = found.unwrap().unwrap();
    assert_eq!(found.predicted, Some(spec("forward-euler").method().documentation.stability_limit));
    assert!(found.doubles_at.is_some_and(|step| step > 0.0), "{found:?}");
}

#[test]
fn steps_that_fail_below_their_limit_are_counted() {
    use AttemptStatus::{Diverged, Ok};
    let map = Map {
        integrator: String::new(),
        against: Against::Young,
        steps: vec![1.0, 2.0, 4.0],
        values: vec![1.0, 2.0, 3.0],
        predicted: vec![Some(2.0), Some(0.0), None],
        status: vec![vec![Ok, Diverged, Diverged], vec![Diverged; 3], vec![Ok, Ok, Diverged]],
    };
    assert_eq!(map.failed_below_limit(), 1);
    assert!(map.fails_early(0, 1) && !map.fails_early(0, 0) && !map.fails_early(0, 2));
}

// A1: spectral radii at h omega = 1, 10, 1000.
#[test]
fn amplification_is_that_of_the_table() {
    let rows = [
        ("forward-euler", [std::f64::consts::SQRT_2, 10.0499, 1000.0]),
        ("rk2-midpoint", [1.118_033_99, 50.01, 5e5]),
        ("rk4", [0.993_905_037, 399.65, 4e10]),
        ("symplectic-euler", [1.0, 97.99, 1e6]),
        ("velocity-verlet", [1.0, 97.99, 1e6]),
        ("implicit-euler", [std::f64::consts::FRAC_1_SQRT_2, 0.099_503_7, 1e-3]),
        ("implicit-midpoint", [1.0, 1.0, 1.0]),
        ("trapezoid", [1.0, 1.0, 1.0]),
        ("generalised-alpha", [0.999_474_614, 0.929_792, 0.8077]),
        ("bdf2", [0.933_321_058, 0.300_750, 0.0231]),
        ("tr-bdf2", [0.996_873_937, 0.444_858, 0.004_83]),
        ("sdirk2", [0.996_873_937, 0.444_858, 0.004_83]),
        ("sdirk3", [0.982_442_774, 0.279_063, 0.002_87]),
        ("crouzeix3", [0.965_272_244, 0.741_936, 0.732_052]),
        ("sdirk4", [0.999_982_119, 0.745_007, 0.009_33]),
        ("gauss2", [1.0, 1.0, 1.0]),
        ("radau-iia2", [0.987_729_597, 0.204_398, 0.002]),
        ("radau-iia3", [0.999_869_307, 0.321_403, 0.003]),
    ];
    for (name, expected) in rows {
        let curve = amplification_curve(spec(name), &[1.0, 10.0, 1000.0]).unwrap();
        for i in 0..3 {
            // Tolerances for the digits of the table.
            let tolerance = [2e-9, 6e-5, 5e-2][i];
            let formula = (curve.formula[i] / expected[i] - 1.0).abs();
            assert!(formula < tolerance, "{name} at {}: {} {}", curve.z[i], curve.formula[i], expected[i]);
            let measured = (curve.measured[i] / curve.formula[i] - 1.0).abs();
            assert!(measured < 1e-6, "{name} at {}: {} {}", curve.z[i], curve.measured[i], curve.formula[i]);
        }
    }
    assert!(amplification_curve(spec("quasi-static"), &[1.0]).is_none());
}

#[test]
fn what_is_measured_is_the_formula_of_every_scheme() {
    let z: Vec<f64> = (-4..=6).map(|i| 10f64.powf(0.5 * f64::from(i))).collect();
    for integrator in IntegratorSpec::ALL {
        let Some(curve) = amplification_curve(*integrator, &z) else { continue };
        for i in 0..z.len() {
            let (measured, formula) = (curve.measured[i], curve.formula[i]);
            assert!(
                (measured / formula - 1.0).abs() < 1e-5,
                "{} at {}: {measured} {formula}",
                curve.integrator,
                z[i]
            );
        }
    }
}

// 2 / omega: a hundred times the stiffness has a tenth of the step; every outcome occurs.
#[test]
fn a_map_has_the_slope_of_the_limit() {
    let source = Source::new("test", text("velocity-verlet", 1e-3));
    let around =
        measure_limit(&scene("velocity-verlet", 1e-3), spec("velocity-verlet"), 1.0, &Arc::default())
            .unwrap()
            .unwrap()
            .measured;
    for (against, exponent) in [(Against::Young, -0.5), (Against::Density, 0.5)] {
        let found =
            map(&source, spec("velocity-verlet"), against, around, true, &Arc::default()).unwrap().unwrap();
        for (row, value) in found.values.iter().enumerate() {
            let limit = found.predicted[row].unwrap();
            assert!((limit / (around * value.powf(exponent)) - 1.0).abs() < 3e-3, "{limit} {around}");
            for (column, step) in
                found.steps.iter().enumerate().filter(|(_, s)| (*s / limit - 1.0).abs() > 0.01)
            {
                let expected = if *step < limit { AttemptStatus::Ok } else { AttemptStatus::Diverged };
                assert_eq!(found.status[row][column], expected, "{against:?} {value} {step}");
            }
        }
    }
    let poisson = map(&source, spec("velocity-verlet"), Against::Poisson, around, true, &Arc::default())
        .unwrap()
        .unwrap();
    assert!(poisson.predicted[3] < poisson.predicted[0]);
    let particles = Source::new(
        "test",
        "dimension = 2\ntime = { integrator = 'rk4', step = 1e-3, duration = 1.0 }\n[[body]]\n\
         mesh = { inline = { points = [[0, 0]] } }\nmass = { total = 1.0 }\n",
    );
    let error =
        map(&particles, spec("rk4"), Against::Young, 1e-3, true, &Arc::default()).unwrap_err().to_string();
    assert!(error.contains("Young's modulus") && error.contains("mapped against density"), "{error}");
}

// Two masses at a distance r: the squared frequencies are proportional to G (m_1 + m_2) / r^3, and
// therefore to G and to the masses.
#[test]
fn orbits_are_mapped_against_what_they_have() {
    let source = Source::new(
        "test",
        "dimension = 2\ntime = { integrator = 'velocity-verlet', step = 1e-3, duration = 1.0 }\n\
         world = { nbody = { constant = 1.0 } }\n[[body]]\n\
         mesh = { inline = { points = [[0, 0], [1, 0]] } }\nmass = { per_vertex = [1.0, 1e-3] }\n",
    );
    let scene = source.scene().unwrap();
    assert_eq!(Against::of(&scene), [Against::Density, Against::Gravity]);
    assert_eq!(Against::chosen(&scene), Against::Gravity);
    for against in [Against::Density, Against::Gravity] {
        let found =
            map(&source, spec("velocity-verlet"), against, 1e-3, true, &Arc::default()).unwrap().unwrap();
        let one = found.values.iter().position(|value| *value == 1.0).unwrap();
        for (value, limit) in found.values.iter().zip(&found.predicted) {
            let ratio = limit.unwrap() / found.predicted[one].unwrap() * value.sqrt();
            assert!((ratio - 1.0).abs() < 3e-3, "{against:?} times {value}: {limit:?}");
        }
    }
}

#[test]
fn a_solve_that_fails_is_told_apart_from_a_run_that_diverges() {
    let mut simulation =
        with_step(&scene("implicit-euler", 1e-3), spec("implicit-euler"), 0.1, &Arc::default()).unwrap();
    let none =
        pliant::solver::SolverOptions { max_iterations: 1, tolerance: Some(0.0), ..Default::default() };
    simulation.set_solver(none);
    assert_eq!(attempt(&mut simulation, 10), AttemptStatus::Unsolved);
}

// A1: forward Euler multiplies the energy of a mode by 1 + z^2 in each step; implicit Euler divides by it.
#[test]
fn energy_drifts_as_the_amplification_says() {
    let source = "dimension = 2\ntime = { integrator = 'rk4', step = 1e-3, duration = 1.0, allow_unstable = \
                  true }\n[[body]]\n\
         mesh = { inline = { points = [[0, 0], [1, 0]], edges = [[0, 1]] } }\nsprings = { stiffness = 1.0 }\n\
         mass = { per_vertex = 1.0 }\npin = [{ vertices = [0] }]\nposition = { displacement = [[0, 0], \
         [0.1, 0]] }\n";
    let scene = Scene::from_toml(source).unwrap();
    let (step, duration) = (1e-3f64, 10.0);
    for (name, sign) in [("forward-euler", 1.0), ("implicit-euler", -1.0)] {
        let drift = energy_drift(&scene, spec(name), step, duration, &Arc::default()).unwrap().unwrap();
        let expected = sign * step.powi(2).ln_1p() / step;
        assert!((drift.per_second / expected - 1.0).abs() < 0.02, "{name}: {drift:?} {expected}");
    }
    let drift = energy_drift(&scene, spec("velocity-verlet"), 0.1, 1000.0, &Arc::default()).unwrap().unwrap();
    assert!(drift.per_second.abs() < 1e-7 && drift.amplitude < 3e-3, "{drift:?}");
}
