//! Work that shows what it finds to a function in Python, and ends when that raises something, or at Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use serde_json::Value;

use crate::document::from_json;
use crate::threads;

/// Who is shown what is found.
pub(crate) struct Watch {
    function: Option<Py<PyAny>>,
    raised: Mutex<Option<PyErr>>,
    /// Set where the work shall end.
    pub(crate) stop: Arc<AtomicBool>,
}

impl Watch {
    /// Shows it as Python's own types.
    pub(crate) fn show(&self, found: &Value) {
        let Some(function) = &self.function else { return };
        let shown = Python::attach(|py| function.call1(py, (from_json(py, found)?,)).map(drop));
        if let Err(error) = shown {
            self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Does `work` without the lock of the interpreter.
///
/// # Errors
/// What a signal's handler or the function raised; `work` panicked.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    function: Option<Py<PyAny>>,
    work: impl FnOnce(&Watch) -> T + Send,
) -> PyResult<T> {
    let watch = Watch { function, raised: Mutex::default(), stop: Arc::default() };
    let mut signal = None;
    let done = threads::interruptible(py, &watch.stop, &mut signal, || work(&watch))?;
    let raised = watch.raised.into_inner().unwrap_or_else(PoisonError::into_inner);
    signal.or(raised).map_or(Ok(done), Err)
}
