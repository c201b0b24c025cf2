//! Errors of gradients and tangents.

use pliant::modes::ModesError;
use pliant::quantity::Rounded;
use pliant::simulation::{SnapshotError, StepError};

/// Reason why a gradient cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GradientError {
    /// A part of the simulation has no adjoint.
    #[error("there is no derivative of {what}: {remedy}")]
    Unsupported {
        /// Name of that part.
        what: String,
        /// Alternative without it.
        remedy: &'static str,
    },
    /// The run failed.
    #[error("the run fails: {0}")]
    Step(#[from] StepError),
    /// A step was subdivided that was a full step when the steps of the run were determined.
    #[error("step {} was subdivided, but was a full step before: choose a smaller step", .step + 1)]
    Parts {
        /// Number of steps before it.
        step: u64,
    },
    /// A state of the run could not be restored.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The natural modes could not be computed.
    #[error("the frequencies cannot be computed: {0}")]
    Modes(#[from] ModesError),
    /// Derivatives of natural frequencies by a parameter are not implemented.
    #[error(
        "natural frequencies have no derivative by parameter {number} of those asked for, counted from 0: \
         moduli, densities, masses, rest shapes and the stiffness of springs have one, masses and shapes \
         where all elements are of first order"
    )]
    FrequencyParameter {
        /// Index among the parameters.
        number: usize,
    },
    /// The loss or its derivative is not finite.
    #[error(
        "the loss is not finite at step {step} (t = {time} s): {what} is {value}",
        time = Rounded::<9>(*.time)
    )]
    Loss {
        /// Step number.
        step: u64,
        /// Time of the step [s].
        time: f64,
        /// The loss itself, or one of its derivatives with the vertex.
        what: String,
        /// Value found.
        value: f64,
    },
    /// The gradient overflows.
    #[error(
        "the gradient overflows at step {step} (t = {time} s): it has grown by exp({growth:.4} t) on the \
         way back from the end of the run; ask for a shorter run",
        time = Rounded::<9>(*.time)
    )]
    Overflow {
        /// Step number at which it overflowed.
        step: u64,
        /// Time of the step [s].
        time: f64,
        /// Growth of its logarithm per second of the run [1/s].
        growth: f64,
    },
    /// The tangent overflows.
    #[error(
        "the tangent overflows in step {step} (t = {time} s): it has grown by exp({growth:.4} t) from the \
         start of the run; ask for a shorter run",
        time = Rounded::<9>(*.time)
    )]
    TangentOverflow {
        /// Step number.
        step: u64,
        /// Time at the end of the step [s].
        time: f64,
        /// Growth of its logarithm per second of the run, from the first nonzero tangent to the last
        /// finite one [1/s].
        growth: f64,
    },
    /// A step has no derivative because its matrix is singular.
    #[error(
        "step {step} (t = {time} s) has no derivative: the matrix of its equations is singular at the \
         solution; another step size moves it away from there",
        time = Rounded::<9>(*.time)
    )]
    Singular {
        /// Step number.
        step: u64,
        /// Time at the end of the step [s].
        time: f64,
    },
    /// The run was stopped, see [`Simulation::set_stop`](pliant::simulation::Simulation::set_stop).
    #[error("stopped at step {step}")]
    Stopped {
        /// Step number.
        step: u64,
    },
    /// A parameter belongs to a term that the simulation does not have.
    #[error(
        "a parameter is a number of {name}, and the simulation has no such term: take the parameters of the \
         scene that it was assembled from"
    )]
    Term {
        /// Name of the term.
        name: String,
    },
    /// The parameter does not exist or has no derivative.
    #[error("`{name}` {problem}; the gradient can be taken with respect to: {}", known.join(", "))]
    Parameter {
        /// Name of the parameter.
        name: String,
        /// Problem with it.
        problem: String,
        /// Names that have a derivative.
        known: Vec<String>,
    },
}
