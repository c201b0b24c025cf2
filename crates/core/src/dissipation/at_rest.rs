//! Damping with a constant matrix, for materials of constant stiffness.

use std::ops::Range;

use super::{DissipationViews, DissipativeTerm, PositionProducts};
use crate::energy::{Fault, Stencils};

/// Dissipation function evaluated at the reference positions `x_0` for any deformation: `R(x_0, v)`,
/// whose matrix is constant.
///
/// Element viscosities `beta mu` and `beta lambda` give Rayleigh damping `C = beta K`, with the stiffness
/// `K` of linear elasticity. The material `linear` has that stiffness at every deformation, and hence
/// this damping. Like its forces, the damping is valid for small rotations.
pub struct AtRest {
    term: Box<dyn DissipativeTerm>,
    /// `x_0`, flat [m].
    rest: Vec<f64>,
}

impl AtRest {
    /// Evaluates `term` at the reference positions `rest` of all vertices of the system, flat [m].
    pub fn new(term: Box<dyn DissipativeTerm>, rest: &[f64]) -> Self {
        AtRest { term, rest: rest.to_vec() }
    }
}

impl DissipativeTerm for AtRest {
    fn name(&self) -> String {
        format!("{}, about the shape at rest", self.term.name())
    }

    fn evaluate(&mut self, _x: &[f64], v: &[f64]) -> bool {
        self.term.evaluate(&self.rest, v)
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.term.add_rows(first, g);
    }

    fn add_damping_product(&mut self, _x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) {
        self.term.add_damping_product(&self.rest, v, p, y);
    }

    fn stencils(&mut self) -> Stencils {
        self.term.stencils()
    }

    fn stencil_dampings(&self, stencils: Range<usize>, _x: &[f64], v: &[f64], out: &mut [f64]) {
        self.term.stencil_dampings(stencils, &self.rest, v, out);
    }

    fn power(&mut self, _x: &[f64], v: &[f64]) -> f64 {
        self.term.power(&self.rest, v)
    }

    fn fault(&self, _x: &[f64], v: &[f64]) -> Option<Fault> {
        self.term.fault(&self.rest, v)
    }
}

impl DissipationViews for AtRest {}

impl PositionProducts for AtRest {
    fn add_position_product(&mut self, _x: &[f64], _v: &[f64], _p: &[f64], _y: &mut [f64]) -> bool {
        true
    }

    fn add_position_change(&mut self, _x: &[f64], _v: &[f64], _u: &[f64], _y: &mut [f64]) -> bool {
        true
    }
}
