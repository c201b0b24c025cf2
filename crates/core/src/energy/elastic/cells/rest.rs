//! Reference data of cells: mean gradients, weights of the hourglass modes, inverse Jacobian at the
//! centre.
//!
//! ```text
//! b_a = (integral of grad N_a) / V,   gamma_h = (h - sum_a b_a . t_h) / N,   t_h = sum_a h_a X_a
//! F = sum_a x_a b_a^T,   q_h = sum_a gamma_ha x_a
//! ```
//!
//! with the modes `h` at the corners: `xi_k xi_l` of each pair of axes, in 3D also `xi_0 xi_1 xi_2`.
//! `gamma_h` is zero on every linear field: Flanagan, Belytschko 1981, "A uniform strain hexahedron and
//! quadrilateral with orthogonal hourglass control", Int. J. Numer. Meth. Eng. 17, 679, equations 44 to 51.

use crate::algebra::Mat;
use crate::element::Isoparametric;
use crate::scalar::Scalar;

/// Maximum number of hourglass modes of a cell.
pub(crate) const MOST_MODES: usize = 4;

/// Amplitude `q_h` of every hourglass mode.
pub(crate) type Amplitudes<S, const D: usize> = [[S; D]; MOST_MODES];

/// Number of hourglass modes of a cell in `d` dimensions.
#[inline(always)]
pub(crate) const fn modes(d: usize) -> usize {
    if d == 2 { 1 } else { MOST_MODES }
}

/// Index of the mode `xi_k xi_l`.
#[inline(always)]
pub(super) const fn mode_of_pair(k: usize, l: usize) -> usize {
    k + l - 1
}

/// Axes of each mode.
const AXES: [&[usize]; MOST_MODES] = [&[0, 1], &[0, 2], &[1, 2], &[0, 1, 2]];

/// Reference data of a cell from which its deformation is computed.
pub(crate) trait RestData<S: Scalar, const D: usize, const N: usize> {
    /// Returns the reference area [m^2] or volume [m^3]; zero in padding lanes.
    fn volume(&self) -> S;
    /// Returns one component of `b` of one node [1/m].
    fn gradient(&self, node: usize, component: usize) -> S;
    /// Returns `gamma` of one mode and node.
    fn weight(&self, mode: usize, node: usize) -> S;

    /// Returns `F` and `q` of positions, or the same sums of another field of the nodes.
    #[inline(always)]
    fn measure(&self, x: &[[S; D]; N]) -> (Mat<S, D>, Amplitudes<S, D>) {
        let (mut f, mut q) = (Mat::zero(), [[S::zero(); D]; MOST_MODES]);
        for a in 1..N {
            for i in 0..D {
                // Relative to the first node: positions far from the origin lose no digits.
                let from_first = x[a][i] - x[0][i];
                for k in 0..D {
                    f[i][k] = from_first.mul_add(self.gradient(a, k), f[i][k]);
                }
                for h in 0..modes(D) {
                    q[h][i] = from_first.mul_add(self.weight(h, a), q[h][i]);
                }
            }
        }
        (f, q)
    }

    /// Returns `T b_a + sum_h gamma_ha y_h` at every node: the transpose.
    #[inline(always)]
    fn spread(&self, by_f: &Mat<S, D>, by_q: &Amplitudes<S, D>) -> [[S; D]; N] {
        let mut nodes = [[S::zero(); D]; N];
        for a in 1..N {
            for i in 0..D {
                let mut sum = by_f[i][0] * self.gradient(a, 0);
                for k in 1..D {
                    sum = by_f[i][k].mul_add(self.gradient(a, k), sum);
                }
                for h in 0..modes(D) {
                    sum = by_q[h][i].mul_add(self.weight(h, a), sum);
                }
                nodes[a][i] = sum;
                // Gradients and weights of all nodes add up to zero.
                nodes[0][i] -= sum;
            }
        }
        nodes
    }
}

