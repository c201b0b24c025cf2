//! Reports: one page of HTML with everything, or Markdown with pictures beside it.

use std::fmt::Write;
use std::path::Path;

use pliant_lab::stress::{self, Case, CaseVerdict};
use pliant_lab::study::page::{Look, Page, TableCell};

use super::Outcome;
use super::conclusion::conclusion;
use super::picture::{sheet, svg};
use super::rows::{any_is_long, numbers, numbers_of_long, scheme, sums, title};
use crate::failure::Failure;
use crate::output;

/// Meaning of the colours of pictures.
const LEGEND: &str = "Elements in 2D: red where J <= 0, blue where J < 0.95, yellow where J > 1.25.";

/// Columns of the table.
const HEADER: [(&str, Look); 19] = [
    ("case", Look::Text),
    ("dim", Look::Number),
    ("material", Look::Text),
    ("nu", Look::Number),
    ("integrator", Look::Text),
    ("solver", Look::Text),
    ("verdict", Look::Text),
    ("iterations", Look::Number),
    ("limit", Look::Number),
    ("min J", Look::Number),
    ("energy", Look::Number),
    ("error", Look::Number),
    ("tolerance", Look::Number),
    ("steps", Look::Number),
    ("worst step", Look::Number),
    ("least gap", Look::Number),
    ("time [s]", Look::Number),
    ("end", Look::Number),
    ("remarks", Look::Long),
];

/// A page that needs nothing else.
pub(super) fn html(results: &[Outcome]) -> String {
    let mut page = Page::new("Stiff and extreme cases");
    page.paragraph(&format!("pliant {}; {}", env!("CARGO_PKG_VERSION"), sums(results)));
    if results.iter().any(|(case, _)| case.row == "scene") {
        page.paragraph(&conclusion(results));
    }
    page.note(CaseVerdict::MEANING);
    page.note(LEGEND);
    page.table(&HEADER, &results.iter().map(row).collect::<Vec<_>>());
    page.finish()
}

/// The row of a case.
fn row(result: &Outcome) -> Vec<TableCell> {
    let (case, f) = result;
    let cell = |text: &str| TableCell::new(text, Look::Number);
    let verdict = match f.verdict {
        CaseVerdict::Pass => Look::Good,
        CaseVerdict::Flagged => Look::Fair,
        CaseVerdict::Fail => Look::Bad,
    };
    let mut cells = vec![
        cell(&title(result)),
        cell(&case.dimension.to_string()),
        cell(&case.material),
        cell(&case.poisson.map_or_else(String::new, |nu| nu.to_string())),
        cell(&scheme(result)),
        cell(case.solver.name()),
        TableCell::new(&f.verdict.to_string().to_lowercase(), verdict),
    ];
    cells.extend(numbers(f).iter().chain(&numbers_of_long(f)).map(|number| cell(number)));
    cells.push(cell(&format!("{:.2}", f.seconds)));
    cells.push(
        f.picture.as_ref().map_or_else(TableCell::default, |picture| TableCell::picture(svg(picture, 90.0))),
    );
    let advice = f.advice.iter().map(|advice| format!("What works: {advice}"));
    let remarks: Vec<String> = f.notes.iter().cloned().chain(advice).collect();
    cells.push(cell(&remarks.join("; ")));
    cells
}

