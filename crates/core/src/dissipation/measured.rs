//! Dashpots: damping by the rate of a number measured at a few vertices.

use std::ops::Range;

use super::{DissipationViews, DissipativeTerm, PositionProducts};
use crate::algebra::Dual;
use crate::energy::Fault;
use crate::energy::elastic::points_of;
use crate::energy::measure::{
    MatrixOutput, MeasuredStencils, RateKernel, ScalarStrain, StencilConstants, fill,
};
use crate::energy::patch::Workspace;
use crate::lanes::dispatch_compact;

/// `R = sum 1/2 c (ds/dt)^2` with `ds/dt = ds/dx . v` over stencils of `N` vertices, `s` a [`ScalarStrain`]:
/// for the length of a spring a dashpot beside it. A rigid motion changes no such number, and is not damped.
pub struct MeasuredRate<Q, const D: usize, const N: usize> {
    body: String,
    stencils: MeasuredStencils<Q, D, N>,
    workspace: Workspace<D>,
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> MeasuredRate<Q, D, N> {
    /// Stencils `vertices` (global vertex indices) of `body`; the `stiffness` of the constants is the
    /// damping constant `c` of each, `[N s/m]` for lengths.
    ///
    /// # Panics
    /// If there are not as many constants as stencils.
    pub fn new(body: &str, vertices: &[[u32; N]], constants: &[StencilConstants], rest: &[f64]) -> Self {
        let stencils = MeasuredStencils::new(vertices, constants, rest);
        MeasuredRate { body: body.into(), workspace: stencils.workspace(), stencils }
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> DissipativeTerm for MeasuredRate<Q, D, N> {
    fn name(&self) -> String {
        format!("damping of the {}s of `{}`", Q::OF, self.body)
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        let MeasuredRate { stencils, workspace, .. } = self;
        stencils.patches.evaluate(workspace, x, Some(v), |patch, scratch| {
            dispatch_compact(RateKernel { stencils, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.stencils.patches.add_rows(&self.workspace, first, g);
    }

    fn add_damping_product(&mut self, x: &[f64], _v: &[f64], p: &[f64], y: &mut [f64]) {
        self.evaluate(x, p);
        self.add_rows(0, y);
    }

    fn stencils(&mut self) -> crate::energy::Stencils {
        self.stencils.patches.lanes()
    }

    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], _v: &[f64], out: &mut [f64]) {
        fill(&self.stencils, stencils, x, MatrixOutput::Rate, out);
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let MeasuredRate { stencils, workspace, .. } = self;
        stencils.patches.sum_along(workspace, x, v, |patch, scratch| {
            dispatch_compact(RateKernel { stencils, patch, scratch })
        })
    }

    fn fault(&self, x: &[f64], _v: &[f64]) -> Option<Fault> {
        let sum = |points: &[[f64; D]; N], rest: &[f64; 2]| {
            Q::deviation(points, rest).1.as_flattened().iter().sum::<f64>()
        };
        self.stencils.fault(&self.body, sum, x)
    }

    fn bytes(&self) -> usize {
        self.stencils.bytes() + self.workspace.bytes()
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> DissipationViews for MeasuredRate<Q, D, N> {}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> PositionProducts for MeasuredRate<Q, D, N> {
    /// `c (s_p d2s/dx2 v + s_v d2s/dx2 p)` with the rates `s_p = ds/dx . p`, `s_v` of each stencil.
    fn add_position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        for (_, vertices, pack, lane) in self.stencils.patches.stencils() {
            let (constant, rest) = self.stencils.constants(pack, lane);
            let rest = rest.map(Dual::constant);
            let points = points_of::<D, N>(x, &vertices);
            let [by_v, by_p] = [v, p].map(|rows| {
                let directions = points_of::<D, N>(rows, &vertices);
                let mut along = [[Dual::constant(0.0); D]; N];
                for (along, (point, direction)) in along.iter_mut().zip(points.iter().zip(&directions)) {
                    for c in 0..D {
                        along[c] = Dual { value: point[c], derivative: direction[c] };
                    }
                }
                // The rate by the slopes: the deviation itself has no rest to be from.
                let slopes = Q::deviation(&along, &rest).1;
                let rate = |(slope, direction): (&[Dual<f64>; D], &[f64; D])| {
                    slope.iter().zip(direction).map(|(slope, direction)| slope.value * direction).sum::<f64>()
                };
                (slopes.iter().zip(&directions).map(rate).sum::<f64>(), slopes)
            });
            for (node, vertex) in vertices.iter().enumerate() {
                for c in 0..D {
                    let (curved_v, curved_p) = (by_v.1[node][c].derivative, by_p.1[node][c].derivative);
                    let bent = by_p.0 * curved_v + by_v.0 * curved_p;
                    y[*vertex as usize * D + c] += constant * bent;
                }
            }
        }
        true
    }

    /// `c (s_v' ds/dx + s_v d2s/dx2 u)`, `s_v'` the change of the rate `s_v = ds/dx . v` along `u`.
    fn add_position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        for (_, vertices, pack, lane) in self.stencils.patches.stencils() {
            let (constant, rest) = self.stencils.constants(pack, lane);
            let [points, velocities, directions] = [x, v, u].map(|rows| points_of::<D, N>(rows, &vertices));
            let along = std::array::from_fn(|node| {
                std::array::from_fn(|c| Dual { value: points[node][c], derivative: directions[node][c] })
            });
            let slopes: [[Dual<f64>; D]; N] = Q::deviation(&along, &rest.map(Dual::constant)).1;
            let mut rate = Dual::constant(0.0);
            for (slope, v) in slopes.as_flattened().iter().zip(velocities.as_flattened()) {
                rate += *slope * Dual::constant(*v);
            }
            for (node, vertex) in vertices.iter().enumerate() {
                for c in 0..D {
                    y[*vertex as usize * D + c] += constant * (rate * slopes[node][c]).derivative;
                }
            }
        }
        true
    }
}
