//! Simulation: a system, its state and an integrator, advanced step by step.

mod adaptive;
mod change;
mod checkpoint;
mod drives;
mod error;
mod forces;
mod grab;
mod material;
mod matrices;
mod path;
mod records;
mod retry;
mod snapshot;
mod statics;
mod stresses;
mod work;

pub use crate::deadline::Stopped;
pub use change::AdoptError;
pub use checkpoint::Checkpoint;
pub use drives::MoveError;
pub use error::{Retried, StepError, UnsolvedStatics};
pub use forces::{AppliedForces, NoForceError};
pub use grab::{GrabError, Grip};
pub use material::MaterialError;
pub use matrices::{MatrixError, SparseMatrix};
pub use path::{ArcLength, LimitPoint, PathState};
pub use records::MotionJumps;
pub use retry::RetriedSteps;
pub use snapshot::{Snapshot, SnapshotError};
pub use statics::{Extreme, StaticState};
pub use work::Work;

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::control::Controller;
use crate::diagnostics::{
    Balance, ContactTraction, Diagnostics, ElementState, Energy, Reaction, ReactionInputs, StabilityLimit,
    mode_range, reactions, stability_limit,
};
use crate::element::Barycentric;
pub use crate::energy::ContactExtremes;
use crate::energy::{ContactShare, ElementTerm, Fault, SurfaceContact};
use crate::integrator::estimate::Tolerances;
use crate::integrator::{Integrator, Method, Scheme};
use crate::numbering::Numbering;
use crate::solver::{ForceLeft, SolveError, SolveFailure, SolverOptions, SolverWork, StepFault, scene_size};
use crate::state::State;
use crate::system::{System, TermId};
use records::StepRecords;

/// Advances a state in time, `(x_n, v_n) -> (x_{n+1}, v_{n+1})`: the public interface of a simulation in
/// Rust and in Python (lecture 3).
pub struct Simulation {
    system: System,
    state: State,
    numbering: Numbering,
    method: Method,
    integrator: Box<dyn Integrator>,
    solver: SolverOptions,
    step_size: f64,
    /// Size of the step that led to the current state [s]; zero before the first.
    last_step_size: f64,
    /// Subdivided steps.
    retried: RetriedSteps,
    /// Substeps of the last step: sizes and end times [s]; empty if it was not subdivided.
    last_parts: Vec<[f64; 2]>,
    /// True if a solved step was undone during the last step.
    took_back: bool,
    /// Solver work before solvers were last reset.
    earlier_solver_work: SolverWork,
    /// Steps attempted since then.
    attempts: u64,
    /// Step size controller, if steps are adaptive; `step_size` is then the next size to try.
    controller: Option<Box<Controller>>,
    /// Path of equilibria in arc-length continuation; `None` if time leads.
    path: Option<Box<path::PathFollower>>,
    /// Records of steps.
    records: StepRecords,
    /// Element points for which states are requested.
    points: Vec<(usize, Barycentric)>,
    /// Recovery of stresses at nodes, if frames have them.
    recovery: Option<Box<stresses::FrameRecovery>>,
    /// Stability limit at the start, once requested.
    stability: Option<StabilityLimit>,
    /// Term of [`Simulation::set_external_forces`].
    external_forces: Option<TermId>,
    /// Terms of [`Simulation::grab`].
    grab: Option<grab::GrabTerms>,
}

impl Simulation {
    /// Creates a simulation of `system` from `state` by `method` with steps of `step_size` [s].
    ///
    /// Constrained coordinates lose their velocity, or start their prescribed motion.
    ///
    /// # Panics
    /// If `state` does not have `n * dimension` coordinates.
    pub fn new(system: System, mut state: State, method: Method, step_size: f64) -> Self {
        let d = system.dimension();
        assert_eq!(state.x().len(), system.mass().len() * d, "one row of coordinates per vertex");
        for (v, w) in state.v_mut().iter_mut().zip(system.inverse_mass()) {
            if *w == 0.0 {
                *v = 0.0;
            }
        }
        if system.has_prescribed_motion() {
            let time = state.time;
            let (x, v) = state.rows_mut();
            // The first step evaluates the force here and reports errors.
            system.prescribe(time, x, v);
        }
        // Tolerances are those of the start, wherever the simulation goes or returns to.
        let solver = SolverOptions { size: Some(scene_size(state.x(), d)), ..SolverOptions::default() };
        let integrator = method.build(state.x().len(), solver);
        Simulation {
            system,
            state,
            numbering: Numbering::identity(),
            method,
            integrator,
            solver,
            step_size,
            last_step_size: 0.0,
            retried: RetriedSteps::default(),
            last_parts: vec![],
            took_back: false,
            earlier_solver_work: SolverWork::default(),
            attempts: 0,
            controller: None,
            path: None,
            records: StepRecords::default(),
            points: vec![],
            recovery: None,
            stability: None,
            external_forces: None,
            grab: None,
        }
    }

