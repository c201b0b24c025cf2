//! Forward run and backward sweep.

use pliant::simulation::{Simulation, Snapshot};

use crate::adjoint::{
    Adjoint, AdjointForces, AdjointPlace, HeldStart, Step, Sums, add_scaled, free_only, has_memory, step_back,
};
use crate::checkpoints::split;
use crate::contact_events::{ContactEvents, TouchingPairs};
use crate::loss::{Loss, LossFrame};
use crate::parameter::{HeldUse, Parameter, StateUse};
use crate::schedule::Schedule;
use crate::walls::{self, Touching, WallEvent, WalledEnd};
use crate::{GradientError, RunGradient, support};

/// State before a step, and data of the step for the backward sweep.
struct SweepRecord {
    step: u64,
    time: f64,
    x: Vec<f64>,
    v: Vec<f64>,
    /// Velocities of the stages of the step that begins here.
    stage_velocities: Vec<Vec<f64>>,
    stage_accelerations: Vec<Vec<f64>>,
    /// History variables of terms.
    history: Vec<f64>,
    /// Snapshot with the memory of the method, if it has one and walls may reset it.
    moment: Option<Snapshot>,
}

/// Backward sweep over a run.
pub(crate) struct Sweep<'a> {
    simulation: &'a mut Simulation,
    loss: &'a mut dyn Loss,
    schedule: &'a Schedule,
    sums: Sums<'a>,
    adjoint: Adjoint,
    value: f64,
    /// Step number and time at the beginning of the run, and time at its end.
    first: u64,
    start: f64,
    end: f64,
    /// Number of steps whose states are kept at once, and number of additional states.
    piece: usize,
    slots: usize,
    /// Last state of the run.
    last: Option<Snapshot>,
    /// Largest component of the derivatives by the last state.
    size_at_end: f64,
    /// True if pins are released at some time.
    releases: bool,
    /// Solves whose friction did not settle: before the run, then in it.
    unsettled: u64,
    /// Vertices that touch walls after the step that follows the one propagated next, if there are walls,
    /// and events found so far.
    later: Option<Touching>,
    wall_events: Vec<WallEvent>,
    /// Pairs in contact in the state after the step to be propagated next, if contact is possible.
    touching: Option<TouchingPairs>,
    contact_events: ContactEvents,
}

impl<'a> Sweep<'a> {
    /// Sweep over `simulation` from its present state, within `budget` bytes.
    pub(crate) fn new(
        simulation: &'a mut Simulation,
        loss: &'a mut dyn Loss,
        parameters: &'a mut [Box<dyn Parameter>],
        budget: usize,
        schedule: &'a Schedule,
    ) -> Self {
        let (unknowns, d) = (simulation.state().x().len(), simulation.system().dimension());
        // A snapshot of a method with memory has at most six rows more than the state.
        let moment = if may_forget(simulation) { 6 } else { 0 };
        let releases = simulation.system().constraints().iter().any(|hold| hold.end().is_finite());
        let record = 8 * unknowns * (2 + stages(simulation) + moment);
        let state = 8 * unknowns * 4;
        Sweep {
            sums: Sums::new(d, unknowns, parameters).turning(simulation.system()),
            releases,
            adjoint: Adjoint::zero(unknowns),
            value: 0.0,
            first: simulation.state().step,
            start: simulation.state().time,
            end: simulation.state().time,
            piece: (budget / 2 / record).max(1),
            slots: budget / 2 / state,
            last: None,
            size_at_end: 0.0,
            unsettled: 0,
            later: None,
            wall_events: vec![],
            touching: None,
            contact_events: ContactEvents::default(),
            simulation,
            loss,
            schedule,
        }
    }

    /// Runs forward and back; the simulation ends in the last state.
    pub(crate) fn run(mut self) -> Result<RunGradient, GradientError> {
        if has_memory(self.simulation.method().scheme) {
            let KeptState { step, time, x, v } = KeptState::of(self.simulation);
            let history = self.simulation.system().history();
            self.simulation.restore(&Snapshot::new(step, time, x, v).with_history(history))?;
        }
        self.unsettled = unsettled(self.simulation);
        let from = self.first;
        self.back(from, from + self.schedule.steps, self.slots)?;
        self.sums.place_turning(self.simulation.system(), self.start, &mut self.adjoint.x);
        if let Some(last) = self.schedule.end().or(self.last.as_ref()) {
            self.simulation.restore(last)?;
        }
        let (numbering, d) = (self.simulation.numbering(), self.simulation.system().dimension());
        let growth = self.growth(self.start);
        self.wall_events.sort_unstable();
        Ok(RunGradient {
            value: self.value,
            position: numbering.to_original(&self.adjoint.x, d).into_owned(),
            velocity: numbering.to_original(&self.adjoint.v, d).into_owned(),
            parameters: self.sums.derivatives,
            growth,
            unsettled: self.unsettled,
            wall_events: self.wall_events,
            contact_events: self.contact_events,
        })
    }

