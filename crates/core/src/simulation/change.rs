//! Parameter changes during a simulation (lecture 21).

use super::Simulation;
use crate::constraint::Hold;
use crate::energy::EnergyTerm;
use crate::energy::load::{ExternalForce, ExternalForces};

/// Error for contact surfaces that overlap.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{conflict} now, at t = {time} s: they can touch only once they are apart")]
pub struct AdoptError {
    /// Description of the surfaces and their position.
    pub conflict: String,
    /// Time of the state [s].
    pub time: f64,
}

/// Name of the term of [`Simulation::set_external_forces`].
const EXTERNAL: &str = "forces from outside";

/// Describes contact surfaces that overlap at `x`, in simulation order.
fn conflict(simulation: &Simulation, x: &[f64]) -> Option<String> {
    let mut touching = simulation.system.terms().iter().filter_map(|term| term.touching());
    touching.find_map(|term| term.conflict(x))
}

impl Simulation {
    /// Describes contact surfaces that would cross or overlap with the vertices, in scene order, at `x`,
    /// flat `(n, dimension)` [m]; `None` if there are none.
    ///
    /// # Panics
    /// If `x` does not have the length of the state's.
    pub fn conflict_at(&self, x: &[f64]) -> Option<String> {
        conflict(self, &self.numbering.to_internal(x, self.system.dimension()))
    }

    /// Sets the positions `x` of the vertices in scene order, flat `(n, dimension)` [m], except for
    /// prescribed coordinates. Pins hold vertices at their new positions. With contact, check
    /// [`conflict_at`](Self::conflict_at) first: steps from overlapping surfaces are undefined.
    ///
    /// # Panics
    /// If `x` does not have the length of the state's.
    pub fn set_positions(&mut self, x: &[f64]) {
        let d = self.system.dimension();
        let x = self.numbering.to_internal(x, d);
        // At the end of the last step the force is known.
        if self.state.x() != &x[..] {
            self.state_mut().x_mut().copy_from_slice(&x);
            self.rest_where_held();
        }
    }

    /// Sets the velocities `v` of the vertices in scene order, flat `(n, dimension)` [m/s], except for
    /// constrained coordinates.
    ///
    /// # Panics
    /// If `v` does not have the length of the state's.
    pub fn set_velocities(&mut self, v: &[f64]) {
        let d = self.system.dimension();
        let v = self.numbering.to_internal(v, d);
        if self.state.v() != &v[..] {
            self.state_mut().v_mut().copy_from_slice(&v);
            self.rest_where_held();
        }
    }

    /// Continues from the current state with the equations, integrator and step of `other`, an assembly
    /// of the same bodies with other parameters. Time-dependent loads and motions are at the current
    /// time. A pin with a new motion continues from its position, with the displacement and rotation that
    /// the motion makes from now on; steered pins remain steered. The energy balance starts anew, as
    /// after [`state_mut`](Self::state_mut), and multistep methods start without history. Additions to
    /// the simulation itself, external forces and pins, are lost: `other` does not have them.
    ///
    /// Walls are bodies to some integrators, the last in scene order, and not to others: vertices that
    /// only `other` has keep their positions there.
    ///
    /// # Errors
    /// [`AdoptError`] if contact surfaces of `other` cross or overlap at the current positions; nothing
    /// is changed then.
    ///
    /// # Panics
    /// If `other` has another dimension, and so is not of the same bodies.
    pub fn adopt(&mut self, other: Simulation) -> Result<(), AdoptError> {
        let d = other.system.dimension();
        assert_eq!(d, self.system.dimension(), "the same dimension");
        let (mut x, mut v) = (other.positions().into_owned(), other.velocities().into_owned());
        let shared = x.len().min(self.state.x().len());
        x[..shared].copy_from_slice(&self.positions()[..shared]);
        v[..shared].copy_from_slice(&self.velocities()[..shared]);
        if let Some(conflict) = other.conflict_at(&x) {
            return Err(AdoptError { conflict, time: self.state.time });
        }
        // Replace the simulation, but keep steering, counts and step size history.
        let (step, time) = (self.state.step, self.state.time);
        let drives = self.drives();
        let before = std::mem::replace(self, other);
        let counted = self.system.force_evaluations() + before.system.force_evaluations();
        self.system.books_mut().set_force_evaluations(counted);
        self.records.counts_losses = before.records.counts_losses;
        if step > 0 {
            self.set_pace(before.pace());
        }
        // Restore the state, then pins and their motions.
        (self.state.step, self.state.time) = (step, time);
        let (here_x, here_v) = self.state.rows_mut();
        here_x.copy_from_slice(&self.numbering.to_internal(&x, d));
        here_v.copy_from_slice(&self.numbering.to_internal(&v, d));
        if step > 0 {
            self.hold_as_after(step, time);
        }
        let time = self.system.load_factor().unwrap_or(time);
        self.system.change_pins(|pins| pins.go_on_from(time, self.state.x()));
        self.set_drives(&drives);
        self.close_ledger();
        self.rest_where_held();
        Ok(())
    }

    /// Applies external forces to the vertices, replacing earlier ones; `None` removes them. The energy
    /// balance starts anew.
    pub fn set_external_forces(&mut self, force: Option<ExternalForce>) {
        let term = force.map(|force| -> Box<dyn EnergyTerm> {
            let (d, n) = (self.system.dimension(), self.system.mass().len());
            Box::new(ExternalForces::new(EXTERNAL, d, n, self.numbering.clone(), force))
        });
        match (self.external_forces.take(), term) {
            (Some(id), None) => self.system.replace_term(id, None),
            (Some(id), term) => {
                self.system.replace_term(id, term);
                self.external_forces = Some(id);
            }
            (None, term) => self.external_forces = term.map(|term| self.system.insert_term(term)),
        }
        self.changed();
    }

    /// Pins these vertices, in scene order, at their current positions along the marked axes x, y, z. The
    /// name serves to [release](Self::release) them.
    pub fn pin(&mut self, name: &str, vertices: &[u32], axes: [bool; 3]) {
        let vertices = vertices.iter().map(|v| self.numbering.internal(*v)).collect();
        self.system.hold(Hold::new(name, vertices).along(axes));
        self.rest_where_held();
        self.changed();
    }

    /// Removes the pins of this name; returns whether there were any. Moving vertices keep their
    /// velocity.
    pub fn release(&mut self, name: &str) -> bool {
        let found = self.system.change_pins(|pins| pins.end(name));
        self.changed();
        found
    }

    /// Invalidates everything that depends on the equations.
    pub(super) fn changed(&mut self) {
        self.state_mut().x_mut();
    }

    /// Sets the velocities of constrained coordinates to zero, or to those of their motion.
    fn rest_where_held(&mut self) {
        let time = self.state.time;
        for (v, w) in self.state.v_mut().iter_mut().zip(self.system.inverse_mass()) {
            if *w == 0.0 {
                *v = 0.0;
            }
        }
        if self.system.has_prescribed_motion() {
            let (x, v) = self.state.rows_mut();
            self.system.prescribe(time, x, v);
        }
    }
}
