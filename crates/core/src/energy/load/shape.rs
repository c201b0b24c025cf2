//! Derivatives of dead loads with respect to the reference configuration.
//!
//! On a face the field `f(X, t)` gives a vertex `w N_i m f(X, t)` at a quadrature point of weight `w` with
//! shape functions `N_i`, `m` the area `|A|` and `X = sum_i N_i X_i`. If the reference positions move by
//! `d_j`, `dm = A / m . sum_j dA/dX_j d_j` and `df = df/dX sum_j N_j d_j`.

use super::{VectorField, VectorSlope, image, nodes};
use crate::algebra::{dot, unit};
use crate::element::{FacePoint, area_rate, face_points, vector_area};

/// Reference positions on which the forces of a load depend, and the slope of its field.
pub struct LoadedShape {
    places: Box<dyn LoadedPlaces>,
    slope: VectorSlope,
}

/// Field of a load at a given time.
struct FieldAt<'a> {
    field: &'a VectorField,
    slope: &'a VectorSlope,
    /// Time [s].
    time: f64,
}

/// A vertex at whose reference position a field is sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedVertex {
    /// Index in the system.
    pub vertex: u32,
    /// Reference position, third component 0 in 2D [m].
    pub point: [f64; 3],
    /// Weight with which the vertex receives the field as a force.
    pub share: f64,
}

impl LoadedShape {
    /// Creates faces of `N` vertices with reference positions `rest` (flat, all vertices of the system)
    /// [m], under a field with this slope.
    pub fn faces<const D: usize, const N: usize>(
        faces: &[[u32; N]],
        rest: &[f64],
        slope: VectorSlope,
    ) -> Self {
        let faces = faces.iter().map(|face| (*face, nodes::<D, N>(rest, *face))).collect();
        LoadedShape { places: Box::new(LoadedFaces(faces)), slope }
    }

    /// Creates single vertices in `dimension` dimensions, whose weights do not depend on the reference
    /// configuration.
    pub fn vertices(dimension: usize, vertices: Vec<LoadedVertex>, slope: VectorSlope) -> Self {
        LoadedShape { places: Box::new(LoadedPoints { dimension, vertices }), slope }
    }

    /// Adds to `rows`, flat over all vertices, the derivatives of the field's work along `p` with respect to
    /// reference positions.
    pub(super) fn add_work(&self, field: &VectorField, time: f64, p: &[f64], rows: &mut [f64]) {
        self.places.add_work(&FieldAt { field, slope: &self.slope, time }, p, rows);
    }

    /// Adds to `force` its change if reference positions move by `change`.
    pub(super) fn add_force(&self, field: &VectorField, time: f64, change: &[f64], force: &mut [f64]) {
        self.places.add_force(&FieldAt { field, slope: &self.slope, time }, change, force);
    }
}

/// Faces of one kind, or vertices.
trait LoadedPlaces: Send + Sync {
    fn add_work(&self, of: &FieldAt<'_>, p: &[f64], rows: &mut [f64]);

    fn add_force(&self, of: &FieldAt<'_>, change: &[f64], force: &mut [f64]);
}

/// Faces with their nodes in the reference configuration [m].
struct LoadedFaces<const D: usize, const N: usize>(Vec<([u32; N], [[f64; D]; N])>);

struct LoadedPoints {
    dimension: usize,
    vertices: Vec<LoadedVertex>,
}

/// A point of a face in the reference configuration.
struct FaceAtRest<'a, const D: usize, const N: usize> {
    face: &'a [u32; N],
    point: &'a FacePoint<N>,
    /// [m]
    place: [f64; 3],
    /// `m`, and `A / m . dA/dX_j` of its nodes.
    area: f64,
    growth: [[f64; D]; N],
}

impl<const D: usize, const N: usize> LoadedFaces<D, N> {
    fn each(&self, mut visit: impl FnMut(&FaceAtRest<'_, D, N>)) {
        let points = face_points::<D, N>();
        for (face, nodes) in &self.0 {
            for point in &points {
                let (normal, area) = unit(&vector_area(nodes, point));
                let growth = std::array::from_fn(|j| area_rate(nodes, point, j, normal, true));
                visit(&FaceAtRest { face, point, place: image(nodes, point), area, growth });
            }
        }
    }
}

impl<const D: usize, const N: usize> FaceAtRest<'_, D, N> {
    /// Returns `sum_i N_i u_i` of rows of all vertices, third component 0 in 2D.
    fn mean(&self, rows: &[f64]) -> [f64; 3] {
        image(&nodes::<D, N>(rows, *self.face), self.point)
    }
}

/// Returns `sum_c p_c df_c/dX_k`.
fn along_slope(p: &[f64], slope: &[[f64; 3]; 3], k: usize) -> f64 {
    p.iter().zip(slope).map(|(p, row)| p * row[k]).sum()
}

impl<const D: usize, const N: usize> LoadedPlaces for LoadedFaces<D, N> {
    fn add_work(&self, of: &FieldAt<'_>, p: &[f64], rows: &mut [f64]) {
        self.each(|at| {
            let (along, slope) = (at.mean(p), (of.slope)(at.place, of.time));
            let work = dot(&along, &(of.field)(at.place, of.time));
            for (j, vertex) in at.face.iter().enumerate() {
                let row = &mut rows[*vertex as usize * D..][..D];
                for (k, row) in row.iter_mut().enumerate() {
                    let by_place = at.area * at.point.shape[j] * along_slope(&along, &slope, k);
                    *row += at.point.weight * (work * at.growth[j][k] + by_place);
                }
            }
        });
    }

    fn add_force(&self, of: &FieldAt<'_>, change: &[f64], force: &mut [f64]) {
        self.each(|at| {
            let moved = nodes::<D, N>(change, *at.face);
            let growth = dot(at.growth.as_flattened(), moved.as_flattened());
            let (value, slope) = ((of.field)(at.place, of.time), (of.slope)(at.place, of.time));
            let way = at.mean(change);
            for (i, vertex) in at.face.iter().enumerate() {
                let row = &mut force[*vertex as usize * D..][..D];
                for (c, row) in row.iter_mut().enumerate() {
                    let change = growth * value[c] + at.area * dot(&slope[c], &way);
                    *row += at.point.weight * at.point.shape[i] * change;
                }
            }
        });
    }
}

impl LoadedPoints {
    /// Calls `visit` with the range of the rows of each vertex, and the slope of its force.
    fn each(&self, of: &FieldAt<'_>, mut visit: impl FnMut(std::ops::Range<usize>, [[f64; 3]; 3])) {
        for LoadedVertex { vertex, point, share } in &self.vertices {
            let first = *vertex as usize * self.dimension;
            let slope = (of.slope)(*point, of.time).map(|row| row.map(|slope| share * slope));
            visit(first..first + self.dimension, slope);
        }
    }
}

impl LoadedPlaces for LoadedPoints {
    fn add_work(&self, of: &FieldAt<'_>, p: &[f64], rows: &mut [f64]) {
        self.each(of, |range, slope| {
            let along = &p[range.clone()];
            let rows = rows[range].iter_mut().enumerate();
            rows.for_each(|(k, row)| *row += along_slope(along, &slope, k));
        });
    }

    fn add_force(&self, of: &FieldAt<'_>, change: &[f64], force: &mut [f64]) {
        self.each(of, |range, slope| {
            let way = &change[range.clone()];
            force[range].iter_mut().zip(slope).for_each(|(force, slope)| *force += dot(&slope, way));
        });
    }
}
