//! Studies, the torture suite, surveys of steps: what commands report, as documents.

mod accuracy;
mod watch;

use std::path::PathBuf;

use numpy::IntoPyArray;
use pliant::solver::LinearSolver;
use pliant_lab::stability::{Against, Drift, MeasuredLimit, StabilitySurvey, SurveyError, SurveyOptions};
use pliant_lab::stress::{self, Case, CaseFilter, CaseResult, Picture};
use pliant_lab::study::report::{FigureKind, StudyReport};
use pliant_lab::study::{
    self, Event, ReferenceChoice, Results, Row, Study, StudyError, StudyPlan, WallClock,
};
use pliant_scene::vary::VariedKey;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use schemars::{JsonSchema, schema_for};
use serde_json::{Value, json};

use crate::document::{self, from_json};
use crate::scene::PyScene;
use crate::{arrays, errors};
pub(crate) use accuracy::{_errors, _refine, _solve};
use watch::{Watch, watched};

/// What to study beside what the scene says.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct StudyOptions {
    reference: String,
    repeats: Option<usize>,
    threads: usize,
    budget: Option<f64>,
    folder: Option<PathBuf>,
    report: Option<PathBuf>,
}

/// Makes a study of what `changes` make of a scene, with `vary` beside, each a path and its values.
#[pyfunction]
pub(crate) fn _study<'py>(
    py: Python<'py>,
    scene: &PyScene,
    changes: &Bound<'py, PyDict>,
    vary: Option<&Bound<'py, PyDict>>,
    options: StudyOptions,
    function: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    if let Some(vary) = vary {
        changes.set_item("study.vary", axes(vary)?)?;
    }
    let scene = scene.changed(changes)?;
    let source = &scene.source;
    let plan = StudyPlan::of(&scene.scene).map_err(|problems| errors::scene(py, &source.error(problems)))?;
    let reference = match &options.reference[..] {
        "auto" => ReferenceChoice::Auto,
        "exact" => ReferenceChoice::Exact,
        "computed" => ReferenceChoice::Computed,
        other => {
            let message = format!("reference is \"auto\", \"exact\" or \"computed\", got {other:?}");
            return Err(PyValueError::new_err(message));
        }
    };
    let plan = StudyPlan {
        reference,
        budget: options.budget.or(plan.budget),
        repeats: options.repeats,
        threads: options.threads,
        ..plan
    };
    if let Some(folder) = &options.folder {
        std::fs::create_dir_all(folder)?;
    }
    let (name, provenance, clock) = (scene.stem(), pliant_cli::provenance(), WallClock::default());
    let made = watched(py, function, |watch| {
        let folder = options.folder.as_deref();
        let study = Study {
            source,
            name: &name,
            plan: &plan,
            folder,
            provenance: &provenance,
            clock: &clock,
            interrupt: &watch.stop,
        };
        study.run(&mut |event| {
            if let Event::Finished(row) = event {
                watch.show(&json!(row));
            }
        })
    })?;
    let results = made.map_err(|error| match error {
        StudyError::Scene(problems) => errors::scene(py, &source.error(problems)),
        StudyError::Variant(error) => errors::scene(py, &error),
        StudyError::NoDuration | StudyError::NotExact | StudyError::Static => {
            PyValueError::new_err(error.to_string())
        }
        StudyError::File { .. } => PyOSError::new_err(error.to_string()),
        error => PyRuntimeError::new_err(error.to_string()),
    })?;
    if let Some(path) = &options.report {
        std::fs::write(path, py.detach(|| html(&results))?)?;
    }
    let mut document = pliant_cli::study_document(std::slice::from_ref(&results))["studies"][0].take();
    document["columns"] = study::columns().collect();
    from_json(py, &document)
}

/// `{"path": [1, 2]}` as a scene writes it.
fn axes(vary: &Bound<'_, PyDict>) -> PyResult<Vec<String>> {
    let axis = |(path, values): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let path: String = path.extract()?;
        let values = document::value(&values, &path)?;
        let Some(toml::Value::Array(values)) = values.filter(|v| v.as_array().is_some_and(|v| !v.is_empty()))
        else {
            return Err(PyValueError::new_err(format!(
                "`{path}` is varied by a list of values, one or more"
            )));
        };
        Ok(VariedKey { path, values: values.iter().map(toml::Value::to_string).collect() }.to_string())
    };
    vary.iter().map(axis).collect()
}

fn html(results: &Results) -> PyResult<String> {
    let title = format!("Error against run time: {}", results.title);
    let report = StudyReport::new(&title, std::slice::from_ref(results), &FigureKind::ALL);
    Ok(report.map_err(|error| PyRuntimeError::new_err(error.to_string()))?.html())
}

/// Which cases to run.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct StressOptions {
    only: Vec<String>,
    materials: Vec<String>,
    integrators: Vec<String>,
    solvers: Vec<String>,
    quick: bool,
}

