//! Parameters of mass: vertex masses and body densities.

use std::ops::Range;

use pliant::system::System;

use super::{ForceUse, ModeUse, Parameter, ParameterNeeds};

/// Lumped masses of vertices [kg]. They act through inertia, uniform gravity and mass-proportional
/// damping; mutual gravity is not included.
#[derive(Clone, Debug)]
pub struct Masses {
    /// Vertices in the order of the simulation.
    vertices: Vec<u32>,
}

impl Masses {
    /// Masses of these vertices, by index in the simulation.
    pub fn new(vertices: Vec<u32>) -> Self {
        Masses { vertices }
    }
}

impl Parameter for Masses {
    fn len(&self) -> usize {
        self.vertices.len()
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { force: true, ..ParameterNeeds::default() }
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        for (derivative, vertex) in derivative.iter_mut().zip(&self.vertices) {
            *derivative += mode_by_mass(of, *vertex as usize);
        }
        of.is_lumped
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let gravity = uniform_gravity(of.system);
        for (change, vertex) in change.iter().zip(&self.vertices) {
            add_by_mass(of, &gravity, *vertex as usize, *change, force);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let gravity = uniform_gravity(of.system);
        for (derivative, vertex) in derivative.iter_mut().zip(&self.vertices) {
            *derivative += by_mass(of, &gravity, *vertex as usize);
        }
    }
}

/// Density of a body [kg/m^3], to which all of its masses are proportional.
#[derive(Clone, Debug)]
pub struct BodyDensity {
    density: f64,
    /// Vertices in the order of the simulation.
    vertices: Vec<u32>,
}

impl BodyDensity {
    /// Density of a body with these vertices; `internal` gives their indices in the simulation.
    pub fn new(density: f64, vertices: Range<u32>, internal: impl Fn(u32) -> u32) -> Self {
        BodyDensity { density, vertices: vertices.map(internal).collect() }
    }
}

impl Parameter for BodyDensity {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { force: true, ..ParameterNeeds::default() }
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        let each = |vertex: &u32| {
            let vertex = *vertex as usize;
            of.system.mass()[vertex] / self.density * mode_by_mass(of, vertex)
        };
        derivative[0] += self.vertices.iter().map(each).sum::<f64>();
        of.is_lumped
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let gravity = uniform_gravity(of.system);
        for vertex in &self.vertices {
            let vertex = *vertex as usize;
            add_by_mass(of, &gravity, vertex, of.system.mass()[vertex] / self.density * change[0], force);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let gravity = uniform_gravity(of.system);
        let each = |vertex: &u32| {
            let vertex = *vertex as usize;
            of.system.mass()[vertex] / self.density * by_mass(of, &gravity, vertex)
        };
        derivative[0] += self.vertices.iter().map(each).sum::<f64>();
    }
}

/// Density of a body in statics [kg/m^3], where it has weight but no inertia: the weight `m g` and the
/// mass-proportional damping force `-alpha m v` are proportional to it.
#[derive(Clone, Debug)]
pub struct WeightDensity {
    of: BodyDensity,
    /// Acceleration of gravity [m/s^2], one number for each dimension.
    gravity: Vec<f64>,
}

impl WeightDensity {
    /// Density of a body whose masses act as weights under this constant gravity.
    pub fn new(of: BodyDensity, gravity: Vec<f64>) -> Self {
        WeightDensity { of, gravity }
    }
}

impl Parameter for WeightDensity {
    fn len(&self) -> usize {
        1
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for i in self.coordinates(of.system) {
            force[i] += self.by_density(of, i) * change[0];
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        derivative[0] += self.coordinates(of.system).map(|i| of.p[i] * self.by_density(of, i)).sum::<f64>();
    }
}

impl WeightDensity {
    fn coordinates(&self, system: &System) -> impl Iterator<Item = usize> {
        let d = system.dimension();
        self.of.vertices.iter().flat_map(move |vertex| *vertex as usize * d..(*vertex as usize + 1) * d)
    }

    /// Derivative of the force along a coordinate.
    fn by_density(&self, of: &ForceUse<'_>, i: usize) -> f64 {
        let (vertex, axis) = (i / of.system.dimension(), i % of.system.dimension());
        let damping = of.system.dissipation().iter().filter_map(|term| term.vertex_drag());
        let drag: f64 = damping.map(|term| term.drag(vertex)).sum();
        (of.system.mass()[vertex] * self.gravity[axis] - drag * of.v[i]) / self.of.density
    }
}

/// Sum of the accelerations of all terms that accelerate every vertex equally [m/s^2].
pub(super) fn uniform_gravity(system: &System) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for acceleration in system.terms().iter().filter_map(|term| term.layout()?.acceleration()) {
        sum.iter_mut().zip(acceleration).for_each(|(sum, a)| *sum += a);
    }
    sum
}

/// Derivative by the mass of a vertex, of `a = g - (dE/dx + m g)/m`, where `dE/dx` contains `-m g` of
/// gravity.
pub(super) fn by_mass(of: &ForceUse<'_>, gravity: &[f64; 3], vertex: usize) -> f64 {
    let (d, mass) = (of.system.dimension(), of.system.mass()[vertex]);
    let coordinates = vertex * d..(vertex + 1) * d;
    let rows = of.p[coordinates.clone()].iter().zip(&of.gradient[coordinates]).zip(gravity);
    rows.map(|((p, gradient), g)| p * (gradient / mass + g)).sum()
}

/// Transpose of [`by_mass`]: adds the change of the force due to a `change` of the mass of a vertex.
pub(super) fn add_by_mass(
    of: &ForceUse<'_>,
    gravity: &[f64; 3],
    vertex: usize,
    change: f64,
    force: &mut [f64],
) {
    let (d, mass) = (of.system.dimension(), of.system.mass()[vertex]);
    let coordinates = vertex * d..(vertex + 1) * d;
    let rows = force[coordinates.clone()].iter_mut().zip(&of.gradient[coordinates]).zip(gravity);
    rows.for_each(|((force, gradient), g)| *force += change * (gradient / mass + g));
}

/// Derivative of `omega^2` of a mode by the lumped mass of a vertex, `-omega^2 |phi|^2` there.
pub(super) fn mode_by_mass(of: &ModeUse<'_>, vertex: usize) -> f64 {
    let d = of.system.dimension();
    -of.square * of.shape[vertex * d..][..d].iter().map(|phi| phi * phi).sum::<f64>()
}
