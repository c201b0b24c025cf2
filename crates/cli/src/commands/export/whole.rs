//! Exports of many frames to one file.

use std::ffi::OsStr;
use std::path::Path;

use pliant_record::export::Export;

use super::{chosen, replace};
use crate::arguments::ExportArguments;
use crate::failure::Failure;

/// A format that holds all frames in one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WholeFormat {
    /// Columns of `/energy`, `/reactions`, probes and measures.
    Csv,
    /// Arrays of NumPy.
    Npz,
    /// Binary glTF.
    Glb,
}

/// Endings of these formats.
const ENDINGS: [(&str, WholeFormat); 3] =
    [("csv", WholeFormat::Csv), ("npz", WholeFormat::Npz), ("glb", WholeFormat::Glb)];

/// The format of a file with this name; `None` for a folder and for other endings.
pub(super) fn format(to: &Path) -> Option<WholeFormat> {
    let ending = to.extension().and_then(OsStr::to_str).filter(|_| !to.is_dir())?.to_ascii_lowercase();
    ENDINGS.iter().find(|(known, _)| *known == ending).map(|(_, format)| *format)
}

/// Frames of a file that was written.
pub(super) struct WrittenFrames {
    /// How many.
    pub(super) frames: usize,
    /// The distance between them, where they are all that the format holds of a recording.
    pub(super) every: Option<usize>,
}

/// Writes the file. A `.glb` of a whole recording has as many frames as it may, evenly spaced.
///
/// # Errors
/// The recording cannot be read, the format cannot hold it, or the file is there.
pub(super) fn write(arguments: &ExportArguments, format: WholeFormat) -> Result<WrittenFrames, Failure> {
    let to = &arguments.to;
    if arguments.format.is_some() {
        return Err(Failure::usage(format!("{} is no name for what --format asks for", to.display())));
    }
    if format == WholeFormat::Csv && arguments.frames.is_some() {
        return Err(Failure::usage("a .csv has a row for each frame; leave out `--frames`"));
    }
    if format != WholeFormat::Glb && arguments.quantised {
        return Err(Failure::usage("`--quantised` goes with a .glb"));
    }
    Failure::unless_file(&arguments.file)?;
    super::super::render::refuse_existing(to, arguments.force)?;
    let mut export = Export::open(&arguments.file).map_err(|error| Failure::recording(&error))?;
    let mut frames = chosen(arguments.frames, export.times().len(), &arguments.file)?;
    let is_whole = frames.len() == export.times().len();
    let every = frames.len().div_ceil(Export::GLB_FRAMES);
    let every = (format == WholeFormat::Glb && is_whole && every > 1).then_some(every);
    if let Some(every) = every {
        frames = frames.into_iter().step_by(every).collect();
    }
    replace(to, |out| match format {
        WholeFormat::Csv => export.write_csv(out),
        WholeFormat::Npz => export.write_npz(&frames, out),
        WholeFormat::Glb => export.write_glb(&frames, arguments.quantised, out),
    })?;
    Ok(WrittenFrames { frames: frames.len(), every })
}
