//! Conversion to nalgebra: rows of vectors as columns of its matrices, [`Mat`] as its square matrices.

use nalgebra::{DMatrixView, DMatrixViewMut, SMatrix};

use super::Mat;

/// Returns vectors `(n, dimension)`, such as [`positions`](crate::simulation::Simulation::positions) and
/// forces, as a matrix of `dimension` rows whose column `i` is vector `i`. Nothing is copied: nalgebra stores
/// columns.
///
/// ```
/// let positions = [0.0, 0.0, 3.0, 4.0];
/// let columns = pliant::algebra::columns(&positions, 2);
/// assert_eq!((columns.column(1) - columns.column(0)).norm(), 5.0);
/// ```
///
/// # Panics
/// If the length is no multiple of `dimension`.
pub fn columns(vectors: &[f64], dimension: usize) -> DMatrixView<'_, f64> {
    DMatrixView::from_slice(vectors, dimension, count(vectors.len(), dimension))
}

/// Returns a mutable view like [`columns`].
///
/// # Panics
/// If the length is no multiple of `dimension`.
pub fn columns_mut(vectors: &mut [f64], dimension: usize) -> DMatrixViewMut<'_, f64> {
    let count = count(vectors.len(), dimension);
    DMatrixViewMut::from_slice(vectors, dimension, count)
}

fn count(length: usize, dimension: usize) -> usize {
    assert!(length.is_multiple_of(dimension), "{length} numbers are no vectors of {dimension} components");
    length / dimension
}

impl<const D: usize> From<Mat<f64, D>> for SMatrix<f64, D, D> {
    fn from(matrix: Mat<f64, D>) -> Self {
        SMatrix::from_fn(|row, column| matrix[row][column])
    }
}

impl<const D: usize> From<SMatrix<f64, D, D>> for Mat<f64, D> {
    fn from(matrix: SMatrix<f64, D, D>) -> Self {
        Mat(std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_columns_stay_where_they_are() {
        let matrix = Mat([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 10.0]]);
        let theirs = nalgebra::Matrix3::from(matrix);
        assert_eq!(theirs[(0, 2)], 3.0);
        assert_eq!(theirs.determinant(), matrix.determinant());
        assert_eq!(Mat::from(theirs), matrix);
    }

    #[test]
    fn a_rotation_of_columns_is_one_of_each_vector() {
        let mut positions = [1.0, 0.0, 0.0, 2.0];
        let quarter = nalgebra::Rotation2::new(std::f64::consts::FRAC_PI_2);
        let turned = quarter.matrix() * columns(&positions, 2);
        columns_mut(&mut positions, 2).copy_from(&turned);
        for (found, right) in positions.iter().zip([0.0, 1.0, -2.0, 0.0]) {
            assert!((found - right).abs() < 1e-15, "{found} for {right}");
        }
    }
}
