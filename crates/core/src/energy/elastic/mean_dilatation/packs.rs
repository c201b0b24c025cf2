//! Rest data of cells at their quadrature points.
//!
//! In bending `u = xi_k xi_l e_k` a multilinear cell has a shear `du_k/dxi_l = xi_k` that the body has
//! not, the larger the longer the cell is along `k`: with two cells through a beam, four times longer
//! than thick, it is 2.4 times too stiff. So the slope along `l` is taken at points drawn to the middle,
//! at `c_lk xi_k` in place of `xi_k` with `c_lk = min(1, h_l / h_k)`, `h` the lengths of the cell: no
//! cell shears more in bending than a cube. Borrvall 2009, "A heuristic attempt to reduce transverse
//! shear locking in fully integrated hexahedra with poor aspect ratio", 7th European LS-DYNA Conference.
//! With `b'` the gradients that these slopes give, and means by the weights,
//!
//! ```text
//! b_q = b'_q - mean(b') + mean(grad N),   F_q = sum_a x_a b_qa^T
//! ```
//!
//! so that linear fields have their gradient and constant stresses their forces: the patch test is passed.
//! Cells of equal lengths have `b = grad N`, and so has a cell so distorted that its `J` of these slopes
//! is not positive.

use crate::algebra::Mat;
use crate::element::Isoparametric;
use crate::energy::elastic::points_of;
use crate::energy::patch::Patches;
use crate::lanes::{Lanes, WIDTH};

use super::shape::number::RestNumber;

/// One quadrature point of a pack of cells.
#[derive(Clone)]
#[repr(align(64))]
pub(crate) struct PointPack<const D: usize, const N: usize> {
    /// `b` of every node [1/m].
    gradient: [[[f64; WIDTH]; D]; N],
    /// Part of the volume that the point stands for.
    part: [f64; WIDTH],
}

impl<const D: usize, const N: usize> PointPack<D, N> {
    const EMPTY: Self = PointPack { gradient: [[[0.0; WIDTH]; D]; N], part: [0.0; WIDTH] };

    /// One component of the gradient of one node.
    #[inline(always)]
    pub(crate) fn gradient<L: Lanes>(&self, node: usize, component: usize) -> L {
        L::load(&self.gradient[node][component])
    }

    /// Part of the volume.
    #[inline(always)]
    pub(crate) fn part<L: Lanes>(&self) -> L {
        L::load(&self.part)
    }

    /// Gradients and part of one lane.
    pub(crate) fn lane(&self, lane: usize) -> ([[f64; D]; N], f64) {
        (self.gradient.map(|components| components.map(|lanes| lanes[lane])), self.part[lane])
    }

    fn set(&mut self, lane: usize, gradient: &[[f64; D]; N], part: f64) {
        for (components, gradient) in self.gradient.iter_mut().zip(gradient) {
            components.iter_mut().zip(gradient).for_each(|(lanes, g)| lanes[lane] = *g);
        }
        self.part[lane] = part;
    }
}

/// Rest data of packs of cells.
pub(crate) struct CellPacks<const D: usize, const N: usize> {
    points: usize,
    /// Every pack at its quadrature points, one after the other.
    rest: Vec<PointPack<D, N>>,
    /// Rest areas [m^2] or volumes [m^3]; zero in lanes without a cell of their own.
    pub(crate) volume: Vec<[f64; WIDTH]>,
}

impl<const D: usize, const N: usize> CellPacks<D, N> {
    /// Packs of these cells of `body` at rest at `rest` (flat, all vertices of the system) [m].
    ///
    /// # Panics
    /// If `det J` is not positive at a quadrature point: meshes are checked before.
    pub(crate) fn new(body: &str, cell: &Isoparametric<D, N>, patches: &Patches<N>, rest: &[f64]) -> Self {
        let points = cell.points.len();
        let mut packs = CellPacks {
            points,
            rest: vec![PointPack::EMPTY; patches.index.len() * points],
            volume: vec![[0.0; WIDTH]; patches.index.len()],
        };
        for (element, vertices, pack, lane) in patches.stencils() {
            let nodes = points_of(rest, &vertices);
            let RestGradients { points: of_points, volume } = gradients(cell, &nodes);
            packs.volume[pack][lane] = volume;
            for ((gradient, part), point) in of_points.into_iter().zip(&mut packs.rest[pack * points..]) {
                assert!(part > 0.0, "element {element} of {body} has a point of volume {part}");
                point.set(lane, &gradient, part);
            }
        }
        for (packs, stencils) in packs.rest.chunks_exact_mut(points).zip(&patches.stencil) {
            let used = stencils.iter().flatten().count();
            for point in packs {
                // Lanes that fill up are those of a real cell, parts of the volume included.
                let (gradient, part) = point.lane(used.saturating_sub(1));
                (used..WIDTH).for_each(|lane| point.set(lane, &gradient, part));
            }
        }
        packs
    }

    /// Turns a cell into axes of its own, from which `rotation` leads to those of space: `R^T b`.
    pub(super) fn turn(&mut self, pack: usize, lane: usize, rotation: &Mat<f64, D>) {
        let turned = rotation.transpose();
        for point in &mut self.rest[pack * self.points..][..self.points] {
            let (gradient, part) = point.lane(lane);
            point.set(lane, &gradient.map(|b| turned.mul_vec(&b)), part);
        }
    }

