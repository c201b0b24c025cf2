//! Records of steps: energy balance, jumps of prescribed motion, worst contacts, wall impulses.
//!
//! No step depends on them. A simulation calls [`StepRecords::begin_step`] and [`StepRecords::end_step`].

use super::ContactExtremes;
use crate::constraint::Jump;
use crate::diagnostics::EnergyLedger;
use crate::integrator::{Integrator, Method};
use crate::state::State;
use crate::system::{ForceId, System, WallImpulses};

/// Report of discontinuous prescribed motion, which no physical body performs.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MotionJumps {
    /// First pin that jumped, `body/pin`.
    pub pin: String,
    /// Time of its jump [s].
    pub time: f64,
    /// Largest displacement component of that jump [m].
    pub size: f64,
    /// Number of jumps of all pins.
    pub count: u64,
}

/// Records of steps.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct StepRecords {
    /// Energy ledger; `None` if no energy enters or leaves. Part of snapshots.
    #[serde(skip)]
    pub(super) ledger: Option<EnergyLedger>,
    /// True if the next step opens a ledger, if one is needed.
    pub(super) opens_ledger: bool,
    /// True if the ledger counts losses.
    pub(super) counts_losses: bool,
    /// Jumps of prescribed motion.
    pub(super) motion_jumps: Option<MotionJumps>,
    /// Worst contacts so far.
    #[serde(default)]
    pub(super) contact_extremes: ContactExtremes,
    /// Wall impulses of the last step to the current state.
    #[serde(default)]
    pub(super) wall_impulses: Option<WallImpulses>,
    /// Velocities that dissipative terms saw in the last static increment, or backward Euler step with
    /// prescribed motion [m/s]. The velocities of the state are zero, or those of the motion at its end.
    #[serde(default)]
    pub(super) increment_velocities: Option<Vec<f64>>,
    /// Time up to which jumps have been recorded [s].
    pub(super) jumps_seen_until: f64,
}

impl Default for StepRecords {
    fn default() -> Self {
        StepRecords {
            ledger: None,
            opens_ledger: true,
            counts_losses: true,
            motion_jumps: None,
            contact_extremes: ContactExtremes::default(),
            wall_impulses: None,
            increment_velocities: None,
            jumps_seen_until: 0.0,
        }
    }
}

impl StepRecords {
    /// Opens the ledger before the first step from a state; records a release of pins.
    pub(super) fn begin_step(&mut self, system: &mut System, state: &State, method: Method, released: bool) {
        if self.opens_ledger {
            self.opens_ledger = false;
            let counted = (self.counts_losses, method.is_backward_euler());
            let ledger = EnergyLedger::new(system, counted, state.x(), state.v());
            let time = system.load_factor().unwrap_or(state.time);
            self.ledger = match method.is_static() {
                true => ledger.map(|ledger| ledger.between_equilibria(system, time, state.x())),
                false => ledger,
            };
        } else if let (true, Some(ledger)) = (released, &mut self.ledger) {
            ledger.release(system, state.x(), state.v());
        }
    }

    /// Records contacts, wall impulses and energy flows of the step of `h` [s] from the time `from` [s] to
    /// `state`. Terms with history take it over.
    pub(super) fn end_step(
        &mut self,
        system: &mut System,
        state: &mut State,
        (method, integrator): (Method, &dyn Integrator),
        [from, h]: [f64; 2],
    ) {
        self.note_contacts(system, state);
        if !system.walls().is_empty() && !method.is_static() {
            let last = system.books_mut().wall_impulses();
            self.wall_impulses.get_or_insert_default().clone_from(last);
        }
        if method.is_static() || method.is_backward_euler() && system.rubs_by_way() {
            self.increment_velocities = integrator.stage_velocities().first().cloned();
        }
        if let Some(ledger) = &mut self.ledger {
            system.set_time(state.time);
            if method.is_static() {
                let time = system.load_factor().unwrap_or(state.time);
                ledger.advance_to_equilibrium(system, h, time, state.x(), state.v());
            } else {
                ledger.advance(system, h, state.x(), state.v());
            }
        }
        if !method.is_static() && system.has_prescribed_motion() {
            self.note_jumps(system, state, [from, h]);
        }
        if system.remembers() {
            self.commit_history(system, state);
        }
    }

    /// Ends a step of terms with history. Discards the force, so that it is evaluated again as after a
    /// snapshot.
    fn commit_history(&mut self, system: &mut System, state: &mut State) {
        let lost = system.commit(state.x(), state.time);
        state.force = ForceId::NONE;
        if let Some(ledger) = &mut self.ledger {
            ledger.commit(lost, system, state.x(), state.v());
        }
    }

    /// Records the jumps of prescribed motion in the step of `h` [s] from the time `from` [s].
    fn note_jumps(&mut self, system: &mut System, state: &State, [from, h]: [f64; 2]) {
        // The end time and the time that integrators prescribe (start plus step) may differ by rounding.
        let seen = Some(self.jumps_seen_until).filter(|until| (until - from).abs() <= 1e-9 * h);
        self.jumps_seen_until = from + h;
        for jump in system.pins().jumps(seen.unwrap_or(from), from + h) {
            if let Some(ledger) = &mut self.ledger {
                ledger.jump(system, &jump.coordinates, state.x(), state.force);
            }
            let Jump { time, size, hold, .. } = jump;
            self.motion_jumps.get_or_insert(MotionJumps { pin: hold, time, size, count: 0 }).count += 1;
        }
    }

    /// Records the contacts at the end of a step.
    fn note_contacts(&mut self, system: &mut System, state: &State) {
        if system.is_watched() {
            let worst = system.contact_extremes(state.x(), state.v(), state.time);
            self.contact_extremes.merge(worst);
            return;
        }
        for touching in system.terms().iter().filter_map(|term| term.touching()) {
            let least = touching.nearest(state.x(), state.time);
            self.contact_extremes.merge(ContactExtremes { least, ..ContactExtremes::default() });
        }
    }

    /// Continues with this ledger. Without one, or if it lacks losses that are requested, the next step
    /// opens a new one.
    pub(super) fn set_ledger(&mut self, ledger: Option<EnergyLedger>, system: &mut System) {
        self.ledger = ledger.filter(|ledger| ledger.holds_losses() == self.counts_losses);
        self.opens_ledger = self.ledger.is_none();
        system.books_mut().count_walls(self.ledger.as_ref().is_some_and(EnergyLedger::counts_walls));
    }

    /// Forgets what belongs to the last step: the state is another one.
    pub(super) fn forget_last_step(&mut self) {
        self.wall_impulses = None;
        self.increment_velocities = None;
    }
}
