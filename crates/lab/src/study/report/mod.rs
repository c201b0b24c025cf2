//! Reports of the results of a study: one self-contained HTML page, and one page of Markdown with charts as
//! files next to it.

mod figures;
mod html;
mod markdown;

use super::advice::{front, number, seconds, words};
use super::plot::PlotError;
use super::results::{LineResult, Results, VariantResult};
use super::row::RowStatus;

pub use figures::{Figure, FigureKind};

/// Section of a report: one variant of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Title of the scene, and the varied keys.
    pub heading: String,
    /// The reference of the runs, and the machine.
    pub about: Vec<String>,
    /// The charts.
    pub figures: Vec<Figure>,
    /// Header and rows of the table of integrators.
    pub table: Vec<[String; 7]>,
    /// The Pareto front in words.
    pub words: Vec<String>,
    /// Remarks that the reader needs to judge the lines.
    pub remarks: Vec<String>,
}

/// Report on one or several studies.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyReport {
    /// Title of the report.
    pub title: String,
    /// The machine.
    pub machine: String,
    /// Remarks on noisy timings, one per study.
    pub noise: Vec<String>,
    /// The parts.
    pub sections: Vec<Section>,
    /// Advice for each scene and reference: name and TOML.
    pub recommendations: Vec<(String, String)>,
}

impl StudyReport {
    /// Report on these studies, with charts of these kinds.
    ///
    /// # Errors
    /// A chart cannot be drawn.
    pub fn new(title: &str, studies: &[Results], kinds: &[FigureKind]) -> Result<StudyReport, PlotError> {
        let mut sections = vec![];
        let mut recommendations = vec![];
        for study in studies {
            for (index, variant) in study.variants.iter().enumerate() {
                sections.push(section(study, variant, index, kinds)?);
            }
            let named = study.recommendations().into_iter().map(|advice| match advice.problem.as_str() {
                "" => (study.name.clone(), advice.settings),
                problem => (format!("{}, {problem}", study.name), advice.settings),
            });
            recommendations.extend(named);
        }
        let noise = studies.iter().filter_map(|study| Some(format!("{}: {}", study.name, study.noise()?)));
        let machine = studies.first().map_or_else(String::new, |study| {
            let p = &study.provenance;
            let threads = study.rows().next().map_or(1, |row| row.threads);
            let plural = if threads == 1 { "" } else { "s" };
            format!("{}, {threads} thread{plural}; {}; {}; commit {}", p.cpu, p.rustc, p.flags, p.commit)
        });
        let noise = noise.collect();
        Ok(StudyReport { title: title.to_owned(), machine, noise, sections, recommendations })
    }

    /// Names and SVG texts of all charts.
    pub fn charts(&self) -> impl Iterator<Item = (&str, &str)> {
        let figures = self.sections.iter().flat_map(|section| &section.figures);
        figures.map(|figure| (figure.file.as_str(), figure.svg.as_str()))
    }

    /// Report as Markdown, with charts in `folder` (a relative path, empty or ending in a slash).
    pub fn markdown(&self, folder: &str) -> String {
        markdown::page(self, folder)
    }

    /// Report as one HTML page that contains its charts.
    pub fn html(&self) -> String {
        html::page(self)
    }
}

fn section(
    study: &Results,
    variant: &VariantResult,
    index: usize,
    kinds: &[FigureKind],
) -> Result<Section, PlotError> {
    let heading = match variant.variant.is_empty() {
        true => study.title.clone(),
        false => format!("{}: {}", study.title, variant.variant),
    };
    let prefix =
        if study.variants.len() > 1 { format!("{}-{}", study.name, index + 1) } else { study.name.clone() };
    let row = variant.rows().next();
    let mut about = vec![format!(
        "Reference: {}. Its own error is about {:.0e}; errors below ten times that are not reported.",
        variant.reference.how, variant.reference.error
    )];
    if let Some(row) = row {
        let what: Vec<&str> =
            [row.material.as_str(), row.element.as_str()].into_iter().filter(|w| !w.is_empty()).collect();
        about.push(format!(
            "{}, {} unknowns, {} simulated; the largest error of {} common times, relative to the motion.",
            what.join(", "),
            row.ndof,
            seconds(row.t_end),
            study.grid.times
        ));
    }
    let refused = study.refused.iter();
    let refused = refused.map(|refused| format!("{} is omitted: {}", refused.integrator, refused.reason));
    let mut table = vec![
        ["integrator", "order", "observed", "smallest error", "at step", "in", "ended because"]
            .map(str::to_owned),
    ];
    table.extend(variant.lines.iter().map(|line| table_row(variant, line)));
    Ok(Section {
        heading,
        about,
        figures: figures::all(&prefix, &study.title, variant, kinds)?,
        table,
        words: words(front(variant.rows()), &variant.reference),
        remarks: refused.chain(remarks(variant)).collect(),
    })
}

fn table_row(variant: &VariantResult, line: &LineResult) -> [String; 7] {
    let rows = variant.of(&line.integrator).map(|record| &record.row);
    let counting = rows.filter_map(|row| Some((row, row.error()?)));
    let best = counting.min_by(|a, b| a.1.total_cmp(&b.1));
    let dash = || "-".to_owned();
    [
        line.integrator.clone(),
        line.order_nominal.to_string(),
        line.order_observed.map_or_else(dash, |order| format!("{order:.2}")),
        best.map_or_else(dash, |(_, error)| format!("{error:.1e}")),
        best.map_or_else(dash, |(row, _)| seconds(row.dt)),
        best.map_or_else(dash, |(row, _)| seconds(row.wall_min_s)),
        line.stop.words().to_owned(),
    ]
}

/// Remarks on failed rows, omitted rows, and integrators below their order.
fn remarks(variant: &VariantResult) -> Vec<String> {
    let mut out = vec![];
    for line in &variant.lines {
        let failed: Vec<String> = variant
            .of(&line.integrator)
            .filter(|record| record.row.status != RowStatus::Ok)
            .map(|record| {
                let row = &record.row;
                let when = row.fail_time.map_or(String::new(), |t| format!(" at t = {}", seconds(t)));
                format!("{} ({}{when})", seconds(row.dt), row.status.words())
            })
            .collect();
        if !failed.is_empty() {
            out.push(format!("{} failed with steps of {}", line.integrator, failed.join(", ")));
        }
        if line.falls_short() {
            out.push(format!(
                "{} has the observed order {:.1} instead of {}: its steps do not resolve all motions yet, or \
                 the solver, the reference, or something that is not smooth limits it, such as walls or \
                 loads that jump",
                line.integrator,
                line.order_observed.unwrap_or(f64::NAN),
                line.order_nominal
            ));
        }
    }
    let dropped = variant.rows().filter(|row| row.dropped).count();
    if dropped > 0 {
        out.push(format!(
            "{dropped} {} dropped: the error is below {}, ten times that of the reference",
            if dropped == 1 { "row was" } else { "rows were" },
            number(variant.reference.floor())
        ));
    }
    out
}