    /// Sets the options for solving implicit steps; explicit integrators ignore them.
    ///
    /// ```
    /// use pliant::integrator::IntegratorSpec;
    /// use pliant::solver::{LinearSolver, SolverOptions};
    /// use pliant::{energy::spring::Springs, simulation::Simulation, state::State, system::System};
    ///
    /// let mut system = System::new(2, vec![1.0; 2]);
    /// system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[100.0], &[1.0], 2)));
    /// system.pin(&[0]);
    /// let still = State::new(vec![0.0, 0.0, 0.0, -1.0], vec![0.0; 4]);
    ///
    /// let mut simulation = Simulation::new(system, still, IntegratorSpec::ImplicitMidpoint.method(), 1e-2);
    /// let (tolerance, linear) = (Some(1e-9), LinearSolver::Cholesky);
    /// simulation.set_solver(SolverOptions { tolerance, linear, ..SolverOptions::default() });
    /// simulation.step()?;
    /// # Ok::<(), pliant::simulation::StepError>(())
    /// ```
    pub fn set_solver(&mut self, options: SolverOptions) {
        // Static increments have no error tolerance.
        let by_error = self.controller.as_ref().filter(|_| !self.method.is_static());
        let allowed = by_error.map(|controller| {
            let Tolerances { position, velocity, .. } = controller.control.tolerances;
            [position, velocity]
        });
        self.solver = SolverOptions {
            step_error: allowed.or(options.step_error),
            size: options.size.or(self.solver.size),
            ..options
        };
        self.integrator = self.method.build(self.state.x().len(), self.solver);
    }

    /// Sets the integrator for further steps; multistep methods start without history.
    pub fn set_method(&mut self, method: Method) {
        self.method = method;
        self.integrator = method.build(self.state.x().len(), self.solver);
        self.records.increment_velocities = None;
    }

    /// Describes the linear solver of an implicit integrator and the reason for its choice.
    pub fn linear_solver(&self) -> String {
        if matches!(self.method.scheme, Scheme::Collocation(_)) {
            return "sparse LU of all stages together, which are not symmetric".into();
        }
        self.solver.linear.explain(&self.system)
    }

    /// Takes one step.
    ///
    /// A state is valid if its force is finite, so that a step includes the force at its end. Nothing is
    /// computed twice: the next step starts with this force.
    ///
    /// Pins that end are released at the start of the step nearest to their end, or at the start of the
    /// next step if step sizes are adaptive.
    ///
    /// A step that an implicit integrator cannot solve is subdivided if the [solver's
    /// options](SolverOptions::retries) allow it. Solvers are reset every 64 steps or 256 Newton
    /// iterations, whichever comes first, and drop what they kept from earlier steps: a
    /// [checkpoint](Self::checkpoint) there changes nothing.
    ///
    /// # Errors
    /// [`StepError::NotFinite`], [`StepError::Unsolved`]; the state is then unchanged.
    pub fn step(&mut self) -> Result<(), StepError> {
        if self.controller.is_some() {
            return self.step_towards(f64::INFINITY);
        }
        self.forget_in_time();
        if let Some(path) = self.path.take() {
            return self.step_along_path(path);
        }
        let h = self.step_size;
        let released = self.system.change_pins(|pins| pins.release(self.state.time + 0.5 * h));
        self.ensure_force(self.state.time)?;
        self.open_ledger(released);
        // A product, not a sum: rounding does not accumulate.
        let end = (self.state.step + 1) as f64 * h;
        self.took_back = false;
        let taken = match self.method.documentation.solves {
            0 => self.single_step(h, end).map_err(|fault| (fault, None)),
            _ => self.step_in_parts(h, end),
        };
        taken.map_err(|(fault, retried)| self.not_finite(fault, retried))?;
        self.state.step += 1;
        self.last_step_size = h;
        Ok(())
    }

    /// Returns the jumps of prescribed motion so far; `None` without any.
    pub fn motion_jumps(&self) -> Option<&MotionJumps> {
        self.records.motion_jumps.as_ref()
    }