/// Reference data of one cell, of a pack, or of a cell with their change along a direction.
///
/// The struct also holds the derivatives of a function with respect to each of these numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellRest<S, const D: usize, const N: usize> {
    /// Area [m^2] or volume [m^3].
    pub(crate) volume: S,
    /// `b` of every node [1/m].
    pub(crate) gradient: [[S; D]; N],
    /// `gamma` of every mode.
    pub(crate) weight: [[S; N]; MOST_MODES],
    /// `J^-1` at the centre, with the gradients `g_k` of the cell's coordinates as its rows [1/m].
    pub(crate) inverse: Mat<S, D>,
}

impl<S: Scalar, const D: usize, const N: usize> RestData<S, D, N> for CellRest<S, D, N> {
    #[inline(always)]
    fn volume(&self) -> S {
        self.volume
    }

    #[inline(always)]
    fn gradient(&self, node: usize, component: usize) -> S {
        self.gradient[node][component]
    }

    #[inline(always)]
    fn weight(&self, mode: usize, node: usize) -> S {
        self.weight[mode][node]
    }
}

impl<S: Scalar, const D: usize, const N: usize> CellRest<S, D, N> {
    /// Returns the reference data of the cell with these nodes [m].
    pub(crate) fn new(cell: &Isoparametric<D, N>, nodes: &[[S; D]; N]) -> Self {
        // V and the integrals of the gradients, by quadrature.
        let mut volume = S::zero();
        let mut gradient = [[S::zero(); D]; N];
        for (xi, part) in cell.points {
            let slopes = (cell.slopes)(xi);
            let j = jacobian(nodes, &slopes);
            let cofactor = j.cofactor();
            volume += S::splat(*part) * j.determinant_with(&cofactor);
            for a in 0..N {
                let of_point = cofactor.mul_vec(&slopes[a].map(|slope| S::splat(part * slope)));
                for i in 0..D {
                    gradient[a][i] += of_point[i];
                }
            }
        }
        // b_a.
        for of_node in &mut gradient {
            for entry in of_node {
                *entry = *entry / volume;
            }
        }
        // gamma_h.
        let mut weight = [[S::zero(); N]; MOST_MODES];
        for (h, weight) in weight.iter_mut().enumerate().take(modes(D)) {
            let (signs, along) = (signs(cell, h), mode_of_rest(cell, h, nodes));
            for a in 0..N {
                let mut sum = S::splat(signs[a]);
                for i in 0..D {
                    sum -= gradient[a][i] * along[i];
                }
                weight[a] = sum * S::splat(1.0 / N as f64);
            }
        }
        // J^-1 at the centre.
        let inverse = jacobian(nodes, &(cell.slopes)(&[0.0; D])).inverse();
        CellRest { volume, gradient, weight, inverse }
    }

    /// Returns the same cell in axes from which `rotation` leads to those of space.
    pub(super) fn turned(mut self, rotation: &Mat<S, D>) -> Self {
        let back = rotation.transpose();
        for of_node in &mut self.gradient {
            *of_node = back.mul_vec(of_node);
        }
        self.inverse = self.inverse.mul(rotation);
        self
    }

    /// Adds the derivatives by gradients and weights of a function of `F` and `q` of the field `x`.
    pub(super) fn add_rates(&mut self, x: &[[S; D]; N], by_f: &Mat<S, D>, by_q: &Amplitudes<S, D>) {
        for a in 1..N {
            let mut from_first = x[a];
            for i in 0..D {
                from_first[i] -= x[0][i];
            }
            let row = by_f.transpose().mul_vec(&from_first);
            for i in 0..D {
                self.gradient[a][i] += row[i];
                for h in 0..modes(D) {
                    self.weight[h][a] += by_q[h][i] * from_first[i];
                }
            }
        }
    }

    /// Returns zeros.
    pub(super) fn zero() -> Self {
        CellRest {
            volume: S::zero(),
            gradient: [[S::zero(); D]; N],
            weight: [[S::zero(); N]; MOST_MODES],
            inverse: Mat::zero(),
        }
    }
}

impl<const D: usize, const N: usize> CellRest<f64, D, N> {
    /// Returns the same numbers as constants of another scalar.
    pub(super) fn splat<S: Scalar>(&self) -> CellRest<S, D, N> {
        CellRest {
            volume: S::splat(self.volume),
            gradient: self.gradient.map(|row| row.map(S::splat)),
            weight: self.weight.map(|row| row.map(S::splat)),
            inverse: Mat::splat(&self.inverse),
        }
    }

