//! Parameters that scale whole terms, linearly or by a power.

use super::{ForceUse, Parameter, ParameterNeeds};
use crate::adjoint::add_scaled;
use pliant::algebra::dot;

/// Parameter `theta` with `dE/d theta = sum_i c_i E_i` and `dR/d theta = sum_i c_i R_i`, energies and
/// dissipation functions of terms of the system: `c = n/theta` for a term proportional to `theta^n`.
#[derive(Clone, Debug)]
pub struct TermFactor {
    /// Factor of each term, with the term's name.
    parts: Vec<(f64, String)>,
}

impl TermFactor {
    /// Parameter with these parts: factors, and names of terms that the system must have.
    pub fn new(parts: Vec<(f64, String)>) -> Self {
        TermFactor { parts }
    }
}

impl Parameter for TermFactor {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        let terms = self.parts.iter().map(|(_, name)| &name[..]).collect();
        ParameterNeeds { terms, ..ParameterNeeds::default() }
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (factor, name) in &self.parts {
            add_scaled(force, -factor * change[0], of.rows_of(name));
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        derivative[0] -= self.parts.iter().map(|(c, name)| c * dot(of.rows_of(name), of.p)).sum::<f64>();
    }
}

/// Mass-proportional drag `c` [1/s], with the force `-c M v`.
#[derive(Clone, Copy, Debug)]
pub struct EtherDrag;

impl Parameter for EtherDrag {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { ether_drag: true, ..ParameterNeeds::default() }
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let (d, mass) = (of.system.dimension(), of.system.mass());
        let each = force.iter_mut().zip(of.v).enumerate();
        each.for_each(|(i, (force, v))| *force -= change[0] * mass[i / d] * v);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let (d, mass) = (of.system.dimension(), of.system.mass());
        let each = of.p.iter().zip(of.v).enumerate();
        derivative[0] -= each.map(|(i, (p, v))| mass[i / d] * p * v).sum::<f64>();
    }
}
