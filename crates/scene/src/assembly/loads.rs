//! Assembly of loads: forces on vertices.

use super::body::BodyAssembly;
use crate::Body;
use crate::KeyPath;
use crate::Load;
use crate::OverTime;
use crate::Problem;
use crate::Selection;
use pliant::element::{face_points, vector_area};
use pliant::energy::EnergyTerm;
use pliant::energy::load::{
    DeadLoad, LoadedShape, LoadedVertex, PressureField, Sample, VectorField, VectorSlope, image, nodes, rim,
};
use pliant::numbering::Numbering;
use pliant::quantity::counted;
use pliant_mesh::{Mesh, select};

/// A load with resolved target; vertices are numbered from 0 in the body.
pub(super) struct LoadPlan {
    pub(super) name: String,
    key: &'static str,
    spec: Load,
    on: LoadTarget,
}

/// A reference position [m], and the shares by which global vertices receive a field's value there.
type Shared = ([f64; 3], Vec<(u32, f64)>);

enum LoadTarget {
    Vertices(Vec<u32>),
    Edges(Vec<[u32; 2]>),
    Triangles(Vec<[u32; 3]>),
    Quadrilaterals(Vec<[u32; 4]>),
    QuadraticEdges(Vec<[u32; 3]>),
    QuadraticTriangles(Vec<[u32; 6]>),
    SerendipityQuadrilaterals(Vec<[u32; 8]>),
    QuadraticQuadrilaterals(Vec<[u32; 9]>),
}

/// Resolves the loads on a body with this mesh.
pub(super) fn placed(
    spec: &Body,
    body: &str,
    mesh: &Mesh,
    path: &KeyPath,
    problems: &mut Vec<Problem>,
) -> Vec<LoadPlan> {
    let mut placed = vec![];
    for (i, load) in spec.load.iter().enumerate() {
        let path = path.key("load").index(i);
        let key = load.key();
        match place(load, key, mesh) {
            Ok(on) => placed.push(LoadPlan { name: load.term_name(i, body), key, spec: load.clone(), on }),
            Err(message) => problems.push(Problem::semantic(path, message)),
        }
    }
    placed
}

fn place(load: &Load, key: &str, mesh: &Mesh) -> Result<LoadTarget, String> {
    let selection = load.selections().pop();
    if matches!(key, "traction" | "pressure") {
        let selection = selection.as_ref();
        return match (mesh.dimension, mesh.order()) {
            (3, order) if mesh.block().is_some() => {
                let has_middles = mesh.block().is_some_and(|block| !block.kind.face_nodes().is_empty());
                mesh.select_quadrilaterals(selection).map(|faces| match (order, has_middles) {
                    (1, _) => LoadTarget::Quadrilaterals(faces),
                    (_, false) => LoadTarget::SerendipityQuadrilaterals(mesh.quadratic_faces(&faces)),
                    (_, true) => LoadTarget::QuadraticQuadrilaterals(mesh.quadratic_faces(&faces)),
                })
            }
            (2, 1) => mesh.select_faces(selection).map(LoadTarget::Edges),
            (2, _) => mesh
                .select_faces::<2>(selection)
                .map(|f| LoadTarget::QuadraticEdges(mesh.quadratic_faces(&f))),
            (_, 1) => mesh.select_faces(selection).map(LoadTarget::Triangles),
            _ => mesh
                .select_faces::<3>(selection)
                .map(|f| LoadTarget::QuadraticTriangles(mesh.quadratic_faces(&f))),
        }
        .map_err(|error| error.to_string());
    }
    let all = || Ok((0..mesh.vertex_count() as u32).collect());
    let vertices: Vec<u32> =
        selection.as_ref().map_or_else(all, |s: &Selection| select(mesh, s)).map_err(|e| e.to_string())?;
    if key == "body_force" && mesh.element_dimension() < 2 {
        return Err("`body_force` is by the volume of cells, and this mesh has none".to_owned());
    }
    Ok(LoadTarget::Vertices(vertices))
}

impl LoadPlan {
    /// Description in words.
    pub(super) fn described(&self, held: &[u32]) -> String {
        let changes = if self.changes() { ", changes with time" } else { "" };
        match &self.on {
            LoadTarget::Vertices(vertices) => {
                let vertices = counted(vertices.len() as u64, "vertex", "vertices");
                format!("{}: {vertices}{changes}", self.name)
            }
            LoadTarget::Edges(faces) => self.described_faces::<2, 2>(faces, held) + changes,
            LoadTarget::Triangles(faces) => self.described_faces::<3, 3>(faces, held) + changes,
            LoadTarget::Quadrilaterals(faces) => self.described_faces::<3, 4>(faces, held) + changes,
            LoadTarget::QuadraticEdges(faces) => self.described_faces::<2, 3>(faces, held) + changes,
            LoadTarget::QuadraticTriangles(faces) => self.described_faces::<3, 6>(faces, held) + changes,
            LoadTarget::SerendipityQuadrilaterals(f) => self.described_faces::<3, 8>(f, held) + changes,
            LoadTarget::QuadraticQuadrilaterals(f) => self.described_faces::<3, 9>(f, held) + changes,
        }
    }

