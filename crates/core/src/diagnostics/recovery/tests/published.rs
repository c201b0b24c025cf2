//! Published problems, against a second implementation of the recoveries in two dimensions.

use std::f64::consts::PI;

use super::super::Recovery::{Average, Patch};
use super::problem::{PlaneProblem, Side, Solved};
use crate::material::Plane;

/// Lame's cylinder.
fn lame(nodes: usize, n: usize) -> Solved {
    let mut problem = PlaneProblem::new((nodes, [n, 2 * n]), (1000.0, 0.3, Plane::Strain), |s, t| {
        let (sin, cos) = (0.5 * PI * t).sin_cos();
        [(1.0 + s) * cos, (1.0 + s) * sin]
    });
    problem.hold(|[x, y]| [(x.abs() < 1e-9).then_some(0.0), (y.abs() < 1e-9).then_some(0.0)]);
    problem.pull(&Side::Left, |_, n| [-n[0], -n[1]]);
    problem.solved(1e-4)
}

/// Stress of Lame's cylinder: `A -+ B / r^2` with `A = 1/3`, `B = 4/3`.
fn lame_stress([x, y]: [f64; 2]) -> [f64; 3] {
    let square = x * x + y * y;
    let (a, b) = (1.0 / 3.0, 4.0 / 3.0 / square);
    let (c, s) = ((x * x - y * y) / square, 2.0 * x * y / square);
    [a - b * c, a + b * c, -b * s]
}

/// Stress of an infinite plate with a hole of radius 1 under a tension 1 along x: Kirsch 1898.
fn kirsch_stress([x, y]: [f64; 2]) -> [f64; 3] {
    let (square, angle) = (x * x + y * y, y.atan2(x));
    let (a, b) = (1.0 / square, 1.5 / (square * square));
    let (c2, c4) = ((2.0 * angle).cos(), (4.0 * angle).cos());
    let (s2, s4) = ((2.0 * angle).sin(), (4.0 * angle).sin());
    [1.0 - a * (1.5 * c2 + c4) + b * c4, -a * (0.5 * c2 - c4) - b * c4, -a * (0.5 * s2 + s4) + b * s4]
}

fn kirsch(nodes: usize, n: usize) -> Solved {
    let mut problem = PlaneProblem::new((nodes, [n, 2 * n]), (1000.0, 0.3, Plane::Strain), |s, t| {
        let (sin, cos) = (0.5 * PI * t).sin_cos();
        let far = if t <= 0.5 { [4.0, 8.0 * t] } else { [8.0 * (1.0 - t), 4.0] };
        [cos + s * (far[0] - cos), sin + s * (far[1] - sin)]
    });
    problem.hold(|[x, y]| [(x.abs() < 1e-9).then_some(0.0), (y.abs() < 1e-9).then_some(0.0)]);
    problem.pull(&Side::Right, |at, n| {
        let [xx, yy, xy] = kirsch_stress(at);
        [xx * n[0] + xy * n[1], xy * n[0] + yy * n[1]]
    });
    problem.solved(1e-4)
}

/// Cantilever of Timoshenko and Goodier.
fn beam(nodes: usize, n: usize) -> Solved {
    let (young, nu) = (1000.0, 0.3);
    let mut problem =
        PlaneProblem::new((nodes, [2 * n, n]), (young, nu, Plane::Stress), |s, t| [8.0 * s, 2.0 * t - 1.0]);
    let inertia = 2.0 / 3.0;
    problem.hold(|[x, y]| {
        let u = y * (2.0 + nu) * (y * y - 1.0) / (6.0 * young * inertia);
        let v = -nu * y * y * 8.0 / (2.0 * young * inertia);
        if x.abs() < 1e-9 { [Some(u), Some(v)] } else { [None; 2] }
    });
    problem.pull(&Side::Right, |[_, y], _| [0.0, -(1.0 - y * y) / (2.0 * inertia)]);
    problem.solved(1e-5)
}

/// NAFEMS LE1, stresses in MPa.
fn le1(nodes: usize, n: usize) -> Solved {
    let mut problem = PlaneProblem::new((nodes, [n, n]), (210e3, 0.3, Plane::Stress), |s, t| {
        let (sin, cos) = (0.5 * PI * t).sin_cos();
        [(2.0 + 1.25 * s) * cos, (1.0 + 1.75 * s) * sin]
    });
    problem.hold(|[x, y]| [(x.abs() < 1e-9).then_some(0.0), (y.abs() < 1e-9).then_some(0.0)]);
    problem.pull(&Side::Right, |_, n| [10.0 * n[0], 10.0 * n[1]]);
    problem.solved(1e-3)
}

/// Asserts that numbers agree to a relative tolerance.
fn assert_near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found:.9e} where {expected:.9e} is right");
}

