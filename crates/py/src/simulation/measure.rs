//! Measurements of a simulation.

use numpy::{IntoPyArray, PyArray1};
use pliant::diagnostics::recovery::Recovery;
use pliant::diagnostics::{Diagnostics, ElementState, MEASURES, Measure};
use pliant::energy::SurfaceContact;
use pliant::simulation::{AppliedForces, MatrixError, SparseMatrix};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::{Inner, PySimulation};
use crate::arrays::Doubles;
use crate::{arrays, document, threads};

/// Energies by their names, those of the balance with its name before.
pub(crate) fn energies<'py>(py: Python<'py>, measured: &Diagnostics) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    table.set_item("kinetic", measured.kinetic)?;
    table.set_item("elastic", measured.elastic)?;
    table.set_item("gravitational", measured.gravitational)?;
    for (name, energy) in measured.further_energies() {
        table.set_item(name, energy)?;
    }
    table.set_item("total", measured.total)?;
    if let Some(balance) = &measured.balance {
        let fields = serde_json::to_value(balance).unwrap_or_default();
        for (name, value) in fields.as_object().into_iter().flatten() {
            table.set_item(format!("balance.{name}"), value.as_f64())?;
        }
    }
    Ok(table)
}

/// A measure by its name.
fn measure_named(name: &str) -> PyResult<&'static Measure> {
    MEASURES.iter().find(|measure| measure.name == name).ok_or_else(|| {
        let names: Vec<&str> = MEASURES.iter().map(|measure| measure.name).collect();
        PyValueError::new_err(format!("there is no measure {name:?}; there are {}", names.join(", ")))
    })
}

impl Inner {
    fn diagnostics(&mut self, py: Python<'_>) -> PyResult<Diagnostics> {
        let simulation = &mut self.simulation;
        let measured = py.detach(|| threads::run(|| simulation.diagnostics()));
        match self.additions.raised() {
            Some(raised) => Err(raised),
            None => Ok(measured),
        }
    }

    fn elements(&self, py: Python<'_>) -> Vec<ElementState> {
        py.detach(|| threads::run(|| self.simulation.element_states()))
    }
}

/// A table by names; those that several have get a number from the second on.
fn by_name<'py, T: IntoPyObject<'py>>(
    py: Python<'py>,
    entries: Vec<(String, T)>,
) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    for (name, value) in entries {
        let mut key = name.clone();
        let mut number = 1;
        while table.contains(&key)? {
            number += 1;
            key = format!("{name} {number}");
        }
        table.set_item(key, value)?;
    }
    Ok(table)
}

impl PySimulation {
    /// Positions and velocities that were given, each of the shape of the simulation's.
    fn given_rows(
        &self,
        positions: Option<Bound<'_, PyAny>>,
        velocities: Option<Bound<'_, PyAny>>,
    ) -> PyResult<[Option<Vec<f64>>; 2]> {
        let rows = |given: Option<Bound<'_, PyAny>>, what| {
            given.map(|given| arrays::finite_rows(&given, &self.shape(), what)).transpose()
        };
        Ok([rows(positions, "positions")?, rows(velocities, "velocities")?])
    }

    fn applied_forces(
        &self,
        py: Python<'_>,
        positions: Option<Bound<'_, PyAny>>,
        velocities: Option<Bound<'_, PyAny>>,
    ) -> PyResult<AppliedForces> {
        let [x, v] = self.given_rows(positions, velocities)?;
        let mut inner = self.lock()?;
        let simulation = &mut inner.simulation;
        let found = py.detach(|| threads::run(|| simulation.forces(x.as_deref(), v.as_deref())));
        found.map_err(|error| inner.failed(py, PyValueError::new_err(error.to_string())))
    }
}

