//! Properties of every measure, and known values.

use super::*;

/// Returns the `i`-th number of a sequence without pattern in (-1, 1).
fn number(i: usize) -> f64 {
    2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
}

/// A stencil, turned by about one radian from the first to the last vertex, and another.
fn stencils<const D: usize, const N: usize>() -> (Vec<f64>, Vec<[u32; N]>) {
    let base: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.2], [1.4, 1.1, 0.3], [0.6, -0.9, 0.5]];
    let x = (0..2).flat_map(|s| {
        (0..N).flat_map(move |n| (0..D).map(move |c| base[n][c] + 0.2 * number(20 * s + 3 * n + c)))
    });
    let mut vertices = vec![[0; N]; 2];
    for n in 0..N {
        (vertices[0][n], vertices[1][n]) = (n as u32, (N + n) as u32);
    }
    (x.collect(), vertices)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn check<Q: ScalarStrain<D, N>, const D: usize, const N: usize>(rest: [f64; 2]) {
    let (x, vertices) = stencils::<D, N>();
    let constants = [StencilConstants { stiffness: 2.0, rest }, StencilConstants { stiffness: 3.0, rest }];
    let mut term = ScalarStrainEnergy::<Q, D, N>::new("a", &vertices, &constants, &x);
    let (p, q): (Vec<f64>, Vec<f64>) = (0..x.len()).map(|i| (number(100 + i), number(200 + i))).unzip();
    let moved = |h: f64| -> Vec<f64> { x.iter().zip(&p).map(|(x, p)| x + h * p).collect() };
    let gradient = |term: &mut ScalarStrainEnergy<Q, D, N>, x: &[f64]| {
        let mut g = vec![0.0; x.len()];
        term.add_gradient(x, &mut g);
        g
    };
    let g = gradient(&mut term, &x);
    let scale = dot(&g, &g).sqrt();
    assert!(scale > 0.1, "{} of {scale}", Q::OF);
    // Fourth-order differences: the error is about h^4 = 1e-12 and 1e-16 / h = 1e-13.
    let h = 1e-3;
    let difference =
        |f: &mut dyn FnMut(f64) -> f64| (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h);
    let slope = difference(&mut |s| term.energy(&moved(s)));
    assert!((slope - dot(&g, &p)).abs() < 1e-9 * scale, "{}: {slope} and {}", Q::OF, dot(&g, &p));
    let (mut hp, mut hq) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    term.add_hessian_product(&x, &p, &mut hp);
    term.add_hessian_product(&x, &q, &mut hq);
    let size = dot(&hp, &hp).sqrt();
    assert!((dot(&hp, &q) - dot(&hq, &p)).abs() < 1e-12 * size, "{}: the Hessian is symmetric", Q::OF);
    for i in 0..x.len() {
        let slope = difference(&mut |s| gradient(&mut term, &moved(s))[i]);
        assert!((slope - hp[i]).abs() < 1e-8 * size, "{}: row {i}: {slope} and {}", Q::OF, hp[i]);
    }
    // Translations and rotations about the origin do no work.
    let mut motions = vec![];
    for c in 0..D {
        motions.push((0..x.len()).map(|i| f64::from(i % D == c)).collect::<Vec<f64>>());
        for b in 0..c {
            let turn = |i: usize| match i % D {
                j if j == b => -x[i + c - b],
                j if j == c => x[i + b - c],
                _ => 0.0,
            };
            motions.push((0..x.len()).map(turn).collect());
        }
    }
    for motion in motions {
        let work = dot(&g, &motion);
        assert!(work.abs() < 1e-13 * scale, "{}: a rigid motion works {work:e}", Q::OF);
    }
}

#[test]
fn gradients_and_hessians_are_derivatives_and_rigid_motions_do_no_work() {
    check::<Length, 2, 2>([0.7, 0.0]);
    check::<Length, 3, 2>([0.7, 0.0]);
    check::<HingeAngle, 3, 4>([1.0, 0.0]);
    check::<HingeAngle, 3, 4>([-0.6, 0.8]);
    check::<Curvature, 2, 3>([0.0; 2]);
    check::<Curvature, 2, 3>([-0.4, 0.0]);
    check::<Curvature, 3, 3>([0.0; 2]);
    check::<Curvature, 3, 3>([0.4, 0.0]);
}

