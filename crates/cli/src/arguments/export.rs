//! `pliant export`.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};

/// `pliant export`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ExportArguments {
    /// Recording (.mcap)
    pub(crate) file: PathBuf,
    /// A folder, or a file: .html (a page that plays it), .pvd (a series of .vtu files), .vtu or .obj (one
    /// frame), .glb (animated surfaces), .npz (arrays), .csv (energies, reactions, probes, extremes)
    #[arg(long, value_name = "DIR_OR_FILE")]
    pub(crate) to: PathBuf,
    /// Format of the files in a folder [default: vtu]
    #[arg(long)]
    pub(crate) format: Option<ExportFormat>,
    /// Frames, counted from 0: one (12), a range without its end (10..20), or a stride (0..100:10, ..:5)
    /// [default: all]
    #[arg(long, value_name = "A..B:STEP", allow_hyphen_values = true)]
    pub(crate) frames: Option<FrameRange>,
    /// Store positions of a .glb in 16 bits: smaller, for readers that support KHR_mesh_quantization
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
            word.parse::<usize>().map_err(|_| format!("`{word}` is not a frame; {what}"))
        };
        let (range, step) = match text.split_once(':') {
            Some((range, step)) => (range, number(step)?),
            None => (text, 1),
        };
        if step == 0 {
            return Err("the stride must be 1 or more".to_owned());
        }
        let (start, end) = match range.split_once("..") {
            Some((start, end)) => {
                let start = if start.is_empty() { 0 } else { number(start)? };
                (start, if end.is_empty() { None } else { Some(number(end)?) })
            }
            None if step > 1 => return Err("a stride needs a range, like 0..100:10".to_owned()),
            None => {
                let frame = number(range)?;
                (frame, frame.checked_add(1))
            }
        };
        if end.is_some_and(|end| end <= start) {
            return Err("the range is empty: its end is excluded".to_owned());
        }
        Ok(FrameRange { start, end, step })
    }
}
