//! Derivatives of contact by the reference configuration: by the areas of primitives, and by the edge
//! lengths that enter the mollifier.
//!
//! The weight of a contact is a sum of area fractions, `w = sum_s f_s A_s`, and its energy and friction
//! are proportional to it. With the forces `g` of the contact at the weight 1,
//!
//! ```text
//! d(w g) = g sum_s f_s dA_s + w dg/d eps d eps,   eps = 1e-3 |A|^2 |B|^2 of the mollifier of edges at rest
//! ```
//!
//! Equal pairs are merged elsewhere by adding their weights; here each is differentiated by itself.

use crate::closest::InnerPair;
use crate::contacts::{Contacts, PlaneContact, rows};
use crate::energy::EvaluatedContacts;
use crate::merge::{AreaOf, AreaPart, MollifiedPair, PairSink};
use crate::model::ContactModel;
use crate::mollifier::{mollified_by_limit, mollifier_by_limit, parallel_limit, squared_cross};
use crate::report::ContactReport;
use crate::surface::{ContactSurface, VertexKind};
use crate::vector::{cross, difference, dot};

/// One value for each area of a surface and for each squared edge length.
pub(crate) struct AreaRates {
    vertices: Vec<f64>,
    edges: Vec<f64>,
    triangles: Vec<f64>,
    /// Values for the squared lengths, which the mollifier depends on.
    squared_lengths: Vec<f64>,
}

impl AreaRates {
    pub(crate) fn zero(surface: &ContactSurface) -> Self {
        AreaRates {
            vertices: vec![0.0; surface.vertex_areas.len()],
            edges: vec![0.0; surface.edges.len()],
            triangles: vec![0.0; surface.triangles.len()],
            squared_lengths: vec![0.0; surface.edges.len()],
        }
    }

    pub(crate) fn of(&mut self, area: AreaOf) -> &mut f64 {
        match area {
            AreaOf::Vertex(v) => &mut self.vertices[v as usize],
            AreaOf::Edge(e) => &mut self.edges[e as usize],
            AreaOf::Triangle(t) => &mut self.triangles[t as usize],
        }
    }
}

/// Reference positions of a primitive's vertices in 3D; third component 0 in 2D.
pub(crate) fn corners<const N: usize>(dimension: usize, rest: &[f64], vertices: &[u32; N]) -> [[f64; 3]; N] {
    let mut corners = [[0.0; 3]; N];
    for (corner, v) in corners.iter_mut().zip(vertices) {
        corner[..dimension].copy_from_slice(&rest[*v as usize * dimension..][..dimension]);
    }
    corners
}

/// Derivatives of the area of a triangle by its corners: `n x e / 2` of the edge `e` opposite to each.
pub(crate) fn area_slopes(corners: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let normal = cross(&difference(&corners[1], &corners[0]), &difference(&corners[2], &corners[0]));
    let half = 0.5 / dot(&normal, &normal).sqrt();
    [0, 1, 2].map(|k| {
        let across = difference(&corners[(k + 2) % 3], &corners[(k + 1) % 3]);
        cross(&normal, &across).map(|slope| half * slope)
    })
}

impl ContactSurface {
    /// Derivative of the area of edge `e` by its length: its width, see [`thicken`](Self::thicken).
    pub(crate) fn width(&self, e: u32) -> f64 {
        self.edge_areas[e as usize] / self.squared_lengths[e as usize].sqrt()
    }

