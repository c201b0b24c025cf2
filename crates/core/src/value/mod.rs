//! Values of keys as a user writes them, stored as plain numbers: their serialisation and their JSON schema.
//!
//! [`OverTime`] is a number or a formula of time, [`OneOrMany`] one number for all or one for each. `As`
//! reads numbers with a dimension from a plain number in SI units or from a text with a unit
//! ([`crate::quantity`]).

mod form;
mod measured;
mod one_or_many;
mod over_time;
mod range;

pub use form::{A_NUMBER, TextError, TextForm};
pub use measured::*;
pub use one_or_many::OneOrMany;
pub use over_time::OverTime;
pub use over_time::{OverPlaceOf, OverTimeOf};
pub use range::KeyRange;
