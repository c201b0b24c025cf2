//! `pliant stability`: how large a step a scene can take.

mod report;

use pliant_lab::stability::{Against, StabilitySurvey, SurveyError, SurveyOptions};
use serde_json::{Value, json};

use crate::arguments::{AgainstArgument, StabilityArguments};
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::output;
use crate::terminal::Terminal;
use crate::text::number;

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
    let choice =
        SurveyOptions { integrators: arguments.integrators.clone(), against, quick: arguments.quick };
    let found = StabilitySurvey::of(&input.source, &choice, interrupt::flag()?, &mut |limit, _| {
        if terminal.verbose {
            let Some(above) = limit.above else { return };
            terminal.note(&format!(
                "{}: {} above {} s",
                limit.integrator,
                above.name(),
                number(limit.measured)
            ));
        }
    });
    let found = found.map_err(|error| match error {
        SurveyError::Scene(error) => Failure::from(error),
        error => Failure::usage(error.to_string()),
    })?;
    let status = if found.complete { ExitStatus::Done } else { ExitStatus::Interrupted };
    let document = document(&found, status, input.source.name());
    terminal.report(&report::describe(&found, terminal.width()))?;
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