    /// Ends of an edge without triangles that take a share of its area.
    fn ends(&self, e: u32) -> impl Iterator<Item = u32> + '_ {
        let part = move |v: &u32| self.dimension == 2 || self.kinds[*v as usize] == VertexKind::Wire;
        self.edges[e as usize].into_iter().filter(part)
    }

    /// Chain rule: adds to `rows`, flat by vertices, the derivatives by reference positions `rest`, flat
    /// [m], from those by areas and squared lengths.
    pub(crate) fn add_by_rest(&self, by: &AreaRates, rest: &[f64], rows: &mut [f64]) {
        let d = self.dimension;
        let mut add = |v: u32, factor: f64, slope: &[f64; 3]| {
            let row = rows[v as usize * d..][..d].iter_mut();
            row.zip(slope).for_each(|(row, slope)| *row += factor * slope);
        };
        for (t, triangle) in self.triangles.iter().enumerate() {
            let corners_of = triangle.iter().zip(&self.corner_parts[t]);
            let of_corners: f64 = corners_of.map(|(v, part)| by.vertices[*v as usize] / part).sum();
            let of_edges: f64 = self.triangle_edges[t].iter().map(|e| by.edges[*e as usize]).sum();
            let factor = by.triangles[t] + of_corners + of_edges / 3.0;
            let slopes = area_slopes(&corners(d, rest, triangle));
            triangle.iter().zip(&slopes).for_each(|(v, slope)| add(*v, factor, slope));
        }
        let mut by_squared = by.squared_lengths.clone();
        for e in self.lone_edges() {
            let of_ends: f64 = self.ends(e).map(|v| 0.5 * by.vertices[v as usize]).sum();
            let length = self.squared_lengths[e as usize].sqrt();
            by_squared[e as usize] += 0.5 * self.width(e) / length * (by.edges[e as usize] + of_ends);
        }
        for (edge, by) in self.edges.iter().zip(by_squared) {
            let [a, b] = corners(d, rest, edge);
            let along = difference(&a, &b);
            add(edge[0], 2.0 * by, &along);
            add(edge[1], -2.0 * by, &along);
        }
    }

    /// Changes of areas and squared lengths if the reference positions `rest` move by `change`, both flat
    /// [m]: the transpose of [`add_by_rest`](Self::add_by_rest).
    pub(crate) fn area_changes(&self, change: &[f64], rest: &[f64]) -> AreaRates {
        let (d, mut changes) = (self.dimension, AreaRates::zero(self));
        for (e, edge) in self.edges.iter().enumerate() {
            let [a, b] = corners(d, rest, edge);
            let [da, db] = corners(d, change, edge);
            changes.squared_lengths[e] = 2.0 * dot(&difference(&a, &b), &difference(&da, &db));
        }
        for (t, triangle) in self.triangles.iter().enumerate() {
            let moved = corners(d, change, triangle);
            let slopes = area_slopes(&corners(d, rest, triangle));
            let grown: f64 = slopes.iter().zip(&moved).map(|(slope, moved)| dot(slope, moved)).sum();
            changes.triangles[t] = grown;
            for (v, part) in triangle.iter().zip(&self.corner_parts[t]) {
                changes.vertices[*v as usize] += grown / part;
            }
            self.triangle_edges[t].iter().for_each(|e| changes.edges[*e as usize] += grown / 3.0);
        }
        for e in self.lone_edges() {
            let length = self.squared_lengths[e as usize].sqrt();
            let grown = 0.5 * self.width(e) / length * changes.squared_lengths[e as usize];
            changes.edges[e as usize] = grown;
            self.ends(e).for_each(|v| changes.vertices[v as usize] += 0.5 * grown);
        }
        changes
    }
}

/// Kind of contact force.
#[derive(Clone, Copy)]
pub(crate) enum ForceOfContact<'a> {
    /// Contact force `dE/dx`.
    Energy,
    /// Friction `dR/dv` at these velocities, flat [m/s], with the contacts at these positions.
    Friction(&'a [f64], &'a Contacts),
}

/// Forces on the vertices of one contact.
#[derive(Clone, Copy)]
pub(crate) struct ForcesOnVertices<const D: usize> {
    count: usize,
    vertices: [u32; 4],
    forces: [[f64; D]; 4],
}

impl<const D: usize> ForcesOnVertices<D> {
    /// Work of the forces along `p`, flat.
    fn work(&self, p: &[f64]) -> f64 {
        let along = rows::<D, 4>(p, &self.vertices);
        let own = self.forces.iter().zip(&along).take(self.count);
        own.map(|(force, p)| dot(force, p)).sum()
    }

    /// Adds a multiple of the forces to `rows`, flat.
    fn add(&self, factor: f64, rows: &mut [f64]) {
        for (v, force) in self.vertices.iter().zip(&self.forces).take(self.count) {
            let row = rows[*v as usize * D..][..D].iter_mut();
            row.zip(force).for_each(|(row, force)| *row += factor * force);
        }
    }

    fn scaled(mut self, factor: f64) -> Self {
        self.forces.iter_mut().flatten().for_each(|force| *force *= factor);
        self
    }
}

/// One contact in terms of the reference configuration.
pub(crate) struct ShapedPair<'a, const D: usize> {
    parts: &'a [AreaPart],
    /// Forces at the weight 1 m^2 [N/m^2].
    forces: ForcesOnVertices<D>,
    /// For nearly parallel edges, their indices and the derivative of the forces by `eps` [N/m^4].
    parallel: Option<([u32; 2], ForcesOnVertices<D>)>,
}

impl<const D: usize> ShapedPair<'_, D> {
    /// Adds the derivatives of the work along `p` by areas and squared lengths.
    pub(crate) fn add_work(&self, surface: &ContactSurface, p: &[f64], by: &mut AreaRates) {
        let work = self.forces.work(p);
        self.parts.iter().for_each(|part| *by.of(part.of) += part.part * work);
        if let Some(([a, b], forces)) = &self.parallel {
            let by_limit = forces.work(p);
            let [of_a, of_b] = limit_slopes(surface, [*a, *b]);
            by.squared_lengths[*a as usize] += by_limit * of_a;
            by.squared_lengths[*b as usize] += by_limit * of_b;
        }
    }

    /// Adds the change of the forces due to that of areas and squared lengths.
    pub(crate) fn add_change(&self, surface: &ContactSurface, changes: &mut AreaRates, rows: &mut [f64]) {
        let grown: f64 = self.parts.iter().map(|part| part.part * *changes.of(part.of)).sum();
        self.forces.add(grown, rows);
        if let Some(([a, b], forces)) = &self.parallel {
            let [of_a, of_b] = limit_slopes(surface, [*a, *b]);
            let [da, db] = [a, b].map(|e| changes.squared_lengths[*e as usize]);
            forces.add(of_a * da + of_b * db, rows);
        }
    }
}

