//! A term whose stencils change as bodies move.

use std::ops::Range;

use pliant::dissipation::{DissipationViews, DissipativeTerm, PositionProducts};
use pliant::energy::{
    ChangingStencils, EnergyKind, EnergyTerm, Fault, Stencils, StepLimit, TermProperties, TermViews,
};
use pliant::material::Psd;

/// `E = sum k/2 (reach - d)^2` over all points and segments whose distance `d` is below the reach: of bodies
/// that slide along each other, in two dimensions. Where the nearest place of a segment is one of its ends
/// the stencil has two vertices, elsewhere three.
pub(crate) struct Penalty {
    /// `[point, first end, second end]`.
    candidates: Vec<[u32; 3]>,
    stiffness: f64,
    reach: f64,
    stencils: MatrixStencils,
    gradient: Vec<f64>,
}

/// Which stencils the matrix is told of.
enum MatrixStencils {
    /// Stencils of all candidates, once.
    All,
    /// Stencils that are not zero, of two vertices and of three, with their candidates.
    Changing { lists: [Stencils; 2], members: [Vec<usize>; 2] },
}

/// A point and the nearest place of a segment.
struct Nearest {
    /// Coefficients of the three vertices in `r`.
    c: [f64; 3],
    /// From the segment to the point.
    r: [f64; 2],
    /// From the first end to the second.
    edge: [f64; 2],
    distance: f64,
}

impl Nearest {
    fn is_inside(&self) -> bool {
        self.c[1] != 0.0 && self.c[2] != 0.0
    }

    /// Which of the three vertices take part.
    fn members(&self) -> Vec<usize> {
        (0..3).filter(|i| self.c[*i] != 0.0).collect()
    }
}

fn row(x: &[f64], vertex: u32) -> [f64; 2] {
    [x[2 * vertex as usize], x[2 * vertex as usize + 1]]
}

fn length(v: [f64; 2]) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

fn nearest(x: &[f64], [p, a, b]: [u32; 3]) -> Nearest {
    let [p, a, b] = [p, a, b].map(|v| row(x, v));
    let edge = [b[0] - a[0], b[1] - a[1]];
    let along = (p[0] - a[0]) * edge[0] + (p[1] - a[1]) * edge[1];
    let t = (along / (edge[0] * edge[0] + edge[1] * edge[1])).clamp(0.0, 1.0);
    let r = [0, 1].map(|i| p[i] - (1.0 - t) * a[i] - t * b[i]);
    Nearest { c: [1.0, t - 1.0, -t], r, edge, distance: length(r) }
}

impl Penalty {
    /// Between all `points` and all `segments`, with changing stencils.
    pub(crate) fn changing(points: &[u32], segments: &[[u32; 2]], [stiffness, reach]: [f64; 2]) -> Self {
        let list = |size| Stencils { size, vertices: vec![] };
        let stencils = MatrixStencils::Changing { lists: [list(2), list(3)], members: [vec![], vec![]] };
        Penalty { stencils, ..Penalty::with_all(points, segments, [stiffness, reach]) }
    }

    /// The same potential; all that may ever touch is in the matrix from the beginning.
    pub(crate) fn with_all(points: &[u32], segments: &[[u32; 2]], [stiffness, reach]: [f64; 2]) -> Self {
        let candidates = points.iter().flat_map(|p| segments.iter().map(|[a, b]| [*p, *a, *b])).collect();
        Penalty { candidates, stiffness, reach, stencils: MatrixStencils::All, gradient: vec![] }
    }

    /// Candidates within reach.
    fn near(&self, x: &[f64]) -> impl Iterator<Item = (usize, Nearest)> {
        let all = self.candidates.iter().map(|candidate| nearest(x, *candidate)).enumerate();
        all.filter(|(_, nearest)| nearest.distance < self.reach)
    }

    /// Candidates and vertices of the stencils at `x` that are not zero, those of two vertices first.
    pub(crate) fn stencils_at(&self, x: &[f64]) -> ([Vec<usize>; 2], [Vec<u32>; 2]) {
        let (mut found, mut vertices) = ([vec![], vec![]], [vec![], vec![]]);
        for (candidate, at) in self.near(x) {
            let list = usize::from(at.is_inside());
            found[list].push(candidate);
            vertices[list].extend(at.members().iter().map(|i| self.candidates[candidate][*i]));
        }
        (found, vertices)
    }

