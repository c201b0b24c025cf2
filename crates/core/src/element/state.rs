//! What is known of single elements: deformation, strain, stress.

use crate::algebra::{Mat, signed_svd};

/// Deformation and stress of one element, and every measure that follows from them (lecture 13 and 15).
///
/// Always three-dimensional: in 2D the third axis is the direction of plane strain, `F_33 = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementState {
    /// Deformation gradient `F`.
    pub deformation_gradient: Mat<f64, 3>,
    /// First Piola-Kirchhoff stress `P = d Psi / dF` [Pa].
    pub first_piola: Mat<f64, 3>,
}

impl ElementState {
    /// `J = det F`, the ratio of volumes.
    pub fn j(&self) -> f64 {
        self.deformation_gradient.determinant()
    }

    /// Principal stretches, descending in magnitude; the last is negative where the element is inverted.
    pub fn principal_stretches(&self) -> [f64; 3] {
        signed_svd(&self.deformation_gradient).sigma
    }

    /// Green strain `E = 1/2 (F^T F - I)`.
    pub fn green_strain(&self) -> Mat<f64, 3> {
        let f = &self.deformation_gradient;
        (f.transpose_mul(f) - Mat::identity()).scale(0.5)
    }

    /// Corotated strain `S - I`, with `F = R S` the signed polar decomposition.
    pub fn corotated_strain(&self) -> Mat<f64, 3> {
        let svd = signed_svd(&self.deformation_gradient);
        svd.v.mul(&Mat::diagonal(&svd.sigma)).mul_transpose(&svd.v) - Mat::identity()
    }

    /// Cauchy stress `sigma = P F^T / J` [Pa]; not finite where `J = 0`.
    pub fn cauchy_stress(&self) -> Mat<f64, 3> {
        self.first_piola.mul_transpose(&self.deformation_gradient).scale(1.0 / self.j())
    }

    /// Von Mises stress `sqrt(3/2 s : s)` [Pa], `s` the deviator of the Cauchy stress.
    pub fn von_mises_stress(&self) -> f64 {
        let sigma = self.cauchy_stress().symmetric();
        let deviator = sigma - Mat::scalar(sigma.trace() / 3.0);
        (1.5 * deviator.norm_squared()).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::UnstableStep;
    use crate::scene::Scene;

    /// The states of a bar of two cells, nu = 0.3, E = 1 MPa, under `x = matrix X + (0.5, 0.2[, 0.1])`.
    fn deformed(matrix: &[&[f64]], material: &str) -> Vec<ElementState> {
        let d = matrix.len();
        let shift = &[0.5, 0.2, 0.1][..d];
        let cells = &[2, 1, 1][..d];
        let text = format!(
            "dimension = {d}\ntime = {{ integrator = 'symplectic-euler', step = 1e-6, duration = 1.0 }}\n[[body]]\n\
             mesh = {{ grid = {{ cells = {cells:?}, spacing = 0.5 }} }}\nmass = {{ density = 1000.0 }}\n\
             elastic = {{ {material} = {{ young = 1e6, poisson = 0.3 }} }}\n\
             position = {{ affine = {{ matrix = {matrix:?}, translation = {shift:?} }} }}\n"
        );
        let scene = Scene::from_toml(&text).unwrap();
        let assembly = scene.assemble(UnstableStep::Accept).ok().unwrap();
        let states = assembly.simulation.element_states();
        assert_eq!(states.len(), if d == 2 { 4 } else { 12 });
        states
    }

    fn assert_close(a: &Mat<f64, 3>, b: [[f64; 3]; 3], scale: f64) {
        assert!((*a - Mat(b)).norm_squared().sqrt() < 1e-12 * scale, "{a:?} is not {b:?}");
    }

    const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    // lecture 13: translation gives F = I, rotation F = R, and neither strain nor stress.
    #[test]
    fn rigid_motion_gives_the_rotation_and_no_strain() {
        let turn: [&[f64]; 3] = [&[0.6, -0.8, 0.0], &[0.8, 0.6, 0.0], &[0.0, 0.0, 1.0]];
        for state in deformed(&turn, "corotated") {
            assert_close(
                &state.deformation_gradient,
                [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]],
                1.0,
            );
            assert_close(&state.green_strain(), [[0.0; 3]; 3], 1.0);
            assert_close(&state.corotated_strain(), [[0.0; 3]; 3], 1.0);
            assert!(state.von_mises_stress() < 1e-6);
        }
        for state in deformed(&[&[1.0, 0.0], &[0.0, 1.0]], "stvk") {
            assert_close(&state.deformation_gradient, IDENTITY, 1.0);
        }
    }

    // lecture 13, 15 and 16: a stretch of 1.2 along x, by hand.
    #[test]
    fn a_stretch_gives_the_strains_and_stresses_of_the_book() {
        let (mu, lambda) = (1e6 / 2.6, 0.3e6 / (1.3 * 0.4));
        for state in deformed(&[&[1.2, 0.0], &[0.0, 1.0]], "corotated") {
            assert!((state.j() - 1.2).abs() < 1e-12);
            assert!((state.principal_stretches()[0] - 1.2).abs() < 1e-12);
            assert_close(&state.green_strain(), [[0.22, 0.0, 0.0], [0.0; 3], [0.0; 3]], 1.0);
            assert_close(&state.corotated_strain(), [[0.2, 0.0, 0.0], [0.0; 3], [0.0; 3]], 1.0);
            let (along, across) = (2.0 * mu * 0.2 + lambda * 0.2, lambda * 0.2);
            let expected = [[along, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]];
            assert_close(&state.first_piola, expected, 1e6);
            // sigma_11 = P_11 * 1.2 / 1.2, the others P / 1.2.
            let von_mises = (along - across / 1.2).abs();
            assert!((state.von_mises_stress() - von_mises).abs() < 1e-6);
        }
    }
}