/// Projected Hessians have no negative curvature in any direction, and nowhere less than the exact one.
fn projected<Q: ScalarStrain<D, N>, const D: usize, const N: usize>(rest: [f64; 2]) {
    let (x, vertices) = stencils::<D, N>();
    let constants = [StencilConstants { stiffness: 2.0, rest }, StencilConstants { stiffness: 3.0, rest }];
    let mut term = ScalarStrainEnergy::<Q, D, N>::new("a", &vertices, &constants, &x);
    let order = term.stencils().vertices;
    let entries = N * (N + 1) / 2 * D * D;
    let blocks = |psd| {
        let mut out = vec![0.0; 2 * entries];
        term.stencil_hessians(0..2, &x, psd, &mut out);
        out
    };
    let (exact, positive) = (blocks(Psd::Exact), blocks(Psd::Projected));
    let product = |blocks: &[f64], p: &[f64]| {
        let mut sum = 0.0;
        for (stencil, blocks) in blocks.chunks_exact(entries).enumerate() {
            let at = |n: usize, c: usize| p[order[stencil * N + n] as usize * D + c];
            let mut block = blocks.chunks_exact(D * D);
            for a in 0..N {
                for b in a..N {
                    let block = block.next().unwrap();
                    let twice = if a == b { 1.0 } else { 2.0 };
                    let entry = |ij: usize| block[ij] * at(a, ij / D) * at(b, ij % D);
                    sum += twice * (0..D * D).map(entry).sum::<f64>();
                }
            }
        }
        sum
    };
    let size = positive.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    for direction in 0..200 {
        let p: Vec<f64> = (0..x.len()).map(|i| number(1000 * direction + i)).collect();
        let (exact, positive) = (product(&exact, &p), product(&positive, &p));
        assert!(positive >= -1e-12 * size, "{}: {positive} along {direction}", Q::OF);
        assert!(positive >= exact - 1e-12 * size, "{}: {positive} for {exact} along {direction}", Q::OF);
    }
}

#[test]
fn projected_hessians_are_positive_and_lose_nothing_that_resists() {
    projected::<Length, 2, 2>([0.7, 0.0]);
    projected::<Length, 3, 2>([1.9, 0.0]);
    projected::<HingeAngle, 3, 4>([1.0, 0.0]);
    projected::<HingeAngle, 3, 4>([-0.6, 0.8]);
    projected::<Curvature, 2, 3>([-0.4, 0.0]);
    projected::<Curvature, 3, 3>([0.0; 2]);
    projected::<Curvature, 3, 3>([3.0, 0.0]);
}

/// The closed form of a hinge is the Hessian itself where nothing is bent, off by a part of the bend, and
/// nowhere below it.
#[test]
fn projected_hessians_of_hinges_bound_the_exact_ones() {
    let (x, _) = stencils::<3, 4>();
    let mut points = [[0.0; 3]; 4];
    points.as_flattened_mut().copy_from_slice(&x[..12]);
    let angle = HingeAngle::deviation(&points, &[1.0, 0.0]).0;
    let matrix = |rest: f64, psd| {
        let constants = [StencilConstants { stiffness: 2.0, rest: [rest.cos(), rest.sin()] }];
        let term = ScalarStrainEnergy::<HingeAngle, 3, 4>::new("a", &[[0, 1, 2, 3]], &constants, &x);
        let mut blocks = vec![0.0; 90];
        term.stencil_hessians(0..1, &x, psd, &mut blocks);
        let mut matrix = [[0.0; 12]; 12];
        let pairs = (0..4).flat_map(|a| (a..4).map(move |b| (a, b)));
        for ((a, b), block) in pairs.zip(blocks.chunks_exact(9)) {
            for (ij, entry) in block.iter().enumerate() {
                let (row, column) = (3 * a + ij / 3, 3 * b + ij % 3);
                (matrix[row][column], matrix[column][row]) = (*entry, *entry);
            }
        }
        matrix
    };
    // Relative size of what is added to the exact Hessian.
    let added = |bend: f64| {
        let [exact, mut above] = [Psd::Exact, Psd::Projected].map(|psd| matrix(angle - bend, psd));
        let size = exact.as_flattened().iter().map(|e| e * e).sum::<f64>().sqrt();
        for (above, exact) in above.as_flattened_mut().iter_mut().zip(exact.as_flattened()) {
            *above = (*above - exact) / size;
        }
        above
    };
    let norm = |matrix: [[f64; 12]; 12]| matrix.as_flattened().iter().map(|e| e * e).sum::<f64>().sqrt();
    assert!(norm(added(0.0)) < 1e-14);
    let (small, large) = (norm(added(1e-3)), norm(added(2e-3)));
    assert!(small > 1e-5 && small < 1e-2 && (large / small - 2.0).abs() < 0.01, "{small} and {large}");
    for bend in [-1.5, -0.3, 0.3, 1.5] {
        // Powers of what is left of a multiple of one lead to the least eigenvalue.
        let (added, mut p) = (added(bend), [0.0; 12]);
        (0..12).for_each(|i| p[i] = number(i));
        let mut least = 0.0;
        for _ in 0..2000 {
            let product = added.map(|row| dot(&row, &p));
            least = dot(&product, &p) / dot(&p, &p);
            (0..12).for_each(|i| p[i] = 2.0 * p[i] - product[i]);
            let length = dot(&p, &p).sqrt();
            p.iter_mut().for_each(|p| *p /= length);
        }
        assert!(least.abs() < 1e-12 || least > 0.0, "{least} at a bend of {bend}");
    }
}

