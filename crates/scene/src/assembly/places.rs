//! Positions of the pins and loads of a scene, found from its meshes alone.

use pliant::energy::attachment::Tie;
use pliant::numbering::Numbering;

use super::attachments::{self, AttachmentPlan};
use super::{build_bodies, memory};
use crate::{Load, Problem, Scene};

/// Vertices constrained by a pin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PinnedVertices {
    /// Name of the pin, such as `beam/left`.
    pub name: String,
    /// Vertices, numbered as in recordings, ascending.
    pub vertices: Vec<u32>,
}

/// Vertices and faces on which a load acts.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedVertices {
    /// Name of the load, such as ``traction 0 on `beam` ``.
    pub name: String,
    /// The load.
    pub load: Load,
    /// Single vertices, or the corners of faces, oriented outwards as in
    /// [`vector_area`](pliant::element::vector_area); numbered as in recordings.
    pub on: Vec<Vec<u32>>,
}

/// Ties of one attachment of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct TiedPoints {
    /// The ties, their vertices numbered as in recordings.
    pub ties: Vec<Tie>,
    /// Spring constant of each tie [N/m].
    pub stiffness: f64,
    /// Rest length of each tie [m].
    pub rest_length: f64,
    /// Damping constant of the dashpot of each tie [N s/m].
    pub dashpot: f64,
}

/// Pins and loads of a scene, and the number of vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenePlaces {
    /// Pins, body after body.
    pub pins: Vec<PinnedVertices>,
    /// Loads, body after body.
    pub loads: Vec<LoadedVertices>,
    /// Number of vertices of all bodies.
    pub vertex_count: usize,
}

impl Scene {
    /// Finds the vertices of all pins and loads; builds meshes, but no terms and no matrices.
    ///
    /// # Errors
    /// Every problem with a mesh, a selection or a mass.
    pub fn places(&self) -> Result<ScenePlaces, Vec<Problem>> {
        memory::check(self)?;
        let bodies = build_bodies(&self.with_obstacles(), &self.directory)?;
        let (mut pins, mut loads) = (vec![], vec![]);
        for body in bodies.iter().filter(|body| !body.is_obstacle) {
            for pin in &body.held {
                let name = format!("{}/{}", body.name, pin.name);
                let vertices = pin.vertices.iter().map(|vertex| body.first_vertex + vertex).collect();
                pins.push(PinnedVertices { name, vertices });
            }
            loads.extend(body.loads.iter().map(|load| LoadedVertices {
                name: load.name.clone(),
                load: load.spec().clone(),
                on: load.places(body.first_vertex),
            }));
        }
        Ok(ScenePlaces { pins, loads, vertex_count: bodies.iter().map(|body| body.mass.len()).sum() })
    }

    /// Finds the ties of all attachments, one after the other; builds meshes, but no terms.
    ///
    /// # Errors
    /// Every problem with a mesh, a selection, a mass or an attachment.
    pub fn ties(&self) -> Result<Vec<TiedPoints>, Vec<Problem>> {
        memory::check(self)?;
        let scene = self.with_obstacles();
        let bodies = build_bodies(&scene, &self.directory)?;
        let start: Vec<f64> = bodies.iter().flat_map(|body| body.position.iter().copied()).collect();
        let plans = attachments::attachments(&scene, &bodies, &Numbering::identity(), &start)?;
        Ok(plans.into_iter().map(AttachmentPlan::into_points).collect())
    }
}
