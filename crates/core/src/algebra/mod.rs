//! Small dense matrices and their decompositions, generic over [`Scalar`](crate::scalar::Scalar).
//!
//! This is the only module of the crate that distinguishes two from three dimensions.

mod dual;
mod eigen;
mod isotropic;
mod matrix;
mod polar;
mod projection;
mod svd;
mod vector;
mod views;

pub use dual::Dual;
pub(crate) use dual::SMALLEST_SUM;
pub use eigen::{symmetric_eigen, symmetric_eigen_of_lanes};
pub use isotropic::{IsotropicFunction, isotropic_gradient, isotropic_hessian, isotropic_value};
pub(crate) use matrix::TURNS;
pub use matrix::{Mat, Vect};
pub use polar::{rotation, rotation_by_svd};
pub(crate) use projection::{PackedMatrix, project_positive, project_positive_packed};
pub use svd::{Svd, signed_svd};
pub(crate) use vector::{all_finite, fused_dot};
pub use vector::{centre, cross, direction, dot, scene_size, unit};
pub use views::{columns, columns_mut};

#[cfg(test)]
pub(crate) mod tests;
