//! Forces that depend on velocities: what they leave alone, orders of convergence, stability.

use std::ops::Range;

use pliant::dissipation::{
    DissipationViews, DissipativeTerm, MassProportional, MeasuredRate, PositionProducts,
};
use pliant::energy::Stencils;
use pliant::energy::measure::{Length, StencilConstants};
use pliant::energy::spring::Springs;
use pliant::integrator::{Method, amplification};
use pliant::simulation::Simulation;
use pliant::solver::{LinearSolver, SolverOptions};
use pliant::state::State;
use pliant::system::System;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;
use serde_json::{Value, json};

use crate::support::particles::{chain, soft_double_pendulum};
use crate::support::{advance, assert_relative, distance, method, methods, methods_of_measurable_order};

/// A square or cube about the origin, thrown with a spin, gravity on it, stretched at the start, with this
/// damping and ether drag [1/s].
fn thrown(dimension: usize, method: Method, (damping, ether_drag): (&Value, f64), h: f64) -> Simulation {
    let d = dimension;
    let (cells, size, origin) = (vec![3; d], vec![1.0; d], vec![-0.5; d]);
    let mut matrix = vec![vec![0.0; d]; d];
    for i in 0..d {
        matrix[i][i] = [1.15, 0.9, 0.95][i];
    }
    let angular = if d == 2 { json!(5.0) } else { json!([0.0, 0.0, 5.0]) };
    let scene: Scene = serde_json::from_value(json!({
        "dimension": d,
        "time": { "integrator": method.documentation.name, "step": h, "duration": 1.0 },
        "world": { "gravity": ([0.0, -9.81, 0.0][..d]), "ether_drag": ether_drag },
        "body": [{
            "mesh": { "grid": { "cells": cells, "size": size, "origin": origin } },
            "elastic": { "stable-neo-hookean": { "young": 1e5, "poisson": 0.3 } },
            "springs": { "stiffness": 1e4 },
            "damping": damping,
            "mass": { "density": 1000.0 },
            "position": { "affine": { "matrix": matrix } },
            "velocity": { "rigid": { "linear": ([2.0, 5.0, 1.0][..d]), "angular": angular } },
        }],
    }))
    .unwrap();
    scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap().simulation
}

/// Momentum [kg m/s], angular momentum about the centre of mass [kg m^2/s].
fn momenta(simulation: &mut Simulation) -> ([f64; 3], [f64; 3]) {
    let diagnostics = simulation.diagnostics();
    let system = simulation.system();
    let (d, x) = (system.dimension(), simulation.state().x());
    let total: f64 = system.mass().iter().sum();
    let mut centre = [0.0; 3];
    for (x, m) in x.chunks(d).zip(system.mass()) {
        for c in 0..d {
            centre[c] += m * x[c] / total;
        }
    }
    let (p, mut l) = (diagnostics.linear_momentum, diagnostics.angular_momentum);
    for (c, l) in l.iter_mut().enumerate() {
        let (a, b) = ((c + 1) % 3, (c + 2) % 3);
        *l -= centre[a] * p[b] - centre[b] * p[a];
    }
    (p, l)
}

fn norm(a: &[f64]) -> f64 {
    a.iter().map(|a| a * a).sum::<f64>().sqrt()
}

