//! Nonlinear least squares of few parameters between bounds, by the Levenberg-Marquardt method.
//!
//! Each step minimises `|r + J d|^2 + m sum_j |J_j|^2 d_j^2` by QR of the stacked matrix. The normal
//! equations would lose half of the digits if parameters are nearly dependent. The damping `m` follows the
//! gain ratio; Nielsen 1999, *Damping parameter in Marquardt's method*, IMM-REP-1999-05.
//!
//! A step to parameters without a prediction (an invalid scene, a run that fails) is halved until there is
//! one. Damping instead would turn it towards the gradient, along which steps creep up to the invalid region
//! and stay there.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Maximum number of steps that reduce the sum of squares.
const MOST_STEPS: u32 = 100;
/// Convergence criterion: relative change of all parameters in a step.
const SMALLEST_STEP: f64 = 1e-12;
/// Damping above which no step makes progress.
const LARGEST_DAMPING: f64 = 1e16;

/// Residuals as a function of parameters, or the reason for their absence.
pub(super) type Residuals<'a, R> = dyn Fn(&[f64]) -> Result<Vec<f64>, R> + Sync + 'a;

/// A least-squares problem.
pub(super) struct LeastSquares<'a, R> {
    /// Residuals; their number is constant.
    pub(super) residuals: &'a Residuals<'a, R>,
    /// Bounds of each parameter; infinite for none.
    pub(super) bounds: &'a [[f64; 2]],
    /// Size of each parameter, positive.
    pub(super) sizes: &'a [f64],
    /// Relative change of a parameter for central differences.
    pub(super) difference: f64,
}

/// Best parameters found from one start.
pub(super) struct Minimum {
    pub(super) parameters: Vec<f64>,
    pub(super) residuals: DVector<f64>,
    /// Derivatives of the residuals at the minimum, a column for each parameter.
    pub(super) jacobian: DMatrix<f64>,
    /// Number of steps that reduced the sum of squares.
    pub(super) steps: u32,
    /// Number of evaluations of the residuals.
    pub(super) evaluations: u64,
    /// False if the iteration reached the step limit.
    pub(super) converged: bool,
}

impl Minimum {
    pub(super) fn sum_of_squares(&self) -> f64 {
        self.residuals.norm_squared()
    }
}

