//! `pliant run --errors`: the errors of a run by mesh, step and solver.

use std::sync::atomic::AtomicBool;

use pliant::quantity::Seconds;
use pliant_lab::budget::{BudgetError, BudgetEvent, ErrorBudget, ErrorPart, QuantityBudget, error_budget};
use pliant_lab::quantity::{NoQuantity, QuantityOfInterest};
use pliant_scene::Source;
use pliant_scene::assembly::Assembly;

use crate::failure::Failure;
use crate::terminal::Terminal;
use crate::text::{counted, number, rounded_to, wrap};

/// Time of the runs for the errors that is not announced [s].
const SILENT: f64 = 1.0;

/// The quantities that `--errors` names; none for those of all probes.
///
/// # Errors
/// A name is none of a quantity of the scene; it has no probe, and nothing is named.
pub(super) fn quantities(names: &[String], assembly: &Assembly) -> Result<Vec<QuantityOfInterest>, Failure> {
    let usage = |error: String| Failure::usage(format!("--errors: {error}"));
    let parse = |name: &String| {
        let quantity: QuantityOfInterest =
            name.parse().map_err(|error: NoQuantity| usage(error.to_string()))?;
        match quantity.is_of(assembly) {
            true => Ok(quantity),
            false => Err(usage(BudgetError::Missing(quantity.to_string()).to_string())),
        }
    };
    let named: Vec<_> = names.iter().filter(|name| !name.is_empty()).map(parse).collect::<Result<_, _>>()?;
    if named.is_empty() && assembly.probes.is_empty() {
        return Err(usage(BudgetError::NoQuantity.to_string()));
    }
    Ok(named)
}

/// Makes the runs beside a run.
///
/// # Errors
/// Those of [`error_budget`].
pub(super) fn estimated(
    source: &Source,
    quantities: &[QuantityOfInterest],
    interrupt: &AtomicBool,
    terminal: Terminal,
) -> Result<ErrorBudget, Failure> {
    let mut begun = |event| match event {
        BudgetEvent::Planned { runs, seconds: expected } if expected > SILENT => {
            let runs = counted(runs as u64, "run", "runs");
            terminal.note(&format!("errors: {runs} more, about {}", Seconds(expected)));
        }
        BudgetEvent::Begun(run) if terminal.verbose => {
            terminal.note(&format!("run {run} for the errors"));
        }
        _ => {}
    };
    error_budget(source, quantities, interrupt, &mut begun).map_err(|error| match error {
        BudgetError::Scene(error) => error.into(),
        BudgetError::Refused(_) => Failure::usage(format!("--errors: {error}")),
        error => Failure::failed("errors", error.to_string()),
    })
}

/// The budget in words.
pub(super) fn described(budget: &ErrorBudget, width: usize) -> String {
    let mut out = String::new();
    for quantity in &budget.quantities {
        out += &of_quantity(quantity, width);
    }
    let runs = counted(budget.runs as u64, "run", "runs");
    let mut end = format!("{runs} in addition to yours, {} of its time", number(budget.cost));
    if let Some(advice) = advice(budget) {
        end += &format!("; {advice}");
    }
    out + &wrap(&end, 0, width)
}

pub(crate) fn of_quantity(of: &QuantityBudget, width: usize) -> String {
    let QuantityBudget { quantity, unit, value, interval, extrapolated, .. } = of;
    let mut out = match (interval, extrapolated) {
        (Some(interval), Some(extrapolated)) => format!(
            "{quantity}  {} {unit}  +- {} {unit}{}  extrapolated {} {unit}\n",
            rounded_to(*value, *interval),
            number(*interval),
            percent(*interval, *value),
            rounded_to(*extrapolated, *interval)
        ),
        _ => format!("{quantity}  {} {unit}  no estimate of the whole error\n", number(*value)),
    };
    for part in &of.parts {
        out += &wrap(&format!("{:6} {}", part.part, of_part(part, unit, *value)), 9, width);
    }
    out
}

fn of_part(part: &ErrorPart, unit: &str, value: f64) -> String {
    let Some(estimate) = &part.estimate else { return format!("no estimate: {}", part.about) };
    let order = match part.expected_order {
        Some(expected) if estimate.order.is_finite() => {
            format!(", order {:.1} of {}", estimate.order, number(expected))
        }
        _ => String::new(),
    };
    let size = match estimate.estimate {
        _ if estimate.interval == 0.0 => return part.about.clone(),
        Some(error) if error != 0.0 => {
            format!("{} {unit}{} +- {}", number(error), percent(error, value), number(estimate.interval))
        }
        _ => format!("within {} {unit}{}", number(estimate.interval), percent(estimate.interval, value)),
    };
    format!("{size}{order}: {}", part.about)
}

/// A part of a value, in brackets; nothing if the value is zero.
fn percent(part: f64, value: f64) -> String {
    match 100.0 * part.abs() / value.abs() {
        _ if value == 0.0 => String::new(),
        small if small < 0.01 => " (below 0.01 %)".into(),
        percent => format!(" ({percent:.2} %)"),
    }
}

/// Advice by the part that limits most quantities.
fn advice(budget: &ErrorBudget) -> Option<&'static str> {
    let interval = |of: &QuantityBudget, part: &str| -> Option<f64> {
        let found = of.parts.iter().find(|own| own.part == part)?;
        Some(found.estimate.as_ref()?.interval)
    };
    let ratios = budget.quantities.iter().filter_map(|of| {
        let (mesh, step) = (interval(of, "mesh")?, interval(of, "step")?);
        Some((mesh, step))
    });
    let (by_mesh, by_step): (Vec<_>, Vec<_>) = ratios.partition(|(mesh, step)| mesh > step);
    match (by_mesh.len(), by_step.len()) {
        (0, 0) => None,
        (mesh, step) if mesh >= step => {
            Some("the mesh limits the accuracy: use more cells or `order = 2` before smaller steps")
        }
        _ => Some("the step limits the accuracy: use a smaller one, or an integrator of higher order"),
    }
}
