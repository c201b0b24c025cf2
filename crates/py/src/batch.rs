//! Copies of one simulation that step together: what a vector of environments stands on.

mod measure;
mod workers;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, TryLockError};
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray1};
use pliant::constraint::Waypoint;
use pliant::energy::load::ExternalForce;
use pliant::simulation::{Checkpoint, StepError};
use pliant_scene::assembly::UnstableStep;
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Doubles};
use crate::simulation::{Inner, PySimulation, place};
use crate::{arguments, errors, threads};
use workers::Workers;

/// Calls that take longer look for Ctrl-C while they run.
const LONG: Duration = Duration::from_millis(100);

/// Copies of a simulation, and arrays that show all of them.
#[pyclass(name = "Batch", frozen, module = "pliant._pliant")]
pub(crate) struct PyBatch {
    members: Mutex<Members>,
    /// Copies, vertices, dimension.
    shape: [usize; 3],
    positions: SharedRows,
    velocities: SharedRows,
}

struct Members {
    all: Vec<Inner>,
    /// Moment that all of them start from.
    start: Checkpoint,
    workers: Workers,
    /// True if the last steps took long.
    is_slow: bool,
}

/// An array of shape (copies, vertices, dimension), and what Python sees of it, which cannot be written.
struct SharedRows {
    array: Py<PyArrayDyn<f64>>,
    shown: Py<PyAny>,
}

impl SharedRows {
    fn new(py: Python<'_>, shape: &[usize]) -> PyResult<Self> {
        let array = PyArrayDyn::<f64>::zeros(py, shape, false);
        let shown = array.call_method0("view")?;
        shown.call_method1("setflags", (false,))?;
        Ok(SharedRows { array: array.unbind(), shown: shown.unbind() })
    }
}

/// Way of a pin in the steps to come, of all copies.
struct Steering {
    name: String,
    /// Displacement and rotation vector of each copy; `None`: where the velocities lead.
    poses: Option<Vec<f64>>,
    /// Velocity and angular velocity of each copy on arrival.
    rates: Vec<f64>,
    over: f64,
}

impl Steering {
    fn apply(&self, inner: &mut Inner, copy: usize) -> Result<(), String> {
        let row = |values: &[f64]| {
            let row = &values[6 * copy..][..6];
            (Vector3::from_row_slice(&row[..3]), Vector3::from_row_slice(&row[3..]))
        };
        let (velocity, angular_velocity) = row(&self.rates);
        let mut target = Waypoint { velocity, angular_velocity, ..Waypoint::at_rest(Isometry3::identity()) };
        match (&self.poses, inner.simulation.pin_waypoint(&self.name)) {
            (Some(poses), _) => {
                let (shift, turn) = row(poses);
                target.pose = Isometry3::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn));
            }
            (None, Some(now)) => target.pose = Waypoint { pose: now.pose, ..target }.after(self.over).pose,
            // Which is said below.
            (None, None) => {}
        }
        let moved = inner.simulation.move_pin(&self.name, target, self.over);
        moved.map_err(|error| format!("copy {copy}: {error}"))
    }
}

/// A copy of a simulation, its number and its rows of the arrays.
struct Member<'a> {
    number: usize,
    inner: &'a mut Inner,
    x: &'a mut [f64],
    v: &'a mut [f64],
}

impl Member<'_> {
    fn show(&mut self) {
        let (simulation, d) = (&self.inner.simulation, self.inner.topology.dimension);
        let (state, numbering) = (simulation.state(), simulation.numbering());
        numbering.write_original(state.x(), d, self.x);
        numbering.write_original(state.v(), d, self.v);
    }
}

/// Pins that are steered, as Python gives them: name, poses, rates, time.
type Moves<'py> = Vec<(String, Option<Bound<'py, PyAny>>, Bound<'py, PyAny>, f64)>;

