//! Closing lines of a run.

use std::time::Duration;

use pliant::available_memory;
use pliant::energy::{Approach, Penetration};
use pliant::integrator::amplification;
use pliant::quantity::Seconds;
use pliant::run::{Outcome, Summary};
use pliant::simulation::{MotionJumps, RetriedSteps, StaticState};
use pliant::solver::SolverWork;
use pliant_record::{LogLevel, Recorded, RecordedOutcome, RecordedStatus};
use pliant_scene::assembly::{ContactSummary, Report, advice_on_gain};
use pliant_scene::{Channel, Scene};
use serde_json::{Value, json};

use super::statics;
use crate::failure::ExitStatus;
use crate::statistics::{Meeting, Statistics};
use crate::text::{self, counted, entry, number};

/// A scene should have its energy back at the end this well, but for what is known to have come in and gone
/// out, relative to the energy that it turns over.
const ENERGY_DRIFT_BOUND: f64 = 1e-3;
/// And should never be farther off on the way.
const ENERGY_ERROR_BOUND: f64 = 1e-2;
/// A gain below this part of the largest error beside it is not what the error is.
const MINOR_GAIN: f64 = 0.1;
/// Contact is overloaded where less than this part of its distance is left.
const OVERLOAD: f64 = 0.05;
/// The part that would be left with the stiffness that is advised.
const COMFORT: f64 = 0.5;
/// Part of its volume below which an element has all but collapsed: foams are pressed to a tenth.
const COLLAPSED: f64 = 0.05;

/// Pressure of the contact barrier at the part `s` of its distance, in parts of its stiffness: `-2 s B'(s^2)`
/// with `B(q) = -(q - 1)^2 ln q`.
fn relative_pressure(s: f64) -> f64 {
    let q = s * s;
    -2.0 * s * (1.0 - q) * (2.0 * q.ln() - 1.0 / q + 1.0)
}

/// How a run ended, and what is known of it.
pub(crate) struct Closing<'a> {
    scene: &'a Scene,
    report: &'a Report,
    summary: &'a Summary,
    statistics: &'a Statistics,
    statics: Option<&'a StaticState>,
    wall: Duration,
}

