//! Muscles: tension along fibres of a solid.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{OverPlaceOf, OverTime};
use pliant::value::*;

/// A muscle in all elements of `elastic`: active stress along its fibres, added to that of the material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(rename = "Muscle")]
pub struct MuscleSpec {
    /// Direction of its fibres at rest.
    pub fibre: FibreSpec,
    /// Tension `T` [Pa] along the direction `a` of the fibres: a number, or a formula of the time `t` and the
    /// place at rest `X`, `Y`, `Z`. The active stress is `P = T (F a) a^T`, which is `S = T a a^T` and
    /// `sigma = T/J (F a)(F a)^T`; positive contracts. Recorded stresses are those of the material alone.
    #[serde(with = "As::<OverPlaceOf<Pressure>>")]
    pub tension: OverTime,
}

impl MuscleSpec {
    /// Name of its term, as muscle `index` of a body of this name.
    pub fn term_name(index: usize, body: &str) -> String {
        format!("muscle {index} of `{body}`")
    }
}

/// Direction of fibres, or of an axis of a material, at rest, one for each element of `elastic`, after
/// `transform` and `repeat`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[serde(rename = "Fibre")]
pub enum FibreSpec {
    /// A vector of any length but zero; each component a number or a formula of the place at rest `X`, `Y`,
    /// `Z` [m], which is taken at the mean of the corners of each element: `["-Y", "X"]` runs around the
    /// origin.
    Direction(
        #[serde(with = "As::<Vec<OverPlaceOf<Number>>>")]
        #[schemars(length(min = 2, max = 3))]
        Vec<OverTime>,
    ),
    /// A vector of any length but zero for each element, in the order of the mesh.
    PerElement(#[serde(with = "As::<Vec<Vec<Number>>>")] Vec<Vec<f64>>),
}

impl FibreSpec {
    /// Its key in a scene.
    pub fn key(&self) -> &'static str {
        match self {
            FibreSpec::Direction(_) => "direction",
            FibreSpec::PerElement(_) => "per_element",
        }
    }

    /// Directions as given, third component 0 in 2D, of elements whose corners have these means at rest [m].
    pub fn vectors(&self, centres: &[[f64; 3]]) -> Vec<[f64; 3]> {
        match self {
            FibreSpec::Direction(formulas) => {
                let at = |centre: &[f64; 3]| components(formulas, |formula| formula.value(*centre, 0.0));
                centres.iter().map(at).collect()
            }
            FibreSpec::PerElement(rows) => rows.iter().map(|row| components(row, |number| *number)).collect(),
        }
    }

    /// Derivatives of the components of these directions by the coordinates of the means; `None` where they
    /// do not go by places.
    pub fn slopes(&self, centres: &[[f64; 3]]) -> Option<Vec<[[f64; 3]; 3]>> {
        let FibreSpec::Direction(formulas) = self else { return None };
        let at = |centre: &[f64; 3]| {
            let mut slopes = [[0.0; 3]; 3];
            let each = slopes.iter_mut().zip(formulas);
            each.for_each(|(slope, formula)| *slope = formula.slope(*centre, 0.0));
            slopes
        };
        formulas.iter().any(OverTime::depends_on_place).then(|| centres.iter().map(at).collect())
    }
}

/// A vector of two or three components.
fn components<T>(given: &[T], value: impl Fn(&T) -> f64) -> [f64; 3] {
    let mut vector = [0.0; 3];
    vector.iter_mut().zip(given).for_each(|(component, given)| *component = value(given));
    vector
}
