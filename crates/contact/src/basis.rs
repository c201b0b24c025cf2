//! Origins of the laws of a model: what of its bodies decides on them, and their derivatives by that.

use pliant::algebra::scene_size;
use pliant::energy::{LawInput, LawLinks, LawNumber};

use crate::explicit::SurfaceMobility;
use crate::model::ContactModel;
use crate::shape::{area_slopes, corners};
use crate::start::least_slopes;
use crate::surface::{ContactSurface, VertexKind};
use crate::vector::{difference, dot};

/// Part of a number by which others may differ from it and still count as alike.
pub const ALIKE: f64 = 1e-9;

/// Origin of the distance from which on surfaces push.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ReachBasis {
    /// It is given.
    #[default]
    Given,
    /// A part of the size of these bodies, the smallest, which are alike.
    Bodies(Vec<u32>),
    /// A part of the length of these edges of the surface, the shortest, which are alike.
    Edges(Vec<u32>),
}

/// Origin of the stiffness of contact of two bodies.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum StiffnessBasis {
    /// It is given, or nothing moves.
    #[default]
    Given,
    /// Young's modulus of a body, and of another where the two are alike.
    Modulus(u32, Option<u32>),
    /// In proportion to the distance and to the mass over area of these vertices, the most, which are alike.
    Masses(Vec<u32>),
    /// In proportion to the reach over the [mobility](SurfaceMobility::of_pair): what explicit steps bear.
    ExplicitStep,
}

/// Contact of a body with itself whose reach and radii are in proportion to its least distance from itself at
/// rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortenedContact {
    /// The body.
    pub body: u32,
    /// Least distance from itself at rest [m].
    pub least: f64,
}

/// Origins of the laws of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LawBasis {
    /// Distance from which on surfaces push that nothing shortens [m].
    pub distance: f64,
    /// Origin of it.
    pub reach: ReachBasis,
    /// Origins of stiffnesses, of the bodies `a <= b` at `a * bodies + b`; given where there is none.
    pub stiffness: Vec<StiffnessBasis>,
    /// Bodies that touch themselves from nearer on than others, because they are near themselves at rest.
    pub shortened: Vec<ShortenedContact>,
    /// Bodies to whose common size the threshold speed is in proportion; none where it is given.
    pub sized: Vec<u32>,
}

/// Derivatives of a number by what it is made of.
type Slopes = Vec<(LawInput, f64)>;

/// Adds the multiple of derivatives of another number.
fn add(to: &mut Slopes, factor: f64, of: &[(LawInput, f64)]) {
    to.extend(of.iter().map(|(input, slope)| (*input, factor * slope)));
}

/// Size of these vertices at rest, [`scene_size`], and its derivatives by coordinates: of the diagonal of
/// their bounding box, each side held by all the vertices in it alike, or of the largest coordinate of a
/// point.
fn size_slopes(vertices: &[u32], rest: &[f64], d: usize) -> (f64, Vec<(usize, f64)>) {
    let mut sides = vec![];
    for axis in 0..d {
        let at = |vertex: &u32| rest[*vertex as usize * d + axis];
        let low = vertices.iter().map(at).fold(f64::INFINITY, f64::min);
        let high = vertices.iter().map(at).fold(f64::NEG_INFINITY, f64::max);
        for (end, sign) in [(low, -1.0), (high, 1.0)] {
            let near = |vertex: &&u32| (at(vertex) - end).abs() <= ALIKE * (high - low);
            let coordinate = |vertex: &u32| *vertex as usize * d + axis;
            let holding: Vec<usize> = vertices.iter().filter(near).map(coordinate).collect();
            sides.push((high - low, sign, holding));
        }
    }
    // Each axis has two ends.
    let diagonal = (0.5 * sides.iter().map(|(side, ..)| side * side).sum::<f64>()).sqrt();
    let coordinates = || vertices.iter().flat_map(|v| (0..d).map(move |axis| *v as usize * d + axis));
    let size = scene_size(&coordinates().map(|i| rest[i]).collect::<Vec<_>>(), d);
    if diagonal < 0.5 * size {
        // One point, at the origin without any coordinate that decides.
        let holding: Vec<usize> = coordinates().filter(|i| rest[*i].abs() >= (1.0 - ALIKE) * size).collect();
        let part = 1.0 / holding.len() as f64;
        return (size, holding.into_iter().map(|i| (i, part.copysign(rest[i]))).collect());
    }
    let slopes = sides.into_iter().flat_map(|(side, sign, holding)| {
        let slope = sign * side / size / holding.len() as f64;
        holding.into_iter().map(move |i| (i, slope))
    });
    (size, slopes.collect())
}

