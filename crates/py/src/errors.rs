//! Errors as Python's exceptions.

use std::io;

use pliant::energy::Fault;
use pliant::simulation::StepError as Step;
use pliant_record::RecordError;
use pliant_record::checkpoint::CheckpointError;
use pliant_scene::{Problem, SceneError as Error};
use pyo3::exceptions::{
    PyFileExistsError, PyFileNotFoundError, PyIndexError, PyKeyError, PyOSError, PyRuntimeWarning,
    PyValueError,
};
use pyo3::prelude::*;

use crate::document::from_json;

mod types {
    #![allow(missing_docs)]
    pyo3::import_exception!(pliant._errors, SceneError);
    pyo3::import_exception!(pliant._errors, StepError);
}

/// A `RuntimeWarning` where Python called.
pub(crate) fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let category = py.get_type::<PyRuntimeWarning>();
    py.import("warnings")?.call_method1("warn", (text, category)).map(drop)
}

/// `SceneError(message, problems)`.
pub(crate) fn scene(py: Python<'_>, error: &Error) -> PyErr {
    let problems: Vec<&Problem> = error.problems().iter().collect();
    let document = serde_json::to_value(&problems).unwrap_or_default();
    match from_json(py, &document) {
        Ok(problems) => types::SceneError::new_err((error.render(false), problems.unbind())),
        Err(error) => error,
    }
}

/// `StepError(message, step, time, element, J, body, vertex, step_size, stable_step)`.
pub(crate) fn step(error: &Step) -> PyErr {
    let (step, time, step_size, stable) = match error {
        Step::NotFinite { step, time, step_size, stable_step, .. }
        | Step::Unstable { step, time, step_size, stable_step, .. } => {
            (*step, *time, *step_size, *stable_step)
        }
        Step::Unsolved { step, time, step_size, .. } | Step::StepTooSmall { step, time, step_size, .. } => {
            (*step, *time, *step_size, None)
        }
    };
    let vertex = error.vertex();
    let (element, j, body) = match error.fault() {
        Some(Fault::Element { body, element, j, .. } | Fault::Material { body, element, j, .. }) => {
            (Some(*element), Some(*j), Some(body.clone()))
        }
        Some(Fault::Sheet { body, element, .. }) => (Some(*element), None, Some(body.clone())),
        Some(Fault::Spring { body, spring, .. }) => (Some(*spring), None, Some(body.clone())),
        Some(Fault::Stencil { body, index, .. }) => (Some(*index), None, Some(body.clone())),
        _ => (None, None, None),
    };
    types::StepError::new_err((error.to_string(), step, time, element, j, body, vertex, step_size, stable))
}

/// A checkpoint that could not be written or gone on from.
pub(crate) fn checkpoint(error: &CheckpointError) -> PyErr {
    let message = error.to_string();
    match error {
        CheckpointError::Read { source, .. } if source.kind() == io::ErrorKind::NotFound => {
            PyFileNotFoundError::new_err(message)
        }
        CheckpointError::Read { .. } | CheckpointError::Write { .. } => PyOSError::new_err(message),
        _ => PyValueError::new_err(message),
    }
}

/// An `OSError` of the right kind where a file is the trouble, an `IndexError` where a frame is, and a
/// `KeyError` where a channel is.
pub(crate) fn record(error: &RecordError) -> PyErr {
    let message = error.to_string();
    match error {
        RecordError::Exists { .. } | RecordError::LeftOver { .. } | RecordError::InUse { .. } => {
            // The words of the command line.
            PyFileExistsError::new_err(
                message.replace("`-o`", "`record=`").replace("`--force`", "`overwrite=True`"),
            )
        }
        RecordError::Read { source, .. } if source.kind() == io::ErrorKind::NotFound => {
            PyFileNotFoundError::new_err(message)
        }
        RecordError::Read { .. } | RecordError::Write { .. } | RecordError::Incomplete { .. } => {
            PyOSError::new_err(message)
        }
        RecordError::NoFrame { .. } => PyIndexError::new_err(message),
        RecordError::NoChannel { .. } => PyKeyError::new_err(message),
        _ => PyValueError::new_err(message),
    }
}
