//! placeholder
use crate::arguments::GalleryArguments; use crate::failure::{ExitStatus, Failure}; use crate::terminal::Terminal;
pub(crate) fn execute(_: &GalleryArguments, _: Terminal) -> Result<ExitStatus, Failure> { Ok(ExitStatus::Done) }
