//! Gradients against central differences of the program's own runs.

use pliant::simulation::Simulation;
use pliant_gradient::{Loss, LossFrame, ParameterSelection, RunGradient, UNLIMITED, gradient};
use pliant_scene::Scene;

use crate::solid::assembled;
use crate::support::{compare_with_differences, dot, scattered};

/// Looks at the last state and at one on the way, at all numbers.
pub(crate) struct ScatteredLoss {
    steps: u64,
    w_x: Vec<f64>,
    w_v: Vec<f64>,
    /// Sizes of the steps [s] and times at their ends [s], where they follow the error.
    chosen: Option<Vec<[f64; 2]>>,
}

impl ScatteredLoss {
    /// Of runs of so many steps, of the sizes that they have from the start of `simulation`.
    pub(crate) fn new(steps: u64, mut simulation: Simulation) -> Self {
        let coordinates = simulation.state().x().len();
        let chosen = simulation.step_control().is_some().then(|| {
            let mut step = |_: u64| {
                simulation.step().unwrap();
                [simulation.last_step_size(), simulation.state().time]
            };
            (0..steps).map(&mut step).collect()
        });
        let [w_x, w_v] = [3.0, 4.0].map(|seed| scattered(coordinates, seed));
        ScatteredLoss { steps, w_x, w_v, chosen }
    }

    /// The loss of a run of `simulation`, and the sum of the magnitudes of its terms.
    pub(crate) fn of_perturbed(&mut self, simulation: &mut Simulation) -> (f64, f64) {
        let value = self.of_run(simulation, |_| {});
        let terms = simulation.positions().iter().zip(&self.w_x).map(|(x, w)| (x * w).abs()).sum();
        (value, terms)
    }

    /// The loss of a run of `simulation`; `seen` is shown its states.
    fn of_run(&mut self, simulation: &mut Simulation, mut seen: impl FnMut(&Simulation)) -> f64 {
        let mut value = 0.0;
        for step in 0..=self.steps {
            if step > 0 {
                match &self.chosen {
                    Some(chosen) => {
                        let [size, end] = chosen[step as usize - 1];
                        simulation.repeat_step(size, end).unwrap();
                    }
                    None => simulation.step().unwrap(),
                }
                seen(simulation);
            }
            let (x, v) = (simulation.positions(), simulation.velocities());
            let mut bars = [vec![0.0; x.len()], vec![0.0; x.len()]];
            let [x_bar, v_bar] = &mut bars;
            value += self.frame(&LossFrame { step, time: 0.0, x: &x, v: &v }, x_bar, v_bar);
        }
        value
    }
}

impl Loss for ScatteredLoss {
    fn frame(&mut self, frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]) -> f64 {
        if frame.step == self.steps {
            x_bar.iter_mut().zip(&self.w_x).for_each(|(bar, w)| *bar += w);
            v_bar.iter_mut().zip(&self.w_v).for_each(|(bar, w)| *bar += 1e-2 * w);
            dot(&self.w_x, frame.x) + 1e-2 * dot(&self.w_v, frame.v)
        } else if frame.step == self.steps / 2 {
            x_bar.iter_mut().zip(&self.w_v).for_each(|(bar, w)| *bar += w);
            dot(&self.w_v, frame.x)
        } else {
            0.0
        }
    }
}

/// Compares the derivatives along one direction of all positions and velocities; what is asked for must be
/// `seen` after some step.
pub(crate) fn compare_starts(
    what: &str,
    scene: &Scene,
    (steps, tolerance): (u64, f64),
    seen: impl Fn(&Simulation) -> bool,
) -> RunGradient {
    let start = || assembled(scene).0;
    let (n, d) = (start().state().x().len(), start().system().dimension());
    let [mut x_dot, mut v_dot] = [1.0, 2.0].map(|seed| scattered(n, seed));
    let weights = start().numbering().to_original(start().system().inverse_mass(), d).into_owned();
    v_dot.iter_mut().zip(&weights).filter(|(_, weight)| **weight == 0.0).for_each(|(dot, _)| *dot = 0.0);
    if start().system().has_prescribed_motion() {
        // Where a pin is comes from its motion, not from the state.
        x_dot.iter_mut().zip(&weights).filter(|(_, weight)| **weight == 0.0).for_each(|(dot, _)| *dot = 0.0);
    }
    let mut loss = ScatteredLoss::new(steps, start());
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
        loss.of_run(&mut simulation, |now| was_seen |= seen(now))
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

/// Compares the derivative by the shape at rest along its change with a number, of scenes that are made of it
/// and start where that leaves them; changes of it are measured by a `size`.
pub(crate) fn compare_shape(
    what: &str,
    scene_of: impl Fn(f64) -> Scene,
    (body, size): (&str, f64),
    (steps, tolerance): (u64, f64),
) {
    let scene = scene_of(0.0);
    let (mut simulation, topology) = assembled(&scene);
    let names = [&format!("body.{body}.rest"), "position", "velocity"];
    let mut selection = ParameterSelection::new(&scene, &topology, simulation.numbering(), &names)
        .unwrap_or_else(|error| panic!("{what}: {error}"));
    let mut loss = ScatteredLoss::new(steps, assembled(&scene).0);
    let found = gradient(&mut simulation, steps, &mut loss, selection.parameters(), UNLIMITED).unwrap();
    let parts = selection.parts(&found);
    // Velocities that go by the shape are no linear functions of it.
    let part = 1e-3;
    let [(ahead, shape_ahead), (behind, shape_behind)] =
        [part * size, -part * size].map(|h| assembled(&scene_of(h)));
    let half = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| 0.5 * (a - b) / part).collect::<Vec<_>>();
    let shape = half(&shape_ahead.rest_positions, &shape_behind.rest_positions);
    let by_shape = dot(&parts[0], &shape);
    let by_start = dot(&parts[1], &half(&ahead.positions(), &behind.positions()))
        + dot(&parts[2], &half(&ahead.velocities(), &behind.velocities()));
    let by = by_shape + by_start;
    assert!(by_shape.abs() > 1e-2 * by.abs(), "{what}: nothing to compare");
    compare_with_differences(
        &format!("{what}, by rest"),
        (by, by.abs() + by_shape.abs()),
        (1e-1, tolerance),
        |h| loss.of_run(&mut assembled(&scene_of(h * size)).0, |_| {}),
    );
}

