//! Charts of a recording's columns over time: as SVG, as pixels, and as text in a terminal.

mod chart;
mod drawn;
mod quantity;
mod terminal;
#[cfg(test)]
mod tests;

pub use chart::{Series, TimeChart};
pub use quantity::{ChartError, PlotQuantity};
