//! Forces and energies term by term, at the current or any other state, for user-defined integrators.

use super::Simulation;
use crate::diagnostics::Diagnostics;
use crate::integrator::equations::acceleration_at;
use crate::system::ForceId;

/// Forces on all vertices, in scene order.
#[derive(Clone, Debug, PartialEq)]
pub struct AppliedForces {
    /// Accelerations of the vertices as steps see them, flat `(n, dimension)` [m/s^2]; zero at
    /// constrained coordinates.
    pub accelerations: Vec<f64>,
    /// Forces of each term by name, flat `(n, dimension)` [N], constrained vertices included: energies,
    /// then dissipation, then ether drag.
    pub terms: Vec<(String, Vec<f64>)>,
}

/// Error for a force that is not finite.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the force is not finite there{0}")]
pub struct NoForceError(String);

impl Simulation {
    /// Computes forces at positions `x` [m] and velocities `v` [m/s], flat `(n, dimension)`, in scene
    /// order, at the current time; `None` means those of the state. Prescribed coordinates override `x`
    /// and `v`. The simulation is not changed.
    ///
    /// Walls and pins, and their impulses in a step, are not included.
    ///
    /// # Errors
    /// If a force is not finite at a free coordinate.
    ///
    /// # Panics
    /// If an array does not have the length of the state's.
    pub fn forces(&mut self, x: Option<&[f64]>, v: Option<&[f64]>) -> Result<AppliedForces, NoForceError> {
        let (d, time) = (self.system.dimension(), self.state.time);
        let known = match x {
            Some(_) => ForceId::NONE,
            // Stored for the next step.
            None => {
                self.state.ensure_force(&mut self.system, time);
                self.state.force
            }
        };
        let (numbering, system) = (&self.numbering, &mut self.system);
        let internal = |rows: Option<&[f64]>, own: &[f64]| {
            rows.map_or_else(|| own.to_vec(), |rows| numbering.to_internal(rows, d).into_owned())
        };
        let (mut x, mut v) = (internal(x, self.state.x()), internal(v, self.state.v()));
        assert_eq!((x.len(), v.len()), (self.state.x().len(), self.state.v().len()), "a row for each vertex");
        let mut a = vec![0.0; x.len()];
        acceleration_at(system, time, (&mut x, &mut v), known, &mut a).map_err(|fault| {
            let fault = self.located(fault).fault;
            NoForceError(fault.map_or_else(String::new, |fault| format!(": {fault}")))
        })?;
        let mut terms: Vec<(String, Vec<f64>)> = vec![];
        let mut add = |name: String, add_rows: &dyn Fn(&mut [f64])| {
            let mut rows = vec![0.0; x.len()];
            add_rows(&mut rows);
            // Terms give derivatives; forces have the opposite sign.
            rows.iter_mut().for_each(|row| *row = 0.0 - *row);
            terms.push((name, self.numbering.to_original(&rows, d).into_owned()));
        };
        let system = &self.system;
        system.terms().iter().for_each(|term| add(term.name(), &|rows| term.add_rows(0, rows)));
        system.dissipation().iter().for_each(|term| add(term.name(), &|rows| term.add_rows(0, rows)));
        let drag = system.ether_drag();
        if drag != 0.0 {
            add("ether drag".into(), &|rows| {
                let of_vertices = rows.chunks_exact_mut(d).zip(v.chunks_exact(d)).zip(system.mass());
                of_vertices
                    .for_each(|((row, v), m)| row.iter_mut().zip(v).for_each(|(f, v)| *f = drag * m * v));
            });
        }
        Ok(AppliedForces { accelerations: self.numbering.to_original(&a, d).into_owned(), terms })
    }

    /// Returns the potential energy of each term by name [J] at positions `x` [m], given as in
    /// [`forces`](Self::forces); `+inf` outside the domain of a barrier material.
    ///
    /// # Panics
    /// If `x` does not have the length of the state's.
    pub fn potential_energies(&mut self, x: Option<&[f64]>) -> Vec<(String, f64)> {
        let x =
            self.numbering.to_internal(x.unwrap_or(&self.positions()), self.system.dimension()).into_owned();
        assert_eq!(x.len(), self.state.x().len(), "a row for each vertex");
        self.system.set_time(self.state.time);
        self.system.potential_energies(&x)
    }

    /// Measures energies at positions `x` [m] and velocities `v` [m/s], given as in
    /// [`forces`](Self::forces), without a balance.
    ///
    /// # Panics
    /// If an array does not have the length of the state's.
    pub fn diagnostics_at(&mut self, x: Option<&[f64]>, v: Option<&[f64]>) -> Diagnostics {
        let mut state = self.state.clone();
        let d = self.system.dimension();
        if let Some(x) = x {
            state.x_mut().copy_from_slice(&self.numbering.to_internal(x, d));
        }
        if let Some(v) = v {
            state.v_mut().copy_from_slice(&self.numbering.to_internal(v, d));
        }
        match self.method.is_static() {
            true => Diagnostics::measure_at_rest(&mut self.system, &state),
            false => Diagnostics::measure_state(&mut self.system, &state),
        }
    }
}
