//! Reference elements of all kinds behind one type: nodes, sides, shape functions, points.

use super::fit::Terms;
use crate::element::{
    Barycentric, CELL_KINDS, CellKind, CellVisitor, Isoparametric, TETRAHEDRON_EDGES, THREE, TRIANGLE_EDGES,
    TWO, interpolation, mass_rule, quadrature_position, reference_gradients, shape_functions,
};

/// Faces of a tetrahedron and edges of a triangle, by corners.
const TETRAHEDRON_FACES: [&[usize]; 4] = [&[1, 2, 3], &[0, 2, 3], &[0, 1, 3], &[0, 1, 2]];
const TRIANGLE_SIDES: [&[usize]; 3] = [&[0, 1], &[1, 2], &[2, 0]];

/// Reference element.
pub(super) struct RecoveryElement {
    /// Dimension of the element, which is 2 in a sheet in space.
    pub(super) dimension: usize,
    /// True for triangles in space.
    pub(super) is_sheet: bool,
    /// Order of the element, 1 or 2.
    pub(super) order: usize,
    /// Number of corners, which come first.
    pub(super) corners: usize,
    /// Positions of the nodes.
    pub(super) nodes: Vec<Barycentric>,
    /// Corners of each side.
    pub(super) sides: &'static [&'static [usize]],
    /// Kind; `None` for simplices.
    kind: Option<&'static CellKind>,
}

/// Values and slopes of the shape functions at a point.
pub(super) struct ShapeValues {
    /// Values, one a node.
    pub(super) values: Vec<f64>,
    /// Derivatives by the reference coordinates; unused ones are zero.
    pub(super) slopes: Vec<[f64; 3]>,
}

