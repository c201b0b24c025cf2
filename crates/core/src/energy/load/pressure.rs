//! Pressure, which follows the surface.

use super::add_rows;
use crate::element::{FacePoint, cross, face_points, vector_area};
use crate::energy::{EnergyKind, EnergyTerm, Fault};

/// A pressure that may change with time and differ from place to place: its value [Pa] and its rate [Pa/s] at the rest position
/// `X` [m] and the time `t` [s].
pub struct PressureField {
    /// Value and rate.
    pub field: Box<dyn Fn([f64; 3], f64) -> (f64, f64) + Send + Sync>,
    /// Whether it depends on time.
    pub changes: bool,
    /// Whether it differs from place to place.
    pub varies: bool,
}

/// Pressure on faces, against their normals out of the body as these are now: the face with vector area `a(x)` gives its vertex `i`
/// the force `-P_i a(x)`, `P_i` the integral of `p N_i` over the rest face by its measure (uniform: `p / D`). A closed surface
/// feels no net force, nor net moment where the pressure is uniform.
///
/// Uniform pressure on a closed surface, or on one whose rim does not move, has the potential `p (V(x) - V(X))`, `V` the volume
/// behind the faces. Otherwise there is none, and its energy is zero. The Hessian is exact in both cases; without a
/// potential it is not symmetric, and the stability limit is found with its symmetric part. Rumpel, Schweizerhof 2003,
/// *Volume-dependent pressure loading and its influence on the stability of structures*, Int. J. Numer. Meth. Eng. 56, 211.
pub struct Pressure<const D: usize> {
    name: String,
    /// Ascending.
    vertices: Vec<u32>,
    /// Places in `vertices`.
    faces: Vec<[u32; D]>,
    /// Quadrature points of each face in the rest shape, where the pressure differs from place to place.
    points: Vec<[f64; 3]>,
    quadrature: Vec<FacePoint<D>>,
    /// A point that does not move, and the volume at rest.
    origin: [f64; D],
    rest_volume: f64,
    conservative: bool,
    pressure: PressureField,
    time: f64,
    /// `P_i` of each face at `time`; a single one where the pressure is uniform.
    now: Vec<[f64; D]>,
    /// Force of the last evaluation on each of `vertices`, flat [N].
    force: Vec<f64>,
}

impl<const D: usize> Pressure<D> {
    /// Pressure on these faces of a system with the flat rest positions `rest` [m]; `rim_stays` says whether the vertices of the
    /// [`rim`] do not move, which is so where there are none.
    pub fn new(
        name: String,
        faces: &[[u32; D]],
        rest: &[f64],
        rim_stays: bool,
        pressure: PressureField,
    ) -> Self {
        let mut vertices = faces.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let slot = |v: u32| vertices.partition_point(|w| *w < v) as u32;
        let local: Vec<[u32; D]> = faces.iter().map(|face| face.map(slot)).collect();
        let quadrature = face_points::<D>();
        let points = match pressure.varies {
            true => faces
                .iter()
                .flat_map(|face| quadrature.iter().map(|q| image(&corners(rest, *face), q)))
                .collect(),
            false => vec![],
        };
        let mut term = Pressure {
            name,
            now: vec![[0.0; D]; if pressure.varies { faces.len() } else { 1 }],
            force: vec![0.0; D * vertices.len()],
            origin: faces.first().map_or([0.0; D], |face| corners(rest, *face)[0]),
            vertices,
            faces: local,
            points,
            quadrature,
            rest_volume: 0.0,
            conservative: rim_stays && !pressure.varies,
            pressure,
            time: 0.0,
        };
        term.rest_volume = term.volume(rest);
        term.look(0.0);
        term
    }

