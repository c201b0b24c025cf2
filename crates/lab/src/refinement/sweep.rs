//! The runs of a study: floors of all meshes first, then schemes and steps where they may pay.

use std::sync::atomic::AtomicBool;

use pliant_scene::{Scene, Source};

use super::results::{QuantityRefinement, RefinedRow, RefinementResults};
use super::{RefinementError, RefinementPlan, StudiedScene};
use crate::quantity::{CellScale, ElementFamily, NoValues, QuantityRun};
use crate::study::Contender;

/// Largest explicit step relative to the largest stable one at rest: bodies that are compressed have smaller
/// ones.
const EXPLICIT_PART: f64 = 0.9;
/// Steps of floors and of rows, as parts of the largest explicit step; rows take the last on the coarsest
/// meshes alone, for the order in time.
const FLOOR_HALVINGS: [u64; 2] = [2, 4];
const ROW_HALVINGS: [u64; 3] = [1, 2, 4];
/// Smallest number of steps of an implicit scheme on the coarsest meshes, for the order in time.
const STEPS_FOR_ORDER: usize = 3;
/// Part of the budget for floors.
const FOR_FLOORS: f64 = 0.6;
/// Largest number of halvings of an implicit step.
const HALVINGS: u32 = 14;
/// Change of a quantity by half the step, relative to that by the mesh, at which the error is the mesh's.
const SMALL: f64 = 0.1;
/// Error of a row over that of its mesh at which smaller steps do not pay.
const NEAR_FLOOR: f64 = 1.1;
/// Total time of timed runs that suffices [s], and their largest number.
const ENOUGH_SECONDS: f64 = 0.2;
const MOST_REPEATS: usize = 3;

/// A study to run.
pub struct RefinementStudy<'a> {
    /// The scene.
    pub source: &'a Source,
    /// Plan of the study.
    pub plan: &'a RefinementPlan,
    /// Set by another thread to stop.
    pub interrupt: &'a AtomicBool,
}

impl RefinementStudy<'_> {
    /// Runs the study, on the plan's number of threads; `watch` sees each run before it begins.
    ///
    /// # Errors
    /// [`RefinementError`]. A failed run is no error.
    pub fn run(&self, watch: &mut (dyn FnMut(&str) + Send)) -> Result<RefinementResults, RefinementError> {
        let threads = self.plan.threads;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|source| RefinementError::Threads { threads, source })?;
        pool.install(|| self.run_here(watch))
    }

    fn run_here(&self, watch: &mut dyn FnMut(&str)) -> Result<RefinementResults, RefinementError> {
        let plan = self.plan;
        let mut sweep = MeshSweep {
            plan,
            of: StudiedScene::new(self.source, &plan.quantities, plan.budget, self.interrupt)?,
            rows: vec![],
            left_out: vec![],
            failed: 0,
            last_failure: None,
            watch,
        };
        sweep.floors()?;
        if sweep.rows.is_empty() {
            let failure = sweep.last_failure.unwrap_or(NoValues::Failed);
            return Err(RefinementError::NoRun(failure));
        }
        // References come from the floors alone.
        let is_static = sweep.of.is_static;
        let evaluated = sweep.of.quantities.iter().enumerate();
        let mut evaluated: Vec<QuantityRefinement> = evaluated
            .map(|(i, quantity)| QuantityRefinement::new(i, quantity, &sweep.rows, is_static))
            .collect();
        if !is_static {
            sweep.schemes(&evaluated)?;
        }
        evaluated.iter_mut().for_each(|of| of.compare(&sweep.rows));
        Ok(RefinementResults {
            dimension: sweep.of.scene.dimension,
            is_static,
            quantities: evaluated,
            rows: sweep.rows,
            left_out: sweep.left_out,
            failed: sweep.failed,
            seconds: sweep.of.seconds(),
        })
    }
}

