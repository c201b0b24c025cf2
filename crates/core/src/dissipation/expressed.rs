//! Dashpots whose dissipation function is a formula of the rate of their length.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::{DissipationViews, DissipativeTerm, PositionProducts};
use crate::algebra::Dual;
use crate::energy::elastic::points_of;
use crate::energy::measure::{Length, MeasuredStencils, ScalarStrain, StencilConstants, gather, scatter};
use crate::energy::patch::{Patch, Scratch, Workspace};
use crate::energy::{Fault, Stencils};
use crate::expression::{ExpressionError, Formula, FormulaError, Graph, NodeId, Program};
use crate::lanes::{Kernel, Lanes, dispatch_compact};
use crate::scalar::Scalar;

/// A formula is no dissipation function of a spring.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DashpotFormulaError {
    /// The text is no formula of `rate`, `l`, `l0` and the parameters.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// A number that is not what it has to be.
    #[error("is {value:?} {what} at rate = {rate:?} m/s, l = l0 = {length:?} m")]
    Value {
        /// The number.
        value: f64,
        /// Its unit and meaning, and a phrase that says which values are right.
        what: &'static str,
        /// The rate [m/s].
        rate: f64,
        /// The rest length [m].
        length: f64,
    },
}

/// The dissipation function `R(rate, l, l0)` [W] of a spring whose length `l` [m] changes at `rate` [m/s] and
/// is `l0` at rest, as a formula.
///
/// ```
/// use pliant::dissipation::DashpotFormula;
/// let damper = DashpotFormula::new("c/2*rate^2 + d/4*rate^4", &[("c", 0.5), ("d", 3.0)])?;
/// assert_eq!(damper.check(0.1), Ok(()));
/// assert_eq!(damper.constant_at_rest(0.1), 0.5);
/// # Ok::<(), pliant::dissipation::DashpotFormulaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DashpotFormula {
    programs: Arc<DashpotPrograms>,
    text: String,
    parameters: Vec<(String, f64)>,
}

/// Values of `rate`, `l`, `l0` and of the parameter by which there is a derivative.
#[derive(Debug)]
struct DashpotPrograms {
    dissipation: Program,
    /// `dR/d rate` [N].
    force: Program,
    /// The parameter's value; zero without any.
    number: f64,
}

impl DashpotPrograms {
    /// Programs of a formula, or of its derivative `by` one of the parameters.
    fn new(
        text: &str,
        formula: &Formula,
        parameters: &[(&str, f64)],
        by: Option<usize>,
    ) -> Result<Self, FormulaError> {
        let (mut graph, last) = (Graph::default(), VARIABLES.len() as u16);
        let mut values: Vec<NodeId> = (0..last).map(|variable| graph.variable(variable)).collect();
        for (index, (_, value)) in parameters.iter().enumerate() {
            let is_variable = by == Some(index);
            values.push(if is_variable { graph.variable(last) } else { graph.number(*value) });
        }
        let mut dissipation = formula.add_to(&mut graph, &values)?;
        if by.is_some() {
            dissipation = graph.derivative(dissipation, last);
        }
        let force = graph.derivative(dissipation, 0);
        let program = |root: NodeId| {
            Program::new(&graph, &[root], &HashMap::new(), VARIABLES.len() + 1)
                .map_err(|[found, most]| ExpressionError::TooLong { found, most, place: 0..text.len() })
        };
        let number = by.map_or(0.0, |by| parameters[by].1);
        Ok(DashpotPrograms { dissipation: program(dissipation)?, force: program(force)?, number })
    }

    /// The dissipation function [W].
    #[inline(always)]
    fn dissipation<S: Scalar>(&self, inputs: [S; 3]) -> S {
        self.value(&self.dissipation, inputs)
    }

    /// The force [N].
    #[inline(always)]
    fn force<S: Scalar>(&self, inputs: [S; 3]) -> S {
        self.value(&self.force, inputs)
    }

    /// The value of a program at a rate, a length and a rest length.
    #[inline(always)]
    fn value<S: Scalar>(&self, program: &Program, [rate, length, rest]: [S; 3]) -> S {
        let mut value = [S::zero()];
        program.run(&[rate, length, rest, S::splat(self.number)], &mut value);
        value[0]
    }