impl ContactSurface {
    /// Derivatives of the length of edge `e` by coordinates at rest.
    fn length_slopes(&self, e: u32, rest: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        let ([a, b], d) = (self.edges[e as usize], self.dimension);
        let [at_a, at_b] = corners(d, rest, &[a, b]);
        let along = difference(&at_b, &at_a);
        let length = dot(&along, &along).sqrt();
        let of_end =
            move |(v, sign): (u32, f64)| (0..d).map(move |k| (v as usize * d + k, sign * along[k] / length));
        [(a, -1.0), (b, 1.0)].into_iter().flat_map(of_end)
    }

    /// Derivatives of the area of vertex `v` at `rest`, flat [m].
    fn vertex_area_slopes(&self, v: u32, rest: &[f64]) -> Slopes {
        let (d, kind) = (self.dimension, self.kinds[v as usize]);
        let mut slopes = vec![];
        if kind == VertexKind::Particle {
            return vec![(LawInput::Distance, self.area_by_width(v))];
        }
        for t in self.triangles_at(v) {
            let triangle = &self.triangles[*t as usize];
            let of_corners = area_slopes(&corners(d, rest, triangle));
            for (corner, slope) in triangle.iter().zip(of_corners) {
                let rows = (0..d).map(|k| (LawInput::Rest(*corner as usize * d + k), slope[k] / 3.0));
                slopes.extend(rows);
            }
        }
        for e in
            self.vertex_edges.of(v).iter().filter(|e| d == 2 || kind == VertexKind::Wire && self.is_wire(**e))
        {
            let half = 0.5 * self.width(*e);
            slopes.extend(self.length_slopes(*e, rest).map(|(i, slope)| (LawInput::Rest(i), half * slope)));
            if d == 3 {
                slopes.push((LawInput::Distance, 0.5 * self.squared_lengths[*e as usize].sqrt()));
            }
        }
        slopes
    }

    /// Triangles at a vertex; none in the plane.
    fn triangles_at(&self, v: u32) -> &[u32] {
        if self.triangles.is_empty() { &[] } else { self.vertex_triangles.of(v) }
    }
}

/// Making of links of one model.
struct LinkMaker<'a> {
    model: &'a ContactModel,
    rest: &'a [f64],
    masses: &'a [f64],
    mobility: SurfaceMobility,
    /// Vertices of the surface of each body.
    vertices: Vec<Vec<u32>>,
}

