//! Pressure, a follower load: it stays normal to the surface.

mod matrix;

use std::ops::Range;

use super::add_rows;
use crate::element::{FacePoint, area_rate, face_corners, face_edges, face_middle, face_points, vector_area};
use crate::energy::{
    Driven, EnergyKind, EnergyTerm, Fault, LoadTerm, Measurements, Stencils, TermProperties, TermViews,
};
use crate::material::Psd;

/// Derivatives of a scalar field with respect to the coordinates of the reference position `X` [m], at the
/// time `t` [s].
pub type ScalarSlope = Box<dyn Fn([f64; 3], f64) -> [f64; 3] + Send + Sync>;

/// A pressure that may depend on time and position.
pub struct PressureField {
    /// Pressure [Pa] as a function of the reference position `X` [m] and the time `t` [s].
    pub field: Box<dyn Fn([f64; 3], f64) -> f64 + Send + Sync>,
    /// Derivatives with respect to the coordinates of `X` [Pa/m].
    pub slope: ScalarSlope,
    /// True if the pressure depends on time.
    pub changes: bool,
    /// True if the pressure depends on position.
    pub varies: bool,
}

/// Pressure on faces, against their current outward normals. A face gives its node `i` the force
/// `-sum_q P_qi a_q(x)`, with its current vector area `a_q` at point `q`. A linear edge or triangle has
/// one point, and `P_i` is the integral of `p N_i` over the reference face by its measure (uniform:
/// `p / D`). Any other face has the points of its quadrature and `P_qi = w_q p_q N_i`, which is exact for
/// uniform pressure on curved faces too. The net force on a closed surface is zero, and so is the net
/// moment if the pressure is uniform.
///
/// Uniform pressure on a closed surface, or on one whose rim is fixed, has the potential
/// `p (V(x) - V(X))` with the volume `V` behind the faces. Otherwise there is no potential, and the
/// energy is zero. Products with the Hessian are exact in both cases. Without a potential the Hessian is
/// not symmetric, and the stability limit and the matrices of implicit steps use its symmetric part.
/// Source: Rumpel, Schweizerhof 2003, *Volume-dependent pressure loading and its influence on the
/// stability of structures*, Int. J. Numer. Meth. Eng. 56, 211.
pub struct Pressure<const D: usize, const N: usize> {
    name: String,
    /// Ascending.
    vertices: Vec<u32>,
    /// Indices into `vertices`.
    faces: Vec<[u32; N]>,
    /// Quadrature points of each face in the reference configuration, if the pressure depends on position.
    points: Vec<[f64; 3]>,
    quadrature: Vec<FacePoint<N>>,
    /// Points at which vector areas are evaluated, with weights that add up to that of the face.
    areas: Vec<FacePoint<N>>,
    /// A fixed point, and the reference volume.
    origin: [f64; D],
    rest_volume: f64,
    conservative: bool,
    pressure: PressureField,
    time: f64,
    /// `P_qi` of each face at `time`, one row for each of `areas`; only those of a single face if the
    /// pressure is uniform.
    now: Vec<[f64; N]>,
    /// The pressure at `time` if it is uniform [Pa].
    uniform: f64,
    /// Force of the last evaluation on each of `vertices`, flat [N].
    force: Vec<f64>,
}

impl<const D: usize, const N: usize> Pressure<D, N> {
    /// Creates a pressure on these faces of a system with the flat reference positions `rest` [m];
    /// `rim_stays` is true if the vertices of the [`rim`] do not move, also if there are none.
    pub fn new(
        name: String,
        faces: &[[u32; N]],
        rest: &[f64],
        rim_stays: bool,
        pressure: PressureField,
    ) -> Self {
        // Number the vertices of the faces locally.
        let mut vertices = faces.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let slot = |v: u32| vertices.partition_point(|w| *w < v) as u32;
        let local: Vec<[u32; N]> = faces.iter().map(|face| face.map(slot)).collect();
        // Linear edges and triangles have one vector area, other faces one per quadrature point.
        let quadrature = face_points::<D, N>();
        let areas = if N == D { vec![face_middle::<D, N>()] } else { quadrature.clone() };
        let points = match pressure.varies {
            true => faces
                .iter()
                .flat_map(|face| quadrature.iter().map(|q| image(&nodes::<D, N>(rest, *face), q)))
                .collect(),
            false => vec![],
        };
        let mut term = Pressure {
            name,
            now: vec![[0.0; N]; areas.len() * if pressure.varies { faces.len() } else { 1 }],
            uniform: 0.0,
            force: vec![0.0; D * vertices.len()],
            origin: faces.first().map_or([0.0; D], |face| nodes::<D, N>(rest, *face)[0]),
            vertices,
            faces: local,
            points,
            quadrature,
            areas,
            rest_volume: 0.0,
            conservative: rim_stays && !pressure.varies,
            pressure,
            time: 0.0,
        };
        // The volume needs the areas and the origin of the finished term.
        term.rest_volume = term.volume(rest);
        term.sample(0.0);
        term
    }

