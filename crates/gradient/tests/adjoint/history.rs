//! A law that remembers: a solid with one Maxwell branch in Green's strain, through steps, states and
//! gradients.

use pliant::algebra::Mat;
use pliant::energy::elastic::{HistoryLaw, RememberingElements};
use pliant::scalar::Scalar;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;
use pliant_gradient::{GradientError, LossFrame, RunDirection, UNLIMITED, gradient, tangent_along};

use crate::support::{compare, method, scattered, solve_exactly};

const MU: f64 = 40.0;
const LAMBDA: f64 = 60.0;
const BRANCH: f64 = 120.0;
const TIME: f64 = 0.07;

/// `psi = mu/2 (tr C - 2 - 2 ln J) + lambda/2 ln^2 J + a k/8 |C - Z|^2` with `a = 1 / (1 + s/tau)`: the
/// strain `Z` of the dashpot follows `C` by implicit Euler, `C - Z' = a (C - Z)`.
struct Maxwell;

/// `C - Z`, entries 11, 22 and 12.
fn over<S: Scalar>(f: &Mat<S, 2>, past: &[S; 3]) -> [S; 3] {
    let c = f.transpose_mul(f);
    [c[0][0] - past[0], c[1][1] - past[1], c[0][1] - past[2]]
}

fn kept<S: Scalar>(s: S) -> S {
    S::one() / (S::one() + S::splat(1.0 / TIME) * s)
}

impl HistoryLaw<2, 3> for Maxwell {
    const START: [f64; 3] = [1.0, 1.0, 0.0];

    fn psi<S: Scalar>(&self, f: &Mat<S, 2>, past: &[S; 3], s: S) -> S {
        let (c, log) = (f.transpose_mul(f), f.determinant().ln());
        let elastic = S::splat(0.5 * MU) * (c.trace() - S::splat(2.0) - S::splat(2.0) * log)
            + S::splat(0.5 * LAMBDA) * log * log;
        let [a, b, shear] = over(f, past);
        elastic + kept(s) * S::splat(BRANCH / 8.0) * (a * a + b * b + S::splat(2.0) * shear * shear)
    }

    fn advanced<S: Scalar>(&self, f: &Mat<S, 2>, past: &[S; 3], s: S) -> [S; 3] {
        let (gone, over) = (S::one() - kept(s), over(f, past));
        [0, 1, 2].map(|i| past[i] + gone * over[i])
    }
}

const H: f64 = 5e-3;

/// Two triangles, or one of second order, that were deformed and let go; one vertex is held.
fn simulation(scheme: &str, second_order: bool) -> Simulation {
    simulation_of(scheme, second_order, H)
}

fn simulation_of(scheme: &str, second_order: bool, step: f64) -> Simulation {
    let rest = match second_order {
        false => vec![0.0, 0.0, 1.0, 0.0, 1.1, 0.9, 0.0, 1.0],
        true => vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.5, 0.02, 0.5, 0.5, 0.0, 0.5],
    };
    let mut system = System::new(2, vec![0.5; rest.len() / 2]);
    match second_order {
        false => system.add_term(Box::new(RememberingElements::<2, 3, 3, _>::new(
            "plate",
            Maxwell,
            &[[0, 1, 2], [0, 2, 3]],
            &rest,
        ))),
        true => system.add_term(Box::new(RememberingElements::<2, 6, 3, _>::new(
            "plate",
            Maxwell,
            &[[0, 1, 2, 3, 4, 5]],
            &rest,
        ))),
    };
    system.pin(&[0]);
    let x: Vec<f64> = rest.iter().zip(scattered(rest.len(), 3.0)).map(|(x, s)| 1.2 * x + 0.05 * s).collect();
    let x = rest[..2].iter().chain(&x[2..]).copied().collect();
    let v = scattered(rest.len(), 8.0).into_iter().enumerate().map(|(i, v)| if i < 2 { 0.0 } else { v });
    let mut simulation = Simulation::new(system, State::new(x, v.collect()), method(scheme), step);
    solve_exactly(&mut simulation);
    simulation
}

