//! C5: a displacement field that is no polynomial is made a solution by the right body force; `E = 1`, `nu =
//! 0.3`.

use std::f64::consts::PI;

use nalgebra::Matrix3;
use pliant::element::{QuadraturePoint, mass_rule, shape_functions};
use pliant::energy::load::{DeadLoad, Sample};
use pliant::simulation::Simulation;
use pliant::solver::SolverOptions;
use serde_json::json;

use super::quadratic::{elements, nodes};
use crate::support::solid::{Solid, at_zero, isotropic};
use crate::support::{assert_relative, method};

const MU: f64 = 1.0 / 2.6;
const LAMBDA: f64 = 0.3 / 0.52;

/// The displacement of the manufactured solution and its gradient.
pub(super) fn manufactured<const D: usize>(x: [f64; D]) -> ([f64; D], [[f64; D]; D]) {
    let (mut u, mut g) = ([0.0; D], [[0.0; D]; D]);
    for i in 0..D {
        // u_i = 0.1 sin(pi x_i) prod_(j != i) cos(k_j pi x_j); in the plane k_1 = 1 for u_0.
        let k = |j: usize| if D == 2 && i == 0 && j == 1 { PI } else { 0.5 * PI };
        let factor = |j: usize| if j == i { (PI * x[j]).sin() } else { (k(j) * x[j]).cos() };
        let slope = |j: usize| if j == i { PI * (PI * x[j]).cos() } else { -k(j) * (k(j) * x[j]).sin() };
        u[i] = 0.1 * (0..D).map(factor).product::<f64>();
        g[i] = std::array::from_fn(|l| {
            0.1 * (0..D).map(|j| if j == l { slope(j) } else { factor(j) }).product::<f64>()
        });
    }
    (u, g)
}

/// First Piola stress of the linear material or the neo-Hookean one with the logarithm, in plane strain.
fn stress<const D: usize>(x: [f64; D], material: &str) -> [[f64; D]; D] {
    let g = manufactured(x).1;
    let mut h = Matrix3::zeros();
    (0..D).for_each(|i| (0..D).for_each(|j| h[(i, j)] = g[i][j]));
    let p = if material == "linear" {
        MU * (h + h.transpose()) + LAMBDA * h.trace() * Matrix3::identity()
    } else {
        let f = Matrix3::identity() + h;
        let inverse = f.try_inverse().unwrap().transpose();
        MU * (f - inverse) + LAMBDA * f.determinant().ln() * inverse
    };
    std::array::from_fn(|i| std::array::from_fn(|j| p[(i, j)]))
}

/// The body force `-Div P`, from differences of the exact stress: `h^4` of the fourth order.
pub(super) fn body_force<const D: usize>(x: [f64; D], material: &str) -> [f64; D] {
    let h = 1e-3;
    let mut b = [0.0; D];
    for j in 0..D {
        let at = |step: f64| {
            let mut y = x;
            y[j] += step;
            stress(y, material)
        };
        let (p1, m1, p2, m2) = (at(h), at(-h), at(2.0 * h), at(-2.0 * h));
        for i in 0..D {
            b[i] -= (8.0 * (p1[i][j] - m1[i][j]) - (p2[i][j] - m2[i][j])) / (12.0 * h);
        }
    }
    b
}

/// Sums over a rule of degree 7 or 8 in every element: `visit(weight, X, u, grad u, N, element)`, `u` the
/// displacement of `x`.
fn integrate<const D: usize, const N: usize>(
    solid: &Solid,
    rest: &[f64],
    x: &[f64],
    mut visit: impl FnMut(f64, [f64; D], [f64; D], [[f64; D]; D], &[f64; N], &[u32; N]),
) {
    let rule = mass_rule::<D, N>();
    for element in elements::<N>(solid) {
        let (at_rest, now) = (nodes::<D, N>(rest, &element), nodes::<D, N>(x, &element));
        for (lambda, weight) in &rule {
            let values = shape_functions::<D, N>(lambda);
            let point = QuadraturePoint::new(&at_rest, lambda, *weight);
            let (mut position, mut u) = ([0.0; D], [0.0; D]);
            for a in 0..N {
                for c in 0..D {
                    position[c] += values[a] * at_rest[a][c];
                    u[c] += values[a] * (now[a][c] - at_rest[a][c]);
                }
            }
            let f = point.deformation_gradient(&now);
            let gradient =
                std::array::from_fn(|i| std::array::from_fn(|j| f[i][j] - f64::from(u8::from(i == j))));
            visit(point.weight, position, u, gradient, &values, &element);
        }
    }
}

