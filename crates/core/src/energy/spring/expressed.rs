//! Springs whose energy is a formula of their length.

use std::sync::Arc;

use crate::energy::measure::{FormulaPrograms, ScalarLaw};
use crate::expression::{Formula, FormulaError};
use crate::scalar::Scalar;

/// Error of a formula that is not a valid spring energy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpringFormulaError {
    /// The text is not a formula of `l`, `l0` and the parameters.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// A value at the rest length is invalid.
    #[error("is {value:?} {what} at the rest length l = l0 = {length:?} m")]
    Rest {
        /// The value.
        value: f64,
        /// Description of the value, and of its valid range.
        what: &'static str,
        /// The rest length [m].
        length: f64,
    },
}

/// Energy `E(l, l0)` [J] of a spring of length `l` and rest length `l0` [m], as a formula.
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
    programs: Arc<FormulaPrograms>,
}

/// Round-off relative to the stiffness times the rest length.
const ROUNDING: f64 = 1e-10;

impl SpringFormula {
    /// Parses the formula `text` of `l`, `l0` [m] and `parameters`, in SI units.
    ///
    /// # Errors
    /// [`SpringFormulaError`] if the text is not a formula or a parameter is invalid.
    pub fn new(text: &str, parameters: &[(&str, f64)]) -> Result<SpringFormula, SpringFormulaError> {
        let formula = Formula::with_parameters(text, &["l", "l0"], parameters)?;
        Ok(SpringFormula { programs: Arc::new(FormulaPrograms::new(text, &formula, 2, parameters, None)?) })
    }

    /// Checks that a spring of rest length `length` [m] has neither energy nor tension at that length,
    /// and a positive stiffness.
    ///
    /// # Errors
    /// [`SpringFormulaError::Rest`] with the invalid value.
    pub fn check_at_rest(&self, length: f64) -> Result<(), SpringFormulaError> {
        let wrong = |value, what| Err(SpringFormulaError::Rest { value, what, length });
        let (energy, tension) =
            (self.programs.value([length, length]), self.programs.slope([length, length]));
        let stiffness = self.stiffness_at_rest(length);
        if !(stiffness.is_finite() && stiffness > 0.0) {
            return wrong(stiffness, "N/m as the stiffness, which must be a positive number,");
        }
        // Both comparisons are needed: NaN exceeds no bound.
        if tension.is_nan() || tension.abs() > ROUNDING * stiffness * length {
            return wrong(tension, "N as the tension, which must be 0,");
        }
        if energy.is_nan() || energy.abs() > ROUNDING * stiffness * length * length {
            return wrong(energy, "J as the energy, which must be 0,");
        }
        Ok(())
    }

    /// Returns the second derivative of the energy with respect to the length, at the rest length [N/m].
    pub fn stiffness_at_rest(&self, length: f64) -> f64 {
        self.programs.curvature([length, length])
    }
}

/// The formula takes the length itself, so deviations are measured from zero.
impl ScalarLaw for SpringFormula {
    #[inline(always)]
    fn origin<S: Scalar>(_: &[S; 2]) -> [S; 2] {
        [S::zero(); 2]
    }

    #[inline(always)]
    fn energy<S: Scalar>(&self, length: S, rest: &[S; 2]) -> S {
        self.programs.value([length, rest[0]])
    }

    #[inline(always)]
    fn force<S: Scalar>(&self, length: S, rest: &[S; 2]) -> S {
        self.programs.slope([length, rest[0]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::EnergyTerm;
    use crate::energy::measure::{Length, ScalarStrainEnergy, StencilConstants};
    use crate::energy::spring::Springs;
    use crate::material::Psd;

    const FORMULA: &str = "k/2*(l - l0)^2";

    /// Returns a chain that is stretched, bent and compressed.
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

    fn springs(
        formula: SpringFormula,
        edges: &[[u32; 2]],
        lengths: &[f64],
        rest: &[f64],
    ) -> ScalarStrainEnergy<Length, 3, 2, SpringFormula> {
        let constants = |length: &f64| StencilConstants { stiffness: 1.0, rest: [*length, 0.0] };
        let constants: Vec<StencilConstants> = lengths.iter().map(constants).collect();
        ScalarStrainEnergy::with_law("chain", formula, edges, &constants, rest)
    }

    fn formula(text: &str, k: f64) -> SpringFormula {
        SpringFormula::new(text, &[("k", k)]).unwrap()
    }

    #[test]
    fn quadratic_formulas_are_springs() {
        let (edges, lengths, rest, x) = chain();
        let mut by_hand =
            Springs::<3>::new("chain", &edges, &vec![70.0; edges.len()], &lengths, rest.len() / 3);
        let mut found = springs(formula(FORMULA, 70.0), &edges, &lengths, &rest);
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

    /// Blocks of the matrix against products with unit vectors, exact and projected.
    #[test]
    fn blocks_are_the_derivative_of_the_force() {
        let (_, _, rest, x) = chain();
        let cubic = formula("k/2*(l - l0)^2 + k/3*(l - l0)^3", 70.0);
        for (length, stretched) in [(0.5, true), (1.9, false)] {
            let mut term = springs(cubic.clone(), &[[0, 1]], &[length], &rest);
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
            // Blocks without negative eigenvalues do not change by the projection, up to rounding.
            let same = projected.iter().zip(&blocks).all(|(a, b)| (a - b).abs() < 1e-12 * 70.0);
            assert_eq!(same, stretched, "a pressed spring gives way sideways");
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
