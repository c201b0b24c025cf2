//! Muscles, whose stiffness changes with time: against differences of runs.

use pliant::simulation::Simulation;
use pliant_gradient::{LossFrame, ParameterSelection, UNLIMITED, gradient, tangent};
use pliant_scene::Scene;

use crate::by_parameters::compare;
use crate::differences::{compare_number, compare_numbers};
use crate::solid::{Further, assembled, scene};
use crate::support::{case, dot, scattered, schemes, solve_exactly};

/// About a third of Young's modulus of the beam at its height, all over it and at an angle to it.
const MUSCLE: &str =
    "muscle = [{ fibre = { direction = [2, 'X + 1'] }, tension = '4e3 * (1 + Y) * sin(9*t + 0.5)' }]";

fn beam(scheme: &str, steps: u64) -> Scene {
    scene(
        &case("beam")["setup"],
        "neo-hookean",
        scheme,
        steps,
        Further { body: MUSCLE, ..Further::default() },
    )
}

fn start(scheme: &str, steps: u64) -> Simulation {
    let mut simulation = assembled(&beam(scheme, steps)).0;
    solve_exactly(&mut simulation);
    simulation
}

/// A loss at the end of a run, `weights . x`.
fn at_end(steps: u64, weights: &[f64]) -> impl FnMut(&LossFrame<'_>, &mut [f64], &mut [f64]) -> f64 {
    move |frame, x_bar, _| {
        if frame.step < steps {
            return 0.0;
        }
        x_bar.copy_from_slice(weights);
        dot(weights, frame.x)
    }
}

/// By initial velocities: at a change of 1e-4, differences are good to the square of it, and to rounding over
/// it.
#[test]
fn steps_with_a_muscle_have_derivatives_by_every_scheme() {
    const STEPS: u64 = 12;
    for scheme in schemes().into_iter().filter(|scheme| *scheme != "quasi-static") {
        let inverse_mass = start(scheme, STEPS).system().inverse_mass().to_vec();
        let n = inverse_mass.len();
        let weights = scattered(n, 3.0);
        // Held vertices have no velocity to change.
        let free = |(c, w): (f64, &f64)| if *w > 0.0 { 1e-4 * c } else { 0.0 };
        let change: Vec<f64> = scattered(n, 1.0).into_iter().zip(&inverse_mass).map(free).collect();
        let end = |sign: f64| {
            let mut simulation = start(scheme, STEPS);
            simulation.state_mut().v_mut().iter_mut().zip(&change).for_each(|(v, dv)| *v += sign * dv);
            (0..STEPS).for_each(|_| simulation.step().unwrap());
            dot(&weights, simulation.state().x())
        };
        let difference = 0.5 * (end(1.0) - end(-1.0));
        let mut loss = at_end(STEPS, &weights);
        let found = gradient(&mut start(scheme, STEPS), STEPS, &mut loss, &mut [], UNLIMITED).unwrap();
        let by = dot(&found.velocity, &change);
        assert!((by / difference - 1.0).abs() < 1e-6, "{scheme}: {by:e}, by differences {difference:e}");
        let forth = tangent(&mut start(scheme, STEPS), STEPS, (&vec![0.0; n], &change), &mut |_, _| {});
        let along = dot(&weights, &forth.unwrap().position);
        assert!((along / by - 1.0).abs() < 1e-10, "{scheme}: {along:e} forwards, {by:e} backwards");
    }
}

