//! Measurements of a static equilibrium.

use super::Simulation;
use crate::diagnostics::Reaction;
use crate::topology::{BodyTopology, Topology};

/// Key figures of a static equilibrium.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StaticState {
    /// Largest displacement of a vertex from the reference configuration [m]; `index` is its number in
    /// the body, from 0.
    pub displacement: Extreme,
    /// Largest von Mises stress of an element [Pa]; `index` is its number in the body, from 0, `at` its
    /// centroid. `None` without elements that have one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub von_mises: Option<Extreme>,
    /// Sum of the reaction forces of all pins [N]; third component 0 in 2D.
    pub reactions: [f64; 3],
    /// Largest component of the residual force at a free coordinate [N]: the accuracy of the last
    /// increment.
    pub residual: f64,
}

/// Largest value of a quantity, and its location.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Extreme {
    /// Value.
    pub value: f64,
    /// Name of the body.
    pub body: String,
    /// Number of the vertex or element in the body, from 0.
    pub index: usize,
    /// Current position [m]; third component 0 in 2D.
    pub at: [f64; 3],
}

impl Simulation {
    /// Measures the current equilibrium. `topology` must be that of the same assembly. `None` if the
    /// method is not [static](crate::integrator::Method::is_static) or a force is not finite.
    pub fn static_state(&mut self, topology: &Topology) -> Option<StaticState> {
        if !self.method().is_static() {
            return None;
        }
        let residual = self.residual()?;
        let x = self.positions().into_owned();
        let displacement = largest_displacement(topology, &x)?;
        let von_mises = self.largest_von_mises(topology, &x);
        let reactions = sum(&self.reactions());
        Some(StaticState { displacement, von_mises, reactions, residual })
    }

    fn largest_von_mises(&self, topology: &Topology, x: &[f64]) -> Option<Extreme> {
        let d = topology.dimension;
        let (mut largest, mut first) = (None, 0);
        // Element by element: the states of all elements need more memory than the system.
        for elements in self.system.terms().iter().filter_map(|term| term.elements()) {
            elements.each_state(self.state.x(), &mut |number, state| {
                let found = (state.von_mises_stress(), first + number);
                // Elements without volume have no Cauchy stress.
                if found.0.is_finite() && largest.is_none_or(|largest| found > largest) {
                    largest = Some(found);
                }
            });
            first += elements.element_count();
        }
        let (value, mut index) = largest?;
        for body in &topology.bodies {
            let Some((vertices, corners)) = body.elements(d) else { continue };
            let count = vertices.len() / corners;
            if index < count {
                let cell = &vertices[index * corners..][..corners];
                return Some(extreme(value, body, index, centroid(x, cell, d)));
            }
            index -= count;
        }
        None
    }
}

fn largest_displacement(topology: &Topology, x: &[f64]) -> Option<Extreme> {
    let d = topology.dimension;
    let distances = x.chunks_exact(d).zip(topology.rest_positions.chunks_exact(d)).map(|(x, rest)| {
        let squares = x.iter().zip(rest).map(|(x, rest)| (x - rest) * (x - rest));
        squares.sum::<f64>().sqrt()
    });
    let (vertex, value) = distances.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let vertex = vertex as u32;
    let body = topology.bodies.iter().find(|body| body.vertices.contains(&vertex))?;
    Some(extreme(value, body, (vertex - body.vertices.start) as usize, centroid(x, &[vertex], d)))
}

fn extreme(value: f64, body: &BodyTopology, index: usize, at: [f64; 3]) -> Extreme {
    Extreme { value, body: body.name.clone(), index, at }
}

/// Mean position of these vertices.
fn centroid(x: &[f64], vertices: &[u32], d: usize) -> [f64; 3] {
    let mut mean = [0.0; 3];
    for vertex in vertices {
        let row = &x[*vertex as usize * d..][..d];
        mean.iter_mut().zip(row).for_each(|(mean, x)| *mean += x / vertices.len() as f64);
    }
    mean
}

fn sum(reactions: &[Reaction]) -> [f64; 3] {
    [0, 1, 2].map(|c| reactions.iter().map(|reaction| reaction.force[c]).sum())
}
