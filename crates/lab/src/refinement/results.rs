//! Results of a study of meshes and steps: references, errors of rows, and the cheapest row for an error.

use serde::Serialize;

use crate::convergence::{LadderEstimate, LadderKind, LadderTier, estimate};
use crate::quantity::{ElementFamily, QuantityOfInterest, RunKey};
use crate::statistics::RunStatistics;
use crate::study::pareto;

/// Errors below this multiple of what is known of the reference are left out.
const TOLD: f64 = 3.0;
/// Errors below this multiple of the difference of two references that do not agree get no advice, and below
/// this multiple of the uncertainty of a reference that nothing confirms.
const TOLD_WITHOUT_AGREEMENT: f64 = 10.0;
/// Relative errors for which the cheapest row is said.
pub(super) const TARGETS: [f64; 3] = [1e-1, 1e-2, 1e-3];
/// Largest number of values of a ladder.
const LADDER: usize = 4;

/// One run.
#[derive(Clone, Debug, Serialize)]
pub struct RefinedRow {
    /// Elements.
    pub family: ElementFamily,
    /// Number of times that the scene's cells are halved.
    pub level: usize,
    /// Cells, as `8x4`.
    pub cells: String,
    /// Coordinates that are free to move.
    pub unknowns: usize,
    /// Name of the scheme.
    pub scheme: &'static str,
    /// Documented order of the scheme.
    pub order: u32,
    /// True if no step solves equations.
    pub explicit: bool,
    /// Step [s]; `None` in statics.
    pub step: Option<f64>,
    /// Values of the quantities.
    pub values: Vec<f64>,
    /// Largest magnitudes of the quantities over time.
    pub largest: Vec<f64>,
    /// Shortest of the timed runs, stepping alone [s].
    pub seconds: f64,
    /// Cost of the first run.
    pub statistics: RunStatistics,
    /// True if the step is so small that the error is that of the mesh.
    pub is_floor: bool,
    /// Keys that make the scene this run.
    pub keys: Vec<RunKey>,
}

impl RefinedRow {
    /// The row of the same mesh whose error is the mesh's; this row without one.
    pub(super) fn floor<'a>(&'a self, rows: &'a [RefinedRow]) -> &'a RefinedRow {
        let is_floor =
            |row: &&RefinedRow| row.is_floor && row.family == self.family && row.level == self.level;
        rows.iter().find(is_floor).unwrap_or(self)
    }
}

/// Values of a quantity on finer and finer meshes of the same elements.
#[derive(Clone, Debug, Serialize)]
pub struct ElementLadder {
    /// Elements.
    pub family: ElementFamily,
    /// Cells of the meshes.
    pub cells: Vec<String>,
    /// Values on the meshes.
    pub values: Vec<f64>,
    /// Order that the error is expected to have.
    pub expected_order: f64,
    /// Estimate of the error of the last value; `None` without one.
    pub estimate: Option<LadderEstimate>,
    /// Reason for which there is none.
    pub reason: Option<String>,
}

impl ElementLadder {
    fn new(
        family: ElementFamily,
        floors: &[&RefinedRow],
        (index, quantity): (usize, &QuantityOfInterest),
        expected_order: f64,
    ) -> Self {
        let values: Vec<f64> = floors.iter().map(|row| row.values[index]).collect();
        let last = &values[values.len().saturating_sub(LADDER)..];
        let found = match quantity.without_limit(last) {
            Some(reason) => Err(reason),
            None => estimate(last, expected_order, LadderKind::Mesh).map_err(|reason| reason.to_string()),
        };
        let (estimate, reason) = match found {
            Ok(found) => (Some(found), None),
            Err(reason) => (None, Some(reason)),
        };
        let cells = floors.iter().map(|row| row.cells.clone()).collect();
        ElementLadder { family, cells, values, expected_order, estimate, reason }
    }

    /// Limit of the values and its uncertainty, that of the last value where values only scatter.
    fn limit(&self) -> Option<(f64, f64)> {
        let found = self.estimate.as_ref()?;
        Some((self.values.last()? + found.estimate.unwrap_or(0.0), found.interval))
    }
}

/// Value of a quantity in the continuous problem, as far as it is known.
#[derive(Clone, Debug, Serialize)]
pub struct QuantityReference {
    /// The value.
    pub value: f64,
    /// Half-width of the interval about the value that is to hold the truth.
    pub uncertainty: f64,
    /// Elements that it comes from.
    pub family: ElementFamily,
    /// Value by other elements with its uncertainty; `None` if no others have one.
    pub second: Option<(ElementFamily, f64, f64)>,
    /// True if the two agree within the sum of their uncertainties.
    pub agrees: bool,
}

