//! `pliant modes`: natural frequencies of a scene, its mode shapes as an animation, the sound of a blow.

mod animation;
mod sound;
mod wav;

use std::path::Path;
use std::sync::Arc;

use pliant::integrator::IntegratorSpec;
use pliant::modes::{MassMatrix, Modes, ModesError};
use pliant::simulation::StepError;
use pliant::solver::SolveFailure;
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{AffinePosition, PositionSpec};
use serde_json::json;

use crate::arguments::ModesArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::terminal::Terminal;
use crate::text::{counted, number, table};

pub(crate) fn execute(arguments: &ModesArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    for path in arguments.output.iter().chain(&arguments.sound.sound) {
        refuse(path, arguments)?;
    }
    let mut input = Input::read(&arguments.scene, &arguments.set, None)?;
    if arguments.equilibrium {
        let time = &mut input.scene.time;
        time.integrator = IntegratorSpec::QuasiStatic;
        // Statics has no error in time that steps could follow.
        time.adaptive = None;
        time.arc_length = None;
        time.step.get_or_insert(time.duration);
    }
    let mut assembly = input.assemble(UnstableStep::Accept)?;
    assembly.simulation.set_stop(Some(Arc::clone(interrupt::flag()?)));
    if arguments.equilibrium {
        let Some(moved) = settle(&mut assembly)? else { return interrupted(terminal) };
        terminal.report(&format!(
            "about the static equilibrium, {} m from where the scene starts\n",
            number(moved)
        ))?;
    }
    let found = match assembly.simulation.modes(arguments.count.get().into()) {
        Err(ModesError::Stopped) => return interrupted(terminal),
        found => found.map_err(|error| Failure::failed("modes", described(&error, &input)))?,
    };
    terminal.report(&describe(&found))?;
    let mut document = json!({ "status": ExitStatus::Done, "scene": input.source.name(), "modes": found });
    if let Some(path) = &arguments.output {
        let recorded = animation::record(path, arguments, &input, &assembly, &found)?;
        terminal.report(&animation::describe(&recorded))?;
        document["recording"] = json!({ "path": recorded.path, "frames": recorded.frames });
    }
    if let Some(path) = &arguments.sound.sound {
        let heard = sound::write(path, arguments, &mut assembly)?;
        terminal.report(&heard.describe())?;
        heard.warnings().iter().for_each(|warning| terminal.warn(warning));
        document["sound"] = heard.document();
    }
    terminal.document(&document)?;
    Ok(ExitStatus::Done)
}

/// Why there are no modes; where bodies start away from their shape at rest, how to start them in it.
fn described(error: &ModesError, input: &Input) -> String {
    let moved = input.scene.body.iter().enumerate().find_map(|(i, body)| Some((i, body.position.as_ref()?)));
    let (ModesError::NotStable, Some((i, position))) = (error, moved) else { return error.to_string() };
    let name = input.scene.body[i].name_or_default(i);
    let remedy = match position {
        PositionSpec::Affine(AffinePosition { matrix: Some(_), .. }) => {
            let rows: &str = match input.scene.dimension {
                2 => "[[1,0],[0,1]]",
                _ => "[[1,0,0],[0,1,0],[0,0,1]]",
            };
            format!("`--set body.{i}.position.affine.matrix={rows}` starts it there")
        }
        _ => "remove `position` to start it there".to_owned(),
    };
    format!("{error}; `position` moves `{name}` away from its reference configuration: {remedy}")
}

/// Asked to end before there is anything to tell.
fn interrupted(terminal: Terminal) -> Result<ExitStatus, Failure> {
    terminal.complain("interrupted: no modes were found yet");
    terminal.document(&json!({ "status": ExitStatus::Interrupted }))?;
    Ok(ExitStatus::Interrupted)
}

/// Before anything is computed: an output that is there, or is the scene.
fn refuse(path: &Path, arguments: &ModesArguments) -> Result<(), Failure> {
    Failure::unless_file(path)?;
    if path.canonicalize().is_ok_and(|path| arguments.scene.canonicalize().is_ok_and(|s| s == path)) {
        return Err(Failure::usage(format!("{} is the scene; choose another output", path.display())));
    }
    if path.exists() && !arguments.force {
        let message = format!("{} exists; name another file, or replace it with `--force`", path.display());
        return Err(Failure::usage(message));
    }
    Ok(())
}

/// Steps of statics until nothing moves: what dissipates resists each. How far the farthest coordinate has
/// come [m]; `None` where it was interrupted.
fn settle(assembly: &mut Assembly) -> Result<Option<f64>, Failure> {
    let simulation = &mut assembly.simulation;
    let largest = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
    let start = simulation.state().x().to_vec();
    // What friction holds creeps by less than its threshold speed, and would for ever.
    let creep = assembly.report.contact.as_ref().and_then(|contact| contact.threshold_speed);
    let still =
        creep.map_or(0.0, |speed| speed * simulation.step_size()).max(1e-9 * simulation.length_scale());
    for _ in 0..STATIC_STEPS {
        let before = simulation.state().x().to_vec();
        match simulation.step() {
            Err(StepError::Unsolved { verdict: SolveFailure::Stopped, .. }) => return Ok(None),
            step => step.map_err(|error| Failure::failed("equilibrium", error.to_string()))?,
        }
        if largest(&before, simulation.state().x()) <= still {
            return Ok(Some(largest(&start, simulation.state().x())));
        }
    }
    let message =
        format!("no equilibrium within {STATIC_STEPS} steps of statics: the loads or the pins go on moving");
    Err(Failure::failed("equilibrium", message))
}

/// How many steps may go by before loads and damping have come to rest.
const STATIC_STEPS: usize = 200;

/// The table for people.
fn describe(found: &Modes) -> String {
    let axes = ["x", "y", "z"];
    let mut header = vec!["mode".to_owned(), "frequency [Hz]".to_owned(), "period [s]".to_owned()];
    header.extend(axes.iter().take(found.free_mass.len()).map(|axis| format!("mass along {axis}")));
    let mut rows = vec![header];
    for (i, mode) in found.modes.iter().enumerate() {
        let period = if mode.frequency > 0.0 { number(1.0 / mode.frequency) } else { "-".into() };
        let mut row = vec![(i + 1).to_string(), number(mode.frequency), period];
        row.extend(mode.effective_mass.iter().map(|share| format!("{:.1}%", 100.0 * share)));
        rows.push(row);
    }
    let mass: Vec<String> = found.free_mass.iter().map(|mass| number(*mass)).collect();
    format!(
        "{}\n{} free to move, {} kg of them along each axis, {}; {}\n",
        table(&rows, 0),
        counted(found.free_coordinates as u64, "coordinate", "coordinates"),
        mass.join(", "),
        match found.mass_matrix {
            MassMatrix::Lumped => "lumped",
            MassMatrix::Consistent => "consistent with the quadratic elements (lumped in steps)",
        },
        counted(found.solves as u64, "linear solve", "linear solves"),
    )
}