    /// Resets [`motion_jumps`](Self::motion_jumps) and [`contact_extremes`](Self::contact_extremes).
    pub(crate) fn forget_what_was_noted(&mut self) {
        self.records.motion_jumps = None;
        self.records.contact_extremes = ContactExtremes::default();
    }

    /// Returns the worst contacts at the ends of the steps so far.
    pub fn contact_extremes(&self) -> &ContactExtremes {
        &self.records.contact_extremes
    }

    /// Opens the energy balance before the first step from the current state; records a release of pins.
    fn open_ledger(&mut self, released: bool) {
        self.records.begin_step(&mut self.system, &self.state, self.method, released);
    }

    /// Records the step of `h` [s] from the time `from` [s], which led to the current state.
    fn note_step(&mut self, from: f64, h: f64) {
        let Simulation { records, system, state, method, integrator, .. } = self;
        records.end_step(system, state, (*method, &**integrator), [from, h]);
    }

    /// Closes the energy balance; the next step starts a new one.
    fn close_ledger(&mut self) {
        self.records.set_ledger(None, &mut self.system);
    }

    /// Evaluates the force at the current positions for `time` [s], unless it is known.
    fn ensure_force(&mut self, time: f64) -> Result<(), StepError> {
        if self.state.ensure_force(&mut self.system, time) {
            return Ok(());
        }
        Err(self.not_finite_here())
    }

    /// Returns the error for a state without a finite force or energy.
    pub(crate) fn not_finite_here(&self) -> StepError {
        self.not_finite(StepFault::at(&self.system, self.state.x(), self.state.v()), None)
    }

    /// Converts vertex numbers of a fault to scene order.
    fn located(&self, StepFault { fault, vertex, solve }: StepFault) -> StepFault {
        let original = |i: usize| self.numbering.original(i as u32) as usize;
        let fault = fault.map(|fault| match fault {
            Fault::Pair { first, second } => Fault::Pair { first: original(first), second: original(second) },
            other => other,
        });
        let left = |left: ForceLeft| ForceLeft { vertex: original(left.vertex), ..left };
        let solve = solve.map(|solve| SolveError { left: solve.left.map(left), ..solve });
        StepFault { fault, vertex: vertex.map(original), solve }
    }

    fn not_finite(&self, fault: StepFault, retried: Option<Box<Retried>>) -> StepError {
        let StepFault { fault, vertex, solve } = self.located(fault);
        let fault = fault.map(Box::new);
        // Without a finite force at the start, the solver is not to blame.
        if let Some(solve) = solve.filter(|solve| solve.verdict != SolveFailure::Infeasible) {
            return StepError::Unsolved {
                step: self.state.step + 1,
                time: self.state.time,
                verdict: solve.verdict,
                iterations: solve.iterations,
                correction: solve.correction,
                fault,
                step_size: self.step_size,
                retried,
                statics: self
                    .method
                    .is_static()
                    .then(|| Box::new(UnsolvedStatics { left: solve.left, load_factor: self.load_factor() })),
            };
        }
        StepError::NotFinite {
            step: self.state.step + 1,
            time: self.state.time,
            fault,
            vertex,
            step_size: self.step_size,
            stable_step: self.stable_step(),
            retried,
            is_implicit: self.method.documentation.solves > 0,
        }
    }

    /// Returns the largest stable step at the start [s], if known.
    pub(crate) fn stable_step(&self) -> Option<f64> {
        self.stability.map(|s| s.step)
    }

    /// Applies the map `(x_n, v_n) -> (x_{n+1}, v_{n+1})` (lecture 3): takes one step from the given
    /// state, in place, vertices in scene order. Time and step count advance.
    ///
    /// ```
    /// use pliant::integrator::IntegratorSpec;
    /// use pliant::{energy::gravity::UniformGravity, simulation::Simulation, state::State, system::System};
    ///
    /// let mut system = System::new(2, vec![1.0]);
    /// system.add_term(Box::new(UniformGravity::new(&[0.0, -10.0], &[1.0])));
    /// let start = State::new(vec![0.0; 2], vec![0.0; 2]);
    /// let mut simulation = Simulation::new(system, start, IntegratorSpec::VelocityVerlet.method(), 0.5);
    /// let (mut x, mut v) = ([0.0, 8.0], [1.0, 0.0]);
    /// simulation.advance(&mut x, &mut v)?;
    /// assert_eq!((x, v), ([0.5, 6.75], [1.0, -5.0]));
    /// # Ok::<(), pliant::simulation::StepError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    ///
    /// # Panics
    /// If an array does not have the length of the state's.
    pub fn advance(&mut self, x: &mut [f64], v: &mut [f64]) -> Result<(), StepError> {
        let d = self.system.dimension();
        let from = self.numbering.to_internal(x, d);
        // At the end of the last step the force is known.
        if self.state.x() != &from[..] {
            self.state_mut().x_mut().copy_from_slice(&from);
        }
        let from = self.numbering.to_internal(v, d);
        if self.state.v() != &from[..] {
            self.state_mut().v_mut().copy_from_slice(&from);
        }
        self.step()?;
        x.copy_from_slice(&self.positions());
        v.copy_from_slice(&self.velocities());
        Ok(())
    }

