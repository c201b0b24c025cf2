//! Loads: external forces that a scene applies to bodies.
//!
//! # How to add one
//! 1. Write the term in this folder: `dead.rs` for forces that do not depend on `x`, `pressure.rs` for those
//!    that do. It implements `EnergyTerm` and `LoadTerm`, and `Driven` if it depends on time.
//! 2. Add the key to `Load` in `crates/scene/src/schema/load.rs`, and to `vectors` or `key` there; to the
//!    keys and the help in `crates/scene/src/validate/loads.rs`.
//! 3. Add its branch to `place` and `term` of `crates/scene/src/assembly/loads.rs`. If the term is generic
//!    over the dimension, build it in `crates/terms`, as `pressure.rs` there.
//! 4. Draw it: `crates/view/src/drawing/loads.rs`.
//! 5. Derivatives by its numbers: `components` in `crates/gradient/src/names/loads.rs`.
//! 6. Tests: `tests.rs` beside this file (forces, products, blocks), `tests/solids/loads.rs`, `loads` in
//!    `tests/element_record.rs`. Print the scene format anew, as `crates/scene/src/schema/mod.rs` says.

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

/// Indices into `vertices`, ascending, of those from `first` on that have rows in an array of `count` rows.
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
