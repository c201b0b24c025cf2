//! Laws of one measure: the energy of its deviation, and the dissipation of its rate.

use std::collections::HashMap;

use crate::algebra::Dual;
use crate::expression::{ExpressionError, Formula, FormulaError, Graph, NodeId, Program};
use crate::scalar::Scalar;

/// Energy as a function of one measure, for stiffness 1.
pub trait ScalarLaw: Send + Sync + 'static {
    /// True for `1/2 s^2`, whose projected Hessian some measures know in closed form.
    const IS_SQUARE: bool = false;

    /// Returns the origin of deviations: the rest value, or zero if the law uses the measure itself.
    fn origin<S: Scalar>(rest: &[S; 2]) -> [S; 2];

    /// Returns `psi(s)`.
    fn energy<S: Scalar>(&self, s: S, rest: &[S; 2]) -> S;

    /// Returns `d psi/ds`.
    fn force<S: Scalar>(&self, s: S, rest: &[S; 2]) -> S;
}

/// Dissipation function of the rate of one measure, for damping constant 1.
pub trait RateLaw: Send + Sync + 'static {
    /// Suffix of the names of terms with this law.
    const SUFFIX: &'static str = "";
    /// True for `1/2 rate^2`, whose force is linear in the velocities.
    const IS_SQUARE: bool = false;

    /// Returns the origin of deviations, see [`ScalarLaw::origin`].
    fn origin<S: Scalar>(rest: &[S; 2]) -> [S; 2];

    /// Returns `R(rate, s)`.
    fn dissipation<S: Scalar>(&self, rate: S, s: S, rest: &[S; 2]) -> S;

    /// Returns `dR/d rate`.
    fn force<S: Scalar>(&self, rate: S, s: S, rest: &[S; 2]) -> S;

    /// Returns `d2R/d rate2`.
    #[inline(always)]
    fn constant<S: Scalar>(&self, rate: S, s: S, rest: &[S; 2]) -> S {
        let rate = Dual { value: rate, derivative: S::one() };
        self.force(rate, Dual::constant(s), &rest.map(Dual::constant)).derivative
    }
}

/// Quadratic law: `1/2 s^2` of a deviation, `1/2 rate^2` of a rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Square;

impl ScalarLaw for Square {
    const IS_SQUARE: bool = true;

    #[inline(always)]
    fn origin<S: Scalar>(rest: &[S; 2]) -> [S; 2] {
        *rest
    }

    #[inline(always)]
    fn energy<S: Scalar>(&self, s: S, _: &[S; 2]) -> S {
        S::splat(0.5) * s * s
    }

    #[inline(always)]
    fn force<S: Scalar>(&self, s: S, _: &[S; 2]) -> S {
        s
    }
}

impl RateLaw for Square {
    const IS_SQUARE: bool = true;

    #[inline(always)]
    fn origin<S: Scalar>(rest: &[S; 2]) -> [S; 2] {
        *rest
    }

    #[inline(always)]
    fn dissipation<S: Scalar>(&self, rate: S, _: S, _: &[S; 2]) -> S {
        S::splat(0.5) * rate * rate
    }

    #[inline(always)]
    fn force<S: Scalar>(&self, rate: S, _: S, _: &[S; 2]) -> S {
        rate
    }
}

/// Maximum number of variables of a formula, plus the parameter of a derivative.
const INPUTS: usize = 4;

/// A formula of a few variables and its derivative with respect to the first of them, as programs.
#[derive(Debug)]
pub(crate) struct FormulaPrograms {
    value: Program,
    slope: Program,
    /// Number of variables, and the value of the parameter for a derivative.
    variables: usize,
    number: f64,
}

impl FormulaPrograms {
    /// Compiles a formula of this many variables, or its derivative with respect to parameter `by`.
    pub(crate) fn new(
        text: &str,
        formula: &Formula,
        variables: usize,
        parameters: &[(&str, f64)],
        by: Option<usize>,
    ) -> Result<Self, FormulaError> {
        let (mut graph, last) = (Graph::default(), variables as u16);
        let mut values: Vec<NodeId> = (0..last).map(|variable| graph.variable(variable)).collect();
        for (index, (_, value)) in parameters.iter().enumerate() {
            let is_variable = by == Some(index);
            values.push(if is_variable { graph.variable(last) } else { graph.number(*value) });
        }
        let mut value = formula.add_to(&mut graph, &values)?;
        if by.is_some() {
            value = graph.derivative(value, last);
        }
        let slope = graph.derivative(value, 0);
        let program = |root: NodeId| {
            Program::new(&graph, &[root], &HashMap::new(), variables + 1)
                .map_err(|[found, most]| ExpressionError::TooLong { found, most, place: 0..text.len() })
        };
        let number = by.map_or(0.0, |by| parameters[by].1);
        Ok(FormulaPrograms { value: program(value)?, slope: program(slope)?, variables, number })
    }

    #[inline(always)]
    fn run<S: Scalar, const N: usize>(&self, program: &Program, variables: [S; N]) -> S {
        let (mut inputs, mut value) = ([S::zero(); INPUTS], [S::zero()]);
        inputs[..N].copy_from_slice(&variables);
        inputs[N] = S::splat(self.number);
        program.run(&inputs[..=self.variables], &mut value);
        value[0]
    }

    /// Returns the value.
    #[inline(always)]
    pub(crate) fn value<S: Scalar, const N: usize>(&self, variables: [S; N]) -> S {
        self.run(&self.value, variables)
    }

    /// Returns the derivative with respect to the first variable.
    #[inline(always)]
    pub(crate) fn slope<S: Scalar, const N: usize>(&self, variables: [S; N]) -> S {
        self.run(&self.slope, variables)
    }

    /// Returns the second derivative with respect to the first variable.
    pub(crate) fn curvature<const N: usize>(&self, variables: [f64; N]) -> f64 {
        let mut along = variables.map(Dual::constant);
        along[0].derivative = 1.0;
        self.slope(along).derivative
    }
}