    fn described_faces<const D: usize, const N: usize>(&self, faces: &[[u32; N]], held: &[u32]) -> String {
        let kind = match &self.spec.pressure {
            None => "",
            Some(pressure) if pressure.depends_on_place() => ", follows the surface, no potential",
            Some(_) if rim::<D, N>(faces).iter().all(|v| held.binary_search(v).is_ok()) => {
                ", follows the surface, with a potential"
            }
            Some(_) => ", follows the surface, no potential (its rim is free to move)",
        };
        format!("{}: {}{kind}", self.name, counted(faces.len() as u64, "face", "faces"))
    }

    /// Load as specified in the scene.
    pub(super) fn spec(&self) -> &Load {
        &self.spec
    }

    /// Targets of the load: single vertices, or the corners of faces, numbered from `first` on.
    pub(super) fn places(&self, first: u32) -> Vec<Vec<u32>> {
        match &self.on {
            LoadTarget::Vertices(vertices) => vertices.iter().map(|vertex| vec![first + vertex]).collect(),
            LoadTarget::Edges(faces) => corners(faces, 2, first),
            LoadTarget::Triangles(faces) => corners(faces, 3, first),
            LoadTarget::Quadrilaterals(faces) => corners(faces, 4, first),
            LoadTarget::QuadraticEdges(faces) => corners(faces, 2, first),
            LoadTarget::QuadraticTriangles(faces) => corners(faces, 3, first),
            LoadTarget::SerendipityQuadrilaterals(faces) => corners(faces, 4, first),
            LoadTarget::QuadraticQuadrilaterals(faces) => corners(faces, 4, first),
        }
    }

    fn changes(&self) -> bool {
        let formula = |value: &OverTime| value.constant().is_none();
        self.spec.vectors().iter().any(|(_, _, vector)| vector.iter().any(formula))
            || self.spec.pressure.as_ref().is_some_and(formula)
    }

    /// Builds the term on the vertices of the whole system; `rest` holds their reference positions, flat,
    /// and `held` the vertices of the body that never move, ascending.
    pub(super) fn term(
        &self,
        parts: &BodyAssembly,
        held: &[u32],
        rest: &[f64],
        numbering: &Numbering,
    ) -> Box<dyn EnergyTerm> {
        let global = |v: u32| numbering.internal(parts.first_vertex + v);
        match &self.on {
            LoadTarget::Vertices(vertices) => {
                let shares = |v: u32| match self.key {
                    "force" => vec![(v, 1.0 / vertices.len() as f64)],
                    "body_force" => parts.shares[v as usize].clone(),
                    _ => vec![(v, 1.0)],
                };
                let d = parts.mesh.dimension;
                let sample = |v: &u32| {
                    let shares = shares(*v).into_iter().map(|(v, share)| (global(v), share));
                    (global(*v), shares.collect::<Vec<_>>())
                };
                let mut samples: Vec<(u32, Vec<(u32, f64)>)> = vertices.iter().map(sample).collect();
                samples.sort_unstable_by_key(|(v, _)| *v);
                let share = |(v, shares): &(u32, Vec<(u32, f64)>)| LoadedVertex {
                    vertex: *v,
                    point: point(rest, *v, d),
                    share: shares[0].1,
                };
                // The shares of a body force depend on the shape through its volumes, which this shape
                // derivative does not cover.
                let shape = (self.key != "body_force").then(|| {
                    let vertices = if self.differs() { samples.iter().map(share).collect() } else { vec![] };
                    LoadedShape::vertices(d, vertices, self.slope())
                });
                let at = |(v, shares)| (point(rest, v, d), shares);
                let load = self.dead(samples.into_iter().map(at).collect(), rest, d);
                Box::new(match shape {
                    Some(shape) => load.with_shape(shape),
                    None => load,
                })
            }
            LoadTarget::Edges(faces) => self.on_faces::<2, 2>(faces, global, held, rest),
            LoadTarget::Triangles(faces) => self.on_faces::<3, 3>(faces, global, held, rest),
            LoadTarget::Quadrilaterals(faces) => self.on_faces::<3, 4>(faces, global, held, rest),
            LoadTarget::QuadraticEdges(faces) => self.on_faces::<2, 3>(faces, global, held, rest),
            LoadTarget::QuadraticTriangles(faces) => self.on_faces::<3, 6>(faces, global, held, rest),
            LoadTarget::SerendipityQuadrilaterals(f) => self.on_faces::<3, 8>(f, global, held, rest),
            LoadTarget::QuadraticQuadrilaterals(f) => self.on_faces::<3, 9>(f, global, held, rest),
        }
    }

