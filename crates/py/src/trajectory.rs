//! Recordings, for `pliant.load`.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use numpy::{IntoPyArray, PyArray1};
use pliant::diagnostics::RecordedField;
use pliant_record::RecordError;
use pliant_record::export::principal_stresses;
use pliant_record::read::{Column, RecordedRows, Trajectory, info, recover};
use pyo3::exceptions::{PyFileExistsError, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::Doubles;
use crate::simulation::contacts_table;
use crate::{arrays, document, errors};

/// Frames of a complete file, read one by one, for `Trajectory`.
#[pyclass(name = "Recording", frozen, module = "pliant._pliant")]
pub(crate) struct PyRecording {
    path: PathBuf,
    reader: Mutex<Trajectory>,
}

impl PyRecording {
    /// Reads without the lock of the interpreter.
    fn read<T: Send>(
        &self,
        py: Python<'_>,
        read: impl FnOnce(&mut Trajectory) -> Result<T, RecordError> + Send,
    ) -> PyResult<T> {
        let read = py.detach(|| read(&mut self.reader.lock().unwrap_or_else(PoisonError::into_inner)));
        read.map_err(|error| errors::record(&error))
    }

    fn frame<'py>(
        &self,
        py: Python<'py>,
        read: impl FnOnce(&mut Trajectory) -> Result<Vec<f64>, RecordError> + Send,
    ) -> PyResult<Doubles<'py>> {
        let (values, shape) =
            self.read(py, |reader| Ok((read(reader)?, [reader.vertex_count(), reader.dimension()])))?;
        arrays::array(py, values, &shape)
    }

    /// A field of elements or vertices by its name.
    fn field(&self, py: Python<'_>, name: &str, frame: usize) -> PyResult<RecordedRows> {
        let field = RecordedField::named(name).ok_or_else(|| {
            let names: Vec<&str> = RecordedField::all().map(|field| field.name).collect();
            PyValueError::new_err(format!("there is no measure {name:?}; there are {}", names.join(", ")))
        })?;
        self.read(py, |reader| reader.field(&field, frame))
    }

    fn columns<'py>(
        &self,
        py: Python<'py>,
        read: impl FnOnce(&mut Trajectory) -> Result<Vec<Column>, RecordError> + Send,
    ) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        for column in self.read(py, read)? {
            columns.set_item(column.name, column.values.into_pyarray(py))?;
        }
        Ok(columns)
    }
}

#[pymethods]
impl PyRecording {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let reader = py.detach(|| Trajectory::open(&path)).map_err(|error| errors::record(&error))?;
        Ok(PyRecording { path, reader: Mutex::new(reader) })
    }

    #[getter]
    fn dimension(&self, py: Python<'_>) -> PyResult<usize> {
        self.read(py, |reader| Ok(reader.dimension()))
    }

    #[getter]
    fn vertex_count(&self, py: Python<'_>) -> PyResult<usize> {
        self.read(py, |reader| Ok(reader.vertex_count()))
    }

    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.read(py, |reader| Ok(reader.times().to_vec()))?.into_pyarray(py))
    }

    fn positions<'py>(&self, py: Python<'py>, frame: usize) -> PyResult<Doubles<'py>> {
        self.frame(py, |reader| reader.positions(frame))
    }

    fn velocities<'py>(&self, py: Python<'py>, frame: usize) -> PyResult<Doubles<'py>> {
        self.frame(py, |reader| reader.velocities(frame))
    }

    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.columns(py, Trajectory::energy)
    }

    fn reactions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.columns(py, Trajectory::reactions)
    }

    fn probe<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
        self.columns(py, |reader| reader.probe(name))
    }

    fn contacts<'py>(&self, py: Python<'py>, frame: usize) -> PyResult<Bound<'py, PyDict>> {
        contacts_table(py, &self.read(py, |reader| reader.contacts(frame))?)
    }

    fn attachment<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyBytes>>> {
        Ok(self.read(py, |reader| reader.attachment(name))?.map(|bytes| PyBytes::new(py, &bytes)))
    }

    fn elements<'py>(&self, py: Python<'py>, measure: &str, frame: usize) -> PyResult<Doubles<'py>> {
        let rows = self.field(py, measure, frame)?;
        let width = rows.fields.len();
        let count = rows.values.len() / width;
        arrays::array(py, rows.values, &[count, width])
    }

    /// Which rows of [`elements`](Self::elements) are of which body: name, first row, number of rows.
    fn element_bodies(&self, py: Python<'_>, measure: &str) -> PyResult<Vec<(String, usize, usize)>> {
        let rows = self.field(py, measure, 0)?;
        Ok(rows.bodies.into_iter().map(|body| (body.name, body.first, body.count)).collect())
    }

    /// Principal values of the recorded `nodal-stress` at every vertex, in descending order.
    fn principal_stresses<'py>(&self, py: Python<'py>, frame: usize) -> PyResult<Doubles<'py>> {
        let rows = principal_stresses(&self.field(py, "nodal-stress", frame)?.values);
        let count = rows.len();
        arrays::array(py, rows.into_iter().flatten().collect(), &[count, 3])
    }

    /// Writes frames for other programs; returns the files.
    fn export(
        &self,
        py: Python<'_>,
        to: PathBuf,
        frames: (usize, usize, usize),
        overwrite: bool,
    ) -> PyResult<Vec<PathBuf>> {
        let exported = py.detach(|| pliant_cli::export(self.path.clone(), to, Some(frames), overwrite));
        exported.map_err(|(code, message)| match code {
            // What can be put right by another call.
            2 if message.contains(" exists; ") => {
                PyFileExistsError::new_err(message.replace("`--force`", "`overwrite=True`"))
            }
            2 => PyValueError::new_err(message.replace("`--frames N`", "`frames=`")),
            _ => PyOSError::new_err(message),
        })
    }

    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = py.detach(|| info(Path::new(&self.path))).map_err(|error| errors::record(&error))?;
        document::from_json(py, &serde_json::to_value(&found).unwrap_or_default())
    }
}

/// Makes a complete file of what a killed run left; says what is in it.
#[pyfunction]
pub(crate) fn _recover<'py>(
    py: Python<'py>,
    part: PathBuf,
    to: PathBuf,
    overwrite: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let recovered = py.detach(|| recover(&part, &to, overwrite)).map_err(|error| errors::record(&error))?;
    document::from_json(py, &serde_json::to_value(&recovered).unwrap_or_default())
}
