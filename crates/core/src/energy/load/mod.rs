//! Loads: external forces that a scene applies to bodies.

mod dead;
mod external;
mod pressure;
mod shape;
#[cfg(test)]
mod tests;

pub use dead::{DeadLoad, Sample};
pub use external::{ExternalForce, ExternalForces, ForceFunction};
pub use pressure::{Pressure, PressureField, ScalarSlope, rim};
pub use pressure::{image, nodes};
pub use shape::{LoadedShape, LoadedVertex};

/// A vector field of the reference position `X` [m] and the time `t` [s].
pub type VectorField = Box<dyn Fn([f64; 3], f64) -> [f64; 3] + Send + Sync>;

/// Derivatives of the components of a [`VectorField`] with respect to the coordinates of `X`.
pub type VectorSlope = Box<dyn Fn([f64; 3], f64) -> [[f64; 3]; 3] + Send + Sync>;

/// Returns the range of `vertices`, ascending, that have rows in an array of `count` rows from `first`
/// on.
fn slots(vertices: &[u32], first: usize, count: usize) -> std::ops::Range<usize> {
    let from = vertices.partition_point(|v| (*v as usize) < first);
    let to = from + vertices[from..].partition_point(|v| (*v as usize) < first + count);
    from..to
}

/// Adds `factor` times the `rows` of these ascending `vertices` to the rows `g` of the vertices from `first`
/// on.
pub(crate) fn add_rows(vertices: &[u32], rows: &[f64], factor: f64, first: usize, g: &mut [f64], d: usize) {
    for slot in slots(vertices, first, g.len() / d) {
        let row = (vertices[slot] as usize - first) * d;
        for c in 0..d {
            g[row + c] += factor * rows[slot * d + c];
        }
    }
}
