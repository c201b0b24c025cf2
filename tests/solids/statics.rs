//! Static equilibrium, by the quasi-static scheme.

use pliant::diagnostics::Diagnostics;
use pliant::run::Outcome;
use pliant::simulation::{Simulation, StepError};
use pliant::solver::{SolveFailure, SolverOptions};
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError};
use serde_json::json;

use crate::support::{largest_difference, method, run_watched};

use crate::support::solid::{Solid, at_zero, isotropic};

/// The beam of W1: 4 m x 1 m, 8 x 2 cells, clamped at x = 0, under gravity.
fn beam(material: &str) -> Solid {
    let mut solid = Solid::grid(&[8, 2], &[4.0, 1.0], isotropic(material, 1e6, 0.3));
    solid.pin = at_zero(2, 0);
    solid.gravity = Some(vec![0.0, -9.81]);
    solid
}

fn tip(simulation: &Simulation) -> [f64; 2] {
    let x = simulation.state().x();
    [x[x.len() - 2] - 4.0, x[x.len() - 1] - 1.0]
}

// C13 W1, static equilibrium
#[test]
fn a_beam_hangs_where_the_plan_has_it() {
    let rows = [
        ("neo-hookean", [-0.158_125_211_285, -1.900_663_540_57]),
        ("stable-neo-hookean", [-0.169_116_128_200, -1.905_800_605_502]),
        ("fixed-corotated", [-0.162_785_870_113, -1.873_119_779_89]),
        ("stvk", [-0.173_098_852_093, -1.779_916_283_52]),
    ];
    for (material, expected) in rows {
        let mut simulation = beam(material).simulation(method("quasi-static"), 1.0);
        simulation.set_solver(SolverOptions { tolerance: Some(1e-12), ..SolverOptions::default() });
        simulation.step().unwrap();
        let error = largest_difference(&tip(&simulation), &expected);
        assert!(error < 1e-10, "{material}: tip off by {error:e} m");
        assert!(simulation.state().v().iter().all(|v| *v == 0.0));
        // In equilibrium already, the next step finds it at once.
        let before = simulation.work().solver.unwrap().newton_iterations;
        simulation.step().unwrap();
        assert!(simulation.work().solver.unwrap().newton_iterations <= before + 2, "{material}");
    }
}

/// The message of a step that is not solved, and the state, which is what it was.
fn unsolved(mut simulation: Simulation) -> (StepError, SolveFailure) {
    let before = simulation.state().x().to_vec();
    let error = simulation.step().unwrap_err();
    assert_eq!(simulation.state().x(), before);
    let StepError::Unsolved { verdict, .. } = error else { panic!("{error}") };
    (error, verdict)
}

#[test]
fn a_body_that_nothing_holds_has_no_equilibrium() {
    let mut solid = beam("stable-neo-hookean");
    solid.pin = json!([]);
    let (error, verdict) = unsolved(solid.simulation(method("quasi-static"), 1.0));
    assert_eq!(verdict, SolveFailure::Indefinite, "{error}");
    assert!(error.to_string().contains("without stiffness or mass"), "{error}");
}

/// A block of 2 m x 0.8 m, clamped at x = 0 unless `pin` says otherwise, with more `keys`, taken to t = 1 in
/// `steps` increments: what is stored at the end, what loads, gravity and motion brought in, and the
/// measurements at both ends.
fn loaded(material: &str, keys: &str, world: &str, steps: usize) -> [Diagnostics; 2] {
    let pin = if keys.contains("pin =") {
        ""
    } else {
        "pin = [{ half_space = { normal = [1, 0], offset = 0.0 } }]"
    };
    let text = format!(
        "dimension = 2\ntime = {{ integrator = 'quasi-static', step = {:?}, duration = 1.0, solver = {{ \
         tolerance = 1e-13 }} }}\n\
         world = {{ {world} }}\n[[body]]\nmesh = {{ grid = {{ cells = [4, 2], size = [2.0, 0.8] }} }}\n\
         elastic = {{ {material} = {{ young = 2e5, poisson = 0.35 }} }}\nmass = {{ density = 900.0 \
         }}\n{pin}\n{keys}\n",
        1.0 / steps as f64
    );
    let scene = Scene::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let mut simulation = scene.assemble(UnstableStep::Refuse).map_err(SceneError::new).unwrap().simulation;
    let start = simulation.diagnostics();
    (0..steps).for_each(|_| simulation.step().unwrap());
    [start, simulation.diagnostics()]
}

