//! Work of friction in steps of backward Euler.

use crate::system::System;

/// Integrates friction as the integrator computes it: the force at the end of a step, at the velocities
/// `(x_(n+1) - x_n) / h`, times the displacement `x_(n+1) - x_n`.
///
/// The trapezoidal rule over the power at the ends of a step would give another work: kinetic energy
/// falls by `F (v_n + v_(n+1)) h/2`, but a body that slides at the start of the step moves by
/// `v_(n+1) h`. The difference is the numerical damping of the integrator, and would count as friction.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct StepFriction {
    /// Positions at the end of the last step, flat [m].
    x: Vec<f64>,
}

/// Work of friction in one step [J].
pub(super) struct FrictionWork {
    pub(super) lost: f64,
    /// Part supplied by prescribed motion.
    pub(super) by_motion: f64,
}

impl StepFriction {
    pub(super) fn from(x: &[f64]) -> Self {
        StepFriction { x: x.to_vec() }
    }

    /// Advances by a step of `h` [s] to the positions `x`.
    pub(super) fn advance(&mut self, system: &mut System, h: f64, x: &[f64]) -> FrictionWork {
        // Friction that is lagged once uses the normal forces at the start of the step.
        let is_lagged = system.most_renewals() == Some(1);
        if is_lagged {
            system.freeze(&self.x, 1.0);
        }
        self.x.iter_mut().zip(x).for_each(|(last, x)| *last = (x - *last) / h);
        let lost = h * system.dissipated_powers(x, &self.x)[1];
        let by_motion = h * power_of_motion(system, x, &self.x);
        if is_lagged {
            system.thaw();
        }
        self.x.copy_from_slice(x);
        FrictionWork { lost, by_motion }
    }
}

/// Returns the power of prescribed motion against friction at positions `x` and velocities `v` [W].
pub(super) fn power_of_motion(system: &mut System, x: &[f64], v: &[f64]) -> f64 {
    if !system.has_prescribed_motion() {
        return 0.0;
    }
    let (d, mut forces) = (system.dimension(), Default::default());
    system.dissipative_forces(x, v, &mut forces);
    let [_, friction] = forces;
    let moving = system.constraints().iter().filter(|hold| hold.moves());
    let carried = moving.flat_map(|hold| {
        let axes = hold.axes();
        hold.vertices()
            .iter()
            .flat_map(move |vertex| (0..d).filter(move |c| axes[*c]).map(move |c| *vertex as usize * d + c))
    });
    carried.map(|i| friction[i] * v[i]).sum()
}
