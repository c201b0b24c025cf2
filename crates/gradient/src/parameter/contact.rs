//! Constants of contact.

use super::{ForceUse, Parameter, ParameterNeeds};
use crate::adjoint::{add_scaled, dot};

/// Stiffness `kappa` of contact [Pa], the same of all pairs: energies and normal forces are in proportion to
/// it, and friction is to these.
#[derive(Clone, Copy, Debug)]
pub struct ContactStiffness {
    stiffness: f64,
}

impl ContactStiffness {
    /// Of this value now.
    pub fn new(stiffness: f64) -> Self {
        ContactStiffness { stiffness }
    }
}

impl Parameter for ContactStiffness {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { contact: true, ..ParameterNeeds::default() }
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        add_scaled(force, -change[0] / self.stiffness, of.contact);
        add_scaled(force, -change[0] / self.stiffness, of.friction);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        derivative[0] -= (dot(of.contact, of.p) + dot(of.friction, of.p)) / self.stiffness;
    }
}

/// Coefficient of friction `mu`, the same of all pairs that rub: forces are in proportion to it.
#[derive(Clone, Copy, Debug)]
pub struct FrictionCoefficient {
    coefficient: f64,
}

impl FrictionCoefficient {
    /// Of this value now, above zero.
    pub fn new(coefficient: f64) -> Self {
        FrictionCoefficient { coefficient }
    }
}

impl Parameter for FrictionCoefficient {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { contact: true, ..ParameterNeeds::default() }
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        add_scaled(force, -change[0] / self.coefficient, of.friction);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        derivative[0] -= dot(of.friction, of.p) / self.coefficient;
    }
}