    /// Samples the pressure at the time `time` [s].
    fn sample(&mut self, time: f64) {
        let mut now = std::mem::take(&mut self.now);
        let field = &self.pressure.field;
        self.integrate(&|x| field(x, time), &mut now);
        self.uniform = if self.pressure.varies { self.uniform } else { field([0.0; 3], time) };
        self.now = now;
    }

    /// Writes the `P_qi` of a pressure to rows like those of `now`.
    fn integrate(&self, pressure: &dyn Fn([f64; 3]) -> f64, now: &mut [[f64; N]]) {
        let Pressure { quadrature, areas, points, .. } = self;
        if !self.pressure.varies {
            let uniform = pressure([0.0; 3]);
            for (now, FacePoint { weight, shape, .. }) in now.iter_mut().zip(areas) {
                *now = shape.map(|shape| weight * shape * uniform);
            }
            return;
        }
        for (now, points) in now.chunks_exact_mut(areas.len()).zip(points.chunks_exact(quadrature.len())) {
            now.fill([0.0; N]);
            for (q, (point, FacePoint { weight, shape, .. })) in points.iter().zip(quadrature).enumerate() {
                let p = pressure(*point);
                // A single vector area takes all.
                let row = &mut now[q.min(areas.len() - 1)];
                (0..N).for_each(|i| row[i] += weight * shape[i] * p);
            }
        }
    }

    /// Returns the vertices of each face and, for each of its vector areas, the point and its `P_i`.
    fn faces(&self) -> impl Iterator<Item = ([u32; N], impl Iterator<Item = (&FacePoint<N>, &[f64; N])>)> {
        self.faces_of(&self.now)
    }

    /// Iterates like `faces` with the rows `P_qi` of another pressure.
    fn faces_of<'s>(
        &'s self,
        rows: &'s [[f64; N]],
    ) -> impl Iterator<Item = ([u32; N], impl Iterator<Item = (&'s FacePoint<N>, &'s [f64; N])>)> {
        let (uniform, count) = (!self.pressure.varies, self.areas.len());
        self.faces.iter().enumerate().map(move |(i, face)| {
            let now = &rows[if uniform { 0 } else { i * count }..][..count];
            (face.map(|slot| self.vertices[slot as usize]), self.areas.iter().zip(now))
        })
    }

    /// Calls `visit` for each quadrature point `q` of each face, with the face, its vector area at `q` for
    /// nodes at `x`, the point, and the slope of the pressure there. A uniform pressure has no calls.
    fn each_slope(&self, x: &[f64], mut visit: impl FnMut([u32; N], [f64; D], &FacePoint<N>, [f64; 3])) {
        let count = self.quadrature.len();
        for (local, points) in self.faces.iter().zip(self.points.chunks_exact(count)) {
            let face = local.map(|slot| self.vertices[slot as usize]);
            let at = nodes::<D, N>(x, face);
            for (q, (place, point)) in points.iter().zip(&self.quadrature).enumerate() {
                // A single vector area takes all.
                let area = vector_area(&at, &self.areas[q.min(self.areas.len() - 1)]);
                visit(face, area, point, (self.pressure.slope)(*place, self.time));
            }
        }
    }

    #[cfg(test)]
    pub(super) fn volume_at_rest(&self) -> f64 {
        self.rest_volume
    }

    /// Returns the volume behind the faces, as seen from `origin`.
    fn volume(&self, x: &[f64]) -> f64 {
        let mut volume = 0.0;
        for (face, areas) in self.faces() {
            let nodes = nodes::<D, N>(x, face);
            for (point, _) in areas {
                let (at, area) = (image(&nodes, point), vector_area(&nodes, point));
                let cone = (0..D).map(|c| (at[c] - self.origin[c]) * area[c]).sum::<f64>();
                volume += point.weight * cone / D as f64;
            }
        }
        volume
    }

    /// Adds `K p` or `K^T p` times `factor` to `y`.
    fn add_product(&self, x: &[f64], p: &[f64], factor: f64, transposed: bool, y: &mut [f64]) {
        for (face, areas) in self.faces() {
            let (at, direction) = (nodes::<D, N>(x, face), nodes::<D, N>(p, face));
            for (point, pressure) in areas {
                if transposed {
                    let mut sum = [0.0; D];
                    (0..N).for_each(|i| (0..D).for_each(|c| sum[c] += pressure[i] * direction[i][c]));
                    for j in 0..N {
                        let row = area_rate(&at, point, j, sum, true);
                        (0..D).for_each(|c| y[face[j] as usize * D + c] += factor * row[c]);
                    }
                    continue;
                }
                let mut rate = [0.0; D];
                for (j, direction) in direction.iter().enumerate() {
                    let part = area_rate(&at, point, j, *direction, false);
                    (0..D).for_each(|c| rate[c] += part[c]);
                }
                for i in 0..N {
                    (0..D).for_each(|c| y[face[i] as usize * D + c] += factor * pressure[i] * rate[c]);
                }
            }
        }
    }
}

