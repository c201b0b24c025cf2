//! Shape functions of second-order quadrilaterals and hexahedra on the reference cell `[-1, 1]^D`, with
//! node coordinates `c_a` of -1, 0 and 1.
//!
//! - Lagrange: products of `xi (xi - 1)/2`, `1 - xi^2` and `xi (xi + 1)/2`, with nodes in the middle of sides
//!   and cells.
//! - Serendipity: `N_a = prod_k (1 + xi_k c_ak)/2 (sum_k xi_k c_ak - D + 1)` at corners, `(1 - xi_m^2)` times
//!   such factors of the other coordinates in the middle of edges along `m`.
//!
//! Source: Zienkiewicz, Taylor, Zhu 2013, *The Finite Element Method: Its Basis and Fundamentals*,
//! chapter 6.

/// Gauss rule of two points, `-1/sqrt(3)` and `1/sqrt(3)`, with weights, on `[-1, 1]`.
pub(crate) const TWO: [(f64, f64); 2] = [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];

/// Gauss rule of three points, `-sqrt(3/5)`, 0 and `sqrt(3/5)`, with weights, on `[-1, 1]`.
pub(crate) const THREE: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// Returns the product of a rule on `[-1, 1]` in `D` dimensions, with the first coordinate running
/// fastest.
pub(super) const fn products<const D: usize, const R: usize, const Q: usize>(
    rule: &[(f64, f64); R],
) -> [([f64; D], f64); Q] {
    let mut points = [([0.0; D], 1.0); Q];
    let mut q = 0;
    while q < Q {
        let (mut k, mut rest) = (0, q);
        while k < D {
            points[q].0[k] = rule[rest % R].0;
            points[q].1 *= rule[rest % R].1;
            rest /= R;
            k += 1;
        }
        q += 1;
    }
    points
}

/// Returns value and derivative of the Lagrange polynomial that is one at the node `c`.
const fn lagrange_line(c: f64, x: f64) -> (f64, f64) {
    if c == 0.0 { (1.0 - x * x, -2.0 * x) } else { (0.5 * x * (x + c), x + 0.5 * c) }
}

/// Returns value and derivative of one coordinate's factor in a serendipity function, without that of
/// corners.
const fn serendipity_line(c: f64, x: f64) -> (f64, f64) {
    if c == 0.0 { (1.0 - x * x, -2.0 * x) } else { (0.5 * (1.0 + x * c), 0.5 * c) }
}

/// True if no coordinate is 0.
const fn is_corner<const D: usize>(node: &[f64; D]) -> bool {
    let (mut k, mut corner) = (0, true);
    while k < D {
        corner = corner && node[k] != 0.0;
        k += 1;
    }
    corner
}

/// Returns values and derivatives of all shape functions.
const fn functions<const D: usize, const N: usize>(
    nodes: &[[f64; D]; N],
    lagrange: bool,
    xi: &[f64; D],
) -> ([f64; N], [[f64; D]; N]) {
    let (mut values, mut slopes) = ([0.0; N], [[0.0; D]; N]);
    let mut a = 0;
    while a < N {
        let node = &nodes[a];
        let (mut product, mut products) = (1.0, [1.0; D]);
        let (mut sum, mut k) = (1.0 - D as f64, 0);
        // Product of the factors of the coordinates, and its derivatives.
        while k < D {
            let (value, slope) =
                if lagrange { lagrange_line(node[k], xi[k]) } else { serendipity_line(node[k], xi[k]) };
            product *= value;
            sum += xi[k] * node[k];
            let mut l = 0;
            while l < D {
                products[l] *= if l == k { slope } else { value };
                l += 1;
            }
            k += 1;
        }
        // Serendipity functions of corners have a further factor, `sum`.
        let of_corner = !lagrange && is_corner(node);
        values[a] = if of_corner { product * sum } else { product };
        k = 0;
        while k < D {
            slopes[a][k] = if of_corner { products[k] * sum + product * node[k] } else { products[k] };
            k += 1;
        }
        a += 1;
    }
    (values, slopes)
}

/// Returns the Lagrange functions of these nodes.
pub(super) const fn lagrange<const D: usize, const N: usize>(
    nodes: &[[f64; D]; N],
    xi: &[f64; D],
) -> ([f64; N], [[f64; D]; N]) {
    functions(nodes, true, xi)
}

/// Returns the serendipity functions of these nodes.
pub(super) const fn serendipity<const D: usize, const N: usize>(
    nodes: &[[f64; D]; N],
    xi: &[f64; D],
) -> ([f64; N], [[f64; D]; N]) {
    functions(nodes, false, xi)
}

/// Returns the derivatives of the shape functions at these points.
pub(super) const fn at_points<const D: usize, const N: usize, const Q: usize>(
    nodes: &[[f64; D]; N],
    is_lagrange: bool,
    points: &[([f64; D], f64); Q],
) -> [[[f64; D]; N]; Q] {
    let mut table = [[[0.0; D]; N]; Q];
    let mut q = 0;
    while q < Q {
        table[q] = functions(nodes, is_lagrange, &points[q].0).1;
        q += 1;
    }
    table
}
