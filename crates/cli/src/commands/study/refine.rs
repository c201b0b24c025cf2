//! `pliant study --refine`: total error against run time, by mesh, elements, scheme and step.

use pliant::quantity::Seconds;
use pliant_lab::refinement::{
    QuantityRefinement, RefinedRow, RefinementError, RefinementPlan, RefinementResults, RefinementStudy,
    StudiedSceneError, chart, percent,
};
use pliant_lab::study::page::{Look, Page, TableCell};
use pliant_scene::Source;
use serde_json::{Value, json};

use super::{name, provenance};
use crate::arguments::StudyArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::progress::announced;
use crate::terminal::Terminal;
use crate::text::{counted, number, rounded_to, table, wrap};

use super::files::Files;

/// Explanation of the errors, for all reports.
const ABOUT: &str = "Each error is that of mesh and step together, against the continuous problem. It is \
                     relative to the largest magnitude of the quantity over time, and no smaller than the \
                     error of the row's mesh with the smallest step: where the two parts cancel, nothing is \
                     gained.";

pub(super) fn execute(
    arguments: &StudyArguments,
    inputs: &[Input],
    files: &Files,
    terminal: Terminal,
) -> Result<ExitStatus, Failure> {
    let interrupted = interrupt::flag()?;
    let [input] = inputs else {
        return Err(Failure::usage("--refine studies one scene at a time"));
    };
    let failed = |error| failure(error, &input.source);
    let mut plan = RefinementPlan::of(&input.scene).map_err(failed)?;
    plan.budget = arguments.budget.unwrap_or(plan.budget);
    plan.repeats = arguments.repeats.map(|n| usize::from(n.get()));
    plan.threads = arguments.threads.map_or(1, |n| usize::from(n.get()));
    let study = RefinementStudy { source: &input.source, plan: &plan, interrupt: interrupted };
    let results = announced(terminal, |watch| study.run(watch)).map_err(failed)?;
    let title = arguments.title.clone().or_else(|| input.scene.title.clone());
    let title = title.unwrap_or_else(|| name(input.source.name()));
    terminal.report(&described(&results, &title, terminal.width()))?;
    let mut document = document(&results, &title);
    let charts = charts(&results)?;
    for (file, svg, _) in &charts {
        files.put(file, svg)?;
    }
    let report = files.put("report.html", &page(&results, &title, &charts))?;
    files.put("study.json", &format!("{document:#}\n"))?;
    terminal.report(&format!("{}  charts, all runs\n", report.display()))?;
    document["status"] = json!(ExitStatus::Done);
    document["folder"] = json!(files.folder().display().to_string());
    terminal.document(&document)?;
    Ok(ExitStatus::Done)
}

fn failure(error: RefinementError, source: &Source) -> Failure {
    match error {
        RefinementError::Plan(problems) => source.error(problems).into(),
        RefinementError::Scene(StudiedSceneError::Scene(error)) => error.into(),
        RefinementError::NoRun(_) | RefinementError::Interrupted | RefinementError::Threads { .. } => {
            Failure::failed("study", error.to_string())
        }
        error => Failure::usage(error.to_string()),
    }
}

/// The verdict, and the cheapest ways, for people.
fn described(results: &RefinementResults, title: &str, width: usize) -> String {
    let mut out = format!("Total error against run time: {title}\n");
    for (i, of) in results.quantities.iter().enumerate() {
        out += &format!("\n{}", wrap(&reference(results, of), 0, width));
        if !of.cheapest.is_empty() {
            out += &table(&cheapest(results, of), 2);
        }
        for none in
            of.cheapest.iter().filter_map(|cheapest| Some((cheapest.error, cheapest.reason.as_ref()?)))
        {
            out += &wrap(&format!("{}: {}", percent(none.0), none.1), 2, width);
        }
        let orders = orders(results, i, of);
        if !orders.is_empty() {
            out += &wrap(&format!("observed orders: {}", orders.join(", ")), 2, width);
        }
    }
    let runs = counted(results.rows.len() as u64, "run", "runs");
    let failed = match results.failed {
        0 => String::new(),
        n => format!(", {n} failed (steps too large)"),
    };
    out += &format!("\n{runs} in {}{failed}\n", Seconds(results.seconds));
    for left_out in &results.left_out {
        out += &wrap(&format!("omitted: {left_out}"), 0, width);
    }
    out
}

