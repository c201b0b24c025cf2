//! Axes: positions and labels of ticks.

use std::ops::Range;

use pliant::quantity::Rounded;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// Map from numbers to positions along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisScale {
    /// Linear scale.
    Linear,
    /// Logarithmic scale, over any number of decades; numbers that are not positive have no position.
    Log,
}

impl AxisScale {
    /// True if a number has a position.
    pub(super) fn holds(self, value: f64) -> bool {
        value.is_finite() && (self == AxisScale::Linear || value > 0.0)
    }
}

/// An axis over a range of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ticks {
    scale: AxisScale,
    from: f64,
    to: f64,
}

/// Replaces the library's logarithmic axis, which writes 1e-14 as 0.00000000000001 and omits decades.
impl Ticks {
    /// Axis over these numbers with a margin; without numbers over a decade or a unit.
    pub(super) fn over(scale: AxisScale, values: impl Iterator<Item = f64>) -> Ticks {
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|value| scale.holds(*value)) {
            from = from.min(value);
            to = to.max(value);
        }
        match scale {
            AxisScale::Log if from > to => Ticks { scale, from: 0.1, to: 10.0 },
            // A range within a decade would have no labelled tick.
            AxisScale::Log => {
                let (from, to) = (from / 1.4, to * 1.4);
                let has_decade = from.log10().ceil() <= to.log10().floor();
                let widened = (10f64.powf(from.log10().floor()), 10f64.powf(to.log10().ceil()));
                let (from, to) = if has_decade { (from, to) } else { widened };
                Ticks { scale, from, to }
            }
            AxisScale::Linear if from > to => Ticks { scale, from: 0.0, to: 1.0 },
            AxisScale::Linear => {
                let room = if to > from { 0.04 * (to - from) } else { 0.5 * from.abs().max(1.0) };
                Ticks { scale, from: from - room, to: to + room }
            }
        }
    }

    /// Ends of the axis.
    pub(super) fn ends(&self) -> (f64, f64) {
        (self.from, self.to)
    }

    /// Relative position of `value` between the lower and the upper end.
    fn part(&self, value: f64) -> f64 {
        match self.scale {
            AxisScale::Linear => (value - self.from) / (self.to - self.from),
            AxisScale::Log => (value / self.from).ln() / (self.to / self.from).ln(),
        }
    }

    /// Number at the relative position `part`.
    pub(super) fn at(&self, part: f64) -> f64 {
        match self.scale {
            AxisScale::Linear => self.from + part * (self.to - self.from),
            AxisScale::Log => self.from * (self.to / self.from).powf(part),
        }
    }

    /// Labelled ticks, about `most` at most.
    fn labelled(&self, most: usize) -> Vec<f64> {
        let most = most.max(1) as f64;
        match self.scale {
            AxisScale::Log => {
                let (first, last) = (self.from.log10().ceil() as i32, self.to.log10().floor() as i32);
                let every = ((f64::from(last - first) + 1.0) / most).ceil().max(1.0) as i32;
                let first = first.div_euclid(every) * every;
                (first..=last)
                    .step_by(every as usize)
                    .map(|e| 10f64.powi(e))
                    .filter(|t| self.has(*t))
                    .collect()
            }
            AxisScale::Linear => {
                let rough = (self.to - self.from) / most;
                let power = 10f64.powf(rough.log10().floor());
                let step = power * [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= rough).unwrap_or(10.0);
                let (first, last) = ((self.from / step).ceil() as i64, (self.to / step).floor() as i64);
                (first..=last).map(|i| i as f64 * step).collect()
            }
        }
    }

    /// Minor ticks: 2 to 9 of each decade, for few decades.
    fn fine(&self) -> Vec<f64> {
        let (first, last) = (self.from.log10().floor(), self.to.log10().ceil());
        if self.scale == AxisScale::Linear || last - first > 5.0 {
            return vec![];
        }
        let decades = first as i32..=last as i32;
        let all = decades.flat_map(|e| (2..10).map(move |i| f64::from(i) * 10f64.powi(e)));
        all.filter(|tick| self.has(*tick)).collect()
    }

    fn has(&self, value: f64) -> bool {
        self.from <= value && value <= self.to
    }
}

