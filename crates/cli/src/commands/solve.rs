//! `pliant solve`: mesh, elements, scheme and step for an accuracy that is wished for, with the proof.

use pliant::quantity::Seconds;
use pliant_lab::accuracy::{AccuracyError, AccuracySearch, AccurateRun, WishedError};
use pliant_lab::quantity::{NoQuantity, QuantityOfInterest};
use pliant_lab::refinement::StudiedSceneError;
use serde_json::json;

use super::run::errors::of_quantity;
use crate::arguments::SolveArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::printable;
use crate::progress::announced;
use crate::terminal::Terminal;
use crate::text::{counted, number, wrap};

/// Default wall time [s].
const BUDGET: f64 = 300.0;

pub(crate) fn execute(arguments: &SolveArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let interrupted = interrupt::flag()?;
    let input = Input::read(&arguments.scene, &arguments.set, None)?;
    let given = input.scene.accuracy.as_ref();
    let (of, error) = match (&arguments.of, &arguments.accuracy, given) {
        (Some(of), Some(error), _) => (of, error),
        (_, _, Some(given)) => (&given.of, &given.error),
        _ => {
            return Err(Failure::usage(
                "what accuracy? Say --accuracy \"1 %\" --of tip.y, or put [accuracy] into the scene",
            ));
        }
    };
    let usage = |error: String| Failure::usage(error);
    let quantity: QuantityOfInterest = of.parse().map_err(|error: NoQuantity| usage(error.to_string()))?;
    let wish = WishedError::parse(error, &quantity).map_err(|error| usage(error.to_string()))?;
    let budget = arguments.budget.or(given.and_then(|given| given.budget)).unwrap_or(BUDGET);
    let search =
        AccuracySearch { source: &input.source, quantity: &quantity, wish, budget, interrupt: interrupted };
    let found = announced(terminal, |watch| search.run(watch));
    let found = found.map_err(|error| match error {
        AccuracyError::Scene(StudiedSceneError::Scene(error)) => error.into(),
        AccuracyError::NotReached(_) | AccuracyError::Interrupted => {
            Failure::failed("accuracy", error.to_string())
        }
        error => Failure::usage(error.to_string()),
    })?;
    let scene = printable::plain(&arguments.scene.to_string_lossy()).into_owned();
    terminal.report(&described(&found, &scene, terminal.width()))?;
    let mut document = json!(found);
    document["status"] = json!(ExitStatus::Done);
    terminal.document(&document)?;
    Ok(ExitStatus::Done)
}

/// The run that was found, and its proof.
fn described(found: &AccurateRun, scene: &str, width: usize) -> String {
    let AccurateRun { elements, cells, scheme, step, wish, proof, .. } = found;
    let step = step.map_or_else(String::new, |step| format!(" with steps of {}", Seconds(step)));
    let chosen = format!("{elements} on {cells} cells, {scheme}{step}: {}", Seconds(found.seconds));
    let mut out = wrap(&chosen, 0, width) + &of_quantity(proof, width);
    out += &wrap(
        &format!(
            "The wish, {} {}, is kept. {} took {}.",
            number(*wish),
            proof.unit,
            counted(found.runs as u64, "run", "runs"),
            Seconds(found.search_seconds)
        ),
        0,
        width,
    );
    out += &format!("\npliant run {scene}");
    let (set, without): (Vec<_>, Vec<_>) = found.keys.iter().partition(|key| key.value.is_some());
    for key in set {
        out += &format!(" \\\n  {key}");
    }
    out.push('\n');
    for key in without {
        out += &format!("and the scene {key}\n");
    }
    out
}
