//! Soft attachments: springs that tie points of bodies to one another or to fixed positions.

use std::ops::Range;

use super::load::add_rows;
use super::{EnergyKind, EnergyTerm, Fault, Stencils, TermProperties, TermViews, TieTerm};
use crate::algebra::dot;
use crate::dissipation::{DissipationViews, DissipativeTerm, PositionProducts};
use crate::material::Psd;

/// One tie: a weighted sum of vertices minus a fixed position, `d = sum_i w_i x_i - a`. The weights of a
/// tie to a position add up to 1. A tie between two points has negative weights for the second point, a
/// sum of 0, and `a = 0`.
#[derive(Clone, Debug, PartialEq)]
pub struct Tie {
    /// Global vertices and their weights.
    pub shares: Vec<(u32, f64)>,
    /// The fixed position [m].
    pub place: [f64; 3],
}

/// Ties with local numbers (slots) of their vertices.
#[derive(Clone, Debug)]
struct Ties {
    name: String,
    dimension: usize,
    /// Global vertex indices, ascending.
    vertices: Vec<u32>,
    /// Slots and weights of all ties.
    shares: Vec<(u32, f64)>,
    /// Range of each tie in `shares`, and its fixed position.
    ties: Vec<(Range<usize>, [f64; 3])>,
}

impl Ties {
    fn new(name: String, dimension: usize, ties: &[Tie]) -> Self {
        let mut vertices: Vec<u32> = ties.iter().flat_map(|tie| tie.shares.iter().map(|(v, _)| *v)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let slot = |v: u32| vertices.partition_point(|w| *w < v) as u32;
        let mut shares = vec![];
        let mut ranges = vec![];
        for tie in ties {
            let first = shares.len();
            shares.extend(tie.shares.iter().map(|&(v, weight)| (slot(v), weight)));
            ranges.push((first..shares.len(), tie.place));
        }
        Ties { name, dimension, vertices, shares, ties: ranges }
    }

    /// Returns `sum_i w_i y_i` of tie `i`, with `y` flat.
    fn mix(&self, i: usize, y: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &(slot, weight) in &self.shares[self.ties[i].0.clone()] {
            let row = &y[self.vertices[slot as usize] as usize * self.dimension..][..self.dimension];
            sum.iter_mut().zip(row).for_each(|(sum, y)| *sum += weight * y);
        }
        sum
    }

    /// Returns `d` of tie `i`.
    fn difference(&self, i: usize, x: &[f64]) -> [f64; 3] {
        let (mixed, place) = (self.mix(i, x), self.ties[i].1);
        [0, 1, 2].map(|c| mixed[c] - place[c])
    }

    /// Distributes `force` of tie `i` to the rows of its vertices, flat by slot.
    fn share_out(&self, i: usize, force: [f64; 3], rows: &mut [f64]) {
        for &(slot, weight) in &self.shares[self.ties[i].0.clone()] {
            let row = &mut rows[slot as usize * self.dimension..][..self.dimension];
            row.iter_mut().zip(force).for_each(|(row, force)| *row += weight * force);
        }
    }

    /// Returns the vertices of each tie, padded to the size of the largest by its last vertex with weight
    /// zero.
    fn stencils(&self) -> Stencils {
        let size = self.ties.iter().map(|(range, _)| range.len()).max().unwrap_or(0);
        let mut vertices = vec![];
        for (range, _) in &self.ties {
            let own = &self.shares[range.clone()];
            vertices.extend((0..size).map(|k| self.vertices[own[k.min(own.len() - 1)].0 as usize]));
        }
        Stencils { size, vertices }
    }

    /// Writes the blocks `w_a w_b K` of the pairs `a <= b` of each of these ties, with the second
    /// derivative `K` with respect to `d`.
    fn blocks(&self, ties: Range<usize>, out: &mut [f64], k: impl Fn(usize) -> [[f64; 3]; 3]) {
        let size = self.ties.iter().map(|(range, _)| range.len()).max().unwrap_or(0);
        let d = self.dimension;
        let mut blocks = out.chunks_exact_mut(d * d);
        for i in ties {
            let (k, own) = (k(i), &self.shares[self.ties[i].0.clone()]);
            let weight = |a: usize| own.get(a).map_or(0.0, |(_, weight)| *weight);
            for a in 0..size {
                for b in a..size {
                    let block = blocks.next().expect("a block for each pair");
                    for r in 0..d {
                        for c in 0..d {
                            block[r * d + c] = weight(a) * weight(b) * k[r][c];
                        }
                    }
                }
            }
        }
    }

    fn fault(&self, i: usize) -> Fault {
        Fault::Stencil { what: "tie", body: self.name.clone(), index: i }
    }
}

fn scaled(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|a| s * a)
}