/// `n` cells a side, boundary held.
fn cube<const D: usize, const N: usize>(material: &str, n: usize) -> Solid {
    let order = if N == D + 1 { 1 } else { 2 };
    let mut solid = Solid::grid(&[n; D], &[1.0; D], isotropic(material, 1.0, 0.3)).of_order(order);
    let side = |axis: usize, sign: f64| {
        let mut normal = vec![0.0; D];
        normal[axis] = sign;
        json!({ "half_space": { "normal": normal, "offset": 0.5 * (sign - 1.0) } })
    };
    solid.pin = (0..D).flat_map(|axis| [side(axis, 1.0), side(axis, -1.0)]).collect();
    solid
}

/// Errors in the equilibrium that the quasi-static scheme finds: of displacements and of their gradients (L2
/// norms).
fn errors<const D: usize, const N: usize>(material: &str, n: usize) -> [f64; 2] {
    let solid = cube::<D, N>(material, n);
    let rest = solid.probe().rest();
    let mut loads = vec![0.0; rest.len()];
    integrate::<D, N>(&solid, &rest, &rest, |weight, x, _, _, values, element| {
        let b = body_force(x, material);
        for (v, value) in element.iter().zip(values) {
            (0..D).for_each(|c| loads[*v as usize * D + c] += weight * value * b[c]);
        }
    });
    solved::<D, N>(&solid, loaded::<D>(&solid, loads))
}

/// The quasi-static simulation of a body with these forces at its vertices [N].
pub(super) fn loaded<const D: usize>(solid: &Solid, loads: Vec<f64>) -> Simulation {
    let mut simulation = solid.simulation(method("quasi-static"), 1.0);
    let rest = simulation.state().x().to_vec();
    let vertices = (rest.len() / D) as u32;
    // The number of the vertex in the place of its position.
    let sample = |v: u32| Sample { point: [f64::from(v), 0.0, 0.0], shares: vec![(v, 1.0)] };
    let force = move |at: [f64; 3], _: f64| {
        std::array::from_fn(|c| if c < D { loads[at[0] as usize * D + c] } else { 0.0 })
    };
    let all: Vec<u32> = (0..vertices).collect();
    let samples = all.iter().map(|v| sample(*v)).collect();
    let load = DeadLoad::new("body force".into(), D, all, &rest, samples, Box::new(force), false);
    simulation.system_mut().add_term(Box::new(load));
    simulation
}

/// Errors of the equilibrium of `simulation`, which has its loads.
fn solved<const D: usize, const N: usize>(solid: &Solid, simulation: Simulation) -> [f64; 2] {
    let rest = simulation.state().x().to_vec();
    let x = equilibrium::<D>(simulation);
    let (mut value, mut gradient) = (0.0, 0.0);
    integrate::<D, N>(solid, &rest, &x, |weight, position, u, g, _, _| {
        let (exact, slope) = manufactured(position);
        for i in 0..D {
            value += weight * (u[i] - exact[i]).powi(2);
            gradient += (0..D).map(|j| weight * (g[i][j] - slope[i][j]).powi(2)).sum::<f64>();
        }
    });
    [f64::sqrt(value), f64::sqrt(gradient)]
}

/// The equilibrium near the manufactured solution.
pub(super) fn equilibrium<const D: usize>(mut simulation: Simulation) -> Vec<f64> {
    let rest = simulation.state().x().to_vec();
    for (x, rest) in simulation.state_mut().x_mut().chunks_exact_mut(D).zip(rest.as_chunks::<D>().0) {
        let u = manufactured(*rest).0;
        x.iter_mut().zip(u).for_each(|(x, u)| *x += u);
    }
    simulation.set_solver(SolverOptions { tolerance: Some(1e-12), ..SolverOptions::default() });
    simulation.step().unwrap();
    simulation.state().x().to_vec()
}