    /// Runs forward from step `from`, where the simulation is, to step `to`, and propagates back.
    fn back(&mut self, from: u64, to: u64, slots: usize) -> Result<(), GradientError> {
        let mut to = to;
        if to - from <= self.piece as u64 {
            return self.back_at_once(to);
        }
        let start = self.simulation.snapshot();
        loop {
            let pieces = (to - from).div_ceil(self.piece as u64) as usize;
            if pieces == 1 {
                return self.back_at_once(to);
            }
            // Without slots, all but the last piece is run again.
            let left = if slots == 0 { pieces - 1 } else { split(pieces, slots.min(pieces)) };
            let middle = from + (left * self.piece) as u64;
            self.advance(middle)?;
            self.back(middle, to, slots.saturating_sub(1))?;
            self.simulation.restore(&start)?;
            to = middle;
        }
    }

    /// Takes steps up to step `to`.
    fn advance(&mut self, to: u64) -> Result<(), GradientError> {
        while self.simulation.state().step < to {
            self.look_for_stop(self.simulation.state().step)?;
            self.schedule.step(self.simulation)?;
        }
        Ok(())
    }

    /// Takes steps up to step `to`, keeping all states, and propagates back.
    fn back_at_once(&mut self, to: u64) -> Result<(), GradientError> {
        // Forward run with records.
        let mut records = vec![];
        while self.simulation.state().step < to {
            let mut record = SweepRecord::of(self.simulation);
            self.look_for_stop(record.step)?;
            self.schedule.step(self.simulation)?;
            record.stage_velocities = self.simulation.stage_velocities().to_vec();
            record.stage_accelerations = self.simulation.stage_accelerations();
            records.push(record);
        }
        let end = SweepRecord::of(self.simulation);
        if self.last.is_none() {
            // First arrival at the end of the run.
            self.last = Some(self.simulation.snapshot());
            self.unsettled = unsettled(self.simulation) - self.unsettled;
            self.end = end.time;
            self.add_loss(&end)?;
            self.size_at_end = self.adjoint.norm();
        }
        // The forward run continues from a restored state, and needs no matrix until then.
        let lent = self.simulation.exchange_matrix_structure(None);
        let is_lent = lent.is_some();
        if is_lent {
            self.sums.exchange_structure(self.simulation.system(), lent);
        }
        // Backward sweep.
        let mut after = end;
        while let Some(record) = records.pop() {
            self.look_for_stop(record.step)?;
            self.step_back(&record, &after)?;
            self.add_loss(&record)?;
            after = record;
        }
        if is_lent {
            let lent = self.sums.exchange_structure(self.simulation.system(), None);
            self.simulation.exchange_matrix_structure(lent);
        }
        Ok(())
    }

    fn look_for_stop(&self, step: u64) -> Result<(), GradientError> {
        if self.simulation.system().is_stopped() { Err(GradientError::Stopped { step }) } else { Ok(()) }
    }

