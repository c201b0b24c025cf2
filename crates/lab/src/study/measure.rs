//! Measurement of one row: one observed run, and timed runs.

use super::errors::ErrorScales;
use super::machine::{forget_peak, peak};
use super::plan::{Contender, TimeGrid, TimeStepping};
use super::results::Record;
use super::row::{Row, RowStatus, SCHEMA};
use super::sweep::{Study, integrator_name, status};
use super::timing::Timing;
use super::trajectory::{InvariantSeries, Runner, WatchedRun};
use super::{Reference, StudyError};
use crate::statistics::RunStatistics;
use pliant::algebra::scene_size;
use pliant::integrator::Scheme;
use pliant_scene::Scene;

/// Number of timed runs of a row.
const REPEATS: usize = 7;
/// Total time of timed runs that also suffices [s].
const ENOUGH_SECONDS: f64 = 1.0;
/// Maximum number of timed runs, if times scatter.
const MOST_REPEATS: usize = 3 * REPEATS;
/// Newton tolerance as a fraction of the scene's size, if the scene has none: far below the errors of
/// time steps.
const NEWTON_TOLERANCE: f64 = 1e-12;

/// Common data of all rows of a variant.
pub(super) struct VariantContext<'a> {
    pub(super) study: &'a Study<'a>,
    pub(super) scene: &'a Scene,
    pub(super) label: &'a str,
    pub(super) weights: &'a ErrorScales,
    pub(super) reference: &'a Reference,
    pub(super) grid: TimeGrid,
}

/// Measures the row of an integrator at a step, timed for about `slice` seconds; `None` if it was not
/// done at `deadline`, or was interrupted.
pub(super) fn measure(
    about: &VariantContext<'_>,
    contender: Contender,
    pace: TimeStepping,
    slice: f64,
    deadline: f64,
) -> Result<Option<Record>, StudyError> {
    let study = about.study;
    let runner = Runner { grid: about.grid, clock: study.clock, interrupt: study.interrupt };
    let scene = &solved_well(about, &runner, contender)?;
    // The observed run, with its peak memory.
    forget_peak();
    let before = study.clock.now();
    let watched = runner.watch(scene, contender, pace, deadline).map_err(StudyError::Scene)?;
    let Some((status, failure)) = status(&watched.summary.outcome) else { return Ok(None) };
    let memory = peak();
    // Timed runs until there are enough, or the time is used up.
    let mut seconds = vec![];
    if status == RowStatus::Ok {
        let wanted = study.plan.repeats.unwrap_or(REPEATS);
        loop {
            let timing = Timing::of(&seconds);
            let total: f64 = seconds.iter().sum();
            let enough = seconds.len() >= wanted || (study.plan.repeats.is_none() && total >= ENOUGH_SECONDS);
            let quiet = study.plan.repeats.is_some() || !timing.is_noisy() || seconds.len() >= MOST_REPEATS;
            let next = watched.setup + watched.stepping;
            let over = study.clock.now() - before + next > slice;
            if (enough && quiet) || over {
                break;
            }
            seconds.push(runner.time(scene, contender, pace).map_err(StudyError::Scene)?.1);
            if study.interrupt.load(std::sync::atomic::Ordering::Relaxed) {
                return Ok(None);
            }
        }
    }
    if seconds.is_empty() {
        seconds.push(watched.stepping);
    }
    let timing = Timing::of(&seconds);
    Ok(Some(record(about, contender, pace, scene, &watched, (status, failure), timing, memory)))
}

/// Scene with a Newton tolerance that does not hide the integrator's error.
fn solved_well(
    about: &VariantContext<'_>,
    runner: &Runner<'_>,
    contender: Contender,
) -> Result<Scene, StudyError> {
    let mut scene = about.scene.clone();
    if contender.method.documentation.solves == 0 {
        return Ok(scene);
    }
    let mut solver = scene.time.solver.clone().unwrap_or_default();
    if solver.tolerance.is_none() {
        let assembly =
            runner.assemble(&scene, contender, TimeStepping::Parts(1)).map_err(StudyError::Scene)?;
        let size = scene_size(assembly.simulation.state().x(), scene.dimension);
        solver.tolerance = Some(NEWTON_TOLERANCE * size);
    }
    scene.time.solver = Some(solver);
    Ok(scene)
}

