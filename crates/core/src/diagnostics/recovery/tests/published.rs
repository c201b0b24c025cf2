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
        let far = if t <= 0.5 { [4.0, 4.0 * sin / cos] } else { [4.0 * cos / sin, 4.0] };
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

#[test]
fn show() {
    for nodes in [3, 6, 4, 8, 9] {
        for n in [8, 16] {
            let norm = (2.0f64 * 0.001497492498211135).sqrt();
            let l = lame(nodes, n);
            eprintln!(
                "lame {nodes} {n}: eta avg {:.7e} spr {:.7e} norm {:.8e} u {:.9e} s {:.7e} {:.7e}",
                l.error(Average).total / norm,
                l.error(Patch).total / norm,
                l.error(Patch).norm / norm,
                l.u[2 * l.vertex([1.0, 0.0])],
                l.normal_stress(Patch, [1.0, 0.0], 1),
                l.normal_stress(Average, [1.0, 0.0], 1)
            );
            let norm = (2.0f64 * 0.007693653726418169).sqrt();
            let l = kirsch(nodes, n);
            eprintln!(
                "kirsch {nodes} {n}: eta avg {:.7e} spr {:.7e} norm {:.8e} u {:.9e} s {:.7e} {:.7e}",
                l.error(Average).total / norm,
                l.error(Patch).total / norm,
                l.error(Patch).norm / norm,
                l.u[2 * l.vertex([1.0, 0.0])],
                l.normal_stress(Patch, [0.0, 1.0], 0),
                l.normal_stress(Average, [0.0, 1.0], 0)
            );
            let norm = (2.0f64 * 0.1342399999999993).sqrt();
            let l = beam(nodes, n);
            eprintln!(
                "beam {nodes} {n}: eta avg {:.7e} spr {:.7e} norm {:.8e} u {:.9e} s {:.7e} {:.7e}",
                l.error(Average).total / norm,
                l.error(Patch).total / norm,
                l.error(Patch).norm / norm,
                l.u[2 * l.vertex([8.0, 0.0]) + 1],
                l.normal_stress(Patch, [0.0, 1.0], 0),
                l.normal_stress(Average, [0.0, 1.0], 0)
            );
            let l = le1(nodes, 2 * n);
            eprintln!(
                "le1 {nodes} {}: eta avg {:.7e} spr {:.7e} norm {:.8e} u {:.9e} s {:.7e} {:.7e}",
                2 * n,
                l.error(Average).relative(),
                l.error(Patch).relative(),
                l.error(Patch).norm,
                l.u[2 * l.vertex([2.0, 0.0])],
                l.normal_stress(Patch, [2.0, 0.0], 1),
                l.normal_stress(Average, [2.0, 0.0], 1)
            );
        }
    }
}
