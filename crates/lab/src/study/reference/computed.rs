//! Numerical references: two integrators of different families, each extrapolated to step zero, that must
//! agree.

use super::super::plan::{Contender, TimeStepping};
use super::super::trajectory::{StateSamples, WatchedRun};
use super::{Reference, ReferenceSearch};
use crate::study::{Event, StudyError};
use pliant::integrator::IntegratorSpec;
use pliant::run::Outcome;
use pliant::solver::SolverOptions;

/// Maximum number of refinements with one integrator.
const MOST_LEVELS: usize = 14;
/// Lower bound of error estimates: rounding of sums over many steps.
const ROUNDING: f64 = 2e-14;

/// Error below which stagnation means rounding.
const RESOLVED: f64 = 1e-7;
/// Largest relative distance of solutions that agree: a tenth of the whole motion.
const AGREEMENT: f64 = 0.1;

/// Solution by one integrator.
struct SchemeResult {
    name: &'static str,
    steps: u64,
    trajectory: StateSamples,
    error: f64,
}

/// Computes a reference: the better of two extrapolated solutions of order 4, and their distance. One
/// integrator is explicit; the other is implicit with two coupled stages, with contact a singly
/// diagonally implicit one.
///
/// Global extrapolation after Richardson and Romberg; Hairer, Norsett, Wanner 1993, *Solving ordinary
/// differential equations I*, section II.9.
pub(super) fn reference(search: &mut ReferenceSearch<'_, '_>) -> Result<Reference, StudyError> {
    let start = search.runner.clock.now();
    let shares = [search.deadline - start, search.last - start];
    let damped = search.scene.world.ether_drag.is_some()
        || search.scene.body.iter().any(|body| body.damping.is_some())
        || !search.scene.world.walls.is_empty();
    let touches = search.scene.acting_contact();
    let rubs = touches.as_ref().is_some_and(|contact| {
        contact.friction > 0.0 || contact.pairs.iter().any(|pair| pair.friction > Some(0.0))
    });
    let damped = damped || rubs;
    // Barriers require steps that end at a solution.
    let implicit = if touches.is_some() { IntegratorSpec::Sdirk4 } else { IntegratorSpec::Gauss2 };
    let explicit = if damped { IntegratorSpec::Rk4 } else { IntegratorSpec::Yoshida4 };
    let (mut found, mut reached): (Vec<SchemeResult>, Vec<String>) = (vec![], vec![]);
    let mut absent = "";
    for (spec, until) in [(explicit, 0.5), (implicit, 1.0)] {
        let scheme = Contender::from(spec);
        let symmetric = spec != IntegratorSpec::Rk4 && !damped && touches.is_none();
        let mut deadlines = shares.map(|share| start + until * share);
        if !found.is_empty() {
            // The existing solution cannot be refined further: its confirmation gets its share of time
            // only.
            deadlines[1] = deadlines[0];
        }
        match extrapolate(search, scheme, symmetric, deadlines)? {
            Ok(scheme) => found.push(scheme),
            Err(how_far) => {
                reached.push(how_far);
                absent = scheme.name();
            }
        }
    }
    found.sort_by(|a, b| a.error.total_cmp(&b.error));
    let other = if found.len() > 1 { found.pop() } else { None };
    let Some(best) = found.pop() else {
        let seconds = search.runner.clock.now() - start;
        return Err(StudyError::NoReference { seconds, reached: reached.join("; ") });
    };
    let disagreement = other.as_ref().map(|other| distance(search, &other.trajectory, &best.trajectory));
    let (error, confirmation) = confirmed(&best, other.as_ref().zip(disagreement).ok_or(absent));
    let how = format!("computed: {} in up to {} steps, extrapolated; {confirmation}", best.name, best.steps);
    let id = format!("{}-extrapolated", best.name);
    Ok(Reference { id, how, error, disagreement, trajectory: best.trajectory })
}