    /// Returns the state, vertices in the order of the [`numbering`](Self::numbering).
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Returns the state for modification, vertices in the order of the [`numbering`](Self::numbering).
    /// Closes the energy balance; the next step starts a new one.
    pub fn state_mut(&mut self) -> &mut State {
        self.close_ledger();
        self.records.forget_last_step();
        &mut self.state
    }

    /// Returns the vertex numbering: the identity, unless scene order would make steps slow.
    pub fn numbering(&self) -> &Numbering {
        &self.numbering
    }

    /// Sets the mapping between scene vertices and those of this system and state.
    pub fn set_numbering(&mut self, numbering: Numbering) {
        self.numbering = numbering;
    }

    /// Returns the positions, flat `(n, dimension)`, vertices in scene order [m].
    pub fn positions(&self) -> Cow<'_, [f64]> {
        self.numbering.to_original(self.state.x(), self.system.dimension())
    }

    /// Returns the velocities, flat `(n, dimension)`, vertices in scene order [m/s].
    pub fn velocities(&self) -> Cow<'_, [f64]> {
        self.numbering.to_original(self.state.v(), self.system.dimension())
    }

    /// Returns the equations of motion.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Returns the equations of motion for evaluation.
    pub fn system_mut(&mut self) -> &mut System {
        &mut self.system
    }

    /// Returns the integration method.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Returns the stage velocities of the last step, flat [m/s], vertices in the order of the
    /// [`numbering`](Self::numbering); see [`Integrator::stage_velocities`].
    pub fn stage_velocities(&self) -> &[Vec<f64>] {
        self.integrator.stage_velocities()
    }

    /// Returns the stage accelerations of the last step, in the same order [m/s^2]; see
    /// [`Integrator::stage_accelerations`].
    pub fn stage_accelerations(&self) -> Vec<Vec<f64>> {
        self.integrator.stage_accelerations()
    }

    /// Returns the step size [s]; the next size to try if steps are adaptive.
    pub fn step_size(&self) -> f64 {
        self.step_size
    }

    /// Measures energies, momenta and the worst element of the current state. Statics has no inertia.
    pub fn diagnostics(&mut self) -> Diagnostics {
        let diagnostics = match self.method.is_static() {
            true => Diagnostics::measure_at_rest(&mut self.system, &self.state),
            false => Diagnostics::measure_state(&mut self.system, &self.state),
        };
        Diagnostics { balance: self.balance(), ..diagnostics }
    }

    /// Measures the energy and its balance alone; nearly free if the last step knew that it was [to be
    /// measured](Self::set_to_be_measured).
    pub(crate) fn energy(&mut self) -> Energy {
        let State { time, force, .. } = self.state;
        self.system.set_time(time);
        let potential = self.system.potential_with_force(|_| true, self.state.x(), force);
        let is_static = self.method.is_static();
        let kinetic = if is_static { 0.0 } else { self.system.kinetic(self.state.v()) };
        let total = kinetic + potential;
        Energy { total, balance: self.balance() }
    }

    fn balance(&mut self) -> Option<Balance> {
        let (system, state) = (&mut self.system, &self.state);
        self.records.ledger.as_ref().map(|ledger| ledger.balance(system, state.x()))
    }

    /// Sets whether [`diagnostics`](Self::diagnostics) include losses to drag, damping and walls
    /// (default: true); a change starts a new energy balance. The cost is a pass over the velocities per
    /// step with drag, one more evaluation of the damping per step with damping, and a copy of the state
    /// per step in which a wall moves a vertex.
    pub fn count_losses(&mut self, counts_losses: bool) {
        if counts_losses != self.records.counts_losses {
            self.records.counts_losses = counts_losses;
            self.close_ledger();
        }
    }

    /// Sets whether [`diagnostics`](Self::diagnostics) follow the next step: parts shared with the force
    /// are then computed once.
    pub(crate) fn set_to_be_measured(&mut self, to_be_measured: bool) {
        self.system.books_mut().set_to_be_measured(to_be_measured);
    }

    /// Returns the current reaction forces of pins and the mean wall forces over the last step, each in
    /// scene order; empty if the force is not finite.
    ///
    /// ```
    /// use pliant::integrator::IntegratorSpec;
    /// use pliant::{constraint::Wall, energy::gravity::UniformGravity};
    /// use pliant::{simulation::Simulation, state::State, system::System};
    ///
    /// // 3 kg on a floor: it carries 30 N.
    /// let mut system = System::new(2, vec![3.0]);
    /// system.add_term(Box::new(UniformGravity::new(&[0.0, -10.0], &[3.0])));
    /// system.add_wall(Wall::new(&[0.0, 1.0], 0.0));
    /// let still = State::new(vec![0.0; 2], vec![0.0; 2]);
    /// let mut simulation = Simulation::new(system, still, IntegratorSpec::SymplecticEuler.method(), 1e-2);
    /// simulation.step()?;
    /// assert!((simulation.reactions()[0].force[1] - 30.0).abs() < 1e-12);
    /// # Ok::<(), pliant::simulation::StepError>(())
    /// ```
    pub fn reactions(&mut self) -> Vec<Reaction> {
        let time = self.state.time;
        let none = self.system.constraints().is_empty() && self.system.walls().is_empty();
        if none || self.ensure_force(time).is_err() {
            return vec![];
        }
        let (x, v) = (self.state.x(), self.state.v());
        let inputs = ReactionInputs {
            time,
            h: self.step_size,
            x,
            v,
            seen: self.records.increment_velocities.as_deref().unwrap_or(v),
            has_inertia: !self.method.is_static(),
            last_step: self.records.wall_impulses.as_ref(),
        };
        reactions(&mut self.system, inputs)
    }

    /// Returns the surfaces currently in contact, in a fixed order; empty without contact.
    pub fn contacts(&self) -> Vec<SurfaceContact> {
        let terms = self.system.terms().iter().filter_map(|term| term.touching());
        let v = self.records.increment_velocities.as_deref().unwrap_or(self.state.v());
        terms.flat_map(|term| term.contacts(self.state.x(), v)).collect()
    }

    /// Returns the pressure and the friction of contact at every vertex, in the order of the scene; NaN at a
    /// vertex of no surface in contact's model. Empty without contact.
    pub fn contact_tractions(&self) -> Vec<ContactTraction> {
        let mut terms = self.system.terms().iter().filter_map(|term| term.touching()).peekable();
        if terms.peek().is_none() {
            return vec![];
        }
        let (x, d) = (self.state.x(), self.system.dimension());
        let v = self.records.increment_velocities.as_deref().unwrap_or(self.state.v());
        let mut shares = vec![ContactShare::default(); x.len() / d];
        terms.for_each(|term| term.add_shares(x, v, &mut shares));
        let internal = (0..shares.len() as u32).map(|vertex| self.numbering.internal(vertex));
        internal.map(|vertex| ContactTraction::of(&shares[vertex as usize])).collect()
    }

    /// Returns the largest component of the residual force at a free coordinate at the current velocities
    /// [N]; `None` if the force is not finite.
    pub(crate) fn residual(&mut self) -> Option<f64> {
        self.ensure_force(self.state.time).ok()?;
        let d = self.system.dimension();
        let system = &mut self.system;
        let v = self.records.increment_velocities.as_deref().unwrap_or(self.state.v());
        system.evaluate_dissipation(self.state.x(), v);
        let mut acceleration = vec![0.0; self.state.x().len()];
        system.accelerations(&mut acceleration);
        let forces = acceleration.iter().enumerate().map(|(i, a)| system.mass()[i / d] * a.abs());
        Some(forces.fold(0.0, f64::max))
    }

    /// Returns the names of the active pins, `body/pin`.
    pub fn pin_names(&self) -> Vec<String> {
        self.system.constraints().iter().map(|hold| hold.name().to_owned()).collect()
    }

    /// Returns the names of the [`reactions`](Self::reactions): active pins and walls.
    pub fn reaction_names(&self) -> Vec<String> {
        let walls = (0..self.system.walls().len()).map(|i| format!("wall{i}"));
        self.pin_names().into_iter().chain(walls).collect()
    }

    /// Returns the current deformation and stress of all elements: body after body, each in mesh order.
    pub fn element_states(&self) -> Vec<ElementState> {
        let terms = || self.system.terms().iter().filter_map(|term| term.elements());
        let mut states = Vec::with_capacity(terms().map(ElementTerm::element_count).sum());
        terms().for_each(|elements| states.extend(elements.element_states(self.state.x())));
        states
    }

    /// Sets the points of [`point_states`](Self::point_states), each by the number of its element in
    /// [`element_states`](Self::element_states).
    pub fn set_points(&mut self, points: Vec<(usize, Barycentric)>) {
        self.points = points;
    }

    /// Returns the current deformation and stress at the points set, in their order.
    pub fn point_states(&self) -> Vec<ElementState> {
        let state = |(element, at): &(usize, Barycentric)| {
            let mut element = *element;
            self.system.terms().iter().filter_map(|term| term.elements()).find_map(|term| {
                let count = term.element_count();
                if element < count {
                    return term.state_at(self.state.x(), element, at);
                }
                element -= count;
                None
            })
        };
        self.points.iter().filter_map(state).collect()
    }

    /// Estimates how much energy the potentials can convert from the current state on [J].
    pub fn potential_scale(&mut self) -> f64 {
        self.system.potential_scale(self.state.x())
    }

    /// Returns the work counts so far.
    pub fn work(&self) -> Work {
        let solver = (self.method.documentation.solves > 0).then(|| self.solver_work());
        Work {
            steps: self.state.step,
            force_evaluations: self.system.force_evaluations(),
            retried: (self.solver.retries > 0 || self.retried.steps > 0)
                .then_some(self.retried)
                .filter(|_| solver.is_some()),
            rejected_steps: self.controller.as_ref().map(|controller| controller.rejected),
            increments: self.controller.as_ref().and_then(|controller| controller.increments()),
            solver,
        }
    }

    /// Solver work so far.
    fn solver_work(&self) -> SolverWork {
        self.earlier_solver_work.plus(self.present_solver_work())
    }

    /// Solver work since the last reset.
    fn present_solver_work(&self) -> SolverWork {
        let along = self.path.as_ref().map_or(SolverWork::none(&self.solver), |path| path.work());
        self.integrator.work().plus(along)
    }

    /// Returns the largest stable step of the integrator for the system linearised at the current state.
    /// `duration` [s] only matters to methods that gain energy at any step. At the start, the result is
    /// stored for error messages.
    ///
    /// ```
    /// use pliant::integrator::IntegratorSpec;
    /// use pliant::{energy::spring::Springs, simulation::Simulation, state::State, system::System};
    ///
    /// // 1 kg on a spring of 100 N/m, hung up at the origin: 10 rad/s.
    /// let mut system = System::new(2, vec![1.0; 2]);
    /// system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[100.0], &[1.0], 2)));
    /// system.pin(&[0]);
    /// let still = State::new(vec![0.0, 0.0, 0.0, -1.0], vec![0.0; 4]);
    ///
    /// let mut simulation = Simulation::new(system, still, IntegratorSpec::SymplecticEuler.method(), 1e-3);
    /// // `h omega` up to 2.
    /// let limit = simulation.stability_limit(1.0)?;
    /// assert!((limit.frequency - 10.0).abs() < 1e-6 && (limit.step - 0.2).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`Stopped`] if the flag of [`set_stop`](Self::set_stop) is set.
    pub fn stability_limit(&mut self, duration: f64) -> Result<StabilityLimit, Stopped> {
        // Vertices released later oscillate freely and raise the highest frequency.
        let (x, v) = (self.state.x(), self.state.v());
        let modes = self.system.with_final_constraints(|system| mode_range(system, x, v));
        if self.system.is_stopped() {
            return Err(Stopped);
        }
        let limit = stability_limit(&self.method, &modes, self.system.ether_drag(), duration);
        if self.state.step == 0 {
            self.stability = Some(limit);
        }
        Ok(limit)
    }

    /// Sets a flag that ends steps, solves and searches for modes and the stability limit; the state is
    /// then that before the step. Each iteration checks it. `None` removes the flag.
    pub fn set_stop(&mut self, stop: Option<Arc<AtomicBool>>) {
        self.system.set_stop(stop);
    }

    /// Estimates the memory that implicit integrators take for their solves, in bytes: matrix, factor or
    /// multigrid levels, Newton's vectors. The factor is analysed, not computed. Explicit integrators take
    /// none.
    pub fn solver_bytes(&mut self) -> usize {
        self.integrator.solver_bytes(&mut self.system, self.state.x())
    }
}