/// Returns a hinge of unit height whose second triangle is turned up by `angle`.
fn folded(angle: f64) -> [[f64; 3]; 4] {
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [0.6, -angle.cos(), angle.sin()]]
}

#[test]
fn a_hinge_measures_its_angle_at_every_fold() {
    for i in -31..=31 {
        let angle = 0.1 * f64::from(i);
        let (s, gradient) = HingeAngle::deviation(&folded(angle), &[1.0, 0.0]);
        assert!((s - angle).abs() < 4e-16 * (1.0 + angle.abs()), "{s} instead of {angle}");
        assert!((gradient[2][2] - 1.0).abs() < 1e-15, "a height of one");
        let (cos, sin) = (0.5f64.cos(), 0.5f64.sin());
        let from_rest = HingeAngle::deviation(&folded(angle), &[cos, sin]).0;
        let wrapped = if angle - 0.5 < -std::f64::consts::PI {
            angle - 0.5 + std::f64::consts::TAU
        } else {
            angle - 0.5
        };
        assert!((from_rest - wrapped).abs() < 1e-15, "{from_rest} instead of {wrapped}");
    }
}

#[test]
fn hinges_without_area_and_joints_without_length_have_finite_forces() {
    let flat = [[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.6, -1.0, 0.1]];
    let (s, gradient) = HingeAngle::deviation(&flat, &[1.0, 0.0]);
    assert!(s.is_finite() && gradient.as_flattened().iter().all(|g| g.is_finite()));
    assert_eq!(HingeAngle::deviation(&[[0.2; 3]; 4], &[1.0, 0.0]), (0.0, [[0.0; 3]; 4]));
    let (s, gradient) = <Curvature as ScalarStrain<3, 3>>::deviation(&[[0.2; 3]; 3], &[0.0; 2]);
    assert!(s < 1e-9 && gradient.as_flattened().iter().all(|g| *g == 0.0));
}

// Bergou et al. 2008: kappa = 2 tan(phi/2).
#[test]
fn a_joint_measures_its_curvature() {
    for phi in [-2.0f64, -0.3, 0.0, 0.7, 3.0] {
        let x = [[-2.0, 0.0], [0.0, 0.0], [0.5 * phi.cos(), 0.5 * phi.sin()]];
        let expected = 2.0 * (0.5 * phi).tan();
        let plane = <Curvature as ScalarStrain<2, 3>>::deviation(&x, &[0.0; 2]).0;
        assert!((plane - expected).abs() < 1e-14 * (1.0 + expected.abs()), "{plane} instead of {expected}");
        let x = x.map(|[a, b]| [a, 0.6 * b, 0.8 * b]);
        let space = <Curvature as ScalarStrain<3, 3>>::deviation(&x, &[0.0; 2]).0;
        assert!((space - expected.abs()).abs() < 2e-10, "{space} instead of {expected}");
    }
}

#[test]
fn the_angle_of_a_point_is_that_of_the_standard_library() {
    for i in 0..20_000 {
        let angle = (f64::from(i) - 9999.5) / 9999.5 * std::f64::consts::PI;
        let (y, x) = (3.0 * angle.sin(), 3.0 * angle.cos());
        let expected = y.atan2(x);
        let found = crate::lanes::atan2(y, x);
        assert!(
            (found - expected).abs() <= 3.0 * f64::EPSILON * expected.abs(),
            "{found} instead of {expected}"
        );
    }
    assert_eq!(crate::lanes::atan2(0.0, 0.0), 0.0);
    assert_eq!(crate::lanes::atan2(0.0, -1.0), std::f64::consts::PI);
    assert_eq!(crate::lanes::atan2(1.0, 0.0), std::f64::consts::FRAC_PI_2);
    assert!(crate::lanes::atan2(f64::NAN, 1.0).is_nan() && crate::lanes::atan2(1.0, f64::NAN).is_nan());
}