    fn on_faces<const D: usize, const N: usize>(
        &self,
        faces: &[[u32; N]],
        global: impl Fn(u32) -> u32,
        held: &[u32],
        rest: &[f64],
    ) -> Box<dyn EnergyTerm> {
        let global: Vec<[u32; N]> = faces.iter().map(|face| face.map(&global)).collect();
        if let Some(pressure) = self.spec.pressure.clone() {
            let rim_stays = rim::<D, N>(faces).iter().all(|v| held.binary_search(v).is_ok());
            let (changes, varies) = (self.changes(), pressure.depends_on_place());
            let of_slope = pressure.clone();
            let field = Box::new(move |x, t| pressure.value(x, t));
            let slope = Box::new(move |x, t| of_slope.slope(x, t));
            let pressure = PressureField { field, slope, changes, varies };
            let (name, faces) = (self.name.clone(), global.as_flattened());
            return pliant_terms::pressure((D, N), name, faces, rest, rim_stays, pressure);
        }
        let quadrature = face_points::<D, N>();
        let mut samples = vec![];
        for face in &global {
            let at_rest = nodes::<D, N>(rest, *face);
            for q in &quadrature {
                let measure = vector_area(&at_rest, q).iter().map(|c| c * c).sum::<f64>().sqrt();
                let shares = (0..N).map(|i| (face[i], q.weight * q.shape[i] * measure)).collect();
                samples.push((image(&at_rest, q), shares));
            }
        }
        let shape = LoadedShape::faces::<D, N>(&global, rest, self.slope());
        Box::new(self.dead(samples, rest, D).with_shape(shape))
    }

    fn components(&self) -> Vec<OverTime> {
        self.spec.vectors().first().map_or_else(Vec::new, |(_, _, vector)| vector.to_vec())
    }

    /// True if the value depends on position.
    fn differs(&self) -> bool {
        self.components().iter().any(OverTime::depends_on_place)
    }

    /// Derivatives of the components with respect to position.
    fn slope(&self) -> VectorSlope {
        let components = self.components();
        Box::new(move |x, t| {
            let mut slope = [[0.0; 3]; 3];
            slope.iter_mut().zip(&components).for_each(|(slope, component)| *slope = component.slope(x, t));
            slope
        })
    }

    /// Dead load with these points and their shares by global vertex. A uniform load needs one point
    /// only.
    fn dead(&self, mut samples: Vec<Shared>, rest: &[f64], dimension: usize) -> DeadLoad {
        let components = self.components();
        let mut vertices: Vec<u32> =
            samples.iter().flat_map(|(_, shares)| shares.iter().map(|(v, _)| *v)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        if !self.differs() {
            let mut sums = vec![0.0; vertices.len()];
            for (v, share) in samples.iter().flat_map(|(_, shares)| shares) {
                sums[vertices.partition_point(|w| w < v)] += share;
            }
            samples = vec![([0.0; 3], vertices.iter().copied().zip(sums).collect())];
        }
        let slot = |v: u32| vertices.partition_point(|w| *w < v) as u32;
        let samples = samples.into_iter().map(|(point, shares)| Sample {
            point,
            shares: shares.into_iter().map(|(v, share)| (slot(v), share)).collect(),
        });
        let samples = samples.collect();
        let field: VectorField = Box::new(move |x, t| {
            let mut force = [0.0; 3];
            for (force, component) in force.iter_mut().zip(&components) {
                *force = component.value(x, t);
            }
            force
        });
        DeadLoad::new(self.name.clone(), dimension, vertices, rest, samples, field, self.changes())
    }
}

/// First `count` nodes of each face, numbered from `first` on.
fn corners<const N: usize>(faces: &[[u32; N]], count: usize, first: u32) -> Vec<Vec<u32>> {
    faces.iter().map(|face| face.iter().take(count).map(|vertex| first + vertex).collect()).collect()
}

fn point(rest: &[f64], vertex: u32, dimension: usize) -> [f64; 3] {
    let mut point = [0.0; 3];
    point[..dimension].copy_from_slice(&rest[vertex as usize * dimension..][..dimension]);
    point
}