/// Returns `s I + p d d^T`.
fn matrix(s: f64, p: f64, d: [f64; 3]) -> [[f64; 3]; 3] {
    let mut m = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            m[i][j] = p * d[i] * d[j] + if i == j { s } else { 0.0 };
        }
    }
    m
}

/// Spring ties, `E = sum 1/2 k (|d| - l)^2`. With `l = 0` this is `k/2 |d|^2`, whose force is smooth at
/// `d = 0`. The forces of a tie between bodies are equal, opposite and along the line between its ends:
/// momentum and angular momentum are conserved.
pub struct Attachment {
    ties: Ties,
    /// `k` [N/m].
    stiffness: f64,
    /// `l` [m].
    rest_length: f64,
    /// `dE/dx` of the vertices, by slot.
    gradient: Vec<f64>,
    /// Scratch memory for products.
    product: Vec<f64>,
}

impl Attachment {
    /// Creates ties of `stiffness` [N/m] each and this `rest_length` [m], in a system of 2 or 3
    /// dimensions.
    pub fn new(name: String, dimension: usize, ties: &[Tie], stiffness: f64, rest_length: f64) -> Self {
        let ties = Ties::new(name, dimension, ties);
        let gradient = vec![0.0; dimension * ties.vertices.len()];
        Attachment { product: gradient.clone(), gradient, ties, stiffness, rest_length }
    }

    /// Returns the force `k (1 - l/|d|) d`.
    fn force(&self, d: [f64; 3]) -> [f64; 3] {
        if self.rest_length == 0.0 {
            return scaled(d, self.stiffness);
        }
        scaled(d, self.stiffness * (1.0 - self.rest_length / dot(&d, &d).sqrt()))
    }
}

impl EnergyTerm for Attachment {
    fn name(&self) -> String {
        format!("attachment `{}`", self.ties.name)
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let square = |i: usize| {
            let d = self.ties.difference(i, x);
            (dot(&d, &d).sqrt() - self.rest_length).powi(2)
        };
        0.5 * self.stiffness * (0..self.ties.ties.len()).map(square).sum::<f64>()
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let mut gradient = std::mem::take(&mut self.gradient);
        gradient.fill(0.0);
        for i in 0..self.ties.ties.len() {
            self.ties.share_out(i, self.force(self.ties.difference(i, x)), &mut gradient);
        }
        self.gradient = gradient;
        crate::algebra::all_finite(&self.gradient)
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        add_rows(&self.ties.vertices, &self.gradient, 1.0, first, g, self.ties.dimension);
    }

    /// Adds `k ((1 - l/|d|) w + l/|d| e (e . w))` with `e = d/|d|` and the change `w` of `d`.
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        self.product.fill(0.0);
        for i in 0..self.ties.ties.len() {
            let w = self.ties.mix(i, p);
            let mut product = scaled(w, self.stiffness);
            if self.rest_length != 0.0 {
                let d = self.ties.difference(i, x);
                let squared = dot(&d, &d);
                let slack = self.rest_length / squared.sqrt();
                let along = dot(&d, &w) / squared;
                product = [0, 1, 2].map(|c| self.stiffness * (w[c] + slack * (along * d[c] - w[c])));
            }
            self.ties.share_out(i, product, &mut self.product);
        }
        add_rows(&self.ties.vertices, &self.product, 1.0, 0, y, self.ties.dimension);
    }

    fn stencils(&mut self) -> Stencils {
        self.ties.stencils()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        self.ties.blocks(stencils, out, |i| {
            let d = self.ties.difference(i, x);
            let squared = dot(&d, &d);
            let across = if self.rest_length == 0.0 { 1.0 } else { 1.0 - self.rest_length / squared.sqrt() };
            let across = if psd == Psd::Projected && across < 0.0 { 0.0 } else { across };
            let along = if squared > 0.0 { (1.0 - across) / squared } else { 0.0 };
            matrix(self.stiffness * across, self.stiffness * along, d)
        });
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        let finite = |i: &usize| self.force(self.ties.difference(*i, x)).iter().all(|f| f.is_finite());
        (0..self.ties.ties.len()).find(|i| !finite(i)).map(|i| self.ties.fault(i))
    }
}