#[test]
fn equilibria_with_a_muscle_have_derivatives() {
    const STEPS: u64 = 2;
    let with_young = |factor: f64| {
        let mut text = serde_json::to_value(beam("quasi-static", STEPS)).unwrap();
        let key = &mut text["body"][0]["elastic"]["neo-hookean"]["young"];
        let young = key.as_f64().unwrap() * factor;
        *key = young.into();
        let scene: Scene = serde_json::from_value(text).unwrap();
        let (mut simulation, topology) = assembled(&scene);
        solve_exactly(&mut simulation);
        (young, scene, simulation, topology)
    };
    let (_, scene, mut simulation, topology) = with_young(1.0);
    let weights = scattered(simulation.state().x().len(), 3.0);
    let name = ["body.beam.elastic.young"];
    let mut chosen = ParameterSelection::new(&scene, &topology, simulation.numbering(), &name).unwrap();
    let mut loss = at_end(STEPS, &weights);
    let found = gradient(&mut simulation, STEPS, &mut loss, chosen.parameters(), UNLIMITED).unwrap();
    let by = chosen.parts(&found)[0][0];
    let [(less, low), (more, high)] = [1.0 - 1e-4, 1.0 + 1e-4].map(|factor| {
        let (young, _, mut simulation, _) = with_young(factor);
        (0..STEPS).for_each(|_| simulation.step().unwrap());
        (young, dot(&weights, simulation.state().x()))
    });
    let difference = (high - low) / (more - less);
    assert!((by / difference - 1.0).abs() < 1e-6, "{by:e}, by differences {difference:e}");
}

/// By its tension, by a factor of it, and by what its formula names.
#[test]
fn numbers_of_a_muscle_are_parameters() {
    for scheme in ["velocity-verlet", "implicit-euler", "newmark(.3025,.6)"] {
        let with = |tension: String| {
            let mut beam = scene(&case("beam")["setup"], "neo-hookean", scheme, 12, Further::default());
            let muscle = serde_json::json!({ "fibre": { "direction": [2, "X + 1"] }, "tension": tension });
            beam.body[0].muscle = vec![serde_json::from_value(muscle).unwrap()];
            beam
        };
        let wave = |a: f64, w: f64, k: f64| {
            with(format!("A*(1 + Y)*sin(w*t + k*X) where A = {a:?}, w = {w:?}, k = {k:?}"))
        };
        let name = |number: &str| format!("body.beam.muscle.0.{number}");
        let a = |a| wave(a, 9.0, 0.5);
        compare_number(scheme, a, (&name("parameters.A"), 4e3, 4e3), (12, 1e-7));
        let w = |w| wave(4e3, w, 0.5);
        compare_number(scheme, w, (&name("parameters.w"), 9.0, 9.0), (12, 1e-7));
        let k = |k| wave(4e3, 9.0, k);
        compare_number(scheme, k, (&name("parameters.k"), 0.5, 1.0), (12, 1e-7));
        let factor = |f: f64| with(format!("{f:?}*4e3*(1 + Y)*sin(9*t)"));
        compare_number(scheme, factor, (&name("factor"), 1.0, 1.0), (12, 1e-7));
        let more = |more: f64| with(format!("4e3*(1 + Y)*sin(9*t) + {more:?}"));
        compare_number(scheme, more, (&name("tension"), 0.0, 4e3), (12, 1e-7));
    }
}

/// Of any length, one for each element.
#[test]
fn directions_of_fibres_in_each_element_have_derivatives() {
    for (setup, scheme, steps) in [
        ("beam", "velocity-verlet", 20),
        ("beam", "implicit-euler", 12),
        ("beam", "quasi-static", 1),
        ("box", "velocity-verlet", 12),
    ] {
        let d = if setup == "beam" { 2 } else { 3 };
        let count = if setup == "beam" { 6 } else { 12 };
        let directions: Vec<f64> = scattered(count * d, 3.0).iter().map(|c| 1.0 + 1.5 * c).collect();
        let of = |directions: &[f64]| {
            let mut scene = scene(&case(setup)["setup"], "neo-hookean", scheme, steps, Further::default());
            let rows: Vec<&[f64]> = directions.chunks(d).collect();
            let muscle =
                serde_json::json!({ "fibre": { "per_element": rows }, "tension": "6e3*(1 + Y)*cos(9*t)" });
            scene.body[0].muscle = vec![serde_json::from_value(muscle).unwrap()];
            scene
        };
        let name = format!("body.{}.muscle.0.fibre.per_element", of(&directions).body[0].name_or_default(0));
        compare_numbers(setup, of, (&name, &directions, &vec![1.0; count * d]), (steps, 1e-6));
        compare(setup, &of(&directions), &[&name], steps);
    }
}
