//! Material axes per element, for anisotropic materials.

use crate::algebra::{Mat, Vect, unit};
use crate::scalar::Scalar;

/// Returns the rotation `R` from the axes of a material to those of space, with the material axes in its
/// columns. The energy density of the rotated material is `psi(F R)`.
///
/// `first` is along the first axis, of any length but zero. `second`, not parallel to it, is in the plane of
/// the first two axes, on the side of the second one. Without `second` the axes are turned by the smallest
/// rotation from x to `first`; if `first` points against x, by half a turn about z and the smallest rotation
/// from there. In the plane this is the rotation about z in either case.
///
/// ```
/// use pliant::material::material_axes;
/// let axes = material_axes(&[0.0, 2.0, 0.0], None);
/// assert_eq!(axes.0, [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
/// ```
pub fn material_axes<S: Scalar>(first: &Vect<S, 3>, second: Option<&Vect<S, 3>>) -> Mat<S, 3> {
    let (first, _) = unit(first);
    let Some(second) = second else {
        let backwards = first[0].lt(S::zero());
        let sign = S::select(backwards, -S::one(), S::one());
        let [x, y, z] = first.map(|component| sign * component);
        let (zero, part) = (S::zero(), S::one() / (S::one() + x));
        let smallest = Mat([
            [x, -y, -z],
            [y, S::one() - y * y * part, -(y * z * part)],
            [z, -(y * z * part), S::one() - z * z * part],
        ]);
        return smallest.mul(&Mat([[sign, zero, zero], [zero, sign, zero], [zero, zero, S::one()]]));
    };
    let along = dot(&first, second);
    let (second, _) = unit(&[0, 1, 2].map(|i| second[i] - along * first[i]));
    let third = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| first[i] * second[j] - first[j] * second[i]);
    let mut axes = Mat::zero();
    for i in 0..3 {
        axes[i] = [first[i], second[i], third[i]];
    }
    axes
}

fn dot<S: Scalar>(a: &Vect<S, 3>, b: &Vect<S, 3>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_a_rotation_whose_first_two_are_as_asked() {
        let second = [0.3, -0.2, 0.9];
        for first in
            [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.2, -3.0, 1.0], [-5.0, 1e-9, 2.0], [0.0, 0.0, -1e-200]]
        {
            for second in [None, Some(&second)] {
                let axes = material_axes(&first, second);
                let off = axes.transpose_mul(&axes) - Mat::identity();
                assert!(off.norm_squared() < 1e-30 && (axes.determinant() - 1.0).abs() < 1e-15, "{axes:?}");
                let column = |j: usize| [axes[0][j], axes[1][j], axes[2][j]];
                let (along, _) = unit(&first);
                assert!((0..3).all(|i| (column(0)[i] - along[i]).abs() < 1e-15), "{first:?} {axes:?}");
                if let Some(second) = second {
                    assert!(dot(&column(1), second) > 0.0 && dot(&column(2), second).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn axes_in_the_plane_turn_about_its_normal() {
        for angle in [-3.0_f64, -1.5, -0.1, 0.4, 1.8, 3.1] {
            let (sin, cos) = angle.sin_cos();
            let expected = Mat([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]);
            let off = material_axes(&[2.0 * cos, 2.0 * sin, 0.0], None) - expected;
            assert!(off.norm_squared() < 1e-30, "{angle}: {off:?}");
        }
    }
}
