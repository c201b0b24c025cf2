//! What can be typed after `pliant`.

mod modes;
mod render;

use std::ffi::{OsStr, OsString};
use std::num::NonZeroU16;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use pliant::quantity::Kind;
use pliant::solver::LinearSolver;

pub(crate) use modes::{ModesArguments, VertexChoice};
pub(crate) use render::{GalleryArguments, PlotArguments, QuantityArgument, RenderArguments};

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

/// What every command takes.
#[derive(Args, Clone, Debug)]
pub(crate) struct CommonArguments {
    /// Print one JSON document on standard output, whatever happens
    #[arg(long, global = true, help_heading = "General")]
    pub(crate) json: bool,
    /// No progress and no report; errors and warnings only
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = "General")]
    pub(crate) quiet: bool,
    /// Say more: the assembled problem before the run
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
    /// Simulate a scene and record it
    Run(RunArguments),
    /// Go on with a run from its last checkpoint
    Resume(ResumeArguments),
    /// Show what a scene amounts to, without running it
    Check(CheckArguments),
    /// Show the natural frequencies of a scene; play its mode shapes and its sound
    Modes(Box<ModesArguments>),
    /// List what scenes can be made of
    List(ListArguments),
    /// Show what a recording holds
    Info(InfoArguments),
    /// Make the recording of a killed run readable
    Recover(RecoverArguments),
    /// Look at a recording: write a page that plays it, and open it in the browser
    View(ViewArguments),
    /// Write a recording for ParaView, PyVista or meshio (.vtu), Blender (.glb, .obj), NumPy (.npz), tables (.csv)
    Export(ExportArguments),
    /// Draw a recording: a still, frames side by side, an animation
    Render(Box<RenderArguments>),
    /// Draw energies, momentum, reactions or probes of a recording over time
    Plot(PlotArguments),
    /// Draw every scene of a folder into one page
    Gallery(GalleryArguments),
    /// Print the format of scenes: the JSON schema for editors, or a page to read
    Schema(SchemaArguments),
    /// Measure how fast this machine takes steps
    Bench(BenchArguments),
    /// Put the solvers, or a scene, through what breaks simulators, and tell what stands
    Stress(StressArguments),
    /// Find how large a step a scene can take: predicted, measured, and against what it is made of
    Stability(StabilityArguments),
    /// Compare schemes and steps: error against run time, with a report
    Study(StudyArguments),
}

/// `pliant run`.
#[derive(Args, Clone, Debug)]
pub(crate) struct RunArguments {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// Where to record; by default the name of the scene with .mcap, in the working directory
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the output if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Simulate this long instead of the scene's duration [s]
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, allow_negative_numbers = true)]
    pub(crate) until: Option<f64>,
    /// Number of threads [default: all cores]; the result does not depend on it
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroU16>,
    /// Also write the readings of the scene's probes as a table of comma-separated values
    #[arg(long, value_name = "FILE")]
    pub(crate) probes: Option<PathBuf>,
    /// Simulate without recording
    #[arg(long, conflicts_with = "output")]
    pub(crate) no_record: bool,
    /// Keep a checkpoint, at most so often (60s, "5 min"), at the end and on Ctrl-C: `pliant resume` goes on
    /// from it with the same bits. It is beside the recording, with .checkpoint in place of .mcap
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) checkpoint: Option<f64>,
    /// Look at the recording in the browser when the run has ended, as `pliant view` does
    #[arg(long, conflicts_with = "no_record")]
    pub(crate) view: bool,
}

/// `pliant resume`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ResumeArguments {
    /// Checkpoint (.checkpoint)
    pub(crate) file: PathBuf,
    /// Where to record, with the frames before; by default where the run has recorded so far
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the output if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Simulate until this time instead of the duration so far [s]
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, allow_negative_numbers = true)]
    pub(crate) until: Option<f64>,
    /// Number of threads [default: all cores]; the result does not depend on it
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroU16>,
    /// Go on without recording
    #[arg(long, conflicts_with = "output")]
    pub(crate) no_record: bool,
    /// Keep a checkpoint at most so often [default: as the run did]
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) checkpoint: Option<f64>,
}

