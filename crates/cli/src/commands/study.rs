//! `pliant study`: error against run time, by many schemes and steps.

mod files;
mod progress;
mod refine;

use std::path::Path;

use pliant_lab::study::report::{FigureKind, StudyReport};
use pliant_lab::study::{
    ABOUT_ERRORS, Provenance, ReferenceChoice, Results, Study, StudyError, StudyPlan, WallClock, words,
};
use pliant_scene::Source;
use pliant_scene::vary::VariedKey;
use serde_json::{Value, json};

use crate::arguments::{ReferenceFrom, StudyArguments};
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::terminal::Terminal;
use crate::text::{table, wrap};

use files::Files;
use progress::StudyProgress;

pub(crate) fn execute(arguments: &StudyArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let interrupted = interrupt::flag()?;
    if cfg!(debug_assertions) {
        terminal.warn("this is a debug build, which is slower: for times that count, build with --release");
    }
    let changes = changes(arguments)?;
    // Every scene is read before the first is studied.
    let inputs = arguments.scenes.iter().map(|scene| Input::read(scene, &changes, None));
    let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
    let files = Files::new(arguments)?;
    if arguments.refine.is_some() {
        return refine::execute(arguments, &inputs, &files, terminal);
    }
    let provenance = provenance();
    let clock = WallClock::default();
    let mut studies = vec![];
    for input in &inputs {
        let plan = plan(arguments, input, inputs.len())?;
        let name = name(input.source.name());
        let mut progress = StudyProgress::new(&name, terminal);
        let study = Study {
            source: &input.source,
            name: &name,
            plan: &plan,
            folder: Some(files.folder()),
            provenance: &provenance,
            clock: &clock,
            interrupt: interrupted,
        };
        let made = study.run(&mut |event| progress.show(&event));
        progress.clear();
        match made {
            Ok(results) => {
                let complete = results.complete;
                studies.push(results);
                if !complete {
                    break;
                }
            }
            Err(StudyError::Interrupted) => break,
            Err(error) => return Err(failure(error, &input.source)),
        }
    }
    let title = arguments.title.clone().unwrap_or_else(|| match &studies[..] {
        [study] => format!("Error against run time: {}", study.title),
        _ => "Error against run time".to_owned(),
    });
    let kinds =
        if arguments.brief { vec![FigureKind::Time, FigureKind::Step] } else { FigureKind::ALL.to_vec() };
    let report = StudyReport::new(&title, &studies, &kinds)
        .map_err(|error| Failure::failed("report", error.to_string()))?;
    let written = files.write(&report, &studies, &study_document(&studies))?;
    for study in &studies {
        terminal.report(&describe(study, terminal.width()))?;
        if let Some(noise) = study.noise() {
            terminal.warn(&format!("{}: {noise}", study.name));
        }
    }
    terminal.report(&written)?;
    let complete = studies.len() == inputs.len() && studies.iter().all(|study| study.complete);
    let status = if complete { ExitStatus::Done } else { ExitStatus::Interrupted };
    let mut whole = study_document(&studies);
    whole["status"] = json!(status);
    whole["folder"] = json!(files.folder().display().to_string());
    terminal.document(&whole)?;
    if !complete {
        terminal.complain("interrupted: the same command goes on from here");
    }
    Ok(status)
}

/// Build of this program, and the machine.
pub fn provenance() -> Provenance {
    Provenance::here(env!("PLIANT_COMMIT"), env!("PLIANT_RUSTC"), env!("PLIANT_FLAGS"))
}

/// Options of the command line, as changes of the scene's own `[study]`.
fn changes(arguments: &StudyArguments) -> Result<Vec<String>, Failure> {
    let mut changes = arguments.set.clone();
    let list = |key: &str, text: &str| -> Result<String, Failure> {
        let axis: VariedKey = format!("study.{key}={text}")
            .parse()
            .map_err(|_| Failure::usage(format!("`{text}` is no list of {key}: separate them by commas")))?;
        let quoted = axis.values.iter().map(|value| {
            match value.starts_with(['{', '"', '\'']) || value.parse::<f64>().is_ok() {
                true => value.clone(),
                false => format!("{value:?}"),
            }
        });
        Ok(format!("study.{key}=[{}]", quoted.collect::<Vec<_>>().join(", ")))
    };
    for (key, text) in [
        ("integrators", &arguments.integrators),
        ("steps", &arguments.steps),
        ("tolerances", &arguments.tolerances),
        ("elements", &arguments.elements),
    ] {
        if let Some(text) = text {
            changes.push(list(key, text)?);
        }
    }
    if !arguments.vary.is_empty() {
        let axes: Vec<String> = arguments.vary.iter().map(|axis| format!("{axis:?}")).collect();
        changes.push(format!("study.vary=[{}]", axes.join(", ")));
    }
    if !arguments.of.is_empty() {
        let names: Vec<String> = arguments.of.iter().map(|name| format!("{name:?}")).collect();
        changes.push(format!("study.of=[{}]", names.join(", ")));
    }
    changes.extend(arguments.refine.filter(|n| *n > 0).map(|n| format!("study.refine={n}")));
    changes.extend(arguments.times.map(|times| format!("study.times={times}")));
    changes.extend(arguments.error.map(|error| format!("study.error={error:?}")));
    Ok(changes)
}