/// Compares the derivatives by these coordinates of the shape at rest, of scenes that are made of it and
/// start at rest; changes of each are measured by a `size`. Coordinates of which little is made are left out.
pub(crate) fn compare_coordinates(
    what: &str,
    scene_of: impl Fn(&[f64]) -> Scene,
    (body, rest, size): (&str, &[f64], f64),
    coordinates: impl Iterator<Item = usize>,
    (steps, tolerance): (u64, f64),
) {
    let scene = scene_of(rest);
    let (mut simulation, topology) = assembled(&scene);
    assert_eq!(topology.rest_positions, rest, "{what}");
    let names = [&format!("body.{body}.rest"), "position"];
    let mut selection = ParameterSelection::new(&scene, &topology, simulation.numbering(), &names)
        .unwrap_or_else(|error| panic!("{what}: {error}"));
    let mut loss = ScatteredLoss::new(steps, assembled(&scene).0);
    let found = gradient(&mut simulation, steps, &mut loss, selection.parameters(), UNLIMITED).unwrap();
    let parts = selection.parts(&found);
    let largest = parts[0].iter().fold(0.0, |largest: f64, by| largest.max(by.abs()));
    let (mut compared, mut all) = (0, 0);
    for i in coordinates {
        let by = parts[0][i] + parts[1][i];
        all += 1;
        if parts[0][i].abs() < 0.1 * largest || by.abs() < 0.1 * largest {
            continue;
        }
        compared += 1;
        compare_with_differences(
            &format!("{what}, coordinate {i}"),
            (size * by, size * largest),
            (1e-1, tolerance),
            |h| {
                let mut moved = rest.to_vec();
                moved[i] += h * size;
                loss.of_run(&mut assembled(&scene_of(&moved)).0, |_| {})
            },
        );
    }
    assert!(4 * compared >= all, "{what}: {compared} of {all} coordinates compared");
}

/// Compares the derivatives by each of the numbers of this name, of scenes that are made of them, where they
/// are `values`; changes of each are measured by its own part of `sizes`.
pub(crate) fn compare_numbers(
    what: &str,
    scene_of: impl Fn(&[f64]) -> Scene,
    (name, values, sizes): (&str, &[f64], &[f64]),
    (steps, tolerance): (u64, f64),
) {
    let scene = scene_of(values);
    let (mut simulation, topology) = assembled(&scene);
    let mut selection = ParameterSelection::new(&scene, &topology, simulation.numbering(), &[name])
        .unwrap_or_else(|error| panic!("{what}: {error}"));
    let mut loss = ScatteredLoss::new(steps, assembled(&scene).0);
    let found = gradient(&mut simulation, steps, &mut loss, selection.parameters(), UNLIMITED).unwrap();
    let parts = &selection.parts(&found)[0];
    assert_eq!(parts.len(), values.len(), "{what}, by {name}");
    for (i, (part, size)) in parts.iter().zip(sizes).enumerate() {
        let by = size * part;
        let what = format!("{what}, by number {i} of {name}");
        compare_with_differences(&what, (by, by.abs()), (1e-2, tolerance), |h| {
            let mut changed = values.to_vec();
            changed[i] += h * size;
            loss.of_run(&mut assembled(&scene_of(&changed)).0, |_| {})
        });
    }
}

/// Compares the derivative by the first of the numbers of this name, of scenes that are made of it, where it
/// is `value`; changes of it are measured by a `size`.
pub(crate) fn compare_number(
    what: &str,
    scene_of: impl Fn(f64) -> Scene,
    (name, value, size): (&str, f64, f64),
    (steps, tolerance): (u64, f64),
) {
    let scene = scene_of(value);
    let (mut simulation, topology) = assembled(&scene);
    let mut selection = ParameterSelection::new(&scene, &topology, simulation.numbering(), &[name])
        .unwrap_or_else(|error| panic!("{what}: {error}"));
    let mut loss = ScatteredLoss::new(steps, assembled(&scene).0);
    let found = gradient(&mut simulation, steps, &mut loss, selection.parameters(), UNLIMITED).unwrap();
    let by = size * selection.parts(&found)[0][0];
    compare_with_differences(&format!("{what}, by {name}"), (by, by.abs()), (1e-2, tolerance), |h| {
        loss.of_run(&mut assembled(&scene_of(value + h * size)).0, |_| {})
    });
}
