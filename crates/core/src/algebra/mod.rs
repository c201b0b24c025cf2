//! Small dense matrices and their decompositions, generic over [`Scalar`](crate::scalar::Scalar).
//!
//! The only place of the crate that knows what differs between two and three dimensions.

mod matrix;

pub use matrix::{Mat, Vect};