fn plan(arguments: &StudyArguments, input: &Input, studies: usize) -> Result<StudyPlan, Failure> {
    let plan = StudyPlan::of(&input.scene).map_err(|problems| Failure::from(input.locate(problems)))?;
    let reference = match arguments.reference {
        ReferenceFrom::Auto => ReferenceChoice::Auto,
        ReferenceFrom::Exact => ReferenceChoice::Exact,
        ReferenceFrom::Computed => ReferenceChoice::Computed,
    };
    let budget = arguments.budget.map(|budget| budget / studies as f64).or(plan.budget);
    let repeats = arguments.repeats.map(|n| usize::from(n.get()));
    let threads = arguments.threads.map_or(1, |n| usize::from(n.get()));
    Ok(StudyPlan { reference, budget, repeats, threads, ..plan })
}

/// The name of a file without its folder and ending.
fn name(path: &str) -> String {
    Path::new(path).file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned())
}

fn failure(error: StudyError, source: &Source) -> Failure {
    match error {
        StudyError::Scene(problems) => source.error(problems).into(),
        StudyError::Variant(error) => error.into(),
        StudyError::NoDuration | StudyError::NotExact | StudyError::Static => {
            Failure::usage(error.to_string())
        }
        error => Failure::failed("study", error.to_string()),
    }
}

/// The tables for people.
fn describe(study: &Results, width: usize) -> String {
    let mut out = format!("{}\n\n{}", study.title, wrap(ABOUT_ERRORS, 0, width));
    for variant in &study.variants {
        if !variant.variant.is_empty() {
            out += &format!("\nwith {}\n", variant.variant);
        }
        out += &format!(
            "reference: {}; its error is about {:.0e}\n\n",
            variant.reference.how, variant.reference.error
        );
        let mut rows = vec![
            ["scheme", "step [s]", "error", "order", "energy", "forces", "Newton", "time [s]", ""]
                .map(str::to_owned)
                .to_vec(),
        ];
        for row in variant.rows() {
            let short = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.2e}"));
            let mark = match (row.status, row.dropped) {
                (pliant_lab::study::RowStatus::Ok, false) => String::new(),
                (pliant_lab::study::RowStatus::Ok, true) => "dropped".into(),
                (status, _) => status.words().into(),
            };
            rows.push(vec![
                row.integrator.clone(),
                format!("{:.4e}", row.dt),
                short(row.err_q_rms),
                row.obs_order.map_or_else(|| "-".into(), |order| format!("{order:.2}")),
                short(row.err_energy_max),
                row.n_force.to_string(),
                row.n_newton.to_string(),
                format!("{:.2e}", row.wall_min_s),
                mark,
            ]);
        }
        out += &table(&rows, 0);
        out.push('\n');
        for line in words(variant.rows(), &variant.reference) {
            out += &format!("{line}\n");
        }
    }
    for refused in &study.refused {
        out += &format!("omitted: {}: {}\n", refused.integrator, refused.reason);
    }
    for advice in study.recommendations() {
        let of =
            if advice.problem.is_empty() { String::new() } else { format!("with {}:\n", advice.problem) };
        out += &format!("\n{of}{}", advice.settings);
    }
    out
}

/// Everything but the states of references, for programs.
pub fn study_document(studies: &[Results]) -> Value {
    let studies: Vec<Value> = studies
        .iter()
        .map(|study| {
            let variants: Vec<Value> = study
                .variants
                .iter()
                .map(|variant| {
                    let reference = &variant.reference;
                    json!({
                        "variant": variant.variant,
                        "reference": { "id": reference.id, "how": reference.how, "error": reference.error,
                            "disagreement": reference.disagreement },
                        "lines": variant.lines,
                        "rows": variant.records,
                        "front": pliant_lab::study::front(variant.rows()).iter().map(|row| json!({
                            "integrator": row.integrator,
                            "dt": row.dt,
                            "error": row.err_q_rms,
                            "wall_min_s": row.wall_min_s,
                        })).collect::<Vec<_>>(),
                    })
                })
                .collect();
            json!({
                "name": study.name,
                "title": study.title,
                "provenance": study.provenance,
                "complete": study.complete,
                "refused": study.refused,
                "variants": variants,
                "recommendations": study.recommendations(),
                "noise": study.noise(),
            })
        })
        .collect();
    json!({ "studies": studies })
}