/// `pliant check`.
#[derive(Args, Clone, Debug)]
pub(crate) struct CheckArguments {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
}

/// `pliant list`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ListArguments {
    /// Only this family
    pub(crate) family: Option<Family>,
}

/// What can be listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Family {
    /// Time integrators
    Integrators,
    /// Hyperelastic materials
    Materials,
    /// Well-known materials: constants, densities and their sources
    Presets,
    /// Finite elements and springs
    Elements,
    /// Meshes: generators and files
    Meshes,
    /// Output channels
    Channels,
}

/// `pliant info`.
#[derive(Args, Clone, Debug)]
pub(crate) struct InfoArguments {
    /// Recording (.mcap)
    pub(crate) file: PathBuf,
}

/// `pliant recover`.
#[derive(Args, Clone, Debug)]
pub(crate) struct RecoverArguments {
    /// What the killed run left behind (.mcap.part)
    pub(crate) file: PathBuf,
    /// Where to write; by default the name without .part
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the output if it exists
    #[arg(long)]
    pub(crate) force: bool,
}

/// `pliant view`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ViewArguments {
    /// Recording (.mcap)
    pub(crate) file: PathBuf,
    /// Where to write the page; by default beside the recording, with .html in place of .mcap
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the page if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Write the page without opening it
    #[arg(long)]
    pub(crate) no_open: bool,
}

/// `pliant export`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ExportArguments {
    /// Recording (.mcap)
    pub(crate) file: PathBuf,
    /// A folder, or a file: .html for a page that plays it, .pvd for a series of .vtu beside it, .vtu or .obj
    /// for a single frame; .glb (animated surfaces), .npz (arrays) or .csv (energies and reactions) for all
    #[arg(long, value_name = "DIR_OR_FILE")]
    pub(crate) to: PathBuf,
    /// What to write into a folder [default: vtu]
    #[arg(long)]
    pub(crate) format: Option<ExportFormat>,
    /// Which frames, from 0: one (12), a range without its end (10..20), or every so many (0..100:10, ..:5) [default: all]
    #[arg(long, value_name = "A..B:STEP", allow_hyphen_values = true)]
    pub(crate) frames: Option<FrameRange>,
    /// Positions of a .glb to 16 bits of each body's box: smaller, for readers that know
    /// KHR_mesh_quantization
    #[arg(long)]
    pub(crate) quantised: bool,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
}

/// File formats of exports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    /// VTK unstructured grids, and a .pvd with their times
    Vtu,
    /// Wavefront OBJ: surfaces
    Obj,
}

/// Frames `start`, `start + step`, ... below `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FrameRange {
    pub(crate) start: usize,
    /// All that follow without it.
    pub(crate) end: Option<usize>,
    pub(crate) step: usize,
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<FrameRange, String> {
        let number = |word: &str| {
            let what = "it must be like 12, 10..20, 10.. or 0..100:10, with whole numbers from 0";
            word.parse::<usize>().map_err(|_| format!("`{word}` is no frame; {what}"))
        };
        let (range, step) = match text.split_once(':') {
            Some((range, step)) => (range, number(step)?),
            None => (text, 1),
        };
        if step == 0 {
            return Err("the step must be 1 or more".to_owned());
        }
        let (start, end) = match range.split_once("..") {
            Some((start, end)) => {
                let start = if start.is_empty() { 0 } else { number(start)? };
                (start, if end.is_empty() { None } else { Some(number(end)?) })
            }
            None if step > 1 => return Err("a step goes with a range, like 0..100:10".to_owned()),
            None => {
                let frame = number(range)?;
                (frame, frame.checked_add(1))
            }
        };
        if end.is_some_and(|end| end <= start) {
            return Err("the range is empty: its end is not part of it".to_owned());
        }
        Ok(FrameRange { start, end, step })
    }
}

/// `pliant bench`.
#[derive(Args, Clone, Debug)]
pub(crate) struct BenchArguments {
    /// Only this row of the table; repeatable
    #[arg(long, value_name = "NAME")]
    pub(crate) row: Vec<String>,
    /// Number of threads [default: one; two as well where threads are compared]
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroU16>,
    /// The smallest size of each row, briefly: a first look
    #[arg(long)]
    pub(crate) quick: bool,
}