impl<'a> Closing<'a> {
    /// `statics` is the equilibrium at the end of a static run, `wall` the time that the steps and the
    /// recording took.
    pub(crate) fn new(
        scene: &'a Scene,
        report: &'a Report,
        summary: &'a Summary,
        statistics: &'a Statistics,
        statics: Option<&'a StaticState>,
        wall: Duration,
    ) -> Closing<'a> {
        Closing { scene, report, summary, statistics, statics, wall }
    }

    /// How the run ended.
    pub(crate) fn status(&self) -> ExitStatus {
        match self.summary.outcome {
            Outcome::Done => ExitStatus::Done,
            Outcome::Interrupted => ExitStatus::Interrupted,
            _ => ExitStatus::Failed,
        }
    }

    /// Warnings that the user should see even without reading the numbers. Of a run that failed they are
    /// those of the scene: causes, of which numbers at its end are effects.
    pub(crate) fn warnings(&self) -> Vec<String> {
        if self.status() == ExitStatus::Failed {
            return self.report.warnings.clone();
        }
        let found = [
            self.inverted().or_else(|| self.collapsed()),
            self.loose(),
            self.jumped(),
            self.unsettled(),
            self.overloaded(),
            self.entered(),
            self.slipped(),
            self.met(),
            self.energy_off().or_else(|| self.energy_gained()),
        ];
        self.report.warnings.iter().cloned().chain(found.into_iter().flatten()).collect()
    }

    /// Elements that are inverted at the end, or have collapsed.
    fn inverted(&self) -> Option<String> {
        let (j, inverted) = (self.summary.end.min_j?, self.summary.end.inverted.filter(|n| *n > 0)?);
        let all: usize = self.report.bodies.iter().map(|body| body.elements).sum();
        Some(format!(
            "{inverted} of {} inverted at the end or without volume (smallest J {}): the shape there is not \
             physical; use a finer mesh, smaller loads or increments, or a material whose energy grows \
             without bound as J goes to 0, such as neo-hookean",
            counted(all as u64, "element is", "elements are"),
            number(j),
        ))
    }

    /// Elements that have little of their volume left at the end.
    fn collapsed(&self) -> Option<String> {
        let j = self.summary.end.min_j.filter(|j| (0.0..COLLAPSED).contains(j))?;
        Some(format!(
            "an element has {} of its volume left at the end (smallest J {}): material models are not valid \
             that far, and the shape there is hardly physical; check what compresses it",
            share(j),
            number(j),
        ))
    }

    /// Implicit steps whose solves the scene's own tolerance ended before they settled.
    fn loose(&self) -> Option<String> {
        let loose = self.summary.work.solver?.loose.filter(|n| *n > 0)?;
        let tolerance = self.scene.time.solver.as_ref()?.tolerance?;
        let extent = self.report.size.iter().map(|length| length * length).sum::<f64>().sqrt();
        Some(format!(
            "{} ended with Newton updates above a tenth of the motion of the step: a `tolerance` of {} m is \
             too large; use {} m or less, or remove it",
            counted(loose, "solve", "solves"),
            number(tolerance),
            number(1e-6 * if extent > 0.0 { extent } else { tolerance }),
        ))
    }

    /// Solves that ended before friction had settled.
    fn unsettled(&self) -> Option<String> {
        let unsettled = self.summary.work.solver?.unsettled;
        (unsettled > 0).then(|| {
            format!(
                "{} ended while friction still changed with the contact forces: use a smaller step, or more \
                 `friction_iterations`",
                counted(unsettled, "solve", "solves"),
            )
        })
    }

    /// Surfaces that were pressed together until little of the gap between them was left.
    fn overloaded(&self) -> Option<String> {
        let least = self.summary.contact.least.as_ref().filter(|least| least.relative < OVERLOAD)?;
        // Explicit steps have a law without a pole.
        if !self.report.is_implicit {
            return None;
        }
        let pairs = &self.report.contact.as_ref()?.pairs;
        let [a, b] = &least.bodies;
        let is_theirs = |[one, other]: &[String; 2]| (one, other) == (a, b) || (one, other) == (b, a);
        let law = pairs.iter().find(|pair| is_theirs(&pair.bodies))?;
        let enough = law.stiffness * relative_pressure(least.relative) / relative_pressure(COMFORT);
        Some(format!(
            "contact of `{a}` and `{b}` was compressed to {} of the activation distance at t = {} s, where \
             solves converge slowly; a [contact] `stiffness` of {} Pa would keep half of the distance",
            share(least.relative),
            number(least.time),
            number(enough),
        ))
    }

    /// Surfaces that entered each other, or came so fast that they could have.
    fn entered(&self) -> Option<String> {
        let contact = &self.summary.contact;
        let advice = "use an implicit integrator, whose contact stops any speed, or a larger [contact] \
                      `stiffness` with a smaller step, or a larger `distance`";
        if let Some(Penetration { bodies: [a, b], depth, time }) = &contact.deepest {
            return Some(format!(
                "`{a}` and `{b}` interpenetrate by {} m at t = {} s: {advice}",
                number(*depth),
                number(*time),
            ));
        }
        let Approach { bodies: [a, b], speed, stopped, time } =
            contact.hardest.as_ref().filter(|hardest| hardest.speed > hardest.stopped)?;
        Some(format!(
            "`{a}` and `{b}` approached each other at {} m/s at t = {} s, but explicit contact stops {} m/s \
             there: they may have interpenetrated; {advice}",
            number(*speed),
            number(*time),
            number(*stopped),
        ))
    }

    /// Friction whose threshold, given by the scene, was stiffer than explicit steps bear.
    fn slipped(&self) -> Option<String> {
        let contact = self.report.contact.as_ref()?;
        let explicit = contact.explicit.as_ref().filter(|explicit| !explicit.raises_threshold)?;
        let (threshold, borne) = (contact.threshold_speed?, explicit.step? * self.summary.contact.friction);
        (threshold < borne).then(|| {
            format!(
                "`threshold_speed`, {} m/s, was too small for this step size, which needs {} m/s at the \
                 largest contact force: sticking contacts may have oscillated; remove it, and it is raised \
                 where necessary",
                number(threshold),
                number(borne),
            )
        })
    }

    /// Bodies that came together while nothing makes them collide.
    fn met(&self) -> Option<String> {
        let Meeting { bodies, time } = self.statistics.meeting()?;
        let [a, b] = bodies.map(|body| &self.report.bodies[body].name);
        Some(format!(
            "the bounding boxes of `{a}` and `{b}` meet from t = {} s on, and nothing makes bodies \
             collide: add `contact = {{}}` to the scene",
            number(*time),
        ))
    }

    /// Prescribed motion that jumped.
    fn jumped(&self) -> Option<String> {
        let MotionJumps { pin, time, size, count } = self.summary.motion_jumps.as_ref()?;
        let more = match count - 1 {
            0 => String::new(),
            more => format!(", the first of {} jumps", more + 1),
        };
        Some(format!(
            "the motion of pin `{pin}` jumps by {} m at t = {} s{more}: one step moves it there, and the \
             work of prescribed motion then depends on the step size; use smoothstep(from, to, t) for a \
             continuous motion",
            number(*size),
            number(*time),
        ))
    }

    /// Energy that has grown although nothing brought it in: no loss is an excuse for that, known or not.
    fn energy_gained(&self) -> Option<String> {
        let gain = self.summary.relative_energy_gain().filter(|gain| *gain > ENERGY_ERROR_BOUND)?;
        Some(format!(
            "the total energy grew by up to {} without external work; {} would be more accurate{}",
            self.in_play(gain),
            self.finer(),
            self.gains_in_impacts() + self.misses_blows(),
        ))
    }

    /// Continuation of a sentence on energy that has grown: of work that the books may not have seen.
    fn misses_blows(&self) -> &'static str {
        let is_moved = self.summary.end.balance.is_some_and(|balance| balance.motion.is_some());
        match is_moved && self.scene.contact.is_some() {
            true => {
                "; the work of prescribed motion is computed from its power at the ends of steps, which \
                 misses impacts shorter than a step"
            }
            false => "",
        }
    }

    /// Continuation of a sentence on energy that has grown: of schemes that do so in impacts.
    fn gains_in_impacts(&self) -> String {
        let scheme = self.scene.time.integrator.method().documentation.name;
        let advice = self.report.contact.as_ref().and_then(|_| advice_on_gain(scheme));
        advice.map_or(String::new(), |advice| format!("; {advice}"))
    }

    /// Energy that is not what it was, where all losses are known.
    fn energy_off(&self) -> Option<String> {
        // What a scene brings in and takes away is known, but for losses that were not asked for.
        let known = !self.takes_energy() || self.loses_known();
        let (error, drift) = (self.summary.relative_energy_error()?, self.summary.relative_energy_drift()?);
        // The energy of a symplectic scheme oscillates and comes back; what is lost for good is held to a
        // closer bound.
        if !known || drift <= ENERGY_DRIFT_BOUND && error <= ENERGY_ERROR_BOUND {
            return None;
        }
        let method = self.scene.time.integrator.method();
        // Many implicit schemes take energy out of motion by design, and more of it the larger the step.
        let damps = method.documentation.solves > 0
            && amplification(&method, 1.0, 0.0, 0.0).spectral_radius() < 1.0 - 1e-9;
        // Work of prescribed motion is known as well as a step is small beside its forces.
        let gained = self.summary.relative_energy_gain() > Some(ENERGY_DRIFT_BOUND.max(MINOR_GAIN * error));
        if damps && !gained && self.summary.end.conserved() < self.summary.start.conserved() {
            return Some(format!(
                "numerical damping: {} removed up to {}, {}; {} removes less{}",
                method.documentation.name,
                self.in_play(error),
                match self.takes_energy() {
                    true => "in addition to physical dissipation",
                    false => "although nothing in the scene dissipates energy",
                },
                self.finer(),
                // Contact does not hold with the midpoint rule, and schemes that take less may give energy in
                // impacts.
                match self.report.contact.is_some() {
                    true => "",
                    false => ", implicit-midpoint almost nothing",
                },
            ));
        }
        Some(format!(
            "the total energy was off by up to {}, and by {} at the end, although nothing in the scene {}; \
             {} would be more accurate{}",
            self.in_play(error),
            share(drift),
            match self.summary.end.balance {
                Some(_) => "accounts for it",
                None => "adds or removes energy",
            },
            self.finer(),
            if gained { self.gains_in_impacts() + self.misses_blows() } else { String::new() },
        ))
    }

    /// Advice for more accurate steps.
    fn finer(&self) -> String {
        match &self.report.step_control {
            Some(_) if self.scene.time.integrator.method().has_own_criterion() => {
                "a smaller `epsilon`".to_owned()
            }
            Some(control) => format!("a smaller `tolerance` than {:e}", control.tolerances.relative),
            None => format!("a smaller step than {}", Seconds(self.report.step)),
        }
    }

    /// One line on an end that is not the planned one; `None` if it is. `file` is what was recorded to.
    pub(crate) fn trouble(&self, file: Option<&str>) -> Option<String> {
        let Summary { outcome, frames, last_frame_time, .. } = self.summary;
        let kept = |what: &str| match file {
            Some(file) => format!("{file} is complete up to t = {} s{what}", number(*last_frame_time)),
            None => format!("nothing was recorded; the run reached t = {} s", number(*last_frame_time)),
        };
        match outcome {
            Outcome::Done => None,
            Outcome::Interrupted => {
                Some(format!("interrupted after {frames} of {} frames; {}", self.report.frames, kept("")))
            }
            Outcome::Failed(error) => Some(format!("{error}\n{}", kept(", the last good frame"))),
            Outcome::ObserverFailed(error) => Some(error.to_string()),
        }
    }

    /// Messages for `/log` of the file.
    pub(crate) fn messages(&self) -> Vec<(LogLevel, String)> {
        let mut messages: Vec<_> =
            self.warnings().into_iter().map(|warning| (LogLevel::Warning, warning)).collect();
        if let Outcome::Failed(error) = &self.summary.outcome {
            messages.push((LogLevel::Error, error.to_string()));
        }
        messages
    }

    /// How the run ended, as the file shall remember it.
    pub(crate) fn recorded_outcome(&self) -> RecordedOutcome {
        let (status, message) = match &self.summary.outcome {
            Outcome::Done => (RecordedStatus::Completed, String::new()),
            Outcome::Interrupted => (
                RecordedStatus::Interrupted,
                format!("interrupted after {} of {} frames", self.summary.frames, self.report.frames),
            ),
            Outcome::Failed(error) => (RecordedStatus::Failed, error.to_string()),
            Outcome::ObserverFailed(error) => (RecordedStatus::Failed, error.to_string()),
        };
        RecordedOutcome {
            status,
            step: Some(self.summary.work.steps),
            time: self.summary.last_frame_time,
            message,
        }
    }

    /// The numbers, for people.
    pub(crate) fn numbers(&self, width: usize) -> String {
        let Summary { frames, work, end, .. } = self.summary;
        let word = if self.status() == ExitStatus::Done { "done" } else { "ended early" };
        let mut out = format!(
            "{word}: {}, {} in {} ({} steps/s)\n",
            counted(*frames, "frame", "frames"),
            counted(work.steps, "step", "steps"),
            text::duration(self.wall),
            text::count(self.steps_per_second().round() as u64),
        );
        let mut line = |name: &str, fact: String| out += &entry(name, &fact, 2, 10, width);
        line("energy", self.energy());
        if !self.summary.is_static {
            let change = number(self.summary.momentum_change());
            line("momentum", format!("changed by {change} kg m/s{}", self.forces_from_outside()));
        }
        for (name, fact) in self.statics.into_iter().flat_map(statics::facts) {
            line(name, fact);
        }
        for reaction in &self.summary.reactions {
            let vector = |v: &[f64; 3]| v.map(number).join(", ");
            let (force, moment) = (vector(&reaction.force), vector(&reaction.moment));
            line("reaction", format!("{}: {force} N; moment {moment} N m at the end", reaction.name));
        }
        // What loads have done is what they brought in and what their potential lost.
        let brought = end.balance.and_then(|balance| balance.loads);
        let potential = end.loads.map(|now| self.summary.start.loads.unwrap_or(0.0) - now);
        let by_loads = potential.map(|lost| lost + brought.unwrap_or(0.0));
        let balance = end.balance.unwrap_or_default();
        let by_gravity =
            balance.gravity.map(|fed| fed + self.summary.start.gravitational - end.gravitational);
        let parts = |word: &str, parts: &[(Option<f64>, &str)]| {
            let said = |(energy, name): &(Option<f64>, &str)| {
                energy.map(|energy| format!("{} J {word} {name}", number(energy)))
            };
            parts.iter().filter_map(said).collect::<Vec<_>>().join(", ")
        };
        let work =
            [(balance.motion, "prescribed motion"), (by_loads, "loads"), (by_gravity, "changing gravity")];
        let losses = [
            (balance.ether_drag, "ether drag"),
            (balance.damping, "damping"),
            (balance.friction, "friction"),
            (balance.walls, "walls"),
        ];
        for (name, said) in [("work", parts("by", &work)), ("losses", parts("to", &losses))] {
            if !said.is_empty() {
                line(name, said);
            }
        }
        if let Some(path) = &self.summary.path {
            for (name, fact) in statics::path(path) {
                line(name, fact);
            }
        }
        if let Some(increments) = &self.summary.work.increments {
            line("increment", statics::increments(increments));
        } else if let Some(rejected) = self.summary.work.rejected_steps {
            let evaluations =
                counted(self.summary.work.force_evaluations, "force evaluation", "force evaluations");
            let rejected = counted(rejected, "step", "steps");
            line("error", format!("{rejected} rejected because the error was too large; {evaluations}"));
        }
        if let Some(RetriedSteps { steps, parts, halvings }) = self.summary.work.retried {
            let said = match steps {
                0 => "no step was subdivided".to_owned(),
                _ => format!(
                    "{} subdivided into {}, the smallest 1/{} of a step",
                    counted(steps, "step", "steps"),
                    counted(parts, "part", "parts"),
                    2_u64.pow(halvings),
                ),
            };
            line("retries", said);
        }
        if let Some(solver) = &self.summary.work.solver {
            line("solver", solver_work(solver));
        }
        if let Some(least) = &self.summary.contact.least {
            let [a, b] = &least.bodies;
            let part = share(least.relative);
            // Walls of a scene without `[contact]` begin to push at their planes.
            let place = match (least.gap < 0.0, least.relative < 0.0) {
                (true, true) => format!("{a} came {} m behind {b}", number(-least.gap)),
                (true, false) => format!(
                    "{a} came {} m behind {b}, with {part} of the contact distance left,",
                    number(-least.gap)
                ),
                (false, _) => {
                    format!("smallest gap {} m ({part} of `distance`) between {a} and {b}", number(least.gap))
                }
            };
            let most = counted(least.most, "pair", "pairs");
            let limited = self.summary.work.solver.map_or(0, |solver| solver.longest_limited);
            let limited = match limited {
                0 => String::new(),
                n => {
                    let iterations = counted(n, "Newton iteration", "Newton iterations");
                    format!("; contact shortened up to {iterations} in a row")
                }
            };
            line(
                "contact",
                format!("{place} at t = {} s; up to {most} at a time{limited}", number(least.time)),
            );
        }
        if let Some(law) = self.report.contact.as_ref().and_then(ContactSummary::law) {
            line("law", law);
        }
        if let Some(Penetration { bodies: [a, b], depth, time }) = &self.summary.contact.deepest {
            let depth = number(*depth);
            line("overlap", format!("{a} and {b}, {depth} m deep at t = {} s", number(*time)));
        }
        if let Some(Approach { bodies: [a, b], speed, stopped, time }) = &self.summary.contact.hardest {
            let limit = if speed > stopped { "above" } else { "near" };
            line(
                "approach",
                format!(
                    "{} m/s between {a} and {b} at t = {} s: {limit} the limit of explicit contact, {} m/s",
                    number(*speed),
                    number(*time),
                    number(*stopped)
                ),
            );
        }
        if let Some(j) = end.min_j {
            let smallest = self.statistics.min_j.map_or(j, |smallest| smallest.min(j));
            let inverted = self.statistics.most_inverted.max(end.inverted).unwrap_or(0);
            let inverted = match inverted {
                0 => "no element inverted".to_owned(),
                n => format!(
                    "up to {} inverted at a time, {} at the end",
                    counted(n, "element", "elements"),
                    end.inverted.unwrap_or(0)
                ),
            };
            line("min J", format!("{}, {inverted}", number(smallest)));
        }
        out
    }

    /// Everything, for programs.
    pub(crate) fn document(&self, scene: &str, recorded: Option<&Recorded>) -> Value {
        let path = recorded.map(|recorded| recorded.path.display().to_string());
        let (file, moves) = (path.as_deref(), !self.summary.is_static);
        let Summary {
            frames, work, start, end, largest_energy_change, energy_scale, last_frame_time, ..
        } = self.summary;
        let problems: Vec<Value> = self
            .trouble(file)
            .map(|message| json!({ "kind": self.kind(), "message": message }))
            .into_iter()
            .collect();
        json!({
            "status": self.status(),
            "scene": scene,
            "file": file,
            "bytes": recorded.map(|recorded| recorded.bytes),
            "summary": {
                "time": last_frame_time,
                "duration": self.scene.time.duration,
                "frames": frames,
                "planned_frames": self.report.frames,
                "steps": work.steps,
                "planned_steps": self.report.steps,
                "rejected_steps": work.rejected_steps,
                "increments": work.increments,
                "path": self.summary.path.as_ref().map(statics::path_document),
                "retried": work.retried,
                "force_evaluations": work.force_evaluations,
                "solver": work.solver,
                "predicted_memory_bytes": self.report.bytes,
                "peak_memory_bytes": available_memory::peak(),
                "wall_seconds": self.wall.as_secs_f64(),
                "steps_per_second": self.steps_per_second(),
                "relative_energy_drift": self.summary.relative_energy_drift(),
                "relative_energy_error": self.summary.relative_energy_error(),
                "relative_energy_gain": self.summary.relative_energy_gain(),
                "largest_energy_change": moves.then_some(largest_energy_change),
                "energy_scale": moves.then_some(energy_scale),
                "momentum_change": moves.then(|| self.summary.momentum_change()),
                "statics": self.statics,
                "motion_jumps": self.summary.motion_jumps,
                "reactions": self.summary.reactions,
                "min_j": self.statistics.min_j.or(end.min_j),
                "least_gap": self.summary.contact.least,
                "deepest_contact": self.summary.contact.deepest,
                "hardest_approach": self.summary.contact.hardest,
                "most_inverted": self.statistics.most_inverted.or(end.inverted),
                "start": start,
                "end": end,
            },
            "warnings": self.warnings(),
            "problems": problems,
        })
    }

    /// Energy at the end, and its fault.
    fn energy(&self) -> String {
        let (total, scale) = (self.summary.end.total, self.summary.energy_scale);
        if !(total.is_finite() && scale.is_finite()) {
            return "more than 1.797e308 J, the largest number: its drift is unknown".to_owned();
        }
        format!("{} J at the end{}", number(total), self.energy_errors())
    }

    /// Fault of the energy at the end; nothing in statics, where none has to be kept.
    fn energy_errors(&self) -> String {
        let (drift, error) = (self.summary.relative_energy_drift(), self.summary.relative_energy_error());
        let (Some(drift), Some(error)) = (drift, error) else { return String::new() };
        let unaccounted = self.unaccounted();
        let scale = number(self.summary.energy_scale);
        format!(
            "; drift {}, largest error {}, relative to {scale} J{unaccounted}",
            share(drift),
            share(error)
        )
    }

    /// A part of the energy scale, in words.
    fn in_play(&self, ratio: f64) -> String {
        let scale = self.summary.energy_scale;
        match (ratio * scale).is_finite() {
            true => format!("{} of {} J", share(ratio), number(scale)),
            false => "an amount that is not finite".to_owned(),
        }
    }

    /// Parts that the drift of the energy is without, or holds beside the errors of the scheme.
    fn unaccounted(&self) -> &'static str {
        // Without a step nothing was taken.
        let takes = self.takes_energy() && !self.loses_known() && self.summary.work.steps > 0;
        match takes {
            true => ", including dissipation (no `energy` among the channels)",
            false => "",
        }
    }

    /// True if anything in the scene takes energy away.
    fn takes_energy(&self) -> bool {
        let world = &self.scene.world;
        let dashpots = self.scene.attachment.iter().any(|attachment| attachment.dashpot.is_some());
        let damped = dashpots || self.scene.body.iter().any(|body| body.damping.is_some());
        damped || self.rubs() || self.report.walls > 0 || world.ether_drag.unwrap_or(0.0) != 0.0
    }

    /// True if any contact has friction.
    fn rubs(&self) -> bool {
        self.report.contact.as_ref().is_some_and(|contact| contact.threshold_speed.is_some())
    }

    /// True if it is known how much, in this run as in any other of the scene: those that show frames to
    /// more than a file may know more.
    fn loses_known(&self) -> bool {
        if !self.scene.output.channels.contains(&Channel::Energy) {
            return false;
        }
        self.summary.end.balance.is_some_and(|balance| balance.counts_losses())
    }

    /// Kind of failure, in a word, for programs.
    fn kind(&self) -> &'static str {
        use pliant::simulation::StepError;
        match &self.summary.outcome {
            Outcome::Failed(StepError::NotFinite { .. }) => "not_finite",
            Outcome::Failed(StepError::Unstable { .. }) => "unstable",
            Outcome::Failed(StepError::Unsolved { .. }) => "unsolved",
            Outcome::Failed(StepError::StepTooSmall { .. }) => "step_too_small",
            Outcome::ObserverFailed(_) => "recording",
            Outcome::Interrupted => "interrupted",
            _ => "failed",
        }
    }

    fn steps_per_second(&self) -> f64 {
        self.summary.work.steps as f64 / self.wall.as_secs_f64().max(1e-9)
    }

    /// Why momentum is not conserved, if it is not meant to be.
    fn forces_from_outside(&self) -> String {
        let world = &self.scene.world;
        // The other kinds of damping leave momentum alone.
        let damps_motion = self
            .scene
            .body
            .iter()
            .filter_map(|body| body.damping.as_ref())
            .any(|damping| damping.mass_proportional.is_some());
        let causes: Vec<&str> = [
            (world.gravity.iter().flatten().any(|g| !g.is_zero()), "gravity"),
            (self.report.bodies.iter().any(|body| body.pinned > 0), "pins"),
            (self.scene.body.iter().any(|body| !body.load.is_empty()), "loads"),
            (!world.walls.is_empty(), "walls"),
            (world.ether_drag.unwrap_or(0.0) != 0.0, "drag"),
            (damps_motion, "damping"),
        ]
        .into_iter()
        .filter_map(|(present, name)| present.then_some(name))
        .collect();
        if causes.is_empty() { String::new() } else { format!(" ({})", causes.join(", ")) }
    }
}

