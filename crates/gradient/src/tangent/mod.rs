//! Tangents of runs: changes of states due to a change of the initial state, computed alongside the run.
//!
//! Each step is linearised where it was taken. A force evaluation costs one product with the Hessian, an
//! implicit stage one solve with the matrix of its [adjoint](crate::adjoint). With bars of the adjoint
//! and dots of the tangent, `x_bar . x_dot + v_bar . v_dot` is the same before and after every step.

mod forces;
mod one_step;

use pliant::simulation::{Simulation, Snapshot};

use crate::adjoint::{AdjointPlace, Step, has_memory};
use crate::parameter::Parameter;
use crate::parts::check_terms;
use crate::schedule::{RunLength, Schedule};
use crate::sweep::may_forget;
use crate::walls::WalledEnd;
use crate::{GradientError, LossFrame, support};
use forces::TangentForces;
use one_step::{StateTangent, advance};

/// Change of a state of a run, such as the last.
#[derive(Clone, Debug, PartialEq)]
pub struct RunTangent {
    /// Change of the positions, flat `(n, dimension)`, vertices in the order of the scene.
    pub position: Vec<f64>,
    /// Change of the velocities, likewise.
    pub velocity: Vec<f64>,
}

/// Direction in the space of initial states and parameters.
#[derive(Clone, Copy, Debug)]
pub struct RunDirection<'a> {
    /// Change of the initial positions, flat `(n, dimension)`, vertices in the order of the scene.
    pub position: &'a [f64],
    /// Change of the initial velocities, likewise; ignored where fixed.
    pub velocity: &'a [f64],
    /// Change of the numbers of each parameter.
    pub parameters: &'a [Vec<f64>],
}