/// The reference of a quantity, in a sentence.
fn reference(results: &RefinementResults, of: &QuantityRefinement) -> String {
    let QuantityRefinement { quantity, unit, ladders, reference, .. } = of;
    let Some(reference) = reference else {
        let reasons = ladders.iter().map(|ladder| {
            let reason = ladder.reason.as_deref().unwrap_or("no estimate");
            format!("{}: {reason}", ladder.family.words(results.dimension))
        });
        return format!("{quantity}: no reference; {}", reasons.collect::<Vec<_>>().join("; "));
    };
    let own = ladders.iter().find(|ladder| ladder.family == reference.family);
    let cells = own.map_or_else(String::new, |ladder| {
        let ends = [ladder.cells.first(), ladder.cells.last()].map(|cells| cells.map_or("", String::as_str));
        format!(", {} to {} cells", ends[0], ends[1])
    });
    let second = match reference.second {
        None => "no other elements confirm it".to_owned(),
        Some((family, value, _)) => {
            let verb = if reference.agrees { "agree" } else { "do not agree" };
            format!(
                "{} {verb}: {} {unit}",
                family.words(results.dimension),
                rounded_to(value, reference.uncertainty)
            )
        }
    };
    format!(
        "{quantity}: {} +- {} {unit} by {}{cells}; {second}",
        rounded_to(reference.value, reference.uncertainty),
        number(reference.uncertainty),
        reference.family.words(results.dimension)
    )
}

/// The table of the cheapest rows.
fn cheapest(results: &RefinementResults, of: &QuantityRefinement) -> Vec<Vec<String>> {
    let header = ["error below", "elements", "cells", "scheme", "step", "error", "run time"];
    let header: Vec<String> = header
        .iter()
        .filter(|name| !results.is_static || !["scheme", "step"].contains(name))
        .map(|name| (*name).to_owned())
        .collect();
    let rows = of.cheapest.iter().filter_map(|cheapest| {
        let row = &results.rows[cheapest.row?];
        let mut cells =
            vec![percent(cheapest.error), row.family.words(results.dimension).to_owned(), row.cells.clone()];
        if !results.is_static {
            cells.extend([
                row.scheme.to_owned(),
                row.step.map_or_else(String::new, |step| Seconds(step).to_string()),
            ]);
        }
        cells.extend([percent(cheapest.reached?), Seconds(row.seconds).to_string()]);
        Some(cells)
    });
    let rows: Vec<Vec<String>> = rows.collect();
    if rows.is_empty() { vec![] } else { std::iter::once(header).chain(rows).collect() }
}

/// Orders that were observed, with the expected ones.
fn orders(results: &RefinementResults, index: usize, of: &QuantityRefinement) -> Vec<String> {
    let in_space = of.ladders.iter().filter_map(|ladder| {
        let order =
            ladder.estimate.as_ref().map(|estimate| estimate.order).filter(|order| order.is_finite())?;
        let words = ladder.family.words(results.dimension);
        Some(format!("{words} {order:.1} of {}", number(ladder.expected_order)))
    });
    let mut schemes: Vec<&str> = results.rows.iter().map(|row| row.scheme).collect();
    schemes.sort_unstable();
    schemes.dedup();
    let in_time = schemes.into_iter().filter_map(|scheme| {
        let expected = results.rows.iter().find(|row| row.scheme == scheme)?.order;
        Some(format!("{scheme} {:.1} of {expected}", results.order_in_time(scheme, index)?))
    });
    in_space.chain(in_time).collect()
}