impl QuantityReference {
    fn of(ladders: &[ElementLadder]) -> Option<QuantityReference> {
        let mut limits: Vec<(ElementFamily, f64, f64)> = ladders
            .iter()
            .filter_map(|ladder| {
                ladder.limit().map(|(value, uncertainty)| (ladder.family, value, uncertainty))
            })
            .collect();
        limits.sort_by(|a, b| a.2.total_cmp(&b.2));
        let (family, value, uncertainty) = *limits.first()?;
        let second = limits.get(1).copied();
        let agrees = second.is_some_and(|(_, other, own)| (value - other).abs() <= uncertainty + own);
        Some(QuantityReference { value, uncertainty, family, second, agrees })
    }

    /// Uncertainty of the value, the difference of the two references included if they do not agree.
    pub fn known(&self) -> f64 {
        match self.second {
            Some((_, other, _)) if !self.agrees => self.uncertainty.max((self.value - other).abs()),
            _ => self.uncertainty,
        }
    }

    /// Smallest error that gets advice, in the unit of the quantity.
    fn trusted(&self) -> f64 {
        if self.agrees { TOLD * self.uncertainty } else { TOLD_WITHOUT_AGREEMENT * self.known() }
    }
}

/// Error of a row in one quantity, relative to its scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RowError {
    /// Index of the row.
    pub row: usize,
    /// Difference from the reference.
    pub net: f64,
    /// Larger of this and the error of the row's mesh with the smallest step.
    pub total: f64,
    /// True if the reference is known well enough to tell the error.
    pub told: bool,
}

/// Cheapest row for an error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cheapest {
    /// Largest relative error.
    pub error: f64,
    /// Index of the row; `None` if no row has such an error, or none can be told.
    pub row: Option<usize>,
    /// The row's error.
    pub reached: Option<f64>,
    /// Reason for which there is no row.
    pub reason: Option<String>,
}

/// Results of one quantity.
#[derive(Clone, Debug, Serialize)]
pub struct QuantityRefinement {
    /// Name, as it was asked for.
    pub quantity: String,
    /// Unit of all values.
    pub unit: &'static str,
    /// Index among the quantities of the rows.
    #[serde(skip)]
    pub(super) index: usize,
    /// Size of the quantity that errors are relative to: its largest magnitude over time.
    pub scale: f64,
    /// Values on the meshes of each kind of elements, with the smallest steps.
    pub ladders: Vec<ElementLadder>,
    /// The reference; `None` if no ladder has a limit.
    pub reference: Option<QuantityReference>,
    /// Errors of all rows; none without a reference.
    pub errors: Vec<RowError>,
    /// Rows on the Pareto front, the fastest first.
    pub front: Vec<usize>,
    /// The cheapest rows for a few errors.
    pub cheapest: Vec<Cheapest>,
}

impl QuantityRefinement {
    /// Finds the reference of a quantity from the floors in `rows`; [`compare`](Self::compare) evaluates
    /// rows.
    pub(super) fn new(
        index: usize,
        quantity: &QuantityOfInterest,
        rows: &[RefinedRow],
        is_static: bool,
    ) -> QuantityRefinement {
        let mut ladders = vec![];
        for family in ElementFamily::ALL {
            let mut floors: Vec<&RefinedRow> =
                rows.iter().filter(|row| row.is_floor && row.family == family).collect();
            floors.sort_by_key(|row| row.level);
            let expected = quantity.order_in_space(family.order(), is_static);
            if !floors.is_empty() {
                ladders.push(ElementLadder::new(family, &floors, (index, quantity), expected));
            }
        }
        let reference = QuantityReference::of(&ladders);
        let largest = |family: Option<ElementFamily>| {
            let of = rows.iter().filter(|row| family.is_none_or(|own| own == row.family));
            let finest = of.filter(|row| row.is_floor).max_by_key(|row| row.level);
            finest.map_or(0.0, |row| row.largest[index])
        };
        let scale = match &reference {
            Some(reference) => largest(Some(reference.family)).max(reference.value.abs()),
            None => largest(None),
        };
        QuantityRefinement {
            quantity: quantity.to_string(),
            unit: quantity.unit(),
            index,
            scale,
            ladders,
            reference,
            errors: vec![],
            front: vec![],
            cheapest: vec![],
        }
    }

    /// Error of a row without that of its mesh; `None` without a reference.
    fn net(&self, row: &RefinedRow) -> Option<f64> {
        Some((row.values[self.index] - self.reference.as_ref()?.value).abs() / self.scale)
    }

    /// Error of a row, at least that of its mesh, whose row is `floor`; `None` without a reference.
    pub(super) fn total(&self, row: &RefinedRow, floor: &RefinedRow) -> Option<f64> {
        Some(self.net(row)?.max(self.net(floor)?))
    }