impl<R: Send> LeastSquares<'_, R> {
    /// Minimises from `start`, which must be within bounds; `watch` receives the number of steps, the sum
    /// of squares and the parameters, and stops the iteration by `false`.
    ///
    /// # Errors
    /// The residuals are missing at the start, or on both sides of a parameter.
    pub(super) fn minimum(
        &self,
        start: &[f64],
        watch: &mut dyn FnMut(u32, f64, &[f64]) -> bool,
    ) -> Result<Minimum, R> {
        let residuals = DVector::from_vec((self.residuals)(start)?);
        let (parameters, jacobian) = (start.to_vec(), DMatrix::zeros(residuals.len(), start.len()));
        let mut at = Minimum { parameters, residuals, jacobian, steps: 0, evaluations: 1, converged: true };
        let (mut damping, mut growth) = (1e-3, 2.0);
        loop {
            // Derivatives and stopping criteria.
            at.jacobian = self.jacobian(&mut at)?;
            let goes_on = watch(at.steps, at.sum_of_squares(), &at.parameters);
            let free = self.free(&at);
            if !goes_on || free.is_empty() || at.sum_of_squares() == 0.0 {
                return Ok(at);
            }
            if at.steps == MOST_STEPS {
                at.converged = false;
                return Ok(at);
            }
            // Attempts of a step: shorter without a prediction, more damped without a decrease.
            let mut part = 1.0;
            loop {
                let Some(step) = self.step(&at, &free, damping) else { return Ok(at) };
                let next: Vec<f64> = self.clipped(&at.parameters, &step, part);
                if self.is_same(&at.parameters, &next) || damping > LARGEST_DAMPING {
                    return Ok(at);
                }
                at.evaluations += 1;
                let Ok(found) = (self.residuals)(&next) else {
                    part *= 0.5;
                    continue;
                };
                let found = DVector::from_vec(found);
                if found.norm_squared() >= at.sum_of_squares() {
                    (damping, growth, part) = (damping * growth, 2.0 * growth, 1.0);
                    continue;
                }
                // Accepted: the damping follows the gain ratio.
                let taken =
                    DVector::from_iterator(step.len(), next.iter().zip(&at.parameters).map(|(a, b)| a - b));
                let predicted = at.sum_of_squares() - (&at.residuals + &at.jacobian * taken).norm_squared();
                let gain = (at.sum_of_squares() - found.norm_squared()) / predicted;
                let factor = if gain.is_finite() { 1.0 - (2.0 * gain - 1.0).powi(3) } else { 1.0 };
                (damping, growth) = (damping * factor.clamp(0.1, 2.0), 2.0);
                (at.parameters, at.residuals, at.steps) = (next, found, at.steps + 1);
                break;
            }
        }
    }

    /// Derivatives by central differences, or one-sided ones if the residuals are missing on one side.
    fn jacobian(&self, at: &mut Minimum) -> Result<DMatrix<f64>, R> {
        let sides: Vec<(usize, f64)> = (0..at.parameters.len()).flat_map(|j| [(j, 1.0), (j, -1.0)]).collect();
        let beside = |(j, side): (usize, f64)| {
            let mut parameters = at.parameters.clone();
            let change = self.difference * self.sizes[j];
            parameters[j] = (parameters[j] + side * change).clamp(self.bounds[j][0], self.bounds[j][1]);
            // Actual change, including rounding.
            let change = parameters[j] - at.parameters[j];
            if change == 0.0 {
                return Ok((0.0, at.residuals.clone()));
            }
            (self.residuals)(&parameters).map(|found| (change, DVector::from_vec(found)))
        };
        let mut found: Vec<Result<_, R>> = sides.into_par_iter().map(beside).collect();
        at.evaluations += found.len() as u64;
        let mut jacobian = DMatrix::zeros(at.residuals.len(), at.parameters.len());
        for j in (0..at.parameters.len()).rev() {
            let (below, above) = (found.pop(), found.pop());
            let ends = match (below, above) {
                (Some(Ok(below)), Some(Ok(above))) => [below, above],
                (Some(Ok(one)), _) | (_, Some(Ok(one))) => [one, (0.0, at.residuals.clone())],
                (Some(Err(fault)), _) | (_, Some(Err(fault))) => return Err(fault),
                (None, None) => continue,
            };
            let [(from, low), (to, high)] = ends;
            jacobian.set_column(j, &((high - low) / (to - from)));
        }
        Ok(jacobian)
    }

    /// Parameters that can still reduce the sum of squares: they have an influence, and no bound blocks
    /// their descent direction.
    fn free(&self, at: &Minimum) -> Vec<usize> {
        let slopes = at.jacobian.tr_mul(&at.residuals);
        let can_move = |j: &usize| {
            let [low, high] = self.bounds[*j];
            let (slope, value) = (slopes[*j], at.parameters[*j]);
            at.jacobian.column(*j).norm() > 0.0
                && !(value <= low && slope > 0.0 || value >= high && slope < 0.0)
        };
        (0..at.parameters.len()).filter(can_move).collect()
    }

    /// Step of these parameters; `None` if it is not finite.
    fn step(&self, at: &Minimum, free: &[usize], damping: f64) -> Option<Vec<f64>> {
        let (rows, count) = at.jacobian.shape();
        let mut stacked = DMatrix::zeros(rows + free.len(), free.len());
        for (column, &j) in free.iter().enumerate() {
            let derivative = at.jacobian.column(j);
            stacked.view_mut((0, column), (rows, 1)).copy_from(&derivative);
            stacked[(rows + column, column)] = damping.sqrt() * derivative.norm();
        }
        let mut right = DVector::zeros(rows + free.len());
        right.rows_mut(0, rows).copy_from(&-&at.residuals);
        let decomposed = stacked.qr();
        decomposed.q_tr_mul(&mut right);
        let solved = decomposed.r().solve_upper_triangular(&right.rows(0, free.len()).into_owned())?;
        let mut step = vec![0.0; count];
        free.iter().zip(solved.iter()).for_each(|(&j, d)| step[j] = *d);
        step.iter().all(|d| d.is_finite()).then_some(step)
    }

    /// Parameters after a fraction of a step, clipped to the bounds.
    fn clipped(&self, parameters: &[f64], step: &[f64], part: f64) -> Vec<f64> {
        let moved = parameters.iter().zip(step).zip(self.bounds);
        moved.map(|((value, step), [low, high])| (value + part * step).clamp(*low, *high)).collect()
    }

    fn is_same(&self, a: &[f64], b: &[f64]) -> bool {
        let close =
            |((a, b), size): ((&f64, &f64), &f64)| (a - b).abs() <= SMALLEST_STEP * a.abs().max(size * 1e-3);
        a.iter().zip(b).zip(self.sizes).all(close)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: [[f64; 2]; 2] = [[f64::NEG_INFINITY, f64::INFINITY]; 2];

    fn minimum(residuals: &Residuals<'_, ()>, bounds: &[[f64; 2]], start: &[f64]) -> Minimum {
        let sizes = vec![1.0; start.len()];
        let problem = LeastSquares { residuals, bounds, sizes: &sizes, difference: 1e-5 };
        problem.minimum(start, &mut |_, _, _| true).unwrap()
    }

    // Rosenbrock 1960, "An automatic method for finding the greatest or least value of a function".
    fn valley(p: &[f64]) -> Result<Vec<f64>, ()> {
        Ok(vec![10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]])
    }

    #[test]
    fn the_end_of_a_curved_valley_is_found() {
        let found = minimum(&valley, &FREE, &[-1.2, 1.0]);
        assert!((found.parameters[0] - 1.0).abs() < 1e-9, "{:?}", found.parameters);
        assert!((found.parameters[1] - 1.0).abs() < 1e-9 && found.converged);
        assert!(found.steps < 40, "{}", found.steps);
    }

    // For x <= 1/2 the minimum is at x = 1/2, y = 1/4.
    #[test]
    fn bounds_are_kept_and_the_rest_is_as_good_as_it_gets() {
        let found = minimum(&valley, &[[-2.0, 0.5], [-2.0, 2.0]], &[-1.2, 1.0]);
        assert_eq!(found.parameters[0], 0.5);
        assert!((found.parameters[1] - 0.25).abs() < 1e-9, "{:?}", found.parameters);
    }

    #[test]
    fn steps_to_where_there_is_nothing_are_taken_back() {
        // The first Gauss-Newton step from here leads far below zero.
        let logarithm = |p: &[f64]| if p[0] > 0.0 { Ok(vec![p[0].ln(), 0.0]) } else { Err(()) };
        let found = minimum(&logarithm, &FREE[..1], &[20.0]);
        assert!((found.parameters[0] - 1.0).abs() < 1e-9, "{:?}", found.parameters);
    }

    #[test]
    fn a_line_through_points_is_that_of_the_normal_equations() {
        let points = [(0.0, 1.0), (1.0, 2.0), (2.0, 2.0), (3.0, 5.0)];
        let line = |p: &[f64]| Ok(points.iter().map(|(x, y)| p[0] + p[1] * x - y).collect());
        let found = minimum(&line, &FREE, &[0.0, 0.0]);
        // Sums computed by hand: n = 4, x = 6, xx = 14, y = 10, xy = 21.
        let [intercept, slope] = [0.7, 1.2];
        assert!((found.parameters[0] - intercept).abs() < 1e-9 && (found.parameters[1] - slope).abs() < 1e-9);
    }
}