/// Returns the positions of the nodes of a face.
pub fn nodes<const D: usize, const N: usize>(x: &[f64], face: [u32; N]) -> [[f64; D]; N] {
    face.map(|v| {
        let mut node = [0.0; D];
        node.copy_from_slice(&x[v as usize * D..][..D]);
        node
    })
}

/// Returns the position of a point of a face; in 2D the third component is 0.
pub fn image<const D: usize, const N: usize>(nodes: &[[f64; D]; N], point: &FacePoint<N>) -> [f64; 3] {
    let mut image = [0.0; 3];
    for (node, shape) in nodes.iter().zip(&point.shape) {
        (0..D).for_each(|c| image[c] += shape * node[c]);
    }
    image
}

/// Returns the vertices at the rim of these faces, ascending; none if the surface is closed.
pub fn rim<const D: usize, const N: usize>(faces: &[[u32; N]]) -> Vec<u32> {
    // Each side with its middle node.
    let mut sides: Vec<[u32; 3]> = match D {
        // A point where an edge begins meets one where an edge ends.
        2 => faces.iter().flat_map(|face| [[face[0], NONE, NONE], [NONE, face[1], NONE]]).collect(),
        _ => {
            let corners = face_corners::<D, N>();
            let middle = |face: &[u32; N], i: usize| if N == corners { NONE } else { face[corners + i] };
            let side = |face: &[u32; N], i: usize| [face[i], face[(i + 1) % corners], middle(face, i)];
            debug_assert!(face_edges::<D, N>().iter().enumerate().all(|(i, e)| *e == [i, (i + 1) % corners]));
            faces.iter().flat_map(|face| (0..corners).map(|i| side(face, i))).collect()
        }
    };
    sides.sort_unstable();
    let twin = |side: &[u32; 3]| {
        let other = [side[1], side[0], side[2]];
        let count = |wanted: &[u32; 3]| {
            sides.partition_point(|s| s <= wanted) - sides.partition_point(|s| s < wanted)
        };
        count(&other) == count(side)
    };
    let mut rim: Vec<u32> =
        sides.iter().filter(|side| !twin(side)).flatten().copied().filter(|v| *v != NONE).collect();
    rim.sort_unstable();
    rim.dedup();
    rim
}

/// Placeholder for no vertex.
const NONE: u32 = u32::MAX;

impl<const D: usize, const N: usize> EnergyTerm for Pressure<D, N> {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn properties(&self) -> TermProperties {
        TermProperties {
            changes_with_time: self.pressure.changes,
            is_conservative: self.conservative,
            ..TermProperties::of(EnergyKind::Load)
        }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        if !self.conservative {
            return 0.0;
        }
        self.uniform * (self.volume(x) - self.rest_volume)
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let mut force = std::mem::take(&mut self.force);
        force.fill(0.0);
        for (local, (face, areas)) in self.faces.iter().zip(self.faces()) {
            let nodes = nodes::<D, N>(x, face);
            for (point, pressure) in areas {
                let area: [f64; D] = vector_area(&nodes, point);
                for (slot, p) in local.iter().zip(pressure) {
                    (0..D).for_each(|c| force[*slot as usize * D + c] -= p * area[c]);
                }
            }
        }
        self.force = force;
        crate::algebra::all_finite(&self.force)
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        add_rows(&self.vertices, &self.force, -1.0, first, g, D);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        self.add_product(x, p, 1.0, false, y);
    }

    fn add_transposed_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> Option<f64> {
        self.add_product(x, p, 1.0, true, y);
        None
    }

    fn stencils(&mut self) -> Stencils {
        self.face_stencils()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        self.face_hessians(stencils, x, psd, out);
    }

    fn fault(&self, _x: &[f64]) -> Option<Fault> {
        let finite = crate::algebra::all_finite(self.now.as_flattened());
        (!finite).then(|| Fault::Load { load: self.name.clone(), time: self.time })
    }
}

impl<const D: usize, const N: usize> TermViews for Pressure<D, N> {
    fn load(&self) -> Option<&dyn LoadTerm> {
        Some(self)
    }

