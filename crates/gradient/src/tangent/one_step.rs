//! Tangents of single steps: one for each engine, with the formulas that its adjoint documents.

use pliant::integrator::alpha::AlphaCoefficients;
use pliant::integrator::splitting::Stage;
use pliant::integrator::tableau::Tableau;
use pliant::integrator::{Method, Scheme};
use pliant::system::System;

use super::forces::TangentForces;
use crate::adjoint::linearised::LinearisedPlaces;
use crate::adjoint::runge_kutta::{node, position};
use crate::adjoint::splitting::{kick_of, kick_places};
use crate::adjoint::statics::{coefficients, velocities};
use crate::adjoint::{AdjointPlace, Singular, StageTables, Step, add_scaled, first_step};
use crate::coupled::{CoupledEquations, StagePlace};
use crate::linear::Coefficients;

/// Change of a state.
pub(super) struct StateTangent {
    pub(super) x: Vec<f64>,
    /// Zero where held.
    pub(super) v: Vec<f64>,
    /// Of the acceleration that schemes with memory carry along.
    a: Vec<f64>,
    /// Of the positions and velocities before, which schemes of two steps look at.
    older: [Vec<f64>; 2],
}

impl StateTangent {
    /// Of the state that a run begins with.
    pub(super) fn new(x: Vec<f64>, v: Vec<f64>) -> Self {
        StateTangent { a: vec![0.0; x.len()], older: [x.clone(), v.clone()], x, v }
    }

    /// True if all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        self.x.iter().chain(&self.v).all(|dot| dot.is_finite())
    }
}

/// A sum of `rows` times numbers.
fn sum(parts: &[(f64, &[f64])]) -> Vec<f64> {
    let mut sum = vec![0.0; parts[0].1.len()];
    parts.iter().for_each(|(factor, rows)| add_scaled(&mut sum, *factor, rows));
    sum
}

/// Takes `dots` from the beginning of a step by `method` to its end.
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
            if step.is_first {
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
                if !system.is_damped() {
                    let at = AdjointPlace { time: place.time, x: &place.x, v: &place.v[0] };
                    let (decay, kick) = kick_of(system, time);
                    let still = vec![0.0; dots.x.len()];
                    let a = forces.acceleration(system, at, (&dots.x, &still));
                    dots.v.iter_mut().zip(&a).for_each(|(v, a)| *v = decay * *v + kick * a);
                    continue;
                }
                let before = dots.v.clone();
                for (k, v) in place.v.iter().enumerate() {
                    let at = AdjointPlace { time: place.time, x: &place.x, v };
                    // Ether drag is in the acceleration.
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
        let (mut x, mut v) = (dots.x.clone(), dots.v.clone());
        for j in 0..i {
            let weight = row.get(j).copied().unwrap_or(0.0);
            add_scaled(&mut x, h * weight, &velocities[j]);
            add_scaled(&mut v, h * weight, &accelerations[j]);
        }
        let time = step.from.time + node(row) * h;
        let (mut at_x, mut at_v) = (position(step, row), step.stage_velocities[i].clone());
        system.prescribe(time, &mut at_x, &mut at_v);
        let at = AdjointPlace { time, x: &at_x, v: &at_v };
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
    let StateTangent { x, v, a, .. } = dots;
    let known_x = sum(&[(1.0, x), (h, v), (h * h * (0.5 - beta), a)]);
    let known_v = sum(&[(1.0, v), (h * (1.0 - gamma), a)]);
    let between = |(new, old): (&f64, &f64)| new_f * new + alpha_f * old;
    let mut at_x: Vec<f64> = step.x.iter().zip(step.from.x).map(between).collect();
    let mut at_v: Vec<f64> = step.v.iter().zip(step.from.v).map(between).collect();
    let time = step.from.time + new_f * h;
    system.prescribe(time, &mut at_x, &mut at_v);
    let at = AdjointPlace { time, x: &at_x, v: &at_v };
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

/// Free coordinates follow the held ones: their own change is taken back by the solve.
fn statics(
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    let StateTangent { x, v, .. } = dots;
    v.fill(0.0);
    let way = velocities(system, step);
    let at = AdjointPlace { time: step.from.time + step.h, x: step.x, v: &way };
    let right = forces.solved_force(system, at, (x, v));
    let moved = forces.solve(system, at, coefficients(step.h), &right)?;
    add_scaled(x, 1.0, &moved);
    Ok(())
}

/// With `X_i = x + y_i` and [tables](StageTables) `t`, `b`, `e`: `M y_i + h^2 sum_l t_il H_l y_l = h c_i M v
/// - h^2 sum_l t_il H_l x`, all dots, without damping.
fn collocation(
    tables: &StageTables,
    forces: &mut TangentForces<'_>,
    system: &mut System,
    step: &Step<'_>,
    dots: &mut StateTangent,
) -> Result<(), Singular> {
    let StageTables { nodes, twice, end_once, end_twice, .. } = tables;
    let (h, s, d) = (step.h, 0..tables.count(), system.dimension());
    let stages = tables.places(system, step);
    let still = vec![0.0; dots.x.len()];
    let mut force = |system: &mut System, stage: &StagePlace, x: &[f64]| {
        let at = AdjointPlace { time: stage.time, x: &stage.x, v: &stage.v };
        forces.force(system, at, (x, &still))
    };
    let pulled: Vec<Vec<f64>> = stages.iter().map(|stage| force(system, stage, &dots.x)).collect();
    let right = |i: usize| {
        let inertial = |(k, v): (usize, &f64)| h * nodes[i] * system.mass()[k / d] * v;
        let mut right: Vec<f64> = dots.v.iter().enumerate().map(inertial).collect();
        s.clone().for_each(|l| add_scaled(&mut right, h * h * twice[i][l], &pulled[l]));
        right
    };
    let rights: Vec<Vec<f64>> = s.clone().map(right).collect();
    let stiffness: Vec<Vec<f64>> =
        twice.iter().map(|row| row.iter().map(|entry| h * h * entry).collect()).collect();
    let damping = vec![vec![0.0; tables.count()]; tables.count()];
    let equations =
        CoupledEquations { stages: &stages, is_forth: true, damping: &damping, stiffness: &stiffness };
    let moved = equations.solve(system, &rights).ok_or(Singular)?;
    let total: f64 = end_once.iter().sum();
    let mut x = sum(&[(1.0, &dots.x), (h * total, &dots.v)]);
    for (l, (stage, moved)) in stages.iter().zip(&moved).enumerate() {
        let mut acceleration = force(system, stage, &sum(&[(1.0, &dots.x), (1.0, moved)]));
        acceleration.iter_mut().zip(system.inverse_mass()).for_each(|(a, weight)| *a *= weight);
        add_scaled(&mut x, h * h * end_twice[l], &acceleration);
        add_scaled(&mut dots.v, h * end_once[l], &acceleration);
    }
    dots.x = x;
    Ok(())
}

/// With the places and weights that the [adjoint](LinearisedPlaces) has, `x' = x + d`: `A d = h M v + h^2 f`,
/// all dots, `f` the force there without the change of `d` itself.
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
