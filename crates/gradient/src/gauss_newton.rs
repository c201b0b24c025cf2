//! Products with the Gauss-Newton matrix of a loss: a tangent run followed by its adjoint.

use pliant::simulation::{Simulation, Snapshot};

use crate::adjoint::has_memory;
use crate::parameter::Parameter;
use crate::tangent::{RunDirection, RunTangent, tangent_along};
use crate::{GradientError, LossFrame, RunGradient, gradient};
use pliant::algebra::dot;

/// Second derivatives of a loss by the states of a run.
pub trait LossCurvature {
    /// Adds to `x_bar` and `v_bar`, initially zero, the product of the second derivatives of one state's
    /// part with its change: for `l = |W x - y|^2/2` it is `x_bar = W^T W dx`. Called once for each
    /// state, from the first to the last.
    fn product(&mut self, frame: &LossFrame<'_>, change: &RunTangent, x_bar: &mut [f64], v_bar: &mut [f64]);
}

impl<F: FnMut(&LossFrame<'_>, &RunTangent, &mut [f64], &mut [f64])> LossCurvature for F {
    fn product(&mut self, frame: &LossFrame<'_>, change: &RunTangent, x_bar: &mut [f64], v_bar: &mut [f64]) {
        self(frame, change, x_bar, v_bar);
    }
}

/// Computes the product of the Gauss-Newton matrix of a loss `L = sum_k l_k(x_k, v_k)` with a
/// `direction`, over two runs of `steps` steps of `simulation` from its present state,
///
/// ```text
/// G d = sum_k J_k^T (d2 l_k) J_k d
/// ```
///
/// with the Jacobians `J_k` of the states by the initial state and by the parameters. `G` is the part of
/// the Hessian of `L` without second derivatives of states, and the whole of it at a minimum with zero
/// residuals. The remainder needs third derivatives of energies, which are not implemented. `G` is
/// symmetric, and positive semidefinite if the `l_k` are convex.
///
/// The `value` is `d . G d`. The simulation ends in the last state; `budget` is that of
/// [`gradient`](crate::gradient()).
///
/// # Errors
/// The errors of [`gradient`](crate::gradient()) and [`tangent_along`].
///
/// # Panics
/// If the direction has another shape than the state and the parameters.
pub fn gauss_newton_product(
    simulation: &mut Simulation,
    steps: u64,
    direction: RunDirection<'_>,
    curvature: &mut dyn LossCurvature,
    parameters: &mut [Box<dyn Parameter>],
    budget: usize,
) -> Result<RunGradient, GradientError> {
    let start = start_of(simulation);
    // For each state [bars of positions, of velocities]; `None` if all are zero.
    let mut bars: Vec<Option<[Vec<f64>; 2]>> = vec![];
    let mut value = 0.0;
    tangent_along(simulation, steps, direction, parameters, &mut |frame, change| {
        let [mut x_bar, mut v_bar] = [(); 2].map(|()| vec![0.0; frame.x.len()]);
        curvature.product(frame, change, &mut x_bar, &mut v_bar);
        value += dot(&x_bar, &change.position) + dot(&v_bar, &change.velocity);
        let is_something = x_bar.iter().chain(&v_bar).any(|bar| *bar != 0.0);
        bars.push(is_something.then_some([x_bar, v_bar]));
    })?;
    simulation.restore(&start)?;
    let first = simulation.state().step;
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]| {
        if let Some([by_x, by_v]) = &bars[(frame.step - first) as usize] {
            x_bar.copy_from_slice(by_x);
            v_bar.copy_from_slice(by_v);
        }
        0.0
    };
    let found = gradient(simulation, steps, &mut loss, parameters, budget)?;
    Ok(RunGradient { value, ..found })
}

/// Snapshot of a simulation from which methods with memory restart.
fn start_of(simulation: &Simulation) -> Snapshot {
    if !has_memory(simulation.method().scheme) {
        return simulation.snapshot();
    }
    let (state, x, v) = (simulation.state(), simulation.positions(), simulation.velocities());
    let snapshot = Snapshot::new(state.step, state.time, x.into_owned(), v.into_owned());
    snapshot.with_history(simulation.system().history())
}
