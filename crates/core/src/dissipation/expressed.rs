//! Dashpots whose dissipation function is a formula of the rate of their length.

use std::sync::Arc;

use crate::energy::measure::{FormulaPrograms, RateLaw};
use crate::expression::{Formula, FormulaError};
use crate::scalar::Scalar;

/// Error in a formula for the dissipation function of a spring.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DashpotFormulaError {
    /// The text is not a formula of `rate`, `l`, `l0` and the parameters.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// A value violates its condition.
    #[error("is {value:?} {what} at rate = {rate:?} m/s, l = l0 = {length:?} m")]
    Value {
        /// The value.
        value: f64,
        /// Unit and meaning of the value, and the condition it violates.
        what: &'static str,
        /// The rate [m/s].
        rate: f64,
        /// The rest length [m].
        length: f64,
    },
}

/// Dissipation function `R(rate, l, l0)` [W] of a spring, given as a formula: `l` [m] is the length,
/// `rate` [m/s] its rate of change and `l0` [m] the rest length.
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
    programs: Arc<FormulaPrograms>,
    text: String,
    parameters: Vec<(String, f64)>,
}

/// Names of the variables, in the order of the programs' inputs.
const VARIABLES: [&str; 3] = ["rate", "l", "l0"];
/// Tolerance of values that must vanish, relative to the values at the probed rates.
const ROUNDING: f64 = 1e-10;
/// Rates at which the force must resist motion in both directions [m/s].
const PROBED: [f64; 5] = [1e-3, 1e-2, 0.1, 1.0, 10.0];

impl DashpotFormula {
    /// Parses the formula `text` of `rate` [m/s], `l`, `l0` [m] and `parameters`, in SI units.
    ///
    /// # Errors
    /// [`DashpotFormulaError`] if the text is not a formula or a parameter is invalid.
    pub fn new(text: &str, parameters: &[(&str, f64)]) -> Result<DashpotFormula, DashpotFormulaError> {
        let formula = Formula::with_parameters(text, &VARIABLES, parameters)?;
        let own = |(name, value): &(&str, f64)| ((*name).to_owned(), *value);
        Ok(DashpotFormula {
            programs: Arc::new(FormulaPrograms::new(text, &formula, VARIABLES.len(), parameters, None)?),
            text: text.to_owned(),
            parameters: parameters.iter().map(own).collect(),
        })
    }

    /// Returns the derivative with respect to a parameter: a dissipation function whose force is the
    /// derivative of this one's force. `None` if there is no such parameter.
    pub fn derivative(&self, parameter: &str) -> Option<DashpotFormula> {
        let by = self.parameters.iter().position(|(name, _)| name == parameter)?;
        let parameters: Vec<(&str, f64)> =
            self.parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let formula = Formula::with_parameters(&self.text, &VARIABLES, &parameters).ok()?;
        let count = VARIABLES.len();
        let programs = FormulaPrograms::new(&self.text, &formula, count, &parameters, Some(by)).ok()?;
        Some(DashpotFormula { programs: Arc::new(programs), ..self.clone() })
    }

    /// Checks a spring of rest length `length` [m] at that length. At rate 0, dissipation and force must
    /// vanish and the slope of the force must be finite and not negative. At a few rates in both
    /// directions the force must resist the motion.
    ///
    /// # Errors
    /// [`DashpotFormulaError::Value`] with the value that violates its condition.
    pub fn check(&self, length: f64) -> Result<(), DashpotFormulaError> {
        let wrong = |value, what, rate| Err(DashpotFormulaError::Value { value, what, rate, length });
        let dissipation = |rate: f64| self.programs.value([rate, length, length]);
        let force = |rate: f64| self.programs.slope([rate, length, length]);
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

    /// Returns the second derivative with respect to the rate, at rate 0 and the rest length [N s/m].
    pub fn constant_at_rest(&self, length: f64) -> f64 {
        self.programs.curvature([0.0, length, length])
    }
}

/// The formula takes the length itself, so deviations are measured from zero.
impl RateLaw for DashpotFormula {
    const SUFFIX: &'static str = " by a formula";

    #[inline(always)]
    fn origin<S: Scalar>(_: &[S; 2]) -> [S; 2] {
        [S::zero(); 2]
    }

    #[inline(always)]
    fn dissipation<S: Scalar>(&self, rate: S, length: S, rest: &[S; 2]) -> S {
        self.programs.value([rate, length, rest[0]])
    }

    #[inline(always)]
    fn force<S: Scalar>(&self, rate: S, length: S, rest: &[S; 2]) -> S {
        self.programs.slope([rate, length, rest[0]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dissipation::{DissipativeTerm, MeasuredRate, PositionProducts};
    use crate::energy::Stencils;
    use crate::energy::measure::{Length, StencilConstants};

    const EDGES: [[u32; 2]; 4] = [[0, 1], [1, 2], [2, 3], [0, 3]];
    const LENGTHS: [f64; 4] = [0.7, 1.1, 0.4, 0.9];

    /// Returns `4 D` numbers in (-1, 1) without a pattern.
    fn scattered<const D: usize>(seed: usize) -> Vec<f64> {
        let number = |i: usize| 2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0;
        (0..4 * D).map(|i| number(i + 100 * seed)).collect()
    }

    fn dashpots<const D: usize>(formula: DashpotFormula) -> MeasuredRate<Length, D, 2, DashpotFormula> {
        let constants = LENGTHS.map(|length| StencilConstants { stiffness: 1.0, rest: [length, 0.0] });
        MeasuredRate::with_law("a", formula, &EDGES, &constants, &scattered::<D>(0))
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

    /// Returns the derivative at 0 from differences of fourth order.
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
        // The blocks assemble to the matrix of the product.
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
        // Derivative with respect to a parameter.
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
