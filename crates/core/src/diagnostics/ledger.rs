//! Where energy comes from and where it goes.

use super::integral::Integral;
use crate::energy::EnergyKind;
use crate::system::System;

/// Energy brought into a system and taken out of it since the start [J]: what there is now, kinetic and potential, less
/// [`net`](Self::net), stays what it was at the start, to the order of the scheme. `None` where a scene has no such thing, and
/// where nobody asked.
///
/// Rates are known at the end of every step, and integrated to fourth order. A rate that jumps within a step (a formula or
/// keyframes with a kink) costs one order for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Balance {
    /// Work of prescribed motion: `1/2 m v^2` of what moves now, less at the start, plus the integral of `dE/dx . v` over
    /// these coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<f64>,
    /// Of loads that change with time or have no potential; those that stay the same are in the potential energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loads: Option<f64>,
}

impl Balance {
    /// The sum of all [J].
    pub fn net(&self) -> f64 {
        [self.motion, self.loads].into_iter().flatten().sum()
    }
}

/// Keeps a [`Balance`].
#[derive(Clone, Debug)]
pub(crate) struct Ledger {
    motion: Option<Motion>,
    loads: Option<Integral>,
}

#[derive(Clone, Debug)]
struct Motion {
    power: Integral,
    /// Kinetic energy of what moves, now, and what it had when it began or began to move [J].
    kinetic: f64,
    less: f64,
}

/// What a ledger reads.
#[derive(Clone, Copy)]
struct Rates {
    motion: f64,
    kinetic: f64,
    loads: f64,
}

impl Ledger {
    /// A ledger for `system`, which holds the force at `x`, at its beginning; `None` where nothing would be written into it.
    pub(crate) fn new(system: &mut System, x: &[f64], v: &[f64]) -> Option<Self> {
        let loads = system.terms().iter().any(|term| is_fed(term.as_ref()));
        let moves = system.has_prescribed_motion();
        if !(loads || moves) {
            return None;
        }
        let rates = Rates::of(system, x, v);
        let motion =
            Motion { power: Integral::new(rates.motion), kinetic: rates.kinetic, less: rates.kinetic };
        Some(Ledger { motion: moves.then_some(motion), loads: loads.then_some(Integral::new(rates.loads)) })
    }

    /// Goes on by a step of `h` [s] to the state `x`, `v`, at whose positions `system` holds the force.
    pub(crate) fn advance(&mut self, system: &mut System, h: f64, x: &[f64], v: &[f64]) {
        let rates = Rates::of(system, x, v);
        if let Some(motion) = &mut self.motion {
            motion.power.advance(h, rates.motion);
            motion.kinetic = rates.kinetic;
        }
        if let Some(loads) = &mut self.loads {
            loads.advance(h, rates.loads);
        }
    }

    /// Goes on from the same state after some of what was held has been let go.
    pub(crate) fn release(&mut self, system: &mut System, x: &[f64], v: &[f64]) {
        let rates = Rates::of(system, x, v);
        if let Some(motion) = &mut self.motion {
            // What flies on takes its energy along.
            motion.less -= motion.kinetic - rates.kinetic;
            motion.kinetic = rates.kinetic;
            motion.power.jump(rates.motion);
        }
    }

    pub(crate) fn balance(&self) -> Balance {
        Balance {
            motion: self.motion.as_ref().map(|motion| motion.power.value() + motion.kinetic - motion.less),
            loads: self.loads.as_ref().map(Integral::value),
        }
    }
}

/// Whether energy comes in through this term otherwise than from its own store, and whether it is a load.
fn is_fed(term: &dyn crate::energy::EnergyTerm) -> bool {
    term.kind() == EnergyKind::Load && term.supplies()
}

impl Rates {
    fn of(system: &mut System, x: &[f64], v: &[f64]) -> Self {
        let (mut motion, mut kinetic) = (0.0, 0.0);
        let (d, drag) = (system.dimension(), system.ether_drag());
        if system.has_prescribed_motion() && !system.dissipation().is_empty() {
            // What moves carries its part of these forces, as they are now.
            system.evaluate_dissipation(x, v);
        }
        for hold in system.constraints().iter().filter(|hold| hold.motion().is_some()) {
            let axes = hold.axes();
            system.visit_gradient(hold.vertices(), |vertex, gradient| {
                let m = system.mass()[vertex];
                for c in (0..d).filter(|c| axes[*c]) {
                    let v = v[vertex * d + c];
                    motion += (gradient[c] + drag * m * v) * v;
                    kinetic += 0.5 * m * v * v;
                }
            });
        }
        let loads = system.power(|term| is_fed(term), x, v);
        Rates { motion, kinetic, loads }
    }
}
