//! Materials that are functions in Python.

use std::sync::PoisonError;

use numpy::PyArrayMethods;
use pliant::energy::batch::BatchMaterial;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::arrays;
use crate::simulation::Raised;

/// A `pliant.Material`.
pub(crate) struct PythonMaterial {
    density: Py<PyAny>,
    stress: Py<PyAny>,
    tangent: Option<Py<PyAny>>,
    dimension: usize,
    raised: Raised,
}

impl PythonMaterial {
    /// What its functions raise goes to `raised`.
    pub(crate) fn new(material: &Bound<'_, PyAny>, dimension: usize, raised: Raised) -> PyResult<Self> {
        let py = material.py();
        if !material.is_instance(&py.import("pliant.material")?.getattr("Material")?)? {
            let kind = material.get_type().name()?;
            return Err(PyTypeError::new_err(format!("a material is a pliant.Material, got a {kind}")));
        }
        let tangent = material.getattr("tangent")?;
        Ok(PythonMaterial {
            density: material.getattr("density")?.unbind(),
            stress: material.getattr("stress")?.unbind(),
            tangent: (!tangent.is_none()).then(|| tangent.unbind()),
            dimension,
            raised,
        })
    }

    /// Calls a function with the deformation gradients `f`; its values have `rank` more axes than there are gradients.
    fn call(&self, function: &Py<PyAny>, what: &str, f: &[f64], rank: usize, out: &mut [f64]) -> bool {
        let d = self.dimension;
        let count = f.len() / (d * d);
        let evaluated = Python::attach(|py| -> PyResult<()> {
            let f = arrays::array(py, f.to_vec(), &[count, d, d])?;
            let values = function.bind(py).call1((f,))?;
            let mut shape = vec![d; rank + 1];
            shape[0] = count;
            let values = arrays::shaped(&values, &shape, &format!("{what} of a material"))?;
            out.copy_from_slice(values.readonly().as_slice()?);
            Ok(())
        });
        let Err(error) = evaluated else { return true };
        // The first, if several threads ask.
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        false
    }
}

impl BatchMaterial for PythonMaterial {
    fn density(&self, f: &[f64], psi: &mut [f64]) -> bool {
        self.call(&self.density, "density", f, 0, psi)
    }

    fn stress(&self, f: &[f64], p: &mut [f64]) -> bool {
        self.call(&self.stress, "stress", f, 2, p)
    }

    fn tangent(&self, f: &[f64], tangent: &mut [f64]) -> Option<bool> {
        let function = self.tangent.as_ref()?;
        Some(self.call(function, "tangent", f, 4, tangent))
    }
}