    /// Propagates the derivatives over the step from `record` to the state `after` it.
    fn step_back(&mut self, record: &SweepRecord, after: &SweepRecord) -> Result<(), GradientError> {
        let SweepRecord { step, time, .. } = *record;
        let (h, method) = (self.schedule.step_size(self.simulation, step), self.simulation.method());
        // Contact changes, and the step without walls.
        self.note_contacts(record, after);
        let lets_go = self.releases && self.lets_go(record, after);
        let walled = match self.simulation.system().walls() {
            [] => None,
            _ => {
                let start = record.moment.clone().unwrap_or_else(|| record.snapshot(self.simulation));
                Some(WalledEnd::of_step(self.simulation, &start, self.schedule)?)
            }
        };
        // Adjoint of the walls, with their events.
        let (mut x, mut v) = (&after.x, &after.v);
        if let Some(walled) = &walled {
            let Adjoint { x: x_bar, v: v_bar, .. } = &mut self.adjoint;
            let before = self.sums.look_at_held().then(|| [x_bar.clone(), v_bar.clone()]);
            walled.back(self.simulation.system(), x_bar, v_bar);
            if let Some([mut by_x, mut by_v]) = before {
                by_x.iter_mut().zip(&*x_bar).for_each(|(by, bar)| *by = bar - *by);
                by_v.iter_mut().zip(&*v_bar).for_each(|(by, bar)| *by = bar - *by);
                let (system, x, v) = (self.simulation.system(), &walled.x, &walled.v);
                let time = time + h;
                self.sums.add_held(&HeldUse { system, time, x, v, x_bar: &by_x, v_bar: &by_v });
            }
            free_only(self.simulation.system(), v_bar);
            let numbering = self.simulation.numbering();
            let number = |step: u64| self.first + self.schedule.whole(step) + 1;
            if let Some(later) = &self.later {
                let next = number(step + 1);
                self.wall_events.extend(walls::events(numbering, next, &walled.touching, later));
            }
            if step == self.first {
                let before = walls::touching(self.simulation.system(), &record.x);
                self.wall_events.extend(walls::events(numbering, number(step), &before, &walled.touching));
            }
            (x, v) = (&walled.x, &walled.v);
        }
        // Adjoint of the step.
        let taken = Step {
            from: AdjointPlace { time, x: &record.x, v: &record.v },
            x,
            v,
            stage_velocities: &record.stage_velocities,
            stage_accelerations: &record.stage_accelerations,
            h,
            growth: self.schedule.growth(self.simulation, step),
            is_first: lets_go
                || record.moment.as_ref().map_or(step == self.first, |moment| !moment.remembers()),
        };
        self.sums.step = self.schedule.whole(step);
        if !record.history.is_empty() {
            let system = self.simulation.system_mut();
            system.set_history(&record.history, time);
            system.set_time(time + h);
            self.sums.history = system.commit_transposed(x, &self.sums.history, &mut self.adjoint.x);
        }
        let held = support::holds_start(self.simulation).then(|| HeldStart::new(&record.x));
        let system = self.simulation.system_mut();
        let mut forces = AdjointForces { system, sums: &mut self.sums, held, means_from: None };
        let singular = |_| support::singular(&method, step + 1, time + h);
        step_back(&method, &mut forces, &taken, &mut self.adjoint).map_err(singular)?;
        if let Some(HeldStart { x_bar, .. }) = forces.held {
            let (system, still) = (self.simulation.system(), vec![0.0; x_bar.len()]);
            let SweepRecord { x, v, .. } = record;
            self.sums.add_held(&HeldUse { system, time, x, v, x_bar: &x_bar, v_bar: &still });
            add_scaled(&mut self.adjoint.x, 1.0, &x_bar);
        }
        // Preparation of the next step back.
        if !self.adjoint.is_finite() {
            return Err(GradientError::Overflow { step, time, growth: self.growth(time) });
        }
        self.later = walled.map(|walled| walled.touching);
        if lets_go {
            self.hold_again(record);
        }
        Ok(())
    }

    /// Counts the changes of contacts in the step from `record` to the state `after` it.
    fn note_contacts(&mut self, record: &SweepRecord, after: &SweepRecord) {
        let system = self.simulation.system();
        let later = self.touching.take().or_else(|| TouchingPairs::of(system, &after.x, &after.v));
        self.touching = later.as_ref().and_then(|_| TouchingPairs::of(system, &record.x, &record.v));
        if let (Some(before), Some(later)) = (&self.touching, &later) {
            self.contact_events.add(before, later);
        }
    }

    /// True if pins are released at the beginning of the step from `record` to the state `after` it.
    /// Leaves the simulation with the constraints of the latter.
    fn lets_go(&mut self, record: &SweepRecord, after: &SweepRecord) -> bool {
        self.simulation.hold_as_after(record.step, record.time);
        let held = self.simulation.system().structure();
        self.simulation.hold_as_after(after.step, after.time);
        self.simulation.system().structure() != held
    }

    /// Restores the constraints released at `record`, before which positions and velocities were
    /// prescribed.
    fn hold_again(&mut self, record: &SweepRecord) {
        let was_held = |weights: &[f64]| weights.iter().map(|weight| *weight == 0.0).collect::<Vec<_>>();
        let after = was_held(self.simulation.system().inverse_mass());
        let SweepRecord { step, time, x, v, .. } = record;
        self.simulation.hold_as_after(*step, *time);
        let system = self.simulation.system();
        let Adjoint { x: x_bar, v: v_bar, .. } = &mut self.adjoint;
        let (mut by_x, mut by_v) = (vec![0.0; x_bar.len()], vec![0.0; x_bar.len()]);
        for (i, before) in was_held(system.inverse_mass()).into_iter().enumerate() {
            if before && !after[i] {
                (by_x[i], by_v[i]) = (x_bar[i], std::mem::take(&mut v_bar[i]));
            }
        }
        self.sums.add_held(&HeldUse { system, time: *time, x, v, x_bar: &by_x, v_bar: &by_v });
    }

