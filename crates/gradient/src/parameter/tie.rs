//! Parameters of attachments: rest lengths, and reference positions of attachment points.

use pliant::algebra::Mat;
use pliant::energy::attachment::Tie;

use super::{ForceUse, ModeUse, Parameter, ParameterNeeds};
use crate::adjoint::add_scaled;
use pliant::algebra::dot;

/// Rest length `l` [m] of the ties of an attachment, `E = sum k/2 (|d| - l)^2`.
#[derive(Clone, Debug)]
pub struct TieRestLength {
    /// Name of the attachment's term.
    term: String,
}

impl TieRestLength {
    /// Rest length of the term with this name.
    pub fn new(term: String) -> Self {
        TieRestLength { term }
    }
}

impl Parameter for TieRestLength {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { rest_lengths: vec![&self.term], ..ParameterNeeds::default() }
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        add_scaled(force, -change[0], of.by_rest_length(&self.term));
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        derivative[0] -= dot(of.by_rest_length(&self.term), of.p);
    }
}

/// Vertex tied to the nearest point of a simplex, to another vertex or to a fixed position.
#[derive(Clone, Debug)]
struct ShapedTie {
    vertex: u32,
    /// Corners with their barycentric coordinates `l_k`; a single one for a vertex, empty for a position.
    corners: Vec<(u32, f64)>,
    /// Fixed position [m]; zero for other ties.
    place: [f64; 3],
    /// Inverse of `e_i . e_j`, `e_i` the edges from the first corner; padded with rows of the identity.
    inverse: Mat<f64, 3>,
    /// Edges `e_i` [m].
    edges: Vec<[f64; 3]>,
    /// Vector `r` from the nearest point to the vertex [m].
    away: [f64; 3],
}

/// Reference positions of a body's vertices, on which ties to nearest points depend through the
/// barycentric coordinates `l` of these points.
///
/// The point is the foot of the perpendicular on the plane, line or corner of the simplex that contains
/// it, `X - sum_k l_k X_k = r`, `e_i . r = 0`. If reference positions move,
///
/// ```text
/// sum_j (e_i . e_j) dl_j = e_i . (dX - sum_k l_k dX_k) + (dX_i - dX_0) . r      dl_0 = -sum_j dl_j
/// ```
///
/// Forces of a tie depend on `d = x - sum_k l_k x_k`, and act on corners in fractions `l_k`. A point on
/// the boundary of its element moves along that boundary only. Ties to vertices and to fixed positions
/// have no such coordinates: reference shapes affect only their directions in vibration modes, which move
/// along with the shape.
#[derive(Clone, Debug)]
pub struct TieShape {
    ties: Vec<ShapedTie>,
    constants: TieConstants,
    dimension: usize,
    /// Index of each vertex of the simulation in the body.
    place: Vec<Option<u32>>,
    vertices: usize,
}

/// Constants of the springs and dashpots of ties.
#[derive(Clone, Copy, Debug)]
pub struct TieConstants {
    /// Stiffness `k` of each tie [N/m].
    pub stiffness: f64,
    /// Rest length `l` [m].
    pub rest_length: f64,
    /// Constant of the parallel dashpot [N s/m].
    pub dashpot: f64,
}

fn product(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Linear combination `sum_i c_i a_i`.
fn combined<'a>(each: impl IntoIterator<Item = (f64, &'a [f64; 3])>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    each.into_iter().for_each(|(c, a)| (0..3).for_each(|k| sum[k] += c * a[k]));
    sum
}

/// Row of a vertex, third component 0 in 2D.
fn row(rows: &[f64], d: usize, vertex: u32) -> [f64; 3] {
    let mut row = [0.0; 3];
    row[..d].copy_from_slice(&rows[vertex as usize * d..][..d]);
    row
}