    fn driven(&mut self) -> Option<&mut dyn Driven> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl<const D: usize, const N: usize> Driven for Pressure<D, N> {
    fn set_time(&mut self, time: f64) {
        if time != self.time {
            self.time = time;
            self.sample(time);
        }
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.work(x, v)
    }
}

impl<const D: usize, const N: usize> Pressure<D, N> {
    /// Adds the force of the pressure with these rows.
    fn add_force_by_rows(&self, rows: &[[f64; N]], x: &[f64], force: &mut [f64]) {
        for (face, areas) in self.faces_of(rows) {
            let at = nodes::<D, N>(x, face);
            for (point, pressure) in areas {
                let area: [f64; D] = vector_area(&at, point);
                for i in 0..N {
                    let row = &mut force[face[i] as usize * D..][..D];
                    row.iter_mut().zip(area).for_each(|(f, area)| *f -= pressure[i] * area);
                }
            }
        }
    }
}

impl<const D: usize, const N: usize> LoadTerm for Pressure<D, N> {
    fn components(&self) -> usize {
        1
    }

    fn work(&self, x: &[f64], p: &[f64]) -> f64 {
        let mut work = 0.0;
        for (face, areas) in self.faces() {
            let (at, p) = (nodes::<D, N>(x, face), nodes::<D, N>(p, face));
            for (point, pressure) in areas {
                let area = vector_area(&at, point);
                work -=
                    (0..N).map(|i| pressure[i] * (0..D).map(|c| area[c] * p[i][c]).sum::<f64>()).sum::<f64>();
            }
        }
        work
    }

    fn add_force_of(&self, value: &dyn Fn([f64; 3], f64) -> [f64; 3], x: &[f64], force: &mut [f64]) {
        let mut rows = self.now.clone();
        self.integrate(&|x| value(x, self.time)[0], &mut rows);
        self.add_force_by_rows(&rows, x, force);
    }

    fn add_force(&self, x: &[f64], force: &mut [f64]) {
        self.add_force_by_rows(&self.now, x, force);
    }

    /// The pressure depends on reference positions, the area only on `x`.
    fn add_work_by_shape(&self, x: &[f64], p: &[f64], rows: &mut [f64]) -> bool {
        self.each_slope(x, |face, area, point, slope| {
            let along = image(&nodes::<D, N>(p, face), point);
            let work: f64 = area.iter().zip(along).map(|(area, p)| area * p).sum();
            for (vertex, shape) in face.iter().zip(&point.shape) {
                let row = rows[*vertex as usize * D..][..D].iter_mut();
                row.zip(slope).for_each(|(row, slope)| *row -= point.weight * shape * work * slope);
            }
        });
        true
    }

    fn add_force_by_shape(&self, x: &[f64], change: &[f64], force: &mut [f64]) -> bool {
        self.each_slope(x, |face, area, point, slope| {
            let way = image(&nodes::<D, N>(change, face), point);
            let changed: f64 = slope.iter().zip(way).map(|(slope, way)| slope * way).sum();
            for (vertex, shape) in face.iter().zip(&point.shape) {
                let row = force[*vertex as usize * D..][..D].iter_mut();
                row.zip(area).for_each(|(f, area)| *f -= point.weight * shape * changed * area);
            }
        });
        true
    }

    fn add_unit_works(&self, x: &[f64], p: &[f64], works: &mut [f64]) {
        for (face, _) in self.faces() {
            let (at, p) = (nodes::<D, N>(x, face), nodes::<D, N>(p, face));
            for point in &self.areas {
                let area: [f64; D] = vector_area(&at, point);
                let along = |p: &[f64; D]| (0..D).map(|c| area[c] * p[c]).sum::<f64>();
                works[0] -= (0..N).map(|i| point.weight * point.shape[i] * along(&p[i])).sum::<f64>();
            }
        }
    }
}

impl<const D: usize, const N: usize> Measurements for Pressure<D, N> {
    /// Returns the sum of all force magnitudes times the size of the scene.
    fn scale(&mut self, x: &[f64]) -> f64 {
        let mut force = 0.0;
        for (face, areas) in self.faces() {
            let nodes = nodes::<D, N>(x, face);
            for (point, p) in areas {
                let area = vector_area::<D, N>(&nodes, point).iter().map(|c| c * c).sum::<f64>().sqrt();
                force += area * p.iter().map(|p| p.abs()).sum::<f64>();
            }
        }
        force * crate::algebra::scene_size(x, D)
    }

    fn add_stiffness_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        self.add_product(x, p, 0.5, false, y);
        self.add_product(x, p, 0.5, true, y);
        false
    }
}
