//! Springs: linear ones, and those whose energy is a formula.

mod arrangement;
mod expressed;
mod half_springs;
mod kernels;
mod pair;
mod runs;
mod slots;
#[cfg(test)]
mod tests;

use std::ops::Range;

pub use self::expressed::{SpringFormula, SpringFormulaError};

use self::arrangement::Arrangement;
use self::half_springs::HalfSprings;
use self::pair::Spring;
use self::runs::Runs;
use super::measure::{Length, ScalarStrainEnergy, StencilConstants};
use super::rows::Add;
use super::{EnergyKind, EnergyTerm, Fault, ForceLayout, Stencils, TermProperties, TermViews};
use crate::lanes::dispatch;
use crate::material::Psd;

/// `E = 1/2 k (l - l0)^2` with `l = |x_1 - x_2|`; the gradient on `x_1` is `k (l - l0) (x_1 - x_2) / l`
/// (lecture 9).
///
/// In the language of elements: `F = (x_1 - x_2) / l0`, `Psi = mu (|F| - 1)^2`, `E = l0 Psi`, so `k = 2 mu /
/// l0` (lecture 10). A spring of length zero has no direction and pulls with no force.
///
/// Where vertices are numbered as on a grid, eight consecutive ones are computed side by side, each with its
/// own springs: the other ends lie side by side, too. They are loaded as they lie, and a tension is computed
/// at the lower end of a spring and read at the upper one. Elsewhere springs are [stencils](ScalarStrainEnergy)
/// that measure a [`Length`].
pub struct Springs<const D: usize> {
    body: String,
    layout: Layout<D>,
    /// The springs one by one, once an implicit scheme has asked for them.
    pairs: Vec<Spring>,
}

enum Layout<const D: usize> {
    /// Springs in runs, and the coordinates of the vertices from the first to the last of them.
    Runs(Arrangement<D>, Range<usize>),
    Measured(ScalarStrainEnergy<Length, D, 2>),
}

use Layout::{Measured, Runs as InRuns};

impl<const D: usize> Springs<D> {
    /// Springs of `body` along `edges` (global vertex indices) of `vertex_count` vertices; stiffness [N/m]
    /// and rest length [m] of each.
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
            Some(runs) => InRuns(Arrangement::new(runs), half.first_vertex * D..end * D),
            None => {
                let constants = |(stiffness, length): (&f64, &f64)| StencilConstants {
                    stiffness: *stiffness,
                    rest: [*length, 0.0],
                };
                let constants: Vec<_> = stiffness.iter().zip(rest_length).map(constants).collect();
                // Vertices are numbered by what is near what.
                let mut places = vec![0.0; vertex_count * D];
                places.iter_mut().step_by(D).zip(0..).for_each(|(place, v)| *place = f64::from(v));
                Measured(ScalarStrainEnergy::new(body, edges, &constants[..edges.len()], &places))
            }
        };
        Springs { body: body.into(), layout, pairs: vec![] }
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
        match &mut self.layout {
            InRuns(springs, range) => springs.energy(&x[range.clone()]),
            Measured(springs) => springs.energy(x),
        }
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        match &mut self.layout {
            InRuns(springs, range) => springs.evaluate(&x[range.clone()]),
            Measured(springs) => springs.evaluate(x),
        }
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let (springs, Range { start, end }) = match &self.layout {
            Measured(springs) => return springs.add_rows(first, g),
            InRuns(springs, range) => (springs, range.clone()),
        };
        // The part of the rows asked for that belongs to vertices from the first to the last with springs.
        let (from, to) = ((first * D).max(start), (first * D + g.len()).min(end));
        if from < to {
            let to_rows = &mut g[from - first * D..to - first * D];
            dispatch(Add { from: &springs.gradient()[from - start..to - start], to: to_rows });
        }
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        match &mut self.layout {
            InRuns(springs, range) => {
                let (x, p, y) = (&x[range.clone()], &p[range.clone()], &mut y[range.clone()]);
                springs.add_hessian_product(x, p, y);
            }
            Measured(springs) => springs.add_hessian_product(x, p, y),
        }
    }

    fn stencils(&mut self) -> Stencils {
        self.pairs = match &self.layout {
            InRuns(springs, range) => {
                let first = range.start / D;
                let spring = |(_, ends, stiffness, rest_length): (u32, [usize; 2], f64, f64)| {
                    let ends = ends.map(|v| (first + v) as u32);
                    Spring { ends, stiffness, rest_length }
                };
                springs.springs().map(spring).collect()
            }
            Measured(springs) => springs
                .each_stencil()
                .map(|(ends, stiffness, [rest_length, _])| Spring { ends, stiffness, rest_length })
                .collect(),
        };
        Stencils { size: 2, vertices: self.pairs.iter().flat_map(|s| s.ends).collect() }
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        pair::hessians::<D>(&self.pairs[stencils], x, psd, out);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        let (springs, range) = match &self.layout {
            Measured(springs) => return springs.fault(x),
            InRuns(springs, range) => (springs, range.clone()),
        };
        let x: &[[f64; D]] = x[range].as_chunks().0;
        let length = |[a, b]: [usize; 2]| (0..D).map(|c| (x[a][c] - x[b][c]).powi(2)).sum::<f64>().sqrt();
        let faulty = springs.springs().filter(|(_, ends, k, rest)| !(k * (length(*ends) - rest)).is_finite());
        let (spring, ends) = faulty.map(|(spring, ends, ..)| (spring, ends)).min()?;
        Some(Fault::Spring { body: self.body.clone(), spring: spring as usize, length: length(ends) })
    }

    fn bytes(&self) -> usize {
        let springs = match &self.layout {
            InRuns(springs, _) => springs.bytes(),
            Measured(springs) => springs.bytes(),
        };
        springs + size_of_val(&self.pairs[..])
    }
}

impl<const D: usize> TermViews for Springs<D> {
    fn layout(&self) -> Option<&dyn ForceLayout> {
        Some(self)
    }
}

impl<const D: usize> ForceLayout for Springs<D> {
    fn rows(&self, first: usize, count: usize) -> Option<&[f64]> {
        let InRuns(springs, Range { start, end }) = &self.layout else { return None };
        let (from, to) = (first * D, (first + count) * D);
        (*start <= from && to <= *end).then(|| &springs.gradient()[from - start..to - start])
    }
}
