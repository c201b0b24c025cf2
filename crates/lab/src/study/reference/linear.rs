//! Exact reference for linear systems: superposition of modes.

use pliant_sparse::symmetric_eigen;

use super::{Reference, ReferenceSearch};
use crate::study::StudyError;
use crate::study::plan::TimeStepping;
use crate::study::trajectory::StateSamples;

/// Maximum number of coordinates, limited by the time of a dense matrix.
const MOST_COORDINATES: usize = 600;
/// Largest relative deviation of the forces along the solution from linearity, to allow for rounding.
const LINEAR: f64 = 1e-10;

/// Exact solution of `M u'' = f_0 - K u` by modes, if the forces along it prove to be linear.
/// [`Superposition`](pliant::modes::Superposition) requires a stable start; here directions in which
/// nothing moves may be unstable, such as those across a chain with a compressed spring.
pub(super) fn solution(search: &mut ReferenceSearch<'_, '_>) -> Result<Option<Reference>, StudyError> {
    let (scene, grid) = (search.scene, search.grid());
    let scheme = scene.time.integrator.into();
    let mut assembly =
        search.runner.assemble(scene, scheme, TimeStepping::Parts(1)).map_err(StudyError::Scene)?;
    let simulation = &mut assembly.simulation;
    let (x0, v0) = (simulation.state().x().to_vec(), simulation.state().v().to_vec());
    let system = simulation.system_mut();
    let lossless = !system.is_damped() && system.ether_drag() == 0.0 && system.walls().is_empty();
    let constant = !system.changes_with_time() && !system.has_prescribed_motion();
    let for_ever = system.constraints().iter().all(|hold| hold.end() == f64::INFINITY);
    let weight = system.inverse_mass().to_vec();
    let free: Vec<usize> = (0..weight.len()).filter(|i| weight[*i] > 0.0).collect();
    let n = free.len();
    if !(lossless && constant && for_ever) || n == 0 || n > MOST_COORDINATES {
        return Ok(None);
    }
    // M^-1/2 K M^-1/2, column by column.
    let mut scaled = vec![0.0; n * n];
    let (mut unit, mut image) = (vec![0.0; x0.len()], vec![0.0; x0.len()]);
    for (column, &j) in free.iter().enumerate() {
        unit[j] = 1.0;
        system.hessian_product(&x0, &unit, &mut image);
        unit[j] = 0.0;
        for (row, &i) in free.iter().enumerate() {
            scaled[row * n + column] = image[i] * (weight[i] * weight[j]).sqrt();
        }
    }
    let stiffness = |i: usize, j: usize| 0.5 * (scaled[i * n + j] + scaled[j * n + i]);
    let Some(eigen) = symmetric_eigen(n, stiffness) else { return Ok(None) };
    let mut gradient = vec![0.0; x0.len()];
    system.gradient(&x0, &mut gradient);
    // For each mode: omega^2, initial force and velocity.
    let project = |column: usize, of: &dyn Fn(usize) -> f64| -> f64 {
        free.iter().enumerate().map(|(row, &i)| eigen.vector(row, column) * of(i)).sum()
    };
    let modes: Vec<(f64, f64, f64)> = (0..n)
        .map(|column| {
            let force = project(column, &|i| -gradient[i] * weight[i].sqrt());
            let velocity = project(column, &|i| v0[i] / weight[i].sqrt());
            (eigen.values[column], force, velocity)
        })
        .collect();
    let highest = modes.iter().map(|mode| mode.0).fold(0.0, f64::max);
    let mut trajectory = StateSamples::default();
    let mut off_line: f64 = 0.0;
    for step in 1..=grid.times {
        let t = grid.duration * step as f64 / grid.times as f64;
        let amplitudes: Vec<(f64, f64)> = modes
            .iter()
            .map(|&(square, force, velocity)| oscillate(square, highest, force, velocity, t))
            .collect();
        let (mut x, mut v, mut ku) = (x0.clone(), v0.clone(), vec![0.0; x0.len()]);
        for (row, &i) in free.iter().enumerate() {
            let (mut u, mut du, mut pull) = (0.0, 0.0, 0.0);
            for (column, (q, dq)) in amplitudes.iter().enumerate() {
                let shape = eigen.vector(row, column);
                u += shape * q;
                du += shape * dq;
                pull += shape * q * modes[column].0;
            }
            x[i] += u * weight[i].sqrt();
            v[i] = du * weight[i].sqrt();
            ku[i] = pull / weight[i].sqrt();
        }
        let mut there = vec![0.0; x0.len()];
        system.gradient(&x, &mut there);
        let size = free
            .iter()
            .map(|&i| there[i].abs().max(ku[i].abs()).max(gradient[i].abs()))
            .fold(f64::MIN_POSITIVE, f64::max);
        for &i in &free {
            off_line = off_line.max((there[i] - gradient[i] - ku[i]).abs() / size);
        }
        trajectory.times.push(t);
        trajectory.x.push(x);
        trajectory.v.push(v);
    }
    if off_line.is_nan() || off_line > LINEAR {
        return Ok(None);
    }
    let d = system.dimension();
    let in_order = |rows: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        rows.iter().map(|row| simulation.numbering().to_original(row, d).into_owned()).collect()
    };
    let (x, v) = (in_order(&trajectory.x), in_order(&trajectory.v));
    // Rounding errors of frequencies accumulate in phases; deviations of the forces act during the whole
    // time.
    let error = (f64::EPSILON * 20.0 + 1e-2 * off_line) * (1.0 + highest.sqrt() * grid.duration);
    Ok(Some(Reference {
        id: "modes".into(),
        how: format!(
            "exact: superposition of all {n} modes of a linear system, along which forces are linear to \
             {off_line:.0e}"
        ),
        error,
        disagreement: Some(0.0),
        trajectory: StateSamples { x, v, ..trajectory },
    }))
}

/// Position and velocity after `t` of `q'' = force - square q` from `q = 0` with speed `velocity`.
fn oscillate(square: f64, highest: f64, force: f64, velocity: f64, t: f64) -> (f64, f64) {
    if square <= 1e-13 * highest {
        return (velocity * t + 0.5 * force * t * t, velocity + force * t);
    }
    let omega = square.sqrt();
    let (sin, cos) = (omega * t).sin_cos();
    // 1 - cos without cancellation.
    let versed = 2.0 * (0.5 * omega * t).sin().powi(2);
    (force / square * versed + velocity / omega * sin, force / omega * sin + velocity * cos)
}