/// Runs the torture suite, or puts a scene through it: documents of the cases, and their end states.
#[pyfunction]
pub(crate) fn _stress<'py>(
    py: Python<'py>,
    scene: Option<&PyScene>,
    options: StressOptions,
    function: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyList>)> {
    let StressOptions { only, materials, integrators, solvers, quick } = options;
    let solver = |text: &String| {
        let found = LinearSolver::ALL.into_iter().find(|solver| solver.name().eq_ignore_ascii_case(text));
        found.ok_or_else(|| {
            let names = LinearSolver::ALL.map(LinearSolver::name).join(", ");
            PyValueError::new_err(format!("there is no linear solver {text:?}; there are {names}"))
        })
    };
    let solvers = solvers.iter().map(solver).collect::<PyResult<_>>()?;
    let choice = CaseFilter { only, materials, integrators, solvers, quick, long: false };
    let cases = match scene {
        Some(scene) => {
            stress::scene_cases(&scene.source, &choice).map_err(|error| errors::scene(py, &error))?
        }
        None => stress::cases(&choice),
    };
    if cases.is_empty() {
        let what = "no case is of these rows, materials, integrators and solvers";
        return Err(PyValueError::new_err(format!(
            "{what}; rows are \"torture\", \"D1\" to \"D13\", \"K18\" and \"K18-long\""
        )));
    }
    let results = watched(py, function, |watch| {
        let mut results: Vec<(Case, CaseResult)> = vec![];
        for case in cases {
            if watch.is_stopped() {
                break;
            }
            let findings = case.run();
            watch.show(&pliant_cli::stress_case(&case, &findings));
            results.push((case, findings));
        }
        results
    })?;
    let documents = results.iter().map(|(case, findings)| pliant_cli::stress_case(case, findings)).collect();
    let pictures =
        results.iter().map(|(_, findings)| findings.picture.as_ref().map(|p| picture(py, p)).transpose());
    let pictures = PyList::new(py, pictures.collect::<PyResult<Vec<_>>>()?)?;
    Ok((from_json(py, &documents)?, pictures))
}

/// Positions, corners of triangles, and J of the element that each is of.
fn picture<'py>(py: Python<'py>, picture: &Picture) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let shape = [picture.x.len() / picture.dimension, picture.dimension];
    table.set_item("positions", arrays::array(py, picture.x.clone(), &shape)?)?;
    table.set_item("triangles", arrays::indices(py, &picture.triangles)?)?;
    table.set_item("J", picture.j.clone().into_pyarray(py))?;
    Ok(table)
}

/// Looks for the largest steps of a scene.
#[pyfunction]
pub(crate) fn _stability<'py>(
    py: Python<'py>,
    scene: &PyScene,
    integrators: Vec<String>,
    against: Option<&str>,
    quick: bool,
    function: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let known = |name: &str| {
        let known = Against::ALL.into_iter().find(|known| known.name() == name);
        known.ok_or_else(|| {
            let names = "\"young\", \"poisson\", \"density\" or \"gravity\"";
            PyValueError::new_err(format!("against is {names}, got {name:?}"))
        })
    };
    let against = against.map(known).transpose()?;
    let choice = SurveyOptions { integrators, against, quick, ..SurveyOptions::default() };
    let found = watched(py, function, |watch: &Watch| {
        StabilitySurvey::of(&scene.source, &choice, &watch.stop, &mut |found| {
            watch.show(&json!({ "limit": found.limits.last(), "drift": found.drifts.last() }));
        })
    })?;
    let found = found.map_err(|error| match error {
        SurveyError::Scene(error) => errors::scene(py, &error),
        error => PyValueError::new_err(error.to_string()),
    })?;
    from_json(py, &json!(found))
}

/// What columns of a report are about, with their units: the words of the library.
#[pyfunction]
pub(crate) fn _columns<'py>(py: Python<'py>, report: &str) -> PyResult<Bound<'py, PyDict>> {
    let described = match report {
        "study" => described::<Row>(),
        "stress" => described::<CaseResult>(),
        "stability" => described::<MeasuredLimit>().into_iter().chain(described::<Drift>()).collect(),
        _ => return Err(PyValueError::new_err(format!("there is no report {report:?}"))),
    };
    let table = PyDict::new(py);
    for (name, text) in described {
        table.set_item(name, text)?;
    }
    Ok(table)
}

/// Fields and their documentation.
fn described<T: JsonSchema>() -> Vec<(String, String)> {
    let schema = schema_for!(T);
    let fields = schema.as_value()["properties"].as_object().cloned().unwrap_or_default();
    let text = |field: &Value| {
        // What is a type of its own has its words beside the reference.
        let words = field["description"].as_str().unwrap_or_default();
        words.split_whitespace().collect::<Vec<_>>().join(" ").replace('`', "``")
    };
    fields.iter().map(|(name, field)| (name.clone(), text(field))).collect()
}

/// Members of each family that scenes can name.
#[pyfunction]
pub(crate) fn _catalogue<'py>(py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
    let families =
        pliant_cli::listed().into_iter().map(|(name, items)| (name.to_owned(), Value::Array(items)));
    from_json(py, &Value::Object(families.collect()))
}
