//! Frictional contact of `pliant` on plain arrays: distances of points, edges and triangles, barriers,
//! continuous collision detection, friction, and the broad phase.
//!
//! A pair of primitives has vertices `x_i` and coefficients `c_i`: `r = sum c_i x_i` is the shortest
//! vector from the second primitive to the first and `d = |r|`. Energies, forces and Hessians of every
//! kind of pair follow from the coefficients by one formula ([`pair`]). The contact energy of a pair is
//! `kappa w dhat B(q)` ([`barrier`]). Continuous collision detection limits implicit steps so that no
//! pair ever touches ([`ccd`]). Explicit steps use an energy with finite forces and check for crossings
//! ([`energy`]).
//!
//! Functions are generic over [`Scalar`](pliant::scalar::Scalar): the same code runs on `f64` and on
//! packs of eight pairs, with identical bits.
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
//!
//! # How to add a primitive
//! 1. An obstacle that is points, segments or triangles within a radius, as a capsule is, needs nothing
//!    here. In `crates/scene/src` it takes `ObstacleShape` (`schema/contact.rs`), its check
//!    (`validate/contact.rs`), what is drawn of it (`assembly/obstacles.rs`), its vertices
//!    (`assembly/body.rs`), and its faces and radius (`ContactParty` in `assembly/contact.rs`).
//! 2. An exact obstacle of another shape, as `SolidBall`, is named in six files: `model.rs` (its list,
//!    `surface_reach`, `named`), `contacts.rs` (`find`, `find_each`), `way.rs` (`first`), `start.rs`
//!    (`each_obstacle_gap`, `enclosed_bodies`), `report.rs` (`described`), and `assembly/contact.rs` of the
//!    scene.
//! 3. A new kind of pair is named in ten: `pair.rs` (`PairKind`), `closest.rs` (`Primitives`, `InnerKind`,
//!    `InnerPair`), `candidates.rs` (its list, `gather`, `count`, `vertex_pairs`), `merge.rs` (its list,
//!    `find_pairs`, `push`), `contacts.rs` (`sizes`, `vertices`, both visits), `way.rs` (`first`),
//!    `start.rs` (`each_distance`); `mollifier.rs`, `friction_slope.rs` and `report.rs` match kinds that
//!    edges can have. `ccd.rs`, `packs.rs`, `visit.rs` and `hessian.rs` are generic.
//! 4. Add it to `tests/fuzz.rs` (motions), `tests/points.rs` (energies) and `tests/surfaces.rs` here, and to
//!    a scene in `tests/contact` of the workspace.

// Functions use the symbols of the cited papers.
#![allow(non_snake_case)]
// Loops over small fixed ranges index several arrays at once; closures would lose the SIMD target
// features.
#![allow(clippy::needless_range_loop)]
// `lecture` is set by `tests/tools/web.sh`.
#![allow(unexpected_cfgs)]

pub mod barrier;
pub mod broad_phase;
pub mod candidates;
pub mod ccd;
pub mod closest;
pub mod contacts;
mod eigen;
pub mod energy;
mod evaluation;
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
mod visit;
pub mod way;

#[cfg(test)]
mod tests;
