//! Contact of `pliant`, from arrays: distances of points, edges and triangles, the barrier between them, how
//! far they may move, friction, and which of them come near.
//!
//! A pair of primitives has vertices `x_i` and coefficients `c_i` with `r = sum c_i x_i` the shortest way
//! from the second primitive to the first and `d = |r|`. Energies, forces and Hessians of every kind of pair
//! follow from the coefficients by one formula ([`pair`]). The contact energy of a pair is `kappa w dhat
//! B(q)` ([`barrier`]), and solved steps are limited so that no pair ever touches ([`ccd`]). Steps that are
//! not solved have an energy without a pole, and are watched ([`energy`]).
//!
//! Functions are generic over [`Scalar`](pliant::scalar::Scalar): the same text runs on `f64` and on packs of
//! eight pairs, with the same bits.
//!
//! ```
//! use pliant_contact::barrier::{Barrier, PotentialForm};
//! use pliant_contact::pair::{PairGeometry, PointTriangle};
//!
//! let x = [[0.2, 0.2, 0.5], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let pair = PairGeometry::<f64, 3, 4, 2>::of::<PointTriangle>(&x);
//! assert_eq!(pair.distance, 0.5);
//! let form = PotentialForm::Barrier;
//! let barrier = Barrier { form, stiffness: 1e5, reach: 1.0, offset: 0.0 };
//! let law = barrier.at(pair.squared_distance, 0.1);
//! // The point is pushed up, the triangle down.
//! let gradient = pair.gradient(law.slope);
//! assert!(gradient[0][2] < 0.0 && gradient[1][2] > 0.0);
//! ```

// Inside a function the symbols of the paper are clearer than words.
#![allow(non_snake_case)]
// Loops over small fixed ranges index several arrays at once; closures would lose their target features.
#![allow(clippy::needless_range_loop)]

pub mod barrier;
pub mod broad_phase;
pub mod candidates;
pub mod ccd;
pub mod closest;
pub mod contacts;
mod eigen;
pub mod energy;
mod expected;
pub mod explicit;
pub mod friction;
mod friction_slope;
pub mod friction_term;
pub mod hessian;
pub mod merge;
pub mod model;
pub mod mollifier;
mod packs;
pub mod pair;
pub mod report;
mod rows;
mod search;
mod shape;
pub mod start;
pub mod surface;
pub mod terms;
mod vector;
pub mod way;

#[cfg(test)]
mod tests;