    /// Returns the derivatives by the reference nodes of a function with these derivatives by the
    /// reference data.
    pub(super) fn by_nodes(&self, cell: &Isoparametric<D, N>, nodes: &[[f64; D]; N]) -> [[f64; D]; N] {
        let rest = CellRest::new(cell, nodes);
        let (mut rows, mut by_gradient) = ([[0.0; D]; N], self.gradient);
        // Through gamma_h, to b and to t_h.
        for (h, weight) in self.weight.iter().enumerate().take(modes(D)) {
            let (signs, along) = (signs(cell, h), mode_of_rest(cell, h, nodes));
            let mut by_along = [0.0; D];
            for a in 0..N {
                for i in 0..D {
                    by_gradient[a][i] -= weight[a] * along[i] / N as f64;
                    by_along[i] -= weight[a] * rest.gradient[a][i] / N as f64;
                }
            }
            rows.iter_mut().zip(signs).for_each(|(row, sign)| add(row, sign, &by_along));
        }
        // `b = B / V`, `B_a = sum_q w cof J s_a`, `V = sum_q w det J`.
        let mut by_volume = self.volume;
        for (by, b) in by_gradient.as_flattened_mut().iter_mut().zip(rest.gradient.as_flattened()) {
            by_volume -= *by * b / rest.volume;
            *by /= rest.volume;
        }
        // Through B and V at each quadrature point, to J.
        for (xi, part) in cell.points {
            let slopes = (cell.slopes)(xi);
            let j = jacobian(nodes, &slopes);
            let by_cofactor = outer_sum(&by_gradient, &slopes);
            let by_j = (j.cofactor().scale(by_volume) + j.cofactor_derivative(&by_cofactor)).scale(*part);
            rows.iter_mut().zip(&slopes).for_each(|(row, slope)| add(row, 1.0, &by_j.mul_vec(slope)));
        }
        // Through J^-1 at the centre.
        let transposed = rest.inverse.transpose();
        let by_middle = transposed.mul(&self.inverse).mul(&transposed);
        let slopes = (cell.slopes)(&[0.0; D]);
        rows.iter_mut().zip(&slopes).for_each(|(row, slope)| add(row, -1.0, &by_middle.mul_vec(slope)));
        rows
    }
}

fn add<const D: usize>(sum: &mut [f64; D], factor: f64, v: &[f64; D]) {
    sum.iter_mut().zip(v).for_each(|(sum, v)| *sum += factor * v);
}

/// Returns mode `h` at the corners.
fn signs<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, h: usize) -> [f64; N] {
    cell.nodes.map(|node| AXES[h].iter().map(|k| node[*k]).product())
}

/// Returns `t_h` of nodes.
fn mode_of_rest<S: Scalar, const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    h: usize,
    nodes: &[[S; D]; N],
) -> [S; D] {
    let mut along = [S::zero(); D];
    for (sign, node) in signs(cell, h).into_iter().zip(nodes) {
        for i in 0..D {
            along[i] += S::splat(sign) * (node[i] - nodes[0][i]);
        }
    }
    along
}

/// Returns `J = sum_a X_a s_a^T`.
fn jacobian<S: Scalar, const D: usize, const N: usize>(
    nodes: &[[S; D]; N],
    slopes: &[[f64; D]; N],
) -> Mat<S, D> {
    let mut j = Mat::zero();
    for a in 1..N {
        for i in 0..D {
            let from_first = nodes[a][i] - nodes[0][i];
            for k in 0..D {
                j[i][k] = from_first.mul_add(S::splat(slopes[a][k]), j[i][k]);
            }
        }
    }
    j
}

/// Returns `sum_a u_a v_a^T`.
#[inline(always)]
pub(crate) fn outer_sum<S: Scalar, const D: usize, const M: usize>(
    u: &[[S; D]; M],
    v: &[[S; D]; M],
) -> Mat<S, D> {
    let mut sum = Mat::zero();
    for a in 0..M {
        for i in 0..D {
            for k in 0..D {
                sum[i][k] = u[a][i].mul_add(v[a][k], sum[i][k]);
            }
        }
    }
    sum
}
