//! Dashpots: damping by the rate of a scalar measured at a few vertices.

use std::marker::PhantomData;
use std::ops::Range;

use super::{DissipationViews, DissipativeTerm, PositionProducts};
use crate::algebra::Dual;
use crate::energy::Fault;
use crate::energy::elastic::points_of;
use crate::energy::measure::{
    DampingMatrix, DissipationKernel, MeasuredStencils, RateKernel, RateLaw, ScalarStrain, Square,
    StencilConstants, fill, moving, rate,
};
use crate::energy::patch::Workspace;
use crate::lanes::dispatch_compact;

/// Dashpots on stencils of `N` vertices: `R = sum c R_1(ds/dt, s)` with `ds/dt = ds/dx . v`, a
/// [`ScalarStrain`] `s` and a [`RateLaw`] `R_1`, by default `1/2 (ds/dt)^2`. On the length of a spring
/// this is a dashpot parallel to the spring. Rigid motion does not change `s` and is not damped.
pub struct MeasuredRate<Q, const D: usize, const N: usize, R = Square> {
    body: String,
    law: R,
    stencils: MeasuredStencils<Q, D, N>,
    workspace: Workspace<D>,
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> MeasuredRate<Q, D, N> {
    /// Creates the stencils `vertices` (global vertex indices) of `body`. The `stiffness` of the
    /// constants is the damping constant `c` of each stencil, `[N s/m]` for lengths.
    ///
    /// # Panics
    /// If the numbers of constants and stencils differ.
    pub fn new(body: &str, vertices: &[[u32; N]], constants: &[StencilConstants], rest: &[f64]) -> Self {
        Self::with_law(body, Square, vertices, constants, rest)
    }
}

/// Vertices, constants and positions of one stencil.
struct Stencil<const D: usize, const N: usize> {
    vertices: [u32; N],
    constant: f64,
    rest: [f64; 2],
    x: [[f64; D]; N],
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize, R: RateLaw> MeasuredRate<Q, D, N, R> {
    /// Creates dashpots with a given law, otherwise like [`new`](MeasuredRate::new).
    ///
    /// # Panics
    /// If the numbers of constants and stencils differ.
    pub fn with_law(
        body: &str,
        law: R,
        vertices: &[[u32; N]],
        constants: &[StencilConstants],
        rest: &[f64],
    ) -> Self {
        let stencils = MeasuredStencils::new(vertices, constants, rest);
        MeasuredRate { body: body.into(), law, workspace: stencils.workspace(), stencils }
    }

    /// Visits each stencil at `x`, one after the other.
    fn each(&self, x: &[f64], mut visit: impl FnMut(&Stencil<D, N>)) {
        for (_, vertices, pack, lane) in self.stencils.patches.stencils() {
            let (constant, rest) = self.stencils.constants(pack, lane);
            visit(&Stencil { vertices, constant, rest, x: points_of(x, &vertices) });
        }
    }
}

/// Adds `part(node, c)` of each coordinate of a stencil to the rows of `vertices` in `y`.
fn add<const D: usize, const N: usize>(
    vertices: &[u32; N],
    y: &mut [f64],
    part: impl Fn(usize, usize) -> f64,
) {
    for (node, vertex) in vertices.iter().enumerate() {
        for c in 0..D {
            y[*vertex as usize * D + c] += part(node, c);
        }
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize, R: RateLaw> DissipativeTerm
    for MeasuredRate<Q, D, N, R>
{
    fn name(&self) -> String {
        format!("damping of the {}s of `{}`{}", Q::OF, self.body, R::SUFFIX)
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        let MeasuredRate { stencils, workspace, law, .. } = self;
        stencils.patches.evaluate(workspace, x, Some(v), |patch, scratch| {
            dispatch_compact(RateKernel { stencils, law, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.stencils.patches.add_rows(&self.workspace, first, g);
    }

    /// Adds `c R'' (ds/dx . p) ds/dx` of each stencil.
    fn add_damping_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) {
        if R::IS_SQUARE {
            self.evaluate(x, p);
            return self.add_rows(0, y);
        }
        self.each(x, |Stencil { vertices, constant, rest, x }| {
            let (s, gradient) = Q::deviation(x, &R::origin(rest));
            let [of_v, of_p] = [v, p].map(|rows| rate(&gradient, &points_of(rows, vertices)));
            let force = constant * self.law.constant(of_v, s, rest) * of_p;
            add::<D, N>(vertices, y, |node, c| force * gradient[node][c]);
        });
    }

    fn stencils(&mut self) -> crate::energy::Stencils {
        self.stencils.patches.lanes()
    }

    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], v: &[f64], out: &mut [f64]) {
        let matrix = DampingMatrix { law: &self.law, measure: PhantomData::<Q> };
        fill(&self.stencils, stencils, (x, v), matrix, out);
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let MeasuredRate { stencils, workspace, law, .. } = self;
        stencils.patches.sum_along(workspace, x, v, |patch, scratch| {
            dispatch_compact(RateKernel { stencils, law, patch, scratch })
        })
    }

    fn value(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let MeasuredRate { stencils, workspace, law, .. } = self;
        stencils.patches.sum_along(workspace, x, v, |patch, scratch| {
            dispatch_compact(DissipationKernel { stencils, law, patch, scratch })
        })
    }

    fn fault(&self, x: &[f64], v: &[f64]) -> Option<Fault> {
        let faulty = self.stencils.patches.stencils().filter(|(_, vertices, pack, lane)| {
            let (_, rest) = self.stencils.constants(*pack, *lane);
            let (s, gradient) = Q::deviation(&points_of(x, vertices), &R::origin(&rest));
            let force = self.law.force(rate(&gradient, &points_of(v, vertices)), s, &rest);
            !gradient.as_flattened().iter().fold(force, |sum, g| sum + g).is_finite()
        });
        let index = faulty.map(|(stencil, ..)| stencil).min()?;
        Some(Fault::Stencil { what: Q::OF, body: self.body.clone(), index })
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize, R: RateLaw> DissipationViews
    for MeasuredRate<Q, D, N, R>
{
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize, R: RateLaw> PositionProducts
    for MeasuredRate<Q, D, N, R>
{
    /// Adds `c (s_p (F_rate d2s/dx2 v + F_s ds/dx) + F d2s/dx2 p)` of each stencil, with
    /// `F = dR_1/d rate` at the rate `ds/dx . v`, and `s_p = ds/dx . p`.
    fn add_position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        self.each(x, |Stencil { vertices, constant, rest, x }| {
            let constants = rest.map(Dual::constant);
            let [(of_v, rate), (of_p, by_p)] = [v, p].map(|rows| {
                let directions = points_of(rows, vertices);
                let found = Q::deviation(&moving(x, &directions), &R::origin(&constants));
                // From the gradient: the deviation may be undefined without a rest value.
                let slopes = found.1.map(|row| row.map(|slope| slope.value));
                (found, rate(&slopes, &directions))
            });
            let s = of_v.0.value;
            let along = |value: f64| Dual { value, derivative: 1.0 };
            let force = self.law.force(along(rate), Dual::constant(s), &constants);
            let by_s = self.law.force(Dual::constant(rate), along(s), &constants).derivative;
            add::<D, N>(vertices, y, |node, c| {
                let (of_v, of_p) = (&of_v.1[node][c], &of_p.1[node][c]);
                let bent = force.derivative * of_v.derivative + by_s * of_v.value;
                constant * (by_p * bent + force.value * of_p.derivative)
            });
        });
        true
    }

    /// Adds the change of `c F ds/dx` along `u`.
    fn add_position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        self.each(x, |Stencil { vertices, constant, rest, x }| {
            let constants = rest.map(Dual::constant);
            let moved = moving(x, &points_of(u, vertices));
            let (s, gradient) = Q::deviation(&moved, &R::origin(&constants));
            let velocities = points_of::<D, N>(v, vertices).map(|row| row.map(Dual::constant));
            let force = self.law.force(rate(&gradient, &velocities), s, &constants);
            add::<D, N>(vertices, y, |node, c| constant * (force * gradient[node][c]).derivative);
        });
        true
    }
}
