//! The compiled half of the Python package `pliant`; the other half is in `python/pliant`.
//!
//! # How to add a method
//! 1. Write it in this folder with a numpydoc comment that gives shapes and units. Columns of reports take
//!    their descriptions and units from the doc comments of their fields in Rust.
//! 2. Add its line to `python/pliant/_pliant.pyi`: `stubtest` compares the two.
//! 3. Test it in `tests/python` of the workspace; `test_docs.py` there reads every docstring.
//! 4. To try it: `pip install maturin`, `maturin develop --profile dev` in `crates/py`,
//!    `pytest tests/python`.

mod arguments;
mod arrays;
mod batch;
mod document;
mod errors;
mod live;
mod material;
mod per_element;
mod reports;
mod run;
mod scene;
mod simulation;
mod state;
mod threads;
mod topology;
mod trajectory;
mod view;

use pyo3::prelude::*;

/// Contents of the package; users import it from `pliant`.
#[pymodule]
mod _pliant {
    #[pymodule_export]
    use super::batch::PyBatch;
    #[pymodule_export]
    use super::live::{_live, PyLiveRun};
    #[pymodule_export]
    use super::reports::{_catalogue, _columns, _errors, _refine, _solve, _stability, _stress, _study};
    #[pymodule_export]
    use super::run::PyFrame;
    #[pymodule_export]
    use super::scene::PyScene;
    #[pymodule_export]
    use super::simulation::{PySimulation, PySuperposition};
    #[pymodule_export]
    use super::state::PyState;
    #[pymodule_export]
    use super::threads::{_after_fork, _rollout};
    #[pymodule_export]
    use super::trajectory::{_recover, PyRecording};
    #[pymodule_export]
    use super::view::{_page, _picture};
    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    /// Runs the command line, the program's name first, and returns its exit code.
    #[pyfunction]
    fn _command(py: Python<'_>, arguments: Vec<std::ffi::OsString>) -> u8 {
        py.detach(|| pliant_cli::execute(arguments.into_iter()))
    }
}