struct MeshSweep<'a> {
    plan: &'a RefinementPlan,
    of: StudiedScene<'a>,
    rows: Vec<RefinedRow>,
    left_out: Vec<String>,
    failed: usize,
    last_failure: Option<NoValues>,
    watch: &'a mut dyn FnMut(&str),
}

/// A mesh of one kind of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FamilyMesh {
    family: ElementFamily,
    level: usize,
}

impl FamilyMesh {
    fn scale(self) -> CellScale {
        CellScale::finer(1 << self.level)
    }

    fn holds(self, row: &RefinedRow) -> bool {
        row.family == self.family && row.level == self.level
    }
}

impl MeshSweep<'_> {
    fn check_interrupt(&self) -> Result<(), RefinementError> {
        if self.of.is_interrupted() { Err(RefinementError::Interrupted) } else { Ok(()) }
    }

    fn words(&self, mesh: FamilyMesh) -> String {
        self.of.words(mesh.family, mesh.scale())
    }

    /// Runs every mesh of every kind of elements with a step so small that the error is the mesh's.
    fn floors(&mut self) -> Result<(), RefinementError> {
        let mut families: Vec<ElementFamily> = match self.plan.families.is_empty() {
            true => ElementFamily::ALL.to_vec(),
            false => self.plan.families.clone(),
        };
        for level in 0..self.plan.levels {
            for family in families.clone() {
                self.check_interrupt()?;
                let mesh = FamilyMesh { family, level };
                let growth = self.of.growth(!self.of.is_static).exp2();
                let expected = self.coarser_floor(mesh).map_or(0.0, |row| row.seconds * growth);
                if level > 0 && expected > FOR_FLOORS * self.plan.budget - self.of.seconds() {
                    self.left_out.push(format!("{} would take {expected:.0} s", self.words(mesh)));
                    families.retain(|other| *other != family);
                    continue;
                }
                if let Err(reason) = self.floor(mesh) {
                    if reason == NoValues::Interrupted {
                        return Err(RefinementError::Interrupted);
                    }
                    self.left_out.push(format!("{}: {reason}", self.words(mesh)));
                    // Elements that the mesh does not have say nothing of the others.
                    if !matches!(self.last_failure, Some(NoValues::Late | NoValues::Failed)) {
                        self.last_failure = Some(reason);
                    }
                    families.retain(|other| *other != family);
                }
            }
        }
        Ok(())
    }

    /// Runs a mesh with a small step.
    fn floor(&mut self, mesh: FamilyMesh) -> Result<(), NoValues> {
        let scene = self.of.on(mesh.family, mesh.scale())?;
        if self.of.is_static {
            let own = Contender::from(scene.time.integrator);
            return self.measure(mesh, own, &scene, None, true).map(|_| ());
        }
        let verlet = Contender::from(pliant::integrator::IntegratorSpec::VelocityVerlet);
        if let Some(limit) = self.of.explicit_limit(&scene, verlet)? {
            for halving in FLOOR_HALVINGS {
                let parts = halving * self.of.parts_below(EXPLICIT_PART * limit.step);
                let expected = parts as f64 * self.of.grid.times as f64 * limit.seconds;
                if expected > 0.5 * FOR_FLOORS * self.plan.budget {
                    break;
                }
                match self.measure(mesh, verlet, &scene, Some(self.of.grid.step(parts)), true) {
                    Err(NoValues::Failed) => {}
                    done => return done.map(|_| ()),
                }
            }
        }
        self.implicit_floor(mesh, &scene)
    }

    /// Halves the step of an implicit scheme until it does not matter beside the mesh.
    fn implicit_floor(&mut self, mesh: FamilyMesh, scene: &Scene) -> Result<(), NoValues> {
        let scheme = Contender::from(pliant::integrator::IntegratorSpec::TrBdf2);
        let coarser = self.coarser_floor(mesh).map(|row| row.values.clone());
        let mut parts = self.of.grid.parts(self.of.own_step);
        let mut last: Option<Vec<f64>> = None;
        for _ in 0..HALVINGS {
            let index = match self.measure(mesh, scheme, scene, Some(self.of.grid.step(parts)), false) {
                Ok(index) => index,
                Err(reason) if last.is_none() && reason == NoValues::Failed => {
                    parts *= 2;
                    continue;
                }
                Err(reason) => return Err(reason),
            };
            let values = self.rows[index].values.clone();
            let is_small = last.as_ref().is_some_and(|last| {
                values.iter().zip(last).enumerate().all(|(i, (value, last))| {
                    let by_mesh = coarser.as_ref().map_or(SMALL * value.abs(), |own| (value - own[i]).abs());
                    (value - last).abs() <= SMALL * by_mesh
                })
            });
            let is_over = 2.0 * self.rows[index].seconds > 0.3 * self.of.left();
            if is_small || is_over {
                self.rows[index].is_floor = true;
                return Ok(());
            }
            last = Some(values);
            parts *= 2;
        }
        Err(NoValues::Failed)
    }

    /// Runs a scheme on a mesh, timed; the index of the row.
    fn measure(
        &mut self,
        mesh: FamilyMesh,
        contender: Contender,
        scene: &Scene,
        step: Option<f64>,
        is_floor: bool,
    ) -> Result<usize, NoValues> {
        let about = format!("{}, {}", self.words(mesh), contender.name());
        (self.watch)(&about);
        let scene = match step {
            Some(step) => self.of.paced(scene.clone(), contender, step),
            None => scene.clone(),
        };
        let QuantityRun { values, unknowns, statistics } = match self.of.runs.run(&scene) {
            Ok(run) => run,
            Err(reason) => {
                self.failed += usize::from(reason == NoValues::Failed);
                return Err(reason);
            }
        };
        let (mut seconds, mut total, mut repeats) =
            (statistics.stepping_seconds, statistics.stepping_seconds, 1);
        let wanted = self.plan.repeats.unwrap_or(MOST_REPEATS);
        while repeats < wanted && (self.plan.repeats.is_some() || total < ENOUGH_SECONDS) {
            let own = self.of.runs.run(&scene)?.statistics.stepping_seconds;
            seconds = seconds.min(own);
            total += own;
            repeats += 1;
        }
        let keys = self.of.keys(mesh.family, mesh.scale(), step.map(|step| (contender, step)));
        self.rows.push(RefinedRow {
            family: mesh.family,
            level: mesh.level,
            cells: self.of.cells.words(mesh.scale()),
            unknowns,
            scheme: contender.name(),
            order: contender.method.documentation.order,
            explicit: contender.method.documentation.solves == 0,
            step,
            values: values.iter().map(|value| value.value).collect(),
            largest: values.iter().map(|value| value.largest).collect(),
            seconds,
            statistics,
            is_floor,
            keys,
        });
        Ok(self.rows.len() - 1)
    }

    /// Runs schemes and steps on every mesh, coarse meshes first.
    fn schemes(&mut self, quantities: &[QuantityRefinement]) -> Result<(), RefinementError> {
        for level in 0..self.plan.levels {
            for family in ElementFamily::ALL {
                let mesh = FamilyMesh { family, level };
                if self.floor_of(mesh).is_none() {
                    continue;
                }
                let Ok(scene) = self.of.on(mesh.family, mesh.scale()) else { continue };
                for contender in self.plan.contenders.clone() {
                    self.check_interrupt()?;
                    if self.of.left() <= 0.0 {
                        return Ok(());
                    }
                    match contender.method.documentation.solves {
                        0 => self.explicit_steps(mesh, contender, &scene),
                        _ => self.implicit_steps(mesh, contender, &scene, quantities)?,
                    }
                }
            }
        }
        Ok(())
    }

    /// Runs an explicit scheme near its limit.
    fn explicit_steps(&mut self, mesh: FamilyMesh, contender: Contender, scene: &Scene) {
        let Ok(Some(limit)) = self.of.explicit_limit(scene, contender) else { return };
        for halving in &ROW_HALVINGS[..if mesh.level == 0 { 3 } else { 2 }] {
            let step = self.of.grid.step(halving * self.of.parts_below(EXPLICIT_PART * limit.step));
            let is_known = self
                .rows
                .iter()
                .any(|row| mesh.holds(row) && row.scheme == contender.name() && row.step == Some(step));
            let expected = self
                .rows
                .iter()
                .filter(|row| mesh.holds(row) && row.explicit)
                .map(|row| row.seconds * row.step.unwrap_or(step) / step)
                .fold(0.0, f64::max);
            if !is_known && expected < 0.5 * self.of.left() {
                // A failed run is counted.
                let _ = self.measure(mesh, contender, scene, Some(step), false);
            }
        }
    }

    /// Runs an implicit scheme with smaller and smaller steps, as long as they may pay.
    fn implicit_steps(
        &mut self,
        mesh: FamilyMesh,
        contender: Contender,
        scene: &Scene,
        quantities: &[QuantityRefinement],
    ) -> Result<(), RefinementError> {
        let mut parts = 1;
        let mut expected = 0.0;
        let mut done = 0;
        for _ in 0..HALVINGS {
            self.check_interrupt()?;
            if expected > 0.3 * self.of.left() {
                self.left_out.push(format!(
                    "{} by {}: steps below {} s would take {expected:.0} s each",
                    self.words(mesh),
                    contender.name(),
                    pliant::quantity::Rounded::<3>(self.of.grid.step(parts / 2))
                ));
                return Ok(());
            }
            let step = self.of.grid.step(parts);
            parts *= 2;
            let is_same = |row: &RefinedRow| {
                mesh.holds(row) && row.scheme == contender.name() && row.step == Some(step)
            };
            let index = match self.rows.iter().position(is_same) {
                Some(index) => index,
                None => match self.measure(mesh, contender, scene, Some(step), false) {
                    Ok(index) => index,
                    Err(NoValues::Failed) => continue,
                    Err(_) => return Ok(()),
                },
            };
            expected = 2.0 * self.rows[index].seconds;
            done += 1;
            let is_for_order = mesh.level == 0 && done < STEPS_FOR_ORDER;
            if !is_for_order && self.is_enough(mesh, index, quantities) {
                return Ok(());
            }
        }
        Ok(())
    }

    /// True if smaller steps than those of a row do not pay: its error is that of its mesh, or a faster row
    /// has errors that this mesh cannot beat, in all quantities with a reference.
    fn is_enough(&self, mesh: FamilyMesh, index: usize, quantities: &[QuantityRefinement]) -> bool {
        let row = &self.rows[index];
        let Some(floor) = self.floor_of(mesh) else { return false };
        let within = |row: &RefinedRow, factor: f64| {
            quantities.iter().all(|of| match (of.total(row, row.floor(&self.rows)), of.total(floor, floor)) {
                (Some(total), Some(floor)) => total <= factor * floor,
                _ => true,
            })
        };
        let mut faster = self.rows.iter().filter(|other| other.seconds < row.seconds);
        within(row, NEAR_FLOOR) || faster.any(|other| within(other, 1.0))
    }

    /// The row of a mesh whose error is the mesh's.
    fn floor_of(&self, mesh: FamilyMesh) -> Option<&RefinedRow> {
        self.rows.iter().find(|row| row.is_floor && mesh.holds(row))
    }

    /// The floor of the same elements on the next coarser mesh.
    fn coarser_floor(&self, mesh: FamilyMesh) -> Option<&RefinedRow> {
        self.floor_of(FamilyMesh { level: mesh.level.checked_sub(1)?, ..mesh })
    }
}