    /// `d2R/d rate2` [N s/m].
    fn slope(&self, [rate, length, rest]: [f64; 3]) -> f64 {
        let rate = Dual { value: rate, derivative: 1.0 };
        self.force([rate, Dual::constant(length), Dual::constant(rest)]).derivative
    }
}

/// Names of the variables, in the order of the inputs of programs.
const VARIABLES: [&str; 3] = ["rate", "l", "l0"];
/// Parts of the slowest power of the list that are rounding.
const ROUNDING: f64 = 1e-10;
/// Rates at which the force must resist [m/s], both ways.
const PROBED: [f64; 5] = [1e-3, 1e-2, 0.1, 1.0, 10.0];

impl DashpotFormula {
    /// Reads the formula `text` of `rate` [m/s], `l`, `l0` [m] and `parameters`, in SI units.
    ///
    /// # Errors
    /// [`DashpotFormulaError`]: the text is no formula, or a parameter cannot be one.
    pub fn new(text: &str, parameters: &[(&str, f64)]) -> Result<DashpotFormula, DashpotFormulaError> {
        let formula = Formula::with_parameters(text, &VARIABLES, parameters)?;
        let own = |(name, value): &(&str, f64)| ((*name).to_owned(), *value);
        Ok(DashpotFormula {
            programs: Arc::new(DashpotPrograms::new(text, &formula, parameters, None)?),
            text: text.to_owned(),
            parameters: parameters.iter().map(own).collect(),
        })
    }

    /// Its derivative by a parameter: the dissipation function of dashpots whose force is that of this one
    /// differentiated. `None` where there is no such parameter.
    pub fn derivative(&self, parameter: &str) -> Option<DashpotFormula> {
        let by = self.parameters.iter().position(|(name, _)| name == parameter)?;
        let parameters: Vec<(&str, f64)> =
            self.parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let formula = Formula::with_parameters(&self.text, &VARIABLES, &parameters).ok()?;
        let programs = DashpotPrograms::new(&self.text, &formula, &parameters, Some(by)).ok()?;
        Some(DashpotFormula { programs: Arc::new(programs), ..self.clone() })
    }

    /// Checks a spring of the rest length `length` [m] there: nothing is taken from what does not move, the
    /// force is zero then and has a finite slope that does not push, and motion is resisted at every one of a
    /// few rates, either way.
    ///
    /// # Errors
    /// [`DashpotFormulaError::Value`] with the number that is not what it has to be.
    pub fn check(&self, length: f64) -> Result<(), DashpotFormulaError> {
        let wrong = |value, what, rate| Err(DashpotFormulaError::Value { value, what, rate, length });
        let dissipation = |rate: f64| self.programs.dissipation([rate, length, length]);
        let force = |rate: f64| self.programs.force([rate, length, length]);
        let least = PROBED.map(|rate| dissipation(rate).abs()).into_iter().fold(f64::INFINITY, f64::min);
        let power = dissipation(0.0);
        if power.is_nan() || power.abs() > ROUNDING * least {
            return wrong(power, "W, which must be 0,", 0.0);
        }
        let push = force(0.0);
        if push.is_nan() || push.abs() > ROUNDING * force(PROBED[0]).abs() {
            return wrong(push, "N as the force, which must be 0,", 0.0);
        }
        let constant = self.constant_at_rest(length);
        if !(constant.is_finite() && constant >= 0.0) {
            return wrong(
                constant,
                "N s/m as the slope of the force, which must be a number, 0 or more,",
                0.0,
            );
        }
        for rate in PROBED.into_iter().flat_map(|rate| [rate, -rate]) {
            let force = force(rate);
            if !(force.is_finite() && force * rate >= 0.0) {
                return wrong(force, "N as the force, which must resist,", rate);
            }
        }
        Ok(())
    }

    /// The second derivative of the function by the rate, at rest [N s/m].
    pub fn constant_at_rest(&self, length: f64) -> f64 {
        self.programs.slope([0.0, length, length])
    }
}

/// Dashpots beside springs, with one formula: `R = sum R(rate, l, l0)` with `rate = dl/dt = n . (v_0 - v_1)`;
/// the derivative by `v_0` is `dR/d rate n`.
pub struct ExpressedDashpots<const D: usize> {
    body: String,
    formula: DashpotFormula,
    stencils: MeasuredStencils<Length, D, 2>,
    workspace: Workspace<D>,
}

