//! Shape functions of quadrilaterals and hexahedra, `N_a = prod_k (1 + xi_k c_ak) / 2` with the corners
//! `c_a` of the reference cell `[-1, 1]^D`: Zienkiewicz, Taylor, Zhu 2013, section 5.4.

/// Coordinate of the Gauss points of order 2 on `[-1, 1]`, `1/sqrt(3)`.
pub(super) const GAUSS: f64 = 0.577_350_269_189_625_8;

/// Shape functions of the cell with these corners.
pub(super) fn shape<const D: usize, const N: usize>(corners: &[[f64; D]; N], xi: &[f64; D]) -> [f64; N] {
    corners.map(|corner| (0..D).map(|k| 0.5 * (1.0 + xi[k] * corner[k])).product())
}

/// Derivatives `dN_a/dxi_k` of the shape functions.
pub(super) fn slopes<const D: usize, const N: usize>(
    corners: &[[f64; D]; N],
    xi: &[f64; D],
) -> [[f64; D]; N] {
    corners.map(|corner| {
        let mut slope = [0.0; D];
        for (k, slope) in slope.iter_mut().enumerate() {
            let others = (0..D).filter(|l| *l != k).map(|l| 0.5 * (1.0 + xi[l] * corner[l]));
            *slope = 0.5 * corner[k] * others.product::<f64>();
        }
        slope
    })
}
