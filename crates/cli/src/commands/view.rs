//! `pliant view`: a recording as a page that plays it, in the browser.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use pliant_view::drawing::{DrawError, Drawing};
use pliant_view::page::{PageBudget, ViewerPage};
use serde_json::{Value, json};

use super::export::replace;
use crate::arguments::ViewArguments;
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;
use crate::text::{self, counted};

pub(crate) fn execute(arguments: &ViewArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let path = arguments.output.clone().unwrap_or_else(|| page_of(&arguments.file));
    refuse_existing(&path, arguments.force, "-o")?;
    let viewed = show(&arguments.file, &path, !arguments.no_open, terminal)?;
    terminal.document(&json!({ "status": ExitStatus::Done, "view": viewed }))?;
    Ok(ExitStatus::Done)
}

/// The page of a recording: its name with `.html` in place of `.mcap`.
pub(crate) fn page_of(recording: &Path) -> PathBuf {
    recording.with_extension("html")
}

/// Refuses a page that is there, unless it may be replaced; `option` names another place.
///
/// # Errors
/// It exists and `force` is not set, or it is no file.
pub(crate) fn refuse_existing(path: &Path, force: bool, option: &str) -> Result<(), Failure> {
    Failure::unless_file(path)?;
    if path.exists() && !force {
        let path = path.display();
        let advice = format!("choose another name with `{option}`, or replace it with `--force`");
        return Err(Failure::usage(format!("{path} exists; {advice}")));
    }
    Ok(())
}

/// Writes the page of a recording, opens it where that is wanted and possible, and says where it is.
///
/// # Errors
/// The recording cannot be read, or the page or standard output not be written.
pub(crate) fn show(recording: &Path, page: &Path, open: bool, terminal: Terminal) -> Result<Value, Failure> {
    let written = write(recording, page)?;
    terminal.report(&written.described(page))?;
    let opened = open && opened(page);
    if open && !opened {
        terminal.note(&format!("no browser could be opened; open {} in one", page.display()));
    }
    let (bytes, frames, of) = (written.html.len(), written.frames, written.frame_count);
    Ok(json!({ "page": page, "bytes": bytes, "frames": frames, "of_frames": of, "opened": opened }))
}

/// Writes the page of a recording.
///
/// # Errors
/// The recording cannot be read, or the page not be written.
pub(crate) fn write(recording: &Path, page: &Path) -> Result<ViewerPage, Failure> {
    Failure::unless_file(recording)?;
    let made = Drawing::open(recording)
        .and_then(|mut drawing| ViewerPage::new(&mut drawing, &PageBudget::default()));
    let made = made.map_err(|error| failure(&error))?;
    replace(page, |out| Ok(out.write_all(made.html.as_bytes())?))?;
    Ok(made)
}

fn failure(error: &DrawError) -> Failure {
    match error {
        DrawError::Record(error) => Failure::recording(error),
        error => Failure::failed("view", error.to_string()),
    }
}

/// The line that says what was written.
trait Described {
    fn described(&self, path: &Path) -> String;
}

impl Described for ViewerPage {
    fn described(&self, path: &Path) -> String {
        let frames = counted(self.frame_count as u64, "frame", "frames");
        let shown = match self.frames == self.frame_count {
            true => frames,
            false => format!("{} of {frames}", self.frames),
        };
        let mut line = format!("wrote {} ({}, {shown})", path.display(), text::bytes(self.html.len() as u64));
        if !self.left_out.is_empty() {
            line += &format!(", without the colourings {}: they did not fit", self.left_out.join(", "));
        }
        line
    }
}

/// Opens a file, or an address, as the desktop does. Whether that could be begun.
pub(crate) fn opened(page: &Path) -> bool {
    let has_screen = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    let mut command = if cfg!(target_os = "macos") {
        Command::new("open")
    } else if cfg!(windows) {
        Command::new("explorer")
    } else if has_screen {
        Command::new("xdg-open")
    } else {
        return false;
    };
    let silent = command.arg(page).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    silent.spawn().is_ok()
}
