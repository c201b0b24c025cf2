//! Ranges of numbers: each is one constant next to its key, used by the schema and by the checks.

use schemars::Schema;
use schemars::transform::Transform;

/// Range of a finite number, stored as the keywords of the JSON schema that bound it.
///
/// `#[schemars(transform = RANGE.in_schema())]` writes it into the schema of a key;
/// [`contains`](Self::contains) checks a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyRange {
    keywords: &'static [(&'static str, f64)],
}

impl KeyRange {
    /// Above 0.
    pub const POSITIVE: Self = KeyRange { keywords: &[("exclusiveMinimum", 0.0)] };
    /// Above 0, below 1.
    pub const PART: Self = KeyRange { keywords: &[("exclusiveMinimum", 0.0), ("exclusiveMaximum", 1.0)] };
    /// 0 to 1.
    pub const FRACTION: Self = KeyRange { keywords: &[("minimum", 0.0), ("maximum", 1.0)] };
    /// Poisson's ratio of an isotropic solid: above -1, below 0.5.
    pub const POISSON: Self = KeyRange { keywords: &[("exclusiveMinimum", -1.0), ("exclusiveMaximum", 0.5)] };

    /// A range bounded by these keywords of the JSON schema: `minimum`, `maximum`, `exclusiveMinimum`,
    /// `exclusiveMaximum`.
    pub const fn of(keywords: &'static [(&'static str, f64)]) -> Self {
        KeyRange { keywords }
    }

    /// True for a finite number in the range.
    pub fn contains(self, value: f64) -> bool {
        let within = |(keyword, end): &(&str, f64)| match *keyword {
            "minimum" => value >= *end,
            "maximum" => value <= *end,
            "exclusiveMinimum" => value > *end,
            "exclusiveMaximum" => value < *end,
            _ => unreachable!("{keyword} is no keyword of a bound"),
        };
        value.is_finite() && self.keywords.iter().all(within)
    }

    /// Writes the range into the schema of its key.
    pub fn in_schema(self) -> impl Transform {
        move |schema: &mut Schema| {
            for (keyword, end) in self.keywords {
                schema.insert((*keyword).to_owned(), (*end).into());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use schemars::{JsonSchema, SchemaGenerator};

    #[derive(JsonSchema)]
    struct Solid {
        #[schemars(transform = KeyRange::POISSON.in_schema())]
        #[expect(dead_code, reason = "its schema alone is looked at")]
        poisson: Option<f64>,
    }

    #[test]
    fn ends_belong_to_a_range_as_its_keywords_say() {
        assert!(KeyRange::FRACTION.contains(0.0) && KeyRange::FRACTION.contains(1.0));
        assert!(!KeyRange::PART.contains(0.0) && !KeyRange::PART.contains(1.0));
        assert!(KeyRange::POISSON.contains(-0.999) && !KeyRange::POISSON.contains(-1.0));
        assert!(KeyRange::POISSON.contains(0.4999) && !KeyRange::POISSON.contains(0.5));
        assert!(!KeyRange::POSITIVE.contains(f64::INFINITY) && !KeyRange::POSITIVE.contains(f64::NAN));
    }

    #[test]
    fn schemas_have_the_same_ends() {
        let schema = Solid::json_schema(&mut SchemaGenerator::default());
        let poisson = schema.as_value().pointer("/properties/poisson").unwrap();
        assert_eq!(
            (&poisson["exclusiveMinimum"], &poisson["exclusiveMaximum"]),
            (&(-1.0).into(), &0.5.into())
        );
    }
}
