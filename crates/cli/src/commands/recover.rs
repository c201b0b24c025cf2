//! `pliant recover`: a readable file from what a killed run has left.

use std::path::{Path, PathBuf};

use pliant_record::read;
use serde_json::json;

use crate::arguments::RecoverArguments;
use crate::failure::{ExitStatus, Failure};
use crate::terminal::Terminal;
use crate::text::{counted, number};

pub(crate) fn execute(arguments: &RecoverArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let part = &arguments.file;
    Failure::unless_file(part)?;
    let out = match &arguments.output {
        Some(out) => out.clone(),
        None => default_output(part)?,
    };
    Failure::unless_file(&out)?;
    let recovered = read::recover(part, &out, arguments.force).map_err(|error| Failure::recording(&error))?;
    let unneeded = if recovered.skipped.is_empty() {
        format!("\n{} is no longer needed", part.display())
    } else {
        String::new()
    };
    terminal.report(&format!(
        "recovered {}, up to t = {} s, into {}{unneeded}",
        counted(recovered.frames, "frame", "frames"),
        number(recovered.last_time),
        recovered.path.display(),
    ))?;
    for damage in &recovered.skipped {
        terminal.warn(&format!("damaged, not recovered: {damage}"));
    }
    terminal.document(&json!({ "status": ExitStatus::Done, "recovered": recovered }))?;
    Ok(ExitStatus::Done)
}

/// The name without `.part`.
fn default_output(part: &Path) -> Result<PathBuf, Failure> {
    if part.extension().is_some_and(|extension| extension == "part") {
        return Ok(part.with_extension(""));
    }
    let mut left_over = part.as_os_str().to_owned();
    left_over.push(".part");
    let left_over = PathBuf::from(left_over);
    let advice = if left_over.exists() {
        format!("what its run left behind is {}", left_over.display())
    } else {
        "say with `-o` where to write".to_owned()
    };
    Err(Failure::usage(format!("{} does not end in .part; {advice}", part.display())))
}
