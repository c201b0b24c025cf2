//! Materials that are functions in Python.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

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
    spent: Spent,
}

/// Time spent in functions of materials, all threads together.
#[derive(Clone, Default)]
pub(crate) struct Spent(Arc<AtomicU64>);

impl Spent {
    fn add(&self, time: Duration) {
        self.0.fetch_add(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    /// Takes what has been added since the last time.
    pub(crate) fn take(&self) -> Duration {
        Duration::from_nanos(self.0.swap(0, Ordering::Relaxed))
    }
}

impl PythonMaterial {
    /// Exceptions of its functions go to `raised`, the time that they take to `spent`.
    pub(crate) fn new(
        material: &Bound<'_, PyAny>,
        dimension: usize,
        raised: Raised,
        spent: Spent,
    ) -> PyResult<Self> {
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
            spent,
        })
    }

    /// Calls a function with the deformation gradients `f`; its values have `rank` more axes than there are
    /// gradients.
    fn call(&self, function: &Py<PyAny>, what: &str, f: &[f64], rank: usize, out: &mut [f64]) -> bool {
        let d = self.dimension;
        let count = f.len() / (d * d);
        let started = Instant::now();
        let evaluated = Python::attach(|py| -> PyResult<()> {
            let f = arrays::array(py, f.to_vec(), &[count, d, d])?;
            let values = function.bind(py).call1((f,))?;
            let mut shape = vec![d; rank + 1];
            shape[0] = count;
            let values = arrays::shaped(&values, &shape, &format!("{what} of a material"))?;
            out.copy_from_slice(values.readonly().as_slice()?);
            Ok(())
        });
        self.spent.add(started.elapsed());
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
