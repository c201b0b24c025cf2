//! Constants of contact.

use pliant::energy::{ContactPlace, ShapedContact};
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

/// Rest positions of the vertices of a body as contact goes by them: by the areas of surfaces.
#[derive(Clone, Debug)]
pub struct ContactShape {
    body: String,
    dimension: usize,
    /// Numbers of the vertices in the simulation.
    vertices: Vec<u32>,
    /// Rest positions of all vertices of the simulation, flat [m].
    rest: Vec<f64>,
}

/// Contact of a system that goes by the shape at rest.
pub(crate) fn shaped(system: &System) -> Option<&dyn ShapedContact> {
    system.terms().iter().find_map(|term| term.touching()?.shaped())
}

impl ContactShape {
    /// Shape of the body of this name and of these vertices, by their numbers in the simulation, in
    /// `dimension` dimensions; `rest` are the rest positions of all vertices, flat, likewise [m].
    pub fn new(body: String, dimension: usize, vertices: Vec<u32>, rest: Vec<f64>) -> Self {
        ContactShape { body, dimension, vertices, rest }
    }

    /// Ranges of the rows of its vertices.
    fn rows(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        self.vertices.iter().map(|vertex| *vertex as usize * self.dimension).map(|at| at..at + self.dimension)
    }
}

/// Place of a use of forces.
fn place<'a>(of: &ForceUse<'a>) -> ContactPlace<'a> {
    ContactPlace { x: of.x, v: of.v, held: of.held }
}

impl Parameter for ContactShape {
    fn len(&self) -> usize {
        self.vertices.len() * self.dimension
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { touching_shapes: vec![&self.body], ..ParameterNeeds::default() }
    }

    /// Nothing touches where no force acts.
    fn add_mode(&mut self, _: &ModeUse<'_>, _: &mut [f64]) -> bool {
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let Some(contact) = shaped(of.system) else { return false };
        let (mut moved, mut gradient) = (vec![0.0; force.len()], vec![0.0; force.len()]);
        for (range, change) in self.rows().zip(change.chunks_exact(self.dimension)) {
            moved[range].copy_from_slice(change);
        }
        contact.add_gradient_by_shape(place(of), &moved, &self.rest, &mut gradient);
        add_scaled(force, -1.0, &gradient);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let Some(contact) = shaped(of.system) else { return };
        let mut rows = vec![0.0; of.p.len()];
        contact.add_work_by_shape(place(of), of.p, &self.rest, &mut rows);
        for (range, derivative) in self.rows().zip(derivative.chunks_exact_mut(self.dimension)) {
            add_scaled(derivative, -1.0, &rows[range]);
        }
    }
}

/// Numbers that the distance `dhat` goes by from which on surfaces push, where nothing has a thickness.
///
/// Where all lengths but areas at rest grow by one factor, `dhat` and the fourth root of the mollifier's
/// `eps` of edges among them, the energy of contact does, too, and friction stays as it is. So with the
/// gradients `g`, of the energy and of friction, their change `H x` where places move by themselves, and `c`
/// the same where rest positions do, which is that of areas, `(D - 1) g`, and of `eps`,
///
/// ```text
/// dhat dg/d dhat = -H x - c + (D - 1) g
/// ```
#[derive(Clone, Debug)]
pub struct ContactReach {
    /// `dhat` [m].
    reach: f64,
    /// Its derivatives by the numbers.
    slopes: Vec<f64>,
    dimension: usize,
    /// Rest positions of all vertices of the simulation, flat [m].
    rest: Vec<f64>,
}

impl ContactReach {
    /// Numbers by which the `reach` [m] has these derivatives, in `dimension` dimensions; `rest` are the rest
    /// positions of all vertices, flat, in the order of the simulation [m].
    pub fn new(reach: f64, slopes: Vec<f64>, dimension: usize, rest: Vec<f64>) -> Self {
        ContactReach { reach, slopes, dimension, rest }
    }

    /// Derivative of the gradients by the reach [N/m]; `None` where it is not known.
    fn by_reach(&self, of: &ForceUse<'_>) -> Option<Vec<f64>> {
        let mut rows = of.stretched.to_vec();
        shaped(of.system)?.add_gradient_by_shape(place(of), &self.rest, &self.rest, &mut rows);
        let of_areas = -((self.dimension - 1) as f64);
        add_scaled(&mut rows, of_areas, of.contact);
        add_scaled(&mut rows, of_areas, of.friction);
        rows.iter_mut().for_each(|row| *row /= -self.reach);
        Some(rows)
    }
}

impl Parameter for ContactReach {
    fn len(&self) -> usize {
        self.slopes.len()
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { contact: true, stretched_contact: true, ..ParameterNeeds::default() }
    }

    /// Nothing touches where no force acts.
    fn add_mode(&mut self, _: &ModeUse<'_>, _: &mut [f64]) -> bool {
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let Some(by_reach) = self.by_reach(of) else { return false };
        add_scaled(force, -dot(&self.slopes, change), &by_reach);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let Some(by_reach) = self.by_reach(of) else { return };
        add_scaled(derivative, -dot(&by_reach, of.p), &self.slopes);
    }
}

/// Relative derivative of the stiffness between two bodies of these names, which has this value [Pa].
type PairRate = dyn Fn([&str; 2], f64) -> f64 + Send;

/// A number that the stiffness `kappa` of contact goes by, another between each two bodies.
pub struct PairStiffness {
    rate: Box<PairRate>,
}

impl PairStiffness {
    /// A number with this derivative of `ln kappa`, by the names of two bodies and `kappa` [Pa].
    pub fn new(rate: impl Fn([&str; 2], f64) -> f64 + Send + 'static) -> Self {
        PairStiffness { rate: Box::new(rate) }
    }

    /// Derivative of the gradients of contact and of friction by the number.
    fn gradient(&self, of: &ForceUse<'_>) -> Option<Vec<f64>> {
        let mut rows = vec![0.0; of.x.len()];
        shaped(of.system)?.add_scaled_gradient(place(of), &self.rate, &mut rows);
        Some(rows)
    }
}

impl Parameter for PairStiffness {
    fn len(&self) -> usize {
        1
    }

    /// Nothing touches where no force acts.
    fn add_mode(&mut self, _: &ModeUse<'_>, _: &mut [f64]) -> bool {
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let Some(gradient) = self.gradient(of) else { return false };
        add_scaled(force, -change[0], &gradient);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        derivative[0] -= self.gradient(of).map_or(0.0, |gradient| dot(&gradient, of.p));
    }
}
