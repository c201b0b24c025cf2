//! Bounds of numbers, as the schema states them: they are written once, beside the key.

use std::fmt;

use super::json_schema::schemas_at;
use super::key_path::KeyPath;

/// One end of a range.
#[derive(Clone, Copy, Debug, PartialEq)]
struct End {
    value: f64,
    /// True if the end belongs to the range.
    included: bool,
}

/// Range of a number at a path of a scene. A number is finite besides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct NumberRange {
    lower: Option<End>,
    upper: Option<End>,
}

impl NumberRange {
    /// Bounds of the number at `path`. Alternatives without bounds do not loosen those with them: a number
    /// and a list of numbers have theirs side by side.
    pub(super) fn at(path: &KeyPath) -> NumberRange {
        let mut bounds = NumberRange::default();
        let nodes = schemas_at(path);
        debug_assert!(!nodes.is_empty(), "no scene has {path}");
        for node in nodes {
            let end = |key: &str, included| node[key].as_f64().map(|value| End { value, included });
            bounds.lower = end("exclusiveMinimum", false).or(end("minimum", true)).or(bounds.lower);
            bounds.upper = end("exclusiveMaximum", false).or(end("maximum", true)).or(bounds.upper);
        }
        bounds
    }

    /// True for finite numbers of the range.
    pub(super) fn allow(self, value: f64) -> bool {
        let above =
            self.lower.is_none_or(|End { value: end, included }| value > end || included && value == end);
        let below =
            self.upper.is_none_or(|End { value: end, included }| value < end || included && value == end);
        value.is_finite() && above && below
    }

    /// The range in words, for a number of things.
    pub(super) fn of_a_count(self) -> String {
        match (self.lower, self.upper) {
            (Some(End { value, .. }), None) => format!("{value} or more"),
            _ => self.to_string(),
        }
    }
}

/// A bound as people write it: without a row of zeros.
struct Written(f64);

impl fmt::Display for Written {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let small = self.0 != 0.0 && self.0.abs() < 1e-4;
        if small { write!(formatter, "{:e}", self.0) } else { write!(formatter, "{}", self.0) }
    }
}

/// As it follows "must be".
impl fmt::Display for NumberRange {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lower = |End { value, included }| {
            if included {
                format!("at least {}", Written(value))
            } else {
                format!("above {}", Written(value))
            }
        };
        let upper = |End { value, included }| {
            if included { format!("at most {value}") } else { format!("below {value}") }
        };
        match (self.lower, self.upper) {
            (None, None) => formatter.write_str("finite"),
            (Some(End { value: 0.0, included: false }), None) => formatter.write_str("positive and finite"),
            (Some(End { value, included: true }), None) => write!(formatter, "{value} or more, and finite"),
            (Some(low), None) => write!(formatter, "{} and finite", lower(low)),
            (None, Some(high)) => write!(formatter, "{} and finite", upper(high)),
            (Some(low), Some(high)) if low.included && high.included => {
                write!(formatter, "{} to {}", low.value, high.value)
            }
            (Some(low), Some(high)) if !low.included && !high.included => {
                write!(formatter, "between {} and {}, both excluded", low.value, high.value)
            }
            (Some(low), Some(high)) => write!(formatter, "{} and {}", lower(low), upper(high)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(path: &str) -> String {
        NumberRange::at(&path.parse().unwrap()).to_string()
    }

    #[test]
    fn bounds_are_those_beside_the_key() {
        assert_eq!(at("time.step"), "positive and finite");
        assert_eq!(at("time.duration"), "0 or more, and finite");
        assert_eq!(at("body.0.bending.poisson"), "above -1 and at most 0.5");
        assert_eq!(at("body.0.mesh.grid.size.1"), "positive and finite");
        assert_eq!(at("body.3.mesh.grid.cells.0"), "1 or more, and finite");
        assert_eq!(at("body.0.springs.stiffness"), "positive and finite");
        assert_eq!(at("body.0.springs.stiffness.7"), "positive and finite");
        assert_eq!(at("body.0.mesh.grid.origin.1"), "finite");
    }

    #[test]
    fn ends_belong_to_ranges_as_the_schema_says() {
        let poisson = NumberRange::at(&"body.0.bending.poisson".parse().unwrap());
        assert!(poisson.allow(0.5) && poisson.allow(-0.999));
        assert!(!poisson.allow(-1.0) && !poisson.allow(0.500_001) && !poisson.allow(f64::NAN));
        let step = NumberRange::at(&"time.step".parse().unwrap());
        assert!(step.allow(f64::MIN_POSITIVE) && !step.allow(0.0) && !step.allow(f64::INFINITY));
    }
}
