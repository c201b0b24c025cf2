//! Work between static equilibria.

use super::EnergyLedger;
use crate::system::System;
use crate::system::{PowerSelection, Powers, feeds, power_of_motion};

/// Last equilibrium of a quasi-static run. Without velocities, work is done between one equilibrium and
/// the next, by the mean of their forces.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Equilibrium {
    /// Time [s].
    time: f64,
    /// Positions, flat [m].
    x: Vec<f64>,
    /// Gradient of the loads that supply energy, flat [N]; empty without any.
    loads: Vec<f64>,
    /// Gradient of all potentials at each coordinate on prescribed motion [N].
    carried: Vec<f64>,
}

impl Equilibrium {
    /// Records the state `x` at `time` [s], where `system` holds the force.
    pub(super) fn of(system: &mut System, looked: PowerSelection, time: f64, x: &[f64]) -> Self {
        let mut loads = vec![];
        if looked.loads {
            loads.resize(x.len(), 0.0);
            let terms = system.terms().iter().filter(|term| feeds(term.as_ref()));
            terms.for_each(|term| term.add_rows(0, &mut loads));
        }
        let rest = vec![0.0; if system.is_damped() { x.len() } else { 0 }];
        let carried = carried(system, x, &rest).into_iter().map(|(_, gradient)| gradient).collect();
        Equilibrium { time, x: x.to_vec(), loads, carried }
    }
}

impl EnergyLedger {
    /// Converts the ledger for a quasi-static run from the state `x` at `time` [s]: neither drag nor
    /// walls dissipate, and moving coordinates have no inertia.
    pub(crate) fn between_equilibria(mut self, system: &mut System, time: f64, x: &[f64]) -> Self {
        self.equilibrium = Some(Equilibrium::of(system, self.looked, time, x));
        (self.ether_drag, self.walls) = (None, None);
        if let Some(own) = &mut self.motion {
            (own.kinetic, own.less) = (0.0, 0.0);
        }
        system.books_mut().count_walls(false);
        self
    }

    /// Advances by an increment of `h` [s] to the equilibrium `x` at `time` [s], where moving coordinates
    /// have the velocities `v` and `system` holds the force. Forces do the work `f . dx` by the
    /// trapezoidal rule, second-order in the increment; prescribed motion without damping does the
    /// integral of its power, to fourth order. Dissipation takes `dx . dR/dv` at the velocities `dx / h`
    /// of the solve.
    pub(crate) fn advance_to_equilibrium(
        &mut self,
        system: &mut System,
        h: f64,
        time: f64,
        x: &[f64],
        v: &[f64],
    ) {
        let Some(last) = self.equilibrium.take() else { return };
        let now = Equilibrium::of(system, self.looked, time, x);
        let dx: Vec<f64> = x.iter().zip(&last.x).map(|(x, last)| x - last).collect();
        let rate: Vec<f64> = dx.iter().map(|dx| dx / h).collect();
        let lost = self.damping.is_some() || self.friction.is_some();
        let [damping, friction] =
            if lost { system.dissipated_powers(x, &rate).map(|power| h * power) } else { [0.0; 2] };
        let works = Powers {
            loads: -mean_work(&last.loads, &now.loads, &dx),
            gravity: self.work_of_gravity(system, (&last, &now), &dx),
            ether_drag: 0.0,
            damping,
            friction,
        };
        self.each(works, |integral, work| integral.add(work));
        if let Some(own) = &mut self.motion {
            let (power, _) = power_of_motion(system, x, v);
            // In arc-length continuation there are no velocities.
            if system.is_damped() || system.load_factor().is_some() {
                own.power.add(work_of_motion(system, (&last, &now), x, &rate, &dx));
            } else {
                // Velocities of prescribed motion are known: the integral of the power is fourth-order.
                own.power.advance(h, power);
            }
        }
        self.equilibrium = Some(now);
    }

    /// Returns the work of time-dependent gravity [J]; `system` is at the time of `now` before and after.
    fn work_of_gravity(
        &self,
        system: &mut System,
        (last, now): (&Equilibrium, &Equilibrium),
        dx: &[f64],
    ) -> f64 {
        let looked = PowerSelection { loads: false, losses: false, ..self.looked };
        if !looked.gravity {
            return 0.0;
        }
        let after = Powers::of(system, looked, &now.x, dx).gravity;
        let factor = system.load_factor();
        if factor.is_some() {
            system.set_load_factor(Some(last.time));
        }
        system.set_time(last.time);
        let before = Powers::of(system, looked, &last.x, dx).gravity;
        system.set_load_factor(factor);
        system.set_time(now.time);
        0.5 * (before + after)
    }

    /// Continues from the state `x` after a release of pins.
    pub(super) fn rebase(&mut self, system: &mut System, x: &[f64]) {
        if let Some(last) = self.equilibrium.take() {
            self.equilibrium = Some(Equilibrium::of(system, self.looked, last.time, x));
        }
    }
}

/// Returns the work of prescribed motion against potentials, and against dissipation at the velocities
/// `rate` [m/s], in joules.
fn work_of_motion(
    system: &mut System,
    (last, now): (&Equilibrium, &Equilibrium),
    x: &[f64],
    rate: &[f64],
    dx: &[f64],
) -> f64 {
    let dissipated = carried(system, x, rate).into_iter();
    let potentials = last.carried.iter().zip(&now.carried);
    dissipated.zip(potentials).map(|((i, all), (last, now))| (0.5 * (last + now) + (all - now)) * dx[i]).sum()
}

/// `1/2 (a + b) . dx`; zero without forces.
fn mean_work(a: &[f64], b: &[f64], dx: &[f64]) -> f64 {
    a.iter().zip(b).zip(dx).map(|((a, b), dx)| 0.5 * (a + b) * dx).sum()
}

/// Returns each prescribed coordinate with the gradient there [N], including dissipation at the
/// velocities `v` [m/s].
fn carried(system: &mut System, x: &[f64], v: &[f64]) -> Vec<(usize, f64)> {
    if !system.has_prescribed_motion() {
        return vec![];
    }
    if system.is_damped() {
        system.evaluate_dissipation(x, v);
    }
    let (d, mut carried) = (system.dimension(), vec![]);
    for hold in system.constraints().iter().filter(|hold| hold.moves()) {
        let axes = hold.axes();
        system.visit_gradient(hold.vertices(), |vertex, gradient| {
            carried.extend((0..d).filter(|c| axes[*c]).map(|c| (vertex * d + c, gradient[c])));
        });
    }
    carried
}
