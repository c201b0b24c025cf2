//! Young's modulus as an array, one for each element: in a scene the largest of them, and factors of it.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use toml::{Table, Value};

/// Puts `elastic_factor` in the place of arrays of `young` in the bodies of a scene.
pub(crate) fn in_tables(tables: &mut Table) -> PyResult<()> {
    let bodies = tables.get_mut("body").and_then(Value::as_array_mut);
    for (i, body) in bodies.into_iter().flatten().enumerate() {
        let Some(body) = body.as_table_mut() else { continue };
        let Some(materials) = body.get_mut("elastic").and_then(Value::as_table_mut) else { continue };
        let mut factors = None;
        for (name, material) in materials.iter_mut() {
            let path = format!("body.{i}.elastic.{name}.young");
            if let Some(young) = material.get_mut("young")
                && let Some((largest, each)) = largest_and_factors(&path, young)?
            {
                (*young, factors) = (largest, Some(each));
            }
        }
        if let Some(factors) = factors
            && body.insert("elastic_factor".to_owned(), factors).is_some()
        {
            let message = format!("body.{i} has `elastic_factor` and `young` as an array: give one of them");
            return Err(PyValueError::new_err(message));
        }
    }
    Ok(())
}

/// A change of a scene: where `young` is an array, of its largest and of `elastic_factor`.
pub(crate) fn in_change(path: &str, value: Value) -> PyResult<Vec<(String, Value)>> {
    let parts: Vec<&str> = path.split('.').collect();
    if let ["body", body, "elastic", _, "young"] = parts[..]
        && let Some((largest, factors)) = largest_and_factors(path, &value)?
    {
        return Ok(vec![(path.to_owned(), largest), (format!("body.{body}.elastic_factor"), factors)]);
    }
    Ok(vec![(path.to_owned(), value)])
}

/// The largest of a list of positive numbers, and how much of it each is; `None` of what is no list.
fn largest_and_factors(path: &str, young: &Value) -> PyResult<Option<(Value, Value)>> {
    let Some(list) = young.as_array() else { return Ok(None) };
    let mut numbers = vec![];
    for (element, value) in list.iter().enumerate() {
        let number = value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
        match number.filter(|number| number.is_finite() && *number > 0.0) {
            Some(number) => numbers.push(number),
            None => {
                let message =
                    format!("`{path}` of element {element} is {value}: give a positive number [Pa]");
                return Err(PyValueError::new_err(message));
            }
        }
    }
    let largest = numbers.iter().copied().fold(f64::NAN, f64::max);
    if numbers.is_empty() {
        return Err(PyValueError::new_err(format!(
            "`{path}` is an empty array: give one number for each element"
        )));
    }
    let factors = numbers.iter().map(|number| Value::Float(number / largest)).collect();
    Ok(Some((Value::Float(largest), Value::Array(factors))))
}
