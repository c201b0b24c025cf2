//! Parameters that change while a simulation runs (lecture 21).

use super::Simulation;
use crate::constraint::Hold;
use crate::energy::EnergyTerm;
use crate::energy::load::{ExternalForce, ExternalForces};

/// Surfaces that shall touch are where they cannot both be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{conflict} now, at t = {time} s: they can touch only once they are apart")]
pub struct AdoptError {
    /// Which, and where.
    pub conflict: String,
    /// Time of the state [s].
    pub time: f64,
}

/// The name of the term of [`Simulation::set_external_forces`].
const EXTERNAL: &str = "forces from outside";

/// Surfaces that cannot be at `x`, in the order of the simulation, in words.
fn conflict(simulation: &Simulation, x: &[f64]) -> Option<String> {
    let mut touching = simulation.system.terms().iter().filter_map(|term| term.touching());
    touching.find_map(|term| term.conflict(x))
}

impl Simulation {
    /// Surfaces that shall touch and would cross or overlap with the vertices, in the order of the scene, at
    /// `x`, flat `(n, dimension)` [m], in words; `None` where bodies can be there.
    ///
    /// # Panics
    /// If `x` has not the length of the state's.
    pub fn conflict_at(&self, x: &[f64]) -> Option<String> {
        conflict(self, &self.numbering.to_internal(x, self.system.dimension()))
    }

    /// Puts the vertices, in the order of the scene, at `x`, flat `(n, dimension)` [m], but for coordinates
    /// on prescribed motion. What is held is held where it is put. Where surfaces touch, ask
    /// [`conflict_at`](Self::conflict_at) first: of steps from within each other nothing can be said.
    ///
    /// # Panics
    /// If `x` has not the length of the state's.
    pub fn set_positions(&mut self, x: &[f64]) {
        let d = self.system.dimension();
        let x = self.numbering.to_internal(x, d);
        // From where the last step ended, the force is known.
        if self.state.x() != &x[..] {
            self.state_mut().x_mut().copy_from_slice(&x);
            self.rest_where_held();
        }
    }

    /// Gives the vertices, in the order of the scene, the velocities `v`, flat `(n, dimension)` [m/s], but
    /// for held coordinates.
    ///
    /// # Panics
    /// If `v` has not the length of the state's.
    pub fn set_velocities(&mut self, v: &[f64]) {
        let d = self.system.dimension();
        let v = self.numbering.to_internal(v, d);
        if self.state.v() != &v[..] {
            self.state_mut().v_mut().copy_from_slice(&v);
            self.rest_where_held();
        }
    }

    /// Goes on from the present state with the equations, the scheme and the step of `other`: an assembly of
    /// the same bodies with other parameters. Loads and motions that depend on time are at the present time;
    /// a pin whose motion is another one goes on from where it is, with the displacement and the rotation
    /// that the new motion makes from now on; pins that are steered still are. The balance of energy begins
    /// anew, as after [`state_mut`](Self::state_mut), and schemes of several steps begin anew. What was added
    /// to the simulation itself, forces from outside and pins, is gone: it is not in `other`.
    ///
    /// Walls are bodies to some schemes, the last in the order of the scene, and none to others: vertices that
    /// only `other` has are where it has them.
    ///
    /// # Errors
    /// [`AdoptError`] where surfaces that touch in `other` cross or overlap at the present positions: nothing
    /// is changed then.
    ///
    /// # Panics
    /// If `other` has another dimension: it then is not of the same bodies.
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
        let (step, time) = (self.state.step, self.state.time);
        let drives = self.drives();
        let before = std::mem::replace(self, other);
        let counted = self.system.force_evaluations() + before.system.force_evaluations();
        self.system.books_mut().set_force_evaluations(counted);
        self.counts_losses = before.counts_losses;
        if step > 0 {
            self.set_pace(before.pace());
        }
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

    /// Puts these forces on the vertices, in place of those set before; `None` for none. The balance of
    /// energy begins anew.
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

    /// Holds the coordinates of these vertices, in the order of the scene, along these of the axes x, y, z
    /// where they are now, under a name by which they can be [released](Self::release).
    pub fn pin(&mut self, name: &str, vertices: &[u32], axes: [bool; 3]) {
        let vertices = vertices.iter().map(|v| self.numbering.internal(*v)).collect();
        self.system.hold(Hold::new(name, vertices).along(axes));
        self.rest_where_held();
        self.changed();
    }

    /// Releases the pins of this name; whether there were any. What they moved flies on.
    pub fn release(&mut self, name: &str) -> bool {
        let found = self.system.change_pins(|pins| pins.end(name));
        self.changed();
        found
    }

    /// The equations are others from now on.
    pub(super) fn changed(&mut self) {
        self.state_mut().x_mut();
    }

    /// Held coordinates have no velocity, but for those that move.
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
