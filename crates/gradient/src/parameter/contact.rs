//! Parameters of contact.

use pliant::energy::{ContactPlace, ShapedContact};
use pliant::system::System;

use super::{ForceUse, ModeUse, Parameter, ParameterNeeds};
use crate::adjoint::add_scaled;
use pliant::algebra::dot;

/// Contact stiffness `kappa` [Pa], common to all pairs. Energies, normal forces and friction are
/// proportional to it.
#[derive(Clone, Copy, Debug)]
pub struct ContactStiffness {
    stiffness: f64,
}

impl ContactStiffness {
    /// Stiffness with its present value.
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

/// Friction coefficient `mu`, common to all pairs with friction. Friction forces are proportional to it.
#[derive(Clone, Copy, Debug)]
pub struct FrictionCoefficient {
    coefficient: f64,
}

impl FrictionCoefficient {
    /// Coefficient with its present value, above zero.
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

/// Contact of a system that depends on the reference shape.
pub(crate) fn shaped(system: &System) -> Option<&dyn ShapedContact> {
    system.terms().iter().find_map(|term| term.touching()?.shaped())
}

/// Reference positions of a body, on which the contact areas depend; contact parameters are fixed.
pub struct ContactShape {
    /// Reference positions of all vertices, flat, in the order of the simulation [m].
    rest: Vec<f64>,
    /// Vertices of the body.
    vertices: Vec<u32>,
    dimension: usize,
}

impl ContactShape {
    /// Shape of these vertices, by index in the simulation, with the reference positions `rest` of all.
    pub fn new(rest: Vec<f64>, vertices: Vec<u32>, dimension: usize) -> Self {
        ContactShape { rest, vertices, dimension }
    }
}

/// Evaluation point of a force.
fn place<'a>(of: &ForceUse<'a>) -> ContactPlace<'a> {
    ContactPlace { x: of.x, v: of.v, held: of.held }
}

impl Parameter for ContactShape {
    fn len(&self) -> usize {
        self.vertices.len() * self.dimension
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { shaped_contact: true, ..ParameterNeeds::default() }
    }

    /// Adds nothing: without forces there is no contact.
    fn add_mode(&mut self, _: &ModeUse<'_>, _: &mut [f64]) -> bool {
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let Some(contact) = shaped(of.system) else { return false };
        let (d, mut moved) = (self.dimension, vec![0.0; self.rest.len()]);
        for (vertex, change) in self.vertices.iter().zip(change.chunks_exact(d)) {
            moved[*vertex as usize * d..][..d].copy_from_slice(change);
        }
        let mut gradient = vec![0.0; force.len()];
        contact.add_gradient_by_shape(place(of), &moved, &self.rest, &mut gradient);
        add_scaled(force, -1.0, &gradient);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let Some(contact) = shaped(of.system) else { return };
        let (d, mut by) = (self.dimension, vec![0.0; self.rest.len()]);
        contact.add_work_by_shape(place(of), of.p, &self.rest, &mut by);
        for (vertex, derivative) in self.vertices.iter().zip(derivative.chunks_exact_mut(d)) {
            add_scaled(derivative, -1.0, &by[*vertex as usize * d..][..d]);
        }
    }
}
