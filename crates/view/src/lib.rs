//! Visualisation of recordings: the drawing model, a page that plays a recording in a browser, and
//! pictures without a browser.

// Loops over small fixed ranges index several arrays at once.
#![allow(clippy::needless_range_loop)]

pub mod colour;
pub mod drawing;
pub mod page;
pub mod picture;
pub mod plot;
#[cfg(test)]
mod test_support;
