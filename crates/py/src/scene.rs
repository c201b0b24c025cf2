//! Scenes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pliant::quantity::counted;
use pliant_lab::fit::key_path;
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{self as core, SceneError, Source};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::{document, errors, per_element, threads};

/// Scene: bodies, world, time integration and output of a simulation.
///
/// Its keyword arguments are the tables of a scene file (``docs/scene-format.md`` has every key), with
/// dictionaries for tables and lists or arrays for lists. `from_toml` reads TOML. Both are checked by the
/// same code.
///
/// Parameters
/// ----------
/// **tables
///     ``dimension``, ``time``, ``world``, ``body``, ... as in a scene file. Numbers are in SI units;
///     strings may carry a unit: ``"3 MPa"``. ``young`` of a material may be an array with one value per
///     element: the scene then has the largest one, and ``elastic_factor``.
///
/// Raises
/// ------
/// SceneError
///     The scene cannot be simulated. Lines and columns refer to the scene written as TOML, `text`.
///
/// Examples
/// --------
/// >>> scene = Scene(
/// ...     dimension=2,
/// ...     time={"integrator": "symplectic-euler", "step": 1e-3, "duration": 1.0},
/// ...     world={"gravity": [0.0, -9.8]},
/// ...     body=[{
/// ...         "mesh": {"grid": {"cells": [4, 1], "spacing": 0.1}},
/// ...         "elastic": {"corotated": {"young": 1e5, "poisson": 0.3}},
/// ...         "mass": {"density": 1000.0},
/// ...     }],
/// ... )
#[pyclass(name = "Scene", frozen, module = "pliant", from_py_object)]
#[derive(Clone)]
pub(crate) struct PyScene {
    pub(crate) source: Arc<Source>,
    pub(crate) scene: Arc<core::Scene>,
}

impl PyScene {
    pub(crate) fn of(py: Python<'_>, source: Source) -> PyResult<Self> {
        let scene = source.scene().map_err(|error| errors::scene(py, &error))?;
        Ok(PyScene { source: Arc::new(source), scene: Arc::new(scene) })
    }

    /// Builds the simulation; problems that show only then are located in the text.
    pub(crate) fn assemble(&self, py: Python<'_>) -> PyResult<Assembly> {
        let assembled = py.detach(|| threads::run(|| self.scene.assemble(UnstableStep::Refuse)));
        assembled.map_err(|problems| errors::scene(py, &self.source.error(problems)))
    }

    /// What files of it are called: the name of its own without folder and ending.
    pub(crate) fn stem(&self) -> String {
        let stem = Path::new(self.source.name()).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        stem.filter(|stem| stem != "<scene>").unwrap_or_else(|| "scene".to_owned())
    }

    /// The path of a key, of one that is named as `gradient` names it too: by the name of its body, without
    /// that of the material.
    fn whole_path(&self, path: String) -> PyResult<String> {
        let name = path.strip_suffix("_per_element").unwrap_or(&path);
        if !(name.ends_with(".elastic.young") || name.ends_with(".elastic.poisson")) {
            return Ok(path);
        }
        key_path(&self.source, &self.scene, name).map_err(|error| PyKeyError::new_err(error.to_string()))
    }

