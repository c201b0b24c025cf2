//! Reports: one page of HTML with everything, or Markdown with pictures beside it.

use std::fmt::Write;
use std::path::Path;

use pliant::stress::{self, Case, Verdict};

use super::picture::{escape, sheet, svg};
use super::rows::{numbers, title};
use super::{Outcome, counts};
use crate::failure::Failure;
use crate::output;

const STYLE: &str = "body{font:14px/1.4 sans-serif;margin:2em;color:#222}table{border-collapse:collapse}\
    td,th{border-bottom:1px solid #ddd;padding:3px 8px;text-align:right;vertical-align:top}\
    td:first-child,th:first-child,td.l{text-align:left}.pass{color:#00734f}.flagged{color:#9a6700}.fail{color:#c1272d;font-weight:bold}\
    .n{max-width:34em;color:#555}";

/// What the colours mean.
const LEGEND: &str = "Elements in 2D: red where J &lt;= 0, blue where J &lt; 0.95, yellow where J &gt; 1.25.";

/// A page that needs nothing else.
pub(super) fn html(results: &[Outcome]) -> String {
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>pliant stress</title><style>{STYLE}</style></head><body>\n\
         <h1>pliant stress</h1>\n<p>pliant {}; {}</p>\n<p>{LEGEND}</p>\n<table>\n<tr><th>case</th><th>dim</th><th>material</th><th>nu</th>\
         <th>integrator</th><th>solver</th><th></th><th>iterations</th><th>bar</th><th>min J</th><th>energy</th><th>error</th>\
         <th>may be</th><th>time [s]</th><th>end</th><th></th></tr>\n",
        env!("CARGO_PKG_VERSION"),
        sums(results),
    );
    for result in results {
        let (case, f) = result;
        let class = f.verdict.to_string().to_lowercase();
        let nu = case.poisson.map_or_else(String::new, |nu| nu.to_string());
        let _ = write!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{nu}</td><td>{}</td><td>{}</td><td class=\"{class}\">{class}</td>",
            escape(&title(result)),
            case.dimension,
            escape(&case.material),
            case.integrator,
            case.solver.name(),
        );
        for number in numbers(f) {
            let _ = write!(out, "<td>{number}</td>");
        }
        let picture = f.picture.as_ref().map_or_else(String::new, |p| svg(p, 90.0));
        let advice = f.advice.as_ref().map_or_else(String::new, |a| format!("<br>What works: {}", escape(a)));
        let _ = writeln!(
            out,
            "<td>{:.2}</td><td>{picture}</td><td class=\"l n\">{}{advice}</td></tr>",
            f.seconds,
            escape(&f.notes.join("; ")),
        );
    }
    out + "</table>\n</body></html>\n"
}

fn sums(results: &[Outcome]) -> String {
    let counts = counts(results);
    format!(
        "{} cases: {} passed, {} flagged, {} failed",
        results.len(),
        counts["pass"],
        counts["flagged"],
        counts["fail"]
    )
}

/// Writes `file` and, into the folder of its name without the ending, its pictures. Nothing in them depends on the machine.
pub(super) fn write(file: &Path, results: &[Outcome]) -> Result<(), Failure> {
    let stem = file.file_stem().map_or_else(|| "stress".into(), |stem| stem.to_string_lossy().into_owned());
    let folder = file.with_file_name(&stem);
    output::folder(&folder)?;
    let mut out = format!(
        "# What breaks simulators\n\nPrinted by `pliant stress --markdown docs/stress.md`: {}. \"its\" are Newton iterations, of the case or of its worst \
         step, and \"bar\" how many there may be: three times those of an independent program. \"energy\" is that at the end over \
         that at the start; \"error\" is compared with \"may be\": the gradient that is left in the table of starts, and elsewhere the \
         difference from a closed form or from an independent code.\n\nFlagged is what is allowed, but what a user must be told: \
         equilibria away from rest, inverted elements, steps that nobody solves, each with its reason below.\n",
        sums(results),
    );
    for dimension in [2, 3] {
        let name = format!("starts-{dimension}d.svg");
        if let Some(svg) = starts(results, dimension) {
            output::file(&folder.join(&name), &svg)?;
            let _ = write!(out, "\n![Static equilibria in {dimension}D]({stem}/{name})\n");
        }
    }
    out += "\nStatic equilibria that Newton's method finds from each start; red elements are inverted, blue ones compressed, yellow ones \
            dilated.\n";
    let mut rows: Vec<&str> = vec![];
    for (case, _) in results {
        if !rows.contains(&case.row) {
            rows.push(case.row);
        }
    }
    for row in rows {
        let _ = write!(
            out,
            "\n## {}\n\n| case | dim | material | nu | integrator | solver | | its | bar | min J | energy | error | may be |\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
            stress::about(row),
        );
        for (case, f) in results.iter().filter(|(case, _)| case.row == row) {
            let nu = case.poisson.map_or_else(String::new, |nu| nu.to_string());
            let _ = writeln!(
                out,
                "| {} | {} | {} | {nu} | {} | {} | {} | {} |",
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

/// What is to be said of those that did not pass.
fn remarks(results: &[Outcome], row: &str) -> String {
    let mut out = String::new();
    for (case, f) in results.iter().filter(|(case, f)| case.row == row && f.verdict != Verdict::Pass) {
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
        let name = format!("{} {}", case.material, case.poisson.unwrap_or(f64::NAN));
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
