//! `pliant stability`: how large a step a scene can take.

mod report;

use pliant_lab::stability::{Against, StabilitySurvey, SurveyError, SurveyOptions};
use serde_json::{Value, json};

use crate::arguments::{AgainstArgument, StabilityArguments};
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::output;
use crate::progress::spinner;
use crate::terminal::Terminal;

pub(crate) fn execute(arguments: &StabilityArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let input = Input::read(&arguments.scene, &arguments.set, None)?;
    if let Some(folder) = &arguments.output {
        output::folder(folder)?;
    }
    let against = arguments.against.map(|against| match against {
        AgainstArgument::Young => Against::Young,
        AgainstArgument::Poisson => Against::Poisson,
        AgainstArgument::Density => Against::Density,
        AgainstArgument::Gravity => Against::Gravity,
    });
    let is_brief = terminal.is_read() && !arguments.all;
    let choice = SurveyOptions {
        integrators: arguments.integrators.clone(),
        against,
        quick: arguments.quick,
        // A map that nobody asked for and nobody sees is not worth its time.
        without_map: is_brief && against.is_none() && arguments.output.is_none() && !terminal.json,
        budget: Some(arguments.budget),
    };
    // The answer stands before the search goes on with other integrators.
    let (bar, mut answered) = (spinner(terminal), Ok(()));
    let answer = |found: &StabilitySurvey| match &bar {
        Some(bar) => bar.suspend(|| terminal.report(&report::answer(found, terminal.width()))),
        None => terminal.report(&report::answer(found, terminal.width())),
    };
    let found = StabilitySurvey::of(&input.source, &choice, interrupt::flag()?, &mut |found| {
        if found.limits.len() + found.not_reached.len() == 1 {
            answered = answer(found);
        }
        let Some(limit) = found.limits.last() else { return };
        match &bar {
            Some(bar) if terminal.verbose => bar.println(report::progress(limit)),
            Some(bar) => bar.set_message(format!("{} done", limit.integrator)),
            None if terminal.verbose => terminal.note(&report::progress(limit)),
            None => {}
        }
    });
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    answered?;
    let found = found.map_err(|error| match error {
        SurveyError::Scene(error) => Failure::from(error),
        error => Failure::usage(error.to_string()),
    })?;
    let status = if found.complete { ExitStatus::Done } else { ExitStatus::Interrupted };
    let document = document(&found, status, input.source.name());
    let rest = if is_brief {
        report::brief(&found, terminal.width())
    } else {
        report::full(&found, terminal.width())
    };
    terminal.report(&rest)?;
    if let Some(folder) = &arguments.output {
        report::write(folder, input.source.name(), &found, &document)?;
        terminal.note(&format!("wrote stability.html, its charts and tables to {}", folder.display()));
    }
    terminal.document(&document)?;
    if !found.complete {
        terminal.complain("interrupted: this is what was found so far");
    }
    Ok(status)
}

fn document(found: &StabilitySurvey, status: ExitStatus, scene: &str) -> Value {
    let mut document = json!({ "status": status, "scene": scene });
    if let (Some(document), Value::Object(found)) = (document.as_object_mut(), json!(found)) {
        document.extend(found);
    }
    document
}
