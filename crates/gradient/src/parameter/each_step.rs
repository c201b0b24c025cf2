//! Parameters for each step of a run: forces and displacements.

use pliant::numbering::Numbering;

use super::{ForceUse, Parameter, StateUse};

/// External forces on all vertices, constant during each step [N]: `(steps, n, dimension)`, vertices in
/// the order of the scene. The run need not have any.
#[derive(Clone, Debug)]
pub struct StepForces {
    numbering: Numbering,
    coordinates: usize,
    steps: usize,
}

/// Displacements of fixed coordinates from each state on [m]: `(steps + 1, n, dimension)`, likewise. Zero
/// where free.
#[derive(Clone, Debug)]
pub struct HeldPlaces {
    numbering: Numbering,
    coordinates: usize,
    states: usize,
}

impl StepForces {
    /// Forces on a simulation with this numbering and number of coordinates.
    pub fn new(numbering: Numbering, coordinates: usize) -> Self {
        StepForces { numbering, coordinates, steps: 0 }
    }
}

impl HeldPlaces {
    /// Displacements in a simulation with this numbering and number of coordinates.
    pub fn new(numbering: Numbering, coordinates: usize) -> Self {
        HeldPlaces { numbering, coordinates, states: 0 }
    }
}

impl Parameter for StepForces {
    fn begin(&mut self, steps: u64) {
        self.steps = steps as usize;
    }

    fn len(&self) -> usize {
        self.steps * self.coordinates
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let change = &change[of.step as usize * self.coordinates..][..self.coordinates];
        let change = self.numbering.to_internal(change, of.system.dimension());
        force.iter_mut().zip(&*change).for_each(|(force, change)| *force += change);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let first = of.step as usize * self.coordinates;
        let p = self.numbering.to_original(of.p, of.system.dimension());
        derivative[first..].iter_mut().zip(&*p).for_each(|(derivative, p)| *derivative += p);
    }
}

impl Parameter for HeldPlaces {
    fn begin(&mut self, steps: u64) {
        self.states = steps as usize + 1;
    }

    fn len(&self) -> usize {
        self.states * self.coordinates
    }

    fn add(&mut self, _: &ForceUse<'_>, _: &mut [f64]) {}

    fn add_state(&mut self, of: &StateUse<'_>, derivative: &mut [f64]) {
        let mut held = of.x_bar.to_vec();
        let free = held.iter_mut().zip(of.system.inverse_mass()).filter(|(_, weight)| **weight > 0.0);
        free.for_each(|(held, _)| *held = 0.0);
        let first = of.step as usize * self.coordinates;
        let held = self.numbering.to_original(&held, of.system.dimension());
        derivative[first..][..self.coordinates].copy_from_slice(&held);
    }
}
