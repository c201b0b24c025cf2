//! `pliant stability`: how large a step a scene can take.

mod report;

use std::sync::atomic::Ordering;

use pliant::integrator::{IntegratorSpec, Scheme};
use pliant::stability::{
    Against, AmplificationCurve, Drift, Map, MeasuredLimit, amplification_curve, energy_drift, map,
    measure_limit, nominal_step,
};
use serde_json::json;

use crate::arguments::{AgainstArgument, StabilityArguments};
use crate::failure::{Failure, Status};
use crate::input::Input;
use crate::interrupt;
use crate::output;
use crate::terminal::Terminal;

/// Steps of the run whose drift is measured, at most.
const DRIFT_STEPS: f64 = 2000.0;

/// All that was found.
struct Found {
    limits: Vec<MeasuredLimit>,
    drifts: Vec<Drift>,
    amplification: Vec<AmplificationCurve>,
    map: Option<Map>,
}

pub(crate) fn execute(arguments: &StabilityArguments, terminal: Terminal) -> Result<Status, Failure> {
    let input = Input::read(&arguments.scene, &arguments.set, None)?;
    let scene = &input.scene;
    let integrators = integrators(&arguments.integrators, scene.time.integrator)?;
    if let Some(folder) = &arguments.output {
        output::folder(folder)?;
    }
    let against = match arguments.against {
        AgainstArgument::Young => Against::Young,
        AgainstArgument::Poisson => Against::Poisson,
        AgainstArgument::Density => Against::Density,
    };
    let interrupted = interrupt::flag()?;
    let stopped = || interrupted.load(Ordering::Relaxed);
    let own = nominal_step(scene);
    let largest = scene.time.duration.max(100.0 * own);
    let mut found = Found { limits: vec![], drifts: vec![], amplification: vec![], map: None };
    for integrator in &integrators {
        if stopped() {
            break;
        }
        let name = integrator.method().documentation.name;
        if terminal.verbose {
            terminal.note(&format!("looking for the largest step of {name}"));
        }
        let limit = measure_limit(scene, *integrator, largest)?;
        // A step that it can take, the scene's own if that is one.
        let step = if limit.measured > 0.0 { own.min(0.5 * limit.measured) } else { own };
        let duration = scene.time.duration.min(DRIFT_STEPS * step);
        found.drifts.push(energy_drift(scene, *integrator, step, duration)?);
        found.limits.push(limit);
        let z: Vec<f64> = (0..=60).map(|i| 10f64.powf(-2.0 + f64::from(i) / 12.0)).collect();
        found.amplification.extend(amplification_curve(*integrator, &z));
    }
    if let Some(limit) = found.limits.first().filter(|_| !stopped()) {
        let around = if limit.measured > 0.0 && limit.above.is_some() { 0.9 * limit.measured } else { own };
        found.map = Some(map(&input.source, integrators[0], against, around, arguments.quick)?);
    }
    let status = if stopped() { Status::Interrupted } else { Status::Done };
    let document = json!({
        "status": status,
        "scene": input.source.name(),
        "limits": found.limits,
        "energy_drift": found.drifts,
        "map": found.map,
        "amplification": found.amplification,
    });
    terminal.report(&report::describe(&found, terminal.width()))?;
    if let Some(folder) = &arguments.output {
        report::write(folder, input.source.name(), &found, &document)?;
        terminal.note(&format!("wrote stability.html, its charts and tables to {}", folder.display()));
    }
    terminal.document(&document)?;
    if stopped() {
        terminal.complain("interrupted: this is what was found so far");
    }
    Ok(status)
}

/// The schemes of these names; all that move things, the scene's own first, without names.
fn integrators(names: &[String], own: IntegratorSpec) -> Result<Vec<IntegratorSpec>, Failure> {
    let name = |spec: &IntegratorSpec| spec.method().documentation.name;
    let moves =
        |spec: &&IntegratorSpec| !matches!(spec.method().scheme, Scheme::QuasiStatic | Scheme::GaussRadau(_));
    let all: Vec<IntegratorSpec> = IntegratorSpec::ALL.iter().filter(moves).copied().collect();
    // With the parameters that the scene gives it.
    let as_written = |spec: &IntegratorSpec| if name(spec) == name(&own) { own } else { *spec };
    if names.is_empty() {
        let others = all.iter().filter(|spec| name(spec) != name(&own)).copied();
        return Ok(Some(own).filter(|own| moves(&own)).into_iter().chain(others).collect());
    }
    let known: Vec<&str> = all.iter().map(name).collect();
    let find = |wanted: &String| {
        let found = all.iter().find(|spec| name(spec) == wanted.as_str()).map(as_written);
        found.ok_or_else(|| {
            Failure::usage(format!(
                "there is no integrator `{wanted}` that moves things; there are {}",
                known.join(", ")
            ))
        })
    };
    names.iter().map(find).collect()
}