    /// The block of members `i` and `j`: with `D = d^2`, `E'' grad D grad D^T + E' hess D`, of which only the
    /// first part is positive.
    fn block(&self, at: &Nearest, psd: Psd, (i, j): (usize, usize)) -> [f64; 4] {
        let Nearest { c, r, edge, distance } = at;
        if *distance >= self.reach {
            return [0.0; 4];
        }
        let first = 0.5 * self.stiffness * (1.0 - self.reach / distance);
        let second = 0.25 * self.stiffness * self.reach / distance.powi(3);
        let square = edge[0] * edge[0] + edge[1] * edge[1];
        // The nearest place moves along the segment.
        let slope = [0.0, 1.0, -1.0];
        let m = |i: usize, k: usize| slope[i] * r[k] - c[i] * edge[k];
        let entry = |n: usize| {
            let (k, l) = (n / 2, n % 2);
            let outer = 4.0 * second * c[i] * c[j] * r[k] * r[l];
            let identity = if k == l { 2.0 * c[i] * c[j] } else { 0.0 };
            let sliding = if at.is_inside() { 2.0 * m(i, k) * m(j, l) / square } else { 0.0 };
            if psd == Psd::Projected { outer } else { outer + first * (identity - sliding) }
        };
        [0, 1, 2, 3].map(entry)
    }
}

/// Writes the blocks of the pairs of members.
fn write(members: &[usize], out: &mut [f64], block: impl Fn((usize, usize)) -> [f64; 4]) {
    let mut blocks = out.chunks_exact_mut(4);
    for (a, i) in members.iter().enumerate() {
        for j in &members[a..] {
            blocks.next().unwrap().copy_from_slice(&block((*i, *j)));
        }
    }
}

impl EnergyTerm for Penalty {
    fn name(&self) -> String {
        "penalty".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        self.near(x).map(|(_, at)| 0.5 * self.stiffness * (self.reach - at.distance).powi(2)).sum()
    }
    fn evaluate(&mut self, x: &[f64]) -> bool {
        let mut gradient = vec![0.0; x.len()];
        for (candidate, at) in self.near(x) {
            let force = self.stiffness * (1.0 - self.reach / at.distance);
            for (vertex, c) in self.candidates[candidate].iter().zip(at.c) {
                (0..2).for_each(|k| gradient[2 * *vertex as usize + k] += force * c * at.r[k]);
            }
        }
        self.gradient = gradient;
        self.gradient.iter().all(|g| g.is_finite())
    }
    fn add_rows(&self, first: usize, g: &mut [f64]) {
        g.iter_mut().zip(&self.gradient[2 * first..]).for_each(|(g, own)| *g += own);
    }
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        for (candidate, at) in self.near(x) {
            let vertices = self.candidates[candidate].map(|v| v as usize);
            for i in 0..3 {
                for j in 0..3 {
                    let (block, p) = (self.block(&at, Psd::Exact, (i, j)), &p[2 * vertices[j]..]);
                    (0..2).for_each(|k| {
                        y[2 * vertices[i] + k] += block[2 * k] * p[0] + block[2 * k + 1] * p[1];
                    });
                }
            }
        }
    }
    fn stencils(&mut self) -> Stencils {
        match self.stencils {
            MatrixStencils::All => Stencils { size: 3, vertices: self.candidates.as_flattened().to_vec() },
            MatrixStencils::Changing { .. } => Stencils::default(),
        }
    }
    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        for (candidate, out) in self.candidates[stencils].iter().zip(out.chunks_exact_mut(24)) {
            let at = nearest(x, *candidate);
            write(&[0, 1, 2], out, |pair| self.block(&at, psd, pair));
        }
    }
    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for Penalty {
    fn limit(&self) -> Option<&dyn StepLimit> {
        Some(self)
    }
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        matches!(self.stencils, MatrixStencils::Changing { .. }).then_some(self)
    }
    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        if matches!(self.stencils, MatrixStencils::Changing { .. }) { Some(self) } else { None }
    }
}

impl StepLimit for Penalty {
    /// No distance shrinks by more than nine tenths: the ends of a pair come nearer by what they move at
    /// most.
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        let part = |candidate: &[u32; 3]| {
            let [p, a, b] = candidate.map(|v| length(row(dx, v)));
            0.9 * nearest(x, *candidate).distance / (p + a.max(b))
        };
        self.candidates.iter().map(part).fold(1.0, f64::min)
    }

    fn guards_way(&self) -> bool {
        true
    }
}

impl ChangingStencils for Penalty {
    fn find(&mut self, x: &[f64]) -> bool {
        let (found, vertices) = self.stencils_at(x);
        let MatrixStencils::Changing { lists, members } = &mut self.stencils else { return false };
        let [of_two, of_three] = vertices;
        let others = lists[0].vertices != of_two || lists[1].vertices != of_three;
        (lists[0].vertices, lists[1].vertices) = (of_two, of_three);
        *members = found;
        others
    }