/// Compares errors on ever finer meshes, from `n` cells a side on, with those of an independent code, to 1
/// %, and the orders with `orders` of the element.
fn compare<const D: usize, const N: usize>(material: &str, n: usize, expected: &[[f64; 2]]) {
    let what = format!("{material}, {D}D, {N} nodes");
    let found: Vec<[f64; 2]> = (0..expected.len()).map(|i| errors::<D, N>(material, n << i)).collect();
    for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
        assert_relative(*found, *expected, 1e-2, &what);
    }
    let orders = if N == D + 1 { [2.0, 1.0] } else { [3.0, 2.0] };
    if let [.., coarse, fine] = &found[..] {
        for (norm, order) in orders.into_iter().enumerate() {
            let measured = (coarse[norm] / fine[norm]).log2();
            assert!((measured - order).abs() < 0.15, "{what}: order {measured:.3} instead of {order}");
        }
    }
}

// C5
#[test]
fn body_forces_of_the_manufactured_solution_are_those_of_the_plan() {
    let rows_2d = [
        ("linear", [0.493_618_195_085_68, 1.736_778_330_060_4]),
        ("neo-hookean", [0.585_066_221_116_43, 1.587_607_205_168_8]),
    ];
    for (material, expected) in rows_2d {
        let b = body_force([0.3, 0.4], material);
        b.iter().zip(expected).for_each(|(b, e)| assert_relative(*b, e, 1e-9, material));
    }
    let rows_3d = [
        ("linear", [0.304_810_743_055_02, 0.528_019_830_201_32, 0.949_664_594_441_48]),
        ("neo-hookean", [0.332_476_432_978_96, 0.603_652_895_403_55, 1.181_272_458_454_6]),
    ];
    for (material, expected) in rows_3d {
        let b = body_force([0.3, 0.5, 0.7], material);
        b.iter().zip(expected).for_each(|(b, e)| assert_relative(*b, e, 1e-9, material));
    }
}

// lecture 18; C5: L2 and H1 errors of an independent code, and the orders 2 and 1 of linear elements.
#[test]
fn errors_of_linear_elements_are_those_of_an_independent_code() {
    let linear = [
        [2.087_722e-3, 5.028_662e-2],
        [5.387_705e-4, 2.524_993e-2],
        [1.359_267e-4, 1.263_676e-2],
        [3.406_262e-5, 6.319_784e-3],
    ];
    compare::<2, 3>("linear", 8, &linear);
    let neo_hookean =
        [[5.314_606e-4, 2.525_159e-2], [1.341_092e-4, 1.263_702e-2], [3.361_051e-5, 6.319_820e-3]];
    compare::<2, 3>("neo-hookean", 16, &neo_hookean);
    compare::<3, 4>("linear", 4, &[[5.503_909e-3, 7.951_478e-2], [1.412_853e-3, 4.043_984e-2]]);
    compare::<3, 4>("neo-hookean", 8, &[[1.414_072e-3, 4.044_366e-2]]);
}

// C5: orders 3 and 2 of quadratic elements.
#[test]
fn errors_of_quadratic_elements_are_those_of_an_independent_code() {
    let linear = [[6.208_042e-5, 3.686_108e-3], [7.660_015e-6, 9.261_119e-4], [9.540_199e-7, 2.317_990e-4]];
    compare::<2, 6>("linear", 8, &linear);
    let neo_hookean =
        [[6.299_060e-5, 3.691_935e-3], [7.695_147e-6, 9.266_273e-4], [9.551_939e-7, 2.318_356e-4]];
    compare::<2, 6>("neo-hookean", 8, &neo_hookean);
    compare::<3, 10>("linear", 2, &[[2.666_092e-3, 3.897_062e-2], [3.441_464e-4, 1.035_955e-2]]);
    compare::<3, 10>("neo-hookean", 4, &[[3.487_229e-4, 1.037_451e-2]]);
}