    /// The pressure at the time `time` [s].
    fn look(&mut self, time: f64) {
        let Pressure { quadrature, points, pressure, now, .. } = self;
        if !pressure.varies {
            now[0] = [(pressure.field)([0.0; 3], time).0 / D as f64; D];
            return;
        }
        for (now, points) in now.iter_mut().zip(points.chunks_exact(quadrature.len())) {
            *now = [0.0; D];
            for (point, FacePoint { weight, shape }) in points.iter().zip(&*quadrature) {
                let (p, _) = (pressure.field)(*point, time);
                (0..D).for_each(|i| now[i] += weight * shape[i] * p);
            }
        }
    }

    /// Each face: its vertices and its `P_i`.
    fn faces(&self) -> impl Iterator<Item = ([u32; D], [f64; D])> + '_ {
        let uniform = self.now.len() == 1;
        self.faces.iter().enumerate().map(move |(i, face)| {
            (face.map(|slot| self.vertices[slot as usize]), self.now[if uniform { 0 } else { i }])
        })
    }

    /// The volume behind the faces, as seen from `origin`.
    fn volume(&self, x: &[f64]) -> f64 {
        let cone = |face: &[u32; D]| {
            let corners = corners(x, face.map(|slot| self.vertices[slot as usize]));
            let area = vector_area(&corners);
            (0..D).map(|c| (corners[0][c] - self.origin[c]) * area[c]).sum::<f64>() / D as f64
        };
        self.faces.iter().map(cone).sum()
    }

    /// Adds `K p` or `K^T p` times `factor` to `y`.
    fn add_product(&self, x: &[f64], p: &[f64], factor: f64, transposed: bool, y: &mut [f64]) {
        for (face, pressure) in self.faces() {
            let (at, direction) = (corners(x, face), corners(p, face));
            if transposed {
                let mut sum = [0.0; D];
                (0..D).for_each(|i| (0..D).for_each(|c| sum[c] += pressure[i] * direction[i][c]));
                for j in 0..D {
                    let row = area_rate(&at, j, sum, true);
                    (0..D).for_each(|c| y[face[j] as usize * D + c] += factor * row[c]);
                }
                continue;
            }
            let mut rate = [0.0; D];
            for (j, direction) in direction.iter().enumerate() {
                let part = area_rate(&at, j, *direction, false);
                (0..D).for_each(|c| rate[c] += part[c]);
            }
            for i in 0..D {
                (0..D).for_each(|c| y[face[i] as usize * D + c] += factor * pressure[i] * rate[c]);
            }
        }
    }
}

/// Positions of the vertices of a face.
fn corners<const D: usize>(x: &[f64], face: [u32; D]) -> [[f64; D]; D] {
    face.map(|v| {
        let mut corner = [0.0; D];
        corner.copy_from_slice(&x[v as usize * D..][..D]);
        corner
    })
}

/// Where a quadrature point of a face is.
fn image<const D: usize>(corners: &[[f64; D]; D], point: &FacePoint<D>) -> [f64; 3] {
    let mut image = [0.0; 3];
    for (corner, shape) in corners.iter().zip(&point.shape) {
        (0..D).for_each(|c| image[c] += shape * corner[c]);
    }
    image
}

/// The derivative of the vector area with respect to vertex `j`, applied to `u`, or its transpose.
fn area_rate<const D: usize>(x: &[[f64; D]; D], j: usize, u: [f64; D], transposed: bool) -> [f64; D] {
    let mut rate = [0.0; D];
    let sign = if transposed { -1.0 } else { 1.0 };
    if D == 2 {
        // The quarter turn to the right, which its transpose undoes.
        let end = if j == 1 { sign } else { -sign };
        (rate[0], rate[1]) = (end * u[1], -end * u[0]);
    } else {
        // Half of the edge opposite of the vertex, times u.
        let (from, to) = (x[(j + 1) % D], x[(j + 2) % D]);
        let edge = [0, 1, 2].map(|c| sign * 0.5 * (to[c] - from[c]));
        rate.copy_from_slice(&cross(edge, [0, 1, 2].map(|c| u[c])));
    }
    rate
}