    /// Adds the derivatives of the loss at a state.
    fn add_loss(&mut self, record: &SweepRecord) -> Result<(), GradientError> {
        let SweepRecord { time, x, v, .. } = record;
        let Some(step) = &self.schedule.frame(record.step) else { return Ok(()) };
        let (numbering, d) = (self.simulation.numbering(), self.simulation.system().dimension());
        let (mut x_bar, mut v_bar) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        let (x, v) = (numbering.to_original(x, d), numbering.to_original(v, d));
        let part =
            self.loss.frame(&LossFrame { step: *step, time: *time, x: &x, v: &v }, &mut x_bar, &mut v_bar);
        self.value += part;
        let wrong = |what: String, value| GradientError::Loss { step: *step, time: *time, what, value };
        if !part.is_finite() {
            return Err(wrong("it".into(), part));
        }
        // Most losses depend on few states.
        let is_zero = |rows: &[f64]| rows.iter().fold(true, |zero, bar| zero & (*bar == 0.0));
        if is_zero(&x_bar) && is_zero(&v_bar) {
            self.add_state(*step);
            return Ok(());
        }
        for (name, rows) in [("position", &x_bar), ("velocity", &v_bar)] {
            if let Some(i) = rows.iter().position(|bar| !bar.is_finite()) {
                let what = format!("its derivative by the {name} of vertex {}", i / d);
                return Err(wrong(what, rows[i]));
            }
        }
        let (x_bar, v_bar) = (numbering.to_internal(&x_bar, d), numbering.to_internal(&v_bar, d));
        let (system, SweepRecord { x, v, .. }) = (self.simulation.system(), record);
        let time = record.time;
        self.sums.add_held(&HeldUse { system, time, x, v, x_bar: &x_bar, v_bar: &v_bar });
        let Adjoint { x, v, .. } = &mut self.adjoint;
        x.iter_mut().zip(&*x_bar).for_each(|(sum, bar)| *sum += bar);
        let free = v.iter_mut().zip(&*v_bar).zip(self.simulation.system().inverse_mass());
        free.filter(|(_, weight)| **weight > 0.0).for_each(|((sum, bar), _)| *sum += bar);
        self.add_state(*step);
        Ok(())
    }

    /// Shows parameters the derivatives by the state after these steps.
    fn add_state(&mut self, step: u64) {
        let (system, step) = (self.simulation.system(), step - self.first);
        self.sums.add_state(&StateUse { system, step, x_bar: &self.adjoint.x });
    }

    /// Growth of the logarithm of the derivatives per second between `time` and the end of the run [1/s];
    /// zero if the loss has none at the end.
    fn growth(&self, time: f64) -> f64 {
        let (norm, span) = (self.adjoint.norm().min(f64::MAX), self.end - time);
        let grown = (norm / self.size_at_end).ln() / span;
        if grown.is_finite() { grown } else { 0.0 }
    }
}

/// Time, positions and velocities in the order of the scene.
struct KeptState {
    step: u64,
    time: f64,
    x: Vec<f64>,
    v: Vec<f64>,
}

impl KeptState {
    fn of(simulation: &Simulation) -> Self {
        let state = simulation.state();
        let (x, v) = (simulation.positions().into_owned(), simulation.velocities().into_owned());
        KeptState { step: state.step, time: state.time, x, v }
    }
}

impl SweepRecord {
    /// Record of the present state.
    fn of(simulation: &Simulation) -> Self {
        let state = simulation.state();
        SweepRecord {
            step: state.step,
            time: state.time,
            x: state.x().to_vec(),
            v: state.v().to_vec(),
            stage_velocities: vec![],
            stage_accelerations: vec![],
            history: simulation.system().history(),
            moment: may_forget(simulation).then(|| simulation.snapshot()),
        }
    }

    /// Snapshot of the record, in the order of the scene.
    fn snapshot(&self, simulation: &Simulation) -> Snapshot {
        let (numbering, d) = (simulation.numbering(), simulation.system().dimension());
        let outside = |rows: &[f64]| numbering.to_original(rows, d).into_owned();
        let snapshot = Snapshot::new(self.step, self.time, outside(&self.x), outside(&self.v));
        snapshot.with_history(self.history.clone())
    }
}

/// True if the method has a memory, which walls reset.
pub(crate) fn may_forget(simulation: &Simulation) -> bool {
    has_memory(simulation.method().scheme) && !simulation.system().walls().is_empty()
}

/// Number of solves so far after which friction still changed.
fn unsettled(simulation: &Simulation) -> u64 {
    simulation.work().solver.map_or(0, |solver| solver.unsettled)
}

/// Number of stages of a step whose velocities or accelerations are kept.
fn stages(simulation: &Simulation) -> usize {
    use pliant::integrator::{Scheme, gauss_radau::NODES};
    match simulation.method().scheme {
        Scheme::RungeKutta(tableau) | Scheme::Dirk(tableau) => tableau.b.len(),
        Scheme::Collocation(tableau) => tableau.b.len(),
        Scheme::GaussRadau(_) => NODES.len(),
        _ => 0,
    }
}