impl LinkMaker<'_> {
    /// Adds `factor` times the derivatives of the logarithm of the most mobile vertex of `a` against `b`, of
    /// several that are alike the mean: of area over mass, its area no larger than that of `b`.
    fn add_mobility(&self, a: u32, b: u32, factor: f64, to: &mut Slopes) {
        let (surface, most) = (&self.model.surface, self.mobility.area(b));
        let area = |v: u32| surface.vertex_areas[v as usize];
        let mobile = |v: &u32| {
            let mass = self.masses[*v as usize];
            let mobility = if mass > 0.0 { area(*v).min(most) / mass } else { 0.0 };
            (mobility > 0.0).then_some((*v, mobility))
        };
        let all: Vec<(u32, f64)> = self.vertices[a as usize].iter().filter_map(mobile).collect();
        let largest = all.iter().map(|(_, mobility)| *mobility).fold(0.0, f64::max);
        let alike: Vec<u32> =
            all.into_iter().filter(|(_, m)| *m >= (1.0 - ALIKE) * largest).map(|(v, _)| v).collect();
        let part = factor / alike.len() as f64;
        for v in alike {
            to.push((LawInput::Mass(v), -part / self.masses[v as usize]));
            if area(v) <= most {
                add(to, part / area(v), &surface.vertex_area_slopes(v, self.rest));
            } else {
                for other in &self.vertices[b as usize] {
                    add(to, part / most, &surface.vertex_area_slopes(*other, self.rest));
                }
            }
        }
    }

    /// Derivatives of `dhat` and of `xi` of a body with itself whose law is shortened.
    fn shortened<const D: usize>(&self, of: &ShortenedContact) -> [Slopes; 2] {
        let (model, distance) = (self.model, self.model.basis.distance);
        let barrier = &model.laws.of(of.body, of.body).barrier;
        let by_least = least_slopes::<D>(model, self.rest, of.body, of.least);
        // dhat = L r / (2 (r + o)), xi = L o / (2 (r + o)), their ratio that of r and o.
        let offset = barrier.offset * distance / barrier.reach;
        let by_distance = barrier.reach / distance * offset / (distance + offset);
        [(barrier.reach, by_distance), (barrier.offset, -by_distance)].map(|(length, by_distance)| {
            let rest = by_least.iter().map(|(i, slope)| (LawInput::Rest(*i), length / of.least * slope));
            rest.chain([(LawInput::Distance, by_distance)]).collect()
        })
    }

    /// Derivatives of `kappa` of two bodies, whose reach has the derivatives `reach`.
    fn stiffness(&self, (a, b): (u32, u32), basis: &StiffnessBasis, reach: &Slopes) -> Slopes {
        let (model, mut slopes) = (self.model, vec![]);
        let barrier = &model.laws.of(a, b).barrier;
        match basis {
            StiffnessBasis::Given => {}
            StiffnessBasis::Modulus(body, alike) => {
                let part = if alike.is_some() { 0.5 } else { 1.0 };
                slopes.extend(Some(*body).into_iter().chain(*alike).map(|i| (LawInput::Modulus(i), part)));
            }
            StiffnessBasis::Masses(vertices) => {
                let part = barrier.stiffness / vertices.len() as f64;
                slopes.push((LawInput::Distance, barrier.stiffness / model.basis.distance));
                for v in vertices {
                    slopes.push((LawInput::Mass(*v), part / self.masses[*v as usize]));
                    let area = model.surface.vertex_areas[*v as usize];
                    add(&mut slopes, -part / area, &model.surface.vertex_area_slopes(*v, self.rest));
                }
            }
            StiffnessBasis::ExplicitStep => {
                add(&mut slopes, barrier.stiffness / barrier.reach, reach);
                let sides = self.mobility.of_sides(a, b);
                let whole = sides[0] + sides[1];
                for ((a, b), side) in [(a, b), (b, a)].into_iter().zip(sides).filter(|(_, side)| *side > 0.0)
                {
                    self.add_mobility(a, b, -barrier.stiffness * side / whole, &mut slopes);
                }
            }
        }
        slopes
    }
}