/// The vertices at the rim of these faces, ascending: none where they close.
pub fn rim<const D: usize>(faces: &[[u32; D]]) -> Vec<u32> {
    let mut sides: Vec<[u32; 2]> = match D {
        // A point where an edge begins meets one where an edge ends.
        2 => faces.iter().flat_map(|face| [[face[0], u32::MAX], [u32::MAX, face[1]]]).collect(),
        _ => faces.iter().flat_map(|face| (0..D).map(|i| [face[i], face[(i + 1) % D]])).collect(),
    };
    sides.sort_unstable();
    let twin = |side: &[u32; 2]| {
        let other = [side[1], side[0]];
        let count = |wanted: &[u32; 2]| {
            sides.partition_point(|s| s <= wanted) - sides.partition_point(|s| s < wanted)
        };
        count(&other) == count(side)
    };
    let mut rim: Vec<u32> =
        sides.iter().filter(|side| !twin(side)).flatten().copied().filter(|v| *v != u32::MAX).collect();
    rim.sort_unstable();
    rim.dedup();
    rim
}

impl<const D: usize> EnergyTerm for Pressure<D> {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn kind(&self) -> EnergyKind {
        EnergyKind::Load
    }

    fn changes_with_time(&self) -> bool {
        self.pressure.changes
    }

    fn is_conservative(&self) -> bool {
        self.conservative
    }

    fn set_time(&mut self, time: f64) {
        if time != self.time {
            self.time = time;
            self.look(time);
        }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        if !self.conservative {
            return 0.0;
        }
        D as f64 * self.now[0][0] * (self.volume(x) - self.rest_volume)
    }

    /// The sum of all forces over the diagonal of the bounding box.
    fn scale(&mut self, x: &[f64]) -> f64 {
        let force = |(face, p): ([u32; D], [f64; D])| {
            let area = vector_area(&corners(x, face)).iter().map(|c| c * c).sum::<f64>().sqrt();
            area * p.iter().map(|p| p.abs()).sum::<f64>()
        };
        self.faces().map(force).sum::<f64>() * crate::state::diagonal(x, D)
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let mut force = std::mem::take(&mut self.force);
        force.fill(0.0);
        for (local, (face, pressure)) in self.faces.iter().zip(self.faces()) {
            let area = vector_area(&corners(x, face));
            for (slot, p) in local.iter().zip(pressure) {
                (0..D).for_each(|c| force[*slot as usize * D + c] -= p * area[c]);
            }
        }
        self.force = force;
        crate::integrator::all_finite(&self.force)
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        add_rows(&self.vertices, &self.force, -1.0, first, g, D);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        self.add_product(x, p, 1.0, false, y);
    }

    fn add_stiffness_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        self.add_product(x, p, 0.5, false, y);
        self.add_product(x, p, 0.5, true, y);
        false
    }

    /// `p' (V(x) - V(X))` with a potential, `f . v` without.
    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        if self.conservative {
            let (_, rate) = (self.pressure.field)([0.0; 3], self.time);
            return rate * (self.volume(x) - self.rest_volume);
        }
        let power = |(face, pressure): ([u32; D], [f64; D])| {
            let (area, v) = (vector_area(&corners(x, face)), corners(v, face));
            -(0..D).map(|i| pressure[i] * (0..D).map(|c| area[c] * v[i][c]).sum::<f64>()).sum::<f64>()
        };
        self.faces().map(power).sum()
    }

    fn fault(&self, _x: &[f64]) -> Option<Fault> {
        let finite = crate::integrator::all_finite(self.now.as_flattened());
        (!finite).then(|| Fault::Load { load: self.name.clone(), time: self.time })
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..])
            + size_of_val(&self.faces[..])
            + size_of_val(&self.points[..])
            + size_of_val(&self.now[..])
            + 8 * self.force.len()
    }
}