impl ShapedTie {
    /// Tie whose first vertex is tied to the point of the others, or to its fixed position.
    fn new(Tie { shares, place }: &Tie, rest: &[f64], d: usize) -> Self {
        let (vertex, place) = (shares[0].0, *place);
        let corners: Vec<(u32, f64)> = shares[1..].iter().map(|(v, weight)| (*v, -weight)).collect();
        let at = |vertex: u32| row(rest, d, vertex);
        let edges: Vec<[f64; 3]> = match &corners[..] {
            [first, others @ ..] => {
                let first = at(first.0);
                let edge = |(corner, _): &(u32, f64)| combined([(1.0, &at(*corner)), (-1.0, &first)]);
                others.iter().map(edge).collect()
            }
            [] => vec![],
        };
        let point: Vec<(f64, [f64; 3])> = corners.iter().map(|(v, l)| (-l, at(*v))).collect();
        let away = combined(point.iter().map(|(l, x)| (*l, x)).chain([(1.0, &at(vertex))]));
        let mut products = Mat::identity();
        for (i, a) in edges.iter().enumerate() {
            edges.iter().enumerate().for_each(|(j, b)| products[i][j] = product(a, b));
        }
        ShapedTie { vertex, corners, place, inverse: products.inverse(), edges, away }
    }

    /// True if it is tied to a point that moves in its element.
    fn has_coordinates(&self) -> bool {
        !self.edges.is_empty()
    }

    /// Relative vector `y - sum_k l_k y_k`.
    fn mixed(&self, rows: &[f64], d: usize) -> [f64; 3] {
        let of_corners: Vec<(f64, [f64; 3])> =
            self.corners.iter().map(|(v, l)| (-l, row(rows, d, *v))).collect();
        combined(of_corners.iter().map(|(l, y)| (*l, y)).chain([(1.0, &row(rows, d, self.vertex))]))
    }

    /// Changes of the barycentric coordinates if reference positions change by `change`.
    fn coordinate_changes(&self, change: impl Fn(u32) -> [f64; 3]) -> Vec<f64> {
        let moved: Vec<(f64, [f64; 3])> = self.corners.iter().map(|(v, l)| (-l, change(*v))).collect();
        let point = combined(moved.iter().map(|(l, dx)| (*l, dx)).chain([(1.0, &change(self.vertex))]));
        let right = |(edge, (_, dx)): (&[f64; 3], &(f64, [f64; 3]))| {
            product(edge, &point) + product(&combined([(1.0, dx), (-1.0, &moved[0].1)]), &self.away)
        };
        let others = self.solved(self.edges.iter().zip(&moved[1..]).map(right));
        std::iter::once(-others.iter().sum::<f64>()).chain(others).collect()
    }

    /// Solves the system of the products `e_i . e_j` for a right-hand side.
    fn solved(&self, right: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut padded = [0.0; 3];
        padded.iter_mut().zip(right).for_each(|(to, from)| *to = from);
        self.inverse.mul_vec(&padded)[..self.edges.len()].to_vec()
    }

    /// Calls `add` with vertices and the derivatives by their reference positions, given those by the
    /// barycentric coordinates: the transpose of [`coordinate_changes`](Self::coordinate_changes).
    fn spread(&self, by: &[f64], mut add: impl FnMut(u32, [f64; 3])) {
        let each = self.solved(by[1..].iter().map(|one| one - by[0]));
        let along = combined(each.iter().copied().zip(&self.edges));
        add(self.vertex, along);
        for (k, (v, l)) in self.corners.iter().enumerate() {
            let turn = if k == 0 { -each.iter().sum::<f64>() } else { each[k - 1] };
            add(*v, combined([(-l, &along), (turn, &self.away)]));
        }
    }
}

/// Force of a tie and its derivatives by `d` and its rate `w`.
struct TieForce {
    /// Force `F` [N].
    force: [f64; 3],
    d: [f64; 3],
    w: [f64; 3],
    constants: TieConstants,
}

impl TieForce {
    /// Force `F = k (1 - l/|d|) d + c (d . w)/|d|^2 d`; if the ends coincide, `k d + c w`.
    fn new(d: [f64; 3], w: [f64; 3], constants: TieConstants) -> Self {
        let mut of = TieForce { force: [0.0; 3], d, w, constants };
        let TieConstants { stiffness, dashpot, .. } = constants;
        let damped = if of.square() > 0.0 {
            combined([(dashpot * product(&d, &w) / of.square(), &d)])
        } else {
            combined([(dashpot, &w)])
        };
        of.force = combined([(stiffness * (1.0 - of.slack()), &d), (1.0, &damped)]);
        of
    }

