//! Results for people and in files.

use std::path::Path;

use pliant::quantity::Seconds;
use pliant_lab::stability::{Against, AttemptStatus, Map, MeasuredLimit, StabilitySurvey};
use pliant_lab::study::page::{Look, Page, TableCell};
use pliant_lab::study::plot::{AxisSpec, CellState, Chart, HeatMap, Line, Point};
use pliant_scene::RefusedScheme;
use serde_json::Value;

use crate::failure::Failure;
use crate::output::{self, csv_line};
use crate::text::{compared, counted, entry, number, percent, table, wrap};

/// Columns of an answer on a terminal.
const ANSWER_WIDTH: usize = 80;

/// Blank between a name, a number and its unit, where no line ends.
const GLUE: &str = "\u{1}";

/// Columns of the table of limits.
const HEADER: [&str; 8] =
    ["", "predicted", "measured", "ratio", "fails by", "at step", "drift [1/s]", "amplitude"];

/// Meaning of the columns.
const ABOUT: &str = "Predicted: linear stability limit at the initial state. Measured: largest step that \
                     completes 1000 steps, 100 with an implicit integrator. Drift: slope of the energy at \
                     the step in the column before it; amplitude: oscillation about that slope; both \
                     relative to the energy scale of the scene.";

/// Note on scenes with walls.
const ABOUT_WALLS: &str = "Predictions do not include walls: these move vertices back after each step, \
                           which can add energy at any step.";

/// Failure above a limit, as a clause.
fn failure(status: AttemptStatus) -> &'static str {
    match status {
        AttemptStatus::Unsolved => "Newton's method fails",
        _ => "the energy diverges",
    }
}

/// Largest step of an integrator that the search found, if it ended with a failure above it.
fn measured(limit: &MeasuredLimit) -> Option<f64> {
    (limit.measured > 0.0 && limit.above.is_some() && !limit.cut_short).then_some(limit.measured)
}

/// One line for each integrator that is done.
pub(super) fn progress(limit: &MeasuredLimit) -> String {
    format!(
        "{}: predicted {}, measured {}",
        limit.integrator,
        predicted_cell(limit.predicted),
        measured_cell(limit)
    )
}

/// The scene's own step next to the largest stable one of the first integrator.
fn verdict(found: &StabilitySurvey) -> String {
    let Some(limit) = found.limits.first() else {
        return "no limit was found within the time budget: increase --budget".into();
    };
    let name = &limit.integrator;
    let own = found.own_step.map(|step| format!("your step, {},", Seconds(step)));
    let own = own.as_deref().unwrap_or("your step, which is adaptive,");
    if let Some(doubles) = limit.doubles_at {
        let times = found.own_step.map_or_else(String::new, |step| {
            format!("; your step, {}, is {} that", Seconds(step), compared(step / doubles))
        });
        return format!(
            "no step is stable ({name}): at {} the highest mode doubles by the end{times}",
            Seconds(doubles)
        );
    }
    let largest = measured(limit).or(limit.predicted);
    match (largest, limit.above) {
        (Some(largest), above) => {
            let kind = if above == Some(AttemptStatus::Unsolved) { "solvable" } else { "stable" };
            match found.own_step {
                Some(step) => {
                    let ratio = compared(step / largest);
                    format!("{own} is {ratio} the largest {kind} one, {} ({name})", Seconds(largest))
                }
                None => {
                    format!("the largest {kind} step is {} ({name}); yours are adaptive", Seconds(largest))
                }
            }
        }
        (None, Some(above)) if limit.measured == 0.0 => {
            format!("{own} fails ({name}): {}, also in the smaller ones tried", failure(above))
        }
        (None, _) if limit.cut_short && found.own_step.is_some_and(|own| limit.measured == own) => {
            format!("{own} is stable ({name}); no trial of a larger one ended within the time budget")
        }
        (None, _) if limit.measured > 0.0 => {
            let first = if found.own_step.is_some() { own } else { "every step" };
            let more = if found.own_step.is_some() { ", and so are larger ones" } else { "" };
            format!("{first} is stable{more} up to {} ({name})", Seconds(limit.measured))
        }
        (None, _) => {
            format!("{own} is below the predicted limit ({name}); no trial ended within the time budget")
        }
    }
}

