//! Results of a study.

use pliant_scene::RefusedScheme;
use serde::{Deserialize, Serialize};

use super::advice::{number, seconds, toml};
use super::errors::TimeError;
use super::machine::Provenance;
use super::plan::TimeGrid;
use super::reference::Reference;
use super::row::Row;
use super::timing::NOISE;

/// The part of its rows with noisy times from which on a study says so.
const NOISY_PART: f64 = 0.1;

/// A row with what was seen on the way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The row.
    pub row: Row,
    /// Errors at each time of comparison, in the units of the scene; as far as the run came.
    pub errors: Vec<TimeError>,
    /// Times at which energies were measured [s].
    pub times: Vec<f64>,
    /// `E - E_0` over the energy in play, at these times.
    pub energy: Vec<f64>,
}

/// Why a scheme was not refined further.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// The error is too close to that of the reference.
    Reference,
    /// The error no longer falls: rounding, or the tolerance of a solver.
    Floor,
    /// The budget would not hold the next step.
    Budget,
    /// The steps asked for are done, or the smallest is reached.
    Steps,
    /// The study was interrupted.
    Interrupted,
}

impl StopReason {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            StopReason::Reference => "error as small as the reference's can be told",
            StopReason::Floor => "error no longer falls",
            StopReason::Budget => "budget used up",
            StopReason::Steps => "all steps done",
            StopReason::Interrupted => "interrupted",
        }
    }
}

/// One scheme on one variant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LineResult {
    /// The scheme.
    pub integrator: String,
    /// The order that it is documented to have.
    pub order_nominal: u32,
    /// The slope through its finest rows that count.
    pub order_observed: Option<f64>,
    /// Why it ends where it does.
    pub stop: StopReason,
}

impl LineResult {
    /// True if it falls short of its order: stiff motions that steps do not resolve yet, or a scheme that
    /// is wrong.
    pub fn falls_short(&self) -> bool {
        self.order_observed.is_some_and(|order| order < f64::from(self.order_nominal) - 0.4)
    }
}

/// All schemes on one variant of the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VariantResult {
    /// Changes of the scene: `path=value`, joined by `; `; empty for the scene itself.
    pub variant: String,
    /// Reference of its runs.
    pub reference: Reference,
    /// The rows, scheme after scheme, from the largest step to the smallest.
    pub records: Vec<Record>,
    /// The schemes.
    pub lines: Vec<LineResult>,
}

impl VariantResult {
    /// The rows.
    pub fn rows(&self) -> impl Iterator<Item = &Row> + Clone {
        self.records.iter().map(|record| &record.row)
    }

    /// The records of a scheme.
    pub fn of(&self, integrator: &str) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |record| record.row.integrator == integrator)
    }
}

/// A whole study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Results {
    /// Name of the scene.
    pub name: String,
    /// Its title.
    pub title: String,
    /// Machine of the study.
    pub provenance: Provenance,
    /// Simulated time [s] and number of times of comparison.
    #[serde(skip)]
    pub grid: TimeGrid,
    /// The largest error that the recommendation may have.
    pub error: f64,
    /// The variants.
    pub variants: Vec<VariantResult>,
    /// Schemes whose steps do not hold the contact of the scene; they are not compared.
    pub refused: Vec<RefusedScheme>,
    /// True if it came to its end.
    pub complete: bool,
}

impl Results {
    /// All rows.
    pub fn rows(&self) -> impl Iterator<Item = &Row> + Clone {
        self.variants.iter().flat_map(VariantResult::rows)
    }

    /// Changes to write into the scene, as [`toml`] says it: one advice for each reference, for errors beside
    /// two references do not compare. A coarse mesh is no cheaper way to simulate a fine one.
    pub fn recommendations(&self) -> Vec<Recommendation> {
        let mut problems: Vec<Vec<&VariantResult>> = vec![];
        for variant in &self.variants {
            match problems.iter_mut().find(|same| same[0].reference.id == variant.reference.id) {
                Some(same) => same.push(variant),
                None => problems.push(vec![variant]),
            }
        }
        let advice = |same: Vec<&VariantResult>| {
            let rows: Vec<&Row> = same.iter().flat_map(|variant| variant.rows()).collect();
            let common = |change: &&str| same.iter().all(|v| v.variant.split("; ").any(|own| own == *change));
            let problem: Vec<&str> = same[0].variant.split("; ").filter(common).collect();
            Recommendation {
                settings: toml(rows, &same[0].reference, self.error),
                problem: problem.join("; "),
            }
        };
        problems.into_iter().map(advice).collect()
    }

    /// Remark on the machine where runs that were repeated differ much in time; `None` on a quiet
    /// one.
    pub fn noise(&self) -> Option<String> {
        let repeated = self.rows().filter(|row| row.repeats > 1);
        let spread = |row: &Row| row.wall_iqr_s / row.wall_median_s;
        let noisy: Vec<&Row> = repeated.clone().filter(|row| spread(row) > NOISE).collect();
        let (worst, count) = (noisy.iter().max_by(|a, b| spread(a).total_cmp(&spread(b)))?, repeated.count());
        (noisy.len() as f64 > NOISY_PART * count as f64).then(|| {
            format!(
                "the machine is noisy: of {count} rows whose runs were repeated, the middle half of the \
                 times of {} differs by more than {} %, most by {} % ({}, step {}); times are the shortest \
                 of each, and smaller differences say nothing",
                noisy.len(),
                number(100.0 * NOISE),
                number(100.0 * spread(worst)),
                worst.integrator,
                seconds(worst.dt)
            )
        })
    }
}

/// Advice for a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Recommendation {
    /// Changes that all variants with one reference have in common: `path=value`, joined by `; `; empty for
    /// the scene as it is.
    pub problem: String,
    /// The settings, as TOML with comments.
    pub settings: String,
}
