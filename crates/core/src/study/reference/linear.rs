//! Linear systems: superposition of their modes.

use super::{Reference, Search};
use crate::study::StudyError;
use crate::study::plan::Pace;
use crate::study::trajectory::Trajectory;

/// All modes of more coordinates than this would take too long.
const MOST_COORDINATES: usize = 600;
/// A force along the solution may be off the linear one by this much, relative: rounding, not curvature.
const LINEAR: f64 = 1e-10;

/// The solution, if along it the force is linear: `M u'' = f_0 - K u`, solved by modes, is then the exact solution, which the forces
/// there prove.
pub(super) fn solution(search: &mut Search<'_, '_>) -> Result<Option<Reference>, StudyError> {
    let (scene, grid) = (search.scene, search.grid());
    let scheme = scene.time.integrator.into();
    let mut assembly = search.runner.assemble(scene, scheme, Pace::Parts(1)).map_err(StudyError::Scene)?;
    let simulation = &mut assembly.simulation;
    let free = assembly.report.free_coordinates;
    if simulation.system().is_damped() || free == 0 || free > MOST_COORDINATES {
        return Ok(None);
    }
    // Whatever the reason why there is none: it is then computed.
    let Ok(modes) = simulation.superposition(None) else { return Ok(None) };
    let highest = modes.oscillators().iter().map(|mode| mode.square).fold(0.0, f64::max);
    let start = simulation.positions().into_owned();
    let mut trajectory = Trajectory::default();
    let mut off_line: f64 = 0.0;
    for step in 1..=grid.times {
        let t = grid.duration * step as f64 / grid.times as f64;
        let (mut x, mut v) = (start.clone(), vec![0.0; start.len()]);
        modes.state_at(t, &mut x, &mut v);
        off_line = off_line.max(nonlinearity(simulation, &x));
        trajectory.times.push(t);
        trajectory.x.push(x);
        trajectory.v.push(v);
    }
    if off_line.is_nan() || off_line > LINEAR {
        return Ok(None);
    }
    // Frequencies are known to rounding, and their errors add up to phases; forces off the line act for all the time.
    let error = (f64::EPSILON * 20.0 + 1e-2 * off_line) * (1.0 + highest.sqrt() * grid.duration);
    let count = modes.oscillators().len();
    let how = format!(
        "exact: superposition of all {count} modes of a linear system, along which forces are linear to {off_line:.0e}"
    );
    Ok(Some(Reference { id: "modes".into(), how, error, trajectory }))
}

/// How far the force at `x`, in the order of the scene, is from the linear one about the start, as a part of the largest.
fn nonlinearity(simulation: &mut crate::simulation::Simulation, x: &[f64]) -> f64 {
    let d = simulation.system().dimension();
    let x = simulation.numbering().to_internal(x, d).into_owned();
    let start = simulation.state().x().to_vec();
    let u: Vec<f64> = x.iter().zip(&start).map(|(x, start)| x - start).collect();
    let system = simulation.system_mut();
    let (mut here, mut there, mut ku) = (vec![0.0; x.len()], vec![0.0; x.len()], vec![0.0; x.len()]);
    system.gradient(&start, &mut here);
    system.gradient(&x, &mut there);
    system.hessian_product(&start, &u, &mut ku);
    let free = || (0..x.len()).filter(|i| system.inverse_mass()[*i] > 0.0);
    let size =
        free().map(|i| here[i].abs().max(there[i].abs()).max(ku[i].abs())).fold(f64::MIN_POSITIVE, f64::max);
    free().map(|i| (there[i] - here[i] - ku[i]).abs() / size).fold(0.0, f64::max)
}
