//! Masses of vertices, and densities of bodies.

use std::ops::Range;

use pliant::system::System;

use super::{ForceUse, ModeUse, Parameter};

/// Lumped masses of vertices [kg]. Uniform gravity pulls at the mass that it accelerates, and damping in
/// proportion to masses grows with them; no other force depends on them, as mutual gravity would.
#[derive(Clone, Debug)]
pub struct Masses {
    /// Vertices in the order of the simulation.
    vertices: Vec<u32>,
}

impl Masses {
    /// Masses of these vertices, by their numbers in the simulation.
    pub fn new(vertices: Vec<u32>) -> Self {
        Masses { vertices }
    }
}

impl Parameter for Masses {
    fn len(&self) -> usize {
        self.vertices.len()
    }

    fn needs_force(&self) -> bool {
        true
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

/// BodyDensity of a body [kg/m^3]: all of its masses in one proportion.
#[derive(Clone, Debug)]
pub struct BodyDensity {
    density: f64,
    /// Vertices in the order of the simulation.
    vertices: Vec<u32>,
}

impl BodyDensity {
    /// The `density` of a body of these vertices, by their numbers in the simulation.
    pub fn new(density: f64, vertices: Range<u32>, internal: impl Fn(u32) -> u32) -> Self {
        BodyDensity { density, vertices: vertices.map(internal).collect() }
    }
}

impl Parameter for BodyDensity {
    fn len(&self) -> usize {
        1
    }

    fn needs_force(&self) -> bool {
        true
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

/// BodyDensity of a body in statics [kg/m^3], where it has weight and no inertia.
#[derive(Clone, Debug)]
pub struct WeightDensity {
    of: BodyDensity,
    /// Acceleration of gravity [m/s^2], a number for each dimension.
    gravity: Vec<f64>,
}

impl WeightDensity {
    /// Of a body whose vertices have their masses for weights, under this constant gravity.
    pub fn new(of: BodyDensity, gravity: Vec<f64>) -> Self {
        WeightDensity { of, gravity }
    }
}

impl Parameter for WeightDensity {
    fn len(&self) -> usize {
        1
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let d = of.system.dimension();
        for vertex in &self.of.vertices {
            let weight = of.system.mass()[*vertex as usize] / self.of.density * change[0];
            let row = &mut force[*vertex as usize * d..][..d];
            row.iter_mut().zip(&self.gravity).for_each(|(force, g)| *force += weight * g);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let d = of.system.dimension();
        let each = |vertex: &u32| {
            let p = &of.p[*vertex as usize * d..][..d];
            let along = p.iter().zip(&self.gravity).map(|(p, g)| p * g).sum::<f64>();
            of.system.mass()[*vertex as usize] / self.of.density * along
        };
        derivative[0] += self.of.vertices.iter().map(each).sum::<f64>();
    }
}

/// Acceleration by all terms that give every vertex the same [m/s^2].
pub(super) fn uniform_gravity(system: &System) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for acceleration in system.terms().iter().filter_map(|term| term.layout()?.acceleration()) {
        sum.iter_mut().zip(acceleration).for_each(|(sum, a)| *sum += a);
    }
    sum
}

/// Derivative by the mass of a vertex: of `a = g - (dE/dx + m g)/m`, where `dE/dx` has `-m g` of gravity.
pub(super) fn by_mass(of: &ForceUse<'_>, gravity: &[f64; 3], vertex: usize) -> f64 {
    let (d, mass) = (of.system.dimension(), of.system.mass()[vertex]);
    let coordinates = vertex * d..(vertex + 1) * d;
    let rows = of.p[coordinates.clone()].iter().zip(&of.gradient[coordinates]).zip(gravity);
    rows.map(|((p, gradient), g)| p * (gradient / mass + g)).sum()
}

/// The transpose of [`by_mass`]: adds to the force what a `change` of the mass of a vertex makes of it.
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

/// Derivative of `omega^2` of a mode by the lumped mass of a vertex: `-omega^2 |phi|^2` there.
pub(super) fn mode_by_mass(of: &ModeUse<'_>, vertex: usize) -> f64 {
    let d = of.system.dimension();
    -of.square * of.shape[vertex * d..][..d].iter().map(|phi| phi * phi).sum::<f64>()
}
