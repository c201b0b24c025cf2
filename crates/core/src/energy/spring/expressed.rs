//! Springs whose energy is a formula of their length.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use crate::algebra::Dual;
use crate::energy::elastic::points_of;
use crate::energy::measure::{Length, MeasuredStencils, ScalarStrain, StencilConstants, gather, scatter};
use crate::energy::patch::{Patch, Scratch, Workspace};
use crate::energy::{EnergyKind, EnergyTerm, Fault, Stencils, TermProperties, TermViews};
use crate::expression::{ExpressionError, Formula, FormulaError, Graph, NodeId, Program};
use crate::lanes::{Kernel, Lanes, dispatch_compact};
use crate::material::Psd;
use crate::scalar::Scalar;

/// A formula is no energy of a spring.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpringFormulaError {
    /// The text is no formula of `l`, `l0` and the parameters.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// A number at the rest length that is not what it has to be.
    #[error("is {value:?} {what} at the rest length l = l0 = {length:?} m")]
    Rest {
        /// The number.
        value: f64,
        /// What it is, and what it has to be.
        what: &'static str,
        /// The rest length [m].
        length: f64,
    },
}

/// The energy `E(l, l0)` [J] of a spring of length `l` and rest length `l0` [m], as a formula.
///
/// ```
/// use pliant::energy::spring::SpringFormula;
/// let spring = SpringFormula::new("k/2*(l - l0)^2 + c/4*(l - l0)^4", &[("k", 50.0), ("c", 1e3)])?;
/// assert_eq!(spring.check_at_rest(0.1), Ok(()));
/// assert_eq!(spring.stiffness_at_rest(0.1), 50.0);
/// # Ok::<(), pliant::energy::spring::SpringFormulaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SpringFormula {
    programs: Arc<SpringPrograms>,
}

/// Values of `l` and `l0`.
#[derive(Debug)]
struct SpringPrograms {
    energy: Program,
    tension: Program,
    stiffness: Program,
}

impl SpringPrograms {
    fn new(text: &str, formula: &Formula, parameters: &[(&str, f64)]) -> Result<Self, FormulaError> {
        let mut graph = Graph::default();
        let mut values = vec![graph.variable(0), graph.variable(1)];
        values.extend(parameters.iter().map(|(_, value)| graph.number(*value)));
        let energy = formula.add_to(&mut graph, &values)?;
        let tension = graph.derivative(energy, 0);
        let stiffness = graph.derivative(tension, 0);
        let program = |root: NodeId| {
            Program::new(&graph, &[root], &HashMap::new(), 2)
                .map_err(|[found, most]| ExpressionError::TooLong { found, most, place: 0..text.len() })
        };
        Ok(SpringPrograms {
            energy: program(energy)?,
            tension: program(tension)?,
            stiffness: program(stiffness)?,
        })
    }
}

/// Parts of what a spring resists its rest length with that are rounding.
const ROUNDING: f64 = 1e-10;

impl SpringFormula {
    /// Reads the formula `text` of `l`, `l0` [m] and `parameters`, in SI units.
    ///
    /// # Errors
    /// [`SpringFormulaError`]: the text is no formula, or a parameter cannot be one.
    pub fn new(text: &str, parameters: &[(&str, f64)]) -> Result<SpringFormula, SpringFormulaError> {
        let formula = Formula::with_parameters(text, &["l", "l0"], parameters)?;
        Ok(SpringFormula { programs: Arc::new(SpringPrograms::new(text, &formula, parameters)?) })
    }

    /// Checks that a spring of the rest length `length` [m] has neither energy nor tension there, and
    /// resists a change.
    ///
    /// # Errors
    /// [`SpringFormulaError::Rest`] with the number that is not what it has to be.
    pub fn check_at_rest(&self, length: f64) -> Result<(), SpringFormulaError> {
        let wrong = |value, what| Err(SpringFormulaError::Rest { value, what, length });
        let SpringPrograms { energy, tension, .. } = &*self.programs;
        let [energy, tension] = [energy, tension].map(|program| value(program, length, length));
        let stiffness = self.stiffness_at_rest(length);
        if !(stiffness.is_finite() && stiffness > 0.0) {
            return wrong(stiffness, "N/m as the stiffness, which must be a positive number,");
        }
        // Not more than a number, and not none either.
        if tension.is_nan() || tension.abs() > ROUNDING * stiffness * length {
            return wrong(tension, "N as the tension, which must be 0,");
        }
        if energy.is_nan() || energy.abs() > ROUNDING * stiffness * length * length {
            return wrong(energy, "J as the energy, which must be 0,");
        }
        Ok(())
    }