/// Writes `file` and, into the folder of its name without the ending, its pictures. Nothing in them depends
/// on the machine.
pub(super) fn write(file: &Path, results: &[Outcome]) -> Result<(), Failure> {
    let stem = file.file_stem().map_or_else(|| "stress".into(), |stem| stem.to_string_lossy().into_owned());
    let folder = file.with_file_name(&stem);
    output::folder(&folder)?;
    let mut out = format!(
        "# Stiff and extreme cases\n\nPrinted by `pliant stress{} --markdown docs/stress.md`{}: {}. \
         \"iterations\" counts Newton iterations, of the case or of its worst step, and \"limit\" is three \
         times those of an independent program. \"energy\" is the final energy over the initial one; \
         \"error\" is compared with \"tolerance\": the residual gradient in the table of starts, and \
         elsewhere the difference from a closed form or from an independent code.\n\n{} Each reason is \
         below.\n",
        if any_is_long(results) { " --long --resume -o results" } else { "" },
        if any_is_long(results) { ", which reuses the results of earlier runs" } else { "" },
        sums(results),
        CaseVerdict::MEANING,
    );
    for dimension in [2, 3] {
        let name = format!("starts-{dimension}d.svg");
        if let Some(svg) = starts(results, dimension) {
            output::file(&folder.join(&name), &svg)?;
            let _ = write!(out, "\n![Static equilibria in {dimension}D]({stem}/{name})\n");
        }
    }
    out += "\nStatic equilibria that Newton's method finds from each start; red elements are inverted, blue \
            ones compressed, yellow ones dilated.\n";
    let mut rows: Vec<&str> = vec![];
    for (case, _) in results {
        if !rows.contains(&case.row) {
            rows.push(case.row);
        }
    }
    for row in rows {
        let _ = write!(out, "\n## {}\n", stress::row_title(row));
        if let Some(about) = stress::row_description(row) {
            let _ = write!(out, "\n{about}\n");
        }
        let of_row: Vec<&Outcome> = results.iter().filter(|(case, _)| case.row == row).collect();
        let long = of_row.iter().any(|(_, f)| f.steps.is_some());
        let columns = if long { [" steps | worst step | least gap |", "---|---|---|"] } else { ["", ""] };
        let _ = write!(
            out,
            "\n| case | dim | material | nu | integrator | solver | | iterations | limit | min J | energy | \
             error | tolerance |{}\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|---|{}\n",
            columns[0], columns[1],
        );
        for (case, f) in of_row {
            let nu = case.poisson.map_or_else(String::new, |nu| nu.to_string());
            let more = if long { format!(" {} |", numbers_of_long(f).join(" | ")) } else { String::new() };
            let _ = writeln!(
                out,
                "| {} | {} | {} | {nu} | {} | {} | {} | {} |{more}",
                case.name,
                case.dimension,
                case.material,
                case.integrator,
                case.solver.name(),
                f.verdict,
                numbers(f).join(" | "),
            );
        }
        out += &remarks(results, row);
    }
    output::file(file, &out)
}

/// Remarks on those that did not pass.
fn remarks(results: &[Outcome], row: &str) -> String {
    let mut out = String::new();
    for (case, f) in results.iter().filter(|(case, f)| case.row == row && f.verdict != CaseVerdict::Pass) {
        let nu = case.poisson.map_or_else(String::new, |nu| format!(", nu = {nu}"));
        let advice = f.advice.as_ref().map_or_else(String::new, |a| format!(" What works: {a}."));
        let _ = write!(
            out,
            "\n- {}, {}D, {}{nu}, {}: {}.{advice}",
            case.name,
            case.dimension,
            case.material,
            case.integrator,
            f.notes.join("; "),
        );
    }
    if out.is_empty() { out } else { out + "\n" }
}

/// The end states of the table of starts in statics.
fn starts(results: &[Outcome], dimension: usize) -> Option<String> {
    let wanted = |case: &Case| {
        case.row == "torture"
            && case.dimension == dimension
            && case.integrator == "quasi-static"
            && case.solver.name() == "cholesky"
            && (dimension == 2 || case.poisson == Some(0.3))
    };
    let (mut columns, mut rows): (Vec<String>, Vec<(String, Vec<_>)>) = (vec![], vec![]);
    for (case, f) in results.iter().filter(|(case, _)| wanted(case)) {
        let name = case.poisson.map_or_else(|| case.material.clone(), |nu| format!("{} {nu}", case.material));
        let column = columns.iter().position(|c| *c == case.name).unwrap_or_else(|| {
            columns.push(case.name.clone());
            columns.len() - 1
        });
        let row = rows.iter().position(|(n, _)| *n == name).unwrap_or_else(|| {
            rows.push((name, vec![]));
            rows.len() - 1
        });
        let pictures = &mut rows[row].1;
        pictures.resize(pictures.len().max(column + 1), None);
        pictures[column] = f.picture.as_ref();
    }
    (!rows.is_empty()).then(|| sheet(&columns, &rows, 96.0))
}