    /// The same scene with values changed, `{"time.step": 1e-3}`.
    pub(crate) fn changed(&self, changes: &Bound<'_, PyDict>) -> PyResult<Self> {
        let py = changes.py();
        let mut overrides = vec![];
        for (path, value) in changes {
            let path: String = path.extract()?;
            let path = self.whole_path(path)?;
            let Some(value) = document::value(&value, &path)? else {
                return Err(PyTypeError::new_err(format!("`{path}` is None: name a value")));
            };
            let parts = per_element::in_change(&path, value)?;
            overrides.extend(parts.into_iter().map(|(path, value)| (path, value.to_string())));
        }
        let source = self.source.varied(&overrides);
        PyScene::of(py, source.map_err(|error| errors::scene(py, &error))?)
    }
}

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(signature = (*given, **tables), text_signature = "(**tables)")]
    fn new(py: Python<'_>, given: &Bound<'_, PyTuple>, tables: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        if let Ok(given) = given.get_item(0) {
            let kind = given.get_type().name()?;
            let message = format!("a scene is made of keyword arguments, its tables, got `{kind}`");
            return Err(PyTypeError::new_err(message + "; `Scene.from_toml(path)` reads a file"));
        }
        let mut table = tables.map_or_else(|| Ok(toml::Table::new()), document::table)?;
        per_element::in_tables(&mut table)?;
        let text = toml::to_string(&table)
            .map_err(|error| PyTypeError::new_err(format!("the scene cannot be written as TOML: {error}")))?;
        PyScene::of(py, Source::new("<scene>", text).made_from_tables())
    }

    /// Read a scene written in TOML.
    ///
    /// Parameters
    /// ----------
    /// path_or_text : str or os.PathLike
    ///     A file, or the text itself, which has more than one line or an equals sign. File names in a scene
    ///     are relative to its directory, or for a text to the working directory.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     The file cannot be read, is not TOML, or cannot be simulated; with line and column.
    ///
    /// Examples
    /// --------
    /// >>> scene = Scene.from_toml("scenes/cantilever_fem_2d.toml")
    /// >>> scene.bodies
    /// ['beam']
    #[staticmethod]
    fn from_toml(py: Python<'_>, path_or_text: &Bound<'_, PyAny>) -> PyResult<Self> {
        let source = match path_or_text.extract::<String>() {
            Ok(text) if text.contains(['\n', '=']) => Ok(Source::new("<scene>", text)),
            _ => Source::from_path(path_or_text.extract::<PathBuf>()?),
        };
        let located = |error: SceneError| errors::scene(py, &error);
        PyScene::of(py, source.map_err(located)?)
    }

    /// Return a copy of the scene with some values changed.
    ///
    /// Parameters
    /// ----------
    /// changes : dict
    ///     New values by path, as for ``--set`` on the command line: ``{"time.step": 1e-3,
    ///     "body.0.elastic.corotated.young": "2 MPa"}``. Entries of lists are counted from 0. Moduli may have
    ///     their names of `Simulation.gradient`, ``"body.beam.elastic.young"``, and ``young`` may be an array
    ///     with one value per element. A single ``young`` keeps an ``elastic_factor``.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     There is no such path, or the changed scene cannot be simulated.
    ///
    /// Examples
    /// --------
    /// >>> scene.with_changes({"time.step": "0.5 ms"}).step_size
    /// 0.0005
    fn with_changes(&self, changes: &Bound<'_, PyDict>) -> PyResult<Self> {
        self.changed(changes)
    }

    /// The value at a path.
    fn _value<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        let nowhere = || PyKeyError::new_err(format!("the scene has no value `{path}`"));
        let tables: toml::Table = self.text().parse().map_err(|_| nowhere())?;
        let (mut here, tables) = (None, toml::Value::Table(tables));
        for part in path.split('.') {
            let holder = here.unwrap_or(&tables);
            let next = part.parse::<usize>().ok().and_then(|index| holder.get(index));
            here = Some(next.or_else(|| holder.get(part)).ok_or_else(nowhere)?);
        }
        let value = serde_json::to_value(here.ok_or_else(nowhere)?).unwrap_or_default();
        document::from_json(py, &value)
    }

    /// The path of a number, with the name of the material that names of derivatives leave out.
    fn _path(&self, name: &str) -> PyResult<String> {
        key_path(&self.source, &self.scene, name).map_err(|error| PyKeyError::new_err(error.to_string()))
    }

    /// Write the scene as TOML.
    ///
    /// Returns
    /// -------
    /// str
    ///     Text of an equal scene, without the comments and order of `text`; quantities are numbers in SI
    ///     units.
    ///
    /// Examples
    /// --------
    /// >>> Scene.from_toml(scene.to_toml()) == scene
    /// True
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        self.scene.to_toml().map_err(|error| errors::scene(py, &error))
    }

    /// str: The text of the scene, changes included.
    #[getter]
    fn text(&self) -> &str {
        self.source.text()
    }

    /// str: Origin of the text: the path of a file, or ``<scene>``.
    #[getter]
    fn name(&self) -> &str {
        self.source.name()
    }

    /// str or None: Title of the scene.
    #[getter]
    fn title(&self) -> Option<&str> {
        self.scene.title.as_deref()
    }

    /// int: Space dimension, 2 or 3.
    #[getter]
    fn dimension(&self) -> usize {
        self.scene.dimension
    }

    /// float or None: Time step [s]; None if it is adaptive.
    #[getter]
    fn step_size(&self) -> Option<f64> {
        self.scene.time.step
    }

    /// float: Simulated time to run [s].
    #[getter]
    fn duration(&self) -> f64 {
        self.scene.time.duration
    }

    /// list of str: Names of the bodies.
    #[getter]
    fn bodies(&self) -> Vec<String> {
        self.scene.body.iter().enumerate().map(|(i, body)| body.name_or_default(i)).collect()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.scene == other.scene
    }

    fn __repr__(&self) -> String {
        let title = self.scene.title.as_deref().map_or(String::new(), |title| format!(", {title:?}"));
        format!(
            "<pliant.Scene {}: {} in {}D{title}>",
            self.name(),
            counted(self.scene.body.len() as u64, "body", "bodies"),
            self.scene.dimension
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let this = slf.get();
        let directory = this.source.directory().as_os_str();
        let is_made = this.source.is_made_from_tables();
        let state = (this.name(), this.text(), directory, is_made).into_pyobject(slf.py())?;
        Ok((slf.get_type().getattr("_restore")?, state))
    }

    /// What pickle calls.
    #[staticmethod]
    #[pyo3(signature = (name, text, directory, is_made = false))]
    fn _restore(
        py: Python<'_>,
        name: String,
        text: String,
        directory: PathBuf,
        is_made: bool,
    ) -> PyResult<Self> {
        let source = Source::new(name, text).in_directory(directory);
        PyScene::of(py, if is_made { source.made_from_tables() } else { source })
    }
}
