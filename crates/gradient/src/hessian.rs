//! Products with the Hessian of a loss, by differences of its gradients.

/// Product with a Hessian, computed by differences.
#[derive(Clone, Debug, PartialEq)]
pub struct HessianProduct {
    /// Components, in the order of those of the gradients.
    pub product: Vec<f64>,
    /// Error estimates, not bounds: the last change of each extrapolation, or the difference to the
    /// results of smaller steps.
    pub errors: Vec<f64>,
}

/// Number of difference steps, each half of the one before.
const LEVELS: usize = 5;

/// Computes the product `H d` of the Hessian of a loss with a direction, by central differences of exact
/// gradients,
///
/// ```text
/// D(h) = (g(h) - g(-h)) / 2h,   g(h) the gradient at the start plus h d,
/// ```
///
/// for `h = reach, reach/2, ..`, extrapolated to `h = 0` by Richardson's rule. Each component takes the
/// extrapolation that changed it least, with an error estimate: Ridders 1982, "Accurate computation of
/// F'(x) and F'(x) F''(x)", Advances in Engineering Software 4, 75.
///
/// The product is not an exact derivative of the steps, as gradients are: second derivatives of states
/// need third ones of energies, which are not implemented. Gradients are smooth within `reach` times the
/// direction if no vertex comes to a wall, no step is solved to a coarse tolerance, and the motion is not
/// chaotic; otherwise the errors show it. At a kink in the initial state itself, the result is the mean
/// of both sides. The part without second derivatives of states is exact in
/// [`gauss_newton_product`](crate::gauss_newton_product()).
///
/// ```
/// use pliant_gradient::hessian_product;
///
/// // L = x^2 y at (1, 2) along (1, 1): H = ((2 y, 2 x), (2 x, 0)).
/// let gradient = |h: f64| {
///     let (x, y) = (1.0 + h, 2.0 + h);
///     Ok::<_, ()>(vec![2.0 * x * y, x * x])
/// };
/// let found = hessian_product(0.1, gradient)?;
/// assert!((found.product[0] - 6.0).abs() < 1e-13 && (found.product[1] - 2.0).abs() < 1e-13);
/// # Ok::<(), ()>(())
/// ```
///
/// # Errors
/// The errors of `gradient_at`, which returns `g(h)` and is called ten times at most.
///
/// # Panics
/// If gradients have different lengths.
pub fn hessian_product<E>(
    reach: f64,
    mut gradient_at: impl FnMut(f64) -> Result<Vec<f64>, E>,
) -> Result<HessianProduct, E> {
    let mut difference = |h: f64| -> Result<Vec<f64>, E> {
        let [ahead, behind] = [gradient_at(h)?, gradient_at(-h)?];
        assert_eq!(ahead.len(), behind.len(), "gradients are of one length");
        Ok(ahead.iter().zip(&behind).map(|(ahead, behind)| (ahead - behind) / (2.0 * h)).collect())
    };
    // Rows of Richardson's table: the difference, then extrapolations from it and the row before.
    let mut last = vec![difference(reach)?];
    let mut best = HessianProduct { product: last[0].clone(), errors: vec![f64::INFINITY; last[0].len()] };
    for level in 1..LEVELS {
        let mut row = vec![difference(reach * 0.5_f64.powi(level as i32))?];
        for (order, coarse) in last.iter().enumerate() {
            let weight = 1.0 / (4.0_f64.powi(order as i32 + 1) - 1.0);
            let fine = &row[order];
            assert_eq!(fine.len(), coarse.len(), "gradients are of one length");
            let extrapolated: Vec<f64> =
                fine.iter().zip(coarse).map(|(fine, coarse)| fine + weight * (fine - coarse)).collect();
            for (i, found) in extrapolated.iter().enumerate() {
                let error = (found - fine[i]).abs().max((found - coarse[i]).abs());
                if error <= best.errors[i] {
                    (best.product[i], best.errors[i]) = (*found, error);
                }
            }
            row.push(extrapolated);
        }
        // If the highest order has left the best value of every component, smaller steps meet rounding,
        // or a kink.
        let (top, before) = (&row[level], &last[level - 1]);
        let left = |i: usize| (top[i] - before[i]).abs() >= 2.0 * best.errors[i];
        let ends = level > 1 && (0..top.len()).all(left);
        last = row;
        if ends {
            break;
        }
    }
    let numbers = best.errors.iter_mut().zip(&best.product);
    for ((error, found), top) in numbers.zip(&last[last.len() - 1]) {
        *error = error.max((found - top).abs());
    }
    Ok(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(reach: f64, gradient: impl Fn(f64) -> f64) -> (f64, f64) {
        let found = hessian_product(reach, |h| Ok::<_, ()>(vec![gradient(h)])).unwrap();
        (found.product[0], found.errors[0])
    }

    #[test]
    fn smooth_gradients_are_differentiated_to_rounding() {
        let (exact, error) = of(0.1, |h| (1.0 + h).exp());
        assert!((exact - 1.0_f64.exp()).abs() < 1e-11 && error < 1e-9, "{exact}, {error:e}");
        let (exact, error) = of(0.5, |h| (3.0 + h).sin() / (2.0 + h));
        let expected = 3.0_f64.cos() / 2.0 - 3.0_f64.sin() / 4.0;
        assert!((exact - expected).abs() <= error && error < 1e-7, "{exact}, {expected}, {error:e}");
    }

    #[test]
    fn the_error_of_a_gradient_with_a_kink_or_with_noise_is_seen() {
        // The derivative is 1 at zero, 4 from 0.03 on.
        let kinked = |h: f64| if h < 0.03 { h } else { h + 3.0 * (h - 0.03) };
        let (found, error) = of(0.4, kinked);
        assert!((found - 1.0).abs() <= 3.0 * error && error > 0.1, "{found}, {error:e}");
        let noisy = |h: f64| h.sin() + 1e-6 * (1e5 * h).sin().signum();
        let (found, error) = of(0.01, noisy);
        assert!((found - 1.0).abs() <= 20.0 * error && error > 1e-6, "{found}, {error:e}");
    }

    #[test]
    fn the_first_error_of_a_gradient_ends_it() {
        let mut calls = 0;
        let failed = hessian_product(0.1, |h| {
            calls += 1;
            if h < 0.0 { Err("behind") } else { Ok(vec![h]) }
        });
        assert_eq!((failed, calls), (Err("behind"), 2));
    }
}