/// Takes `steps` steps of `simulation` from its present state, and computes the directional derivative
/// (`jvp`) of the last positions and velocities along a change of the initial ones by `position` and
/// `velocity`, flat `(n, dimension)`, vertices in the order of the scene. Fixed vertices change with the
/// positions where they are fixed; their `velocity` is ignored.
///
/// `watch` is called with every state, including the first and the last, and its change. The simulation
/// ends in the last state; methods with memory restart at the first.
///
/// ```
/// use pliant::energy::gravity::UniformGravity;
/// use pliant::integrator::IntegratorSpec;
/// use pliant::{simulation::Simulation, state::State, system::System};
/// use pliant_gradient::tangent;
///
/// let mut system = System::new(2, vec![2.0]);
/// system.add_term(Box::new(UniformGravity::new(&[0.0, -10.0], &[2.0])));
/// let state = State::new(vec![0.0, 5.0], vec![1.0, 0.0]);
/// let mut simulation = Simulation::new(system, state, IntegratorSpec::VelocityVerlet.method(), 0.125);
/// // y = y_0 + v_0 t - g t^2/2 at t = 1.
/// let found = tangent(&mut simulation, 8, (&[0.0, 1.0], &[0.0, 2.0]), &mut |_, _| {})?;
/// assert_eq!((found.position, found.velocity), (vec![0.0, 3.0], vec![0.0, 2.0]));
/// # Ok::<(), pliant_gradient::GradientError>(())
/// ```
///
/// # Errors
/// [`GradientError`], as [`gradient`](crate::gradient()).
///
/// # Panics
/// If the change of the initial state has another length than the state.
pub fn tangent(
    simulation: &mut Simulation,
    steps: u64,
    (position, velocity): (&[f64], &[f64]),
    watch: &mut dyn FnMut(&LossFrame<'_>, &RunTangent),
) -> Result<RunTangent, GradientError> {
    tangent_along(simulation, steps, RunDirection { position, velocity, parameters: &[] }, &mut [], watch)
}

/// Computes the tangent as [`tangent`] does, along a `direction` of the initial state and of `parameters`.
///
/// ```
/// use pliant::energy::gravity::UniformGravity;
/// use pliant::integrator::IntegratorSpec;
/// use pliant::{simulation::Simulation, state::State, system::System};
/// use pliant_gradient::{Gravity, Parameter, RunDirection, tangent_along};
///
/// let mut system = System::new(2, vec![2.0]);
/// system.add_term(Box::new(UniformGravity::new(&[0.0, -10.0], &[2.0])));
/// let state = State::new(vec![0.0, 5.0], vec![1.0, 0.0]);
/// let mut simulation = Simulation::new(system, state, IntegratorSpec::VelocityVerlet.method(), 0.125);
/// let mut parameters: Vec<Box<dyn Parameter>> = vec![Box::new(Gravity::new(2))];
/// let direction = RunDirection { position: &[0.0; 2], velocity: &[0.0; 2], parameters: &[vec![0.0, 1.0]] };
/// // y = y_0 + v_0 t + g t^2/2 at t = 1.
/// let found = tangent_along(&mut simulation, 8, direction, &mut parameters, &mut |_, _| {})?;
/// assert_eq!((found.position, found.velocity), (vec![0.0, 0.5], vec![0.0, 1.0]));
/// # Ok::<(), pliant_gradient::GradientError>(())
/// ```
///
/// # Errors
/// The errors of [`tangent`]; displacements of fixed vertices in each step have no tangent.
///
/// # Panics
/// If the direction has another shape than the state and the parameters.
pub fn tangent_along(
    simulation: &mut Simulation,
    steps: u64,
    direction: RunDirection<'_>,
    parameters: &mut [Box<dyn Parameter>],
    watch: &mut dyn FnMut(&LossFrame<'_>, &RunTangent),
) -> Result<RunTangent, GradientError> {
    // Checks, and the steps of the run.
    support::check(simulation)?;
    if simulation.system().remembers() {
        return Err(GradientError::Unsupported {
            what: "tangents of terms that remember earlier steps".into(),
            remedy: "`gradient` has an adjoint",
        });
    }
    check_terms(simulation.system_mut(), parameters)?;
    let schedule = Schedule::of(simulation, RunLength::Steps(steps))?;
    let RunDirection { position, velocity, parameters: changes } = direction;
    parameters.iter_mut().for_each(|parameter| parameter.begin(steps));
    let counts = parameters.iter().map(|parameter| parameter.len());
    assert!(counts.eq(changes.iter().map(Vec::len)), "one change for each number of each parameter");
    if has_memory(simulation.method().scheme) {
        let (step, time) = (simulation.state().step, simulation.state().time);
        let (x, v) = (simulation.positions().into_owned(), simulation.velocities().into_owned());
        simulation.restore(&Snapshot::new(step, time, x, v))?;
    }
    // Tangent of the initial state.
    let d = simulation.system().dimension();
    let inside = |rows: &[f64]| simulation.numbering().to_internal(rows, d).into_owned();
    let mut dots = StateTangent::new(inside(position), inside(velocity));
    let mut forces = TangentForces::new(d, dots.x.len(), parameters, changes);
    forces.keep_free(simulation.system(), &mut dots.v);
    let start = simulation.state().time;
    forces.start_moving(simulation.system(), start, &dots.x);
    if let Some([x, _]) = forces.held_change(simulation.system(), start, (&dots.x, &dots.v)) {
        dots.x = x;
    }
    refuse_unknown(simulation, &mut forces)?;
    let first = simulation.state().step;
    let mut grown = TangentGrowth { start, size: dots.norm() };
    show(simulation, &schedule, &mut forces, &dots, watch);
    for step in first..first + schedule.steps {
        let state = simulation.state();
        let (time, x, v) = (state.time, state.x().to_vec(), state.v().to_vec());
        if simulation.system().is_stopped() {
            return Err(GradientError::Stopped { step });
        }
        // State before the step, and the step itself.
        let begins = match may_forget(simulation) {
            true => !simulation.snapshot().remembers(),
            false => step == first,
        };
        let walled = match simulation.system().walls() {
            [] => None,
            _ => Some(unwalled(simulation, &schedule)?),
        };
        let held = simulation.system().structure();
        let turned = forces.held_change(simulation.system(), time, (&dots.x, &dots.v));
        schedule.step(simulation)?;
        // Where pins are released, methods with memory restart. Velocities were prescribed until then:
        // those of rotating vertices follow their positions, all others do not change.
        let lets_go = simulation.system().structure() != held;
        if let Some([_, v]) = turned.filter(|_| lets_go) {
            dots.v = v;
            forces.keep_free(simulation.system(), &mut dots.v);
        }
        let begins = begins || lets_go;
        // Tangent of the step.
        let (h, method) = (schedule.step_size(simulation, step), simulation.method());
        let stage_velocities = simulation.stage_velocities().to_vec();
        let (after_x, after_v) = (simulation.state().x().to_vec(), simulation.state().v().to_vec());
        let taken = Step {
            from: AdjointPlace { time, x: &x, v: &v },
            x: walled.as_ref().map_or(&after_x, |walled| &walled.x),
            v: walled.as_ref().map_or(&after_v, |walled| &walled.v),
            stage_velocities: &stage_velocities,
            stage_accelerations: &simulation.stage_accelerations(),
            h,
            growth: schedule.growth(simulation, step),
            is_first: begins,
        };
        forces.step = schedule.whole(step);
        forces.held = support::holds_start(simulation).then(|| [x.clone(), dots.x.clone()]);
        let singular = |_| support::singular(&method, step + 1, time + h);
        let before = dots.norm();
        advance(&method, &mut forces, simulation.system_mut(), &taken, &mut dots).map_err(singular)?;
        if let Some(walled) = &walled {
            // A partly fixed vertex enters the wall's action with its prescribed components.
            if let Some([x, v]) = forces.held_change(simulation.system(), time + h, (&dots.x, &dots.v)) {
                (dots.x, dots.v) = (x, v);
            }
            walled.forth(simulation.system(), &mut dots.x, &mut dots.v);
            forces.keep_free(simulation.system(), &mut dots.v);
        }
        if let Some([x, _]) = forces.held_change(simulation.system(), time + h, (&dots.x, &dots.v)) {
            dots.x = x;
        }
        // Growth, and the state shown.
        if !dots.is_finite() {
            let growth = grown.rate(before, time);
            return Err(GradientError::TangentOverflow { step: step + 1, time: time + h, growth });
        }
        if grown.size == 0.0 {
            grown = TangentGrowth { start: time + h, size: dots.norm() };
        }
        show(simulation, &schedule, &mut forces, &dots, watch);
    }
    if let Some(end) = schedule.end() {
        simulation.restore(end)?;
    }
    Ok(outside(simulation, &mut forces, &dots))
}

/// First state with a nonzero change, the reference of the growth.
struct TangentGrowth {
    /// Time of that state [s].
    start: f64,
    /// Largest change of a component.
    size: f64,
}

impl TangentGrowth {
    /// Growth of the logarithm of changes per second up to `time`, where the largest is `size` [1/s].
    fn rate(&self, size: f64, time: f64) -> f64 {
        let grown = (size / self.size).ln() / (time - self.start);
        if grown.is_finite() { grown } else { 0.0 }
    }
}

/// Refuses parameters without a derivative of forces for tangents.
fn refuse_unknown(simulation: &mut Simulation, forces: &mut TangentForces<'_>) -> Result<(), GradientError> {
    let state = simulation.state();
    let (time, x, v) = (state.time, state.x().to_vec(), state.v().to_vec());
    let still = vec![0.0; x.len()];
    let at = AdjointPlace { time, x: &x, v: &v };
    forces.force(simulation.system_mut(), at, (&still, &still));
    match forces.unknown {
        None => Ok(()),
        Some(number) => Err(GradientError::Unsupported {
            what: format!("tangents by parameter {number} of those given, counted from 0"),
            remedy: "displacements of pins in each step have none; `gradient` has an adjoint",
        }),
    }
}

/// Computes the next step without walls; the simulation stays where it is.
fn unwalled(simulation: &mut Simulation, schedule: &Schedule) -> Result<WalledEnd, GradientError> {
    let start = simulation.snapshot();
    let walled = WalledEnd::of_step(simulation, &start, schedule)?;
    simulation.restore(&start)?;
    Ok(walled)
}

/// Converts the tangent to the order of the scene.
fn outside(simulation: &Simulation, forces: &mut TangentForces<'_>, dots: &StateTangent) -> RunTangent {
    let (numbering, d) = (simulation.numbering(), simulation.system().dimension());
    let rows = |rows: &[f64]| numbering.to_original(rows, d).into_owned();
    // Velocities of rotating vertices follow from their positions, and are not part of the steps.
    let turned = forces.held_change(simulation.system(), simulation.state().time, (&dots.x, &dots.v));
    let (x, v) = turned.as_ref().map_or((&dots.x, &dots.v), |[x, v]| (x, v));
    RunTangent { position: rows(x), velocity: rows(v) }
}

/// Calls `watch` with the state at the end of a step.
fn show(
    simulation: &Simulation,
    schedule: &Schedule,
    forces: &mut TangentForces<'_>,
    dots: &StateTangent,
    watch: &mut dyn FnMut(&LossFrame<'_>, &RunTangent),
) {
    let (x, v) = (simulation.positions(), simulation.velocities());
    let Some(step) = schedule.frame(simulation.state().step) else { return };
    let time = simulation.state().time;
    watch(&LossFrame { step, time, x: &x, v: &v }, &outside(simulation, forces, dots));
}
