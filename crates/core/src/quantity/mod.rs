//! Quantities: numbers with a unit, as a user writes them, `"3 MPa"`.
//!
//! [`Kind::parse`] turns such a text into the number in SI units that the rest of the crate works with. Units
//! are a table of our own. Of the crates at hand, `uom` and `dimensioned` check dimensions at compile time
//! and read no products or powers from text, and `rink-core`, `fend-core` and `numbat` are whole calculators
//! with thousands of units, none of which tells where in the text a mistake is; what is needed here is thirty
//! symbols, their prefixes, products and powers.
//!
//! A decimal unit moves the decimal point of the text before it becomes binary: `"0.1 ms"` has the same bits
//! as `1e-4`.

mod counted;
mod dimension;
mod error;
mod kind;
mod parse;
mod rounded;
#[cfg(test)]
mod tests;
mod unit;

pub use counted::{count, counted};
pub use dimension::Dimension;
pub use error::QuantityError;
pub use kind::Kind;
pub(crate) use parse::number_length;
pub use parse::{Quantity, is_quantity};
pub use rounded::Rounded;
pub use unit::{prefixes, unit_symbols};
