//! Tangents of single steps, one for each family of integrators, with the formulas in the module of its
//! adjoint.

use pliant::integrator::alpha::AlphaCoefficients;
use pliant::integrator::splitting::Stage;
use pliant::integrator::tableau::Tableau;
use pliant::integrator::{Method, Scheme};
use pliant::system::System;

use super::forces::TangentForces;
use crate::adjoint::alpha::moved;
use crate::adjoint::linearised::LinearisedPlaces;
use crate::adjoint::runge_kutta::{node, position, set_means_of_held};
use crate::adjoint::splitting::{kick_by_drag, kick_of, kick_places};
use crate::adjoint::statics::{coefficients, velocities};
use crate::adjoint::{AdjointPlace, Singular, StageTables, Step, add_scaled, first_step};
use crate::coupled::{CoupledEquations, StagePlace};
use crate::linear::Coefficients;

/// Change of a state.
pub(super) struct StateTangent {
    pub(super) x: Vec<f64>,
    /// Change of the velocities; zero where fixed.
    pub(super) v: Vec<f64>,
    /// Change of the acceleration that methods with memory carry along.
    a: Vec<f64>,
    /// Change of the acceleration before it.
    older_a: Vec<f64>,
    /// Change of the positions and velocities before, for two-step methods.
    older: [Vec<f64>; 2],
}

impl StateTangent {
    /// Change of the initial state.
    pub(super) fn new(x: Vec<f64>, v: Vec<f64>) -> Self {
        let zero = || vec![0.0; x.len()];
        StateTangent { a: zero(), older_a: zero(), older: [x.clone(), v.clone()], x, v }
    }

    /// True if all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        self.x.iter().chain(&self.v).all(|dot| dot.is_finite())
    }

    /// Largest change of a component; infinite if one is NaN.
    pub(super) fn norm(&self) -> f64 {
        let all = self.x.iter().chain(&self.v);
        all.fold(0.0, |norm: f64, dot| if dot.is_nan() { f64::INFINITY } else { norm.max(dot.abs()) })
    }
}

/// Linear combination of `rows`.
fn sum(parts: &[(f64, &[f64])]) -> Vec<f64> {
    let mut sum = vec![0.0; parts[0].1.len()];
    parts.iter().for_each(|(factor, rows)| add_scaled(&mut sum, *factor, rows));
    sum
}

/// Propagates `dots` from the beginning of a step by `method` to its end.
pub(super) fn advance(
    method: &Method,
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    match method.scheme {
        Scheme::Splitting(stages) => {
            splitting((stages, method.documentation.order), forces, system, step, dots);
            Ok(())
        }
        Scheme::RungeKutta(tableau) | Scheme::Dirk(tableau) => {
            runge_kutta(&tableau, forces, system, step, dots)
        }
        Scheme::Alpha(coefficients) => alpha(&coefficients, forces, system, step, dots),
        Scheme::Bdf2(start) => {
            let old = [dots.x.clone(), dots.v.clone()];
            if step.is_first || step.growth != 1.0 {
                advance(&first_step(start), forces, system, step, dots)?;
            } else {
                bdf2(forces, system, step, dots)?;
            }
            dots.older = old;
            Ok(())
        }
        Scheme::QuasiStatic => statics(forces, system, step, dots),
        Scheme::Collocation(tableau) => {
            collocation(&StageTables::of_tableau(&tableau), forces, system, step, dots)
        }
        Scheme::GaussRadau(_) => collocation(StageTables::gauss_radau(), forces, system, step, dots),
        Scheme::Linearised(_) => linearised(forces, system, step, dots),
    }
}

fn splitting(
    (stages, order): (&[Stage], u32),
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) {
    let mut places = kick_places((stages, order), system, step).into_iter();
    for stage in stages {
        match stage {
            Stage::Drift(c) => add_scaled(&mut dots.x, c * step.h, &dots.v),
            Stage::Kick(c) => {
                let Some(place) = places.next() else { continue };
                let time = c * step.h;
                // Velocity-independent forces: one closed-form kick.
                if !system.is_damped() {
                    let at = AdjointPlace { time: place.time, x: &place.x, v: &place.v[0] };
                    let (decay, kick) = kick_of(system, time);
                    let still = vec![0.0; dots.x.len()];
                    let a = forces.acceleration(system, at, (&dots.x, &still));
                    dots.v.iter_mut().zip(&a).for_each(|(v, a)| *v = decay * *v + kick * a);
                    let change = forces.ether_drag_change();
                    if change != 0.0 && system.ether_drag() != 0.0 {
                        add_scaled(&mut dots.v, change, &kick_by_drag(system, &place, time));
                        forces.keep_free(system, &mut dots.v);
                    }
                    continue;
                }
                // Velocity-dependent forces: explicit stages.
                let before = dots.v.clone();
                for (k, v) in place.v.iter().enumerate() {
                    let at = AdjointPlace { time: place.time, x: &place.x, v };
                    // The acceleration includes mass-proportional drag.
                    let a = forces.acceleration(system, at, (&dots.x, &dots.v));
                    let part = time / (place.v.len() - k) as f64;
                    dots.v = sum(&[(1.0, &before), (part, &a)]);
                }
            }
        }
    }
}