/// The body force of the linear material in closed form, as formulas of a scene:
/// `-(lambda + mu) grad div u - mu Laplacian u`.
fn formulas<const D: usize>() -> Vec<String> {
    let axes = &["X", "Y", "Z"][..D];
    let half = |j: usize| format!("cos(pi/2*{})", axes[j]);
    let wave = |name: &str, j: usize| format!("{name}(pi*{})", axes[j]);
    let scale = |modulus: f64| 0.1 * PI * PI * modulus;
    if D == 2 {
        let (s, c) = (|j| wave("sin", j), |j| wave("cos", j));
        return vec![
            format!(
                "{}*({}*{} + 0.5*{}*sin(pi/2*X)) + {}*{}*{}",
                scale(LAMBDA + MU),
                s(0),
                c(1),
                c(1),
                scale(2.0 * MU),
                s(0),
                c(1)
            ),
            format!(
                "{}*({}*{} + {}*{}) + {}*{}*{}",
                scale(LAMBDA + MU),
                c(0),
                s(1),
                s(1),
                half(0),
                scale(1.25 * MU),
                s(1),
                half(0)
            ),
        ];
    }
    let component = |i: usize| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let own = format!("{}*{}*{}", wave("sin", i), half(j), half(k));
        let others = format!("({}*{} + {}*{})", wave("cos", j), half(k), wave("cos", k), half(j));
        format!(
            "{}*({own} + 0.5*sin(pi/2*{})*{others}) + {}*{own}",
            scale(LAMBDA + MU),
            axes[i],
            scale(1.5 * MU)
        )
    };
    (0..3).map(component).collect()
}

/// The orders of the errors of displacements and gradients under the `body_force` of a scene, between `n` and
/// `2 n` cells a side.
fn orders<const D: usize, const N: usize>(n: usize) -> [f64; 2] {
    let errors = |n: usize| {
        let mut solid = cube::<D, N>("linear", n);
        solid.load = json!([{ "body_force": formulas::<D>() }]);
        solved::<D, N>(&solid, solid.simulation(method("quasi-static"), 1.0))
    };
    let (coarse, fine) = (errors(n), errors(2 * n));
    [0, 1].map(|norm| f64::log2(coarse[norm] / fine[norm]))
}

// C5: the loads of scenes keep the orders of the elements; lumped ones would leave quadratic elements 1.91
// and 0.91.
#[test]
fn body_forces_of_scenes_keep_the_orders_of_the_elements() {
    fn check(what: &str, orders: [f64; 2], expected: [f64; 2]) {
        for (order, expected) in orders.into_iter().zip(expected) {
            assert!((order - expected).abs() < 0.15, "{what}: order {order:.3} instead of {expected}");
        }
    }
    check("triangles", orders::<2, 3>(16), [2.0, 1.0]);
    check("tetrahedra", orders::<3, 4>(8), [2.0, 1.0]);
    check("quadratic triangles", orders::<2, 6>(8), [3.0, 2.0]);
    check("quadratic tetrahedra", orders::<3, 10>(3), [3.0, 2.0]);
}

// A column that stands under its own weight, nu = 0, is shortened by `rho g / E (L y - y^2/2)`, which
// quadratic elements have exactly; lumped weights would be off by a part of 1e-2 here.
#[test]
fn quadratic_columns_stand_under_their_weight_exactly() {
    for d in [2, 3] {
        let (mut cells, mut size) = (vec![1; d], vec![0.5; d]);
        (cells[1], size[1]) = (3, 2.0);
        let mut down = vec![0.0; d];
        down[1] = -10.0;
        let force: Vec<f64> = down.iter().map(|g| 1000.0 * g).collect();
        let at_once = |gravity: Option<Vec<f64>>, load: serde_json::Value| {
            let mut solid = Solid::grid(&cells, &size, isotropic("linear", 1e6, 0.0)).of_order(2);
            (solid.pin, solid.gravity, solid.load) = (at_zero(d, 1), gravity, load);
            let mut simulation = solid.simulation(method("quasi-static"), 1.0);
            simulation.set_solver(SolverOptions { tolerance: Some(1e-12), ..SolverOptions::default() });
            let rest = simulation.state().x().to_vec();
            simulation.step().unwrap();
            for (x, rest) in simulation.state().x().chunks_exact(d).zip(rest.chunks_exact(d)) {
                let y = rest[1];
                let expected = -1e-2 * (2.0 * y - 0.5 * y * y);
                for c in 0..d {
                    let expected = if c == 1 { expected } else { 0.0 };
                    assert!((x[c] - rest[c] - expected).abs() < 1e-12, "{d}D: {x:?} at {rest:?}");
                }
            }
        };
        at_once(Some(down), json!([]));
        at_once(None, json!([{ "body_force": force }]));
    }
}