/// Work of the solvers of implicit steps.
fn solver_work(work: &SolverWork) -> String {
    let mut facts = vec![counted(work.newton_iterations, "Newton iteration", "Newton iterations")];
    let counts = [
        (work.factorizations, "factorisation", "factorisations"),
        (work.cg_iterations, "conjugate gradient iteration", "conjugate gradient iterations"),
    ];
    facts.extend(counts.into_iter().filter(|(n, ..)| *n > 0).map(|(n, one, many)| counted(n, one, many)));
    if work.fallbacks > 0 {
        let solves = counted(work.fallbacks, "solve", "solves");
        let to = if work.factorizations > 0 { "a factorisation" } else { "multigrid" };
        facts.push(format!("{solves} by conjugate gradients took too many iterations and fell back to {to}"));
    }
    facts.join(", ")
}

/// A part of a whole: `1.2e-5`, or in per cent where that is more telling.
fn share(ratio: f64) -> String {
    match ratio {
        // Of energies beyond all numbers, and of their differences.
        r if !r.is_finite() => "not finite".to_owned(),
        0.0 => "0".to_owned(),
        r if r < 1e-3 => format!("{r:.1e}"),
        r if r < 10.0 => text::percent(r),
        r => format!("{} times", number(r)),
    }
}

/// Where the file is, and what opens it.
pub(crate) fn how_to_open(recorded: &Recorded) -> String {
    let path = recorded.path.display().to_string();
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+@%:,".contains(c);
    let shell =
        if path.chars().all(plain) { path.clone() } else { format!("'{}'", path.replace('\'', r"'\''")) };
    format!(
        "\n{path} ({}) opens in\n  \
         your browser          pliant view {shell}\n  \
         Foxglove, Lichtblick  open the file, import the layout docs/foxglove-layout.json\n  \
         Rerun                 rerun {shell}\n  \
         Python                mcap.reader.make_reader(open({path:?}, \"rb\"))\n",
        text::bytes(recorded.bytes)
    )
}
