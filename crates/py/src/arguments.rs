//! Arguments as callers write them.

use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyString;

/// A number of steps, copies, modes, threads or bytes.
///
/// # Errors
/// `ValueError` for one below zero, or beyond what the type holds.
pub(crate) fn count<T: TryFrom<u64>>(object: &Bound<'_, PyAny>) -> PyResult<T> {
    let found = object.extract::<u64>().map(T::try_from);
    match found {
        Ok(Ok(count)) => Ok(count),
        Err(error) if !error.is_instance_of::<PyOverflowError>(object.py()) => Err(error),
        _ => {
            Err(PyValueError::new_err(format!("a count is a whole number from 0 on, got {}", object.str()?)))
        }
    }
}

/// The same, or `None`.
pub(crate) fn optional_count<T: TryFrom<u64>>(object: &Bound<'_, PyAny>) -> PyResult<Option<T>> {
    if object.is_none() { Ok(None) } else { count(object).map(Some) }
}

/// Names, or one alone.
pub(crate) fn names(object: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    if let Ok(name) = object.cast::<PyString>() {
        return Ok(vec![name.extract()?]);
    }
    object.extract().map_err(|_| {
        let kind = object.get_type().name().map_or_else(|_| "another type".into(), |name| name.to_string());
        PyTypeError::new_err(format!("a name, or a list of names, is wanted, got {kind}"))
    })
}
