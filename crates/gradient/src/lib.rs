//! Gradients of runs: `L = sum_k l_k(x_k, v_k)` by the state that a run begins with and by parameters of its
//! forces.
//!
//! They are derivatives of the steps that were taken, not of the motion that these approximate: each step
//! is taken back by the adjoint of its engine, exact to rounding, or to the tolerance of the solver where
//! steps are implicit. One sweep gives the derivatives by all numbers at once.
//!
//! A mass that falls: `y = y_0 + v_0 t - g t^2/2` by `velocity-verlet`, without error.
//!
//! ```
//! use pliant::energy::gravity::UniformGravity;
//! use pliant::integrator::IntegratorSpec;
//! use pliant::{simulation::Simulation, state::State, system::System};
//! use pliant_gradient::{LossFrame, Gravity, Parameter, UNLIMITED, gradient};
//!
//! let mut system = System::new(2, vec![2.0]);
//! system.add_term(Box::new(UniformGravity::new(&[0.0, -10.0], &[2.0])));
//! let state = State::new(vec![0.0, 5.0], vec![1.0, 0.0]);
//! let mut simulation = Simulation::new(system, state, IntegratorSpec::VelocityVerlet.method(), 0.125);
//! let mut height = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
//!     if frame.step < 8 {
//!         return 0.0;
//!     }
//!     x_bar[1] = 1.0;
//!     frame.x[1]
//! };
//! let mut parameters: Vec<Box<dyn Parameter>> = vec![Box::new(Gravity::new(2))];
//! let found = gradient(&mut simulation, 8, &mut height, &mut parameters, UNLIMITED)?;
//! assert_eq!((found.value, &found.position[..]), (0.0, &[0.0, 1.0][..]));
//! assert_eq!(found.velocity, [0.0, 1.0]);
//! assert_eq!(found.parameters[0], [0.0, 0.5]);
//! # Ok::<(), pliant_gradient::GradientError>(())
//! ```

mod adjoint;
mod checkpoints;
mod contact_events;
mod coupled;
mod error;
mod frequencies;
mod gauss_newton;
mod hessian;
mod krylov;
mod linear;
mod loss;
mod names;
mod parameter;
mod parts;
mod schedule;
mod support;
mod sweep;
mod tangent;
mod walls;

use pliant::simulation::Simulation;

use schedule::{RunLength, Schedule};

pub use contact_events::ContactEvents;
pub use error::GradientError;
pub use frequencies::{FrequencyGradient, frequency_gradient};
pub use gauss_newton::{LossCurvature, gauss_newton_product};
pub use hessian::{HessianProduct, hessian_product};
pub use loss::{Loss, LossFrame};
pub use names::{ParameterSelection, names};
pub use parameter::{
    AttractingMasses, AxisDirections, BodyDensity, BodyElements, Concatenated, ContactShape,
    ContactStiffness, EtherDrag, FibreTension, ForceUse, FormulaNumber, FrictionCoefficient, Gravity,
    GravityNumber, HeldChange, HeldPlaces, HeldUse, LoadFactor, LoadShape, LoadValue, Masses,
    MembraneElements, ModeUse, Modulus, MotionFactor, MotionNumber, MotionShape, NumberLink, Parameter,
    ParameterNeeds, RestLengths, ShapedElements, Softening, SpringStiffness, StateUse, StepForces,
    TermFactor, TieConstants, TieRestLength, TieShape, Together, TunedSpring, VolumeForce, WeightDensity,
    Weighted, cell_axes,
};
pub use support::check;
pub use tangent::{RunDirection, RunTangent, tangent, tangent_along};
pub use walls::WallEvent;

/// A budget that keeps all states.
pub const UNLIMITED: usize = usize::MAX;

/// Derivatives of a loss.
#[derive(Clone, Debug, PartialEq)]
pub struct RunGradient {
    /// The loss.
    pub value: f64,
    /// By the positions at the start, flat `(n, dimension)`, vertices in the order of the scene; of held
    /// vertices by the places where they are held.
    pub position: Vec<f64>,
    /// By the velocities at the start, likewise; zero where held.
    pub velocity: Vec<f64>,
    /// By the numbers of each parameter, in their order.
    pub parameters: Vec<Vec<f64>>,
    /// Growth of the logarithm of the largest derivative by a state, from the last state to the first
    /// [1/s]; zero where the loss does not depend on the last.
    pub growth: f64,
    /// Solves of the run after which friction still changed, beyond the tolerance: their steps were taken
    /// with normal forces of elsewhere, and the derivatives are not exact there.
    pub unsettled: u64,
    /// Vertices that came to a wall or left one, by steps: those of which only the beginning or only the end
    /// has the vertex on the wall, in scenes without contact. The step on the way has no derivative where it
    /// just so comes there; the one given is that of the side on which the run was. A gradient of many such
    /// events says little about changes that are large enough to shift them.
    pub wall_events: Vec<WallEvent>,
    /// Changes of the pairs that touch, in scenes with contact.
    pub contact_events: ContactEvents,
}

