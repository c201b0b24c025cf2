//! Errors of failed steps, and their messages with advice.

use crate::energy::Fault;
use crate::quantity::{Rounded, Seconds, counted};
use crate::solver::{ForceLeft, SolveError, SolveFailure, StepFault};

/// Error of a failed step; the state is still the last valid one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepError {
    /// A position, velocity or force is not finite.
    #[error(
        "step {step} (t = {time} s) failed{}: {}{}",
        nor_in_parts(.retried.as_deref()), cause(.fault.as_deref(), .vertex),
        advice(
            .fault.as_deref(), smallest(*.step_size, .retried.as_deref()), *.stable_step,
            parts(*.is_implicit, .retried.as_deref())
        ),
        time = Rounded::<9>(*.time)
    )]
    NotFinite {
        /// Number of the attempted step, from 1.
        step: u64,
        /// Time at its start [s].
        time: f64,
        /// Cause, if a term knows it.
        fault: Option<Box<Fault>>,
        /// First vertex whose position or velocity is not finite.
        vertex: Option<usize>,
        /// Attempted step size [s].
        step_size: f64,
        /// Largest stable step at the start [s], if known.
        stable_step: Option<f64>,
        /// Smallest failed substep, if substeps were tried; the cause then refers to it.
        retried: Option<Box<Retried>>,
        /// True for an implicit integrator, which can subdivide steps.
        is_implicit: bool,
    },
    /// An implicit step was not solved.
    #[error(
        "step {step} ({}) was not solved{}: {verdict}{}{}{}; {}",
        moment(*.time, .statics.as_deref()), nor_in_parts(.retried.as_deref()),
        iterations_taken(*.iterations, *.correction),
        left_over(.statics.as_ref().and_then(|statics| statics.left)), place(.fault.as_deref()),
        remedy(*.verdict, .fault.as_deref(), .statics.as_deref(), *.step_size, .retried.as_deref())
    )]
    Unsolved {
        /// Number of the attempted step, from 1.
        step: u64,
        /// Time at its start [s].
        time: f64,
        /// Reason of the solver.
        verdict: SolveFailure,
        /// Newton iterations taken.
        iterations: u32,
        /// Largest component of the last correction [m].
        correction: f64,
        /// Cause, if a term knows it.
        fault: Option<Box<Fault>>,
        /// Attempted step size [s].
        step_size: f64,
        /// Smallest failed substep, if substeps were tried; reason and cause then refer to it.
        retried: Option<Box<Retried>>,
        /// Further details in statics.
        statics: Option<Box<UnsolvedStatics>>,
    },
    /// The required step size is below the smallest allowed one.
    #[error(
        "{what} {step} (t = {time} s) failed: {step_size} is still too large{}, and the smallest allowed is \
         {smallest}{}{}{}",
        still(*.error), why(.cause.as_deref()),
        left_over(.cause.as_ref().and_then(|cause| cause.solve?.left)),
        beyond_limit(*.is_static),
        what = if *.is_static { "increment" } else { "step" },
        step_size = Seconds(*.step_size), smallest = Seconds(*.smallest),
        time = Rounded::<9>(*.time)
    )]
    StepTooSmall {
        /// Number of the attempted step, from 1.
        step: u64,
        /// Time at its start [s].
        time: f64,
        /// Last attempted step size [s].
        step_size: f64,
        /// Smallest allowed step size [s].
        smallest: f64,
        /// Error of that last step relative to the tolerance; `None` if the step failed.
        error: Option<f64>,
        /// Cause, if the step failed.
        cause: Option<Box<StepFault>>,
        /// True in statics.
        is_static: bool,
    },
    /// The total energy has grown beyond any physical cause.
    #[error(
        "unstable: after step {step} (t = {time} s) the total energy is {energy} J, {start} J at the start{}",
        advice(None, *.step_size, *.stable_step, ""),
        energy = Rounded::<4>(*.energy), start = Rounded::<4>(*.start),
        time = Rounded::<9>(*.time)
    )]
    Unstable {
        /// Steps taken.
        step: u64,
        /// Simulated time [s].
        time: f64,
        /// Current total energy [J].
        energy: f64,
        /// Total energy at the start [J].
        start: f64,
        /// The step size [s].
        step_size: f64,
        /// Largest stable step at the start [s], if known.
        stable_step: Option<f64>,
    },
}

