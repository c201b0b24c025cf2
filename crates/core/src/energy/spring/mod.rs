//! Springs: linear ones, and those whose energy is a formula.

mod arrangement;
mod expressed;
mod gathered;
mod half_springs;
mod kernels;
mod neighbours;
mod pair;
mod runs;
mod slots;
#[cfg(test)]
mod tests;

use std::ops::Range;

pub use self::expressed::{SpringFormula, SpringFormulaError};

use self::arrangement::Arrangement;
use self::gathered::GatheredNeighbours;
use self::half_springs::HalfSprings;
use self::pair::Spring;
use self::runs::Runs;
use super::rows::Add;
use super::{EnergyKind, EnergyTerm, Fault, ForceLayout, Stencils, TermProperties, TermViews};
use crate::lanes::dispatch;
use crate::material::Psd;

/// Linear springs, `E = 1/2 k (l - l0)^2` with `l = |x_1 - x_2|`; the gradient on `x_1` is
/// `k (l - l0) (x_1 - x_2) / l` (lecture 9).
///
/// As a one-dimensional element: `F = (x_1 - x_2) / l0`, `Psi = mu (|F| - 1)^2`, `E = l0 Psi`, so `k = 2 mu /
/// l0` (lecture 10). A spring of length zero has no direction and exerts no force.
///
/// Eight consecutive vertices are computed side by side, each with its own springs. If they are numbered
/// as on a grid, the other ends are adjacent too: they are loaded directly, and a tension is computed at
/// the lower end of a spring and read at the upper one. Otherwise the other ends are gathered, and each
/// end computes the tension.
pub struct Springs<const D: usize> {
    body: String,
    /// Range of the coordinates of the vertices from the first to the last with springs, in a flat array.
    coordinates: Range<usize>,
    layout: Layout<D>,
    /// Individual springs, after an implicit integrator has requested them.
    pairs: Vec<Spring>,
}

enum Layout<const D: usize> {
    Runs(Arrangement<D, Runs>),
    Gathered(Arrangement<D, GatheredNeighbours>),
}

/// Evaluates an expression on the arrangement of either layout.
macro_rules! on {
    ($layout:expr, $springs:ident => $e:expr) => {
        match $layout {
            Layout::Runs($springs) => $e,
            Layout::Gathered($springs) => $e,
        }
    };
}

impl<const D: usize> Springs<D> {
    /// Creates springs of `body` along `edges` (global vertex indices) of `vertex_count` vertices, with
    /// the stiffness [N/m] and rest length [m] of each.
    ///
    /// # Panics
    /// If an edge joins a vertex to itself or to one beyond `vertex_count`, or a list is shorter than
    /// `edges`.
    pub fn new(
        body: &str,
        edges: &[[u32; 2]],
        stiffness: &[f64],
        rest_length: &[f64],
        vertex_count: usize,
    ) -> Self {
        let half = HalfSprings::new(edges);
        let end = half.first_vertex + half.vertex_count();
        assert!(end <= vertex_count, "a spring ends at vertex {}, there are {vertex_count}", end - 1);
        let layout = match Runs::new(&half, stiffness, rest_length) {
            Some(runs) => Layout::Runs(Arrangement::new(runs)),
            None => {
                Layout::Gathered(Arrangement::new(GatheredNeighbours::new(&half, stiffness, rest_length)))
            }
        };
        Springs { body: body.into(), coordinates: half.first_vertex * D..end * D, layout, pairs: vec![] }
    }
}

impl<const D: usize> EnergyTerm for Springs<D> {
    fn name(&self) -> String {
        format!("springs of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let x = &x[self.coordinates.clone()];
        on!(&mut self.layout, springs => springs.energy(x))
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let x = &x[self.coordinates.clone()];
        on!(&mut self.layout, springs => springs.evaluate(x))
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let Range { start, end } = self.coordinates;
        // Part of the requested rows that belongs to vertices from the first to the last with springs.
        let (from, to) = ((first * D).max(start), (first * D + g.len()).min(end));
        if from < to {
            let rows = on!(&self.layout, springs => springs.gradient());
            let to_rows = &mut g[from - first * D..to - first * D];
            dispatch(Add { from: &rows[from - start..to - start], to: to_rows });
        }
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let range = self.coordinates.clone();
        let (x, p, y) = (&x[range.clone()], &p[range.clone()], &mut y[range]);
        on!(&mut self.layout, springs => springs.add_hessian_product(x, p, y));
    }

    fn stencils(&mut self) -> Stencils {
        let first = self.coordinates.start / D;
        let springs = on!(&self.layout, springs => springs
            .springs()
            .map(|(_, ends, stiffness, rest_length)| {
                let ends = ends.map(|v| (first + v) as u32);
                Spring { ends, stiffness, rest_length }
            })
            .collect::<Vec<_>>());
        let vertices = springs.iter().flat_map(|s| s.ends).collect();
        self.pairs = springs;
        Stencils { size: 2, vertices }
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        pair::hessians::<D>(&self.pairs[stencils], x, psd, out);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        let x: &[[f64; D]] = x[self.coordinates.clone()].as_chunks().0;
        let length = |[a, b]: [usize; 2]| (0..D).map(|c| (x[a][c] - x[b][c]).powi(2)).sum::<f64>().sqrt();
        let faulty = on!(&self.layout, springs => springs
            .springs()
            .filter(|(_, ends, k, rest)| !(k * (length(*ends) - rest)).is_finite())
            .map(|(spring, ends, ..)| (spring, ends))
            .min());
        faulty.map(|(spring, ends)| Fault::Spring {
            body: self.body.clone(),
            spring: spring as usize,
            length: length(ends),
        })
    }
}

impl<const D: usize> TermViews for Springs<D> {
    fn layout(&self) -> Option<&dyn ForceLayout> {
        Some(self)
    }
}

impl<const D: usize> ForceLayout for Springs<D> {
    fn rows(&self, first: usize, count: usize) -> Option<&[f64]> {
        let Range { start, end } = self.coordinates;
        let (from, to) = (first * D, (first + count) * D);
        let rows = on!(&self.layout, springs => springs.gradient());
        (start <= from && to <= end).then(|| &rows[from - start..to - start])
    }
}