/// Facts that the verdict is based on.
fn basis(found: &StabilitySurvey) -> String {
    let Some(limit) = found.limits.first() else { return String::new() };
    let mut said = vec![];
    said.extend(match (measured(limit), limit.doubles_at) {
        (_, Some(_)) => None,
        (Some(_), _) => limit.above.map(|above| format!("above that {}", failure(above))),
        (None, _) if limit.cut_short => Some("the search ended early".to_owned()),
        (None, _) if limit.above.is_none() => {
            Some(format!("nothing failed up to {}", Seconds(limit.measured)))
        }
        (None, _) => None,
    });
    if limit.doubles_at.is_none() {
        said.push(match limit.predicted {
            Some(step) => format!("linear stability limit: {}", Seconds(step)),
            None => "any step is predicted to be stable".into(),
        });
    }
    said.extend(found.drift_of(&limit.integrator).map(|drift| match drift.status {
        AttemptStatus::Ok => format!(
            "energy at a step of {}: drift {} per second, oscillation {}",
            Seconds(drift.step),
            percent(drift.per_second),
            percent(drift.amplitude)
        ),
        status => format!("at a step of {} {}", Seconds(drift.step), failure(status)),
    }));
    said.join("; ")
}

/// The verdict and its basis.
pub(super) fn answer(found: &StabilitySurvey, width: usize) -> String {
    let width = width.min(ANSWER_WIDTH);
    wrap(&verdict(found), 0, width) + &wrap(&basis(found), 0, width)
}

/// Other integrators by their largest steps, or the map; what is said after the answer on a terminal.
pub(super) fn brief(found: &StabilitySurvey, width: usize) -> String {
    let width = width.min(ANSWER_WIDTH);
    let mut out = String::from("\n");
    match &found.map {
        Some(map) => out += &text_map(map),
        None => {
            for (label, text) in others(found) {
                out += &entry(label, &text, 0, 16, width).replace(GLUE, " ");
            }
        }
    }
    notes(found).iter().for_each(|note| out += &wrap(note, 0, width));
    out + "--all prints every integrator and a map of stable steps\n"
}

/// Integrators after the first, grouped by what limits them.
fn others(found: &StabilitySurvey) -> Vec<(&'static str, String)> {
    let others = found.limits.get(1..).unwrap_or_default();
    let largest = |limit: &MeasuredLimit| measured(limit).or(limit.predicted);
    let is_unsolved = |limit: &MeasuredLimit| limit.above == Some(AttemptStatus::Unsolved);
    let steps = |wanted: &dyn Fn(&MeasuredLimit) -> bool| -> Vec<String> {
        let chosen = others.iter().filter(|limit| limit.doubles_at.is_none() && wanted(limit));
        let mut steps: Vec<_> = chosen.filter_map(|limit| Some((largest(limit)?, limit))).collect();
        steps.sort_by(|a, b| b.0.total_cmp(&a.0));
        steps.iter().map(|(step, limit)| format!("{} {}", limit.integrator, Seconds(*step))).collect()
    };
    let names = |wanted: &dyn Fn(&MeasuredLimit) -> bool| -> Vec<String> {
        others.iter().filter(|limit| wanted(limit)).map(|limit| limit.integrator.clone()).collect()
    };
    let is_any = |limit: &MeasuredLimit| largest(limit).is_none();
    let ended = |limit: &MeasuredLimit| is_any(limit) && limit.above.is_none() && !limit.cut_short;
    let up_to = others.iter().filter(|limit| ended(limit)).map(|limit| limit.measured).fold(0.0, f64::max);
    let groups = [
        ("stable up to", steps(&|limit| !is_unsolved(limit)), String::new()),
        ("solved up to", steps(&is_unsolved), String::new()),
        ("any step", names(&ended), format!(", tried up to {}", Seconds(up_to))),
        ("not finished", names(&|limit| is_any(limit) && !ended(limit)), String::new()),
        ("no step", names(&|limit| limit.doubles_at.is_some()), ": energy grows at any".into()),
        ("not reached", found.not_reached.clone(), ": increase --budget".into()),
    ];
    let some = groups.into_iter().filter(|(_, names, _)| !names.is_empty());
    let glued = |names: Vec<String>| {
        let names: Vec<String> = names.iter().map(|name| name.replace(' ', GLUE)).collect();
        names.join(", ")
    };
    some.map(|(label, names, about)| (label, glued(names) + &about)).collect()
}