#[allow(clippy::too_many_arguments, reason = "a row has many columns")]
fn record(
    about: &VariantContext<'_>,
    contender: Contender,
    pace: TimeStepping,
    scene: &Scene,
    watched: &WatchedRun,
    (status, failure): (RowStatus, Option<(f64, String)>),
    timing: Timing,
    memory: Option<f64>,
) -> Record {
    let WatchedRun { assembly, summary, trajectory, series, .. } = watched;
    let reference = about.reference;
    let errors = about.weights.errors(trajectory, &reference.trajectory);
    let (momentum, angular) = about.weights.momentum_errors(series, &reference.trajectory);
    let ok = status == RowStatus::Ok;
    let finite = |value: f64| (ok && value.is_finite()).then_some(value);
    let counts = RunStatistics::new(summary.work, watched.setup, timing.median);
    let provenance = about.study.provenance;
    let method = contender.method.documentation;
    let implicit = method.solves > 0;
    let row = Row {
        schema: SCHEMA,
        case: about.study.name.to_owned(),
        commit: provenance.commit.clone(),
        host: provenance.host.clone(),
        cpu: provenance.cpu.clone(),
        threads: about.study.plan.threads,
        rustc: provenance.rustc.clone(),
        flags: provenance.flags.clone(),
        precision: "f64".into(),
        element: elements(about.scene),
        material: materials(about.scene),
        nu: about.scene.body.iter().find_map(|b| b.elastic.as_ref()?.lame()).map(poisson),
        ndof: assembly.report.free_coordinates,
        mass: "lumped".into(),
        integrator: integrator_name(contender, matches!(pace, TimeStepping::Tolerance(_))),
        order_nominal: method.order,
        stages: stages(contender),
        dt: match pace {
            TimeStepping::Parts(parts) => about.grid.step(parts),
            TimeStepping::Tolerance(_) => summary.end.time / counts.steps.max(1) as f64,
        },
        steps: counts.steps,
        t_end: about.grid.duration,
        newton_tol: scene.time.solver.as_ref().filter(|_| implicit).and_then(|solver| solver.tolerance),
        lin_solver: implicit.then(|| linear_solver(&assembly.simulation.linear_solver())),
        err_q_rms: finite(errors.q_rms),
        err_q_max: finite(errors.q_max),
        err_v_rms: finite(errors.v_rms),
        err_energy_max: summary.relative_energy_error().and_then(finite),
        err_momentum: finite(momentum),
        err_angmom: finite(angular),
        ref_id: reference.id.clone(),
        ref_err: reference.error,
        status,
        fail_time: failure.as_ref().map(|failure| failure.0),
        n_force: counts.force_evaluations,
        n_hess: counts.hessians,
        n_factor: counts.factorizations,
        n_newton: counts.newton_iterations,
        n_linesearch: counts.line_search_energies,
        n_cg: counts.cg_iterations,
        wall_min_s: timing.min,
        wall_median_s: timing.median,
        wall_iqr_s: timing.iqr,
        repeats: timing.repeats,
        setup_s: watched.setup,
        peak_rss_mb: memory,
        obs_order: None,
        tol: match pace {
            TimeStepping::Parts(_) => None,
            TimeStepping::Tolerance(tolerance) => Some(tolerance),
        },
        n_reject: summary.work.rejected_steps,
        variant: about.label.to_owned(),
        dropped: ok && errors.q_rms < reference.floor(),
        message: failure.map(|failure| failure.1),
    };
    Record {
        row,
        errors: errors.at,
        times: series.times.clone(),
        energy: energy(series, summary.energy_scale),
    }
}

/// Energy error over time: `E - E_0` relative to the energy scale.
fn energy(series: &InvariantSeries, scale: f64) -> Vec<f64> {
    let first = series.energy.first().copied().unwrap_or(0.0);
    series.energy.iter().map(|energy| (energy - first) / scale).collect()
}

/// Number of force evaluations in an explicit step, solves in an implicit one, or stages of a collocation
/// method.
fn stages(contender: Contender) -> u32 {
    let about = contender.method.documentation;
    match contender.method.scheme {
        Scheme::Collocation(tableau) => tableau.b.len() as u32,
        _ if about.solves > 0 => about.solves,
        _ => about.force_evaluations,
    }
}

/// Short name of the linear solver, without the explanation.
fn linear_solver(explained: &str) -> String {
    explained.split(", chosen").next().unwrap_or_default().to_owned()
}

/// Poisson's ratio from Lame's constants.
fn poisson(lame: pliant::material::Lame) -> f64 {
    0.5 * lame.lambda / (lame.lambda + lame.mu)
}

/// Kinds of elements, each once.
fn elements(scene: &Scene) -> String {
    let kind = |body: &pliant_scene::Body| {
        let quadratic = body.order == Some(2);
        match (&body.elastic, scene.dimension, body.membrane.is_some()) {
            (None, ..) if body.is_particles() => "particles",
            (None, ..) => "springs",
            (Some(_), 3, false) if quadratic => "tet10",
            (Some(_), 3, false) => "tet4",
            (Some(_), ..) if quadratic => "tri6",
            (Some(_), ..) => "tri3",
        }
    };
    each_once(scene.body.iter().map(kind))
}

/// Materials, each once.
fn materials(scene: &Scene) -> String {
    each_once(scene.body.iter().filter_map(|body| body.elastic.as_ref()).map(|material| material.name()))
}

fn each_once<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut all: Vec<&str> = vec![];
    for name in names {
        if !all.contains(&name) {
            all.push(name);
        }
    }
    all.join("+")
}