impl PyBatch {
    fn lock(&self) -> PyResult<MutexGuard<'_, Members>> {
        let mut members = match self.members.try_lock() {
            Ok(members) => members,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => {
                return Err(PyRuntimeError::new_err(
                    "the environments are in the middle of a step: another thread uses them",
                ));
            }
        };
        members.workers.after_fork()?;
        Ok(members)
    }

    /// Numbers of the copies that a mask names; all without one.
    fn named(&self, mask: Option<PyReadonlyArray1<'_, bool>>) -> PyResult<Vec<bool>> {
        let Some(mask) = mask else { return Ok(vec![true; self.shape[0]]) };
        let mask = mask.as_array().to_vec();
        if mask.len() != self.shape[0] {
            let message =
                format!("a mask of environments must have length {}, got {}", self.shape[0], mask.len());
            return Err(PyValueError::new_err(message));
        }
        Ok(mask)
    }

    /// Results of `work` on each copy that the mask names, with the numbers of the copies.
    fn each<T: Send>(
        &self,
        py: Python<'_>,
        members: &mut Members,
        mask: &[bool],
        work: impl Fn(&mut Member<'_>, &AtomicBool) -> T + Sync,
    ) -> PyResult<Vec<(usize, T)>> {
        let (mut positions, mut velocities) =
            (self.positions.array.bind(py).try_readwrite()?, self.velocities.array.bind(py).try_readwrite()?);
        let width = self.shape[1] * self.shape[2];
        // Scenes without vertices have no rows.
        let x = positions.as_slice_mut()?.chunks_exact_mut(width.max(1));
        let v = velocities.as_slice_mut()?.chunks_exact_mut(width.max(1));
        let Members { all, workers, is_slow, .. } = members;
        let of_all = all.iter_mut().zip(x).zip(v).enumerate();
        let of_all = of_all.map(|(number, ((inner, x), v))| Member { number, inner, x, v });
        let items: Vec<Member<'_>> = of_all.filter(|member| mask[member.number]).collect();
        let (stop, mut signal) = (AtomicBool::new(false), None);
        let one = |mut member: Member<'_>| (member.number, work(&mut member, &stop));
        let started = Instant::now();
        let results = if *is_slow {
            threads::interruptible(py, &stop, &mut signal, || workers.each(items, one))?
        } else {
            py.detach(|| workers.each(items, one))
        };
        *is_slow = started.elapsed() > LONG;
        match signal {
            Some(signal) => Err(signal),
            None => py.check_signals().map(|()| results),
        }
    }

    fn rows(&self, values: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<f64>> {
        let values = arrays::rows(values, &self.shape, what)?;
        let [_, vertices, dimension] = self.shape;
        if let Some(i) = values.iter().position(|value| !value.is_finite()) {
            let (row, value) = (i / dimension, values[i]);
            let (copy, vertex) = (row / vertices, row % vertices);
            let message =
                format!("{what} must be finite, got {value} at vertex {vertex} of environment {copy}");
            return Err(PyValueError::new_err(message));
        }
        Ok(values)
    }
}

#[pymethods]
impl PyBatch {
    /// `count` copies of `simulation`, which starts them all from where it is.
    #[new]
    fn new(
        py: Python<'_>,
        simulation: &PySimulation,
        #[pyo3(from_py_with = arguments::count)] count: usize,
        #[pyo3(from_py_with = arguments::count)] threads: usize,
    ) -> PyResult<Self> {
        let (scene, start, additions) = simulation.lock()?.parts(py);
        let workers = Workers::new(threads)?;
        let assemble = |_: usize| scene.scene.assemble(UnstableStep::Refuse);
        let assemblies = py.detach(|| workers.each((0..count).collect(), assemble));
        let mut all = vec![];
        for assembly in assemblies {
            let assembly = assembly.map_err(|problems| errors::scene(py, &scene.source.error(problems)))?;
            let mut inner = Inner::new(scene.clone(), assembly);
            inner.go_on_from(py, &start, additions.duplicate(py))?;
            all.push(inner);
        }
        let topology = &all.first().ok_or_else(|| PyValueError::new_err("no environments"))?.topology;
        let shape = [count, topology.vertex_count, topology.dimension];
        let batch = PyBatch {
            members: Mutex::new(Members { all, start, workers, is_slow: false }),
            shape,
            positions: SharedRows::new(py, &shape)?,
            velocities: SharedRows::new(py, &shape)?,
        };
        batch.each(py, &mut *batch.lock()?, &vec![true; count], |member, _| member.show())?;
        Ok(batch)
    }

    /// Positions of all copies, read only: the same array each time.
    #[getter]
    fn positions(&self, py: Python<'_>) -> Py<PyAny> {
        self.positions.shown.clone_ref(py)
    }

    /// Velocities, likewise.
    #[getter]
    fn velocities(&self, py: Python<'_>) -> Py<PyAny> {
        self.velocities.shown.clone_ref(py)
    }

    /// Times of all copies.
    fn times<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let members = self.lock()?;
        let times: Vec<f64> = members.all.iter().map(|inner| inner.simulation.state().time).collect();
        Ok(PyArray1::from_vec(py, times))
    }

    /// Takes `n` steps of the copies that the mask names, with these forces on them from now on and these
    /// ways of their pins; what could not take a step, and why.
    #[pyo3(signature = (n, mask = None, forces = None, moves = None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = arguments::count)] n: u64,
        mask: Option<PyReadonlyArray1<'py, bool>>,
        forces: Option<Bound<'py, PyAny>>,
        moves: Option<Moves<'py>>,
    ) -> PyResult<Vec<(usize, PyErr)>> {
        let mask = self.named(mask)?;
        let forces = forces.map(|forces| self.rows(&forces, "forces")).transpose()?;
        let shape = [self.shape[0], 6];
        let mut steerings = vec![];
        for (name, poses, rates, over) in moves.into_iter().flatten() {
            let poses = poses.map(|poses| arrays::rows(&poses, &shape, "poses of pins")).transpose()?;
            let rates = arrays::rows(&rates, &shape, "velocities of pins")?;
            steerings.push(Steering { name, poses, rates, over });
        }
        let width = self.shape[1] * self.shape[2];
        let work = |member: &mut Member<'_>, stop: &AtomicBool| -> Result<Result<(), StepError>, String> {
            for steering in &steerings {
                steering.apply(member.inner, member.number)?;
            }
            let simulation = &mut member.inner.simulation;
            if let Some(forces) = &forces {
                let rows = forces[member.number * width..][..width].to_vec();
                simulation.set_external_forces(Some(ExternalForce::Constant(rows)));
            }
            let mut steps = (0..n).take_while(|_| !stop.load(Ordering::Relaxed));
            let end = steps.try_for_each(|_| simulation.step());
            member.show();
            Ok(end)
        };
        let mut members = self.lock()?;
        let ends = self.each(py, &mut members, &mask, work)?;
        let mut failures = vec![];
        for (copy, end) in ends {
            if let Err(error) = end.map_err(PyValueError::new_err)? {
                failures.push((copy, members.all[copy].failed(py, errors::step(&error))));
            }
        }
        Ok(failures)
    }

    /// Puts the copies that the mask names back to their start, with the forces of that, and then at these
    /// positions with these velocities.
    #[pyo3(signature = (mask = None, positions = None, velocities = None))]
    fn reset(
        &self,
        py: Python<'_>,
        mask: Option<PyReadonlyArray1<'_, bool>>,
        positions: Option<Bound<'_, PyAny>>,
        velocities: Option<Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let mask = self.named(mask)?;
        let x = positions.map(|rows| self.rows(&rows, "positions")).transpose()?;
        let v = velocities.map(|rows| self.rows(&rows, "velocities")).transpose()?;
        let mut members = self.lock()?;
        for (inner, _) in members.all.iter_mut().zip(&mask).filter(|(_, named)| **named) {
            let force = inner.additions.force().map(|force| force.clone_ref(py));
            let force = force.map(|force| inner.external_force(force.bind(py))).transpose()?;
            inner.simulation.set_external_forces(force.flatten());
        }
        let (start, width) = (members.start.clone(), self.shape[1] * self.shape[2]);
        let work = |member: &mut Member<'_>, _: &AtomicBool| {
            let simulation = &mut member.inner.simulation;
            let resumed = simulation.resume(&start);
            let row = |rows: &Option<Vec<f64>>| {
                rows.as_ref().map(|rows| rows[member.number * width..][..width].to_vec())
            };
            let placed = row(&x).map_or(Ok(()), |x| place(simulation, &x));
            row(&v).into_iter().for_each(|v| simulation.set_velocities(&v));
            member.show();
            resumed.map_err(|error| PyValueError::new_err(error.to_string())).and(placed)
        };
        for (_, resumed) in self.each(py, &mut members, &mask, work)? {
            resumed?;
        }
        Ok(())
    }

    /// Changes values of the scene of one copy, which goes on from where it is.
    fn set(&self, copy: usize, changes: &Bound<'_, PyDict>) -> PyResult<()> {
        self.lock()?.all.get_mut(copy).ok_or_else(|| absent(copy))?.change(changes)
    }

    /// Another simulation that goes on from where this copy is, without the forces of `step`.
    fn copied(&self, py: Python<'_>, copy: usize) -> PyResult<PySimulation> {
        let mut members = self.lock()?;
        let (scene, now, additions) = members.all.get_mut(copy).ok_or_else(|| absent(copy))?.parts(py);
        let mut inner = Inner::new(scene.clone(), scene.assemble(py)?);
        inner.go_on_from(py, &now, additions)?;
        Ok(PySimulation::of(inner))
    }

    /// Forces and moments of pins and walls: their names, and an array (copies, names, 2, 3).
    fn reactions<'py>(&self, py: Python<'py>) -> PyResult<(Vec<String>, Doubles<'py>)> {
        let mut members = self.lock()?;
        let names = self.reaction_names(&members);
        let one = |member: &mut Member<'_>, _: &AtomicBool| {
            measure::reactions(&mut member.inner.simulation, &names)
        };
        let values = self.each(py, &mut members, &vec![true; self.shape[0]], one)?;
        let values = values.into_iter().flat_map(|(_, values)| values).collect();
        let shape = [self.shape[0], names.len(), 2, 3];
        Ok((names, arrays::array(py, values, &shape)?))
    }

    /// Probes: their names, and an array (copies, names, 2, dimension) of positions and velocities.
    fn probes<'py>(&self, py: Python<'py>) -> PyResult<(Vec<String>, Doubles<'py>)> {
        let members = self.lock()?;
        let probes = &members.all[0].probes;
        let (width, d) = (self.shape[1] * self.shape[2], self.shape[2]);
        let (x, v) =
            (self.positions.array.bind(py).try_readonly()?, self.velocities.array.bind(py).try_readonly()?);
        let (x, v) = (x.as_slice()?, v.as_slice()?);
        let mut values = vec![];
        for copy in 0..self.shape[0] {
            for probe in probes {
                values.extend(measure::mixed(probe, &x[copy * width..][..width], d));
                values.extend(measure::mixed(probe, &v[copy * width..][..width], d));
            }
        }
        let names = probes.iter().map(|probe| probe.name.clone()).collect();
        Ok((names, arrays::array(py, values, &[self.shape[0], probes.len(), 2, d])?))
    }

    /// Sums of the forces of contact on bodies: their names, and an array (copies, bodies, 3).
    fn contact_forces<'py>(&self, py: Python<'py>) -> PyResult<(Vec<String>, Doubles<'py>)> {
        let mut members = self.lock()?;
        let bodies: Vec<String> =
            members.all[0].topology.bodies.iter().map(|body| body.name.clone()).collect();
        let one = |member: &mut Member<'_>, _: &AtomicBool| {
            measure::contact_forces(&member.inner.simulation, &bodies)
        };
        let values = self.each(py, &mut members, &vec![true; self.shape[0]], one)?;
        let values = values.into_iter().flat_map(|(_, values)| values).collect();
        let shape = [self.shape[0], bodies.len(), 3];
        Ok((bodies, arrays::array(py, values, &shape)?))
    }
}

impl PyBatch {
    /// Names of pins and walls; a pin that has let go in one copy holds in another.
    fn reaction_names(&self, members: &Members) -> Vec<String> {
        let mut names: Vec<String> = vec![];
        for name in members.all.iter().flat_map(|inner| inner.simulation.reaction_names()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }
}

fn absent(copy: usize) -> PyErr {
    PyIndexError::new_err(format!("there is no environment {copy}"))
}
