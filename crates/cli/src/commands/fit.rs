//! `pliant fit`: constants of a scene from measurements.

use std::path::Path;

use pliant_lab::fit::{FitError, FitOptions, FitProgress, SceneFit};
use serde_json::{Value, json};

use crate::arguments::FitArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::output;
use crate::progress::spinner;
use crate::terminal::Terminal;
use crate::text::{counted, number, table, wrap};

pub(crate) fn execute(arguments: &FitArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let outputs = [(&arguments.output, "svg"), (&arguments.fitted, "toml")];
    for (path, extension) in outputs.iter().filter_map(|(path, e)| Some((path.as_deref()?, *e))) {
        refuse(path, extension, arguments)?;
    }
    let input = Input::read(&arguments.scene, &arguments.set, None)?;
    let data = read(&arguments.to)?;
    let name = arguments.to.display().to_string();
    let options = FitOptions {
        parameters: arguments.parameters.clone(),
        bounds: arguments.bounds.iter().map(|bounds| (bounds.key.clone(), bounds.ends)).collect(),
        starts: arguments.starts.get(),
        seed: arguments.seed,
        columns: arguments.columns.clone(),
        length: arguments.length,
        area: arguments.area,
    };
    let bar = spinner(terminal);
    let mut watch = |progress: FitProgress<'_>| {
        let values: Vec<String> = progress.parameters.iter().map(|value| number(*value)).collect();
        let FitProgress { start, steps, sum_of_squares, .. } = progress;
        let line = format!(
            "start {}, step {steps}: sum of squares {}, at {}",
            start + 1,
            number(sum_of_squares),
            values.join(", ")
        );
        match &bar {
            Some(bar) => bar.set_message(line),
            None if terminal.verbose => terminal.note(&line),
            None => {}
        }
    };
    let found = SceneFit::of(&input.source, (&name, &data), &options, interrupt::flag()?, &mut watch);
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    let found = match found {
        Err(FitError::Stopped) => {
            terminal.complain("interrupted: nothing was fitted yet");
            terminal.document(&json!({ "status": ExitStatus::Interrupted }))?;
            return Ok(ExitStatus::Interrupted);
        }
        found => found.map_err(failure)?,
    };
    terminal.report(&describe(&found, &name, terminal.width()))?;
    found.warnings.iter().for_each(|warning| terminal.warn(warning));
    if let Some(path) = &arguments.output {
        let title = format!("{} and {name}", input.source.name());
        let svg = found.svg(&title).map_err(|error| Failure::failed("chart", error.to_string()))?;
        output::file(path, &svg)?;
        terminal.note(&format!("drew the fit to {}", path.display()));
    }
    if let Some(path) = &arguments.fitted {
        output::file(path, found.scene.text())?;
        terminal.note(&format!("wrote the scene with these values to {}", path.display()));
    }
    terminal.document(&document(&found, input.source.name(), &name))?;
    Ok(ExitStatus::Done)
}

/// The table's text.
fn read(path: &Path) -> Result<String, Failure> {
    Failure::unless_file(path)?;
    std::fs::read_to_string(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::InvalidData => Failure::usage(format!("{} is no text", path.display())),
        _ => Failure::usage(format!("cannot read {}: {error}", path.display())),
    })
}

/// Before anything is computed: an output that is there, is an input, or has another ending.
fn refuse(path: &Path, extension: &str, arguments: &FitArguments) -> Result<(), Failure> {
    Failure::unless_file(path)?;
    let there = path.canonicalize().ok();
    let is = |other: &Path| there.is_some() && other.canonicalize().ok() == there;
    if is(&arguments.scene) || is(&arguments.to) {
        return Err(Failure::usage(format!("{} is an input; choose another output", path.display())));
    }
    if path.extension().is_none_or(|found| found != extension) {
        return Err(Failure::usage(format!("{} must end in .{extension}", path.display())));
    }
    if path.exists() && !arguments.force {
        let message = format!("{} exists; name another file, or replace it with `--force`", path.display());
        return Err(Failure::usage(message));
    }
    Ok(())
}

fn failure(error: FitError) -> Failure {
    match error {
        FitError::Scene(error) => Failure::from(error),
        FitError::Run(_) => Failure::failed("fit", error.to_string()),
        error => Failure::usage(error.to_string()),
    }
}

/// The report for people.
fn describe(found: &SceneFit, data: &str, width: usize) -> String {
    let SceneFit { parameters, series, .. } = found;
    let mut rows = vec![["parameter", "value", "95 % within", "in the scene"].map(str::to_owned).to_vec()];
    for parameter in parameters {
        let within = match (parameter.interval, parameter.at_bound) {
            (Some([low, high]), _) => format!("+- {}", number(0.5 * (high - low))),
            (None, true) => "at its bound".into(),
            (None, false) => "unknown".into(),
        };
        let value = format!("{:.10e}", parameter.value).parse::<f64>().unwrap_or(parameter.value);
        rows.push(vec![parameter.path.clone(), value.to_string(), within, number(parameter.start)]);
    }
    let mut out = table(&rows, 0) + "\n";
    for (i, of) in parameters.iter().enumerate() {
        for (j, with) in parameters.iter().enumerate().skip(i + 1) {
            if let Some(correlation) = found.correlation[i][j] {
                out += &format!("correlation of {} and {}: {correlation:.3}\n", of.path, with.path);
            }
        }
    }
    for one in series {
        let count = counted(one.at.len() as u64, "number", "numbers");
        out +=
            &format!("{}: {count}, residual {} {} (root mean square)\n", one.name, number(one.rms), one.unit);
    }
    let runs = counted(found.runs, "run", "runs");
    let fitted = counted(parameters.len() as u64, "parameter", "parameters");
    let numbers = counted(found.measured as u64, "number", "numbers");
    let steps = counted(found.steps.into(), "step", "steps");
    let line = format!("{fitted} fitted to {numbers} of {data} in {steps}, {runs}");
    out += &wrap(&line, 0, width);
    if let [_, _, ..] = found.starts[..] {
        let of = |start: &pliant_lab::fit::FitStart| start.sum_of_squares.map_or("failed".into(), number);
        let sums: Vec<String> = found.starts.iter().map(of).collect();
        out += &wrap(&format!("sums of squares of the starts: {}", sums.join(", ")), 0, width);
    }
    format!("{out}\n{}", found.toml)
}

fn document(found: &SceneFit, scene: &str, data: &str) -> Value {
    let mut document = json!({ "status": ExitStatus::Done, "scene": scene, "data": data });
    if let (Some(document), Value::Object(found)) = (document.as_object_mut(), json!(found)) {
        document.extend(found);
    }
    document
}