impl<const D: usize> ExpressedDashpots<D> {
    /// Dashpots of `body` along `edges` (global vertex indices) with their rest lengths [m]; `rest` (flat,
    /// all vertices of the system) [m] says what is near what.
    ///
    /// # Panics
    /// If there are not as many lengths as edges.
    pub fn new(
        body: &str,
        formula: DashpotFormula,
        edges: &[[u32; 2]],
        rest_lengths: &[f64],
        rest: &[f64],
    ) -> Self {
        let constants = |length: &f64| StencilConstants { stiffness: 1.0, rest: [*length, 0.0] };
        let constants: Vec<StencilConstants> = rest_lengths.iter().map(constants).collect();
        let stencils = MeasuredStencils::new(edges, &constants, rest);
        ExpressedDashpots { body: body.into(), formula, workspace: stencils.workspace(), stencils }
    }

    /// Each dashpot, one after the other: its vertices, rest length and places.
    fn each(&self, x: &[f64], mut visit: impl FnMut(&[u32; 2], f64, &[[f64; D]; 2])) {
        for (_, vertices, pack, lane) in self.stencils.patches.stencils() {
            let (_, [rest, _]) = self.stencils.constants(pack, lane);
            visit(&vertices, rest, &points_of::<D, 2>(x, &vertices));
        }
    }
}

/// The length of one spring and its derivatives.
#[inline(always)]
fn length<S: Scalar, const D: usize>(x: &[[S; D]; 2]) -> (S, [[S; D]; 2]) {
    Length::deviation(x, &[S::zero(), S::zero()])
}

/// Places that move along a direction.
fn along<const D: usize>(points: &[[f64; D]; 2], directions: &[[f64; D]; 2]) -> [[Dual<f64>; D]; 2] {
    let entry = |node: usize, c: usize| Dual { value: points[node][c], derivative: directions[node][c] };
    std::array::from_fn(|node| std::array::from_fn(|c| entry(node, c)))
}

/// `gradient . v`.
#[inline(always)]
fn rate<S: Scalar, const D: usize>(gradient: &[[S; D]; 2], v: &[[S; D]; 2]) -> S {
    let mut rate = S::zero();
    for node in 0..2 {
        for c in 0..D {
            rate = gradient[node][c].mul_add(v[node][c], rate);
        }
    }
    rate
}

/// Forces of a patch; gives the power [W], or the dissipation functions.
struct DashpotKernel<'a, const D: usize> {
    dashpots: &'a MeasuredStencils<Length, D, 2>,
    programs: &'a DashpotPrograms,
    patch: &'a Patch,
    scratch: &'a mut Scratch<D>,
    is_power: bool,
}

impl<const D: usize> Kernel for DashpotKernel<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Scratch { position, direction, gradient: out } = self.scratch;
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let constants = &self.dashpots.packs[pack];
            let index = &self.dashpots.patches.index[pack];
            let (x, v) = (gather::<L, D, 2>(position, index), gather::<L, D, 2>(direction, index));
            let (length, gradient) = length(&x);
            let rate = rate(&gradient, &v);
            let inputs = [rate, length, constants.rest::<L>()[0]];
            // Lanes that fill up have no dashpot.
            let own = |value| L::select(L::zero().lt(constants.stiffness::<L>()), value, L::zero());
            let force = own(self.programs.force(inputs));
            sum += if self.is_power { force * rate } else { own(self.programs.dissipation(inputs)) };
            scatter(out, index, force, &gradient);
        }
        sum.horizontal_sum()
    }
}

impl<const D: usize> ExpressedDashpots<D> {
    fn sum(&mut self, x: &[f64], v: &[f64], is_power: bool) -> f64 {
        let ExpressedDashpots { stencils: dashpots, workspace, formula, .. } = self;
        let programs = &*formula.programs;
        dashpots.patches.sum_along(workspace, x, v, |patch, scratch| {
            dispatch_compact(DashpotKernel { dashpots, programs, patch, scratch, is_power })
        })
    }
}

