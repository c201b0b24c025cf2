//! Results for people and in files.

use std::path::Path;

use pliant_lab::stability::{Against, AttemptStatus, Map, StabilitySurvey};
use pliant_lab::study::page::{Look, Page, TableCell};
use pliant_lab::study::plot::{AxisSpec, CellState, Chart, HeatMap, Line, Point};
use pliant_scene::RefusedScheme;
use serde_json::Value;

use crate::failure::Failure;
use crate::output::{self, csv_line};
use crate::text::{counted, number, table, wrap};

/// Columns of the table of limits.
const HEADER: [&str; 8] =
    ["", "predicted [s]", "measured [s]", "ratio", "above it", "at step [s]", "drift [1/s]", "amplitude"];

/// Meaning of the columns.
const ABOUT: &str = "Predicted is the limit of the scene linearised at its start, by what a step does to an \
                     oscillator; measured the largest step with which 1000 steps (100 of an implicit \
                     scheme) could be taken. Drift is the slope of the energy, amplitude what oscillates \
                     about it, both over the energy that there is.";

/// A limit that is predicted, in the words of `pliant list`.
fn predicted_limit(limit: Option<f64>) -> String {
    match limit {
        None => "any".into(),
        Some(0.0) => "none".into(),
        Some(step) => number(step),
    }
}

/// What a reader of the table has to know of this scene.
fn remarks(found: &StabilitySurvey) -> Vec<String> {
    let mut out = vec![];
    for limit in &found.limits {
        out.extend(limit.doubles_at.map(|step| {
            let step = number(step);
            format!(
                "{}: none, it gains energy at any step; at {step} s the fastest motion would double by the \
                 end.",
                limit.integrator
            )
        }));
    }
    let early = found.map.as_ref().map_or(0, Map::failed_below_limit);
    if early > 0 {
        out.push(format!(
            "{} of the map failed below the limit that is predicted. That limit is of small motion about the \
             start; there the motion became large.",
            counted(early as u64, "step", "steps")
        ));
    }
    out
}

/// A row for each scheme.
fn limits(found: &StabilitySurvey) -> Vec<[String; 8]> {
    let mut rows = vec![];
    for (limit, drift) in found.limits.iter().zip(&found.drifts) {
        let predicted = predicted_limit(limit.predicted);
        let measured = match limit.above {
            Some(_) => number(limit.measured),
            None => format!(">= {}", number(limit.measured)),
        };
        let ratio = limit
            .predicted
            .filter(|_| limit.above.is_some() && limit.doubles_at.is_none())
            .map_or_else(String::new, |p| format!("{:.3}", limit.measured / p));
        let ok = drift.status == AttemptStatus::Ok;
        rows.push([
            limit.integrator.clone(),
            predicted,
            measured,
            ratio,
            limit.above.map_or("", AttemptStatus::name).into(),
            number(drift.step),
            if ok { number(drift.per_second) } else { drift.status.name().into() },
            if ok { number(drift.amplitude) } else { String::new() },
        ]);
    }
    rows
}

pub(super) fn describe(found: &StabilitySurvey, width: usize) -> String {
    let mut rows = vec![HEADER.map(str::to_owned).to_vec()];
    rows.extend(limits(found).into_iter().map(Vec::from));
    let mut out = table(&rows, 0);
    out.push('\n');
    out += &wrap(ABOUT, 0, width);
    if found.walls > 0 {
        out += &wrap(
            "No prediction accounts for walls: vertices are put back after each step, and in an implicit \
             one, which is solved without them, that can add energy at any size of the step.",
            0,
            width,
        );
    }
    for RefusedScheme { integrator, reason } in &found.refused {
        out += &wrap(&format!("Left out: {integrator}: {reason}."), 0, width);
    }
    if let Some(map) = &found.map {
        out.push('\n');
        out += &text_map(map);
    }
    for remark in remarks(found) {
        out += &wrap(&remark, 0, width);
    }
    out.push('\n');
    out + &format!("{}\n", agreement(found))
}

fn agreement(found: &StabilitySurvey) -> String {
    let apart = found.amplification.iter().flat_map(|curve| {
        curve.measured.iter().zip(&curve.formula).map(|(measured, formula)| (measured / formula - 1.0).abs())
    });
    let apart = apart.fold(0.0, f64::max);
    format!("amplification of an oscillator: measured and formula agree to {}", number(apart))
}

fn row_name(map: &Map, row: usize) -> String {
    let value = map.values[row];
    match map.against {
        Against::Young => format!("stiffness x {}", number(value)),
        Against::Poisson => format!("nu = {value}"),
        Against::Density => format!("density x {}", number(value)),
        Against::Gravity => format!("gravity x {}", number(value)),
    }
}

/// `.` taken, `x` diverged, `!` not solved.
fn text_map(map: &Map) -> String {
    let mut rows = vec![];
    for row in (0..map.values.len()).rev() {
        let line: String = map.status[row]
            .iter()
            .map(|status| match status {
                AttemptStatus::Ok => " .",
                AttemptStatus::Diverged => " x",
                AttemptStatus::Unsolved => " !",
            })
            .collect();
        let limit = predicted_limit(map.predicted[row]);
        rows.push(vec![row_name(map, row), line, limit]);
    }
    let (first, last) = (map.steps.first().copied().unwrap_or(0.0), map.steps.last().copied().unwrap_or(0.0));
    let head =
        vec![String::new(), format!("{} to {} s", number(first), number(last)), "predicted [s]".into()];
    rows.insert(0, head);
    format!("{}: . taken, x diverged, ! Newton failed\n{}", map.integrator, table(&rows, 0))
}

