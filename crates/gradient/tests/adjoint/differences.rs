//! Gradients against central differences of the program's own runs.

use pliant::simulation::Simulation;
use pliant_gradient::{LossFrame, RunGradient, UNLIMITED, gradient};
use pliant_scene::Scene;

use crate::solid::assembled;
use crate::support::{compare_with_differences, dot, scattered};

/// Compares the derivatives along one direction of all positions and velocities, of a loss that looks at the
/// last state and at one on the way; what is asked for must be `seen` after some step.
pub(crate) fn compare_starts(
    what: &str,
    scene: &Scene,
    (steps, tolerance): (u64, f64),
    seen: impl Fn(&Simulation) -> bool,
) -> RunGradient {
    let start = || assembled(scene).0;
    let (n, d) = (start().state().x().len(), start().system().dimension());
    let [mut x_dot, mut v_dot, w_x, w_v] = [1.0, 2.0, 3.0, 4.0].map(|seed| scattered(n, seed));
    let weights = start().numbering().to_original(start().system().inverse_mass(), d).into_owned();
    v_dot.iter_mut().zip(&weights).filter(|(_, weight)| **weight == 0.0).for_each(|(dot, _)| *dot = 0.0);
    if start().system().has_prescribed_motion() {
        // Where a pin is comes from its motion, not from the state.
        x_dot.iter_mut().zip(&weights).filter(|(_, weight)| **weight == 0.0).for_each(|(dot, _)| *dot = 0.0);
    }
    let part = |step: u64, x: &[f64], v: &[f64]| match step {
        step if step == steps => dot(&w_x, x) + 1e-2 * dot(&w_v, v),
        step if step == steps / 2 => dot(&w_v, x),
        _ => 0.0,
    };
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]| {
        if frame.step == steps {
            x_bar.iter_mut().zip(&w_x).for_each(|(bar, w)| *bar += w);
            v_bar.iter_mut().zip(&w_v).for_each(|(bar, w)| *bar += 1e-2 * w);
        } else if frame.step == steps / 2 {
            x_bar.iter_mut().zip(&w_v).for_each(|(bar, w)| *bar += w);
        }
        part(frame.step, frame.x, frame.v)
    };
    let mut simulation = start();
    let found = gradient(&mut simulation, steps, &mut loss, &mut [], UNLIMITED).unwrap();
    assert_eq!(found.unsettled, 0, "{what}");
    let mut was_seen = false;
    let mut moved = |by_x: f64, by_v: f64| {
        let mut simulation = start();
        let [dx, dv] = [&x_dot, &v_dot].map(|dots| simulation.numbering().to_internal(dots, d).into_owned());
        let state = simulation.state_mut();
        state.x_mut().iter_mut().zip(&dx).for_each(|(x, dx)| *x += by_x * dx);
        state.v_mut().iter_mut().zip(&dv).for_each(|(v, dv)| *v += by_v * dv);
        let mut value = part(0, &simulation.positions(), &simulation.velocities());
        for step in 1..=steps {
            simulation.step().unwrap();
            value += part(step, &simulation.positions(), &simulation.velocities());
            was_seen |= seen(&simulation);
        }
        value
    };
    let by = |gradient: &[f64], dots: &[f64]| {
        let parts: Vec<f64> = gradient.iter().zip(dots).map(|(by, dot)| by * dot).collect();
        (parts.iter().sum::<f64>(), dot(&parts, &parts).sqrt())
    };
    let of = format!("{what}, by positions");
    compare_with_differences(&of, by(&found.position, &x_dot), (1e-5, tolerance), |h| moved(h, 0.0));
    if !simulation.method().is_static() {
        let of = format!("{what}, by velocities");
        compare_with_differences(&of, by(&found.velocity, &v_dot), (1e-3, tolerance), |h| moved(0.0, h));
    }
    assert!(was_seen, "{what}: nothing touches");
    found
}