// README, promise 6: every kind of damping but `mass_proportional` and `ether_drag`, at once.
#[test]
fn a_spinning_falling_body_keeps_momentum_and_spin_while_its_vibration_dies() {
    let damping = json!({
        "strain_rate": { "shear": 500.0, "second": 100.0 }, "dashpot": 50.0, "stiffness_proportional": 1e-2,
    });
    for dimension in [2, 3] {
        for name in ["symplectic-euler", "velocity-verlet", "yoshida4"] {
            let mut simulation = thrown(dimension, method(name), (&damping, 0.0), 2.5e-4);
            let mass: f64 = simulation.system().mass().iter().sum();
            let (p, l) = momenta(&mut simulation);
            let power = |s: &mut Simulation| {
                let (x, v) = (s.state().x().to_vec(), s.state().v().to_vec());
                s.system_mut().dissipated_power(&x, &v)
            };
            advance(&mut simulation, 40);
            let before = power(&mut simulation);
            advance(&mut simulation, 7960);
            let after = power(&mut simulation);
            let (mut p_end, l_end) = momenta(&mut simulation);
            p_end[1] += mass * 9.81 * simulation.state().time;
            let change = |a: [f64; 3], b: [f64; 3]| distance(&a, &b) / norm(&b);
            let (p, l) = (change(p_end, p), change(l_end, l));
            assert!(p < 1e-12, "{name} in {dimension}D changes the momentum by {p:e}");
            assert!(l < 1e-12, "{name} in {dimension}D changes the spin by {l:e}");
            // A velocity of symplectic Euler belongs half a step before its position: the body seems to grow
            // at the rate e = h omega^2 / 2 = 3.1e-3 1/s in the plane of its spin. With eta = 885 Pa s and
            // zeta = 677 Pa s that alone is 4 eta e^2 + 4 zeta e^2 = 0.06 W, and the dashpots add to it. The
            // cube, whose mesh has one diagonal, does not turn about a principal axis: it goes on nutating,
            // ever less.
            let bound = match (dimension, name) {
                (2, "symplectic-euler") => 0.1,
                (2, _) => 1e-8 * before,
                _ => 1e-4 * before,
            };
            assert!(before > 1e3 && after < bound, "{name} in {dimension}D: {before:e} W, {after:e} W");
        }
    }
}

// README, promise 6: both slow rigid motion down as exp(-alpha t), Rayleigh's alpha and the drag of the
// ether.
#[test]
fn mass_proportional_damping_and_ether_drag_slow_a_fall_as_they_say() {
    for (name, alpha, drag) in [("mass_proportional", 2.0, 0.0), ("ether_drag", 0.0, 2.0)] {
        let damping = json!({ "mass_proportional": alpha });
        let mut simulation = thrown(2, method("rk4"), (&damping, drag), 2.5e-4);
        let (p, l) = momenta(&mut simulation);
        let mass: f64 = simulation.system().mass().iter().sum();
        advance(&mut simulation, 4000);
        let (p_end, l_end) = momenta(&mut simulation);
        let decay = (-2.0f64).exp();
        assert_relative(p_end[0], p[0] * decay, 1e-10, &format!("{name}: momentum along x"));
        let fall = -mass * 9.81 * (1.0 - decay) / 2.0;
        assert_relative(p_end[1], p[1] * decay + fall, 1e-10, &format!("{name}: momentum along y"));
        assert_relative(l_end[2], l[2] * decay, 1e-6, &format!("{name}: spin"));
    }
}

/// The soft double pendulum with dashpots beside its springs and damping in proportion to the mass, at t =
/// 1.
fn damped_pendulum(method: Method, steps: usize) -> Vec<f64> {
    let mut simulation = soft_double_pendulum(method, 1.0 / steps as f64);
    let rest = simulation.state().x().to_vec();
    let constants = [1.0, 2.0].map(|stiffness| StencilConstants { stiffness, rest: [0.0; 2] });
    let dashpots = MeasuredRate::<Length, 2, 2>::new("pendulum", &[[0, 1], [1, 2]], &constants, &rest);
    let drag = MassProportional::new("pendulum", 0.3, &[1.0, 1.0, 2.0], 0..3, 2);
    simulation.system_mut().add_dissipation(Box::new(dashpots));
    simulation.system_mut().add_dissipation(Box::new(drag));
    advance(&mut simulation, steps);
    [simulation.state().x(), simulation.state().v()].concat()
}

/// The soft double pendulum under ether drag at t = 1, damped besides or not.
fn dragged_pendulum(method: Method, damped: bool, steps: usize) -> Vec<f64> {
    let mut simulation = soft_double_pendulum(method, 1.0 / steps as f64);
    simulation.system_mut().set_ether_drag(1.5);
    if damped {
        let drag = MassProportional::new("pendulum", 0.3, &[1.0, 1.0, 2.0], 0..3, 2);
        simulation.system_mut().add_dissipation(Box::new(drag));
    }
    advance(&mut simulation, steps);
    [simulation.state().x(), simulation.state().v()].concat()
}

// A8, damped: from three step sizes, since there is no closed form.
#[test]
fn every_scheme_keeps_its_order_under_damping() {
    check_orders("damping", damped_pendulum);
}

