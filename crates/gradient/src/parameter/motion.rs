//! Prescribed motion.

use pliant::system::System;

use super::{ForceUse, HeldUse, Parameter};

/// A factor of the prescribed motion of a pin, 1 as the scene has it: places `x(0) + f u(t)`, velocities `f
/// u'(t)`.
#[derive(Clone, Debug)]
pub struct MotionFactor {
    hold: String,
    /// Coordinates that it moves, and where they would be without motion [m], once they have been looked up.
    starts: Option<Vec<(usize, f64)>>,
}

impl MotionFactor {
    /// Of the [hold](pliant::constraint::Hold) of this name.
    pub fn new(hold: String) -> Self {
        MotionFactor { hold, starts: None }
    }

    fn starts(&mut self, system: &System) -> &[(usize, f64)] {
        self.starts.get_or_insert_with(|| {
            let (d, n) = (system.dimension(), system.inverse_mass().len());
            let (mut x, mut v) = (vec![0.0; n], vec![0.0; n]);
            // All motion starts from there.
            system.prescribe(0.0, &mut x, &mut v);
            let holds = system.constraints().iter().filter(|hold| hold.name() == self.hold);
            holds.flat_map(|hold| hold.coordinates(d)).map(|i| (i, x[i])).collect()
        })
    }
}

impl Parameter for MotionFactor {
    fn len(&self) -> usize {
        1
    }

    fn looks_at_held(&self) -> bool {
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (i, start) in self.starts(of.system) {
            derivative[0] -= of.by_positions[*i] * (of.x[*i] - start) + of.by_velocities[*i] * of.v[*i];
        }
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        for (i, start) in self.starts(of.system) {
            derivative[0] += of.x_bar[*i] * (of.x[*i] - start) + of.v_bar[*i] * of.v[*i];
        }
    }
}