    /// Evaluates errors, front and advice of all rows.
    pub(super) fn compare(&mut self, rows: &[RefinedRow]) {
        let Some(reference) = &self.reference else { return };
        let least = TOLD * reference.known() / self.scale;
        let error = |(i, row): (usize, &RefinedRow)| {
            let total = self.total(row, row.floor(rows))?;
            Some(RowError { row: i, net: self.net(row)?, total, told: total >= least })
        };
        self.errors = rows.iter().enumerate().filter_map(error).collect();
        let told = self.errors.iter().filter(|of| of.told);
        self.front = pareto(told.map(|of| (of.row, rows[of.row].seconds, of.total)).collect());
        self.cheapest = TARGETS.map(|error| self.cheapest_for(error, rows)).to_vec();
    }

    /// The cheapest row whose error is at most `error`, relative.
    pub fn cheapest_for(&self, error: f64, rows: &[RefinedRow]) -> Cheapest {
        let none = |reason: String| Cheapest { error, row: None, reached: None, reason: Some(reason) };
        let Some(reference) = &self.reference else {
            let reason = self.ladders.iter().rev().find_map(|ladder| ladder.reason.clone());
            return none(reason.unwrap_or_else(|| "no reference".to_owned()));
        };
        if error * self.scale < reference.trusted() {
            let known = reference.known() / self.scale;
            return none(match (&reference.second, reference.agrees) {
                (Some(_), true) => format!("the reference is known to {} only", percent(known)),
                (Some(_), false) => {
                    format!("the references of two kinds of elements differ by {}", percent(known))
                }
                _ => format!("no other elements confirm the reference, which is known to {}", percent(known)),
            });
        }
        let good = self.errors.iter().filter(|of| of.total <= error);
        match good.min_by(|a, b| rows[a.row].seconds.total_cmp(&rows[b.row].seconds)) {
            Some(of) => Cheapest { error, row: Some(of.row), reached: Some(of.total), reason: None },
            None => {
                let best = self.errors.iter().map(|of| of.total).fold(f64::INFINITY, f64::min);
                none(format!("no run reaches it, the best has {}", percent(best)))
            }
        }
    }

    /// Relative error of the mesh of a kind of elements at a level.
    pub fn floor(&self, family: ElementFamily, level: usize, rows: &[RefinedRow]) -> Option<f64> {
        let is_floor = |of: &&RowError| {
            let row = &rows[of.row];
            row.is_floor && row.family == family && row.level == level
        };
        self.errors.iter().find(is_floor).map(|of| of.net)
    }
}

/// Part as text: `1.2 %`, `0.04 %`, `2e-6`.
pub fn percent(part: f64) -> String {
    use pliant::quantity::Rounded;
    if part >= 1e-5 { format!("{} %", Rounded::<2>(100.0 * part)) } else { format!("{part:.0e}") }
}

/// Results of a study of meshes and steps.
#[derive(Clone, Debug, Serialize)]
pub struct RefinementResults {
    /// Dimension of the scene.
    pub dimension: usize,
    /// True if the scene is static.
    pub is_static: bool,
    /// All runs that reached their ends.
    pub rows: Vec<RefinedRow>,
    /// The quantities.
    pub quantities: Vec<QuantityRefinement>,
    /// Elements, schemes and steps that were not run, with the reasons.
    pub left_out: Vec<String>,
    /// Number of runs that failed.
    pub failed: usize,
    /// Wall time of the study [s].
    pub seconds: f64,
}

impl RefinementResults {
    /// Order of a scheme in time, observed on the coarsest mesh with three steps by factors of 2; `None`
    /// without one, or if these steps are not in its asymptotic range.
    pub fn order_in_time(&self, scheme: &str, quantity: usize) -> Option<f64> {
        let mut meshes: Vec<(usize, ElementFamily)> =
            self.rows.iter().filter(|row| row.scheme == scheme).map(|row| (row.level, row.family)).collect();
        meshes.sort_by_key(|(level, family)| (*level, family.order()));
        meshes.dedup();
        meshes.into_iter().find_map(|(level, family)| {
            let of = |row: &&RefinedRow| row.scheme == scheme && row.level == level && row.family == family;
            let mut rows: Vec<(f64, f64)> = self
                .rows
                .iter()
                .filter(of)
                .filter_map(|row| Some((row.step?, row.values[quantity])))
                .collect();
            rows.sort_by(|a, b| b.0.total_cmp(&a.0));
            let is_halved = |pair: &[(f64, f64)]| (pair[0].0 / pair[1].0 - 2.0).abs() < 1e-6;
            let last = rows.get(rows.len().checked_sub(3)?..)?;
            if !last.windows(2).all(is_halved) {
                return None;
            }
            let values: Vec<f64> = last.iter().map(|(_, value)| *value).collect();
            let order = self.rows.iter().find(|row| row.scheme == scheme)?.order;
            let found = estimate(&values, f64::from(order), LadderKind::Step).ok()?;
            (found.tier == LadderTier::Asymptotic && found.order.is_finite()).then_some(found.order)
        })
    }
}
