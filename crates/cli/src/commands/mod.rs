//! One file per command; here the way from the command line to the exit code.

mod bench;
mod check;
mod export;
mod fit;
mod info;
mod list;
mod live;
mod modes;
mod new;
mod plot;
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
mod view;

pub use export::export;
pub use list::listed;
pub use run::closing;
pub use stress::stress_case;
pub use study::{provenance, study_document};

use std::ffi::OsString;

use serde_json::json;

use crate::arguments::{ColorChoice, Command, CommandLine, CommonArguments};
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;

/// Does what the command line asks for.
pub(crate) fn execute(arguments: impl Iterator<Item = OsString>) -> ExitStatus {
    let arguments: Vec<OsString> = arguments.collect();
    let (command, common) = match CommandLine::read(&arguments) {
        Ok(parsed) => parsed,
        Err(error) => return not_understood(&error, &arguments),
    };
    let terminal = Terminal::new(&common);
    let result = match command {
        Command::New(arguments) => new::execute(&arguments, terminal),
        Command::Run(arguments) => run::execute(&arguments, terminal),
        Command::Resume(arguments) => resume::execute(&arguments, terminal),
        Command::Check(arguments) => check::execute(&arguments, terminal),
        Command::Modes(arguments) => modes::execute(&arguments, terminal),
        Command::List(arguments) => list::execute(&arguments, terminal),
        Command::Info(arguments) => info::execute(&arguments, terminal),
        Command::Recover(arguments) => recover::execute(&arguments, terminal),
        Command::View(arguments) => view::execute(&arguments, terminal),
        Command::Live(arguments) => live::execute(&arguments, terminal),
        Command::Export(arguments) => export::execute(&arguments, terminal),
        Command::Render(arguments) => render::execute(&arguments, terminal),
        Command::Plot(arguments) => plot::execute(&arguments, terminal),
        Command::Schema(arguments) => schema::execute(&arguments, terminal),
        Command::Completions(arguments) => shell::completions(&arguments, terminal),
        Command::Man(arguments) => shell::man(&arguments, terminal),
        Command::Bench(arguments) => bench::execute(&arguments, terminal),
        Command::Stress(arguments) => stress::execute(&arguments, terminal),
        Command::Stability(arguments) => stability::execute(&arguments, terminal),
        Command::Solve(arguments) => solve::execute(&arguments, terminal),
        Command::Study(arguments) => study::execute(&arguments, terminal),
        Command::Fit(arguments) => fit::execute(&arguments, terminal),
    };
    result.unwrap_or_else(|failure| give_up(&failure, terminal))
}

/// Says why a command could not go on: to people on standard error, to programs on standard output.
fn give_up(failure: &Failure, terminal: Terminal) -> ExitStatus {
    terminal.complain(&failure.render(terminal.color));
    let document = json!({ "status": failure.status, "problems": failure.problems() });
    // A failure of standard output can be told nowhere.
    let _ = terminal.document(&document);
    failure.status
}

/// Help, version, or a mistake on the command line.
fn not_understood(error: &clap::Error, arguments: &[OsString]) -> ExitStatus {
    // The options were not read; these few are looked for by hand.
    let has = |option: &str| arguments.iter().skip(1).any(|argument| argument == option);
    let never =
        has("--color=never") || arguments.windows(2).any(|pair| pair[0] == "--color" && pair[1] == "never");
    let color = if never { ColorChoice::Never } else { ColorChoice::Auto };
    let common = CommonArguments { json: has("--json"), quiet: false, verbose: false, color };
    let terminal = Terminal::new(&common);
    let rendered = error.render();
    let text = if terminal.color { rendered.ansi().to_string() } else { rendered.to_string() };
    if !error.use_stderr() {
        let plain = rendered.to_string();
        return terminal
            .print(&plain)
            .map_or_else(|failure| give_up(&failure, terminal), |()| ExitStatus::Done);
    }
    terminal.complain(&text);
    let message = rendered.to_string();
    // The first paragraph; usage and tips are for people.
    let first: Vec<&str> = message.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    let message = first.join(" ").trim_start_matches("error: ").to_owned();
    let problems = json!([{ "kind": "usage", "message": message }]);
    let _ = terminal.document(&json!({ "status": ExitStatus::Invalid, "problems": problems }));
    ExitStatus::Invalid
}