    /// Rest data of a pack at its quadrature points.
    #[inline(always)]
    pub(crate) fn rest(&self, pack: usize) -> &[PointPack<D, N>] {
        &self.rest[pack * self.points..][..self.points]
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.rest[..]) + size_of_val(&self.volume[..])
    }
}

/// Gradients of the nodes of a cell at a quadrature point, and the part of the volume that it stands for.
pub(super) type RestPoint<S, const D: usize, const N: usize> = ([[S; D]; N], S);

/// Rest data of a cell at its quadrature points.
pub(super) struct RestGradients<S, const D: usize, const N: usize> {
    pub(super) points: Vec<RestPoint<S, D, N>>,
    /// Area [m^2] or volume [m^3].
    pub(super) volume: S,
}

/// `b` at the quadrature points of a cell, and their parts of its volume.
pub(super) fn gradients<S: RestNumber, const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    nodes: &[[S; D]; N],
) -> RestGradients<S, D, N> {
    let lengths = lengths_to_draw(cell, nodes);
    let RestGradients { points: exact, volume } = exact_gradients(cell, nodes);
    let mut mean = [[S::zero(); D]; N];
    let mut points = vec![];
    for ((xi, _), (exact, part)) in cell.points.iter().zip(exact) {
        let drawn = physical(nodes, &drawn_slopes(cell, xi, &lengths));
        for ((mean, exact), drawn) in
            mean.as_flattened_mut().iter_mut().zip(exact.as_flattened()).zip(drawn.as_flattened())
        {
            *mean += part * (*exact - *drawn);
        }
        points.push((drawn, part));
    }
    for (gradient, _) in &mut points {
        let entries = gradient.as_flattened_mut().iter_mut();
        entries.zip(mean.as_flattened()).for_each(|(entry, mean)| *entry += *mean);
    }
    RestGradients { points, volume }
}

/// Lengths by which slopes are drawn: those of the cell, equal ones where it folds then.
pub(super) fn lengths_to_draw<S: RestNumber, const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    nodes: &[[S; D]; N],
) -> [S; D] {
    let lengths = lengths(cell, nodes);
    let is_folded = |(xi, _): &([f64; D], f64)| {
        let j = jacobian(nodes, &drawn_slopes(cell, xi, &lengths));
        j.determinant().value() <= 0.0
    };
    if cell.points.iter().any(is_folded) { [S::one(); D] } else { lengths }
}

/// Gradients of the shape functions at the quadrature points of a cell, and their parts of its volume.
pub(super) fn exact_gradients<S: RestNumber, const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    nodes: &[[S; D]; N],
) -> RestGradients<S, D, N> {
    let slopes_at = |xi: &[f64; D]| (cell.slopes)(xi).map(|slope| slope.map(S::splat));
    let mut volume = S::zero();
    let mut points = vec![];
    for (xi, weight) in cell.points {
        let slopes = slopes_at(xi);
        let part = S::splat(*weight) * jacobian(nodes, &slopes).determinant();
        volume += part;
        points.push((physical(nodes, &slopes), part));
    }
    points.iter_mut().for_each(|(_, part)| *part = *part / volume);
    RestGradients { points, volume }
}

/// Lengths of a cell along its axes, twice the lengths of the columns of `J` in its middle [m].
pub(super) fn lengths<S: RestNumber, const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    nodes: &[[S; D]; N],
) -> [S; D] {
    let j = middle(cell, nodes);
    let mut lengths = [S::zero(); D];
    for (k, length) in lengths.iter_mut().enumerate() {
        let mut square = S::zero();
        (0..D).for_each(|i| square += j[i][k] * j[i][k]);
        *length = S::splat(2.0) * square.sqrt();
    }
    lengths
}

/// `J` in the middle of a cell [m].
pub(super) fn middle<S: RestNumber, const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    nodes: &[[S; D]; N],
) -> Mat<S, D> {
    jacobian(nodes, &(cell.slopes)(&[0.0; D]).map(|slope| slope.map(S::splat)))
}

/// Slopes of the shape functions, each at its own point.
pub(super) fn drawn_slopes<S: RestNumber, const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    xi: &[f64; D],
    lengths: &[S; D],
) -> [[S; D]; N] {
    let mut slopes = [[S::zero(); D]; N];
    for l in 0..D {
        let mut at = xi.map(S::splat);
        (0..D).for_each(|k| at[k] *= (lengths[l] / lengths[k]).at_most_one());
        for (slope, of_node) in slopes.iter_mut().zip(S::slopes(cell, &at)) {
            slope[l] = of_node[l];
        }
    }
    slopes
}

/// Gradients `J^-T s` from slopes `s` by the coordinates of the cell, `J = sum_a X_a s_a^T`.
pub(super) fn physical<S: RestNumber, const D: usize, const N: usize>(
    nodes: &[[S; D]; N],
    slopes: &[[S; D]; N],
) -> [[S; D]; N] {
    let transposed = jacobian(nodes, slopes).inverse().transpose();
    slopes.map(|slope| transposed.mul_vec(&slope))
}

/// `J = sum_a X_a s_a^T`.
pub(super) fn jacobian<S: RestNumber, const D: usize, const N: usize>(
    nodes: &[[S; D]; N],
    slopes: &[[S; D]; N],
) -> Mat<S, D> {
    let mut j = Mat::zero();
    for (node, slope) in nodes.iter().zip(slopes) {
        for r in 0..D {
            (0..D).for_each(|c| j[r][c] += (node[r] - nodes[0][r]) * slope[c]);
        }
    }
    j
}