    fn square(&self) -> f64 {
        product(&self.d, &self.d)
    }

    /// Ratio `l/|d|`.
    fn slack(&self) -> f64 {
        if self.constants.rest_length == 0.0 {
            0.0
        } else {
            self.constants.rest_length / self.square().sqrt()
        }
    }

    /// Change of the force with `d` along `dd` and with `w` along `dw`.
    fn change(&self, dd: &[f64; 3], dw: &[f64; 3]) -> [f64; 3] {
        let TieForce { d, w, constants, .. } = self;
        let TieConstants { stiffness, dashpot, .. } = *constants;
        let (square, slack) = (self.square(), self.slack());
        if square == 0.0 {
            return combined([(stiffness, dd), (dashpot, dw)]);
        }
        let along = product(d, dd) / square;
        let rate = product(d, w) / square;
        let of_rate = (product(dd, w) + product(d, dw)) / square - 2.0 * along * rate;
        combined([
            (stiffness * (1.0 - slack) + dashpot * rate, dd),
            (stiffness * slack * along + dashpot * of_rate, d),
        ])
    }

    /// Derivatives by `d` and by `q` of the curvature `q . dF/dd q` at zero velocity, with `n = d/|d|`,
    /// `s = l/|d|`,
    ///
    /// ```text
    /// c = k ((1 - s) |q|^2 + s (n . q)^2)
    /// dc/dd = k s/|d| ((|q|^2 - (n . q)^2) n + 2 (n . q) (q - (n . q) n))
    /// dc/dq = 2 k ((1 - s) q + s (n . q) n)
    /// ```
    fn curvature_slopes(&self, q: &[f64; 3]) -> [[f64; 3]; 2] {
        let TieForce { d, constants: TieConstants { stiffness, .. }, .. } = self;
        let slack = self.slack();
        if slack == 0.0 {
            return [[0.0; 3], combined([(2.0 * stiffness, q)])];
        }
        let length = self.square().sqrt();
        let along = product(d, q) / length;
        let bend = stiffness * slack / length;
        let by_d =
            combined([(bend * (product(q, q) - 3.0 * along * along) / length, d), (2.0 * bend * along, q)]);
        let by_q =
            combined([(2.0 * stiffness * (1.0 - slack), q), (2.0 * stiffness * slack * along / length, d)]);
        [by_d, by_q]
    }

    /// Derivatives of the work of the force along `q` by `d` and by `w`: the transpose of
    /// [`change`](Self::change).
    fn slopes(&self, q: &[f64; 3]) -> [[f64; 3]; 2] {
        let TieForce { d, w, constants, .. } = self;
        let TieConstants { stiffness, dashpot, .. } = *constants;
        let (square, slack) = (self.square(), self.slack());
        if square == 0.0 {
            return [combined([(stiffness, q)]), combined([(dashpot, q)])];
        }
        let along = product(d, q) / square;
        let rate = product(d, w) / square;
        let by_d = combined([
            (stiffness * (1.0 - slack) + dashpot * rate, q),
            (stiffness * slack * along - 2.0 * dashpot * along * rate, d),
            (dashpot * along, w),
        ]);
        [by_d, combined([(dashpot * along, d)])]
    }
}

impl TieShape {
    /// Shape parameter for the reference positions of `vertices` through ties with these constants. In
    /// each tie the tied vertex comes first, then the corners of the point that it is tied to, with
    /// negated coordinates; none for a fixed position. All are indices in the simulation, whose reference
    /// positions are `rest`, flat [m].
    pub fn new(
        ties: &[Tie],
        constants: TieConstants,
        (dimension, rest): (usize, &[f64]),
        vertices: &[u32],
    ) -> Self {
        let mut place = vec![None; rest.len() / dimension];
        vertices.iter().zip(0..).for_each(|(vertex, i)| place[*vertex as usize] = Some(i));
        let ties = ties.iter().map(|tie| ShapedTie::new(tie, rest, dimension)).collect();
        TieShape { ties, constants, dimension, place, vertices: vertices.len() }
    }