/// Writes tables, charts and a page.
pub(super) fn write(
    folder: &Path,
    scene: &str,
    found: &StabilitySurvey,
    document: &Value,
) -> Result<(), Failure> {
    let n = |x: f64| format!("{x:?}");
    let mut csv = csv_line(&[
        "integrator",
        "predicted_s",
        "measured_s",
        "above",
        "drift_step_s",
        "drift_status",
        "drift_per_s",
        "amplitude",
        "doubles_at_s",
    ]);
    for (limit, drift) in found.limits.iter().zip(&found.drifts) {
        csv += &csv_line(&[
            &limit.integrator,
            &limit.predicted.map_or_else(String::new, n),
            &n(limit.measured),
            limit.above.map_or("", AttemptStatus::name),
            &n(drift.step),
            drift.status.name(),
            &n(drift.per_second),
            &n(drift.amplitude),
            &limit.doubles_at.map_or_else(String::new, n),
        ]);
    }
    output::file(&folder.join("stability.csv"), &csv)?;
    output::file(&folder.join("stability.json"), &format!("{document:#}\n"))?;
    let amplification = amplification(found)?;
    output::file(&folder.join("amplification.svg"), &amplification)?;
    let mut page = Page::new(&format!("How large a step: {scene}"));
    let cells = |row: [String; 8]| row.iter().map(|cell| TableCell::new(cell, Look::Number)).collect();
    let header = HEADER.map(|name| (if name.is_empty() { "scheme" } else { name }, Look::Number));
    page.table(&header, &limits(found).into_iter().map(cells).collect::<Vec<_>>());
    page.note(ABOUT);
    page.list(remarks(found).iter().map(String::as_str));
    if let Some(map) = &found.map {
        output::file(&folder.join("map.csv"), &map_csv(map))?;
        let svg = heat_map(map)?;
        output::file(&folder.join("map.svg"), &svg)?;
        page.figure(
            &svg,
            "Which steps the first scheme takes, row by row. \"limit\" is the last step below the limit that \
             is predicted for small motion about the start; larger motion can fail below it.",
        );
    }
    page.figure(&amplification, &format!("Spectral radius of one step; {}.", agreement(found)));
    output::file(&folder.join("stability.html"), &page.finish())
}

fn map_csv(map: &Map) -> String {
    let mut csv = csv_line(&["integrator", "against", "value", "predicted_s", "step_s", "status"]);
    for (row, value) in map.values.iter().enumerate() {
        for (step, status) in map.steps.iter().zip(&map.status[row]) {
            let predicted = map.predicted[row].map_or_else(String::new, |p| format!("{p:?}"));
            csv += &csv_line(&[
                &map.integrator,
                map.against.name(),
                &format!("{value:?}"),
                &predicted,
                &format!("{step:?}"),
                status.name(),
            ]);
        }
    }
    csv
}

fn heat_map(map: &Map) -> Result<String, Failure> {
    let cell = |row: usize, column: usize| {
        let status = map.status[row][column];
        let at = AttemptStatus::ALL.iter().position(|s| *s == status).unwrap_or(0);
        // Where the limit is: the last step below it.
        let next = map.steps.get(column + 1).copied().unwrap_or(f64::INFINITY);
        let limit = map.predicted[row].is_some_and(|limit| map.steps[column] <= limit && limit < next);
        Some((at, if limit { "limit".to_owned() } else { String::new() }))
    };
    let order: Vec<usize> = (0..map.values.len()).rev().collect();
    let what = match map.against {
        Against::Young => "times the stiffness",
        Against::Poisson => "Poisson's ratio",
        Against::Density => "times the density of the first body",
        Against::Gravity => "times the mutual gravity",
    };
    let names = ["taken", "diverged", "Newton failed"];
    let colors = [(0x9b, 0xd4, 0xb5), (0xd5, 0x5e, 0x00), (0xe6, 0x9f, 0x00)];
    let svg = HeatMap {
        title: format!("{}: which steps it takes", map.integrator),
        x: "step [s]; \"limit\": the last one below what is predicted for small motion".into(),
        y: what.into(),
        columns: map.steps.iter().map(|s| format!("{s:.0e}")).collect(),
        rows: order.iter().map(|row| number(map.values[*row])).collect(),
        cells: order.iter().map(|row| (0..map.steps.len()).map(|c| cell(*row, c)).collect()).collect(),
        states: names
            .iter()
            .zip(colors)
            .map(|(name, color)| CellState { name: (*name).into(), color })
            .collect(),
    };
    svg.svg().map_err(|error| Failure::failed("chart", error.to_string()))
}

/// Measured spectral radii.
fn amplification(found: &StabilitySurvey) -> Result<String, Failure> {
    let mut chart = Chart::new(
        "Amplification of an oscillator in one step",
        AxisSpec::log("h omega"),
        AxisSpec::log("spectral radius"),
    );
    for (look, curve) in found.amplification.iter().enumerate() {
        let shown = |radius: f64| radius.is_finite() && radius > 0.0 && radius < 1e3;
        let points = |radii: &[f64]| -> Vec<Point> {
            let all = curve.z.iter().zip(radii);
            all.filter(|(_, r)| shown(**r)).map(|(z, r)| Point::new(*z, *r)).collect()
        };
        chart.lines.push(Line {
            name: curve.integrator.clone(),
            points: points(&curve.measured),
            marked: false,
            joined: true,
            look,
        });
    }
    chart.floors.push((1.0, "neither grows nor decays".into()));
    chart.svg().map_err(|error| Failure::failed("chart", error.to_string()))
}