/// Keys of a row as TOML to paste.
fn keys(row: &RefinedRow) -> String {
    row.keys.iter().map(|key| format!("{key}\n")).collect()
}

/// Charts with their files and captions.
fn charts(results: &RefinementResults) -> Result<Vec<(String, String, String)>, Failure> {
    let mut charts = vec![];
    for (i, of) in results.quantities.iter().enumerate().filter(|(_, of)| of.reference.is_some()) {
        let svg = chart(results, of).svg();
        let svg = svg.map_err(|error| Failure::failed("report", error.to_string()))?;
        let caption = "The front is joined, and named by mesh and elements. Filled marks are explicit \
                       integrators. Thin lines are the errors of the meshes, which no step reduces.";
        charts.push((format!("error-{}.svg", i + 1), svg, caption.to_owned()));
    }
    Ok(charts)
}

fn page(results: &RefinementResults, title: &str, charts: &[(String, String, String)]) -> String {
    let mut page = Page::new(&format!("Total error against run time: {title}"));
    let mut charts = charts.iter();
    for (i, of) in results.quantities.iter().enumerate() {
        page.heading(&of.quantity);
        page.paragraph(&reference(results, of));
        let rows = cheapest(results, of);
        if let Some((header, rows)) = rows.split_first() {
            let header: Vec<(&str, Look)> = header.iter().map(|name| (name.as_str(), Look::Text)).collect();
            let cells = |row: &Vec<String>| row.iter().map(|cell| TableCell::new(cell, Look::Text)).collect();
            page.table(&header, &rows.iter().map(cells).collect::<Vec<_>>());
        }
        let none = of.cheapest.iter().filter_map(|cheapest| {
            Some(format!("{}: {}", percent(cheapest.error), cheapest.reason.as_ref()?))
        });
        let none: Vec<String> = none.collect();
        page.list(none.iter().map(String::as_str));
        if let Some((_, svg, caption)) = of.reference.as_ref().and_then(|_| charts.next()) {
            page.figure(svg, caption);
        }
        for cheapest in &of.cheapest {
            if let Some(row) = cheapest.row {
                page.paragraph(&format!("{}, options of a run:", percent(cheapest.error)));
                page.preformatted(&keys(&results.rows[row]));
            }
        }
        let orders = orders(results, i, of);
        if !orders.is_empty() {
            page.note(&format!("Observed orders: {}.", orders.join(", ")));
        }
    }
    page.heading("All runs");
    page.paragraph(ABOUT);
    page.table(
        &[
            ("elements", Look::Text),
            ("cells", Look::Text),
            ("unknowns", Look::Number),
            ("scheme", Look::Text),
            ("step [s]", Look::Number),
            ("run time [s]", Look::Number),
            ("errors", Look::Number),
        ],
        &results.rows.iter().enumerate().map(|(i, row)| cells(results, i, row)).collect::<Vec<_>>(),
    );
    page.list(results.left_out.iter().map(String::as_str));
    let provenance = provenance();
    page.note(&format!(
        "{}; {}; {}; commit {}",
        provenance.cpu, provenance.rustc, provenance.flags, provenance.commit
    ));
    page.finish()
}

/// Cells of a row in the table of all runs.
fn cells(results: &RefinementResults, index: usize, row: &RefinedRow) -> Vec<TableCell> {
    let errors = results
        .quantities
        .iter()
        .map(|of| of.errors.get(index).map_or_else(|| "-".to_owned(), |error| percent(error.total)));
    let text = [
        row.family.words(results.dimension).to_owned(),
        row.cells.clone(),
        row.unknowns.to_string(),
        row.scheme.to_owned(),
        row.step.map_or_else(|| "-".to_owned(), |step| format!("{step:.4e}")),
        format!("{:.3e}", row.seconds),
        errors.collect::<Vec<_>>().join(", "),
    ];
    text.iter().map(|text| TableCell::new(text, Look::Number)).collect()
}

fn document(results: &RefinementResults, title: &str) -> Value {
    json!({ "title": title, "provenance": provenance(), "refinement": results })
}