/// Derivatives of `eps` of two edges by their squared lengths [m^2].
fn limit_slopes(surface: &ContactSurface, [a, b]: [u32; 2]) -> [f64; 2] {
    let [of_a, of_b] = [a, b].map(|e| surface.squared_lengths[e as usize]);
    [parallel_limit(1.0, of_b), parallel_limit(of_a, 1.0)]
}

/// Sink that visits every contact at `x`, flat [m], by itself.
pub(crate) struct ShapeSink<'a, const D: usize> {
    pub(crate) model: &'a ContactModel,
    pub(crate) x: &'a [f64],
    pub(crate) of: ForceOfContact<'a>,
    /// Buffer for one contact.
    pub(crate) one: Contacts,
    pub(crate) visit: &'a mut dyn FnMut(&ShapedPair<'_, D>),
}

impl<const D: usize> ShapeSink<'_, D> {
    /// Forces of the one contact; `None` if it has none, or no friction.
    fn forces(&self) -> Option<ForcesOnVertices<D>> {
        match self.of {
            ForceOfContact::Energy => {
                let mut found = EvaluatedContacts::<D> { with_gradient: true, terms: vec![] };
                self.one.visit_packs::<D>(self.model, self.x, 0..1, &mut found);
                let (vertices, forces) = found.terms.first()?.gradient();
                Some(ForcesOnVertices { count: vertices.len(), vertices: filled(vertices), forces })
            }
            ForceOfContact::Friction(v, _) => {
                let report = ContactReport::<D>::of(&self.one, self.model, self.x, 0);
                let pair = report.rubbing(self.model.threshold_speed)?;
                let forces = pair.gradient(&rows::<D, 4>(v, &report.vertices));
                Some(ForcesOnVertices { count: report.count, vertices: report.vertices, forces })
            }
        }
    }

    fn show(&mut self, parts: &[AreaPart], parallel: Option<([u32; 2], ForcesOnVertices<D>)>) {
        if let Some(forces) = self.forces() {
            (self.visit)(&ShapedPair { parts, forces, parallel });
        }
    }

    /// True if the merged contact has friction: tensile ones do not.
    fn rubs(&self) -> bool {
        match self.of {
            ForceOfContact::Energy => true,
            ForceOfContact::Friction(_, all) => all.stencils.has_like(&self.one.stencils),
        }
    }

    /// Visits the vertices at half-spaces.
    pub(crate) fn planes(&mut self, planes: &[PlaneContact]) {
        self.one.clear();
        for plane in planes {
            self.one.planes.clear();
            self.one.planes.push(PlaneContact { weight: 1.0, ..*plane });
            self.show(&[AreaPart::of_vertex(plane.vertices[0], 1.0)], None);
        }
        self.one.planes.clear();
    }

    /// Derivative of the forces of the one pair of nearly parallel edges by `eps`.
    fn by_limit(&mut self, pair: &MollifiedPair) -> Option<ForcesOnVertices<D>> {
        let x = corners(D, self.x, &pair.vertices);
        match self.of {
            ForceOfContact::Energy => {
                let law = self.model.law(pair.vertices[0], pair.vertices[3]);
                let found = mollified_by_limit(&x, pair, &law.barrier);
                let mut forces = [[0.0; D]; 4];
                forces.iter_mut().zip(&found).for_each(|(force, row)| force.copy_from_slice(&row[..D]));
                Some(ForcesOnVertices { count: 4, vertices: pair.vertices, forces })
            }
            ForceOfContact::Friction(..) => {
                // Friction is proportional to the mollifier, so evaluate it without.
                self.one.stencils.mollified[0].limit = 0.0;
                let [by_limit, _] = mollifier_by_limit(squared_cross(&x), pair.limit);
                Some(self.forces()?.scaled(pair.weight * by_limit))
            }
        }
    }
}

/// Pads to four vertices with the first.
fn filled(vertices: &[u32]) -> [u32; 4] {
    std::array::from_fn(|i| vertices.get(i).or(vertices.first()).copied().unwrap_or_default())
}

impl<const D: usize> PairSink for ShapeSink<'_, D> {
    fn pair(&mut self, vertices: &[u32; 4], inner: &InnerPair, parts: &[AreaPart]) {
        self.one.clear();
        self.one.stencils.push(vertices, inner, 1.0);
        if self.rubs() {
            self.show(parts, None);
        }
    }

    fn parallel(&mut self, edges: [u32; 2], inner: &InnerPair, parts: &[AreaPart]) {
        let weight = self.model.surface.weight(parts);
        if matches!(self.of, ForceOfContact::Friction(..)) && weight <= 0.0 {
            return;
        }
        let pair = self.model.surface.parallel_pair(edges, inner, weight);
        self.one.clear();
        self.one.stencils.mollified.push(MollifiedPair { weight: 1.0, ..pair });
        let by_limit = self.by_limit(&pair);
        self.one.stencils.mollified[0].limit = pair.limit;
        self.show(parts, by_limit.map(|forces| (edges, forces)));
    }
}
