//! Recordings as pages and pictures, for notebooks.

use std::path::PathBuf;

use pliant_view::drawing::{Colouring, DrawError, Drawing};
use pliant_view::page::{PageBudget, ViewerPage};
use pliant_view::picture::{Film, Fit, Image, RenderOptions, Style, Theme, ViewDirection, write_png};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors;
use crate::simulation::PySimulation;

/// Frames of the picture beside a page.
const SHOWN: usize = 3;
/// Width and height of each of its frames [pixel].
const SIZE: [usize; 2] = [400, 300];

fn failure(error: &DrawError) -> PyErr {
    match error {
        DrawError::Record(error) => errors::record(error),
        error => PyValueError::new_err(error.to_string()),
    }
}

/// The page that plays a recording, of at most `max_bytes` of packed data: text, number of frames in it,
/// number of frames of the recording, names of colourings that found no place.
#[pyfunction]
pub(crate) fn _page(
    py: Python<'_>,
    path: PathBuf,
    max_bytes: usize,
) -> PyResult<(String, usize, usize, Vec<String>)> {
    let budget = PageBudget { bytes: max_bytes, ..PageBudget::default() };
    let page = py.detach(|| ViewerPage::new(&mut Drawing::open(&path)?, &budget));
    let ViewerPage { html, frames, frame_count, left_out } = page.map_err(|error| failure(&error))?;
    Ok((html, frames, frame_count, left_out))
}

/// A picture of a recording as PNG: its only frame, or a few of them side by side.
#[pyfunction]
pub(crate) fn _picture(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyBytes>> {
    let image = py.detach(|| drawn(&path)).map_err(|error| failure(&error))?;
    let mut content = Vec::new();
    write_png(&image, &mut content).map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    Ok(PyBytes::new(py, &content))
}

fn drawn(path: &std::path::Path) -> Result<Image, DrawError> {
    let mut drawing = Drawing::open(path)?;
    let last = drawing.times().len() - 1;
    let mut frames: Vec<usize> = (0..SHOWN).map(|i| i * last / (SHOWN - 1)).collect();
    frames.dedup();
    let options = RenderOptions {
        style: Style { size: SIZE, theme: Theme::Light, transparent: false },
        direction: ViewDirection::default(),
        fit: Fit::Auto,
        colouring: Colouring::Body,
        range: None,
        labels: true,
    };
    let film = Film::read(&mut drawing, &frames, options)?;
    Ok(if film.len() == 1 { film.draw().swap_remove(0) } else { film.contact_sheet() })
}

#[pymethods]
impl PySimulation {
    /// Show the current state in a page with a movable camera, for notebooks and files, or run it live in a
    /// page.
    ///
    /// Parameters
    /// ----------
    /// live : bool, default False
    ///     True to run a copy of the simulation in the page, as in ``pliant live``: paced to real time, with
    ///     sliders, and vertices that can be dragged. A thread of this process serves it on loopback: the
    ///     browser must be on the same machine.
    /// max_bytes : int, default 2000000
    ///     Bytes of data in the page before encoding; data that do not fit are omitted, and the page says so.
    /// height : int, default 480
    ///     Height in a notebook [pixel].
    ///
    /// Returns
    /// -------
    /// View or LiveView
    ///     View that a notebook shows as the last expression of a cell; elsewhere use
    ///     ``.save("state.html")``, or ``.open()`` for a live one.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A number is below 1; or a live view is requested of a simulation with parts that are not in its
    ///     scene (materials and forces in Python, added pins).
    /// OSError
    ///     No port is available.
    ///
    /// Examples
    /// --------
    /// >>> page = simulation.view()
    #[pyo3(signature = (*, live = false, max_bytes = 2_000_000, height = 480))]
    fn view<'py>(
        slf: &Bound<'py, Self>,
        live: bool,
        max_bytes: i64,
        height: i64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        if live {
            return py.import("pliant.view")?.getattr("LiveView")?.call1((slf, height));
        }
        let bounds = PyDict::new(py);
        bounds.set_item("max_bytes", max_bytes)?;
        bounds.set_item("height", height)?;
        py.import("pliant.view")?.call_method("_of_state", (slf,), Some(&bounds))
    }
}
