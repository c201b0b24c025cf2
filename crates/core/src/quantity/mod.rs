//! Quantities: numbers with a unit, as a user writes them, `"3 MPa"`.
//!
//! [`Kind::parse`] converts such a text to the number in SI units that the rest of the crate uses. The units
//! are a table of this crate: thirty symbols, their prefixes, products and powers. Other crates do not fit:
//! `uom` and `dimensioned` check dimensions at compile time and do not read products or powers from text;
//! `rink-core`, `fend-core` and `numbat` are whole calculators with thousands of units, and none of them
//! reports the position of a mistake in the text.
//!
//! A decimal unit moves the decimal point of the text before the conversion to binary: `"0.1 ms"` has the
//! same bits as `1e-4`.

mod counted;
mod dimension;
mod error;
mod kind;
mod parse;
mod rounded;
mod seconds;
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
pub use seconds::Seconds;
pub use unit::{prefixes, unit_symbols};
