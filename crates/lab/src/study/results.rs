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

/// Fraction of noisy rows from which on a study reports noise.
const NOISY_PART: f64 = 0.1;

/// A row with its errors and energies over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Row of the table.
    pub row: Row,
    /// Errors at each time of comparison that the run reached, in the units of the scene.
    pub errors: Vec<TimeError>,
    /// Times of the energies [s].
    pub times: Vec<f64>,
    /// Energy error `E - E_0` relative to the energy scale, at these times.
    pub energy: Vec<f64>,
}

/// Reason for ending the refinement of an integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// The error is too close to that of the reference.
    Reference,
    /// The error no longer falls: rounding, or the tolerance of a solver.
    Floor,
    /// The budget does not suffice for the next step.
    Budget,
    /// The given steps are done, or the smallest step is reached.
    Steps,
    /// The study was interrupted.
    Interrupted,
}

impl StopReason {
    /// Reason in words.
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

/// Results of one integrator on one variant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LineResult {
    /// Name of the integrator.
    pub integrator: String,
    /// Documented order.
    pub order_nominal: u32,
    /// Slope through the finest rows that count.
    pub order_observed: Option<f64>,
    /// Reason for ending.
    pub stop: StopReason,
}

impl LineResult {
    /// True if the observed order is too low: stiff motions that the steps do not resolve yet, or a wrong
    /// integrator.
    pub fn falls_short(&self) -> bool {
        self.order_observed.is_some_and(|order| order < f64::from(self.order_nominal) - 0.4)
    }
}

/// Results of all integrators on one variant of the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VariantResult {
    /// Changes of the scene: `path=value`, joined by `; `; empty for the scene itself.
    pub variant: String,
    /// Reference of the runs.
    pub reference: Reference,
    /// Rows, integrator after integrator, from the largest step to the smallest.
    pub records: Vec<Record>,
    /// Results of the integrators.
    pub lines: Vec<LineResult>,
}

impl VariantResult {
    /// Rows of the table.
    pub fn rows(&self) -> impl Iterator<Item = &Row> + Clone {
        self.records.iter().map(|record| &record.row)
    }

    /// Records of an integrator.
    pub fn of(&self, integrator: &str) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |record| record.row.integrator == integrator)
    }
}

/// Results of a study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Results {
    /// Name of the scene.
    pub name: String,
    /// Title of the scene.
    pub title: String,
    /// Machine of the study.
    pub provenance: Provenance,
    /// Simulated time [s] and number of times of comparison.
    #[serde(skip)]
    pub grid: TimeGrid,
    /// Largest error of the recommendation.
    pub error: f64,
    /// Results of the variants.
    pub variants: Vec<VariantResult>,
    /// Integrators that do not support the contact of the scene; they are not compared.
    pub refused: Vec<RefusedScheme>,
    /// True if the study was completed.
    pub complete: bool,
}

impl Results {
    /// All rows.
    pub fn rows(&self) -> impl Iterator<Item = &Row> + Clone {
        self.variants.iter().flat_map(VariantResult::rows)
    }

    /// Recommended settings as [`toml`] writes them, one for each reference: errors relative to different
    /// references are not comparable. A coarse mesh is no substitute for a fine one.
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

    /// Remark on the machine if repeated runs differ much in time; `None` on a quiet machine.
    pub fn noise(&self) -> Option<String> {
        let repeated = self.rows().filter(|row| row.repeats > 1);
        let spread = |row: &Row| row.wall_iqr_s / row.wall_median_s;
        let noisy: Vec<&Row> = repeated.clone().filter(|row| spread(row) > NOISE).collect();
        let (worst, count) = (noisy.iter().max_by(|a, b| spread(a).total_cmp(&spread(b)))?, repeated.count());
        (noisy.len() as f64 > NOISY_PART * count as f64).then(|| {
            format!(
                "noisy timings: of {count} rows with repeated runs, {} have an interquartile range above {} \
                 %, the worst {} % ({}, step {}); times are minima, and smaller differences are not \
                 significant",
                noisy.len(),
                number(100.0 * NOISE),
                number(100.0 * spread(worst)),
                worst.integrator,
                seconds(worst.dt)
            )
        })
    }
}

/// Recommended settings for a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Recommendation {
    /// Changes common to all variants with this reference: `path=value`, joined by `; `; empty for the
    /// unchanged scene.
    pub problem: String,
    /// Settings, as TOML with comments.
    pub settings: String,
}