impl StepError {
    /// Returns the cause, if a term knows it.
    pub fn fault(&self) -> Option<&Fault> {
        match self {
            StepError::NotFinite { fault, .. } | StepError::Unsolved { fault, .. } => fault.as_deref(),
            StepError::StepTooSmall { cause, .. } => cause.as_ref()?.fault.as_ref(),
            StepError::Unstable { .. } => None,
        }
    }

    /// Returns the first vertex whose position or velocity is not finite.
    pub fn vertex(&self) -> Option<usize> {
        match self {
            StepError::NotFinite { vertex, .. } => *vertex,
            StepError::StepTooSmall { cause, .. } => cause.as_ref()?.vertex,
            StepError::Unsolved { .. } | StepError::Unstable { .. } => None,
        }
    }
}

/// Details of an unsolved static increment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnsolvedStatics {
    /// Largest residual force.
    pub left: Option<ForceLeft>,
    /// Load factor at the start of the step, in arc-length continuation.
    pub load_factor: Option<f64>,
}

/// Smallest substep that failed, as all larger ones did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Retried {
    /// Number of halvings of the step.
    pub halvings: u32,
    /// Size of the substep [s].
    pub step_size: f64,
    /// Time at its start [s].
    pub time: f64,
}

/// Describes the substeps tried.
fn nor_in_parts(retried: Option<&Retried>) -> String {
    let said = |Retried { halvings, step_size, time }: &Retried| {
        let sizes = 2_u64.pow(*halvings);
        format!(
            ", even subdivided down to 1/{sizes}, {step_size}, the last part at t = {time} s",
            step_size = Seconds(*step_size),
            time = Rounded::<9>(*time)
        )
    };
    retried.map_or(String::new(), said)
}

/// Describes the moment of a step: its time or load factor.
fn moment(time: f64, statics: Option<&UnsolvedStatics>) -> String {
    let load_factor = statics.and_then(|statics| statics.load_factor);
    load_factor.map_or_else(
        || format!("t = {time} s", time = Rounded::<9>(time)),
        |factor| format!("load factor {factor:.6}"),
    )
}

/// Smallest attempted step [s].
fn smallest(step_size: f64, retried: Option<&Retried>) -> f64 {
    retried.map_or(step_size, |part| part.step_size)
}

/// Advice on step subdivision.
fn parts(is_implicit: bool, retried: Option<&Retried>) -> &'static str {
    match (is_implicit, retried) {
        (false, _) => "",
        (true, None) => ", or `retries` in [time] solver, which subdivide failed steps",
        (true, Some(_)) => ", or more `retries` in [time] solver",
    }
}

/// Advice for an unsolved step.
fn remedy(
    verdict: SolveFailure,
    fault: Option<&Fault>,
    statics: Option<&UnsolvedStatics>,
    step_size: f64,
    retried: Option<&Retried>,
) -> String {
    if statics.is_some_and(|statics| statics.load_factor.is_some()) {
        return match verdict {
            SolveFailure::Unloaded => "multiply the load or the prescribed motion that is to grow by `t`, \
                                       which is the load factor: `force = [\"0\", \"-10*t\"]`"
                .into(),
            SolveFailure::Singular => "support every body by pins or attachments; at a bifurcation, add a \
                                       small load to one side, or a small imperfection of the shape"
                .into(),
            _ => "no radius down to a millionth of the first one converges: use a smaller `first` or \
                  `largest` in [time] arc_length, or check what becomes unstable there"
                .into(),
        };
    }
    if matches!(fault, Some(Fault::Sheet { .. })) {
        return "use a material that withstands more stretch, or smaller loads".into();
    }
    if matches!(fault, Some(Fault::Material { .. })) {
        return AT_MATERIAL.into();
    }
    if statics.is_some() && verdict == SolveFailure::Indefinite {
        return "statics has no inertia: support every body by pins or attachments, or check what becomes \
                unstable there"
            .into();
    }
    let half = 0.5 * smallest(step_size, retried);
    let smaller = format!("a smaller step, {}{}", Seconds(half), parts(true, retried));
    match verdict {
        SolveFailure::IterationCap => format!("allow more `iterations`, or try {smaller}"),
        SolveFailure::LinearSolver => format!("use `linear = \"cholesky\"`, or try {smaller}"),
        _ => format!("try {smaller}"),
    }
}

/// Advice if a user-defined material returns no number.
const AT_MATERIAL: &str = "evaluate its function at that deformation, and look for a division by zero";

