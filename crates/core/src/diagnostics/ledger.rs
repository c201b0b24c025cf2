//! Energy ledger: computes the energy balance step by step.

mod equilibrium;
mod friction;

use super::Balance;
use super::integral::Integral;
use crate::energy::EnergyTerm;
use crate::system::{
    ForceId, PowerSelection, Powers, System, WallLoss, feeds, is_changing_gravity, power_of_motion,
};
use equilibrium::Equilibrium;
use friction::StepFriction;

/// Computes a [`Balance`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct EnergyLedger {
    motion: Option<MotionEnergy>,
    loads: Option<Integral>,
    gravity: Option<Integral>,
    /// Potential energy of loads and of gravity at the start [J].
    changing: [f64; 2],
    ether_drag: Option<Integral>,
    damping: Option<Integral>,
    #[serde(default)]
    friction: Option<Integral>,
    /// Friction of backward Euler, which has one force per step; its power is then in no integral.
    #[serde(default)]
    of_steps: Option<StepFriction>,
    walls: Option<Walls>,
    looked: PowerSelection,
    /// Last state of a quasi-static run.
    equilibrium: Option<Equilibrium>,
}

#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct MotionEnergy {
    power: Integral,
    /// Current kinetic energy of moving coordinates, and what they had at the start or when they began to
    /// move [J].
    kinetic: f64,
    less: f64,
}

/// Energy taken by walls [J]: the sum over all steps, which integration errors may lower, and its maximum
/// so far.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct Walls {
    sum: f64,
    lost: f64,
}

impl EnergyLedger {
    /// Opens a ledger for `system`, which holds the force at `x`, with losses if `losses` is true; `None`
    /// if no energy enters or leaves. `backward` is true if the integrator has one force per step, at its
    /// end.
    pub(crate) fn new(
        system: &mut System,
        (losses, backward): (bool, bool),
        x: &[f64],
        v: &[f64],
    ) -> Option<Self> {
        // Energy flows that the scene has.
        let any = |system: &System, asked: fn(&dyn EnergyTerm) -> bool| {
            system.terms().iter().any(|term| asked(term.as_ref()))
        };
        let looked =
            PowerSelection { loads: any(system, feeds), gravity: any(system, is_changing_gravity), losses };
        let walls = losses && !system.walls().is_empty();
        let drags = losses && system.ether_drag() != 0.0;
        let dissipates = |friction| system.dissipation().iter().any(|term| term.is_friction() == friction);
        let [damped, rubs] = [false, true].map(|friction| losses && dissipates(friction));
        let damped = damped || losses && system.remembers();
        let moves = system.has_prescribed_motion();
        if !(looked.loads || looked.gravity || walls || drags || damped || rubs || moves) {
            return None;
        }
        // Start all integrals with the current flows.
        let of_steps = (backward && dissipates(true)).then(|| StepFriction::from(x));
        system.books_mut().count_walls(walls);
        let motion = moves.then(|| {
            let (power, kinetic) = power_of_motion(system, x, v);
            let rubbed = of_steps.as_ref().map_or(0.0, |_| friction::power_of_motion(system, x, v));
            MotionEnergy { power: Integral::new(power - rubbed), kinetic, less: kinetic }
        });
        let flows = Powers::of(system, looked, x, v);
        Some(EnergyLedger {
            motion,
            loads: looked.loads.then(|| Integral::new(flows.loads)),
            gravity: looked.gravity.then(|| Integral::new(flows.gravity)),
            changing: changing(system, x),
            ether_drag: drags.then(|| Integral::new(flows.ether_drag)),
            damping: damped.then(|| Integral::new(flows.damping)),
            friction: rubs.then(|| Integral::new(flows.friction)),
            of_steps,
            walls: walls.then(Walls::default),
            looked,
            equilibrium: None,
        })
    }

    /// True if the ledger was opened with losses.
    pub(crate) fn holds_losses(&self) -> bool {
        self.looked.losses
    }

    /// True if the ledger counts wall losses.
    pub(crate) fn counts_walls(&self) -> bool {
        self.walls.is_some()
    }

