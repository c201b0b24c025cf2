//! The command line: all that can be typed after `pliant`.

mod bench;
mod check;
mod export;
mod fit;
mod info;
mod list;
mod live;
mod modes;
mod new;
mod recover;
mod render;
mod resume;
mod run;
mod schema;
mod shell;
mod solve;
mod stability;
mod stress;
mod study;
mod values;
mod view;

use std::ffi::{OsStr, OsString};
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use pliant_scene::nearest;

pub(crate) use bench::BenchArguments;
pub(crate) use check::CheckArguments;
pub(crate) use export::{ExportArguments, ExportFormat, FrameRange};
pub(crate) use fit::FitArguments;
pub(crate) use info::InfoArguments;
pub(crate) use list::{Family, ListArguments};
pub(crate) use live::LiveArguments;
pub(crate) use modes::{ModesArguments, VertexChoice};
pub(crate) use new::NewArguments;
pub(crate) use recover::RecoverArguments;
pub(crate) use render::{PlotArguments, QuantityArgument, RenderArguments};
pub(crate) use resume::ResumeArguments;
pub(crate) use run::RunArguments;
pub(crate) use schema::{SchemaArguments, SchemaFormat};
pub(crate) use shell::{CompletionsArguments, ManArguments};
pub(crate) use solve::SolveArguments;
pub(crate) use stability::{AgainstArgument, StabilityArguments};
pub(crate) use stress::StressArguments;
pub(crate) use study::{ReferenceFrom, StudyArguments};
pub(crate) use view::ViewArguments;

/// The whole command line.
#[derive(Debug, Parser)]
#[command(name = "pliant", version, about = "Simulates deformable bodies, cloth, strands and particles.")]
#[command(after_help = "`pliant SCENE` is short for `pliant run SCENE`.\n\
    Exit codes: 0 done, 1 the run failed, 2 bad usage or scene, 130 interrupted.")]
#[command(override_usage = "pliant [run] [OPTIONS] SCENE\n       pliant COMMAND ...")]
#[command(subcommand_negates_reqs = true, arg_required_else_help = true, disable_help_subcommand = true)]
pub(crate) struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: Option<RunArguments>,
    #[command(flatten)]
    pub(crate) common: CommonArguments,
}

/// Options of every command.
#[derive(Args, Clone, Debug)]
pub(crate) struct CommonArguments {
    /// Print one JSON document on standard output, also on failure
    #[arg(long, global = true, help_heading = "General")]
    pub(crate) json: bool,
    /// Print errors and warnings only
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = "General")]
    pub(crate) quiet: bool,
    /// Print the assembled problem before the run
    #[arg(short, long, global = true, help_heading = "General")]
    pub(crate) verbose: bool,
    /// Colours: auto, always or never; auto respects NO_COLOR
    #[arg(
        long,
        global = true,
        value_name = "WHEN",
        default_value = "auto",
        hide_possible_values = true,
        help_heading = "General"
    )]
    pub(crate) color: ColorChoice,
}

/// When to use colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum ColorChoice {
    /// On a terminal, unless NO_COLOR is set
    #[default]
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write a commented starter scene
    New(NewArguments),
    /// Simulate a scene and record it
    Run(RunArguments),
    /// Continue a run from its last checkpoint
    Resume(ResumeArguments),
    /// Print the assembled problem: unknowns, stability limit, memory, active features
    Check(CheckArguments),
    /// Compute natural frequencies; animate mode shapes, synthesise the sound of an impact
    Modes(Box<ModesArguments>),
    /// List integrators, materials, presets, elements, meshes and output channels
    List(ListArguments),
    /// Describe a recording, and how its run ended
    Info(InfoArguments),
    /// Make the recording of a killed run readable
    Recover(RecoverArguments),
    /// Write a page that plays a recording, and open it in the browser
    View(ViewArguments),
    /// Run a scene in the browser, where you can drag vertices
    Live(LiveArguments),
    /// Convert a recording for ParaView and PyVista (.vtu), Blender (.glb, .obj), NumPy (.npz), tables (.csv)
    Export(ExportArguments),
    /// Draw a recording: a still, frames side by side, an animation
    Render(Box<RenderArguments>),
    /// Plot energies, momentum, reactions or probes of a recording over time
    Plot(PlotArguments),
    /// Print the format of scenes: a JSON schema for editors, or a reference page
    Schema(SchemaArguments),
    /// Print a completion script for bash, zsh, fish or powershell
    Completions(CompletionsArguments),
    /// Print the manual page, or write one for every command
    Man(ManArguments),
    /// Measure the speed of steps on this machine
    Bench(BenchArguments),
    /// Run robustness tests on the solvers or on a scene
    Stress(StressArguments),
    /// Find the largest stable step: predicted, measured, and as a function of a parameter
    Stability(StabilityArguments),
    /// Find mesh, elements, integrator and step for the accuracy of a quantity, and prove it
    Solve(SolveArguments),
    /// Compare integrators and steps: error in time, on this mesh, against run time, with a report
    Study(StudyArguments),
    /// Fit parameters of a scene to measurements: trajectories, material curves, frequencies
    Fit(Box<FitArguments>),
}