// Drag split off from the step would leave order 2 of every scheme.
#[test]
fn every_scheme_keeps_its_order_under_ether_drag() {
    check_orders("ether drag", |method, steps| dragged_pendulum(method, false, steps));
    check_orders("ether drag and damping", |method, steps| dragged_pendulum(method, true, steps));
}

/// The order of every scheme, from the positions and velocities that it has after steps of three sizes.
fn check_orders(what: &str, run: impl Fn(Method, usize) -> Vec<f64>) {
    for method in methods_of_measurable_order() {
        let documentation = &method.documentation;
        let steps = match (documentation.order, documentation.solves) {
            (1, _) => 4000,
            // With fewer, higher powers of the step still count.
            (5.., 0) => 100,
            // The most accurate: rounding is near.
            (4.., 1) | (5.., _) => 25,
            _ => 200,
        };
        let [coarse, middle, fine] = [1, 2, 4].map(|n| run(method, n * steps));
        for (quantity, range) in [("position", 2..6), ("velocity", 8..12)] {
            let difference = |a: &[f64], b: &[f64]| distance(&a[range.clone()], &b[range.clone()]);
            let measured = (difference(&coarse, &middle) / difference(&middle, &fine)).log2();
            let documented = f64::from(documentation.order);
            let agrees = (measured - documented).abs() < 0.15;
            assert!(agrees, "{}: {quantity} has order {measured:.3} under {what}", documentation.name);
        }
    }
}

// A1, damped stability: x'' + 2 zeta omega x' + omega^2 x = 0.
#[test]
fn a_damped_oscillator_is_stable_up_to_where_theory_says() {
    for zeta in [0.05, 0.3, 0.7, 1.0, 3.0] {
        let radius =
            |name: &str, z: f64| amplification(&method(name), z, 2.0 * zeta * z, 0.0).spectral_radius();
        let mut limits = vec![("symplectic-euler", 2.0 * ((1.0 + zeta * zeta).sqrt() - zeta))];
        if zeta <= 1.0 {
            limits.push(("forward-euler", 2.0 * zeta));
        }
        for (name, limit) in limits {
            assert!(
                radius(name, (1.0 - 1e-6) * limit) <= 1.0 + 1e-12,
                "{name} at zeta = {zeta}, below {limit}"
            );
            assert!(
                radius(name, (1.0 + 1e-6) * limit) > 1.0 + 1e-9,
                "{name} at zeta = {zeta}, above {limit}"
            );
        }
    }
}

const CHAIN_STIFFNESS: [f64; 4] = [100.0, 400.0, 100.0, 300.0];

/// A chain of springs, pulled a little.
fn free_chain(method: Method, h: f64) -> Simulation {
    chain(method, &[1.0, 2.0, 1.0, 3.0], &CHAIN_STIFFNESS, 1.0, &[1e-3, -2e-3, 1e-3, 1e-3], h)
}

/// The same with dashpots `beta k`.
fn damped_chain(method: Method, beta: f64, h: f64) -> Simulation {
    let mut simulation = free_chain(method, h);
    let edges = [[0, 1], [1, 2], [2, 3], [3, 4]];
    let constants = CHAIN_STIFFNESS.map(|k| StencilConstants { stiffness: beta * k, rest: [0.0; 2] });
    let rest = simulation.state().x().to_vec();
    let dashpots = MeasuredRate::<Length, 2, 2>::new("chain", &edges, &constants, &rest);
    simulation.system_mut().add_dissipation(Box::new(dashpots));
    simulation
}

