//! Values of keys as a user writes them, behind plain numbers: how serde reads and writes them, how the JSON
//! schema describes them.
//!
//! [`OverTime`] is a number or a formula of the time, [`OneOrMany`] a number for all or one for each. Numbers
//! with a dimension are read by `As`, from a plain number in SI units or from a text with a unit
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