impl<const D: usize> DissipativeTerm for ExpressedDashpots<D> {
    fn name(&self) -> String {
        format!("damping of the springs of `{}` by a formula", self.body)
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        let ExpressedDashpots { stencils: dashpots, workspace, formula, .. } = self;
        let programs = &*formula.programs;
        dashpots.patches.evaluate(workspace, x, Some(v), |patch, scratch| {
            dispatch_compact(DashpotKernel { dashpots, programs, patch, scratch, is_power: true });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.stencils.patches.add_rows(&self.workspace, first, g);
    }

    /// `d2R/d rate2 (n . p) n`.
    fn add_damping_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) {
        let programs = &*self.formula.programs;
        self.each(x, |vertices, rest, points| {
            let (length, gradient) = length(points);
            let [of_v, of_p] = [v, p].map(|rows| rate(&gradient, &points_of::<D, 2>(rows, vertices)));
            let force = programs.slope([of_v, length, rest]) * of_p;
            for (vertex, gradient) in vertices.iter().zip(&gradient) {
                let row = &mut y[*vertex as usize * D..][..D];
                row.iter_mut().zip(gradient).for_each(|(y, slope)| *y += force * slope);
            }
        });
    }

    fn stencils(&mut self) -> Stencils {
        self.stencils.patches.lanes()
    }

    /// `d2R/d rate2 n n^T`.
    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], v: &[f64], out: &mut [f64]) {
        let lanes = self.stencils.patches.lanes_in(stencils).zip(out.chunks_exact_mut(3 * D * D));
        for ((vertices, pack, lane), out) in lanes {
            let (share, [rest, _]) = self.stencils.constants(pack, lane);
            let (length, gradient) = length(&points_of::<D, 2>(x, &vertices));
            let rate = rate(&gradient, &points_of::<D, 2>(v, &vertices));
            // Lanes that fill up have no dashpot.
            let constant = if share == 0.0 { 0.0 } else { self.formula.programs.slope([rate, length, rest]) };
            let n = gradient[0];
            for (block, sign) in out.chunks_exact_mut(D * D).zip([1.0, -1.0, 1.0]) {
                for (ij, entry) in block.iter_mut().enumerate() {
                    *entry = sign * constant * n[ij / D] * n[ij % D];
                }
            }
        }
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.sum(x, v, true)
    }

    fn value(&mut self, x: &[f64], v: &[f64]) -> f64 {
        self.sum(x, v, false)
    }

    fn fault(&self, x: &[f64], v: &[f64]) -> Option<Fault> {
        let faulty = self.stencils.patches.stencils().filter(|(_, vertices, pack, lane)| {
            let (_, [rest, _]) = self.stencils.constants(*pack, *lane);
            let (length, gradient) = length(&points_of::<D, 2>(x, vertices));
            let rate = rate(&gradient, &points_of::<D, 2>(v, vertices));
            !self.formula.programs.force([rate, length, rest]).is_finite()
        });
        let index = faulty.map(|(spring, ..)| spring).min()?;
        Some(Fault::Stencil { what: "spring", body: self.body.clone(), index })
    }

    fn bytes(&self) -> usize {
        self.stencils.bytes() + self.workspace.bytes()
    }
}

impl<const D: usize> DissipationViews for ExpressedDashpots<D> {}

