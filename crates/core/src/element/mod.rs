//! Elements: how positions of vertices become a deformation gradient, and a stress becomes forces.

mod simplex;

pub use simplex::{SimplexPack, simplex_rest};
pub(crate) use simplex::{edge_matrix, vertex_gradients};