// A1b, damped: the limit that `pliant check` prints is where the run begins to blow up. With damping in
// proportion to the stiffness the fastest motion is the one damped most.
#[test]
fn the_limit_of_a_damped_system_is_sharp() {
    let limited =
        |m: &Method| m.documentation.stability_limit > 0.0 && m.documentation.stability_limit.is_finite();
    for method in methods().filter(limited) {
        let name = method.documentation.name;
        for beta in [1e-3, 0.02, 0.2] {
            let limit = damped_chain(method, beta, 1.0).stability_limit(1.0).unwrap();
            assert_relative(limit.damping, beta * limit.frequency.powi(2), 1e-5, "strongest damping");
            if name == "symplectic-euler" {
                let zeta = 0.5 * beta * limit.frequency;
                let expected = 2.0 * ((1.0 + zeta * zeta).sqrt() - zeta) / limit.frequency;
                assert_relative(limit.step, expected, 1e-5, "limit of symplectic Euler");
            }
            let undamped = method.documentation.stability_limit / limit.frequency;
            let largest = |h: f64| largest_speed(damped_chain(method, beta, h));
            let below = largest(0.99 * limit.step);
            assert!(below < 1.0, "{name}, beta = {beta}, just below {}: {below} m/s", limit.step);
            // Where the limit is that of the fastest motion undamped, damping may still help.
            if limit.step < undamped * (1.0 - 1e-9) {
                let above = largest(1.01 * limit.step);
                assert!(above > 1.0, "{name}, beta = {beta}, just above {}: {above} m/s", limit.step);
            }
        }
    }
}

/// The chain damped at the rate `alpha` or under that ether drag.
fn slowed_chain(method: Method, alpha: f64, by_drag: bool, h: f64) -> Simulation {
    let mut simulation = free_chain(method, h);
    if by_drag {
        simulation.system_mut().set_ether_drag(alpha);
    } else {
        let mass = [1.0, 1.0, 2.0, 1.0, 3.0];
        let drag = MassProportional::new("chain", alpha, &mass, 0..5, 2);
        simulation.system_mut().add_dissipation(Box::new(drag));
    }
    simulation
}

/// The largest speed in 4000 steps; infinite where one could not be taken.
fn largest_speed(mut simulation: Simulation) -> f64 {
    let mut largest = 0.0f64;
    for _ in 0..4000 {
        if simulation.step().is_err() {
            return f64::INFINITY;
        }
        largest = simulation.state().v().iter().fold(largest, |m, v| m.max(v.abs()));
    }
    largest
}

// Strong damping in proportion to the mass gives the slowest motion the root -alpha, and no motion a larger
// one: the limit is where the real interval of stability ends, |R(-alpha h)| = 1; Hairer, Wanner 1996, table
// IV.2.1, by bisection of the polynomials.
#[test]
fn slow_motion_under_strong_damping_limits_the_step() {
    let exponential =
        |z: f64, terms: i32| (0..=terms).rev().fold(0.0f64, |sum, k| 1.0 + sum * z / f64::from(k + 1));
    let dormand_prince = |z: f64| exponential(z, 5) + z.powi(6) / 600.0;
    let yoshida = |z: f64| {
        let w = 1.0 / (2.0 - 2f64.cbrt());
        let kick = |part: f64| exponential(part * z, 4);
        (kick(0.5 * w) * kick(0.5 - 0.5 * w)).powi(2)
    };
    // Name, stability function, whether drag acts in the stages.
    type Row<'a> = (&'a str, &'a dyn Fn(f64) -> f64, bool);
    let rows: [Row<'_>; 8] = [
        ("forward-euler", &|z: f64| exponential(z, 1), true),
        ("symplectic-euler", &|z: f64| exponential(z, 1), false),
        ("rk2-midpoint", &|z: f64| exponential(z, 2), true),
        ("velocity-verlet", &|z: f64| exponential(0.5 * z, 2).powi(2), false),
        ("bogacki-shampine3", &|z: f64| exponential(z, 3), true),
        ("rk4", &|z: f64| exponential(z, 4), true),
        ("dormand-prince5", &dormand_prince, true),
        ("yoshida4", &yoshida, false),
    ];
    for (name, r, in_stages) in rows {
        let (mut low, mut high) = (0.5, 10.0);
        while r(-high).abs() <= 1.0 {
            high += 1.0;
        }
        while high - low > 1e-12 {
            let middle = 0.5 * (low + high);
            if r(-middle).abs() <= 1.0 { low = middle } else { high = middle }
        }
        // The slowest motion has a frequency of 4 rad/s: its root is alpha but for (4/alpha)^2.
        let alpha = 4000.0;
        for by_drag in [false, true] {
            let limit = |h: f64| slowed_chain(method(name), alpha, by_drag, h).stability_limit(1.0).unwrap();
            let found = limit(1.0);
            if by_drag && !in_stages {
                // An exact flow.
                let free = method(name).documentation.stability_limit / found.frequency;
                // Kicks backwards in time amplify what drag takes.
                let goes_back = name == "yoshida4";
                assert!(goes_back || found.step > 0.9 * free, "{name}: {}, {free} without drag", found.step);
                let below = largest_speed(slowed_chain(method(name), alpha, by_drag, 0.99 * found.step));
                assert!(below < 1.0, "{name}, below {}: {below} m/s", found.step);
                continue;
            }
            assert_relative(found.step * alpha, low, 1e-3, name);
            let largest =
                |part: f64| largest_speed(slowed_chain(method(name), alpha, by_drag, part * found.step));
            let (below, above) = (largest(0.99), largest(1.01));
            assert!(below < 1.0 && above > 1.0, "{name}, by drag {by_drag}: {below} m/s and {above} m/s");
        }
    }
}

