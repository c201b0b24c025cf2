//! Constants of contact.

use pliant::energy::{ContactLawRates, ContactPlace, LawInput, LawInputRates, LawLinks, ShapedContact};
use pliant::system::System;

use super::{ForceUse, ModeUse, Parameter, ParameterNeeds};
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

/// Contact of a system that goes by the shape at rest.
pub(crate) fn shaped(system: &System) -> Option<&dyn ShapedContact> {
    system.terms().iter().find_map(|term| term.touching()?.shaped())
}

/// Masses of vertices that go by the rest positions of a body.
pub trait MassShape: Send {
    /// Adds to the derivatives by its rest positions what those by all masses, vertices in the order of the
    /// simulation, make of them.
    fn add(&self, by_masses: &[f64], derivative: &mut [f64]);

    /// Adds to masses what a change of its rest positions makes of them: the transpose.
    fn add_change(&self, change: &[f64], masses: &mut [f64]);
}

/// Numbers by which contact goes, as those of a parameter make them.
enum ContactInputs {
    /// Rest positions of vertices, and the masses that go by them.
    Shape(Vec<u32>, Option<Box<dyn MassShape>>),
    /// Masses: number of the parameter, vertex, and the derivative of its mass by it.
    Masses(usize, Vec<(usize, u32, f64)>),
    /// Young's modulus of a body.
    Modulus(u32),
}

impl ContactInputs {
    /// Count of the numbers of the parameter.
    fn len(&self, d: usize) -> usize {
        match self {
            ContactInputs::Shape(vertices, _) => vertices.len() * d,
            ContactInputs::Masses(count, _) => *count,
            ContactInputs::Modulus(_) => 1,
        }
    }

    /// Adds to the derivatives by numbers of the parameter.
    fn add(&self, d: usize, by: &LawInputRates, derivative: &mut [f64]) {
        match self {
            ContactInputs::Shape(vertices, masses) => {
                for (vertex, derivative) in vertices.iter().zip(derivative.chunks_exact_mut(d)) {
                    add_scaled(derivative, 1.0, &by.rest[*vertex as usize * d..][..d]);
                }
                if let Some(masses) = masses {
                    masses.add(&by.masses, derivative);
                }
            }
            ContactInputs::Masses(_, each) => {
                each.iter().for_each(|(i, v, rate)| derivative[*i] += rate * by.masses[*v as usize]);
            }
            ContactInputs::Modulus(body) => derivative[0] += by.moduli[*body as usize],
        }
    }

    /// Adds the change that one of the parameter makes: the transpose.
    fn add_change(&self, d: usize, change: &[f64], to: &mut LawInputRates) {
        match self {
            ContactInputs::Shape(vertices, masses) => {
                for (vertex, change) in vertices.iter().zip(change.chunks_exact(d)) {
                    add_scaled(&mut to.rest[*vertex as usize * d..][..d], 1.0, change);
                }
                if let Some(masses) = masses {
                    masses.add_change(change, &mut to.masses);
                }
            }
            ContactInputs::Masses(_, each) => {
                each.iter().for_each(|(i, v, rate)| to.masses[*v as usize] += rate * change[*i]);
            }
            ContactInputs::Modulus(body) => to.moduli[*body as usize] += change[0],
        }
    }
}

/// Shape and masses of all bodies, of which contact is made.
#[derive(Clone, Debug)]
pub struct ContactBasis {
    /// 2 or 3.
    pub dimension: usize,
    /// Rest positions of all vertices, flat, in the order of the simulation [m].
    pub rest: Vec<f64>,
    /// Masses of all vertices, likewise [kg].
    pub masses: Vec<f64>,
}

/// Numbers of bodies that contact goes by: by the areas of surfaces, and by its laws, which are made of
/// sizes, masses and moduli where the scene does not give them.
pub struct ContactNumbers {
    basis: ContactBasis,
    inputs: ContactInputs,
    /// Once they have been asked for.
    links: Option<LawLinks>,
}

