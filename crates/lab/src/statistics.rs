//! Cost of a run: work in counts that do not depend on the machine, and time.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use pliant::observer::{Observer, Work};
use pliant::run::{Summary, count_losses_for, run};
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Problem, Scene};

/// Cost of one run. Counts do not depend on the machine or the number of threads; times do.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct RunStatistics {
    /// Number of accepted time steps.
    pub steps: u64,
    /// Number of steps rejected by the error estimate.
    pub rejected_steps: u64,
    /// Number of steps that failed and were subdivided.
    pub retried_steps: u64,
    /// Number of parts of these steps.
    pub parts: u64,
    /// Number of evaluations of the total force.
    pub force_evaluations: u64,
    /// Number of assembled matrices; 0 for explicit integrators, like all counts below.
    pub hessians: u64,
    /// Number of factorised matrices.
    pub factorizations: u64,
    /// Number of Newton iterations.
    pub newton_iterations: u64,
    /// Number of energies evaluated in line searches.
    pub line_search_energies: u64,
    /// Number of halvings in line searches.
    pub line_search_halvings: u64,
    /// Number of iterations of conjugate gradients.
    pub cg_iterations: u64,
    /// Number of solves that conjugate gradients left to a factorisation.
    pub fallbacks: u64,
    /// Wall time of the assembly [s]: meshes, masses, stability limit.
    pub setup_seconds: f64,
    /// Wall time of the run [s], including the symbolic factorisation of the first step.
    pub stepping_seconds: f64,
}

impl RunStatistics {
    /// Combines this work and these times [s].
    pub fn new(work: Work, setup_seconds: f64, stepping_seconds: f64) -> RunStatistics {
        let (solver, retried) = (work.solver.unwrap_or_default(), work.retried.unwrap_or_default());
        RunStatistics {
            steps: work.steps,
            rejected_steps: work.rejected_steps.unwrap_or(0),
            retried_steps: retried.steps,
            parts: retried.parts,
            force_evaluations: work.force_evaluations,
            hessians: solver.hessians,
            factorizations: solver.factorizations,
            newton_iterations: solver.newton_iterations,
            line_search_energies: solver.energies,
            line_search_halvings: solver.halvings,
            cg_iterations: solver.cg_iterations,
            fallbacks: solver.fallbacks,
            setup_seconds,
            stepping_seconds,
        }
    }
}

/// Assembles and runs a scene, and measures the cost.
///
/// # Errors
/// Errors of [`Scene::assemble`].
pub fn run_measured(
    scene: &Scene,
    unstable: UnstableStep,
    observers: &mut [&mut dyn Observer],
    interrupt: &AtomicBool,
) -> Result<(Assembly, Summary, RunStatistics), Vec<Problem>> {
    let started = Instant::now();
    let mut assembly = scene.assemble(unstable)?;
    let setup = started.elapsed();
    let started = Instant::now();
    count_losses_for(&mut assembly.simulation, observers);
    let summary = run(&mut assembly.simulation, &scene.plan(), observers, interrupt);
    let stepping = started.elapsed();
    let statistics = RunStatistics::new(summary.work, setup.as_secs_f64(), stepping.as_secs_f64());
    Ok((assembly, summary, statistics))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "dimension = 2
        time = { integrator = 'implicit-euler', step = 1e-3, duration = 0.01 }
        world = { gravity = [0.0, -9.81] }
        [[body]]
        mesh = { grid = { cells = [2, 1], spacing = 0.1 } }
        elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
        mass = { density = 1000.0 }
        pin = [{ box = { min = [0.0, 0.0], max = [0.0, 0.1] } }]";

    fn statistics(integrator: &str) -> RunStatistics {
        let scene = Scene::from_toml(&SCENE.replace("implicit-euler", integrator)).unwrap();
        run_measured(&scene, UnstableStep::Accept, &mut [], &AtomicBool::new(false)).unwrap().2
    }

    #[test]
    fn implicit_steps_count_what_their_solvers_do() {
        let counted = statistics("implicit-euler");
        assert_eq!(counted.steps, 10);
        assert!(counted.newton_iterations >= 10, "{counted:?}");
        assert!(counted.hessians >= 1 && counted.factorizations >= 1, "{counted:?}");
        assert!(counted.line_search_energies >= 10, "{counted:?}");
        assert_eq!(counted.cg_iterations, 0, "small systems are factorised: {counted:?}");
        assert!(counted.setup_seconds > 0.0 && counted.stepping_seconds > 0.0);
    }

    #[test]
    fn explicit_steps_count_forces_alone() {
        let counted = statistics("rk4");
        assert_eq!((counted.steps, counted.newton_iterations, counted.hessians), (10, 0, 0));
        assert_eq!(counted.force_evaluations, 41, "four a step, and the one at the start");
    }
}