impl TermViews for Attachment {
    fn ties(&mut self) -> Option<&mut dyn TieTerm> {
        Some(self)
    }
}

impl TieTerm for Attachment {
    fn move_places(&mut self, place: [f64; 3]) {
        self.ties.ties.iter_mut().for_each(|(_, of_tie)| *of_tie = place);
    }

    /// Adds `-k d/|d|` of each tie.
    fn add_gradient_by_rest_length(&self, x: &[f64], rows: &mut [f64]) {
        let mut by_slot = vec![0.0; self.gradient.len()];
        for i in 0..self.ties.ties.len() {
            let d = self.ties.difference(i, x);
            let length = dot(&d, &d).sqrt();
            if length > 0.0 {
                self.ties.share_out(i, scaled(d, -self.stiffness / length), &mut by_slot);
            }
        }
        add_rows(&self.ties.vertices, &by_slot, 1.0, 0, rows, self.ties.dimension);
    }
}

/// Dashpots parallel to ties: `R = sum c/2 (d|d|/dt)^2`, a force `c (e . w) e` with `e = d/|d|` and the
/// rate `w` of `d`. At `d = 0` the ends separate along `w`, and the force is `c w`. Like the force of the
/// ties it conserves momentum and angular momentum.
pub struct AttachmentDashpots {
    ties: Ties,
    /// `c` [N s/m].
    constant: f64,
    /// True if the dashpots act on the whole rate of `d`, `R = sum c/2 |w|^2`.
    in_all_directions: bool,
    /// `dR/dv` of the vertices, by slot.
    gradient: Vec<f64>,
}

impl AttachmentDashpots {
    /// Creates dashpots of `constant` [N s/m] each.
    pub fn new(name: String, dimension: usize, ties: &[Tie], constant: f64) -> Self {
        let ties = Ties::new(name, dimension, ties);
        let gradient = vec![0.0; dimension * ties.vertices.len()];
        AttachmentDashpots { gradient, ties, constant, in_all_directions: false }
    }

    /// Applies the dashpots to the whole rate of `d`, not only along it: `R = sum c/2 |w|^2`. Between bodies
    /// this does not conserve angular momentum.
    #[must_use]
    pub fn in_all_directions(self) -> Self {
        AttachmentDashpots { in_all_directions: true, ..self }
    }

    /// True if the force of a tie with this `|d|^2` [m^2] is `c w`.
    fn is_isotropic(&self, squared: f64) -> bool {
        self.in_all_directions || squared == 0.0
    }

    fn force(&self, i: usize, x: &[f64], v: &[f64]) -> [f64; 3] {
        let (d, w) = (self.ties.difference(i, x), self.ties.mix(i, v));
        let squared = dot(&d, &d);
        if self.is_isotropic(squared) {
            scaled(w, self.constant)
        } else {
            scaled(d, self.constant * (dot(&d, &w) / squared))
        }
    }
}

impl DissipativeTerm for AttachmentDashpots {
    fn name(&self) -> String {
        format!("damping of attachment `{}`", self.ties.name)
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        let mut gradient = std::mem::take(&mut self.gradient);
        gradient.fill(0.0);
        for i in 0..self.ties.ties.len() {
            self.ties.share_out(i, self.force(i, x, v), &mut gradient);
        }
        self.gradient = gradient;
        crate::algebra::all_finite(&self.gradient)
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        add_rows(&self.ties.vertices, &self.gradient, 1.0, first, g, self.ties.dimension);
    }