fn run(simulation: &mut Simulation, steps: usize) {
    (0..steps).for_each(|_| simulation.step().unwrap());
}

/// Exact: with every vertex held, `C - Z` is multiplied by `a` in each step, whatever the scheme, and forces
/// at the end of a step are those at the beginning of the next.
#[test]
fn a_held_strain_relaxes_as_the_law_says() {
    for scheme in ["velocity-verlet", "implicit-euler", "rk4"] {
        let mut simulation = simulation(scheme, false);
        simulation.system_mut().pin(&[1, 2, 3]);
        simulation.set_velocities(&[0.0; 8]);
        let start = over_of(&simulation);
        run(&mut simulation, 12);
        let part = (1.0 + H / TIME).powi(-12);
        let expected: Vec<f64> = start.iter().map(|over| over * part).collect();
        compare(scheme, &over_of(&simulation), &expected, 1e-12);
    }
}

/// `C - Z` of the two triangles, which have one pack: eight lanes of three numbers.
fn over_of(simulation: &Simulation) -> Vec<f64> {
    let (x, history) = (simulation.positions().into_owned(), simulation.system().history());
    let rest = [0.0, 0.0, 1.0, 0.0, 1.1, 0.9, 0.0, 1.0];
    let elements = [[0, 1, 2], [0, 2, 3]];
    let edges = |x: &[f64], [a, b, c]: [usize; 3]| {
        Mat([0, 1].map(|i| [x[2 * b + i] - x[2 * a + i], x[2 * c + i] - x[2 * a + i]]))
    };
    let mut all: Vec<[f64; 3]> = elements
        .map(|element| {
            let f = edges(&x, element).mul(&edges(&rest, element).inverse());
            let c = f.transpose_mul(&f);
            [c[0][0], c[1][1], c[0][1]]
        })
        .to_vec();
    // The order of lanes is that of the patches.
    let lane = |lane: usize| [0, 1, 2].map(|h| history[8 * h + lane]);
    let (own, swapped) = ([lane(0), lane(1)], [lane(1), lane(0)]);
    let distance = |lanes: &[[f64; 3]; 2]| -> f64 {
        all.iter().flatten().zip(lanes.iter().flatten()).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let lanes = if distance(&own) <= distance(&swapped) { own } else { swapped };
    all.iter_mut().zip(lanes).for_each(|(c, past)| c.iter_mut().zip(past).for_each(|(c, z)| *c -= z));
    all.concat()
}

/// A state holds the history: what goes on from a snapshot, a checkpoint or after a trial has the same bits.
#[test]
fn states_hold_the_history() {
    for scheme in ["velocity-verlet", "implicit-midpoint"] {
        let mut straight = simulation(scheme, false);
        run(&mut straight, 6);
        let (moment, checkpoint) = (straight.snapshot(), straight.checkpoint());
        let (mut x, mut v) = (straight.positions().into_owned(), straight.velocities().into_owned());
        straight.advanced(&mut x, &mut v).unwrap();
        assert_eq!(straight.snapshot(), moment, "{scheme}: a trial leaves the state");
        run(&mut straight, 5);
        let end = straight.snapshot();
        let mut other = simulation(scheme, false);
        other.resume(&checkpoint).unwrap();
        run(&mut other, 5);
        assert_eq!(other.snapshot(), end, "{scheme} from a checkpoint");
        other.restore(&moment).unwrap();
        run(&mut other, 5);
        compare(scheme, &other.positions(), &end.x, 1e-12);
        compare(scheme, &other.system().history(), &straight.system().history(), 1e-12);
        let bare = pliant::simulation::Snapshot::new(0, 0.0, end.x.clone(), end.v.clone());
        assert!(other.restore(&bare).unwrap_err().to_string().contains("remembers 0 numbers"));
    }
}

/// Energy, and what is lost of it, is that of the beginning, to the second order of the step.
#[test]
fn the_books_close_to_second_order() {
    let gap = |steps: usize| {
        let mut simulation = simulation_of("velocity-verlet", false, H * 20.0 / steps as f64);
        let start = simulation.diagnostics().total;
        run(&mut simulation, steps);
        let end = simulation.diagnostics();
        let lost = end.balance.unwrap().damping.unwrap();
        assert!(lost > 0.2 * start, "{lost} of {start}");
        (end.total + lost - start).abs() / start
    };
    let (coarse, fine) = (gap(20), gap(80));
    assert!(coarse < 2e-3 && fine < coarse / 10.0, "{coarse:e} {fine:e}");
}

/// Sum of scattered multiples of the squares of all positions and of the last velocities.
fn loss(steps: u64) -> impl FnMut(&LossFrame<'_>, &mut [f64], &mut [f64]) -> f64 {
    move |frame, x_bar, v_bar| {
        let mut value = 0.0;
        for (i, weight) in scattered(frame.x.len(), 1.0 + frame.step as f64).into_iter().enumerate() {
            value += weight * frame.x[i] * frame.x[i];
            x_bar[i] = 2.0 * weight * frame.x[i];
            if frame.step == steps {
                value += weight * frame.v[i];
                v_bar[i] = weight;
            }
        }
        value
    }
}

/// Gradients by the start of schemes of every engine are central differences, through any piece of a run that
/// is taken again.
#[test]
fn gradients_go_through_the_history() {
    const STEPS: u64 = 14;
    for (scheme, second_order) in [
        ("symplectic-euler", false),
        ("velocity-verlet", true),
        ("rk4", false),
        ("implicit-euler", true),
        ("trapezoid", false),
        ("sdirk2", false),
        ("bdf2", false),
        ("generalised-alpha(.8)", false),
        ("gauss2", false),
    ] {
        let start = simulation(scheme, second_order);
        let (x, v) = (start.positions().into_owned(), start.velocities().into_owned());
        let value = |x: &[f64], v: &[f64]| {
            let mut run = simulation(scheme, second_order);
            run.set_positions(x);
            run.set_velocities(v);
            let (mut loss, mut sum) = (loss(STEPS), 0.0);
            let mut rows = [vec![0.0; x.len()], vec![0.0; x.len()]];
            for step in 0..=STEPS {
                let (x, v) = (run.positions().into_owned(), run.velocities().into_owned());
                let [by_x, by_v] = &mut rows;
                sum += loss(&LossFrame { step, time: step as f64 * H, x: &x, v: &v }, by_x, by_v);
                if step < STEPS {
                    run.step().unwrap();
                }
            }
            sum
        };
        let difference = |of_v: bool| -> Vec<f64> {
            let along = |i: usize, step: f64| {
                let (mut x, mut v) = (x.clone(), v.clone());
                (if of_v { &mut v } else { &mut x })[i] += step;
                value(&x, &v)
            };
            (2..x.len()).map(|i| (along(i, 1e-5) - along(i, -1e-5)) / 2e-5).collect()
        };
        for budget in [UNLIMITED, 4000] {
            let found =
                gradient(&mut simulation(scheme, second_order), STEPS, &mut loss(STEPS), &mut [], budget);
            let found = found.unwrap();
            compare(&format!("{scheme} x"), &found.position[2..], &difference(false), 2e-7);
            compare(&format!("{scheme} v"), &found.velocity[2..], &difference(true), 2e-7);
        }
    }
}

/// Tangents are refused.
#[test]
fn tangents_are_refused() {
    let mut run = simulation("rk4", false);
    let still = vec![0.0; run.positions().len()];
    let direction = RunDirection { position: &still, velocity: &still, parameters: &[] };
    let refused = tangent_along(&mut run, 2, direction, &mut [], &mut |_, _| {}).unwrap_err();
    assert!(
        matches!(&refused, GradientError::Unsupported { what, .. } if what.contains("remember")),
        "{refused}"
    );
}
