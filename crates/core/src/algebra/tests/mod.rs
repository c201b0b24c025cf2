//! Decompositions against references in twice the precision, over every kind of `F` that has its own pitfall.

mod double_double;
mod dual;
mod eigen;
mod lanes;
mod polar;
pub(crate) mod sample;
mod svd;