    /// Derivatives of the work of `tie` along `p` by its barycentric coordinates.
    fn works(&self, tie: &ShapedTie, of: &ForceUse<'_>) -> Vec<f64> {
        let d = self.dimension;
        let [distance, rate, q] = [of.x, of.v, of.p].map(|rows| tie.mixed(rows, d));
        let force = TieForce::new(distance, rate, self.constants);
        let [by_d, by_w] = force.slopes(&q);
        let by = |(v, _): &(u32, f64)| {
            let [x, v, p] = [of.x, of.v, of.p].map(|rows| row(rows, d, *v));
            -product(&by_d, &x) - product(&by_w, &v) - product(&force.force, &p)
        };
        tie.corners.iter().map(by).collect()
    }
}

impl Parameter for TieShape {
    fn len(&self) -> usize {
        self.vertices * self.dimension
    }

    /// Ends are at their rest length and change direction and distance as the vertices move along with
    /// the shape.
    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        let d = self.dimension;
        for tie in &self.ties {
            let distance = combined([(1.0, &tie.mixed(of.x, d)), (-1.0, &tie.place)]);
            let [by_d, by_q] =
                TieForce::new(distance, [0.0; 3], self.constants).curvature_slopes(&tie.mixed(of.shape, d));
            self.add_to(tie.vertex, 1.0, &by_d, derivative);
            tie.corners.iter().for_each(|(v, l)| self.add_to(*v, -l, &by_d, derivative));
            if tie.has_coordinates() {
                let by = |(v, _): &(u32, f64)| {
                    -product(&by_q, &row(of.shape, d, *v)) - product(&by_d, &row(of.x, d, *v))
                };
                let by: Vec<f64> = tie.corners.iter().map(by).collect();
                tie.spread(&by, |v, by| self.add_to(v, 1.0, &by, derivative));
            }
        }
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let d = self.dimension;
        let moved = |vertex: u32| {
            let mut moved = [0.0; 3];
            if let Some(place) = self.place[vertex as usize] {
                moved[..d].copy_from_slice(&change[place as usize * d..][..d]);
            }
            moved
        };
        for tie in self.ties.iter().filter(|tie| tie.has_coordinates()) {
            let changes = tie.coordinate_changes(moved);
            let [distance, rate] = [of.x, of.v].map(|rows| tie.mixed(rows, d));
            let of_tie = TieForce::new(distance, rate, self.constants);
            let [dd, dw] = [of.x, of.v].map(|rows| {
                let each: Vec<[f64; 3]> = tie.corners.iter().map(|(v, _)| row(rows, d, *v)).collect();
                combined(changes.iter().map(|dl| -dl).zip(&each))
            });
            let turned = of_tie.change(&dd, &dw);
            let mut add = |vertex: u32, factor: f64, by: &[f64; 3]| {
                let row = force[vertex as usize * d..][..d].iter_mut();
                row.zip(by).for_each(|(row, by)| *row -= factor * by);
            };
            add(tie.vertex, 1.0, &turned);
            for ((v, l), dl) in tie.corners.iter().zip(&changes) {
                add(*v, -l, &turned);
                add(*v, -dl, &of_tie.force);
            }
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for tie in self.ties.iter().filter(|tie| tie.has_coordinates()) {
            let works = self.works(tie, of);
            tie.spread(&works, |v, by| self.add_to(v, -1.0, &by, derivative));
        }
    }
}

impl TieShape {
    /// Adds a multiple to the derivatives by the reference position of a vertex, if it belongs to the
    /// body.
    fn add_to(&self, vertex: u32, factor: f64, by: &[f64; 3], derivative: &mut [f64]) {
        let Some(place) = self.place[vertex as usize] else { return };
        let row = derivative[place as usize * self.dimension..][..self.dimension].iter_mut();
        row.zip(by).for_each(|(row, by)| *row += factor * by);
    }
}