impl Ranged for Ticks {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (low, high): (i32, i32)) -> i32 {
        low + (self.part(*value) * f64::from(high - low)).round() as i32
    }

    fn key_points<H: KeyPointHint>(&self, hint: H) -> Vec<f64> {
        let mut ticks = self.labelled(hint.bold_points());
        if hint.weight().allow_light_points() {
            ticks.extend(self.fine());
        }
        ticks
    }

    fn range(&self) -> Range<f64> {
        self.from..self.to
    }
}

impl ValueFormatter<f64> for Ticks {
    fn format_ext(&self, value: &f64) -> String {
        match self.scale {
            AxisScale::Log => power_of_ten(value.log10().round() as i32),
            AxisScale::Linear => short(*value),
        }
    }
}

/// Power of ten with superscripts; small powers as plain numbers.
fn power_of_ten(e: i32) -> String {
    match e {
        -2..=3 => short(10f64.powi(e)),
        _ => {
            let digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
            let superscript = |c: char| match c.to_digit(10) {
                Some(d) => digits.chars().nth(d as usize).unwrap_or(c),
                None => '⁻',
            };
            format!("10{}", e.to_string().chars().map(superscript).collect::<String>())
        }
    }
}

/// Number with up to four digits.
fn short(value: f64) -> String {
    Rounded::<4>(value).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &Ticks, most: usize) -> Vec<String> {
        ticks.labelled(most).iter().map(|t| ticks.format_ext(t)).collect()
    }

    #[test]
    fn a_logarithmic_axis_reaches_down_to_rounding() {
        let ticks = Ticks::over(AxisScale::Log, [3e-15, 1e-14, 0.5, 0.0, -1.0, f64::NAN].into_iter());
        let places = [3e-15, 1e-14, 1e-10, 0.5].map(|v| ticks.map(&v, (0, 1000)));
        assert!(places.windows(2).all(|pair| pair[0] < pair[1]), "{places:?}");
        assert!(places[0] >= 0 && places[3] <= 1000, "{places:?}");
        let labels = labels(&ticks, 20);
        assert_eq!(labels.first().unwrap(), "10⁻¹⁴");
        assert_eq!(labels.len(), 14, "one for every decade: {labels:?}");
        // All decades have the same length.
        let gap = |a: f64| ticks.map(&(10.0 * a), (0, 100_000)) - ticks.map(&a, (0, 100_000));
        assert!((gap(1e-14) - gap(1e-2)).abs() <= 1);
    }

    #[test]
    fn decades_are_thinned_out_where_there_are_many() {
        let ticks = Ticks::over(AxisScale::Log, [1e-14, 1.0].into_iter());
        assert_eq!(labels(&ticks, 5), ["10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "1"].map(str::to_owned));
    }

    #[test]
    fn a_range_within_a_decade_has_ticks() {
        let ticks = Ticks::over(AxisScale::Log, [0.02, 0.03].into_iter());
        assert_eq!(labels(&ticks, 5), ["0.01", "0.1"].map(str::to_owned));
    }

    #[test]
    fn linear_ticks_are_round() {
        let ticks = Ticks::over(AxisScale::Linear, [0.0, 1.0].into_iter());
        assert_eq!(labels(&ticks, 6), ["0", "0.2", "0.4", "0.6", "0.8", "1"].map(str::to_owned));
        assert_eq!(ticks.map(&0.5, (0, 100)), 50);
        // An axis exists for a single number, and for none.
        assert!(Ticks::over(AxisScale::Linear, [3.0].into_iter()).ends().0 < 3.0);
        assert_eq!(Ticks::over(AxisScale::Linear, std::iter::empty()).ends(), (0.0, 1.0));
    }
}
