//! State of single elements: deformation, strain, stress.

use crate::algebra::{Mat, signed_svd};

/// Deformation and stress of one element, and all measures that follow from them (lecture 13 and 15).
///
/// Tensors are three-dimensional: in 2D the third axis is the direction of plane strain, `F_33 = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementState {
    /// Deformation gradient `F`.
    pub deformation_gradient: Mat<f64, 3>,
    /// First Piola-Kirchhoff stress `P = d Psi / dF` [Pa].
    pub first_piola: Mat<f64, 3>,
    /// Energy density `Psi(F)` per reference volume [J/m^3].
    pub energy_density: f64,
    /// True if the third axis is out of the plane of a scene in 2D: rotations are then about this axis.
    pub plane: bool,
}

impl ElementState {
    /// Returns the volume ratio `J = det F`.
    pub fn j(&self) -> f64 {
        self.deformation_gradient.determinant()
    }

    /// Returns the principal stretches, descending in magnitude; the last is negative in an inverted
    /// element.
    pub fn principal_stretches(&self) -> [f64; 3] {
        signed_svd(&self.deformation_gradient).sigma
    }

    /// Returns the Green strain `E = 1/2 (F^T F - I)`.
    pub fn green_strain(&self) -> Mat<f64, 3> {
        let f = &self.deformation_gradient;
        (f.transpose_mul(f) - Mat::identity()).scale(0.5)
    }

    /// Returns the corotated strain `S - I`, with `F = R S` the signed polar decomposition: `R` is a
    /// rotation, in 2D one in the plane, and `S` has the negative stretch of an inverted element.
    pub fn corotated_strain(&self) -> Mat<f64, 3> {
        let f = &self.deformation_gradient;
        if !self.plane {
            return stretch(f) - Mat::identity();
        }
        let in_plane = stretch(&Mat([[f[0][0], f[0][1]], [f[1][0], f[1][1]]]));
        let mut strain = Mat::diagonal(&[0.0, 0.0, f[2][2]]);
        for i in 0..2 {
            strain[i][..2].copy_from_slice(&in_plane[i]);
        }
        strain - Mat::identity()
    }

    /// Returns the Cauchy stress `sigma = P F^T / J` [Pa]; not finite if `J = 0`.
    pub fn cauchy_stress(&self) -> Mat<f64, 3> {
        self.first_piola.mul_transpose(&self.deformation_gradient).scale(1.0 / self.j())
    }

    /// Returns the von Mises stress `sqrt(3/2 s : s)` [Pa], with the deviator `s` of the Cauchy stress.
    pub fn von_mises_stress(&self) -> f64 {
        von_mises(&self.cauchy_stress())
    }
}

/// Returns the von Mises stress `sqrt(3/2 s : s)` of a stress [Pa], with the deviator `s` of its symmetric
/// part.
pub fn von_mises(stress: &Mat<f64, 3>) -> f64 {
    let sigma = stress.symmetric();
    let deviator = sigma - Mat::scalar(sigma.trace() / 3.0);
    (1.5 * deviator.norm_squared()).sqrt()
}

/// Returns `S = V diag(sigma) V^T` of `F = R S`.
fn stretch<const D: usize>(f: &Mat<f64, D>) -> Mat<f64, D> {
    let svd = signed_svd(f);
    svd.v.mul(&Mat::diagonal(&svd.sigma)).mul_transpose(&svd.v)
}
