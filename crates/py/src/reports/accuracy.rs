//! Errors of quantities, total error against run time, and runs for a wished accuracy.

use pliant_lab::accuracy::{AccuracyError, AccuracySearch, WishedError};
use pliant_lab::budget::{BudgetError, BudgetEvent, error_budget};
use pliant_lab::quantity::{NoQuantity, QuantityOfInterest};
use pliant_lab::refinement::{RefinementError, RefinementPlan, RefinementStudy, StudiedSceneError};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use super::watch::watched;
use crate::document::from_json;
use crate::errors;
use crate::scene::PyScene;

/// Estimates the errors of quantities of a scene.
#[pyfunction]
pub(crate) fn _errors<'py>(
    py: Python<'py>,
    scene: &PyScene,
    of: Vec<String>,
    function: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let quantities = of.iter().map(|name| quantity(name)).collect::<PyResult<Vec<_>>>()?;
    let found = watched(py, function, |watch| {
        error_budget(&scene.source, &quantities, &watch.stop, &mut |event| {
            if let BudgetEvent::Begun(run) = event {
                watch.show(&json!(run));
            }
        })
    })?;
    let found = found.map_err(|error| match error {
        BudgetError::Scene(error) => errors::scene(py, &error),
        BudgetError::Unfinished => PyRuntimeError::new_err(error.to_string()),
        error => PyValueError::new_err(error.to_string()),
    })?;
    from_json(py, &json!(found))
}

/// Compares meshes, elements, schemes and steps on what `changes` make of a scene.
#[pyfunction]
pub(crate) fn _refine<'py>(
    py: Python<'py>,
    scene: &PyScene,
    changes: &Bound<'py, PyDict>,
    budget: Option<f64>,
    threads: usize,
    function: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let scene = scene.changed(changes)?;
    let failed = |error| match error {
        RefinementError::Scene(StudiedSceneError::Scene(error)) => errors::scene(py, &error),
        RefinementError::Plan(problems) => errors::scene(py, &scene.source.error(problems)),
        RefinementError::NoRun(_) | RefinementError::Interrupted | RefinementError::Threads { .. } => {
            PyRuntimeError::new_err(error.to_string())
        }
        error => PyValueError::new_err(error.to_string()),
    };
    let mut plan = RefinementPlan::of(&scene.scene).map_err(failed)?;
    (plan.budget, plan.threads) = (budget.unwrap_or(plan.budget), threads);
    let found = watched(py, function, |watch| {
        RefinementStudy { source: &scene.source, plan: &plan, interrupt: &watch.stop }
            .run(&mut |run| watch.show(&json!(run)))
    })?;
    let found = found.map_err(failed)?;
    let mut document = json!(found);
    let elements = found.rows.iter().map(|row| row.family.words(found.dimension));
    document["elements"] = elements.collect();
    from_json(py, &document)
}

/// Finds a run whose error of a quantity is small enough.
#[pyfunction]
pub(crate) fn _solve<'py>(
    py: Python<'py>,
    scene: &PyScene,
    of: &str,
    error: &str,
    budget: f64,
    function: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let quantity = quantity(of)?;
    let wish =
        WishedError::parse(error, &quantity).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let found = watched(py, function, |watch| {
        let interrupt = &watch.stop;
        let search = AccuracySearch { source: &scene.source, quantity: &quantity, wish, budget, interrupt };
        search.run(&mut |run| watch.show(&json!(run)))
    })?;
    let found = found.map_err(|error| match error {
        AccuracyError::Scene(StudiedSceneError::Scene(error)) => errors::scene(py, &error),
        AccuracyError::NotReached(_) | AccuracyError::Interrupted => {
            PyRuntimeError::new_err(error.to_string())
        }
        error => PyValueError::new_err(error.to_string()),
    })?;
    from_json(py, &json!(found))
}

fn quantity(name: &str) -> PyResult<QuantityOfInterest> {
    name.parse().map_err(|error: NoQuantity| PyValueError::new_err(error.to_string()))
}