    fn stencils(&mut self) -> Stencils {
        self.ties.stencils()
    }

    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], _v: &[f64], out: &mut [f64]) {
        self.ties.blocks(stencils, out, |i| {
            let d = self.ties.difference(i, x);
            let squared = dot(&d, &d);
            if self.is_isotropic(squared) {
                matrix(self.constant, 0.0, d)
            } else {
                matrix(0.0, self.constant / squared, d)
            }
        });
    }

    fn add_damping_product(&mut self, x: &[f64], _v: &[f64], p: &[f64], y: &mut [f64]) {
        self.evaluate(x, p);
        self.add_rows(0, y);
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        (0..self.ties.ties.len()).map(|i| dot(&self.force(i, x, v), &self.ties.mix(i, v))).sum()
    }

    fn fault(&self, x: &[f64], v: &[f64]) -> Option<Fault> {
        let finite = |i: &usize| self.force(*i, x, v).iter().all(|f| f.is_finite());
        (0..self.ties.ties.len()).find(|i| !finite(i)).map(|i| self.ties.fault(i))
    }
}

impl DissipationViews for AttachmentDashpots {}

impl PositionProducts for AttachmentDashpots {
    /// Adds `c [p (d.w) + w (d.p)]/|d|^2 - 2 c (d.p) (d.w) d/|d|^4` of each tie, the derivative with
    /// respect to `d`; `p` and `w` are weighted sums like `d`.
    fn add_position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        let mut rows = vec![0.0; self.gradient.len()];
        for i in 0..self.ties.ties.len() {
            let (d, w, p) = (self.ties.difference(i, x), self.ties.mix(i, v), self.ties.mix(i, p));
            let squared = dot(&d, &d);
            if !self.is_isotropic(squared) {
                let (by_w, by_p) = (dot(&d, &w) / squared, dot(&d, &p) / squared);
                let by_d = [0, 1, 2].map(|c| p[c] * by_w + w[c] * by_p - 2.0 * by_p * by_w * d[c]);
                self.ties.share_out(i, scaled(by_d, self.constant), &mut rows);
            }
        }
        add_rows(&self.ties.vertices, &rows, 1.0, 0, y, self.ties.dimension);
        true
    }

    /// Adds `c [u' (d.w) + d (u'.w)]/|d|^2 - 2 c (d.u') (d.w) d/|d|^4` of each tie; `u'` is a weighted
    /// sum of `u` like `w`.
    fn add_position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        let mut rows = vec![0.0; self.gradient.len()];
        for i in 0..self.ties.ties.len() {
            let (d, w, u) = (self.ties.difference(i, x), self.ties.mix(i, v), self.ties.mix(i, u));
            let squared = dot(&d, &d);
            if !self.is_isotropic(squared) {
                let (by_w, by_u, both) =
                    (dot(&d, &w) / squared, dot(&d, &u) / squared, dot(&u, &w) / squared);
                let change = [0, 1, 2].map(|c| u[c] * by_w + d[c] * (both - 2.0 * by_u * by_w));
                self.ties.share_out(i, scaled(change, self.constant), &mut rows);
            }
        }
        add_rows(&self.ties.vertices, &rows, 1.0, 0, y, self.ties.dimension);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the `i`-th number of a sequence without pattern in (-1, 1).
    fn number(i: usize) -> f64 {
        2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
    }

    fn scattered(dimension: usize, seed: usize) -> Vec<f64> {
        (0..7 * dimension).map(|i| number(i + 100 * seed)).collect()
    }

    /// Returns ties to a position, to a vertex and to a point inside an element.
    fn ties() -> Vec<Tie> {
        let tie = |shares: &[(u32, f64)], place| Tie { shares: shares.to_vec(), place };
        vec![
            tie(&[(5, 1.0)], [0.3, 0.1, 0.0]),
            tie(&[(2, 1.0), (6, -1.0)], [0.0; 3]),
            tie(&[(1, 1.0), (0, -0.2), (3, -0.5), (6, -0.3)], [0.0; 3]),
        ]
    }

    fn along(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    fn difference(f: impl Fn(f64) -> f64) -> f64 {
        let h = 1e-3;
        (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h)
    }

    fn moved(x: &[f64], p: &[f64], h: f64) -> Vec<f64> {
        x.iter().zip(p).map(|(x, p)| x + h * p).collect()
    }

    #[test]
    fn forces_and_hessian_products_are_derivatives() {
        for (dimension, rest_length) in [(2, 0.0), (3, 0.0), (2, 0.4), (3, 0.4)] {
            let term = || Attachment::new("a".into(), dimension, &ties(), 3.0, rest_length);
            let (x, p) = (scattered(dimension, 1), scattered(dimension, 2));
            let gradient = |x: &[f64]| {
                let mut g = vec![0.0; x.len()];
                term().add_gradient(x, &mut g);
                g
            };
            let slope = difference(|h| term().energy(&moved(&x, &p, h)));
            assert!((slope - along(&gradient(&x), &p)).abs() < 1e-9, "{dimension}, {rest_length}");
            let mut product = vec![0.0; x.len()];
            term().add_hessian_product(&x, &p, &mut product);
            for i in 0..x.len() {
                let slope = difference(|h| gradient(&moved(&x, &p, h))[i]);
                assert!((slope - product[i]).abs() < 1e-8, "{dimension}, {rest_length}, {i}: {slope}");
            }
        }
    }

    #[test]
    fn dashpots_damp_the_length_alone() {
        for dimension in [2, 3] {
            let mut term = AttachmentDashpots::new("a".into(), dimension, &ties()[1..2], 3.0);
            let (mut x, v) = (scattered(dimension, 1), scattered(dimension, 2));
            let length = |h: f64| {
                let x = moved(&x, &v, h);
                let square = |c: usize| (x[2 * dimension + c] - x[6 * dimension + c]).powi(2);
                (0..dimension).map(square).sum::<f64>().sqrt()
            };
            let rate = difference(length);
            assert!((term.power(&x, &v) - 3.0 * rate * rate).abs() < 1e-9);
            let mut product = vec![0.0; x.len()];
            term.add_damping_product(&x, &v, &v, &mut product);
            assert!((along(&product, &v) - 3.0 * rate * rate).abs() < 1e-9);
            // Ends of a sequence differ by the same wherever it begins: squares do not.
            let squares = |seed| scattered(dimension, seed).iter().map(|s| s * s).collect::<Vec<f64>>();
            let (p, u) = (squares(3), squares(4));
            let [mut by_positions, mut change] = [vec![0.0; x.len()], vec![0.0; x.len()]];
            assert!(term.add_position_product(&x, &v, &p, &mut by_positions));
            assert!(term.add_position_change(&x, &v, &u, &mut change));
            let size = along(&change, &change).sqrt();
            let error = (along(&by_positions, &u) - along(&change, &p)).abs();
            assert!(error < 1e-13 * size && size > 0.1, "{error:e} of {size}");
            // If the ends meet, every motion separates them.
            for c in 0..dimension {
                x[2 * dimension + c] = x[6 * dimension + c];
            }
            let squared: f64 =
                (0..dimension).map(|c| (v[2 * dimension + c] - v[6 * dimension + c]).powi(2)).sum();
            assert!((term.power(&x, &v) - 3.0 * squared).abs() < 1e-12);
        }
    }

    #[test]
    fn a_tie_with_a_length_whose_ends_meet_is_named() {
        let mut term = Attachment::new("a".into(), 2, &ties(), 3.0, 0.4);
        let x = vec![0.0; 14];
        assert!(!term.evaluate(&x));
        let expected = Fault::Stencil { what: "tie", body: "a".into(), index: 1 };
        assert_eq!(term.fault(&x), Some(expected));
        assert!(
            Attachment::new("a".into(), 2, &ties(), 3.0, 0.0).evaluate(&x),
            "without a length all is well"
        );
    }
}