/// Error of the best solution, and the confirmation in words. `other` is the second solution with its
/// distance, or the name of the integrator that has none.
fn confirmed(best: &SchemeResult, other: Result<(&SchemeResult, f64), &str>) -> (f64, String) {
    let (other, distance) = match other {
        Ok(other) => other,
        Err(name) => {
            let none = format!("no second integrator confirms it, {name} did not finish in time");
            return (best.error, none);
        }
    };
    if distance > AGREEMENT {
        let away =
            format!("no two integrators agree, {} differs by {distance:.0e} of the motion", other.name);
        return (distance, away);
    }
    // Consistent with both error estimates, or one of the estimates is wrong.
    let error = if distance > 10.0 * (best.error + other.error) { distance } else { best.error };
    (error, format!("{} agrees to {distance:.0e}", other.name))
}

/// Larger of the relative errors of positions and velocities.
fn distance(search: &ReferenceSearch<'_, '_>, a: &StateSamples, b: &StateSamples) -> f64 {
    let errors = search.weights.errors(a, b);
    errors.q_rms.max(errors.v_rms)
}

/// Halves the step until the extrapolated states no longer change; returns the progress of the last run
/// if no two runs completed. The first deadline ends the refinement, the second the search for two runs
/// to extrapolate from.
fn extrapolate(
    search: &mut ReferenceSearch<'_, '_>,
    scheme: Contender,
    symmetric: bool,
    [refine, give_up]: [f64; 2],
) -> Result<Result<SchemeResult, String>, StudyError> {
    let grid = search.grid();
    let mut scene = search.scene.clone();
    if scheme.method.documentation.solves > 0 {
        // Solved to rounding: a larger solver error would be extrapolated.
        let mut solver = scene.time.solver.clone().unwrap_or_default();
        solver.tolerance = Some(1e-15 * search.size());
        solver.iterations.get_or_insert(SolverOptions::default().max_iterations);
        scene.time.solver = Some(solver);
    }
    let limit = search.stability_limit(scheme)?;
    let mut parts = if limit.is_finite() { grid.parts(0.5 * limit).next_power_of_two() } else { 1 };
    // Extrapolations of the last level, by ascending order.
    let mut last: Vec<StateSamples> = vec![];
    let (mut best, mut worse) = (None::<SchemeResult>, 0);
    let mut cost: f64 = 0.0;
    let mut reached = format!("{} was not tried", scheme.name());
    for _ in 0..MOST_LEVELS {
        let clock = search.runner.clock;
        let deadline = if best.is_some() { refine } else { give_up };
        if clock.now() + 1.8 * cost > deadline {
            break;
        }
        (search.watch)(Event::Reference { scheme: scheme.name(), step: grid.step(parts) });
        let before = clock.now();
        let run = search
            .runner
            .watch(&scene, scheme, TimeStepping::Parts(parts), deadline)
            .map_err(StudyError::Scene)?;
        cost = clock.now() - before;
        search.unless_interrupted()?;
        let (end, duration) = (run.assembly.simulation.state().time, grid.duration);
        let step = grid.step(parts);
        reached = match &run.summary.outcome {
            Outcome::Failed(error) => format!("{}: {error}", scheme.name()),
            _ => format!(
                "{} in steps of {step:.3e} s came to t = {end:.3e} s of {duration} s in {cost:.1} s",
                scheme.name()
            ),
        };
        if run.out_of_time {
            break;
        }
        if run.is_done() {
            let steps = run.summary.work.steps;
            let next = tableau(&last, run, scheme.method.documentation.order, symmetric);
            if let (Some(coarse), Some(fine)) = (last.last(), next.last()) {
                let change = distance(search, coarse, fine);
                let error = change.max(ROUNDING);
                match &best {
                    Some(best) if best.error <= error => worse += 1,
                    _ => {
                        worse = 0;
                        let trajectory = fine.clone();
                        best = Some(SchemeResult { name: scheme.name(), steps, trajectory, error });
                    }
                }
                // With unresolved fast motions the error neither falls nor rises for a while.
                let resolved = best.as_ref().is_some_and(|best| best.error < RESOLVED);
                if change <= ROUNDING || worse == 2 && resolved || worse == 5 {
                    break;
                }
            }
            last = next;
        } else {
            last.clear();
        }
        parts *= 2;
    }
    Ok(best.ok_or(reached))
}

