use super::sample::{Random, largest, orthogonality};
use crate::algebra::{Mat, symmetric_eigen};

#[test]
fn diagonalises_symmetric_matrices() {
    fn check<const D: usize>() {
        let mut random = Random(5);
        for _ in 0..2000 {
            let a = random.gaussian::<D>().symmetric();
            let (lambda, v) = symmetric_eigen(&a);
            let back = v.transpose_mul(&Mat::diagonal(&lambda)).mul(&v);
            assert!(orthogonality(&v) < 5e-15);
            assert!(largest(&(back - a)) < 5e-15 * a.norm_squared().sqrt());
        }
        let (lambda, v) = symmetric_eigen(&Mat::<f64, D>::zero());
        assert_eq!((lambda, v), ([0.0; D], Mat::identity()));
    }
    check::<2>();
    check::<3>();
}