impl ContactNumbers {
    fn new(basis: ContactBasis, inputs: ContactInputs) -> Self {
        ContactNumbers { basis, inputs, links: None }
    }

    /// Rest positions of these vertices, by their numbers in the simulation, and the masses that go by them.
    pub fn shape(basis: ContactBasis, vertices: Vec<u32>, masses: Option<Box<dyn MassShape>>) -> Self {
        Self::new(basis, ContactInputs::Shape(vertices, masses))
    }

    /// A count of numbers that masses go by: number, vertex in the simulation, derivative of its mass by it.
    pub fn masses(basis: ContactBasis, count: usize, each: Vec<(usize, u32, f64)>) -> Self {
        Self::new(basis, ContactInputs::Masses(count, each))
    }

    /// Young's modulus of a body, by its number in the scene.
    pub fn modulus(basis: ContactBasis, body: u32) -> Self {
        Self::new(basis, ContactInputs::Modulus(body))
    }

    /// Nothing, for each number that contact goes by.
    fn zero(&self, contact: &dyn ShapedContact) -> LawInputRates {
        LawInputRates {
            rest: vec![0.0; self.basis.rest.len()],
            masses: vec![0.0; self.basis.masses.len()],
            moduli: vec![0.0; contact.bodies()],
        }
    }

    /// Finds the links of the laws, once; false where neither they nor areas go by its numbers.
    fn find_links(&mut self, contact: &dyn ShapedContact) -> bool {
        let ContactBasis { rest, masses, .. } = &self.basis;
        let links = self.links.get_or_insert_with(|| contact.law_links(rest, masses));
        let mut inputs = links.pairs.iter().map(|(_, _, input, _)| input);
        match &self.inputs {
            ContactInputs::Shape(..) => true,
            ContactInputs::Masses(..) => inputs.any(|input| matches!(input, LawInput::Mass(_))),
            ContactInputs::Modulus(body) => inputs.any(|input| *input == LawInput::Modulus(*body)),
        }
    }
}

/// Place of a use of forces.
fn place<'a>(of: &ForceUse<'a>) -> ContactPlace<'a> {
    ContactPlace { x: of.x, v: of.v, held: of.held }
}

impl Parameter for ContactNumbers {
    fn len(&self) -> usize {
        self.inputs.len(self.basis.dimension)
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { shaped_contact: true, ..ParameterNeeds::default() }
    }

    /// Nothing touches where no force acts.
    fn add_mode(&mut self, _: &ModeUse<'_>, _: &mut [f64]) -> bool {
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let Some(contact) = shaped(of.system) else { return false };
        if !self.find_links(contact) {
            return true;
        }
        let mut inputs = self.zero(contact);
        self.inputs.add_change(self.basis.dimension, change, &mut inputs);
        let links = self.links.as_ref().filter(|links| !links.is_empty());
        let laws = links.map(|links| links.changes(&inputs, contact.bodies()));
        let mut gradient = vec![0.0; force.len()];
        let changes = (&inputs.rest[..], laws.as_ref());
        contact.add_gradient_by_shape(place(of), changes, &self.basis.rest, &mut gradient);
        add_scaled(force, -1.0, &gradient);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let Some(contact) = shaped(of.system) else { return };
        if !self.find_links(contact) {
            return;
        }
        let mut by = self.zero(contact);
        let links = self.links.as_ref().filter(|links| !links.is_empty());
        let mut laws = links.map(|_| ContactLawRates::zero(contact.bodies()));
        let to = (&mut by.rest[..], laws.as_mut());
        contact.add_work_by_shape(place(of), of.p, &self.basis.rest, to);
        if let (Some(links), Some(laws)) = (links, &laws) {
            links.add_rates(laws, &mut by);
        }
        let opposite = |by: &mut Vec<f64>| by.iter_mut().for_each(|by| *by = -*by);
        [&mut by.rest, &mut by.masses, &mut by.moduli].into_iter().for_each(opposite);
        self.inputs.add(self.basis.dimension, &by, derivative);
    }
}