    /// Advances by a step of `h` [s] to the state `x`, `v`; `system` holds the force at `x`.
    pub(crate) fn advance(&mut self, system: &mut System, h: f64, x: &[f64], v: &[f64]) {
        let wall_loss = system.books_mut().take_wall_loss();
        let rubbed = self.of_steps.as_mut().map(|of_steps| of_steps.advance(system, h, x));
        if let (Some(friction), Some(rubbed)) = (&mut self.friction, &rubbed) {
            friction.add(rubbed.lost);
        }
        if let Some(own) = &mut self.motion {
            let (mut power, kinetic) = power_of_motion(system, x, v);
            let mut before = wall_loss.map_or(power, |loss| loss.motion);
            if let Some(rubbed) = &rubbed {
                own.power.add(rubbed.by_motion);
                let now = friction::power_of_motion(system, x, v);
                (power, before) = (power - now, before - now);
            }
            own.power.advance(h, before);
            if wall_loss.is_some() {
                own.power.jump(power);
            }
            own.kinetic = kinetic;
        }
        // Other flows; without walls they continue smoothly.
        let flows = Powers::of(system, self.looked, x, v);
        let Some(WallLoss { energy, flows: before, not_done, .. }) = wall_loss else {
            self.each(flows, |integral, rate| integral.advance(h, rate));
            return;
        };
        // Walls act instantly at the end of a step, which led to the state before.
        self.each(before, |integral, rate| integral.advance(h, rate));
        self.each(not_done, Integral::add);
        self.each(flows, Integral::jump);
        if let Some(walls) = &mut self.walls {
            walls.sum += energy;
            walls.lost = walls.lost.max(walls.sum);
        }
    }

    /// Records the energy [J] that terms with history lost instantly at the end of a step.
    pub(crate) fn commit(&mut self, lost: f64, system: &mut System, x: &[f64], v: &[f64]) {
        let flows = Powers::of(system, self.looked, x, v);
        if let Some(damping) = &mut self.damping {
            damping.add(lost);
            damping.jump(flows.damping);
        }
    }

    /// Records a jump of these moving coordinates, each by its distance [m], at the end of the step to
    /// the state `x`, where `system` holds the force `force`. The energy of all potentials there, minus
    /// that without the jump, is work.
    pub(crate) fn jump(
        &mut self,
        system: &mut System,
        coordinates: &[(usize, f64)],
        x: &[f64],
        force: ForceId,
    ) {
        let Some(own) = &mut self.motion else { return };
        let mut before = x.to_vec();
        coordinates.iter().for_each(|(i, distance)| before[*i] -= distance);
        let of_all = |_| true;
        let work = system.potential_with_force(of_all, x, force) - system.potential_energy(&before);
        if work.is_finite() {
            own.power.add(work);
        }
        // No polynomial passes through both sides.
        own.power.restart();
        let (now, then) = (changing(system, x), changing(system, &before));
        (0..2).for_each(|i| self.changing[i] += now[i] - then[i]);
    }

    /// Continues from the same state after a release of pins.
    pub(crate) fn release(&mut self, system: &mut System, x: &[f64], v: &[f64]) {
        if let Some(own) = &mut self.motion {
            let (mut power, kinetic) = power_of_motion(system, x, v);
            if self.of_steps.is_some() {
                power -= friction::power_of_motion(system, x, v);
            }
            let kinetic = if self.equilibrium.is_some() { 0.0 } else { kinetic };
            // Released vertices take their kinetic energy along.
            own.less -= own.kinetic - kinetic;
            own.kinetic = kinetic;
            own.power.jump(power);
        }
        self.rebase(system, x);
        let flows = Powers::of(system, self.looked, x, v);
        self.each(flows, Integral::jump);
    }

    /// Visits each integral with its part of `flows`; step friction is in none.
    fn each(&mut self, flows: Powers, mut go: impl FnMut(&mut Integral, f64)) {
        let EnergyLedger { loads, gravity, ether_drag, damping, friction, of_steps, .. } = self;
        let friction = friction.as_mut().filter(|_| of_steps.is_none());
        let rates = [flows.loads, flows.gravity, flows.ether_drag, flows.damping];
        let integrals = [loads, gravity, ether_drag, damping].map(Option::as_mut);
        for (integral, rate) in integrals.into_iter().zip(rates).chain([(friction, flows.friction)]) {
            if let Some(integral) = integral {
                go(integral, rate);
            }
        }
    }

    /// Returns the balance at the positions `x`, at the time last set.
    pub(crate) fn balance(&self, system: &mut System, x: &[f64]) -> Balance {
        let value = |integral: &Option<Integral>| integral.as_ref().map(Integral::value);
        // The integral of dE/dt at fixed x is the increase of E plus the work it has done. Unlike dE/dt,
        // the power of a force that jumps is finite.
        let now = changing(system, x);
        let fed =
            |work: &Option<Integral>, i: usize| value(work).map(|work| work + now[i] - self.changing[i]);
        Balance {
            motion: self.motion.as_ref().map(|motion| motion.power.value() + motion.kinetic - motion.less),
            loads: fed(&self.loads, 0),
            gravity: fed(&self.gravity, 1),
            ether_drag: value(&self.ether_drag),
            damping: value(&self.damping),
            friction: value(&self.friction),
            walls: self.walls.as_ref().map(|walls| walls.lost),
        }
    }
}

/// Returns the potential energies [J] of loads ([`feeds`]) and of time-dependent gravity; loads without a
/// potential count as zero.
fn changing(system: &mut System, x: &[f64]) -> [f64; 2] {
    [system.potential_of(feeds, x), system.potential_of(is_changing_gravity, x)]
}
