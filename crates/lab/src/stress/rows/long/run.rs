//! Runs of long scenes with checks after every step.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::stress::rows::contact::OVERLOAD;
use crate::stress::scenes::{self, assemble};
use crate::stress::{CaseResult, CaseVerdict};
use pliant_scene::assembly::Assembly;

/// Energy from nowhere may be so large, as a part of what prescribed motion turned over: its work is
/// integrated over steps at whose ends its rate is known. And as a part of the energy in play, which solves
/// leave.
const GAINS: [f64; 2] = [1e-2, 1e-7];

/// A long case under way.
pub(super) struct LongRun<'a> {
    stop: &'a Arc<AtomicBool>,
    result: CaseResult,
}

/// One of its scenes.
pub(super) struct LongScene {
    /// Name in remarks.
    name: String,
    assembly: Assembly,
    /// Steps that it is to take.
    planned: u64,
    energy: EnergyRange,
    /// Rounding of its energy [J].
    rounding: f64,
}

/// Energies of a scene on its way [J].
#[derive(Clone, Copy, Default)]
struct EnergyRange {
    /// Total less what came in; friction is not added, for what is lost makes up for no gain.
    least: f64,
    /// Largest growth above the least before it, and when [s].
    gain: [f64; 2],
    /// Most that was brought in.
    turnover: f64,
    /// Most that was in play.
    in_play: f64,
}

impl LongScene {
    /// Positions, flat [m].
    pub(super) fn x(&self) -> Vec<f64> {
        self.assembly.simulation.positions().into_owned()
    }

    /// Takes note of bodies whose Young's moduli times volumes have the sum `stiffness` [J]. Energies of
    /// elements are differences of numbers of this size: gains up to its rounding are none.
    pub(super) fn expect_rounding(&mut self, stiffness: f64) {
        self.rounding = f64::EPSILON * stiffness;
    }

    /// Coordinates of a body, flat [m].
    pub(super) fn of_body(&self, name: &str) -> Vec<f64> {
        let Some(body) = self.assembly.topology.bodies.iter().find(|body| body.name == name) else {
            panic!("{}: there is no body {name}", self.name)
        };
        let d = self.assembly.topology.dimension;
        self.x()[d * body.vertices.start as usize..d * body.vertices.end as usize].to_vec()
    }

    /// Mean of the vertices of a body [m].
    pub(super) fn centre(&self, name: &str) -> Vec<f64> {
        let d = self.assembly.topology.dimension;
        let x = self.of_body(name);
        let count = (x.len() / d) as f64;
        (0..d).map(|k| x.iter().skip(k).step_by(d).sum::<f64>() / count).collect()
    }

    /// Lowest and highest vertex of a body [m].
    pub(super) fn heights(&self, name: &str) -> [f64; 2] {
        let d = self.assembly.topology.dimension;
        let x = self.of_body(name);
        let heights = x.iter().skip(d - 1).step_by(d);
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(*z), high.max(*z)])
    }

    /// Tetrahedra of a body, by their corners [m].
    pub(super) fn tetrahedra(&self, name: &str) -> Vec<[[f64; 3]; 4]> {
        let x = self.x();
        let at = |v: u32| [0, 1, 2].map(|k| x[3 * v as usize + k]);
        let bodies = self.assembly.topology.bodies.iter().filter(|body| body.name == name);
        bodies.flat_map(|body| &body.tetrahedra).map(|t| t.map(at)).collect()
    }

    /// Energy stored in elements [J].
    pub(super) fn elastic(&mut self) -> f64 {
        self.assembly.simulation.diagnostics().elastic
    }

    /// Contacts at present.
    pub(super) fn contact_count(&self) -> usize {
        self.assembly.simulation.contacts().len()
    }

    fn look_at_energy(&mut self) {
        let now = self.assembly.simulation.diagnostics();
        let brought = now.balance.map_or(0.0, |balance| balance.net() + balance.lost());
        let energy = now.total - brought;
        let range = &mut self.energy;
        range.turnover = range.turnover.max(brought.abs());
        range.in_play = range.in_play.max(now.kinetic + now.elastic + now.contact.unwrap_or(0.0));
        // Beside NaN, for which a gain is infinite.
        let grown = if energy.is_finite() { energy - range.least } else { f64::INFINITY };
        if grown > range.gain[0] {
            range.gain = [grown, self.assembly.simulation.state().time];
        }
        range.least = range.least.min(energy);
    }
}

impl<'a> LongRun<'a> {
    /// Ends once `stop` is set, within a step too.
    pub(super) fn new(stop: &'a Arc<AtomicBool>) -> Self {
        let result = CaseResult { iterations: Some(0), steps: Some(0), ..CaseResult::default() };
        LongRun { stop, result }
    }