#[pymethods]
impl PySimulation {
    /// Compute energies, at the current or a given state.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, shape (n, dim), optional
    ///     Positions [m]; default: the current ones.
    /// velocities : array_like, shape (n, dim), optional
    ///     Velocities [m/s]; default: the current ones.
    /// by_term : bool, default False
    ///     True for the potential energy of each term, by name: ``elements of `beam```.
    ///
    /// Returns
    /// -------
    /// dict of str to float
    ///     ``kinetic``, ``elastic``, ``gravitational``, ``loads`` (if there are any), ``total`` [J], and for
    ///     the current state the external work and dissipation since the start, or since the last change of
    ///     the state or the scene: ``balance.motion``, ``balance.loads``, ``balance.gravity``,
    ///     ``balance.ether_drag``, ``balance.damping``, ``balance.friction``, ``balance.walls``.
    ///
    /// Notes
    /// -----
    /// Time-dependent quantities are evaluated at `time`. Outside the domain of a material the energy is
    /// infinite.
    ///
    /// Examples
    /// --------
    /// >>> simulation.energy()["kinetic"]
    /// 0.0
    /// >>> simulation.energy(simulation.positions)["elastic"] == simulation.energy()["elastic"]
    /// True
    #[pyo3(signature = (positions = None, velocities = None, *, by_term = false))]
    fn energy<'py>(
        &self,
        py: Python<'py>,
        positions: Option<Bound<'py, PyAny>>,
        velocities: Option<Bound<'py, PyAny>>,
        by_term: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let [x, v] = self.given_rows(positions, velocities)?;
        let (x, v) = (x.as_deref(), v.as_deref());
        let mut inner = self.lock()?;
        if x.is_none() && v.is_none() && !by_term {
            return energies(py, &inner.diagnostics(py)?);
        }
        let simulation = &mut inner.simulation;
        if by_term {
            let found = py.detach(|| threads::run(|| simulation.potential_energies(x)));
            inner.additions.raised().map_or(Ok(()), Err)?;
            return by_name(py, found);
        }
        let found = py.detach(|| threads::run(|| simulation.diagnostics_at(x, v)));
        inner.additions.raised().map_or(Ok(()), Err)?;
        energies(py, &found)
    }

    /// Compute the forces on all vertices, at the current or a given state, for custom integrators.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, shape (n, dim), optional
    ///     Positions [m]; default: the current ones. Vertices of moving pins keep their prescribed positions.
    /// velocities : array_like, shape (n, dim), optional
    ///     Velocities [m/s], for damping, friction and drag; default: the current ones.
    /// by_term : bool, default False
    ///     True for the force of each term, by name: ``elements of `beam```.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (n, dim), or dict of str to such arrays
    ///     ``-dE/dx - dR/dv - c m v`` [N]: elements, springs, bending, gravity, loads, muscles, attachments,
    ///     contact and `external_forces`, then damping and friction, then ether drag.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     An array has the wrong shape or is not finite, or the force is not finite there.
    ///
    /// Notes
    /// -----
    /// Time-dependent quantities are evaluated at `time`. Walls without ``[contact]`` move vertices back
    /// after a step, and pins fix theirs: neither is a force, and forces at pinned vertices are carried by
    /// the pins. A step computes with `accelerations`, bit for bit.
    ///
    /// Examples
    /// --------
    /// >>> simulation.forces().shape
    /// (10, 2)
    #[pyo3(signature = (positions = None, velocities = None, *, by_term = false))]
    fn forces<'py>(
        &self,
        py: Python<'py>,
        positions: Option<Bound<'py, PyAny>>,
        velocities: Option<Bound<'py, PyAny>>,
        by_term: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let AppliedForces { terms, .. } = self.applied_forces(py, positions, velocities)?;
        if by_term {
            let terms =
                terms.into_iter().map(|(name, rows)| Ok((name, arrays::array(py, rows, &self.shape())?)));
            return Ok(by_name(py, terms.collect::<PyResult<Vec<_>>>()?)?.into_any());
        }
        let mut sum = vec![0.0; self.vertices * self.dimension];
        for (_, rows) in terms {
            sum.iter_mut().zip(rows).for_each(|(sum, force)| *sum += force);
        }
        Ok(arrays::array(py, sum, &self.shape())?.into_any())
    }

    /// Compute the accelerations of all vertices, bit-identical to those in explicit steps.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, shape (n, dim), optional
    ///     Positions [m]; default: the current ones.
    /// velocities : array_like, shape (n, dim), optional
    ///     Velocities [m/s]; default: the current ones.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (n, dim)
    ///     Accelerations [m/s^2]; zero at pinned degrees of freedom.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     As for `forces`.
    ///
    /// Notes
    /// -----
    /// They are `forces` over `masses` up to round-off: gravity is added as an acceleration. One step of
    /// symplectic Euler is ``v += h * simulation.accelerations(x, v); x += h * v``, except for walls,
    /// prescribed motion, and ether drag, which splitting integrators solve exactly.
    ///
    /// Examples
    /// --------
    /// >>> x, v, h = simulation.positions, simulation.velocities, simulation.step_size
    /// >>> v = v + h * simulation.accelerations(x, v)
    /// >>> simulation.step()
    /// >>> bool((simulation.positions == x + h * v).all())
    /// True
    #[pyo3(signature = (positions = None, velocities = None))]
    fn accelerations<'py>(
        &self,
        py: Python<'py>,
        positions: Option<Bound<'py, PyAny>>,
        velocities: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Doubles<'py>> {
        let AppliedForces { accelerations, .. } = self.applied_forces(py, positions, velocities)?;
        arrays::array(py, accelerations, &self.shape())
    }

    /// Compute the current linear momentum.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (dim,)
    ///     ``sum m v`` [kg m/s].
    ///
    /// Examples
    /// --------
    /// >>> simulation.momentum()
    /// array([0., 0.])
    fn momentum<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let measured = self.lock()?.diagnostics(py)?;
        Ok(measured.linear_momentum[..self.dimension].to_vec().into_pyarray(py))
    }

    /// Compute the current angular momentum about the origin.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (3,)
    ///     ``sum m x cross v`` [kg m^2/s]; in 2D only the third component.
    ///
    /// Examples
    /// --------
    /// >>> simulation.angular_momentum()
    /// array([0., 0., 0.])
    fn angular_momentum<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let measured = self.lock()?.diagnostics(py)?;
        Ok(measured.angular_momentum.to_vec().into_pyarray(py))
    }

    /// Compute the deformation gradient of every finite element, body by body in mesh order.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (m, dim, dim)
    ///     Deformation gradient ``F``; at the centroid of second-order elements.
    ///
    /// Examples
    /// --------
    /// >>> simulation.deformation_gradient().shape
    /// (8, 2, 2)
    fn deformation_gradient<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        let (states, d) = (self.lock()?.elements(py), self.dimension);
        let part = |state: &ElementState| -> Vec<f64> {
            state.deformation_gradient.0[..d].iter().flat_map(|row| row[..d].to_vec()).collect()
        };
        arrays::array(py, states.iter().flat_map(part).collect(), &[states.len(), d, d])
    }

    /// Compute the stress of every finite element, body by body in mesh order.
    ///
    /// Parameters
    /// ----------
    /// kind : {"cauchy", "first-piola", "von-mises"}
    ///     Kind of stress.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (m, 3, 3), or (m,) for "von-mises"
    ///     Stress [Pa]; in 2D the third axis is out of the plane.
    ///
    /// Examples
    /// --------
    /// >>> simulation.stress("von-mises").shape
    /// (8,)
    #[pyo3(signature = (kind = "cauchy"))]
    fn stress<'py>(&self, py: Python<'py>, kind: &str) -> PyResult<Doubles<'py>> {
        let states = self.lock()?.elements(py);
        let tensors = |of: fn(&ElementState) -> [[f64; 3]; 3]| {
            let values = states.iter().flat_map(|state| of(state).as_flattened().to_vec()).collect();
            arrays::array(py, values, &[states.len(), 3, 3])
        };
        match kind {
            "cauchy" => tensors(|state| state.cauchy_stress().0),
            "first-piola" => tensors(|state| state.first_piola.0),
            "von-mises" => {
                let values = states.iter().map(ElementState::von_mises_stress).collect();
                arrays::array(py, values, &[states.len()])
            }
            _ => Err(PyValueError::new_err(format!(
                "there is no stress {kind:?}; there are \"cauchy\", \"first-piola\" and \"von-mises\""
            ))),
        }
    }

    /// Compute the stress at the nodes of all elements, body by body, never averaged across bodies.
    ///
    /// Parameters
    /// ----------
    /// recovery : {"patch", "average", "element"}
    ///     "patch": superconvergent patch recovery (Zienkiewicz, Zhu 1992), the most accurate; "average":
    ///     mean of the elements at a node; "element": one value per element and node.
    /// kind : {"cauchy", "von-mises", "principal"}
    ///     Kind of stress; von Mises and principal stresses come from the recovered tensor.
    ///
    /// Returns
    /// -------
    /// vertices : ndarray of int64, shape (m,)
    ///     Vertex of each value, without vertices that have no element.
    /// stress : ndarray of float64, shape (m, 3, 3), (m,) for "von-mises", (m, 3) for "principal"
    ///     Stress [Pa]; in 2D the third axis is out of the plane. Principal stresses are in descending order.
    ///
    /// Examples
    /// --------
    /// >>> vertices, stress = simulation.nodal_stress(kind="von-mises")
    /// >>> vertices.shape, stress.shape
    /// ((10,), (10,))
    #[pyo3(signature = (recovery = "patch", kind = "cauchy"))]
    fn nodal_stress<'py>(
        &self,
        py: Python<'py>,
        recovery: &str,
        kind: &str,
    ) -> PyResult<(Bound<'py, PyArray1<i64>>, Doubles<'py>)> {
        let recovery = match recovery {
            "patch" => Recovery::Patch,
            "average" => Recovery::Average,
            "element" => Recovery::Element,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "there is no recovery {recovery:?}; there are \"patch\", \"average\" and \"element\""
                )));
            }
        };
        let stress = {
            let inner = self.lock()?;
            py.detach(|| threads::run(|| inner.simulation.nodal_stress(&inner.topology, recovery)))
        };
        let count = stress.vertices.len();
        let values = match kind {
            "cauchy" => {
                let values =
                    stress.stress.iter().flat_map(|stress| stress.0.as_flattened().to_vec()).collect();
                arrays::array(py, values, &[count, 3, 3])
            }
            "von-mises" => arrays::array(py, stress.von_mises(), &[count]),
            "principal" => {
                let values = stress.principal().into_iter().flat_map(|principal| principal.values).collect();
                arrays::array(py, values, &[count, 3])
            }
            _ => Err(PyValueError::new_err(format!(
                "there is no stress {kind:?}; there are \"cauchy\", \"von-mises\" and \"principal\""
            ))),
        }?;
        let vertices: Vec<i64> = stress.vertices.into_iter().map(i64::from).collect();
        Ok((vertices.into_pyarray(py), values))
    }

    /// Compute a measure of every finite element, as in the channels of a recording.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name as in ``[output] channels`` of a scene: ``"green-strain"``, ``"jacobian"``,
    ///     ``"principal-stretches"``, ...
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (m, k)
    ///     Components of the measure, in the order of ``pliant list channels``.
    ///
    /// Examples
    /// --------
    /// >>> simulation.measure("jacobian")[0]
    /// array([1.])
    fn measure<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Doubles<'py>> {
        let measure = measure_named(name)?;
        let states = self.lock()?.elements(py);
        let mut values = vec![];
        states.iter().for_each(|state| measure.write(state, &mut values));
        arrays::array(py, values, &[states.len(), measure.fields.len()])
    }

    /// Compute the current reaction forces of pins and walls.
    ///
    /// Returns
    /// -------
    /// dict of str to ndarray of float64, shape (2, 3)
    ///     Force [N] and moment [N m] by name, ``body/pin`` or ``wall0``. The moment is about the mean
    ///     position of the vertices, or the centre of rotation of the pin, or the point of a wall nearest to
    ///     the origin.
    ///
    /// Examples
    /// --------
    /// >>> force, moment = simulation.reactions()["beam/left"]
    /// >>> force.shape
    /// (3,)
    fn reactions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut inner = self.lock()?;
        let simulation = &mut inner.simulation;
        let reactions = py.detach(|| threads::run(|| simulation.reactions()));
        let table = PyDict::new(py);
        for reaction in reactions {
            let values = [reaction.force, reaction.moment].as_flattened().to_vec();
            table.set_item(reaction.name, arrays::array(py, values, &[2, 3])?)?;
        }
        Ok(table)
    }

    /// List the currently active contact pairs, in a fixed order.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``"bodies"``, a list of m pairs of names; arrays of float64: ``"points"`` of shape (m, 2, 3), the
    ///     closest points of the two [m], ``"normals"`` (m, 3), from the second to the first, ``"gaps"`` (m,)
    ///     [m], ``"forces"`` (m,), the normal forces [N], ``"friction"`` (m, 3), the friction on the first
    ///     [N] at the current velocities, in the tangent plane: ``-mu force f1(v) v / |v|``. Empty without
    ///     ``[contact]``.
    ///
    /// Examples
    /// --------
    /// >>> simulation.contacts()["bodies"]
    /// []
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.lock()?;
        let simulation = &inner.simulation;
        let contacts = py.detach(|| threads::run(|| simulation.contacts()));
        contacts_table(py, &contacts)
    }

    /// Compute the largest stable step of the integrator, linearised about the current state.
    ///
    /// Returns
    /// -------
    /// float
    ///     Step [s]; infinite for integrators that are stable at any step.
    ///
    /// Examples
    /// --------
    /// >>> simulation.critical_step() > simulation.step_size
    /// True
    fn critical_step(&self, py: Python<'_>) -> PyResult<f64> {
        let mut inner = self.lock()?;
        let duration = inner.scene.scene.time.duration;
        let simulation = &mut inner.simulation;
        let limit = py.detach(|| threads::run(|| simulation.stability_limit(duration)));
        limit.map(|limit| limit.step).map_err(|error| PyRuntimeError::new_err(error.to_string()))
    }

    /// dict of str to object: Counts of the work so far, which do not depend on the machine.
    #[getter]
    fn work<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let work = self.lock()?.simulation.work();
        document::from_json(py, &serde_json::to_value(work).unwrap_or_default())
    }

    /// Compute the stiffness matrix ``K = d2E/dx2`` at the current positions.
    ///
    /// Returns
    /// -------
    /// scipy.sparse.csr_array, shape (n * dim, n * dim)
    ///     Matrix [N/m] of all degrees of freedom ``vertex * dim + axis``, pinned ones included; symmetric.
    ///     External forces by a function are omitted: their derivative is unknown.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Mutual gravity couples every vertex with all others: the matrix is dense.
    /// ImportError
    ///     SciPy is not installed.
    ///
    /// Examples
    /// --------
    /// >>> simulation.stiffness().shape
    /// (20, 20)
    fn stiffness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut inner = self.lock()?;
        let simulation = &mut inner.simulation;
        self.csr(py, py.detach(|| threads::run(|| simulation.stiffness_matrix())))
    }

    /// Compute the damping matrix ``C = d2R/dv2`` at the current state.
    ///
    /// Returns
    /// -------
    /// scipy.sparse.csr_array, shape (n * dim, n * dim)
    ///     Matrix [N s/m], as for `stiffness`, without ether drag.
    ///
    /// Raises
    /// ------
    /// ValueError, ImportError
    ///     As for `stiffness`.
    ///
    /// Examples
    /// --------
    /// >>> simulation.damping().shape
    /// (20, 20)
    fn damping<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut inner = self.lock()?;
        let simulation = &mut inner.simulation;
        self.csr(py, py.detach(|| threads::run(|| simulation.damping_matrix())))
    }

    /// Return the lumped mass matrix.
    ///
    /// Returns
    /// -------
    /// scipy.sparse.csr_array, shape (n * dim, n * dim)
    ///     Diagonal matrix [kg].
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     SciPy is not installed.
    ///
    /// Examples
    /// --------
    /// >>> round(float(simulation.mass().diagonal()[::2].sum()), 9)
    /// 40.0
    fn mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let count = self.vertices * self.dimension;
        let masses = self.lock()?.topology.masses.clone();
        let value = masses.iter().flat_map(|m| std::iter::repeat_n(*m, self.dimension)).collect();
        self.csr(
            py,
            Ok(SparseMatrix { row_start: (0..=count).collect(), column: (0..count).collect(), value }),
        )
    }
}

