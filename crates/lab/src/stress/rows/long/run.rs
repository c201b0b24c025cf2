//! Runs of long scenes with checks after every step.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::stress::rows::contact::note_gap;
use crate::stress::scenes::{self, assemble};
use crate::stress::{CaseResult, CaseVerdict};
use pliant_scene::assembly::Assembly;

/// Limits on unexplained energy gain. The first is a fraction of the work of prescribed motion, which is
/// integrated over steps from its rates at their ends; the second a fraction of the energy scale, for the
/// solver's error.
const GAINS: [f64; 2] = [1e-2, 1e-7];

/// A running long case.
pub(super) struct LongRun<'a> {
    stop: &'a Arc<AtomicBool>,
    result: CaseResult,
}

/// A scene of a long case.
pub(super) struct LongScene {
    /// Name in notes.
    name: String,
    assembly: Assembly,
    /// Planned number of steps.
    planned: u64,
    energy: EnergyRange,
    /// Rounding error of the energy [J].
    rounding: f64,
}

/// Range of the energies of a scene [J].
#[derive(Clone, Copy, Default)]
struct EnergyRange {
    /// Smallest total energy minus external work; friction is not added, because dissipation must not
    /// hide a gain.
    least: f64,
    /// Largest growth above the smallest earlier value, and its time [s].
    gain: [f64; 2],
    /// Largest external work.
    turnover: f64,
    /// Largest energy scale.
    in_play: f64,
}

impl LongScene {
    /// Positions, flat [m].
    pub(super) fn x(&self) -> Vec<f64> {
        self.assembly.simulation.positions().into_owned()
    }

    /// Sets the rounding error for bodies whose Young's moduli times volumes sum to `stiffness` [J].
    /// Element energies are differences of numbers of this size: gains up to their rounding do not count.
    pub(super) fn expect_rounding(&mut self, stiffness: f64) {
        self.rounding = f64::EPSILON * stiffness;
    }

    /// Positions of a body's vertices, flat [m].
    pub(super) fn of_body(&self, name: &str) -> Vec<f64> {
        let Some(body) = self.assembly.topology.bodies.iter().find(|body| body.name == name) else {
            panic!("{}: there is no body {name}", self.name)
        };
        let d = self.assembly.topology.dimension;
        self.x()[d * body.vertices.start as usize..d * body.vertices.end as usize].to_vec()
    }

    /// Mean of a body's vertices [m].
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

    /// Tetrahedra of a body, as corner positions [m].
    pub(super) fn tetrahedra(&self, name: &str) -> Vec<[[f64; 3]; 4]> {
        let x = self.x();
        let at = |v: u32| [0, 1, 2].map(|k| x[3 * v as usize + k]);
        let bodies = self.assembly.topology.bodies.iter().filter(|body| body.name == name);
        bodies.flat_map(|body| &body.tetrahedra).map(|t| t.map(at)).collect()
    }

    /// Elastic energy [J].
    pub(super) fn elastic(&mut self) -> f64 {
        self.assembly.simulation.diagnostics().elastic
    }

    /// Current number of contacts.
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
        // NaN counts as an infinite gain.
        let grown = if energy.is_finite() { energy - range.least } else { f64::INFINITY };
        if grown > range.gain[0] {
            range.gain = [grown, self.assembly.simulation.state().time];
        }
        range.least = range.least.min(energy);
    }
}

impl<'a> LongRun<'a> {
    /// Starts a case; it ends once `stop` is set, even within a step.
    pub(super) fn new(stop: &'a Arc<AtomicBool>) -> Self {
        let result = CaseResult { iterations: Some(0), steps: Some(0), ..CaseResult::default() };
        LongRun { stop, result }
    }

    /// Begins a scene of the case, planned for this many steps.
    pub(super) fn begin(&mut self, name: impl Into<String>, text: &str, planned: u64) -> LongScene {
        let mut assembly = assemble(text);
        assembly.simulation.system_mut().set_stop(Some(Arc::clone(self.stop)));
        let energy = EnergyRange { least: f64::INFINITY, ..EnergyRange::default() };
        let mut scene = LongScene { name: name.into(), assembly, planned, energy, rounding: 0.0 };
        scene.look_at_energy();
        scene.energy.gain = [0.0, 0.0];
        scene
    }

    /// Takes steps of a scene; `None` if they ended early: at the first failed check, or when time is up.
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

    /// Takes and checks one step. The error describes the failed check; it is `None` when time is up.
    fn take_one(&mut self, scene: &mut LongScene) -> Result<(), Option<String>> {
        let simulation = &mut scene.assembly.simulation;
        if self.stop.load(Ordering::Relaxed) {
            return Err(None);
        }
        let before = scenes::iterations(simulation);
        let taken = simulation.step();
        // A stopped solve fails without meaning.
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

    /// Ends a scene: checks its energies, and stores its picture.
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

    /// Checks a criterion at the end of a scene, or during it.
    pub(super) fn demand(&mut self, holds: bool, otherwise: impl FnOnce() -> String) {
        self.result.demand(holds, otherwise);
    }

    /// Compares a scene's error with its tolerance.
    pub(super) fn measure(&mut self, what: &str, error: f64, tolerance: f64) {
        self.result.measure(what, error, tolerance);
    }

    /// Result of all scenes.
    pub(super) fn finish(self) -> CaseResult {
        let mut result = self.result;
        let touched = result.least_gap.is_some();
        result.demand(touched || result.cut_short, || "nothing touched".into());
        if let Some(gap) = result.least_gap {
            note_gap(&mut result, gap);
        }
        result
    }
}
