//! Adjoint of splitting methods: kicks and drifts in reverse order.
//!
//! A drift is `x += c h v`. A kick is `v = e v + k a(x)` with `e = exp(-d c h)`, `k = (1 - e)/d` under
//! mass-proportional drag `d`, and `e = 1`, `k = c h` without. If forces depend on velocities, a kick of
//! a method of order `p` has `p` stages, `v_k = v + c h/(p + 1 - k) (a(x, v_(k-1)) - d v_(k-1))`, each with
//! its own adjoint.

use std::borrow::Cow;

use pliant::integrator::splitting::Stage::{self, Drift, Kick};
use pliant::system::System;

use pliant::algebra::dot;

use super::{Adjoint, AdjointForces, AdjointPlace, Bars, Step, add_scaled, free_only};

/// Positions, and the velocities before the kick and after each of its stages but the last.
pub(crate) struct KickPlace<'a> {
    pub(crate) time: f64,
    pub(crate) x: Cow<'a, [f64]>,
    pub(crate) v: Vec<Cow<'a, [f64]>>,
}

/// Propagates `adjoint` back over one step with these stages, of a method of this order.
pub(super) fn step_back(
    (stages, order): (&[Stage], u32),
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    adjoint: &mut Adjoint,
) {
    let mut places = kick_places((stages, order), forces.system, step);
    for stage in stages.iter().rev() {
        match stage {
            Drift(c) => add_scaled(&mut adjoint.v, c * step.h, &adjoint.x),
            Kick(c) => {
                let Some(place) = places.pop() else { continue };
                if forces.system.is_damped() {
                    damped_kick_back(forces, &place, c * step.h, adjoint);
                } else {
                    kick_back(forces, &place, c * step.h, adjoint);
                }
            }
        }
        free_only(forces.system, &mut adjoint.v);
    }
}

/// Propagates `adjoint` back over a kick of `time` [s] under velocity-independent forces.
fn kick_back(forces: &mut AdjointForces<'_, '_>, place: &KickPlace<'_>, time: f64, adjoint: &mut Adjoint) {
    let (decay, kick) = kick_of(forces.system, time);
    let Adjoint { x, v, .. } = adjoint;
    if forces.system.ether_drag() != 0.0 && forces.sums.has_ether_drag() {
        let part = dot(v, &kick_by_drag(forces.system, place, time));
        forces.sums.add_ether_drag(part);
    }
    let a_bar: Vec<f64> = v.iter().map(|v| kick * v).collect();
    v.iter_mut().for_each(|v| *v *= decay);
    let at = AdjointPlace { time: place.time, x: &place.x, v: &place.v[0] };
    forces.acceleration(at, &a_bar, Bars { x, v });
}

/// Propagates `adjoint` back over a kick of `time` [s] under velocity-dependent forces.
fn damped_kick_back(
    forces: &mut AdjointForces<'_, '_>,
    place: &KickPlace<'_>,
    time: f64,
    adjoint: &mut Adjoint,
) {
    let (drag, order) = (forces.system.ether_drag(), place.v.len());
    let Adjoint { x, v: of_stage, .. } = adjoint;
    let mut before = vec![0.0; x.len()];
    for (k, v) in place.v.iter().enumerate().rev() {
        add_scaled(&mut before, 1.0, of_stage);
        let part = time / (order - k) as f64;
        let a_bar: Vec<f64> = of_stage.iter().map(|v| part * v).collect();
        of_stage.iter_mut().for_each(|v| *v *= -drag * part);
        let at = AdjointPlace { time: place.time, x: &place.x, v };
        forces.acceleration(at, &a_bar, Bars { x, v: of_stage });
        free_only(forces.system, of_stage);
    }
    add_scaled(of_stage, 1.0, &before);
}

/// Factors of the velocity and of the acceleration in a kick of `time` [s].
pub(crate) fn kick_of(system: &System, time: f64) -> (f64, f64) {
    let drag = system.ether_drag();
    if drag == 0.0 {
        return (1.0, time);
    }
    let decay = -drag * time;
    (decay.exp(), -decay.exp_m1() / drag)
}

/// Derivative of the velocity after a kick of `time` [s] by the mass-proportional drag, without that
/// through the drag force `-d M v` in the acceleration, which is `-k v`: `de/dd = -t e` and
/// `dk/dd = (t e - k)/d`.
pub(crate) fn kick_by_drag(system: &mut System, place: &KickPlace<'_>, time: f64) -> Vec<f64> {
    let (decay, kick) = kick_of(system, time);
    let (by_velocity, by_acceleration) = (kick - time * decay, (time * decay - kick) / system.ether_drag());
    let a = acceleration(system, place, &place.v[0]);
    place.v[0].iter().zip(&a).map(|(v, a)| by_velocity * v + by_acceleration * a).collect()
}

/// Evaluation points of all kicks. Positions before the first drift and after the last are known. Others,
/// and velocities if forces or drag depend on them, are recomputed.
pub(crate) fn kick_places<'a>(
    (stages, order): (&[Stage], u32),
    system: &mut System,
    step: &Step<'a>,
) -> Vec<KickPlace<'a>> {
    let drifts = stages.iter().filter(|stage| matches!(stage, Drift(_))).count();
    let (mut x, mut v) = (Cow::Borrowed(step.from.x), Cow::Borrowed(step.from.v));
    let (mut places, mut drifted, mut done) = (vec![], 0.0, 0);
    for stage in stages {
        match stage {
            Drift(c) => {
                (done, drifted) = (done + 1, drifted + c);
                if done < drifts || system.has_prescribed_motion() {
                    add_scaled(x.to_mut(), c * step.h, &v);
                    system.prescribe(step.from.time + drifted * step.h, x.to_mut(), v.to_mut());
                }
                if done == drifts {
                    x = Cow::Borrowed(step.x);
                }
            }
            Kick(c) => {
                let time = step.from.time + drifted * step.h;
                let mut place = KickPlace { time, x: x.clone(), v: vec![v.clone()] };
                if system.is_damped() {
                    damped_kick(system, &mut place, c * step.h, order, v.to_mut());
                } else if done + 1 < drifts || system.ether_drag() != 0.0 {
                    let (decay, kick) = kick_of(system, c * step.h);
                    let a = acceleration(system, &place, &v);
                    v.to_mut().iter_mut().zip(&a).for_each(|(v, a)| *v = decay * *v + kick * a);
                }
                places.push(place);
            }
        }
    }
    places
}

/// Repeats a kick of `time` [s], and keeps the velocities of its stages.
fn damped_kick(system: &mut System, place: &mut KickPlace<'_>, time: f64, order: u32, v: &mut [f64]) {
    let (drag, before) = (system.ether_drag(), v.to_vec());
    for stage in 1..=order {
        if stage > 1 {
            place.v.push(Cow::Owned(v.to_vec()));
        }
        let part = time / f64::from(order + 1 - stage);
        let a = acceleration(system, place, v);
        for i in 0..v.len() {
            v[i] = before[i] + part * (a[i] - drag * v[i]);
        }
    }
}

/// Acceleration by all forces, without mass-proportional drag [m/s^2].
fn acceleration(system: &mut System, place: &KickPlace<'_>, v: &[f64]) -> Vec<f64> {
    let mut a = vec![0.0; v.len()];
    system.set_time(place.time);
    system.evaluate(&place.x);
    for term in system.dissipation_mut() {
        term.evaluate(&place.x, v);
    }
    system.accelerations(&mut a);
    a
}