    /// The second derivative of the energy by the length, at rest [N/m].
    pub fn stiffness_at_rest(&self, length: f64) -> f64 {
        value(&self.programs.stiffness, length, length)
    }
}

/// The value of a program at a length and a rest length.
#[inline(always)]
fn value<S: Scalar>(program: &Program, length: S, rest: S) -> S {
    let mut value = [S::zero()];
    program.run(&[length, rest], &mut value);
    value[0]
}

/// Springs with one formula: `E = sum E(l, l0)`, the gradient on `x_1` is `dE/dl (x_1 - x_2) / l`.
pub struct ExpressedSprings<const D: usize> {
    body: String,
    formula: SpringFormula,
    stencils: MeasuredStencils<Length, D, 2>,
    workspace: Workspace<D>,
}

impl<const D: usize> ExpressedSprings<D> {
    /// Springs of `body` along `edges` (global vertex indices) with their rest lengths [m]; `rest` (flat,
    /// all vertices of the system) [m] says what is near what.
    ///
    /// # Panics
    /// If there are not as many lengths as edges.
    pub fn new(
        body: &str,
        formula: SpringFormula,
        edges: &[[u32; 2]],
        rest_lengths: &[f64],
        rest: &[f64],
    ) -> Self {
        let constants = |length: &f64| StencilConstants { stiffness: 1.0, rest: [*length, 0.0] };
        let constants: Vec<StencilConstants> = rest_lengths.iter().map(constants).collect();
        let stencils = MeasuredStencils::new(edges, &constants, rest);
        ExpressedSprings { body: body.into(), formula, workspace: stencils.workspace(), stencils }
    }
}

/// The length of one spring and its derivatives.
#[inline(always)]
fn length<S: Scalar, const D: usize>(x: &[[S; D]; 2]) -> (S, [[S; D]; 2]) {
    Length::deviation(x, &[S::zero(), S::zero()])
}

macro_rules! spring_kernels {
    ($($name:ident($scratch:ty);)+) => {
        $(
            struct $name<'a, const D: usize> {
                springs: &'a MeasuredStencils<Length, D, 2>,
                programs: &'a SpringPrograms,
                patch: &'a Patch,
                scratch: $scratch,
            }
        )+
    };
}

spring_kernels! {
    LengthEnergyKernel(&'a Scratch<D>);
    TensionKernel(&'a mut Scratch<D>);
    TensionRateKernel(&'a mut Scratch<D>);
}

/// `value` in lanes with a spring of their own, zero in others.
#[inline(always)]
fn own<L: Lanes>(share: L, value: L) -> L {
    L::select(L::zero().lt(share), value, L::zero())
}

impl<const D: usize> Kernel for LengthEnergyKernel<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let mut sum = L::zero();
        for pack in self.patch.packs.clone() {
            let constants = &self.springs.packs[pack];
            let x = gather::<L, D, 2>(&self.scratch.position, &self.springs.patches.index[pack]);
            let energy = value(&self.programs.energy, length(&x).0, constants.rest::<L>()[0]);
            sum += own(constants.stiffness::<L>(), energy);
        }
        sum.horizontal_sum()
    }
}

impl<const D: usize> Kernel for TensionKernel<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (position, out) = (&*self.scratch.position, &mut *self.scratch.gradient);
        for pack in self.patch.packs.clone() {
            let constants = &self.springs.packs[pack];
            let index = &self.springs.patches.index[pack];
            let (length, gradient) = length(&gather::<L, D, 2>(position, index));
            let tension = value(&self.programs.tension, length, constants.rest::<L>()[0]);
            scatter(out, index, own(constants.stiffness::<L>(), tension), &gradient);
        }
    }
}

impl<const D: usize> Kernel for TensionRateKernel<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Scratch { position, direction, gradient: out } = self.scratch;
        for pack in self.patch.packs.clone() {
            let constants = &self.springs.packs[pack];
            let index = &self.springs.patches.index[pack];
            let (x, p) = (gather::<L, D, 2>(position, index), gather::<L, D, 2>(direction, index));
            let mut along = [[Dual::constant(L::zero()); D]; 2];
            for node in 0..2 {
                for c in 0..D {
                    along[node][c] = Dual { value: x[node][c], derivative: p[node][c] };
                }
            }
            let (length, gradient) = length(&along);
            let rest = Dual::constant(constants.rest::<L>()[0]);
            let tension = value(&self.programs.tension, length, rest);
            let mut product = [[L::zero(); D]; 2];
            for node in 0..2 {
                for c in 0..D {
                    product[node][c] =
                        own(constants.stiffness::<L>(), (tension * gradient[node][c]).derivative);
                }
            }
            scatter(out, index, L::one(), &product);
        }
    }
}

