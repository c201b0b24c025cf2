//! Where the pins of a scene are, found from its meshes alone.

use super::{build_bodies, memory};
use crate::{Problem, Scene};

/// Vertices that one pin of a scene holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PinnedVertices {
    /// Name of the pin, as `beam/left`.
    pub name: String,
    /// Its vertices, numbered as in recordings, ascending.
    pub vertices: Vec<u32>,
}

/// Pins of a scene, and the number of vertices that their numbers count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PinPlaces {
    /// The pins, body after body.
    pub pins: Vec<PinnedVertices>,
    /// Number of vertices of all bodies.
    pub vertex_count: usize,
}

impl Scene {
    /// Finds the vertices of all pins; meshes are built for that, terms and matrices are not.
    ///
    /// # Errors
    /// Every problem with a mesh, a selection or a mass.
    pub fn pin_places(&self) -> Result<PinPlaces, Vec<Problem>> {
        memory::check(self)?;
        let bodies = build_bodies(self, &self.directory)?;
        let mut pins = vec![];
        for body in &bodies {
            for pin in &body.held {
                let name = format!("{}/{}", body.name, pin.name);
                let vertices = pin.vertices.iter().map(|vertex| body.first_vertex + vertex).collect();
                pins.push(PinnedVertices { name, vertices });
            }
        }
        Ok(PinPlaces { pins, vertex_count: bodies.iter().map(|body| body.mass.len()).sum() })
    }
}