impl CommandLine {
    /// Reads the command line.
    ///
    /// # Errors
    /// The message of clap: a mistake, or the help or version that was asked for.
    pub(crate) fn read(arguments: &[OsString]) -> Result<(Command, CommonArguments), clap::Error> {
        let matches = CommandLine::command().try_get_matches_from(arguments).map_err(|error| {
            // `pliant chekc beam.toml` reads as a scene named `chekc` with one argument too many.
            let word = arguments.get(1).filter(|_| error.kind() == ErrorKind::UnknownArgument);
            word.and_then(|word| misspelled_command(word)).unwrap_or_else(|| with_option(error))
        })?;
        // `pliant beam.toml check`, `pliant --force check beam.toml`: clap would leave them unused.
        let before = ["RunArguments", "RunOptions"].iter().any(|group| matches.contains_id(group));
        if matches.subcommand_name().is_some() && before {
            return Err(CommandLine::command().error(
                ErrorKind::ArgumentConflict,
                "the scene and the options of a command come after its name: pliant run SCENE --until 1",
            ));
        }
        let line = CommandLine::from_arg_matches(&matches)?;
        match (line.command, line.run) {
            (Some(command), _) => Ok((command, line.common)),
            (None, Some(run)) => match misspelled_command(run.scene.as_os_str()) {
                Some(error) => Err(error),
                None => Ok((Command::Run(run), line.common)),
            },
            (None, None) => Err(CommandLine::command().error(
                ErrorKind::MissingRequiredArgument,
                "no scene given; use `pliant SCENE`, or see `pliant --help`",
            )),
        }
    }
}

/// Options by the names that they have elsewhere.
const OPTION_SYNONYMS: &[(&str, &str)] = &[
    ("--duration", "--until"),
    ("--time", "--until"),
    ("--end", "--until"),
    ("--out", "--output"),
    ("--overwrite", "--force"),
    ("--jobs", "--threads"),
    ("--param", "--set"),
];

/// The mistake `error` with the option that was meant, where one is known by another name.
fn with_option(mut error: clap::Error) -> clap::Error {
    let unknown = match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(name)) if error.kind() == ErrorKind::UnknownArgument => name.clone(),
        _ => return error,
    };
    let name = unknown.split('=').next().unwrap_or_default();
    if let Some((_, meant)) = OPTION_SYNONYMS.iter().find(|(other, _)| *other == name) {
        error.insert(ContextKind::SuggestedArg, ContextValue::String((*meant).to_owned()));
        // That it could be a value helps nobody.
        error.remove(ContextKind::Suggested);
    }
    error
}

/// The error for a word that can be neither a command nor a file.
fn misspelled_command(word: &OsStr) -> Option<clap::Error> {
    let path = Path::new(word);
    let may_be_file = path.extension().is_some() || path.components().count() != 1 || path.exists();
    let shown = word.to_string_lossy();
    if may_be_file || shown.starts_with('-') {
        return None;
    }
    let line = CommandLine::command();
    let names: Vec<&str> = line.get_subcommands().map(clap::Command::get_name).collect();
    if names.contains(&&*shown) {
        return None;
    }
    let scene = path.with_extension("toml");
    let meant = match nearest(&shown, &names) {
        _ if scene.is_file() => format!("; did you mean `pliant run {}`?", scene.display()),
        Some(command) => format!("; did you mean `pliant {command}`?"),
        None => "; `pliant --help` lists the commands".to_owned(),
    };
    let message = format!("`{shown}` is neither a command nor a file{meant}");
    Some(CommandLine::command().error(ErrorKind::InvalidSubcommand, message))
}