impl<const D: usize> EnergyTerm for ExpressedSprings<D> {
    fn name(&self) -> String {
        format!("springs of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let ExpressedSprings { stencils: springs, workspace, formula, .. } = self;
        let programs = &*formula.programs;
        springs.patches.sum(workspace, x, |patch, scratch| {
            dispatch_compact(LengthEnergyKernel { springs, programs, patch, scratch })
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let ExpressedSprings { stencils: springs, workspace, formula, .. } = self;
        let programs = &*formula.programs;
        springs.patches.evaluate(workspace, x, None, |patch, scratch| {
            dispatch_compact(TensionKernel { springs, programs, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.stencils.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let ExpressedSprings { stencils: springs, workspace, formula, .. } = self;
        let programs = &*formula.programs;
        springs.patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            dispatch_compact(TensionRateKernel { springs, programs, patch, scratch });
        });
        springs.patches.add_rows(workspace, 0, y);
    }

    fn stencils(&mut self) -> Stencils {
        self.stencils.patches.lanes()
    }

    /// `E'' n n^T + E'/l (I - n n^T)`; projected, each factor is zero where it is negative.
    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        let lanes = self.stencils.patches.lanes_in(stencils).zip(out.chunks_exact_mut(3 * D * D));
        for ((vertices, pack, lane), out) in lanes {
            let (share, [rest, _]) = self.stencils.constants(pack, lane);
            let (length, [n, _]) = length(&points_of::<D, 2>(x, &vertices));
            let SpringPrograms { tension, stiffness, .. } = &*self.formula.programs;
            let factors = [value(stiffness, length, rest), value(tension, length, rest) / length];
            // A comparison, not a maximum: NaN is kept.
            let clamp = |factor: f64| if psd == Psd::Projected && factor < 0.0 { 0.0 } else { factor };
            let [along, across] = factors.map(clamp);
            let (same, rest) = out.split_at_mut(D * D);
            let (opposite, last) = rest.split_at_mut(D * D);
            for i in 0..D {
                for j in 0..D {
                    let unit = if i == j { across } else { 0.0 };
                    let entry = (along - across).mul_add(n[i] * n[j], unit);
                    // Lanes that fill up have no spring.
                    let entry = if share == 0.0 { 0.0 } else { entry };
                    same[i * D + j] = entry;
                    opposite[i * D + j] = -entry;
                    last[i * D + j] = entry;
                }
            }
        }
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        let tension = |points: &[[f64; D]; 2], rest: &[f64; 2]| {
            value(&self.formula.programs.tension, length(points).0, rest[0])
        };
        let Some(Fault::Stencil { index, .. }) = self.stencils.fault(&self.body, tension, x) else {
            return None;
        };
        let spring = self.stencils.patches.stencils().find(|(spring, ..)| *spring == index);
        let length = spring.map_or(f64::NAN, |(_, vertices, ..)| length(&points_of::<D, 2>(x, &vertices)).0);
        Some(Fault::Spring { body: self.body.clone(), spring: index, length })
    }

    fn bytes(&self) -> usize {
        self.stencils.bytes() + self.workspace.bytes()
    }
}

impl<const D: usize> TermViews for ExpressedSprings<D> {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::spring::Springs;

    const FORMULA: &str = "k/2*(l - l0)^2";

    /// A chain that is stretched, bent and pressed.
    fn chain() -> (Vec<[u32; 2]>, Vec<f64>, Vec<f64>, Vec<f64>) {
        let count = 20;
        let rest: Vec<f64> = (0..count).flat_map(|i| [f64::from(i), 0.1 * f64::from(i % 3), 0.0]).collect();
        let moved =
            |(i, x): (usize, &f64)| x * (1.0 + 0.3 * (1.7 * i as f64).sin()) + 0.05 * (i as f64).cos();
        let x = rest.iter().enumerate().map(moved).collect();
        let edges: Vec<[u32; 2]> = (0..count as u32 - 1)
            .map(|i| [i, i + 1])
            .chain((0..count as u32 - 3).map(|i| [i + 3, i]))
            .collect();
        let lengths = edges.iter().enumerate().map(|(i, _)| 0.8 + 0.05 * i as f64).collect();
        (edges, lengths, rest, x)
    }

    fn formula(text: &str, k: f64) -> SpringFormula {
        SpringFormula::new(text, &[("k", k)]).unwrap()
    }

    #[test]
    fn quadratic_formulas_are_springs() {
        let (edges, lengths, rest, x) = chain();
        let mut by_hand =
            Springs::<3>::new("chain", &edges, &vec![70.0; edges.len()], &lengths, rest.len() / 3);
        let mut found = ExpressedSprings::<3>::new("chain", formula(FORMULA, 70.0), &edges, &lengths, &rest);
        assert!((found.energy(&x) / by_hand.energy(&x) - 1.0).abs() < 1e-13);
        let p: Vec<f64> = (0..x.len()).map(|i| (0.3 * i as f64).sin()).collect();
        let results = |term: &mut dyn EnergyTerm| {
            let (mut g, mut y) = (vec![0.0; x.len()], vec![0.0; x.len()]);
            term.add_gradient(&x, &mut g);
            term.add_hessian_product(&x, &p, &mut y);
            [g, y]
        };
        for (expected, found) in results(&mut by_hand).iter().zip(&results(&mut found)) {
            let scale = expected.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            for (a, b) in expected.iter().zip(found) {
                assert!((a - b).abs() < 1e-12 * scale, "{a} {b}");
            }
        }
    }

    /// The blocks of the matrix against the product with unit vectors, and without what is negative.
    #[test]
    fn blocks_are_the_derivative_of_the_force() {
        let (_, _, rest, x) = chain();
        let cubic = formula("k/2*(l - l0)^2 + k/3*(l - l0)^3", 70.0);
        for (length, stretched) in [(0.5, true), (1.9, false)] {
            let mut term = ExpressedSprings::<3>::new("chain", cubic.clone(), &[[0, 1]], &[length], &rest);
            let lanes = term.stencils().vertices.len() / 2;
            let mut blocks = vec![0.0; lanes * 27];
            term.stencil_hessians(0..lanes, &x, Psd::Exact, &mut blocks);
            for axis in 0..3 {
                let (mut p, mut y) = (vec![0.0; x.len()], vec![0.0; x.len()]);
                p[axis] = 1.0;
                term.add_hessian_product(&x, &p, &mut y);
                for i in 0..3 {
                    let sum: f64 = (0..lanes).map(|lane| blocks[lane * 27 + 3 * i + axis]).sum();
                    assert!((sum - y[i]).abs() < 1e-11 * 70.0, "{sum} {}", y[i]);
                    let sum: f64 = (0..lanes).map(|lane| blocks[lane * 27 + 9 + 3 * i + axis]).sum();
                    assert!((sum - y[3 + i]).abs() < 1e-11 * 70.0, "{sum} {}", y[3 + i]);
                }
            }
            let mut projected = vec![0.0; lanes * 27];
            term.stencil_hessians(0..lanes, &x, Psd::Projected, &mut projected);
            assert_eq!(projected == blocks, stretched, "a pressed spring gives way sideways");
        }
    }

    #[test]
    fn mistakes_are_named() {
        let message = |text: &str, names: &[(&str, f64)]| {
            let found = SpringFormula::new(text, names).and_then(|formula| formula.check_at_rest(0.5));
            found.expect_err(text).to_string()
        };
        assert_eq!(message("k*(l - x)", &[("k", 1.0)]), "unknown name `x`");
        assert_eq!(message("l - l0", &[("k", 1.0)]), "`k` is not in the formula: remove it, or use it there");
        assert!(message("(l - l0)^2", &[("l", 1.0)]).starts_with("`l` has a meaning of its own"));
        let at_rest = |text: &str| message(text, &[("k", 8.0)]);
        assert_eq!(
            at_rest("k/2*l^2"),
            "is 4.0 N as the tension, which must be 0, at the rest length l = l0 = 0.5 m"
        );
        assert!(at_rest("k/2*(l - l0)^2 + 1").starts_with("is 1.0 J as the energy, which must be 0,"));
        assert!(at_rest("-k/2*(l - l0)^2").starts_with("is -8.0 N/m as the stiffness"));
        assert!(at_rest("k*log(l - l0)").starts_with("is NaN N/m as the stiffness"));
    }
}
