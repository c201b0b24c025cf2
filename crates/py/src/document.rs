//! From Python's dictionaries, lists and arrays to TOML, and from JSON to Python.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde_json::Value as Json;
use toml::{Table, Value};

/// Deeper than any scene; what holds itself has no end.
const DEEPEST: usize = 32;

/// A value of a scene: `None` where there is none. Arrays become lists, paths texts.
pub(crate) fn value(object: &Bound<'_, PyAny>, at: &str) -> PyResult<Option<Value>> {
    nested(object, at, 0)
}

fn nested(object: &Bound<'_, PyAny>, at: &str, depth: usize) -> PyResult<Option<Value>> {
    if depth > DEEPEST {
        return Err(PyValueError::new_err(format!("`{at}` is nested too deep to be part of a scene")));
    }
    if object.is_none() {
        return Ok(None);
    }
    let value = if let Ok(flag) = object.cast::<PyBool>() {
        Value::Boolean(flag.is_true())
    } else if object.is_instance_of::<PyInt>() {
        let too_large = |_| PyValueError::new_err(format!("`{at}` is too large a whole number: {object}"));
        Value::Integer(object.extract().map_err(too_large)?)
    } else if let Ok(number) = object.cast::<PyFloat>() {
        Value::Float(number.value())
    } else if let Ok(text) = object.cast::<PyString>() {
        Value::String(text.to_str()?.to_owned())
    } else if let Ok(table) = object.cast::<PyDict>() {
        return Ok(Some(Value::Table(dictionary(table, at, depth)?)));
    } else if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
        let mut items = vec![];
        for (i, item) in object.try_iter()?.enumerate() {
            let at = format!("{at}.{i}");
            let item = nested(&item?, &at, depth + 1)?;
            items.push(item.ok_or_else(|| PyTypeError::new_err(format!("`{at}` is None, in a list")))?);
        }
        Value::Array(items)
    } else if object.hasattr("tolist")? {
        return nested(&object.call_method0("tolist")?, at, depth + 1);
    } else if object.hasattr("__fspath__")? {
        Value::String(object.call_method0("__fspath__")?.extract()?)
    } else {
        let kind = object.get_type().name()?;
        return Err(PyTypeError::new_err(format!("`{at}` is a {kind}, which cannot be part of a scene")));
    };
    Ok(Some(value))
}

/// A table of a scene; entries that are `None` are left out.
pub(crate) fn table(dictionary: &Bound<'_, PyDict>) -> PyResult<Table> {
    self::dictionary(dictionary, "", 0)
}

fn dictionary(table: &Bound<'_, PyDict>, at: &str, depth: usize) -> PyResult<Table> {
    let mut entries = Table::new();
    for (key, value) in table {
        let key: String = key.extract().map_err(|_| PyTypeError::new_err("keys of a scene are texts"))?;
        let at = if at.is_empty() { key.clone() } else { format!("{at}.{key}") };
        if let Some(value) = nested(&value, &at, depth + 1)? {
            entries.insert(key, value);
        }
    }
    Ok(entries)
}

/// A JSON document as Python's own types.
pub(crate) fn from_json<'py>(py: Python<'py>, document: &Json) -> PyResult<Bound<'py, PyAny>> {
    Ok(match document {
        Json::Null => py.None().into_bound(py),
        Json::Bool(flag) => PyBool::new(py, *flag).to_owned().into_any(),
        Json::String(text) => PyString::new(py, text).into_any(),
        Json::Number(number) => match (number.as_i64(), number.as_u64()) {
            (Some(whole), _) => whole.into_pyobject(py)?.into_any(),
            (_, Some(whole)) => whole.into_pyobject(py)?.into_any(),
            _ => PyFloat::new(py, number.as_f64().unwrap_or(f64::NAN)).into_any(),
        },
        Json::Array(items) => {
            let items = items.iter().map(|item| from_json(py, item)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, items)?.into_any()
        }
        Json::Object(fields) => {
            let table = PyDict::new(py);
            for (key, value) in fields {
                table.set_item(key, from_json(py, value)?)?;
            }
            table.into_any()
        }
    })
}
