//! Gradients of runs: derivatives of a loss `L = sum_k l_k(x_k, v_k)` by the initial state and by
//! parameters of the forces.
//!
//! The derivatives are those of the discrete steps, not of the continuous motion they approximate. Each
//! step is propagated back by the adjoint of its integrator, exact to rounding, or to the solver
//! tolerance for implicit steps. One backward sweep gives the derivatives by all parameters at once.
//!
//! Example: a falling mass, `y = y_0 + v_0 t - g t^2/2`, which `velocity-verlet` integrates exactly.
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

/// Memory budget that keeps all states.
pub const UNLIMITED: usize = usize::MAX;

/// Derivatives of a loss.
#[derive(Clone, Debug, PartialEq)]
pub struct RunGradient {
    /// Value of the loss.
    pub value: f64,
    /// Derivatives by the initial positions, flat `(n, dimension)`, vertices in the order of the scene;
    /// for fixed vertices by the positions where they are fixed.
    pub position: Vec<f64>,
    /// Derivatives by the initial velocities, likewise; zero where fixed.
    pub velocity: Vec<f64>,
    /// Derivatives by the numbers of each parameter, in order.
    pub parameters: Vec<Vec<f64>>,
    /// Growth of the logarithm of the largest derivative by a state, from the last state to the first
    /// [1/s]; zero if the loss does not depend on the last.
    pub growth: f64,
    /// Number of solves after which lagged friction still changed by more than the tolerance. Their steps
    /// used normal forces of another state, and their derivatives are not exact.
    pub unsettled: u64,
    /// Events of vertices that came to a wall or left one in a step, in scenes without contact. A step in
    /// which a vertex just reaches a wall has no derivative; the one returned is that of the side on
    /// which the run was. A gradient with many such events says little about perturbations that are large
    /// enough to shift them.
    pub wall_events: Vec<WallEvent>,
    /// Changes of the pairs in contact, in scenes with contact.
    pub contact_events: ContactEvents,
}

/// Takes `steps` steps of `simulation` from its present state, and computes the derivatives of `loss`
/// over the states from the first to the last. The simulation ends in the last state; methods with memory
/// restart at the first.
///
/// States are kept in `budget` bytes, at least those of one step. If they do not fit, parts of the run
/// are repeated from a few stored states: explicit methods bit-identically, implicit ones to the
/// tolerance of their solver.
///
/// With adaptive step sizes, the derivatives are those at the sizes found in a run before: the dependence
/// of the sizes themselves on the initial state or a parameter is not included.
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

/// Computes the gradient as [`gradient`] does, with steps that land on each of the `times`, ascending
/// [s], and end at the last. With a fixed step size, as many steps are taken as come nearest to that.
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
/// The errors of [`gradient`].
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
