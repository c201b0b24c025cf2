//! The linear simplex: triangle in 2D, tetrahedron in 3D.
//!
//! With `D_s = [x_1 - x_0, ..., x_D - x_0]` and `D_m` the same in the reference configuration,
//! `F = D_s D_m^-1` is constant in the element. The energy is `w Psi(F)`, with the reference area or
//! volume `w`. With `H = w P D_m^-T` the gradient at vertex `a + 1` is column `a` of `H`, at vertex 0
//! minus their sum. Source: lecture 18 and 19; Sifakis, Barbic 2012, *FEM Simulation of 3D Deformable
//! Solids*, section 4.1, with the reference vertex first instead of last.

use super::tangents::edges;
use crate::algebra::Mat;
use crate::lanes::{Lanes, WIDTH};

/// Reference data of `WIDTH` simplices, laid out for vector loads.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct SimplexPack<const D: usize> {
    /// `D_m^-1`, `inverse_rest[row][column][lane]` [1/m].
    inverse_rest: [[[f64; WIDTH]; D]; D],
    /// Reference area [m^2] or volume [m^3]; zero in unused lanes.
    weight: [f64; WIDTH],
}

/// Returns `D_m^-1` and the signed reference area or volume of the simplex with these vertices.
pub fn simplex_rest<const D: usize, const N: usize>(points: &[[f64; D]; N]) -> (Mat<f64, D>, f64) {
    let rest = Mat(edges(points));
    let factorial = if D == 2 { 2.0 } else { 6.0 };
    (rest.inverse(), rest.determinant() / factorial)
}

impl<const D: usize> SimplexPack<D> {
    /// Creates a pack of empty lanes.
    pub fn new() -> Self {
        SimplexPack { inverse_rest: [[[0.0; WIDTH]; D]; D], weight: [0.0; WIDTH] }
    }

    /// Sets the element of one lane; unused lanes have zero `weight`.
    pub fn set(&mut self, lane: usize, inverse_rest: &Mat<f64, D>, weight: f64) {
        for i in 0..D {
            for j in 0..D {
                self.inverse_rest[i][j][lane] = inverse_rest[i][j];
            }
        }
        self.weight[lane] = weight;
    }

    /// Multiplies the weight of one lane by `factor`.
    pub fn scale_weight(&mut self, lane: usize, factor: f64) {
        self.weight[lane] *= factor;
    }

    /// Rotates the element of one lane before the deformation: `F R` in place of `F`.
    pub fn turn(&mut self, lane: usize, rotation: &Mat<f64, D>) {
        let (inverse_rest, weight) = self.lane(lane);
        self.set(lane, &inverse_rest.mul(rotation), weight);
    }

    /// Repeats the last element with weight zero in all lanes from `used` on: their `J` is that of a real
    /// element.
    pub fn fill_up(&mut self, used: usize) {
        let Some(last) = used.checked_sub(1) else { return };
        let (inverse_rest, _) = self.lane(last);
        for lane in used..WIDTH {
            self.set(lane, &inverse_rest, 0.0);
        }
    }

    /// Returns `D_m^-1` of every lane.
    #[inline(always)]
    pub fn inverse_rest<L: Lanes>(&self) -> Mat<L, D> {
        let mut m = Mat::zero();
        for i in 0..D {
            for j in 0..D {
                m[i][j] = L::load(&self.inverse_rest[i][j]);
            }
        }
        m
    }

    /// Returns the reference area or volume of every lane.
    #[inline(always)]
    pub fn weight<L: Lanes>(&self) -> L {
        L::load(&self.weight)
    }

    /// Returns `D_m^-1` and weight of one lane.
    pub fn lane(&self, lane: usize) -> (Mat<f64, D>, f64) {
        let mut m = Mat::zero();
        for i in 0..D {
            for j in 0..D {
                m[i][j] = self.inverse_rest[i][j][lane];
            }
        }
        (m, self.weight[lane])
    }
}

impl<const D: usize> Default for SimplexPack<D> {
    fn default() -> Self {
        Self::new()
    }
}