// ln |R| = ln(1 + z^4/4) / 2 in each step of the midpoint rule, whose growth is below rounding at small z:
// doubled by the end at the step that is told, not a thousandth of a radian.
#[test]
fn a_scheme_that_gains_slowly_may_take_the_steps_that_double_the_fastest_motion() {
    let simulation = &mut free_chain(method("rk2-midpoint"), 1.0);
    let limit = simulation.stability_limit(1.0).unwrap();
    assert!(limit.grows_at_any_step);
    let (z, steps) = (limit.step * limit.frequency, 1.0 / limit.step);
    assert_relative(0.5 * (0.25 * z.powi(4)).ln_1p() * steps, std::f64::consts::LN_2, 1e-9, "growth");
}

// One strong dashpot damps neither the fastest motion nor the slowest alone: its matrix has no eigenvector
// with the stiffness.
#[test]
fn a_single_dashpot_leaves_steps_below_the_limit_stable() {
    let explicit =
        |m: &Method| m.documentation.stability_limit > 0.0 && m.documentation.stability_limit.is_finite();
    for method in methods().filter(explicit) {
        let name = method.documentation.name;
        for (edge, part) in [([0, 1], 1.5), ([2, 3], 2.2), ([3, 4], 2.5), ([0, 1], 3.0), ([2, 3], 8.0)] {
            let build = |h: f64| {
                let mut simulation = free_chain(method, h);
                // The fastest motion has 27.6 rad/s.
                let constants = [StencilConstants { stiffness: 27.6 * part, rest: [0.0; 2] }];
                let rest = simulation.state().x().to_vec();
                let dashpot = MeasuredRate::<Length, 2, 2>::new("chain", &[edge], &constants, &rest);
                simulation.system_mut().add_dissipation(Box::new(dashpot));
                simulation
            };
            let limit = build(1.0).stability_limit(1.0).unwrap().step;
            let below = largest_speed(build(0.98 * limit));
            assert!(below < 1.0, "{name}, {part} across {edge:?}, just below {limit}: {below} m/s");
        }
    }
}

// What a system loses is what its dissipative terms say they take away.
#[test]
fn the_energy_lost_is_the_power_of_the_dissipation_over_time() {
    let build = |h: f64| {
        let mut system = System::new(2, vec![1.0, 1.0]);
        system.add_term(Box::new(Springs::<2>::new("a", &[[0, 1]], &[20.0], &[1.0], 2)));
        let constants = [StencilConstants { stiffness: 0.7, rest: [0.0; 2] }];
        let x = vec![0.0, 0.0, 1.3, 0.1];
        system.add_dissipation(Box::new(MeasuredRate::<Length, 2, 2>::new("a", &[[0, 1]], &constants, &x)));
        Simulation::new(system, State::new(x, vec![0.3, 0.0, 0.0, 1.0]), method("rk4"), h)
    };
    let mut simulation = build(1e-3);
    let start = simulation.diagnostics().total;
    let power = |s: &mut Simulation| {
        let (x, v) = (s.state().x().to_vec(), s.state().v().to_vec());
        s.system_mut().dissipated_power(&x, &v)
    };
    // Simpson's rule over two steps at a time.
    let mut lost = 0.0;
    for _ in 0..500 {
        let mut sum = power(&mut simulation);
        advance(&mut simulation, 1);
        sum += 4.0 * power(&mut simulation);
        advance(&mut simulation, 1);
        sum += power(&mut simulation);
        lost += sum * 1e-3 / 3.0;
    }
    let end = simulation.diagnostics().total;
    assert!(lost > 0.1 * start);
    assert_relative(start - end, lost, 1e-9, "energy lost");
}