/// Displacements, stresses recovered both ways, and both estimates as parts of the exact norm.
#[test]
fn simplices_have_the_digits_of_a_second_implementation() {
    let norm = (2.0f64 * 1.497_492_498_211_135e-3).sqrt();
    let rows = [
        (3, [1.853_660_327_4e-3, 1.666_195_399_5, 1.537_894_704_9], [9.742_992e-2, 9.636_868_7e-2], 2e-6),
        (6, [1.906_449_226_3e-3, 1.670_192_507_3, 1.659_778_334_2], [2.237_627e-3, 2.309_490e-3], 2e-2),
    ];
    for (nodes, [u, patch, average], [eta_average, eta_patch], tolerance) in rows {
        let (solved, at) = (lame(nodes, 8), [1.0, 0.0]);
        let what = format!("{nodes} nodes");
        assert_near(&what, solved.u[2 * solved.vertex(at)], u, 1e-8);
        assert_near(&what, solved.normal_stress(Patch, at, 1), patch, 2e-6);
        assert_near(&what, solved.normal_stress(Average, at, 1), average, 2e-6);
        assert_near(&what, solved.error(Average).total / norm, eta_average, 2e-6);
        assert_near(&what, solved.error(Patch).total / norm, eta_patch, tolerance);
    }
    let norm = (2.0f64 * 0.134_24).sqrt();
    let rows = [
        (3, [-0.241_929_645_2, 11.144_721_366, 10.505_016_778], [0.290_137_54, 0.291_575_02], 2e-6),
        (6, [-0.266_995_023_6, 11.991_958_138, 11.979_761_987], [3.148_500_2e-3, 4.493_053e-3], 2e-2),
    ];
    for (nodes, [u, patch, average], [eta_average, eta_patch], tolerance) in rows {
        let (solved, at) = (beam(nodes, 8), [0.0, 1.0]);
        let what = format!("beam, {nodes} nodes");
        assert_near(&what, solved.u[2 * solved.vertex([8.0, 0.0]) + 1], u, 1e-8);
        assert_near(&what, solved.normal_stress(Patch, at, 0), patch, 2e-6);
        assert_near(&what, solved.normal_stress(Average, at, 0), average, 2e-6);
        assert_near(&what, solved.error(Average).total / norm, eta_average, 2e-6);
        assert_near(&what, solved.error(Patch).total / norm, eta_patch, tolerance);
    }
}

/// NAFEMS, "The standard NAFEMS benchmarks" (1990), test LE1: 92.7 MPa, more exactly 92.6576 MPa.
#[test]
fn le1_has_the_digits_of_a_second_implementation_and_converges() {
    let at = [2.0, 0.0];
    for (nodes, n, patch, average) in
        [(3, 16, 87.071_766, 77.505_575), (3, 32, 91.728_459, 85.245_214), (6, 16, 93.372_530, 91.624_322)]
    {
        let solved = le1(nodes, n);
        assert_near("patch", solved.normal_stress(Patch, at, 1), patch, 2e-6);
        assert_near("average", solved.normal_stress(Average, at, 1), average, 2e-6);
    }
    // Serendipity and Lagrange cells, with complete integration the digits of the mean.
    assert_near("quad9", le1(9, 16).normal_stress(Average, at, 1), 92.535_086, 2e-6);
    for nodes in [8, 9] {
        let error = |n| (le1(nodes, n).normal_stress(Patch, at, 1) - 92.6576).abs();
        let (coarse, fine) = (error(16), error(32));
        assert!(fine < 0.11 && coarse / fine > 4.0, "{nodes} nodes: {coarse} {fine}");
    }
}

/// Effectivity: the estimate over the true error, in the energy norm.
#[test]
fn estimates_by_patches_are_near_the_true_error() {
    for nodes in [3, 4, 6, 8, 9] {
        let order = if nodes < 5 { 1.0 } else { 2.0 };
        let [coarse, fine] = [8, 16].map(|n| lame(nodes, n));
        let errors = [&coarse, &fine].map(|solved| solved.true_error(lame_stress));
        let seen = (errors[0] / errors[1]).log2();
        assert!((seen - order).abs() < 0.1, "{nodes} nodes: order {seen}");
        for (solved, error) in [(&coarse, errors[0]), (&fine, errors[1])] {
            let effectivity = solved.error(Patch).total / error;
            assert!((0.9..1.1).contains(&effectivity), "cylinder, {nodes} nodes: {effectivity}");
        }
    }
    for nodes in [3, 6, 9] {
        let plate = kirsch(nodes, 16);
        let effectivity = plate.error(Patch).total / plate.true_error(kirsch_stress);
        assert!((0.85..1.15).contains(&effectivity), "plate, {nodes} nodes: {effectivity}");
    }
}

/// The largest stress at the hole is three times the tension.
#[test]
fn stress_at_the_hole_of_a_plate_converges_to_three() {
    for (nodes, patch, average) in [(3, 3.236_105_1, 3.091_777_0), (6, 2.998_519_6, 2.997_334_3)] {
        let solved = kirsch(nodes, 16);
        assert_near("patch", solved.normal_stress(Patch, [0.0, 1.0], 0), patch, 2e-6);
        assert_near("average", solved.normal_stress(Average, [0.0, 1.0], 0), average, 2e-6);
    }
    for (nodes, most) in [(3, 0.24), (4, 0.21), (6, 0.002), (8, 0.04), (9, 0.04)] {
        let error = (kirsch(nodes, 16).normal_stress(Patch, [0.0, 1.0], 0) - 3.0).abs();
        assert!(error < most, "{nodes} nodes: {error}");
    }
}