    fn lists(&self) -> &[Stencils] {
        match &self.stencils {
            MatrixStencils::Changing { lists, .. } => lists,
            MatrixStencils::All => &[],
        }
    }

    fn blocks(
        &self,
        list: usize,
        stencils: Range<usize>,
        (x, _): (&[f64], &[f64]),
        psd: Psd,
        out: &mut [f64],
    ) {
        let MatrixStencils::Changing { members, .. } = &self.stencils else { return };
        let count = [12, 24][list];
        for (candidate, out) in members[list][stencils].iter().zip(out.chunks_exact_mut(count)) {
            let at = nearest(x, self.candidates[*candidate]);
            write(&at.members(), out, |pair| self.block(&at, psd, pair));
        }
    }
}

/// `R = sum c/2 (1 - d/reach) |w|^2` over the pairs of a penalty, `w` the velocity of the point beside the
/// nearest place of the segment: the bodies rub.
pub(crate) struct Rubbing {
    pairs: Penalty,
    constant: f64,
    gradient: Vec<f64>,
}

impl Rubbing {
    /// Between the pairs of a penalty, `c` = `constant` [N s/m].
    pub(crate) fn new(pairs: Penalty, constant: f64) -> Self {
        Rubbing { pairs, constant, gradient: vec![] }
    }

    fn factor(&self, at: &Nearest) -> f64 {
        self.constant * (1.0 - at.distance / self.pairs.reach).max(0.0)
    }

    /// Adds `dR/dv` to `y`.
    fn add(&self, x: &[f64], v: &[f64], y: &mut [f64]) {
        for (candidate, at) in self.pairs.near(x) {
            let vertices = self.pairs.candidates[candidate].map(|v| 2 * v as usize);
            for k in 0..2 {
                let w: f64 = (0..3).map(|i| at.c[i] * v[vertices[i] + k]).sum();
                (0..3).for_each(|i| y[vertices[i] + k] += self.factor(&at) * at.c[i] * w);
            }
        }
    }

    fn block(&self, at: &Nearest, (i, j): (usize, usize)) -> [f64; 4] {
        let entry = self.factor(at) * at.c[i] * at.c[j];
        [entry, 0.0, 0.0, entry]
    }
}

impl DissipativeTerm for Rubbing {
    fn name(&self) -> String {
        "rubbing".into()
    }
    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        let mut gradient = vec![0.0; x.len()];
        self.add(x, v, &mut gradient);
        self.gradient = gradient;
        self.gradient.iter().all(|g| g.is_finite())
    }
    fn add_rows(&self, first: usize, g: &mut [f64]) {
        g.iter_mut().zip(&self.gradient[2 * first..]).for_each(|(g, own)| *g += own);
    }
    fn add_damping_product(&mut self, x: &[f64], _: &[f64], p: &[f64], y: &mut [f64]) {
        self.add(x, p, y);
    }
    fn stencils(&mut self) -> Stencils {
        self.pairs.stencils()
    }
    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], _: &[f64], out: &mut [f64]) {
        for (candidate, out) in self.pairs.candidates[stencils].iter().zip(out.chunks_exact_mut(24)) {
            let at = nearest(x, *candidate);
            write(&[0, 1, 2], out, |pair| self.block(&at, pair));
        }
    }
    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.evaluate(x, v);
        self.gradient.iter().zip(v).map(|(g, v)| g * v).sum()
    }
}

impl DissipationViews for Rubbing {
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        self.pairs.changing().map(|_| self as &dyn ChangingStencils)
    }
    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        if self.pairs.changing().is_some() { Some(self) } else { None }
    }
}

impl PositionProducts for Rubbing {}

impl ChangingStencils for Rubbing {
    fn find(&mut self, x: &[f64]) -> bool {
        self.pairs.find(x)
    }

    fn lists(&self) -> &[Stencils] {
        self.pairs.lists()
    }

    fn blocks(&self, list: usize, stencils: Range<usize>, (x, _): (&[f64], &[f64]), _: Psd, out: &mut [f64]) {
        let MatrixStencils::Changing { members, .. } = &self.pairs.stencils else { return };
        let count = [12, 24][list];
        for (candidate, out) in members[list][stencils].iter().zip(out.chunks_exact_mut(count)) {
            let at = nearest(x, self.pairs.candidates[*candidate]);
            write(&at.members(), out, |pair| self.block(&at, pair));
        }
    }
}
