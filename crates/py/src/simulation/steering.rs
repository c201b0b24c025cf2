//! Poses and velocities of pins, from arrays.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use pliant::constraint::Waypoint;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays;

/// Columns of a rotation may differ so much from unit length and from right angles.
const ORTHOGONAL: f64 = 1e-6;

/// A displacement, or a homogeneous matrix.
pub(super) fn pose(pose: &Bound<'_, PyAny>, dimension: usize) -> PyResult<Isometry3<f64>> {
    let numbers = pose.py().import("numpy")?.call_method1("asarray", (pose, "float64"))?;
    let rank: usize = numbers.getattr("ndim")?.extract()?;
    if rank < 2 {
        let shift = arrays::finite_rows(&numbers, &[dimension], "the displacement of a pin")?;
        return Ok(Isometry3::translation(shift[0], shift[1], shift.get(2).copied().unwrap_or(0.0)));
    }
    let n = dimension + 1;
    let rows = arrays::finite_rows(&numbers, &[n, n], "the pose of a pin")?;
    let mut turn = Matrix3::identity();
    let mut shift = Vector3::zeros();
    for i in 0..dimension {
        (0..dimension).for_each(|j| turn[(i, j)] = rows[i * n + j]);
        shift[i] = rows[i * n + dimension];
    }
    let last = (0..n).all(|j| rows[dimension * n + j] == f64::from(u8::from(j == dimension)));
    let defect = (turn.transpose() * turn - Matrix3::identity()).amax();
    if !last || defect > ORTHOGONAL || turn.determinant() < 0.0 {
        let message =
            "the pose of a pin is a rotation and a displacement: [[R, u], [0, 1]] with R^T R = 1, det R = 1";
        return Err(PyValueError::new_err(message));
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    Ok(Isometry3::from_parts(shift.into(), rotation))
}

/// A velocity, or that and an angular velocity; of no pose.
pub(super) fn rates(velocity: Option<&Bound<'_, PyAny>>, dimension: usize) -> PyResult<Waypoint> {
    let mut waypoint = Waypoint::at_rest(Isometry3::identity());
    let Some(velocity) = velocity else { return Ok(waypoint) };
    let (linear, angular) = match velocity.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() {
        // Two numbers are a velocity in the plane.
        Ok((linear, angular)) if linear.extract::<f64>().is_err() => (linear, Some(angular)),
        _ => (velocity.clone(), None),
    };
    let linear = arrays::finite_rows(&linear, &[dimension], "the velocity of a pin")?;
    waypoint.velocity = Vector3::from_fn(|i, _| linear.get(i).copied().unwrap_or(0.0));
    if let Some(angular) = angular {
        waypoint.angular_velocity = if dimension == 2 {
            Vector3::new(0.0, 0.0, angular.extract()?)
        } else {
            Vector3::from_vec(arrays::finite_rows(&angular, &[3], "the angular velocity of a pin")?)
        };
    }
    Ok(waypoint)
}