/// Sliding of one particle on a plane, `R = F (sqrt(|v|^2 + e^2) - e)`: nearly Coulomb's, and not quadratic.
struct Sliding {
    force: f64,
    threshold: f64,
    gradient: [f64; 2],
}

impl Sliding {
    fn smoothed(&self, v: &[f64]) -> f64 {
        (v[0] * v[0] + v[1] * v[1] + self.threshold * self.threshold).sqrt()
    }

    fn damping(&self, v: &[f64]) -> [f64; 4] {
        let speed = self.smoothed(v);
        let entry = |n: usize| {
            let identity = if n / 2 == n % 2 { 1.0 } else { 0.0 };
            self.force / speed * (identity - v[n / 2] * v[n % 2] / (speed * speed))
        };
        [0, 1, 2, 3].map(entry)
    }
}

impl DissipativeTerm for Sliding {
    fn name(&self) -> String {
        "sliding".into()
    }
    fn evaluate(&mut self, _: &[f64], v: &[f64]) -> bool {
        let factor = self.force / self.smoothed(v);
        self.gradient = [factor * v[0], factor * v[1]];
        factor.is_finite()
    }
    fn add_rows(&self, _: usize, g: &mut [f64]) {
        g.iter_mut().zip(self.gradient).for_each(|(g, own)| *g += own);
    }
    fn add_damping_product(&mut self, _: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) {
        let c = self.damping(v);
        (0..2).for_each(|k| y[k] += c[2 * k] * p[0] + c[2 * k + 1] * p[1]);
    }
    fn stencils(&mut self) -> Stencils {
        Stencils { size: 1, vertices: vec![0] }
    }
    fn stencil_dampings(&self, _: Range<usize>, _: &[f64], v: &[f64], out: &mut [f64]) {
        out.copy_from_slice(&self.damping(v));
    }
    fn power(&mut self, _: &[f64], v: &[f64]) -> f64 {
        self.force * (v[0] * v[0] + v[1] * v[1]) / self.smoothed(v)
    }
    fn value(&mut self, _: &[f64], v: &[f64]) -> f64 {
        self.force * (self.smoothed(v) - self.threshold)
    }
}

impl DissipationViews for Sliding {}

impl PositionProducts for Sliding {}

// The objective of a step has R itself: with half the power in its place, no step along the direction would
// lower it as its slope says.
#[test]
fn a_dissipation_function_need_not_be_quadratic() {
    let (force, threshold, h, start) = (3000.0, 1.0, 0.01, [60.0, -30.0]);
    for linear in [LinearSolver::Cholesky, LinearSolver::Cg, LinearSolver::MatrixFree] {
        let mut system = System::new(2, vec![1.0]);
        system.add_dissipation(Box::new(Sliding { force, threshold, gradient: [0.0; 2] }));
        let state = State::new(vec![0.0; 2], start.to_vec());
        let mut simulation = Simulation::new(system, state, method("implicit-euler"), h);
        let options = SolverOptions { tolerance: Some(1e-13), linear, ..SolverOptions::default() };
        simulation.set_solver(options);
        for step in 1..=4 {
            let before = simulation.state().v().to_vec();
            simulation.step().unwrap();
            let v = simulation.state().v();
            let speed = (v[0] * v[0] + v[1] * v[1] + threshold * threshold).sqrt();
            for c in 0..2 {
                let residual = v[c] - before[c] + h * force * v[c] / speed;
                // The tolerance of positions is felt in velocities, and by the derivative of the force.
                let most = 1e-13 / h * (1.0 + h * force / threshold);
                assert!(residual.abs() < most, "{linear:?}, step {step}: {residual:e}");
            }
        }
        let work = simulation.work().solver.unwrap();
        assert_eq!(work.halvings, 0, "{linear:?}: no step is too long");
    }
}
