//! Charts of a report.

use super::super::advice::seconds;
use super::super::plot::{AxisSpec, Chart, Line, PlotError, Point, SlopeTriangle};
use super::super::results::{Record, VariantResult};
use super::super::row::{Row, RowStatus};

/// Kind of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureKind {
    /// Error against run time.
    Time,
    /// Error against step.
    Step,
    /// Error against force evaluations.
    Forces,
    /// Error against Newton iterations of implicit integrators.
    Newton,
    /// Energy over time.
    Energy,
}

impl FigureKind {
    /// All kinds, in the order of a report.
    pub const ALL: [FigureKind; 5] =
        [FigureKind::Time, FigureKind::Step, FigureKind::Forces, FigureKind::Newton, FigureKind::Energy];

    fn name(self) -> &'static str {
        match self {
            FigureKind::Time => "time",
            FigureKind::Step => "step",
            FigureKind::Forces => "forces",
            FigureKind::Newton => "newton",
            FigureKind::Energy => "energy",
        }
    }
}

/// A chart with its caption.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name of the file.
    pub file: String,
    /// Caption.
    pub caption: String,
    /// The chart as SVG.
    pub svg: String,
}

const ERROR: &str = "error of positions, relative";

pub(super) fn all(
    prefix: &str,
    title: &str,
    variant: &VariantResult,
    kinds: &[FigureKind],
) -> Result<Vec<Figure>, PlotError> {
    let mut figures = vec![];
    for kind in kinds {
        let (chart, caption) = match kind {
            FigureKind::Time => (
                against(
                    variant,
                    "error against run time",
                    "run time, stepping alone \
                                                            [s]",
                    true,
                    |row| row.wall_min_s,
                ),
                "Error against run time: the lower left is better. The label is the smallest step of each \
                 integrator, each mark a step half as long as the one before."
                    .to_owned(),
            ),
            FigureKind::Step => (
                steps(variant),
                "Error against step. Triangles show the slopes of orders of convergence.".to_owned(),
            ),
            FigureKind::Forces => (
                against(
                    variant,
                    "error against work: forces",
                    "force \
                     evaluations",
                    false,
                    |row| row.n_force as f64,
                ),
                "Error against force evaluations, which do not depend on the machine.".to_owned(),
            ),
            FigureKind::Newton => (
                against(variant, "error against work: linear systems", "Newton iterations", false, |row| {
                    row.n_newton as f64
                }),
                "Error against Newton iterations, implicit integrators only.".to_owned(),
            ),
            FigureKind::Energy => energy(variant),
        };
        if chart.lines.is_empty() {
            continue;
        }
        let chart = Chart { title: format!("{title}: {}", chart.title), ..chart };
        figures.push(Figure { file: format!("{prefix}-{}.svg", kind.name()), caption, svg: chart.svg()? });
    }
    Ok(figures)
}

/// Chart of errors against a cost; integrators without that cost are omitted. A failed run is a cross.
fn against(variant: &VariantResult, title: &str, x: &str, label: bool, cost: impl Fn(&Row) -> f64) -> Chart {
    let mut chart = Chart::new(title, AxisSpec::log(x), AxisSpec::log(ERROR));
    for (look, line) in variant.lines.iter().enumerate() {
        let rows = variant.of(&line.integrator).map(|record| &record.row);
        let shown = rows.filter(|row| !row.dropped && cost(row) > 0.0);
        let mut points: Vec<Point> = shown
            .map(|row| Point {
                x: cost(row),
                y: (row.status == RowStatus::Ok).then_some(row.error()).flatten(),
                label: None,
            })
            .collect();
        if points.is_empty() {
            continue;
        }
        let smallest = variant.of(&line.integrator).map(|r| &r.row).filter(|row| row.counts()).last();
        if let (true, Some(row), Some(point)) =
            (label, smallest, points.iter_mut().rev().find(|p| p.y.is_some()))
        {
            point.label =
                Some(row.tol.map_or_else(|| seconds(row.dt), |tolerance| format!("tol. {tolerance:e}")));
        }
        chart.lines.push(Line { name: line.integrator.clone(), points, marked: true, joined: true, look });
    }
    chart
}

fn steps(variant: &VariantResult) -> Chart {
    let mut chart = against(variant, "error against step", "step [s]", false, |row| row.dt);
    if variant.rows().any(|row| row.dropped) {
        chart.floors.push((variant.reference.floor(), "ten times the error of the reference".to_owned()));
    }
    // One triangle for each order, below the middle row of the most accurate integrator of that order.
    let mut orders: Vec<u32> = variant.lines.iter().map(|line| line.order_nominal).collect();
    orders.sort_unstable();
    orders.dedup();
    for order in orders {
        let lines = variant.lines.iter().filter(|line| line.order_nominal == order);
        let points = lines.flat_map(|line| {
            let rows: Vec<(f64, f64)> =
                variant.of(&line.integrator).filter_map(|r| Some((r.row.dt, r.row.error()?))).collect();
            rows.get(rows.len() / 2).copied()
        });
        if let Some((x, y)) = points.min_by(|a, b| a.1.total_cmp(&b.1)) {
            chart.slopes.push(SlopeTriangle { order: f64::from(order), x: 1.15 * x, y: 0.12 * y });
        }
    }
    chart
}

/// Chart of energies at the largest step at which half of the integrators work, or at each integrator's
/// nearest step.
fn energy(variant: &VariantResult) -> (Chart, String) {
    let mut chart = Chart::new(
        "energy over time",
        AxisSpec::linear("time [s]"),
        AxisSpec::linear("change of energy, relative"),
    );
    let mut steps: Vec<f64> = variant.rows().map(|row| row.dt).collect();
    steps.sort_by(|a, b| b.total_cmp(a));
    steps.dedup();
    let works = |step: f64| {
        let at_step = |record: &&Record| record.row.dt == step && record.row.status == RowStatus::Ok;
        variant.lines.iter().filter(|line| variant.of(&line.integrator).any(|r| at_step(&r))).count()
    };
    let Some(step) =
        steps.iter().copied().find(|step| 2 * works(*step) >= variant.lines.len()).or(steps.last().copied())
    else {
        return (chart, String::new());
    };
    let away = |record: &&Record| (record.row.dt / step).ln().abs();
    for (look, line) in variant.lines.iter().enumerate() {
        let ok = variant.of(&line.integrator).filter(|record| record.row.status == RowStatus::Ok);
        let Some(record) = ok.min_by(|a, b| away(a).total_cmp(&away(b))) else { continue };
        let points = record.times.iter().zip(&record.energy).map(|(t, e)| Point::new(*t, *e)).collect();
        let other =
            if record.row.dt == step { String::new() } else { format!(" ({})", seconds(record.row.dt)) };
        let name = format!("{}{other}", line.integrator);
        chart.lines.push(Line { name, points, marked: false, joined: true, look });
    }
    let caption =
        format!("Energy over time at steps of {}, or the nearest step of the integrator.", seconds(step));
    (chart, caption)
}