fn runge_kutta(
    tableau: &Tableau,
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    let Tableau { a, b, .. } = *tableau;
    let (h, drag) = (step.h, system.ether_drag());
    let (mut velocities, mut accelerations): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (vec![], vec![]);
    for (i, row) in a.iter().enumerate() {
        let g = h * row.get(i).copied().unwrap_or(0.0);
        // Known part of the stage.
        let (mut x, mut v) = (dots.x.clone(), dots.v.clone());
        for j in 0..i {
            let weight = row.get(j).copied().unwrap_or(0.0);
            add_scaled(&mut x, h * weight, &velocities[j]);
            add_scaled(&mut v, h * weight, &accelerations[j]);
        }
        let time = step.from.time + node(row) * h;
        let (mut at_x, mut at_v) = (position(step, row), step.stage_velocities[i].clone());
        system.prescribe(time, &mut at_x, &mut at_v);
        let means = set_means_of_held(tableau, system, step, (&at_x, &mut at_v));
        forces.means_from = means.map(|(from, h)| (from.time, h));
        let at = AdjointPlace { time, x: &at_x, v: &at_v };
        // Acceleration of the stage.
        let acceleration = if g == 0.0 {
            forces.acceleration(system, at, (&x, &v))
        } else {
            add_scaled(&mut x, g, &v);
            let right = forces.solved_force(system, at, (&x, &v));
            let coefficients = Coefficients { inertia: 1.0 + g * drag, damping: g, stiffness: g * g };
            forces.solve(system, at, coefficients, &right)?
        };
        add_scaled(&mut v, g, &acceleration);
        velocities.push(v);
        accelerations.push(acceleration);
    }
    forces.means_from = None;
    for (i, b) in b.iter().enumerate() {
        add_scaled(&mut dots.x, h * b, &velocities[i]);
        add_scaled(&mut dots.v, h * b, &accelerations[i]);
    }
    Ok(())
}

fn alpha(
    coefficients: &AlphaCoefficients,
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    let AlphaCoefficients { alpha_m, alpha_f, beta, gamma } = *coefficients;
    let (h, drag, d) = (step.h, system.ether_drag(), system.dimension());
    let (new_m, new_f) = (1.0 - alpha_m, 1.0 - alpha_f);
    if step.is_first {
        dots.a = forces.acceleration(system, step.from, (&dots.x, &dots.v));
    }
    let StateTangent { x, v, a, older_a, .. } = dots;
    if !step.is_first {
        let moved = moved(coefficients, step.growth);
        a.iter_mut().zip(&*older_a).for_each(|(a, older)| *a += moved * (*a - older));
    }
    older_a.clone_from(a);
    // Known parts of the new state.
    let known_x = sum(&[(1.0, x), (h, v), (h * h * (0.5 - beta), a)]);
    let known_v = sum(&[(1.0, v), (h * (1.0 - gamma), a)]);
    let between = |(new, old): (&f64, &f64)| new_f * new + alpha_f * old;
    let mut at_x: Vec<f64> = step.x.iter().zip(step.from.x).map(between).collect();
    let mut at_v: Vec<f64> = step.v.iter().zip(step.from.v).map(between).collect();
    let time = step.from.time + new_f * h;
    system.prescribe(time, &mut at_x, &mut at_v);
    let at = AdjointPlace { time, x: &at_x, v: &at_v };
    // Acceleration at the intermediate state.
    let (part_x, part_v) = (sum(&[(new_f, &known_x), (alpha_f, x)]), sum(&[(new_f, &known_v), (alpha_f, v)]));
    let mut right = forces.solved_force(system, at, (&part_x, &part_v));
    for (i, right) in right.iter_mut().enumerate() {
        *right -= alpha_m * system.mass()[i / d] * a[i];
    }
    let matrix = Coefficients {
        inertia: new_m + new_f * gamma * h * drag,
        damping: new_f * gamma * h,
        stiffness: new_f * beta * h * h,
    };
    *a = forces.solve(system, at, matrix, &right)?;
    *x = sum(&[(1.0, &known_x), (h * h * beta, a)]);
    *v = sum(&[(1.0, &known_v), (h * gamma, a)]);
    Ok(())
}