/// Notes that a reader of this scene needs.
fn notes(found: &StabilitySurvey) -> Vec<String> {
    let mut out = vec![];
    let surveyed = found.limits.iter().map(|limit| &limit.integrator).chain(&found.not_reached);
    if surveyed.into_iter().all(|name| name.as_str() != found.own_integrator) {
        out.push(format!("Not surveyed: {}, the integrator of the scene.", found.own_integrator));
    }
    if found.walls > 0 {
        out.push(ABOUT_WALLS.into());
    }
    if !found.refused.is_empty() {
        let names: Vec<&str> = found.refused.iter().map(|refused| refused.integrator.as_str()).collect();
        out.push(format!(
            "Omitted, since they do not support the contact of the scene: {}.",
            names.join(", ")
        ));
    }
    let early = found.map.as_ref().map_or(0, Map::failed_below_limit);
    if early > 0 {
        out.push(format!(
            "{} of the map failed below the predicted limit, which is linearised about the initial state: \
             the motion became large.",
            counted(early as u64, "step", "steps")
        ));
    }
    out
}

/// Predicted limit in the words of `pliant list`.
fn predicted_cell(limit: Option<f64>) -> String {
    match limit {
        None => "any".into(),
        Some(0.0) => "none".into(),
        Some(step) => Seconds(step).to_string(),
    }
}

fn measured_cell(limit: &MeasuredLimit) -> String {
    match measured(limit) {
        Some(step) => Seconds(step).to_string(),
        None if limit.measured > 0.0 => format!(">= {}", Seconds(limit.measured)),
        None if limit.cut_short => "not reached".into(),
        None => "none".into(),
    }
}

/// A row for each integrator.
fn limits(found: &StabilitySurvey) -> Vec<[String; 8]> {
    let row = |limit: &MeasuredLimit| {
        let ratio = limit.predicted.filter(|_| limit.doubles_at.is_none()).zip(measured(limit));
        let drift = found.drift_of(&limit.integrator);
        let ok = drift.filter(|drift| drift.status == AttemptStatus::Ok);
        [
            limit.integrator.clone(),
            predicted_cell(limit.predicted),
            measured_cell(limit),
            ratio.map_or_else(String::new, |(predicted, measured)| format!("{:.3}", measured / predicted)),
            limit.above.map_or("", AttemptStatus::name).into(),
            drift.map_or_else(String::new, |drift| Seconds(drift.step).to_string()),
            match (ok, drift) {
                (Some(ok), _) => number(ok.per_second),
                (None, drift) => drift.map_or("", |drift| drift.status.name()).into(),
            },
            ok.map_or_else(String::new, |ok| number(ok.amplitude)),
        ]
    };
    found.limits.iter().map(row).collect()
}

/// Everything in rows, after the answer.
pub(super) fn full(found: &StabilitySurvey, width: usize) -> String {
    let mut rows = vec![HEADER.map(str::to_owned).to_vec()];
    rows.extend(limits(found).into_iter().map(Vec::from));
    let mut out = format!("\n{}\n{}", table(&rows, 0), wrap(ABOUT, 0, width));
    if let Some(map) = &found.map {
        out.push('\n');
        out += &text_map(map);
    }
    out.push('\n');
    for remark in remarks(found).into_iter().chain(notes(found)) {
        out += &wrap(&remark, 0, width);
    }
    out + &wrap(&agreement(found), 0, width)
}

/// Details of single integrators.
fn remarks(found: &StabilitySurvey) -> Vec<String> {
    let doubles = found.limits.iter().filter_map(|limit| {
        Some(format!(
            "{}: none, it gains energy at any step; at {} its highest mode would double by the end.",
            limit.integrator,
            Seconds(limit.doubles_at?)
        ))
    });
    let refused =
        found.refused.iter().map(|RefusedScheme { integrator, reason }| format!("{integrator}: {reason}."));
    let names = found.not_reached.join(", ");
    let late = (!names.is_empty()).then(|| format!("Not reached within the time budget: {names}."));
    doubles.chain(refused).chain(late).collect()
}

fn agreement(found: &StabilitySurvey) -> String {
    let apart = found.amplification.iter().flat_map(|curve| {
        curve.measured.iter().zip(&curve.formula).map(|(measured, formula)| (measured / formula - 1.0).abs())
    });
    let apart = apart.fold(0.0, f64::max);
    format!("amplification of an oscillator: measured and formula agree to {}", percent(apart))
}

fn row_name(map: &Map, row: usize) -> String {
    let value = map.values[row];
    let factor =
        if value < 1.0 { format!("/ {}", number(1.0 / value)) } else { format!("x {}", number(value)) };
    match map.against {
        Against::Young => format!("stiffness {factor}"),
        Against::Poisson => format!("nu = {value}"),
        Against::Density => format!("density {factor}"),
        Against::Gravity => format!("gravity {factor}"),
    }
}

