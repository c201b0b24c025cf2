//! Fibres at quadrature points, in packs for lanes.

use crate::element::shape_functions;
use crate::element::{Isoparametric, quadrature_count, quadrature_points, quadrature_position};
use crate::lanes::{Lanes, WIDTH};
use crate::material::Psd;

/// A fibre at a quadrature point of an element of `N` nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibrePoint<const N: usize> {
    /// Rest area [m^2] or volume [m^3] that the point stands for.
    pub weight: f64,
    /// `a . dN_i/dX` [1/m] of each node, with the unit direction `a` at rest.
    pub slopes: [f64; N],
    /// The point at rest [m]; third component 0 in 2D.
    pub place: [f64; 3],
}

/// The fibres of a simplex with these nodes at rest, at its quadrature points, along the unit vector that
/// `direction` gives for a place [m].
pub fn simplex_fibres<const D: usize, const N: usize>(
    rest: &[[f64; D]; N],
    direction: impl Fn([f64; 3]) -> [f64; D],
) -> Vec<FibrePoint<N>> {
    let lambda = (0..quadrature_count::<D, N>()).map(quadrature_position::<D, N>);
    let points = quadrature_points(rest).zip(lambda);
    let fibre = points.map(|(point, lambda)| {
        let place = place(rest, &shape_functions::<D, N>(&lambda));
        fibre(point.weight, &point.gradients, place, direction(place))
    });
    fibre.collect()
}

/// The fibres of a cell that is no simplex, as [`simplex_fibres`] has them.
pub fn cell_fibres<const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    rest: &[[f64; D]; N],
    direction: impl Fn([f64; 3]) -> [f64; D],
) -> Vec<FibrePoint<N>> {
    let fibre = cell.points.iter().map(|(xi, weight)| {
        let j = cell.jacobian(rest, xi);
        let inverse = j.inverse();
        let gradients = (cell.slopes)(xi).map(|slope| inverse.transpose().mul_vec(&slope));
        let place = place(rest, &(cell.shape)(xi));
        fibre(weight * j.determinant(), &gradients, place, direction(place))
    });
    fibre.collect()
}

/// `sum_a N_a X_a`.
fn place<const D: usize, const N: usize>(rest: &[[f64; D]; N], shape: &[f64; N]) -> [f64; 3] {
    let mut place = [0.0; 3];
    for (node, weight) in rest.iter().zip(shape) {
        (0..D).for_each(|c| place[c] += weight * node[c]);
    }
    place
}

fn fibre<const D: usize, const N: usize>(
    weight: f64,
    gradients: &[[f64; D]; N],
    place: [f64; 3],
    direction: [f64; D],
) -> FibrePoint<N> {
    let slope = |gradient: [f64; D]| gradient.iter().zip(&direction).map(|(g, a)| g * a).sum();
    FibrePoint { weight, slopes: gradients.map(slope), place }
}

/// The fibres at one quadrature point of `WIDTH` elements, laid out for vector loads.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct FibrePack<const N: usize> {
    slopes: [[f64; WIDTH]; N],
    /// Zero in lanes without an element of their own.
    weight: [f64; WIDTH],
    /// `w T` [J] at the time last said.
    pull: [f64; WIDTH],
}

impl<const N: usize> FibrePack<N> {
    pub(super) const EMPTY: Self =
        FibrePack { slopes: [[0.0; WIDTH]; N], weight: [0.0; WIDTH], pull: [0.0; WIDTH] };

    pub(super) fn set(&mut self, lane: usize, point: &FibrePoint<N>) {
        self.weight[lane] = point.weight;
        for (slopes, slope) in self.slopes.iter_mut().zip(&point.slopes) {
            slopes[lane] = *slope;
        }
    }

    /// Takes the tension [Pa] of every lane that has an element.
    pub(super) fn pull(&mut self, tension: impl Fn(usize) -> f64) {
        for lane in 0..WIDTH {
            let weight = self.weight[lane];
            self.pull[lane] = if weight == 0.0 { 0.0 } else { weight * tension(lane) };
        }
    }

    /// Weight and slopes of a lane.
    pub(super) fn fibre(&self, lane: usize) -> (f64, [f64; N]) {
        (self.weight[lane], self.slopes.map(|slopes| slopes[lane]))
    }

    /// `w T c_a c_b` of a lane.
    pub(super) fn stiffness(&self, lane: usize, a: usize, b: usize, psd: Psd) -> f64 {
        let pull = self.pull[lane];
        // A comparison, not a maximum: NaN is kept.
        let pull = if psd == Psd::Projected && pull < 0.0 { 0.0 } else { pull };
        pull * self.slopes[a][lane] * self.slopes[b][lane]
    }

    /// `sum_b |w (T - now) c_a c_b|` of every node of a lane; nothing where the tension `largest` [Pa] is
    /// there.
    pub(super) fn row_sums(&self, lane: usize, largest: f64) -> [f64; N] {
        let more = (self.weight[lane] * largest - self.pull[lane]).max(0.0);
        let sum: f64 = self.slopes.iter().map(|slopes| slopes[lane].abs()).sum();
        self.slopes.map(|slopes| more * slopes[lane].abs() * sum)
    }

    pub(super) fn is_finite(&self) -> bool {
        self.pull.iter().all(|pull| pull.is_finite())
    }

    /// Sum of `|w T|` [J].
    pub(super) fn strength(&self) -> f64 {
        self.pull.iter().map(|pull| pull.abs()).sum()
    }

    /// `F a = sum_i c_i (x_i - x_0)` of every lane.
    #[inline(always)]
    pub(super) fn image<L: Lanes, const D: usize>(&self, x: &[[L; D]; N]) -> [L; D] {
        let mut image = [L::zero(); D];
        for node in 1..N {
            let slope = L::load(&self.slopes[node]);
            for c in 0..D {
                image[c] = slope.mul_add(x[node][c] - x[0][c], image[c]);
            }
        }
        image
    }

    /// Adds `w T c_i F a` to the gradient at every node, at the first minus the sum of the others.
    #[inline(always)]
    pub(super) fn add_pull<L: Lanes, const D: usize>(&self, image: &[L; D], gradient: &mut [[L; D]; N]) {
        let pull = self.tension::<L>();
        for c in 0..D {
            let force = pull * image[c];
            for node in 1..N {
                let part = L::load(&self.slopes[node]) * force;
                gradient[node][c] += part;
                gradient[0][c] -= part;
            }
        }
    }

    /// `w T` [J] of every lane.
    #[inline(always)]
    pub(super) fn tension<L: Lanes>(&self) -> L {
        L::load(&self.pull)
    }
}