impl PySimulation {
    fn csr<'py>(
        &self,
        py: Python<'py>,
        matrix: Result<SparseMatrix, MatrixError>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let matrix = matrix.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let SparseMatrix { row_start, column, value } = matrix;
        let parts = (value.into_pyarray(py), arrays::counts(py, &column), arrays::counts(py, &row_start));
        let count = self.vertices * self.dimension;
        py.import("scipy.sparse")?.call_method1("csr_array", (parts, (count, count)))
    }
}

/// Contacts as a dict of arrays.
pub(crate) fn contacts_table<'py>(
    py: Python<'py>,
    contacts: &[SurfaceContact],
) -> PyResult<Bound<'py, PyDict>> {
    let (count, table) = (contacts.len(), PyDict::new(py));
    let bodies: Vec<(String, String)> =
        contacts.iter().map(|c| (c.bodies[0].clone(), c.bodies[1].clone())).collect();
    table.set_item("bodies", bodies)?;
    let points: Vec<f64> = contacts.iter().flat_map(|c| c.points.as_flattened().to_vec()).collect();
    table.set_item("points", arrays::array(py, points, &[count, 2, 3])?)?;
    let normals: Vec<f64> = contacts.iter().flat_map(|c| c.normal).collect();
    table.set_item("normals", arrays::array(py, normals, &[count, 3])?)?;
    let gaps: Vec<f64> = contacts.iter().map(|c| c.gap).collect();
    table.set_item("gaps", arrays::array(py, gaps, &[count])?)?;
    let forces: Vec<f64> = contacts.iter().map(|c| c.force).collect();
    table.set_item("forces", arrays::array(py, forces, &[count])?)?;
    let friction: Vec<f64> = contacts.iter().flat_map(|c| c.friction).collect();
    table.set_item("friction", arrays::array(py, friction, &[count, 3])?)?;
    Ok(table)
}