/// Next row of the extrapolation tableau, from the last row and a run with half the step.
fn tableau(last: &[StateSamples], run: WatchedRun, order: u32, symmetric: bool) -> Vec<StateSamples> {
    let mut row = vec![run.trajectory];
    for (j, coarse) in last.iter().enumerate() {
        let power = order + if symmetric { 2 } else { 1 } * j as u32;
        // Higher powers only amplify rounding errors.
        if power > 12 {
            break;
        }
        let factor = 1.0 / (f64::from(1u32 << power) - 1.0);
        let fine = &row[j];
        let combine = |fine: &[Vec<f64>], coarse: &[Vec<f64>]| -> Vec<Vec<f64>> {
            let rows = fine.iter().zip(coarse);
            rows.map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + factor * (a - b)).collect()).collect()
        };
        let next = StateSamples {
            times: fine.times.clone(),
            x: combine(&fine.x, &coarse.x),
            v: combine(&fine.v, &coarse.v),
        };
        row.push(next);
    }
    row
}

impl ReferenceSearch<'_, '_> {
    /// Size of the scene [m].
    fn size(&self) -> f64 {
        let scheme = self.scene.time.integrator.into();
        let assembly = self.runner.assemble(self.scene, scheme, TimeStepping::Parts(1));
        assembly.map_or(1.0, |assembly| {
            pliant::solver::scene_size(assembly.simulation.state().x(), self.scene.dimension)
        })
    }

    /// Largest stable step of an integrator at the start [s].
    fn stability_limit(&self, scheme: Contender) -> Result<f64, StudyError> {
        if scheme.method.documentation.stability_limit == f64::INFINITY {
            return Ok(f64::INFINITY);
        }
        let assembly =
            self.runner.assemble(self.scene, scheme, TimeStepping::Parts(1)).map_err(StudyError::Scene)?;
        Ok(assembly.report.stability.map_or(f64::INFINITY, |stability| stability.step))
    }

    fn unless_interrupted(&self) -> Result<(), StudyError> {
        match self.runner.interrupt.load(std::sync::atomic::Ordering::Relaxed) {
            true => Err(StudyError::Interrupted),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solution(name: &'static str, error: f64) -> SchemeResult {
        SchemeResult { name, steps: 100, trajectory: StateSamples::default(), error }
    }

    // A distant second solution with a large error estimate confirms nothing.
    #[test]
    fn a_reference_is_confirmed_by_a_scheme_that_agrees_alone() {
        let best = solution("rk4", 4e-3);
        let (error, how) = confirmed(&best, Ok((&solution("sdirk4", 0.5), 1.2)));
        assert!(error == 1.2 && how.starts_with("no two integrators agree"), "{error} {how}");
        let (error, how) = confirmed(&best, Ok((&solution("sdirk4", 5e-3), 8e-3)));
        assert!(error == 4e-3 && how == "sdirk4 agrees to 8e-3", "{error} {how}");
        // Both error estimates are small, so one of them must be wrong.
        let (error, how) = confirmed(&solution("rk4", 1e-9), Ok((&solution("sdirk4", 1e-9), 1e-6)));
        assert!(error == 1e-6 && how == "sdirk4 agrees to 1e-6", "{error} {how}");
        let (error, how) = confirmed(&best, Err("sdirk4"));
        assert!(
            error == 4e-3 && how.starts_with("no second integrator confirms it, sdirk4"),
            "{error} {how}"
        );
    }
}