/// Describes iterations and last correction; empty if there was no iteration.
fn iterations_taken(iterations: u32, correction: f64) -> String {
    if !correction.is_finite() {
        return String::new();
    }
    format!(
        "; {}, last correction {correction} m",
        counted(iterations.into(), "iteration", "iterations"),
        correction = Rounded::<4>(correction)
    )
}

/// Describes the largest residual force of a static solve.
fn left_over(left: Option<ForceLeft>) -> String {
    let said = |ForceLeft { force, vertex }| {
        format!(", largest residual force {force} N at vertex {vertex}", force = Rounded::<4>(force))
    };
    left.map_or(String::new(), said)
}

/// Advice if static increments become too small.
fn beyond_limit(is_static: bool) -> &'static str {
    if is_static {
        "; this may be a limit point, beyond which no equilibrium is near: `arc_length` in [time] instead \
         of `adaptive` follows the path past it, dynamics with damping jumps to the next equilibrium"
    } else {
        ""
    }
}

fn still(error: Option<f64>) -> String {
    error.map_or(String::new(), |error| {
        format!(", its error {error} times the tolerance", error = Rounded::<3>(error))
    })
}

fn why(failure: Option<&StepFault>) -> String {
    match failure {
        None | Some(StepFault { fault: None, vertex: None, solve: None }) => {
            "; use a larger `tolerance`, or look for a discontinuity there".into()
        }
        Some(StepFault { solve: Some(SolveError { verdict, .. }), fault, .. }) => {
            format!("; the solve failed: {verdict}{}", place(fault.as_ref()))
        }
        Some(StepFault { fault, vertex, .. }) => format!("; {}", cause(fault.as_ref(), vertex)),
    }
}

fn cause(fault: Option<&Fault>, vertex: &Option<usize>) -> String {
    match (fault, vertex) {
        (Some(fault), _) => fault.to_string(),
        (None, Some(vertex)) => format!("vertex {vertex} has no finite position or velocity"),
        (None, None) => "the force is not finite".into(),
    }
}

fn place(fault: Option<&Fault>) -> String {
    fault.map_or(String::new(), |fault| format!("; {fault}"))
}

/// A stability limit this many times the step says nothing about a failure.
const FAR_ABOVE: f64 = 1e3;

/// Advice for a step that is not finite.
fn advice(fault: Option<&Fault>, step: f64, stable: Option<f64>, parts: &str) -> String {
    let half = 0.5 * step;
    let mut advice = match stable {
        Some(stable) if step > stable => {
            // Three digits may round up: stay below the limit.
            let most = Seconds(0.99 * stable);
            format!("; a step of {} is above the stability limit: use at most {most}", Seconds(step))
        }
        Some(stable) if stable < FAR_ABOVE * step => format!(
            "; the step is below the stability limit of the linearised equations, {}, but large \
             deformation, contact, loads or close masses can require less: try a smaller step, {}",
            Seconds(stable),
            Seconds(half)
        ),
        _ => format!("; try a smaller step, {}{parts}", Seconds(half)),
    };
    if matches!(fault, Some(Fault::Crossing { .. })) && !parts.is_empty() {
        return format!(
            "; Newton's method went around an edge: try a smaller step, {}{parts}",
            Seconds(half)
        );
    }
    if matches!(fault, Some(Fault::Crossing { .. })) {
        return "; the impact is too fast for explicit contact: use an implicit integrator, whose contact \
                stops any speed, or a larger [contact] `stiffness` with a smaller step, or a larger \
                `distance`; [contact] `allow_penetration = true` ignores crossings"
            .into();
    }
    if matches!(fault, Some(Fault::Pair { .. })) {
        return "; give [world] nbody a `softening` length, or use `ias15` with `adaptive` for close \
                encounters of masses that start apart"
            .into();
    }
    if matches!(fault, Some(Fault::Material { .. })) {
        return format!("; {AT_MATERIAL}");
    }
    if matches!(fault, Some(Fault::Sheet { .. })) {
        return "; use a material that withstands more stretch, or smaller loads and motions".into();
    }
    let helps = |fault: &Fault| match fault {
        Fault::Element { j, material_would_help, .. } => *material_would_help && *j <= 0.0,
        _ => false,
    };
    if fault.is_some_and(helps) {
        advice += ", or a material that tolerates inversion, such as stable-neo-hookean";
    }
    advice
}
