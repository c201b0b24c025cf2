//! Parameters of uniform gravity.

use pliant_scene::OverTime;

use super::{ForceUse, Parameter};

/// Acceleration of uniform gravity [m/s^2], one number for each dimension. For time-dependent gravity the
/// derivative is by a constant added to it.
#[derive(Clone, Copy, Debug)]
pub struct Gravity {
    dimension: usize,
}

impl Gravity {
    /// Gravity in `dimension` dimensions.
    pub fn new(dimension: usize) -> Self {
        Gravity { dimension }
    }
}

impl Parameter for Gravity {
    fn len(&self) -> usize {
        self.dimension
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (force, mass) in force.chunks_exact_mut(self.dimension).zip(of.system.mass()) {
            force.iter_mut().zip(change).for_each(|(force, change)| *force += mass * change);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        match self.dimension {
            2 => add_weights::<2>(of.p, of.system.mass(), derivative),
            _ => add_weights::<3>(of.p, of.system.mass(), derivative),
        }
    }
}

/// Adds `sum_i m_i p_i`.
fn add_weights<const D: usize>(p: &[f64], mass: &[f64], sum: &mut [f64]) {
    let mut total = [0.0; D];
    for (p, mass) in p.as_chunks::<D>().0.iter().zip(mass) {
        (0..D).for_each(|k| total[k] += mass * p[k]);
    }
    sum.iter_mut().zip(total).for_each(|(sum, total)| *sum += total);
}

/// Parameter of the gravity formulas, named after `where`; common to all components that use it.
#[derive(Clone, Debug)]
pub struct GravityNumber {
    /// Components of gravity [m/s^2].
    formulas: Vec<OverTime>,
    name: String,
}

impl GravityNumber {
    /// Parameter with this name in the components of gravity.
    pub fn new(formulas: Vec<OverTime>, name: String) -> Self {
        GravityNumber { formulas, name }
    }

    /// Gravity parameter, and the derivative of gravity at the time of a force.
    fn rates(&self, time: f64) -> (Gravity, Vec<f64>) {
        let rate = |formula: &OverTime| formula.derivative(&self.name, [0.0; 3], time);
        (Gravity::new(self.formulas.len()), self.formulas.iter().map(rate).collect())
    }
}

impl Parameter for GravityNumber {
    fn len(&self) -> usize {
        1
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let (mut gravity, rates) = self.rates(of.time);
        let change: Vec<f64> = rates.iter().map(|rate| rate * change[0]).collect();
        gravity.add_change(of, &change, force)
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let (mut gravity, rates) = self.rates(of.time);
        let mut by_gravity = vec![0.0; rates.len()];
        gravity.add(of, &mut by_gravity);
        derivative[0] += by_gravity.iter().zip(&rates).map(|(by, rate)| by * rate).sum::<f64>();
    }
}
