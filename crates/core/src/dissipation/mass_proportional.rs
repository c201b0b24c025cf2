//! Mass-proportional damping.

use std::ops::Range;

use super::{DissipationViews, DissipativeTerm, PositionProducts, VertexDrag};
use crate::energy::Stencils;

/// Mass-proportional damping `R = 1/2 alpha sum_i m_i |v_i|^2` over the vertices of a body. The force
/// `-alpha m_i v_i` slows every motion alike, rigid motion included. A mode of angular frequency `omega`
/// has the damping ratio `alpha / (2 omega)`.
#[derive(Clone, Debug)]
pub struct MassProportional {
    body: String,
    dimension: usize,
    /// `alpha m_i` of the vertices of the body [kg/s].
    coefficients: Vec<f64>,
    vertices: Range<usize>,
    /// `dR/dv`, flat.
    gradient: Vec<f64>,
}

impl MassProportional {
    /// Creates damping at the rate `alpha` [1/s] for the vertices `vertices` of `body`, with the masses
    /// `mass` [kg].
    ///
    /// # Panics
    /// If the numbers of masses and vertices differ.
    pub fn new(body: &str, alpha: f64, mass: &[f64], vertices: Range<usize>, dimension: usize) -> Self {
        assert_eq!(mass.len(), vertices.len(), "one mass per vertex");
        MassProportional {
            body: body.into(),
            dimension,
            coefficients: mass.iter().map(|m| alpha * m).collect(),
            gradient: vec![0.0; dimension * mass.len()],
            vertices,
        }
    }

    fn coordinates(&self) -> Range<usize> {
        self.dimension * self.vertices.start..self.dimension * self.vertices.end
    }

    /// Returns the body's rows of a flat array, each with its coefficient.
    fn rows<'a>(&'a self, v: &'a [f64]) -> impl Iterator<Item = (&'a [f64], f64)> {
        v[self.coordinates()].chunks_exact(self.dimension).zip(self.coefficients.iter().copied())
    }
}

impl DissipativeTerm for MassProportional {
    fn name(&self) -> String {
        format!("mass-proportional damping of `{}`", self.body)
    }

    fn evaluate(&mut self, _x: &[f64], v: &[f64]) -> bool {
        let mut gradient = std::mem::take(&mut self.gradient);
        let mut sum = 0.0;
        for (g, (v, c)) in gradient.chunks_exact_mut(self.dimension).zip(self.rows(v)) {
            for (g, v) in g.iter_mut().zip(v) {
                *g = c * v;
                // Zero times a finite number is zero, times any other NaN.
                sum += 0.0 * *g;
            }
        }
        self.gradient = gradient;
        sum == 0.0
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let Range { start, end } = self.coordinates();
        let offset = first * self.dimension;
        let (from, to) = (offset.max(start), (offset + g.len()).min(end));
        if from < to {
            for (g, own) in g[from - offset..].iter_mut().zip(&self.gradient[from - start..to - start]) {
                *g += own;
            }
        }
    }

    fn add_damping_product(&mut self, _x: &[f64], _v: &[f64], p: &[f64], y: &mut [f64]) {
        let coordinates = self.coordinates();
        for (y, (p, c)) in y[coordinates].chunks_exact_mut(self.dimension).zip(self.rows(p)) {
            for (y, p) in y.iter_mut().zip(p) {
                *y += c * p;
            }
        }
    }

    fn stencils(&mut self) -> Stencils {
        Stencils { size: 1, vertices: (self.vertices.start as u32..self.vertices.end as u32).collect() }
    }

    fn stencil_dampings(&self, stencils: Range<usize>, _x: &[f64], _v: &[f64], out: &mut [f64]) {
        let d = self.dimension;
        out.fill(0.0);
        for (block, c) in out.chunks_exact_mut(d * d).zip(&self.coefficients[stencils]) {
            (0..d).for_each(|i| block[i * d + i] = *c);
        }
    }

    fn power(&mut self, _x: &[f64], v: &[f64]) -> f64 {
        self.rows(v).map(|(v, c)| c * v.iter().map(|v| v * v).sum::<f64>()).sum()
    }
}

impl DissipationViews for MassProportional {
    fn vertex_drag(&self) -> Option<&dyn VertexDrag> {
        Some(self)
    }
}

impl PositionProducts for MassProportional {
    fn add_position_product(&mut self, _x: &[f64], _v: &[f64], _p: &[f64], _y: &mut [f64]) -> bool {
        true
    }

    fn add_position_change(&mut self, _x: &[f64], _v: &[f64], _u: &[f64], _y: &mut [f64]) -> bool {
        true
    }
}

impl VertexDrag for MassProportional {
    fn drag(&self, vertex: usize) -> f64 {
        if self.vertices.contains(&vertex) { self.coefficients[vertex - self.vertices.start] } else { 0.0 }
    }
}
