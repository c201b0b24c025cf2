//! Charts as SVG texts: lines over linear and logarithmic axes, and maps of states.
//!
//! A chart gives the same text on every machine: the SVG contains no fonts, times or identifiers.

mod axis;
mod chart;
mod heat_map;
mod labels;
mod style;
#[cfg(test)]
mod tests;

pub use axis::AxisScale;
pub use chart::{AxisSpec, Chart, Line, Point, SlopeTriangle};
pub use heat_map::{CellState, HeatMap};

/// Error of drawing a chart.
#[derive(Debug, thiserror::Error)]
#[error("the chart `{title}` cannot be drawn: {reason}")]
pub struct PlotError {
    /// Title of the chart.
    pub title: String,
    /// Message of the drawing library.
    pub reason: String,
}