impl<const D: usize> PositionProducts for ExpressedDashpots<D> {
    /// `(n . p) (f_rate dn.v + f_l n) + f dn.p`, with `f = dR/d rate` and `dn.v` the change of `n` along `v`.
    fn add_position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        let programs = &*self.formula.programs;
        self.each(x, |vertices, rest, points| {
            let [of_v, of_p] = [v, p].map(|rows| {
                let directions = points_of::<D, 2>(rows, vertices);
                let (length, gradient) = length(&along(points, &directions));
                (length, gradient)
            });
            let (length, rest) = (of_v.0.value, Dual::constant(rest));
            // Rates are the derivatives of lengths.
            let (rate, by_p) = (of_v.0.derivative, of_p.0.derivative);
            let inputs = |rate, length| [rate, length, rest];
            let moving = |value| Dual { value, derivative: 1.0 };
            let by_rate = programs.force(inputs(moving(rate), Dual::constant(length)));
            let by_length = programs.force(inputs(Dual::constant(rate), moving(length))).derivative;
            for (node, vertex) in vertices.iter().enumerate() {
                let row = &mut y[*vertex as usize * D..][..D];
                for (c, y) in row.iter_mut().enumerate() {
                    let (of_v, of_p) = (&of_v.1[node][c], &of_p.1[node][c]);
                    let bent = by_rate.derivative * of_v.derivative + by_length * of_v.value;
                    *y += by_p * bent + by_rate.value * of_p.derivative;
                }
            }
        });
        true
    }

    /// The change of `f n` along `u`.
    fn add_position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        let programs = &*self.formula.programs;
        self.each(x, |vertices, rest, points| {
            let (length, gradient) = length(&along(points, &points_of::<D, 2>(u, vertices)));
            let velocities = points_of::<D, 2>(v, vertices).map(|row| row.map(Dual::constant));
            let force = programs.force([rate(&gradient, &velocities), length, Dual::constant(rest)]);
            for (vertex, gradient) in vertices.iter().zip(&gradient) {
                let row = &mut y[*vertex as usize * D..][..D];
                row.iter_mut().zip(gradient).for_each(|(y, slope)| *y += (force * *slope).derivative);
            }
        });
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dissipation::MeasuredRate;

    const EDGES: [[u32; 2]; 4] = [[0, 1], [1, 2], [2, 3], [0, 3]];
    const LENGTHS: [f64; 4] = [0.7, 1.1, 0.4, 0.9];

    /// `i`-th numbers of a sequence without pattern in (-1, 1).
    fn scattered<const D: usize>(seed: usize) -> Vec<f64> {
        let number = |i: usize| 2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0;
        (0..4 * D).map(|i| number(i + 100 * seed)).collect()
    }

    fn dashpots<const D: usize>(formula: DashpotFormula) -> ExpressedDashpots<D> {
        ExpressedDashpots::new("a", formula, &EDGES, &LENGTHS, &scattered::<D>(0))
    }

    fn force(term: &mut dyn DissipativeTerm, x: &[f64], v: &[f64]) -> Vec<f64> {
        let mut g = vec![0.0; x.len()];
        assert!(term.evaluate(x, v));
        term.add_rows(0, &mut g);
        g
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// The derivative at 0, by differences of fourth order.
    fn difference(f: impl Fn(f64) -> f64) -> f64 {
        let h = 1e-3;
        (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h)
    }

    #[test]
    fn a_square_is_a_dashpot() {
        let (x, v, p) = (scattered::<3>(1), scattered::<3>(2), scattered::<3>(3));
        let mut by_formula = dashpots::<3>(DashpotFormula::new("c/2*rate^2 + 0*l", &[("c", 2.5)]).unwrap());
        let constants = [StencilConstants { stiffness: 2.5, rest: [0.0; 2] }; 4];
        let mut by_hand = MeasuredRate::<Length, 3, 2>::new("a", &EDGES, &constants, &scattered::<3>(0));
        let close = |a: &[f64], b: &[f64]| {
            let size = dot(b, b).sqrt();
            assert!(size > 0.1 && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14 * size), "{a:?} {b:?}");
        };
        close(&force(&mut by_formula, &x, &v), &force(&mut by_hand, &x, &v));
        close(&[by_formula.power(&x, &v)], &[by_hand.power(&x, &v)]);
        close(&[by_formula.value(&x, &v)], &[by_hand.value(&x, &v)]);
        let product = |add: &mut dyn FnMut(&mut [f64])| {
            let mut y = vec![0.0; x.len()];
            add(&mut y);
            y
        };
        let pairs: [[Vec<f64>; 2]; 3] = [
            [
                product(&mut |y| by_formula.add_damping_product(&x, &v, &p, y)),
                product(&mut |y| by_hand.add_damping_product(&x, &v, &p, y)),
            ],
            [
                product(&mut |y| assert!(by_formula.add_position_product(&x, &v, &p, y))),
                product(&mut |y| assert!(by_hand.add_position_product(&x, &v, &p, y))),
            ],
            [
                product(&mut |y| assert!(by_formula.add_position_change(&x, &v, &p, y))),
                product(&mut |y| assert!(by_hand.add_position_change(&x, &v, &p, y))),
            ],
        ];
        pairs.iter().for_each(|[a, b]| close(a, b));
    }

    fn check_derivatives<const D: usize>() {
        let text = "c/2*rate^2*(1 + l/l0) + d*l*rate^4";
        let parameters = [("c", 2.0), ("d", 0.7)];
        let formula = DashpotFormula::new(text, &parameters).unwrap();
        let [x, v, p, q] = [1, 2, 3, 4].map(scattered::<D>);
        let moved =
            |x: &[f64], p: &[f64], h: f64| -> Vec<f64> { x.iter().zip(p).map(|(x, p)| x + h * p).collect() };
        let term = || dashpots::<D>(formula.clone());
        let close = |found: f64, expected: f64| {
            assert!((found - expected).abs() < 1e-8 * expected.abs().max(1.0), "{found}, {expected}");
        };
        let forces = |x: &[f64], v: &[f64]| force(&mut term(), x, v);
        close(dot(&forces(&x, &v), &p), difference(|h| term().value(&x, &moved(&v, &p, h))));
        close(dot(&forces(&x, &v), &v), term().power(&x, &v));
        let [mut damping, mut by_positions, mut change] = [(); 3].map(|()| vec![0.0; x.len()]);
        term().add_damping_product(&x, &v, &p, &mut damping);
        close(dot(&damping, &q), difference(|h| dot(&forces(&x, &moved(&v, &p, h)), &q)));
        assert!(term().add_position_product(&x, &v, &p, &mut by_positions));
        close(dot(&by_positions, &q), difference(|h| dot(&forces(&moved(&x, &q, h), &v), &p)));
        assert!(term().add_position_change(&x, &v, &q, &mut change));
        let both = [dot(&change, &p), dot(&by_positions, &q)];
        assert!((both[0] - both[1]).abs() < 1e-12 * both[0].abs().max(1.0), "{both:?}");
        // The blocks together are the matrix of the product.
        let mut blocked = term();
        let Stencils { size, vertices } = blocked.stencils();
        let mut blocks = vec![0.0; vertices.len() / size * 3 * D * D];
        blocked.stencil_dampings(0..vertices.len() / size, &x, &v, &mut blocks);
        let mut product = vec![0.0; x.len()];
        for (ends, blocks) in vertices.chunks_exact(2).zip(blocks.chunks_exact(3 * D * D)) {
            for (block, (a, b)) in blocks.chunks_exact(D * D).zip([(0, 0), (0, 1), (1, 1)]) {
                for ij in 0..D * D {
                    let [a, b] = [ends[a] as usize * D + ij / D, ends[b] as usize * D + ij % D];
                    product[a] += block[ij] * p[b];
                    if a / D != b / D {
                        product[b] += block[ij] * p[a];
                    }
                }
            }
        }
        let error = product.iter().zip(&damping).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(error < 1e-12, "{error:e}");
        // By a parameter.
        let by_d = formula.derivative("d").unwrap();
        let of = |d: f64| dashpots::<D>(DashpotFormula::new(text, &[("c", 2.0), ("d", d)]).unwrap());
        let along = |h: f64| dot(&force(&mut of(0.7 + h), &x, &v), &p);
        close(dot(&force(&mut dashpots::<D>(by_d), &x, &v), &p), difference(along));
        assert!(formula.derivative("e").is_none());
    }

    #[test]
    fn products_are_derivatives_of_forces_and_forces_of_the_function() {
        check_derivatives::<2>();
        check_derivatives::<3>();
    }

    #[test]
    fn functions_that_push_are_none() {
        let error = |text: &str| {
            let formula = DashpotFormula::new(text, &[("c", 2.0)]);
            formula.and_then(|formula| formula.check(0.5)).unwrap_err().to_string()
        };
        let at_rest = "at rate = 0.0 m/s, l = l0 = 0.5 m";
        assert_eq!(error("c/2*rate^2 + 1"), format!("is 1.0 W, which must be 0, {at_rest}"));
        assert_eq!(error("c*rate"), format!("is 2.0 N as the force, which must be 0, {at_rest}"));
        assert!(error("-c*rate^2").starts_with("is -4.0 N s/m as the slope of the force"));
        let pushes = error("c*(rate^2 - rate^4)");
        assert!(
            pushes.starts_with("is -4.0 N as the force, which must resist, at rate = 1.0 m/s"),
            "{pushes}"
        );
        assert!(error("c*abs(rate)^1.5").contains("N s/m as the slope of the force"));
        assert!(error("c*speed^2").contains("unknown name `speed`"));
        assert!(error("rate^2").contains("`c` is not in the formula"));
    }
}
