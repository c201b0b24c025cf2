//! Reasons why a gradient cannot be had.

use pliant::modes::ModesError;
use pliant::quantity::Rounded;
use pliant::simulation::{SnapshotError, StepError};

/// A gradient cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GradientError {
    /// Something in the simulation has no adjoint.
    #[error("there is no derivative of {what}: {remedy}")]
    Unsupported {
        /// Its name.
        what: String,
        /// A way to do without it.
        remedy: &'static str,
    },
    /// The run failed.
    #[error("the run fails: {0}")]
    Step(#[from] StepError),
    /// A step was taken in parts that was whole when the steps of the run were chosen.
    #[error("step {} is taken in parts, which was whole before: choose a shorter step", .step + 1)]
    Parts {
        /// Steps before it.
        step: u64,
    },
    /// A state of the run could not be gone back to.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The natural modes cannot be found.
    #[error("the frequencies cannot be had: {0}")]
    Modes(#[from] ModesError),
    /// Derivatives of frequencies by a parameter are not known.
    #[error(
        "natural frequencies have no derivative by parameter {number} of those asked for, counted from 0: \
         moduli, densities, masses, rest shapes and the stiffness of springs have one, masses and shapes \
         where all elements are of first order"
    )]
    FrequencyParameter {
        /// Its place among the parameters.
        number: usize,
    },
    /// The loss, or its derivative, is not finite.
    #[error(
        "the loss is not finite at step {step} (t = {time} s): {what} is {value}",
        time = Rounded::<9>(*.time)
    )]
    Loss {
        /// Number of the step.
        step: u64,
        /// Time there [s].
        time: f64,
        /// The loss itself, or a derivative of it and its vertex.
        what: String,
        /// The number.
        value: f64,
    },
    /// The gradient is beyond the range of numbers.
    #[error(
        "the gradient overflows at step {step} (t = {time} s): it has grown by exp({growth:.4} t) on the \
         way back from the end of the run; ask for a shorter run",
        time = Rounded::<9>(*.time)
    )]
    Overflow {
        /// Number of the step at which it did.
        step: u64,
        /// Time there [s].
        time: f64,
        /// Growth of its logarithm per second of the run [1/s].
        growth: f64,
    },
    /// The changes of states are beyond the range of numbers.
    #[error(
        "the tangent overflows in step {step} (t = {time} s): it has grown by exp({growth:.4} t) from the \
         start of the run; ask for a shorter run",
        time = Rounded::<9>(*.time)
    )]
    TangentOverflow {
        /// Number of the step.
        step: u64,
        /// Time at its end [s].
        time: f64,
        /// Growth of its logarithm per second of the run, from the first state that changes to the last
        /// that is a number [1/s].
        growth: f64,
    },
    /// A step has no derivative: its matrix is singular.
    #[error(
        "step {step} (t = {time} s) has no derivative: the matrix of its equations is singular at the \
         solution; another step size moves it away from there",
        time = Rounded::<9>(*.time)
    )]
    Singular {
        /// Number of the step.
        step: u64,
        /// Time at its end [s].
        time: f64,
    },
    /// It was told to stop, see [`Simulation::set_stop`](pliant::simulation::Simulation::set_stop).
    #[error("stopped at step {step}")]
    Stopped {
        /// Number of the step.
        step: u64,
    },
    /// A parameter is a number of a term that the simulation does not have.
    #[error(
        "a parameter is a number of {name}, and the simulation has no such term: take the parameters of the \
         scene that it was assembled from"
    )]
    Term {
        /// Name of the term.
        name: String,
    },
    /// There is no such parameter, or it has no derivative.
    #[error("`{name}` {problem}; the gradient can be taken with respect to: {}", known.join(", "))]
    Parameter {
        /// Its name.
        name: String,
        /// The mistake.
        problem: String,
        /// Names that have a derivative.
        known: Vec<String>,
    },
}