const TRACTION: &str =
    "load = [{ half_space = { normal = [-1, 0], offset = -2.0 }, traction = ['3e3 * t', '-2e3 * t'] }]";

/// Clapeyron: a force that grows in proportion to the displacement does half the work of the whole force on
/// the whole way, and that is what is stored; the trapezoidal rule is exact for it, however many increments
/// there are.
#[test]
fn the_work_of_a_load_on_a_linear_body_is_the_energy_that_it_stores() {
    for steps in [1, 2, 5] {
        let [start, end] = loaded("linear", TRACTION, "", steps);
        let brought_in = end.balance.unwrap().loads.unwrap();
        // What it brought in, and what its potential lost.
        let work = brought_in + start.loads.unwrap() - end.loads.unwrap();
        assert!(start.elastic == 0.0 && end.elastic > 1.0, "{end:?}");
        assert!((work / end.elastic - 1.0).abs() < 1e-9, "{steps}: {work} J of {} J", end.elastic);
        assert!((end.loads.unwrap() / end.elastic + 2.0).abs() < 1e-9, "{end:?}");
    }
}

/// Energy in is energy stored to second order in the increment, whatever brings it in: pressure that follows
/// the surface, dead loads, gravity that changes, prescribed motion, and all at once.
#[test]
fn the_work_between_equilibria_is_exact_to_second_order() {
    let pressure = "load = [{ half_space = { normal = [0, -1], offset = -0.8 }, pressure = '2000 * t' }]";
    let moved = "pin = [{ half_space = { normal = [1, 0], offset = 0 } }, { half_space = { normal = [-1, \
                 0], offset = -2 }, motion = { displacement = ['0.2 * t', '-0.5 * t^2'] } }]";
    let falling = "gravity = ['3 * t', '-9.81 * t']";
    let all = format!("{moved}\n{pressure}");
    for (what, keys, world) in [
        ("pressure", pressure, ""),
        ("traction", TRACTION, ""),
        ("gravity", "", falling),
        ("motion", moved, ""),
        ("all", &all, falling),
    ] {
        let off = |steps: usize| {
            let [start, end] = loaded("neo-hookean", keys, world, steps);
            // Moving pins have velocities, and count as kinetic energy, in statics too.
            assert!(end.elastic > 10.0, "{what}: {end:?}");
            (end.conserved() - start.conserved()).abs()
        };
        let (coarse, fine) = (off(8), off(16));
        let order = (coarse / fine).log2();
        // The velocities of prescribed motion are known: alone, its work is of fourth order.
        let is_right = order > 1.8 && (what == "motion" || order < 2.2);
        assert!(is_right, "{what}: order {order}, {coarse:e} J, {fine:e} J");
    }
}

/// Equilibria have no energy that a run could be judged by: a body loaded from nothing is no body that blows
/// up.
#[test]
fn a_quasi_static_run_is_not_judged_by_its_energy() {
    let mut solid = beam("stable-neo-hookean");
    solid.gravity = None;
    solid.load = json!([{ "half_space": { "normal": [0.0, -1.0], "offset": -1.0 }, "pressure": "1e3 * t" }]);
    let mut simulation = solid.simulation(method("quasi-static"), 0.1);
    let summary = run_watched(&mut simulation, 1.0, 10.0);
    assert!(matches!(summary.outcome, Outcome::Done), "{summary:?}");
    assert!(summary.is_static && summary.end.elastic > 1.0, "{summary:?}");
    let errors =
        [summary.relative_energy_drift(), summary.relative_energy_error(), summary.relative_energy_gain()];
    assert_eq!(errors, [None; 3]);
}
