//! Measurements of a state: energies, momenta, worst element; stability limit of the step.

/// Measurements of one state. Sums run over all vertices in index order.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Diagnostics {
    /// Simulated time [s].
    pub time: f64,
    /// Load factor; `None` unless a path of equilibria is followed by arc length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_factor: Option<f64>,
    /// `sum 1/2 m |v|^2` [J].
    pub kinetic: f64,
    /// Energy of all elements and springs [J].
    pub elastic: f64,
    /// `-sum m g.x` plus the mutual energy of gravitating bodies [J].
    pub gravitational: f64,
    /// Potential energy of loads and of muscle tension [J]; `None` without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loads: Option<f64>,
    /// Energy stored in contact [J]; `None` without contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<f64>,
    /// Energy of terms of [other kinds](EnergyKind::Other) [J]; `None` without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other: Option<f64>,
    /// Sum of the above [J].
    pub total: f64,
    /// Energy that entered and left since the start; `None` without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub balance: Option<Balance>,
    /// `sum m v` [kg m/s]; third component 0 in 2D.
    pub linear_momentum: [f64; 3],
    /// `sum m x cross v` about the origin [kg m^2/s]; in 2D only the third component.
    pub angular_momentum: [f64; 3],
    /// Smallest `det F` of any element; `None` without elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_j: Option<f64>,
    /// Number of elements with `det F <= 0`; `None` without elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inverted: Option<u64>,
}

mod balance;
mod integral;
mod ledger;
mod measures;
mod reaction;
pub mod recovery;
mod stability;
mod wall_reaction;

pub use crate::element::ElementState;
pub use balance::Balance;
pub(crate) use ledger::EnergyLedger;
pub(crate) use measures::symmetric_tensor;
pub use measures::{
    CONTACT_MEASURES, ContactTraction, ERROR_MEASURE, FieldRows, MEASURES, Measure, NODAL_MEASURES,
    RecordedField, SymmetricTensor,
};
pub use reaction::Reaction;
pub(crate) use reaction::{ReactionInputs, reactions};
pub use stability::{
    DampedMode, HighestFrequency, ModeRange, StabilityLimit, largest_frequency, mode_range, stability_limit,
};

use crate::energy::EnergyKind;
use crate::state::State;
use crate::system::{ForceId, System};

impl Diagnostics {
    /// Measures a state. Sums run in index order on one thread, or over fixed groups: bit-identical for
    /// any number of threads.
    pub fn measure(system: &mut System, time: f64, x: &[f64], v: &[f64]) -> Self {
        Self::measure_with_force(system, time, x, v, ForceId::NONE)
    }

    /// Measures `state`, reusing what was computed with its force.
    pub(crate) fn measure_state(system: &mut System, state: &State) -> Self {
        Self::measure_with_force(system, state.time, state.x(), state.v(), state.force)
    }

    /// Measures a state without inertia: kinetic energy and momenta are zero.
    pub(crate) fn measure_at_rest(system: &mut System, state: &State) -> Self {
        let rest = vec![0.0; state.v().len()];
        Self::measure_with_force(system, state.time, state.x(), &rest, state.force)
    }

    fn measure_with_force(system: &mut System, time: f64, x: &[f64], v: &[f64], force: ForceId) -> Self {
        system.set_time(time);
        let kinetic = system.kinetic(v);
        // Potential energies by kind; `None` if no term has that kind.
        let mut of_kind = |asked: fn(EnergyKind) -> bool| {
            let is_there = system.terms().iter().any(|term| asked(term.properties().kind));
            is_there.then(|| system.potential_with_force(asked, x, force))
        };
        let elastic = of_kind(|kind| kind == EnergyKind::Elastic).unwrap_or(0.0);
        let gravitational = of_kind(|kind| kind == EnergyKind::Gravitational).unwrap_or(0.0);
        let loads = of_kind(|kind| kind == EnergyKind::Load);
        let contact = of_kind(|kind| kind == EnergyKind::Contact);
        let other = of_kind(|kind| matches!(kind, EnergyKind::Other(_)));
        let stored = [loads, contact, other].into_iter().flatten();
        // Momenta and the worst element.
        let (linear_momentum, angular_momentum) = match system.dimension() {
            2 => momenta::<2>(system.mass(), x, v),
            _ => momenta::<3>(system.mass(), x, v),
        };
        let deformation = system.deformation(x);
        Diagnostics {
            time,
            load_factor: system.load_factor(),
            kinetic,
            elastic,
            gravitational,
            loads,
            contact,
            other,
            total: stored.fold(kinetic + elastic + gravitational, |sum, energy| sum + energy),
            balance: None,
            linear_momentum,
            angular_momentum,
            min_j: deformation.map(|d| d.min_j),
            inverted: deformation.map(|d| d.inverted),
        }
    }
}

impl Diagnostics {
    /// Returns the potential energies that only some systems have, by field name [J].
    pub fn further_energies(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let named = [("loads", self.loads), ("contact", self.contact), ("other", self.other)];
        named.into_iter().filter_map(|(name, energy)| Some((name, energy?)))
    }

    /// Returns the conserved energy [J]: the total minus the net energy that entered.
    pub fn conserved(&self) -> f64 {
        self.energy().conserved()
    }

    /// Returns the energy alone.
    pub(crate) fn energy(&self) -> Energy {
        Energy { total: self.total, balance: self.balance }
    }
}

/// Energy of a state and its balance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Energy {
    /// Kinetic plus potential energy [J].
    pub(crate) total: f64,
    pub(crate) balance: Option<Balance>,
}

impl Energy {
    /// Returns the conserved energy [J]: the total minus the net energy that entered.
    pub(crate) fn conserved(&self) -> f64 {
        self.total - self.balance.map_or(0.0, |balance| balance.net())
    }

    /// Returns the growth of energy since `start` without external supply [J]. Losses do not compensate a
    /// gain, and a negative loss, itself a gain, does not hide one.
    pub(crate) fn gain(&self, start: &Energy) -> f64 {
        let without_losses =
            |energy: &Energy| energy.conserved() - energy.balance.map_or(0.0, |balance| balance.lost());
        (self.conserved() - start.conserved()).max(without_losses(self) - without_losses(start))
    }
}

/// Computes `sum m v` and `sum m x cross v`.
fn momenta<const D: usize>(mass: &[f64], x: &[f64], v: &[f64]) -> ([f64; 3], [f64; 3]) {
    let (mut p, mut l) = ([0.0; 3], [0.0; 3]);
    let rows = x.as_chunks::<D>().0.iter().zip(v.as_chunks::<D>().0);
    for ((xi, vi), m) in rows.zip(mass) {
        let (mut x, mut v) = ([0.0; 3], [0.0; 3]);
        x[..D].copy_from_slice(xi);
        v[..D].copy_from_slice(vi);
        for c in 0..3 {
            let (a, b) = ((c + 1) % 3, (c + 2) % 3);
            p[c] += m * v[c];
            l[c] += m * (x[a] * v[b] - x[b] * v[a]);
        }
    }
    (p, l)
}

#[cfg(test)]
mod tests;
