//! The file that a run is recorded to, or none.

use pliant::assembly::Assembly;
use pliant::observer::Observer;

use crate::arguments::RunArguments;
use crate::failure::Failure;
use crate::input::Input;

/// The recorder of a run; without one with `--no-record`.
pub(crate) struct Recording;

impl Recording {
    pub(crate) fn open(_: &RunArguments, _: &Input, _: &Assembly) -> Result<Recording, Failure> {
        Ok(Recording)
    }

    pub(crate) fn observer(&mut self) -> Option<&mut dyn Observer> {
        None
    }
}
