//! Splitting methods: alternating kicks and drifts, each solving its part of the motion exactly.
//!
//! Velocity-dependent forces belong to the kick. A kick of time `c h` then solves `v' = a(x, v)` at fixed
//! `x` by `p` stages, `p` the order of the method: `v_k = v + c h / (p + 1 - k) a(x, v_(k-1))`. For a
//! force linear in `v` this is the Taylor polynomial of degree `p` of the exact flow, so the method keeps
//! its order. Order 1 takes the force at the velocity before the kick. The force of the potentials is
//! computed once; each further stage evaluates the dissipative terms. Scenes without such forces skip all
//! of this.
//!
//! Ether drag `c` also belongs to the kick and keeps the order. If no other force depends on velocities,
//! the kick solves `v' = a(x) - c v` exactly, `v(t) = exp(-c t) v + (1 - exp(-c t))/c a`; otherwise its
//! stages include the drag.

use super::Integrator;
use super::equations::exact_response;
use crate::lanes::{Numbers, exp};
use crate::pass::{KickDrift, PassResult};
use crate::solver::StepFault;
use crate::state::State;
use crate::system::{ForceId, System};

/// One part of a step, with its fraction of the step size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// `v += c h a(x)`.
    Kick(f64),
    /// `x += c h v`.
    Drift(f64),
}

/// Integrator for a sequence of kicks and drifts.
///
/// The force at the end of a step is reused for the first kick of the next, unless positions have changed
/// since.
pub struct Splitting {
    stages: &'static [Stage],
    /// Stages of a kick with velocity-dependent forces.
    order: u32,
    x: Numbers,
    v: Numbers,
    /// Velocities before such a kick; otherwise empty.
    before: Vec<f64>,
}

impl Splitting {
    /// Creates the integrator for `stages`, a method of order `order`, on `unknowns` coordinates.
    pub fn new(stages: &'static [Stage], order: u32, unknowns: usize) -> Self {
        Splitting { stages, order, x: Numbers::zeros(unknowns), v: Numbers::zeros(unknowns), before: vec![] }
    }

    /// Applies `kick` to the copies with a velocity-dependent force.
    fn damped_kick(&mut self, system: &mut System, kick: &KickDrift) -> PassResult {
        let drag = system.ether_drag();
        let Splitting { order, x, v, before, .. } = self;
        // Allocates in the first step only.
        before.resize(v.len(), 0.0);
        before.copy_from_slice(v);
        // Stages of the kick; each restarts from the velocities before it.
        for stage in 1..*order {
            system.evaluate_dissipation(x, v);
            let time = kick.kick / f64::from(*order + 1 - stage);
            slowed(before, drag * time, v);
            system.pass(&KickDrift { kick: time, ..KickDrift::NOTHING }, None, x, v);
        }
        system.evaluate_dissipation(x, v);
        slowed(before, drag * kick.kick, v);
        system.pass(kick, None, x, v)
    }
}

/// Replaces the velocities `v` of a stage by `before - decay v`.
fn slowed(before: &[f64], decay: f64, v: &mut [f64]) {
    if decay == 0.0 {
        return v.copy_from_slice(before);
    }
    v.iter_mut().zip(before).for_each(|(v, before)| *v = before - decay * *v);
}

/// Velocity that a constant force produces under drag, as a fraction of that without drag: `(1 - R)/z`
/// for the factor `R` by which drag reduces a velocity, `z` its rate times the step size. Kicks have
/// `order` stages, or are exact.
fn response(stages: &[Stage], order: Option<u32>, z: f64) -> f64 {
    let Some(order) = order else { return exact_response(z) };
    stages.iter().fold(0.0, |sum, stage| match stage {
        Stage::Kick(c) => {
            let last = (1..order).fold(1.0, |v, stage| 1.0 - c * z / f64::from(order + 1 - stage) * v);
            sum + (1.0 - z * sum) * c * last
        }
        Stage::Drift(_) => sum,
    })
}

/// Kick of `time` [s] under ether drag `drag` [1/s]: the exact flow of `v' = a - drag v` at fixed `a`.
fn kick_under_drag(drag: f64, time: f64) -> KickDrift {
    if drag == 0.0 {
        return KickDrift { kick: time, ..KickDrift::NOTHING };
    }
    let decay = -drag * time;
    KickDrift { drag: exp(decay), kick: -libm::expm1(decay) / drag, ..KickDrift::NOTHING }
}

impl Integrator for Splitting {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let stages = self.stages;
        let damped = system.is_damped();
        // The stages of a damped kick include the drag.
        let drag = if damped { 0.0 } else { system.ether_drag() };
        let mut force = state.force;
        // Time is that of the positions: it advances with the drifts.
        let mut drifted = 0.0;
        let mut next = 0;
        while next < stages.len() {
            // One pass over the vertices does a kick and the drift after it, or either alone. The first
            // pass reads the state and writes copies, so that a failed step leaves the state unchanged.
            let first = next == 0;
            let mut pass = KickDrift::NOTHING;
            if let Some(Stage::Kick(c)) = stages.get(next) {
                pass = kick_under_drag(drag, c * h);
                if !system.holds(force) {
                    system.set_time(state.time + drifted * h);
                    let at = if first { state.x() } else { &self.x[..] };
                    force = system.evaluate(at).ok_or_else(|| StepFault::at(system, at, state.v()))?;
                }
                next += 1;
            }
            if let Some(Stage::Drift(c)) = stages.get(next) {
                pass.drift = c * h;
                drifted += c;
                next += 1;
            }
            let last = next == stages.len();
            pass.walls = last && system.begin_walls_in_pass();
            let passed = if damped && pass.kick != 0.0 {
                if first {
                    self.x.copy_from_slice(state.x());
                    self.v.copy_from_slice(state.v());
                }
                self.damped_kick(system, &pass)
            } else {
                let from = first.then(|| (state.x(), state.v()));
                system.pass(&pass, from, &mut self.x, &mut self.v)
            };
            let prescribed = system.prescribe(state.time + drifted * h, &mut self.x, &mut self.v);
            if !(passed.finite && prescribed) {
                return Err(StepFault::at(system, &self.x, &self.v));
            }
            let mut put_back = passed.put_back;
            if last {
                let response = |z| response(stages, damped.then_some(self.order), z);
                let (x, v) = (&mut self.x[..], &mut self.v[..]);
                if pass.walls {
                    system.book_walls(state, h, (x, v), &response);
                } else {
                    put_back = system.apply_walls(state, h, (x, v), &response);
                }
            }
            if pass.drift != 0.0 || put_back {
                force = ForceId::NONE;
            }
        }
        state.swap(&mut self.x, &mut self.v, force);
        Ok(())
    }

    fn undo(&mut self, state: &mut State) {
        // The swap at the end of the step left the old state here.
        state.swap(&mut self.x, &mut self.v, ForceId::NONE);
    }
}
