//! From NumPy's arrays to slices, and back.

use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

/// An array of doubles of any shape.
pub(crate) type Doubles<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Anything that NumPy makes an array of numbers from, of `shape`, as a contiguous one of doubles: itself
/// where it is one. Nothing is copied before its shape is known to be right. `what` names it in messages.
///
/// # Errors
/// `TypeError` of complex numbers and booleans, `ValueError` of another shape.
pub(crate) fn shaped<'py>(object: &Bound<'py, PyAny>, shape: &[usize], what: &str) -> PyResult<Doubles<'py>> {
    if let Ok(array) = object.cast::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
        && array.shape() == shape
    {
        return Ok(array.clone());
    }
    let py = object.py();
    let numpy = py.import("numpy")?;
    // A number alone is a list of one.
    let array = numpy.call_method1("atleast_1d", (object,))?;
    let array = array.cast::<PyUntypedArray>()?;
    if array.shape() != shape {
        let message = format!("{what} must have shape {}, got {}", tuple(shape), tuple(array.shape()));
        return Err(PyValueError::new_err(message));
    }
    let kind = match array.dtype().kind() {
        b'c' => "complex numbers",
        b'b' => "booleans",
        _ => {
            let options = [("dtype", "float64")].into_py_dict(py)?;
            let array = numpy.call_method("ascontiguousarray", (array,), Some(&options))?;
            return Ok(array.cast_into::<PyArrayDyn<f64>>()?);
        }
    };
    Err(PyTypeError::new_err(format!("{what} must be real numbers, got {kind}")))
}

/// The numbers of an array of `shape`, by rows.
pub(crate) fn rows(object: &Bound<'_, PyAny>, shape: &[usize], what: &str) -> PyResult<Vec<f64>> {
    Ok(shaped(object, shape, what)?.readonly().as_slice()?.to_vec())
}

/// The same, of finite numbers.
pub(crate) fn finite_rows(object: &Bound<'_, PyAny>, shape: &[usize], what: &str) -> PyResult<Vec<f64>> {
    let values = rows(object, shape, what)?;
    if let Some(i) = values.iter().position(|value| !value.is_finite()) {
        let width = shape.last().copied().unwrap_or(1);
        let message = format!("{what} must be finite, got {} at vertex {}", values[i], i / width);
        return Err(PyValueError::new_err(message));
    }
    Ok(values)
}

fn tuple(shape: &[usize]) -> String {
    let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
    format!("({}{})", sizes.join(", "), if shape.len() == 1 { "," } else { "" })
}

/// The same array, whose entries cannot be assigned: what is written into a copy would be lost in silence.
pub(crate) fn read_only(array: Doubles<'_>) -> PyResult<Doubles<'_>> {
    array.try_readwrite()?.make_nonwriteable();
    Ok(array)
}

/// A list of numbers as a new array of this shape.
pub(crate) fn array<'py>(py: Python<'py>, values: Vec<f64>, shape: &[usize]) -> PyResult<Doubles<'py>> {
    values.into_pyarray(py).reshape(shape.to_vec())
}

/// A table of vertex numbers.
pub(crate) fn indices<'py, const N: usize>(
    py: Python<'py>,
    cells: &[[u32; N]],
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    cells.as_flattened().to_vec().into_pyarray(py).reshape([cells.len(), N])
}

/// A list of counts.
pub(crate) fn counts<'py>(py: Python<'py>, values: &[usize]) -> Bound<'py, PyArray1<i64>> {
    values.iter().map(|value| *value as i64).collect::<Vec<i64>>().into_pyarray(py)
}

/// Makes an array one that cannot be written.
pub(crate) fn freeze(array: &Bound<'_, PyArray2<f64>>) -> PyResult<()> {
    let options = [("write", false)].into_py_dict(array.py())?;
    array.call_method("setflags", (), Some(&options))?;
    Ok(())
}

/// Vertex numbers below `count`.
pub(crate) fn vertices(object: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<u32>> {
    let numpy = object.py().import("numpy")?;
    let array = numpy.call_method1("atleast_1d", (object,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let list: Vec<i64> = match &kind[..] {
        "b" => array.call_method0("nonzero")?.get_item(0)?.call_method0("tolist")?.extract()?,
        "i" | "u" => array.call_method0("ravel")?.call_method0("tolist")?.extract()?,
        _ => return Err(PyValueError::new_err("vertices must be whole numbers, or a mask of booleans")),
    };
    if kind == "b" && array.len()? != count {
        let message = format!("a mask of vertices must have length {count}, got {}", array.len()?);
        return Err(PyValueError::new_err(message));
    }
    let vertex = |v: i64| match u32::try_from(v) {
        Ok(vertex) if (vertex as usize) < count => Ok(vertex),
        _ => Err(PyValueError::new_err(format!("there is no vertex {v}: there are {count}, from 0"))),
    };
    list.into_iter().map(vertex).collect()
}