impl ContactModel {
    /// Derivatives of its laws by what they are made of, at the rest positions `rest`, flat [m], and `masses`
    /// of all vertices [kg].
    pub(crate) fn law_links<const D: usize>(&self, rest: &[f64], masses: &[f64]) -> LawLinks {
        let (bodies, basis, surface) = (self.names.len(), &self.basis, &self.surface);
        let inverse = |v: u32| if masses[v as usize] > 0.0 { 1.0 / masses[v as usize] } else { 0.0 };
        let mut vertices = vec![vec![]; bodies];
        surface.vertices.iter().for_each(|v| vertices[self.body(*v) as usize].push(*v));
        let mobility = SurfaceMobility::new(surface, bodies, inverse);
        let maker = LinkMaker { model: self, rest, masses, mobility, vertices };
        let mut links = LawLinks { distance: self.distance_slopes::<D>(rest), ..LawLinks::default() };
        let is_given = links.distance.is_empty();
        for (a, b) in (0..bodies as u32).flat_map(|a| (a..bodies as u32).map(move |b| (a, b))) {
            if !self.touch(a, b) {
                continue;
            }
            let pair = a as usize * bodies + b as usize;
            let shortened = basis.shortened.iter().find(|one| a == b && one.body == a);
            let [reach, offset] = match shortened {
                Some(shortened) => maker.shortened::<D>(shortened),
                None => [vec![(LawInput::Distance, 1.0)], vec![]],
            };
            let given = StiffnessBasis::Given;
            let stiffness = maker.stiffness((a, b), basis.stiffness.get(pair).unwrap_or(&given), &reach);
            for (number, slopes) in
                [(LawNumber::Stiffness, stiffness), (LawNumber::Reach, reach), (LawNumber::Offset, offset)]
            {
                let some = slopes.into_iter().filter(|(input, _)| !is_given || *input != LawInput::Distance);
                links.pairs.extend(some.map(|(input, slope)| (pair, number, input, slope)));
            }
        }
        if !basis.sized.is_empty() && self.laws.has_friction() {
            let (size, slopes) = size_slopes(&self.vertices_of(&basis.sized), rest, D);
            let speed = self.threshold_speed / size;
            links.threshold_speed = slopes.into_iter().map(|(i, slope)| (i, speed * slope)).collect();
        }
        links
    }

    /// Derivatives of the distance from which on surfaces push; none where it is given.
    fn distance_slopes<const D: usize>(&self, rest: &[f64]) -> Vec<(usize, f64)> {
        let distance = self.basis.distance;
        let mut slopes = vec![];
        match &self.basis.reach {
            ReachBasis::Given => {}
            ReachBasis::Bodies(bodies) => {
                for body in bodies {
                    let (size, of_body) = size_slopes(&self.vertices_of(&[*body]), rest, D);
                    let part = distance / size / bodies.len() as f64;
                    slopes.extend(of_body.into_iter().map(|(i, slope)| (i, part * slope)));
                }
            }
            ReachBasis::Edges(edges) => {
                for e in edges {
                    let length = self.surface.squared_lengths[*e as usize].sqrt();
                    let part = distance / length / edges.len() as f64;
                    slopes.extend(self.surface.length_slopes(*e, rest).map(|(i, slope)| (i, part * slope)));
                }
            }
        }
        slopes
    }

    /// All vertices of these bodies, those inside included.
    fn vertices_of(&self, bodies: &[u32]) -> Vec<u32> {
        let all = (0..).zip(&self.surface.bodies);
        all.filter(|(_, body)| bodies.contains(body)).map(|(v, _)| v).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes of a cloud, of one point, of two at one place and of one at the origin.
    #[test]
    fn sizes_have_the_derivatives_of_differences() {
        let rest = [0.3, -0.1, 0.2, 0.5, 0.4, -0.7, 0.1, -0.9, 0.6, 0.1, -0.9, 0.6, 0.0, 0.0, 0.0];
        let cases: [(&[u32], &[u32], usize); 4] =
            [(&[0, 1, 2], &[0], 6), (&[1], &[1], 1), (&[2, 3], &[2, 3], 2), (&[4], &[], 0)];
        for (vertices, moving, count) in cases {
            let size = |rest: &[f64]| {
                let points = vertices.iter().flat_map(|v| &rest[*v as usize * 3..][..3]);
                scene_size(&points.copied().collect::<Vec<_>>(), 3)
            };
            let (found, slopes) = size_slopes(vertices, &rest, 3);
            assert!((found - size(&rest)).abs() < 1e-15 && slopes.len() == count, "{vertices:?}: {slopes:?}");
            for axis in 0..3 {
                let place = |v: &u32| *v as usize * 3 + axis;
                let moved = |h: f64| {
                    let mut moved = rest;
                    moving.iter().for_each(|v| moved[place(v)] += h);
                    size(&moved)
                };
                let own = |i: &usize| moving.iter().any(|v| place(v) == *i);
                let by: f64 = slopes.iter().filter(|(i, _)| own(i)).map(|(_, slope)| slope).sum();
                let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                assert!((by - difference).abs() < 1e-9, "{vertices:?}, {axis}: {by}, {difference}");
            }
        }
    }
}