/// Takes `steps` steps of `simulation` from where it is, and gives the derivatives of `loss` over the
/// states from the first to the last. The simulation ends where the steps have led; schemes that remember
/// earlier steps begin anew.
///
/// States are kept in `budget` bytes, one step's at least. Where they do not fit, parts of the run are
/// taken again from a few states that are kept: explicit schemes with the same bits, implicit ones to the
/// tolerance of their solver.
///
/// Derivatives where step sizes follow the error are those at the sizes that a run before has found: what a
/// change of the start or of a parameter would make of the sizes themselves is no part of them.
///
/// # Errors
/// [`GradientError`]: a term without adjoint, a step that fails, a loss that is not finite, a
/// gradient that overflows.
pub fn gradient(
    simulation: &mut Simulation,
    steps: u64,
    loss: &mut dyn Loss,
    parameters: &mut [Box<dyn Parameter>],
    budget: usize,
) -> Result<RunGradient, GradientError> {
    gradient_over(simulation, RunLength::Steps(steps), loss, parameters, budget)
}

/// The same of steps that land on each of the `times`, ascending [s], and end at the last. Of fixed sizes are
/// as many as come nearest to that.
///
/// ```
/// use pliant::control::StepControl;
/// use pliant::energy::gravity::UniformGravity;
/// use pliant::integrator::{IntegratorSpec, estimate::Tolerances};
/// use pliant::{simulation::Simulation, state::State, system::System};
/// use pliant_gradient::{LossFrame, UNLIMITED, gradient_to};
///
/// let mut system = System::new(2, vec![2.0]);
/// system.add_term(Box::new(UniformGravity::new(&[0.0, -10.0], &[2.0])));
/// let state = State::new(vec![0.0, 5.0], vec![1.0, 0.0]);
/// let mut simulation = Simulation::new(system, state, IntegratorSpec::DormandPrince5.method(), 0.125);
/// let tolerances = Tolerances { relative: 1e-6, position: 1e-6, velocity: 1e-6 };
/// simulation.set_step_control(StepControl { tolerances, first: None, smallest: 0.0, largest: 0.3 });
/// let mut height = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
///     if frame.time != 1.0 {
///         return 0.0;
///     }
///     x_bar[1] = 1.0;
///     frame.x[1]
/// };
/// // y = y_0 + v_0 t - g t^2/2 at t = 1.
/// let found = gradient_to(&mut simulation, &[0.5, 1.0], &mut height, &mut [], UNLIMITED)?;
/// assert!((found.value).abs() < 1e-14 && (found.velocity[1] - 1.0).abs() < 1e-14);
/// # Ok::<(), pliant_gradient::GradientError>(())
/// ```
///
/// # Errors
/// As [`gradient`].
pub fn gradient_to(
    simulation: &mut Simulation,
    times: &[f64],
    loss: &mut dyn Loss,
    parameters: &mut [Box<dyn Parameter>],
    budget: usize,
) -> Result<RunGradient, GradientError> {
    gradient_over(simulation, RunLength::Times(times), loss, parameters, budget)
}

fn gradient_over(
    simulation: &mut Simulation,
    length: RunLength<'_>,
    loss: &mut dyn Loss,
    parameters: &mut [Box<dyn Parameter>],
    budget: usize,
) -> Result<RunGradient, GradientError> {
    support::check(simulation)?;
    parts::check_terms(simulation.system_mut(), parameters)?;
    let start = simulation.may_take_parts().then(|| simulation.snapshot());
    let mut sweep = |simulation: &mut Simulation, schedule: Schedule| {
        parameters.iter_mut().for_each(|parameter| parameter.begin(schedule.frames()));
        sweep::Sweep::new(simulation, loss, parameters, budget, &schedule).run()
    };
    let schedule = Schedule::whole_steps(simulation, length)?;
    match (sweep(simulation, schedule), start) {
        (Err(GradientError::Parts { .. }), Some(start)) => {
            simulation.restore(&start)?;
            let schedule = Schedule::of(simulation, length)?;
            sweep(simulation, schedule)
        }
        (end, _) => end,
    }
}