/// `pliant stress`.
#[derive(Args, Clone, Debug)]
pub(crate) struct StressArguments {
    /// Scene file (TOML), to be put out of shape in place of the suite's own
    pub(crate) scene: Option<PathBuf>,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE", requires = "scene")]
    pub(crate) set: Vec<String>,
    /// Only these rows: torture, D1 to D13
    #[arg(long, value_name = "ROW", value_delimiter = ',', conflicts_with = "scene")]
    pub(crate) only: Vec<String>,
    /// Only these materials; those without numbers of an independent program run if they are named
    #[arg(long, value_name = "NAME", value_delimiter = ',', conflicts_with = "scene")]
    pub(crate) materials: Vec<String>,
    /// Only these integrators; those without numbers of an independent program run if they are named
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) integrators: Vec<String>,
    /// Only these linear solvers: auto, cholesky, cg, multigrid, matrix-free; those that are named go through every start, and through
    /// every implicit scheme on a scene
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = linear_solver)]
    pub(crate) solvers: Vec<LinearSolver>,
    /// What takes a tenth of a second or less
    #[arg(long)]
    pub(crate) quick: bool,
    /// Wall time for everything, for example 60s or "5 min": runs of a scene are cut short where it is over, and say so, cases of the
    /// suite left out [default: 60s for a scene]
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) budget: Option<f64>,
    /// Also write stress.csv, stress.json and stress.html with pictures of the end states into this folder
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Also write a page of Markdown, with its pictures in a folder beside it
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
}

/// `pliant stability`.
#[derive(Args, Clone, Debug)]
pub(crate) struct StabilityArguments {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// The integrators to look at, the scene's own first [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) integrators: Vec<String>,
    /// What the map has beside the step [default: young, gravity where nothing is elastic, else density]
    #[arg(long, value_name = "WHAT")]
    pub(crate) against: Option<AgainstArgument>,
    /// A coarse map
    #[arg(long)]
    pub(crate) quick: bool,
    /// Also write stability.csv, map.csv, stability.json, stability.html and its charts into this folder
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
}

/// What a map varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum AgainstArgument {
    /// Young's modulus, or the constant of springs, of all bodies
    Young,
    /// Poisson's ratio of all bodies
    Poisson,
    /// The density, or other mass, of the first body
    Density,
    /// The constant of mutual gravity
    Gravity,
}

/// `pliant study`.
#[derive(Args, Clone, Debug)]
pub(crate) struct StudyArguments {
    /// Scene files (TOML); what they say in [study] is what is compared, unless told otherwise here
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    /// Change a value of the scene, for example time.duration=1; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// The schemes, separated by commas [default: a dozen, and the scene's own]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) integrators: Option<String>,
    /// The steps [s], separated by commas [default: chosen by factors of 2]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) steps: Option<String>,
    /// Tolerances of schemes whose steps follow the error, separated by commas [default: by factors of 10]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) tolerances: Option<String>,
    /// Vary a value of the scene beside; repeatable, every combination is studied
    #[arg(long, value_name = "PATH=A,B,..")]
    pub(crate) vary: Vec<String>,
    /// At how many times states are compared, at least 20
    #[arg(long, value_name = "N")]
    pub(crate) times: Option<NonZeroU16>,
    /// Timed runs of each row [default: 7, or as many as take a second]
    #[arg(long, value_name = "N")]
    pub(crate) repeats: Option<NonZeroU16>,
    /// Threads that steps run on, as many for every row; the system places them [default: 1]
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroU16>,
    /// Wall time for everything, for example 60s or "5 min" [default: 60s for each scene where steps are chosen]
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) budget: Option<f64>,
    /// Where the reference comes from: auto, exact or computed
    #[arg(long, value_name = "FROM", default_value = "auto", hide_possible_values = true)]
    pub(crate) reference: ReferenceFrom,
    /// The largest error that the recommendation may have [default: 0.01]
    #[arg(long, value_name = "ERROR")]
    pub(crate) error: Option<f64>,
    /// Folder for reports, charts, tables, and what a next study can use [default: the name of the scene with -study]
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Where the Markdown goes [default: report.md in the folder]
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
    /// Title of the report
    #[arg(long, value_name = "TEXT")]
    pub(crate) title: Option<String>,
    /// Two charts for each scene rather than five
    #[arg(long)]
    pub(crate) brief: bool,
    /// Forget the rows and references that an earlier study left in the folder
    #[arg(long)]
    pub(crate) fresh: bool,
}

