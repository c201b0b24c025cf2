//! placeholder
use crate::arguments::PlotArguments; use crate::failure::{ExitStatus, Failure}; use crate::terminal::Terminal;
pub(crate) fn execute(_: &PlotArguments, _: Terminal) -> Result<ExitStatus, Failure> { Ok(ExitStatus::Done) }
