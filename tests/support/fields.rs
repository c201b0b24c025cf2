//! Potentials that only tests need.

use pliant::energy::{EnergyKind, EnergyTerm, Fault, TermProperties, TermViews};

/// A potential in terms of the differences `d_i = x_{i+1} - x_i` of a one-dimensional row of unknowns, both
/// ends held at zero: `E = sum_i 1/2 d_i^2 + alpha/3 d_i^3` (Fermi, Pasta, Ulam, Tsingou).
pub(crate) struct CubicChain {
    alpha: f64,
    gradient: Vec<f64>,
}

impl CubicChain {
    pub(crate) fn new(alpha: f64) -> Self {
        CubicChain { alpha, gradient: vec![] }
    }

    /// Calls `visit(index of the left vertex + 1, d)` for each of the `n + 1` springs.
    fn differences(x: &[f64], mut visit: impl FnMut(usize, f64)) {
        let mut left = 0.0;
        for (i, &right) in x.iter().chain(&[0.0]).enumerate() {
            visit(i, right - left);
            left = right;
        }
    }
}

impl EnergyTerm for CubicChain {
    fn name(&self) -> String {
        "cubic chain".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        let mut sum = 0.0;
        Self::differences(x, |_, d| sum += 0.5 * d * d + self.alpha / 3.0 * d * d * d);
        sum
    }
    fn evaluate(&mut self, x: &[f64]) -> bool {
        let (alpha, g) = (self.alpha, &mut self.gradient);
        g.clear();
        g.resize(x.len(), 0.0);
        Self::differences(x, |i, d| {
            let tension = d + alpha * d * d;
            if i < x.len() {
                g[i] += tension;
            }
            if i > 0 {
                g[i - 1] -= tension;
            }
        });
        g.iter().all(|g| g.is_finite())
    }
    fn add_rows(&self, first: usize, g: &mut [f64]) {
        for (g, own) in g.iter_mut().zip(&self.gradient[first..]) {
            *g += own;
        }
    }
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        Self::differences(x, |i, d| {
            let right = p.get(i).copied().unwrap_or(0.0);
            let left = if i > 0 { p[i - 1] } else { 0.0 };
            let q = (1.0 + 2.0 * self.alpha * d) * (right - left);
            if i < x.len() {
                y[i] += q;
            }
            if i > 0 {
                y[i - 1] -= q;
            }
        });
    }
    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for CubicChain {}