/// Where the reference of a study comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReferenceFrom {
    /// Exact where it is known, else computed
    Auto,
    /// Exact, or the study is refused
    Exact,
    /// Computed by two independent schemes
    Computed,
}

/// `pliant schema`.
#[derive(Args, Clone, Debug)]
pub(crate) struct SchemaArguments {
    /// json: the JSON schema; markdown: the reference page
    #[arg(long, value_name = "FORMAT", default_value = "json", hide_possible_values = true)]
    pub(crate) format: SchemaFormat,
}

/// How the format of scenes is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SchemaFormat {
    /// JSON schema
    Json,
    /// Reference page
    Markdown,
}

fn linear_solver(text: &str) -> Result<LinearSolver, String> {
    let named = LinearSolver::ALL.into_iter().find(|solver| solver.name().eq_ignore_ascii_case(text));
    named.ok_or_else(|| {
        format!("the linear solvers are {}", LinearSolver::ALL.map(LinearSolver::name).join(", "))
    })
}

fn positive_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        Ok(_) => Err("it must be a positive number of seconds".into()),
        Err(_) => Err("it must be a number of seconds, like 0.5".into()),
    }
}

/// A time with or without its unit.
fn time_span(text: &str) -> Result<f64, String> {
    match Kind::TIME.parse(text) {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        Ok(_) => Err("it must be a positive time".into()),
        Err(_) => Err("it must be a time, like 60s or \"5 min\"".into()),
    }
}

impl CommandLine {
    /// Reads the command line.
    ///
    /// # Errors
    /// What clap has to say: a mistake, or the help or version that was asked for.
    pub(crate) fn read(arguments: &[OsString]) -> Result<(Command, CommonArguments), clap::Error> {
        let matches = CommandLine::command().try_get_matches_from(arguments).map_err(|error| {
            // `pliant chekc beam.toml` reads as a scene named `chekc` with one argument too many.
            let word = arguments.get(1).filter(|_| error.kind() == ErrorKind::UnknownArgument);
            word.and_then(|word| misspelled_command(word)).unwrap_or(error)
        })?;
        // `pliant beam.toml check`, `pliant --force check beam.toml`: clap would leave them unused.
        if matches.subcommand_name().is_some() && matches.contains_id("RunArguments") {
            return Err(CommandLine::command().error(
                ErrorKind::ArgumentConflict,
                "options of a command, and the scene, come after its name: pliant run SCENE --until 1",
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
                "which scene? Try `pliant SCENE`, or `pliant --help`",
            )),
        }
    }
}

/// The commands alone, to ask clap what a word may have been meant to be.
#[derive(Debug, Parser)]
#[command(name = "pliant", disable_help_subcommand = true)]
struct CommandsOnly {
    #[command(flatten)]
    common: CommonArguments,
    #[command(subcommand)]
    command: Command,
}

/// The error for a word that can be neither a command nor a file.
fn misspelled_command(word: &OsStr) -> Option<clap::Error> {
    let path = Path::new(word);
    let may_be_file = path.extension().is_some() || path.components().count() != 1 || path.exists();
    if may_be_file || word.to_string_lossy().starts_with('-') {
        return None;
    }
    // Of the word alone: what follows belongs to a command that does not exist.
    let alone = [OsStr::new("pliant"), word];
    let error = CommandsOnly::command()
        .try_get_matches_from(alone)
        .and_then(|matches| CommandsOnly::from_arg_matches(&matches));
    error.err().filter(|error| error.kind() == ErrorKind::InvalidSubcommand)
}