fn bdf2(
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    let (g, drag) = (2.0 / 3.0 * step.h, system.ether_drag());
    let StateTangent { x, v, older, .. } = dots;
    let mut known_x = sum(&[(4.0 / 3.0, x), (-1.0 / 3.0, &older[0])]);
    let known_v = sum(&[(4.0 / 3.0, v), (-1.0 / 3.0, &older[1])]);
    let at = AdjointPlace { time: step.from.time + step.h, x: step.x, v: step.v };
    let foreseen = sum(&[(1.0, &known_x), (g, &known_v)]);
    let right = forces.solved_force(system, at, (&foreseen, &known_v));
    let coefficients = Coefficients { inertia: 1.0 + g * drag, damping: g, stiffness: g * g };
    let a = forces.solve(system, at, coefficients, &right)?;
    *v = sum(&[(1.0, &known_v), (g, &a)]);
    add_scaled(&mut known_x, g, v);
    *x = known_x;
    Ok(())
}

/// Tangent of a static equilibrium: free coordinates follow the fixed ones; the solve removes their own
/// change.
fn statics(
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    let StateTangent { x, v, .. } = dots;
    v.fill(0.0);
    let at = AdjointPlace { time: step.from.time + step.h, x: step.x, v: velocities(step) };
    let right = forces.solved_force(system, at, (x, v));
    let moved = forces.solve(system, at, coefficients(step.h), &right)?;
    add_scaled(x, 1.0, &moved);
    Ok(())
}

/// Tangent of a collocation step, with [tables](StageTables) `a`, `t` of the stages, all dots: `M A_i +
/// (C_i + c M) h sum_j a_ij A_j + H_i h^2 sum_j t_ij A_j = f_i`, `f_i` the change of the force of stage
/// `i` at `x + c_i h v` and `v`.
fn collocation(
    tables: &StageTables,
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    let StageTables { nodes, once, twice, end_once, end_twice } = tables;
    let h = step.h;
    let stages = tables.places(system, step);
    let mut force = |(stage, node): (&StagePlace, &f64)| {
        let at = AdjointPlace { time: stage.time, x: &stage.x, v: &stage.v };
        forces.force(system, at, (&sum(&[(1.0, &dots.x), (node * h, &dots.v)]), &dots.v))
    };
    let rights: Vec<Vec<f64>> = stages.iter().zip(nodes).map(&mut force).collect();
    let times = |factor: f64, table: &[Vec<f64>]| -> Vec<Vec<f64>> {
        table.iter().map(|row| row.iter().map(|entry| factor * entry).collect()).collect()
    };
    let (damping, stiffness) = (times(h, once), times(h * h, twice));
    let equations =
        CoupledEquations { stages: &stages, is_forth: true, damping: &damping, stiffness: &stiffness };
    let accelerations = equations.solve(system, &rights).ok_or(Singular)?;
    add_scaled(&mut dots.x, h * end_once.iter().sum::<f64>(), &dots.v);
    for (l, acceleration) in accelerations.iter().enumerate() {
        add_scaled(&mut dots.x, h * h * end_twice[l], acceleration);
        add_scaled(&mut dots.v, h * end_once[l], acceleration);
    }
    Ok(())
}

/// Tangent of a linearised step `x' = x + d`, with the points and weights of the
/// [adjoint](LinearisedPlaces): `A d = h M v + h^2 f`, all dots, `f` the force there without the change
/// of `d` itself.
fn linearised(
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    let places = LinearisedPlaces::of(system, step);
    let coefficients = LinearisedPlaces::coefficients(system, step.h);
    let (h, d, still) = (step.h, system.dimension(), vec![0.0; dots.x.len()]);
    let at = AdjointPlace { time: places.time, x: &places.x, v: &places.v };
    let mut right = forces.force(system, at, (&dots.x, &still));
    for (weight, [x, v]) in &places.beside {
        let beside = forces.force(system, AdjointPlace { time: places.time, x, v }, (&dots.x, &still));
        add_scaled(&mut right, *weight, &beside);
    }
    for (i, right) in right.iter_mut().enumerate() {
        *right = h * h * *right + h * system.mass()[i / d] * dots.v[i];
    }
    let way = forces.solve(system, at, coefficients, &right)?;
    if !forces.is_definite() {
        return Err(Singular);
    }
    add_scaled(&mut dots.x, 1.0, &way);
    dots.v = way.iter().map(|way| way / h).collect();
    Ok(())
}
