//! Content of a chart, and the scale of its axes.

/// Values over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Times [s] and values; values that are not finite leave a gap.
    pub points: Vec<[f64; 2]>,
}

/// Chart of series over time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeChart {
    /// Title above the chart.
    pub title: String,
    /// Quantity of the vertical axis, with its unit.
    pub name: String,
    /// Series, at least one.
    pub series: Vec<Series>,
}

/// Ends of both axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChartAxes {
    pub(super) time: [f64; 2],
    pub(super) value: [f64; 2],
}

impl ChartAxes {
    /// Position of a point, from 0 to 1 to the right and upwards.
    pub(super) fn share(&self, [time, value]: [f64; 2]) -> [f64; 2] {
        let along = |[low, high]: [f64; 2], x: f64| (x - low) / (high - low);
        [along(self.time, time), along(self.value, value)]
    }
}

impl TimeChart {
    /// Axes that contain all finite points, with some room above and below.
    pub(super) fn axes(&self) -> ChartAxes {
        let finite =
            || self.series.iter().flat_map(|series| &series.points).filter(|point| point[1].is_finite());
        let [low, high] = ends(finite().map(|point| point[1]));
        let room = if high > low { 0.05 * (high - low) } else { low.abs().max(1.0) * 0.5 };
        let [start, end] = ends(finite().map(|point| point[0]));
        let end = if end > start { end } else { start + 1.0 };
        ChartAxes { time: [start, end], value: [low - room, high + room] }
    }
}

/// Smallest and largest number; zeros if there are none.
fn ends(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let ends = numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    if ends[0] <= ends[1] { ends } else { [0.0, 0.0] }
}
