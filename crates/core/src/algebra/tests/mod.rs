//! Decompositions against references in twice the precision, over every kind of `F` that has its own pitfall.

mod double_double;
mod eigen;
mod polar;
mod sample;
mod svd;