    /// A scene of the case, which is to take so many steps.
    pub(super) fn begin(&mut self, name: impl Into<String>, text: &str, planned: u64) -> LongScene {
        let mut assembly = assemble(text);
        assembly.simulation.system_mut().set_stop(Some(Arc::clone(self.stop)));
        let energy = EnergyRange { least: f64::INFINITY, ..EnergyRange::default() };
        let mut scene = LongScene { name: name.into(), assembly, planned, energy, rounding: 0.0 };
        scene.look_at_energy();
        scene.energy.gain = [0.0, 0.0];
        scene
    }

    /// Takes steps of a scene; `None` where they ended before: at the first that is not as it must be, or
    /// where the time is over.
    pub(super) fn take(&mut self, scene: &mut LongScene, steps: u64) -> Option<()> {
        for _ in 0..steps {
            if let Err(ended) = self.take_one(scene) {
                if let Some(found) = ended {
                    self.result.note(CaseVerdict::Fail, format!("{}: {found}", scene.name));
                } else {
                    self.result.cut_short = true;
                    let taken = scene.assembly.simulation.work().steps;
                    let told =
                        format!("cut short: {}, sound for {taken} of {} steps", scene.name, scene.planned);
                    self.result.note(CaseVerdict::Flagged, told);
                }
                self.end(scene);
                return None;
            }
        }
        Some(())
    }

    /// One step, looked at; what is found, nothing where the time is over.
    fn take_one(&mut self, scene: &mut LongScene) -> Result<(), Option<String>> {
        let simulation = &mut scene.assembly.simulation;
        if self.stop.load(Ordering::Relaxed) {
            return Err(None);
        }
        let before = scenes::iterations(simulation);
        let taken = simulation.step();
        // A solve that is stopped fails, but says nothing.
        if taken.is_err() && self.stop.load(Ordering::Relaxed) {
            return Err(None);
        }
        let result = &mut self.result;
        let iterations = scenes::iterations(simulation) - before;
        *result.iterations.get_or_insert(0) += iterations;
        result.worst_step = result.worst_step.max(Some(iterations));
        taken.map_err(|error| Some(error.to_string()))?;
        *result.steps.get_or_insert(0) += 1;
        let step = simulation.work().steps;
        if !simulation.state().x().iter().chain(simulation.state().v()).all(|x| x.is_finite()) {
            return Err(Some(format!("after step {step} not all is finite")));
        }
        let contacts = simulation.contacts();
        for contact in &contacts {
            result.least_gap =
                Some(result.least_gap.map_or(contact.relative_gap, |g| g.min(contact.relative_gap)));
            if contact.gap.is_nan() || contact.gap <= 0.0 {
                return Err(Some(format!("after step {step} a gap of {:.3e} m", contact.gap)));
            }
        }
        let crossings = pliant_mesh::crossings(&scene.assembly.topology, &simulation.positions());
        if let Some((first, second)) = crossings.first() {
            let count = crossings.len();
            return Err(Some(format!(
                "after step {step} {count} primitives cross, vertices {first:?} and {second:?} first"
            )));
        }
        scene.look_at_energy();
        Ok(())
    }

    /// Ends a scene: its energies, and what it looks like.
    pub(super) fn end(&mut self, scene: &mut LongScene) {
        let EnergyRange { gain: [gain, time], turnover, in_play, .. } = scene.energy;
        let most = GAINS[0] * turnover + GAINS[1] * in_play + scene.rounding;
        self.result.demand(gain <= most, || {
            format!("{}: {gain:.3e} J of {in_play:.3e} J come from nowhere until {time:.4} s", scene.name)
        });
        let simulation = &mut scene.assembly.simulation;
        let unsettled = simulation.work().solver.map_or(0, |solver| solver.unsettled);
        if unsettled > 0 {
            let told =
                format!("unsettled: {}, friction still changed at the end of {unsettled} solves", scene.name);
            self.result.note(CaseVerdict::Flagged, told);
        }
        let min_j = simulation.diagnostics().min_j;
        self.result.min_j = [self.result.min_j, min_j].into_iter().flatten().reduce(f64::min);
        self.result.picture = Some(scenes::picture(simulation, &scene.assembly.topology));
    }

    /// Demands what holds at the end of a scene, or on its way.
    pub(super) fn demand(&mut self, holds: bool, otherwise: impl FnOnce() -> String) {
        self.result.demand(holds, otherwise);
    }

    /// Compares the number that a scene is judged by with how large it may be.
    pub(super) fn measure(&mut self, what: &str, error: f64, tolerance: f64) {
        self.result.measure(what, error, tolerance);
    }

    /// Result of all scenes.
    pub(super) fn finish(self) -> CaseResult {
        let mut result = self.result;
        let touched = result.least_gap.is_some();
        result.demand(touched || result.cut_short, || "nothing touched".into());
        if let Some(gap) = result.least_gap.filter(|gap| *gap < OVERLOAD) {
            result.note(CaseVerdict::Flagged, format!("overload: least gap {gap:.2e} of its distance"));
        }
        result
    }
}