/// Map with `.` for a step that was taken, `x` for one that diverged, `!` for one that was not solved.
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
        rows.push(vec![row_name(map, row), line, predicted_cell(map.predicted[row])]);
    }
    let (first, last) = (map.steps.first().copied().unwrap_or(0.0), map.steps.last().copied().unwrap_or(0.0));
    rows.insert(
        0,
        vec![String::new(), format!("{} to {}", Seconds(first), Seconds(last)), "predicted".into()],
    );
    format!("{}: . stable, x diverged, ! Newton failed\n{}", map.integrator, table(&rows, 0))
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
        "cut_short",
    ]);
    for limit in &found.limits {
        let drift = found.drift_of(&limit.integrator);
        csv += &csv_line(&[
            &limit.integrator,
            &limit.predicted.map_or_else(String::new, n),
            &n(limit.measured),
            limit.above.map_or("", AttemptStatus::name),
            &drift.map_or_else(String::new, |drift| n(drift.step)),
            drift.map_or("", |drift| drift.status.name()),
            &drift.map_or_else(String::new, |drift| n(drift.per_second)),
            &drift.map_or_else(String::new, |drift| n(drift.amplitude)),
            &limit.doubles_at.map_or_else(String::new, n),
            if limit.cut_short { "true" } else { "false" },
        ]);
    }
    output::file(&folder.join("stability.csv"), &csv)?;
    output::file(&folder.join("stability.json"), &format!("{document:#}\n"))?;
    let amplification = amplification(found)?;
    output::file(&folder.join("amplification.svg"), &amplification)?;
    let mut page = Page::new(&format!("Largest stable step: {scene}"));
    page.paragraph(&format!("{}; {}.", verdict(found), basis(found)));
    let cells = |row: [String; 8]| row.iter().map(|cell| TableCell::new(cell, Look::Number)).collect();
    let header = HEADER.map(|name| (if name.is_empty() { "integrator" } else { name }, Look::Number));
    page.table(&header, &limits(found).into_iter().map(cells).collect::<Vec<_>>());
    page.note(ABOUT);
    page.list(remarks(found).iter().chain(&notes(found)).map(String::as_str));
    if let Some(map) = &found.map {
        output::file(&folder.join("map.csv"), &map_csv(map))?;
        let svg = heat_map(map)?;
        output::file(&folder.join("map.svg"), &svg)?;
        page.figure(
            &svg,
            "Stable steps of the first integrator, row by row. \"limit\" is the last step below the \
             predicted limit, which is linearised about the initial state; \"early\" is a failure below it, \
             where the motion became large.",
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
        let label = match () {
            () if map.fails_early(row, column) => "early",
            () if limit => "limit",
            () => "",
        };
        Some((at, label.to_owned()))
    };
    let early =
        if map.failed_below_limit() > 0 { "; \"early\": failed below it, in large motion" } else { "" };
    let order: Vec<usize> = (0..map.values.len()).rev().collect();
    let what = match map.against {
        Against::Young => "times the stiffness",
        Against::Poisson => "Poisson's ratio",
        Against::Density => "times the density of the first body",
        Against::Gravity => "times the mutual gravity",
    };
    let names = ["stable", "diverged", "Newton failed"];
    let colors = [(0x9b, 0xd4, 0xb5), (0xd5, 0x5e, 0x00), (0xe6, 0x9f, 0x00)];
    let svg = HeatMap {
        title: format!("{}: stable steps", map.integrator),
        x: format!("step [s]; \"limit\": the last one below the predicted limit{early}"),
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

#[cfg(test)]
mod tests {
    use super::*;
    use pliant::integrator::IntegratorSpec;
    use pliant_lab::stability::Drift;

    /// A survey of all integrators, of which every third has a limit, every third none, every third fails
    /// in Newton's method.
    fn survey(own_step: f64) -> StabilitySurvey {
        let mut found = StabilitySurvey {
            own_integrator: "symplectic-euler",
            own_step: Some(own_step),
            walls: 1,
            not_reached: vec!["radau-iia3".into()],
            complete: true,
            ..StabilitySurvey::default()
        };
        for (i, spec) in IntegratorSpec::ALL.iter().enumerate() {
            let integrator = spec.method().documentation.name.to_owned();
            let (predicted, above) = match i % 3 {
                0 => (Some(4.34e-4), Some(AttemptStatus::Diverged)),
                1 => (None, Some(AttemptStatus::Unsolved)),
                _ => (None, None),
            };
            let (status, per_second, amplitude) = (AttemptStatus::Ok, -4.1e-7, 3.5e-5);
            found.drifts.push(Drift {
                integrator: integrator.clone(),
                step: 1.67e-4,
                status,
                per_second,
                amplitude,
            });
            found.limits.push(MeasuredLimit {
                integrator,
                predicted,
                doubles_at: None,
                measured: 4.336e-4,
                above,
                trials: 12,
                cut_short: false,
            });
        }
        found
    }

    fn map() -> Map {
        Map {
            integrator: "symplectic-euler".into(),
            against: Against::Young,
            steps: vec![1e-4, 4e-4, 1e-3],
            values: (-4..=4).map(|e| 10f64.powi(e)).collect(),
            predicted: vec![Some(4.34e-4); 9],
            status: vec![vec![AttemptStatus::Ok, AttemptStatus::Diverged, AttemptStatus::Diverged]; 9],
        }
    }

    #[test]
    fn an_answer_fits_a_terminal_with_the_verdict_first() {
        let found = survey(1.67e-4);
        let with_map = StabilitySurvey { map: Some(map()), ..survey(1.67e-4) };
        for found in [&found, &with_map] {
            let said = answer(found, 200) + &brief(found, 200);
            assert!(
                said.starts_with("your step, 167 us, is 38.5 % of the largest stable one, 434 us ("),
                "{said}"
            );
            assert!(
                said.lines().count() <= 24 && said.lines().all(|line| line.len() <= ANSWER_WIDTH),
                "{said}"
            );
            for word in ["NaN", "inf", "e-4", "e-5", "e-7"] {
                assert!(!said.contains(word), "{word} in\n{said}");
            }
        }
        assert!(brief(&found, 80).contains("not reached     radau-iia3"));
        assert!(full(&found, 80).contains("Not reached within the time budget: radau-iia3."));
    }

    // Failures below the limit have a label of their own and a note; without them neither is there.
    #[test]
    fn a_failure_below_the_limit_is_not_labelled_as_the_limit() {
        let early = map();
        let svg = heat_map(&early).unwrap();
        assert!(
            svg.contains("\nearly\n") && !svg.contains("\nlimit\n") && svg.contains("failed below it"),
            "{svg}"
        );
        let found = StabilitySurvey { map: Some(early.clone()), ..survey(1e-4) };
        assert!(notes(&found).iter().any(|note| note.starts_with("9 steps of the map failed below")));
        let usual = Map { predicted: vec![Some(2e-4); 9], ..early };
        let svg = heat_map(&usual).unwrap();
        assert!(svg.contains("\nlimit\n") && !svg.contains("early"), "{svg}");
    }

    #[test]
    fn every_end_of_a_search_has_a_verdict() {
        let of = |change: &dyn Fn(&mut MeasuredLimit)| {
            let mut found = survey(1e-3);
            change(&mut found.limits[0]);
            verdict(&found)
        };
        let any = |limit: &mut MeasuredLimit| limit.predicted = None;
        assert!(of(&|_| {}).starts_with("your step, 1 ms, is 2.31 times the largest stable one, 434 us"));
        assert!(of(&|limit| limit.doubles_at = Some(1e-6)).ends_with("your step, 1 ms, is 1000 times that"));
        // An implicit integrator: no failure, a failure of every step, nothing tried to the end.
        let stable = of(&|limit| {
            any(limit);
            (limit.above, limit.measured) = (None, 2.0);
        });
        assert!(
            stable.starts_with("your step, 1 ms, is stable, and so are larger ones up to 2 s ("),
            "{stable}"
        );
        let failed = of(&|limit| {
            any(limit);
            limit.measured = 0.0;
        });
        assert!(failed.starts_with("your step, 1 ms, fails ("), "{failed}");
        let cut = of(&|limit| {
            any(limit);
            (limit.above, limit.measured, limit.cut_short) = (None, 0.0, true);
        });
        assert!(cut.contains("no trial ended within the time budget"), "{cut}");
        let only = of(&|limit| {
            any(limit);
            (limit.above, limit.measured, limit.cut_short) = (None, 1e-3, true);
        });
        assert!(only.contains("is stable (") && only.contains("no trial of a larger one ended"), "{only}");
        let unsolved = of(&|limit| limit.above = Some(AttemptStatus::Unsolved));
        assert!(unsolved.contains("the largest solvable one"), "{unsolved}");
        assert!(verdict(&StabilitySurvey::default()).contains("--budget"));
    }
}
