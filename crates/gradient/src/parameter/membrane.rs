//! Poisson's ratio of membranes.
//!
//! A triangle in 3D of volume `w` maps its reference plane by `F = Q G`, `G` two by two in its own plane.
//! The solid stretches by `s` across it: 1 in plane strain; in plane stress `P_33(G, s) = 0`. With `H`
//! formed from `p` as `F` is from the positions, `p . dE/dx = w P : Q^T H`. If the solid's stress changes
//! by `P'`, `P` changes by `P' + s' dP/ds`, `s' = -P'_33 / (dP_33/ds)`, which is 0 in plane strain.

use pliant::algebra::Mat;
use pliant::element::simplex_rest;
use pliant::energy::elastic::{flattened, points_of};
use pliant::material::MaterialSpec;

use super::elements::{ElementEnergy, Maker};
use super::{ForceUse, Parameter};

/// Triangles of a membrane with their reference geometry and material.
#[derive(Clone, Copy, Debug)]
pub struct MembraneElements<'a> {
    /// Vertices of the triangles, by index in the simulation, flat.
    pub cells: &'a [u32],
    /// Reference positions of all vertices of the simulation, flat [m].
    pub rest: &'a [f64],
    /// Reference thickness [m].
    pub thickness: f64,
    /// True in plane stress, false in plane strain.
    pub frees_faces: bool,
    /// Material of the membrane.
    pub material: &'a MaterialSpec,
}

impl MembraneElements<'_> {
    /// Parameter by which the energy density of the solid has the derivative `sum c_i psi_i`, factors
    /// first: see [`Modulus`](super::Modulus).
    pub fn modulus(&self, parts: &[(f64, MaterialSpec)]) -> Box<dyn Parameter> {
        let triangles = self.cells.as_chunks::<3>().0.to_vec();
        let rest = triangles.iter().map(|triangle| {
            let (inverse, area) = simplex_rest(&flattened(&points_of(self.rest, triangle)).0);
            (inverse, self.thickness * area)
        });
        let energy = |material: &MaterialSpec| material.visit::<3, _>(Maker);
        Box::new(MembraneModulus {
            rest: rest.collect(),
            triangles,
            frees_faces: self.frees_faces,
            solid: energy(self.material),
            parts: parts.iter().map(|(factor, material)| (*factor, energy(material))).collect(),
        })
    }
}

struct MembraneModulus {
    triangles: Vec<[u32; 3]>,
    /// Inverse edges in the reference plane, and `w`.
    rest: Vec<(Mat<f64, 2>, f64)>,
    frees_faces: bool,
    solid: Box<dyn ElementEnergy<3>>,
    parts: Vec<(f64, Box<dyn ElementEnergy<3>>)>,
}

/// Relative change of the thickness stretch below which one more Newton step is exact to rounding.
const CLOSE: f64 = 1e-8;
/// Limit on the Newton steps.
const MOST_STEPS: usize = 60;

/// `e_3 e_3^T`.
fn across() -> Mat<f64, 3> {
    Mat([[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]])
}

impl MembraneModulus {
    /// Deformation gradient of the solid with `G` in its first two axes.
    fn in_space(&self, g: &Mat<f64, 2>) -> Mat<f64, 3> {
        let mut f = across();
        (0..2).for_each(|i| f[i][..2].copy_from_slice(&g[i]));
        if !self.frees_faces {
            return f;
        }
        let mut is_close = false;
        for _ in 0..MOST_STEPS {
            let (p, k) = (self.solid.stress(&f)[2][2], self.solid.stress_along(&f, &across())[2][2]);
            // If the energy is not convex, step downhill; never through zero, and not too far at once.
            let step = if k > 0.0 { -p / k } else { -p.signum() * f[2][2] };
            let last = is_close;
            is_close = k > 0.0 && step.abs() <= CLOSE * f[2][2];
            f[2][2] = (f[2][2] + step).clamp(0.5 * f[2][2], 2.0 * f[2][2]);
            if last {
                break;
            }
        }
        f
    }

    /// Rows of `Q`, and the derivative of `P` of triangle `i` by the parameter.
    fn rate(&self, i: usize, x: &[f64]) -> ([[f64; 2]; 3], Mat<f64, 2>) {
        let (corners, axes) = flattened(&points_of(x, &self.triangles[i]));
        let edges = Mat([[corners[1][0], corners[2][0]], [corners[1][1], corners[2][1]]]);
        let f = self.in_space(&edges.mul(&self.rest[i].0));
        let mut rate =
            self.parts.iter().fold(Mat::zero(), |sum, (c, psi)| psi.stress(&f).scale_add(*c, &sum));
        if self.frees_faces {
            let by_stretch = self.solid.stress_along(&f, &across());
            rate = by_stretch.scale_add(-rate[2][2] / by_stretch[2][2], &rate);
        }
        (axes, rate.leading())
    }
}

impl Parameter for MembraneModulus {
    fn len(&self) -> usize {
        1
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (i, triangle) in self.triangles.iter().enumerate() {
            let ((axes, rate), (inverse, volume)) = (self.rate(i, of.x), &self.rest[i]);
            let by_edges = rate.mul_transpose(inverse).scale(-volume * change[0]);
            for (k, axes) in axes.iter().enumerate() {
                for a in 0..2 {
                    let along = axes[0] * by_edges[0][a] + axes[1] * by_edges[1][a];
                    force[triangle[a + 1] as usize * 3 + k] += along;
                    force[triangle[0] as usize * 3 + k] -= along;
                }
            }
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (i, triangle) in self.triangles.iter().enumerate() {
            let ((axes, rate), (inverse, volume)) = (self.rate(i, of.x), &self.rest[i]);
            let p: [[f64; 3]; 3] = points_of(of.p, triangle);
            let mut along = Mat::zero();
            for (r, a) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                along[r][a] = (0..3).map(|k| axes[k][r] * (p[a + 1][k] - p[0][k])).sum::<f64>();
            }
            derivative[0] -= volume * rate.dot(&along.mul(inverse));
        }
    }
}