impl RecoveryElement {
    /// Creates the element with so many nodes in a space of this dimension; `None` if there is none.
    pub(super) fn new(space: usize, nodes: usize) -> Option<Self> {
        let is_kind = |kind: &&&CellKind| kind.dimension == space && kind.nodes == nodes;
        if let Some(kind) = CELL_KINDS.iter().find(is_kind).copied() {
            return Some(RecoveryElement {
                dimension: space,
                is_sheet: false,
                order: kind.order(),
                corners: kind.corners,
                nodes: kind.visit(CellNodes),
                sides: kind.sides,
                kind: Some(kind),
            });
        }
        let (dimension, order) = match (space, nodes) {
            (2 | 3, 3) => (2, 1),
            (2, 6) => (2, 2),
            (3, 4) => (3, 1),
            (3, 10) => (3, 2),
            _ => return None,
        };
        let corner = |i: usize| std::array::from_fn(|k| f64::from(u8::from(k == i)));
        let mut nodes: Vec<Barycentric> = (0..=dimension).map(corner).collect();
        if order == 2 {
            let edges: &[[usize; 2]] = if dimension == 2 { &TRIANGLE_EDGES } else { &TETRAHEDRON_EDGES };
            for [a, b] in edges {
                nodes.push(std::array::from_fn(|k| 0.5 * (nodes[*a][k] + nodes[*b][k])));
            }
        }
        let sides: &'static [&'static [usize]] =
            if dimension == 2 { &TRIANGLE_SIDES } else { &TETRAHEDRON_FACES };
        let is_sheet = dimension < space;
        Some(RecoveryElement { dimension, is_sheet, order, corners: dimension + 1, nodes, sides, kind: None })
    }

    /// Returns the points that the field of an element is fitted to.
    pub(super) fn element_points(&self) -> Vec<Barycentric> {
        match (self.kind, self.dimension, self.order) {
            (Some(_), ..) => self.product(&TWO).into_iter().map(|(at, _)| at).collect(),
            (None, dimension, 1) => vec![middle(dimension)],
            (None, 2, _) => (0..3).map(quadrature_position::<2, 6>).collect(),
            (None, ..) => (0..4).map(quadrature_position::<3, 10>).collect(),
        }
    }

    /// Returns the points that the field of a patch is fitted to.
    pub(super) fn patch_points(&self) -> Vec<Barycentric> {
        if self.kind.is_some() && self.order == 1 { vec![[0.0; 4]] } else { self.element_points() }
    }

    /// Returns the weights that give the value at a node from those at the
    /// [points](Self::element_points): constant or linear in simplices, multilinear in other cells. There
    /// are as many points as coefficients: the least squares are an interpolation.
    pub(super) fn extrapolation(&self, node: &Barycentric) -> Vec<f64> {
        let multilinear =
            |point: Barycentric| (0..self.dimension).map(|k| 0.5 * (1.0 + node[k] / point[k])).product();
        match (self.kind, self.dimension, self.order) {
            (Some(_), ..) => self.element_points().into_iter().map(multilinear).collect(),
            (None, _, 1) => vec![1.0],
            (None, 2, _) => interpolation::<2, 6>(node)[..3].to_vec(),
            (None, ..) => interpolation::<3, 10>(node)[..4].to_vec(),
        }
    }

    /// Returns points and weights, fractions of the reference element, of a rule that is exact for squares
    /// of functions with the nodes of the element where its sides are straight.
    pub(super) fn rule(&self) -> Vec<(Barycentric, f64)> {
        match (self.kind, self.dimension, self.order) {
            (Some(_), _, 1) => self.product(&TWO),
            (Some(_), ..) => self.product(&THREE),
            (None, 2, 1) => (0..3).map(|q| (quadrature_position::<2, 6>(q), 1.0 / 3.0)).collect(),
            (None, _, 1) => (0..4).map(|q| (quadrature_position::<3, 10>(q), 0.25)).collect(),
            (None, 2, _) => mass_rule::<2, 6>(),
            (None, ..) => mass_rule::<3, 10>(),
        }
    }

    /// Returns the volume of the reference element.
    pub(super) fn content(&self) -> f64 {
        match (self.kind, self.dimension) {
            (Some(_), dimension) => f64::from(1 << dimension),
            (None, 2) => 0.5,
            (None, _) => 1.0 / 6.0,
        }
    }

    /// Returns the polynomials that a patch may take, best first.
    pub(super) fn polynomials(&self) -> &'static [Terms] {
        match (self.kind, self.order) {
            (_, 1) => &[Terms::Complete(1), Terms::Complete(0)],
            (None, _) => &[Terms::Complete(2), Terms::Complete(1), Terms::Complete(0)],
            (Some(_), _) => &[Terms::MixedCubic, Terms::Complete(2), Terms::Complete(1), Terms::Complete(0)],
        }
    }

    /// Returns the corners of the edge, face or element in whose middle a node stands; a corner is its
    /// own.
    pub(super) fn parents(&self, node: usize) -> Vec<usize> {
        let at = self.nodes[node];
        let is_parent = |corner: &usize| match self.kind {
            None => at[*corner] > 0.0,
            Some(_) => (0..self.dimension).all(|k| at[k] == 0.0 || at[k] == self.nodes[*corner][k]),
        };
        (0..self.corners).filter(is_parent).collect()
    }

    /// Returns the shape functions at a point.
    pub(super) fn shape(&self, at: &Barycentric) -> ShapeValues {
        match (self.kind, self.dimension, self.order) {
            (Some(kind), ..) => kind.visit(ShapeAt(at)),
            (None, 2, 1) => of_simplex::<2, 3>(at),
            (None, 2, _) => of_simplex::<2, 6>(at),
            (None, _, 1) => of_simplex::<3, 4>(at),
            (None, ..) => of_simplex::<3, 10>(at),
        }
    }

    /// Returns the product of a rule on `[-1, 1]` in every direction of a cell, with weights of sum 1.
    fn product(&self, rule: &[(f64, f64)]) -> Vec<(Barycentric, f64)> {
        let mut points: Vec<(Barycentric, f64)> = vec![([0.0; 4], 1.0)];
        for k in 0..self.dimension {
            let with = |(at, weight): &(Barycentric, f64)| {
                let (at, weight) = (*at, *weight);
                rule.iter().map(move |(x, share)| {
                    let mut at = at;
                    at[k] = *x;
                    (at, weight * 0.5 * share)
                })
            };
            points = points.iter().flat_map(with).collect();
        }
        points
    }
}

/// Returns the centroid of a simplex.
fn middle(dimension: usize) -> Barycentric {
    std::array::from_fn(|k| if k <= dimension { 1.0 / (dimension + 1) as f64 } else { 0.0 })
}

fn of_simplex<const D: usize, const N: usize>(at: &Barycentric) -> ShapeValues {
    let slopes = reference_gradients::<D, N>(at).iter().map(in_space).collect();
    ShapeValues { values: shape_functions::<D, N>(at).to_vec(), slopes }
}

/// Appends zeros to a vector of `D` components.
fn in_space<const D: usize>(vector: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|k| if k < D { vector[k] } else { 0.0 })
}

/// Visitor of the nodes of a cell.
struct CellNodes;

impl CellVisitor for CellNodes {
    type Output = Vec<Barycentric>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        let node = |xi: &[f64; D]| std::array::from_fn(|k| if k < D { xi[k] } else { 0.0 });
        cell.nodes.iter().map(node).collect()
    }
}

/// Visitor of the shape functions of a cell at a point.
struct ShapeAt<'a>(&'a Barycentric);

impl CellVisitor for ShapeAt<'_> {
    type Output = ShapeValues;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        let mut xi = [0.0; D];
        xi.copy_from_slice(&self.0[..D]);
        let slopes = (cell.slopes)(&xi).iter().map(in_space).collect();
        ShapeValues { values: (cell.shape)(&xi).to_vec(), slopes }
    }
}
