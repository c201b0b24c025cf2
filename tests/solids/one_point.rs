//! Published problems of quadrilaterals and hexahedra, small strains. Numbers of the same element by an
//! independent program (Q1/E12 with the Jacobian of the middle, its enhanced strains condensed numerically),
//! parts of those of fine meshes of 27 nodes, or of theory.

use nalgebra::{DMatrix, DVector};
use serde_json::json;

use super::benchmarks::sheared;
use crate::support::method;
use crate::support::solid::{Kind, Solid, at_zero, isotropic};

/// Work of `load` on the displacements that it causes, where these are sums of the columns of `allowed`; and
/// the displacements.
pub(super) fn compliance(solid: &Solid, allowed: &DMatrix<f64>, load: &DVector<f64>) -> (f64, DVector<f64>) {
    let mut probe = solid.probe();
    let rest = probe.rest();
    let stiffness = allowed.transpose() * probe.stiffness(&rest) * allowed;
    let moved = allowed * stiffness.lu().solve(&(allowed.transpose() * load)).unwrap();
    (moved.dot(load), moved)
}

/// Units of the unknowns that are free.
pub(super) fn units(rest: &[f64], d: usize, is_free: impl Fn(&[f64], usize) -> bool) -> DMatrix<f64> {
    let free: Vec<usize> = (0..rest.len()).filter(|i| is_free(&rest[i / d * d..][..d], i % d)).collect();
    DMatrix::from_fn(rest.len(), free.len(), |row, column| f64::from(u8::from(free[column] == row)))
}

/// A block of cells of a kind from the origin on, its nodes moved by `place`; those in the middle of edges
/// are between them.
pub(super) fn block(
    kind: Kind,
    cells: &[usize],
    size: &[f64],
    place: impl Fn(&[f64]) -> Vec<f64>,
    poisson: f64,
    young: f64,
) -> Solid {
    let elastic = isotropic("linear", young, poisson);
    let mut mesh = Solid::grid(cells, size, elastic.clone()).of_kind(kind).mesh();
    let moved: Vec<f64> = mesh.points.chunks_exact(cells.len()).flat_map(place).collect();
    mesh.points = moved;
    Solid::inline(&mesh, elastic).of_kind(kind)
}

/// Asserts numbers to 1 %, and to the last digit that is given.
pub(super) fn assert_parts(what: &str, found: &[f64], expected: &[f64]) {
    let is_near = |(found, expected): (&f64, &f64)| (found - expected).abs() < 0.01 * expected + 6e-4;
    assert!(found.iter().zip(expected).all(is_near), "{what}: {found:.4?}, expected {expected:?}");
}

// MacNeal, Harder 1985, six cells: forces in the plane and out of it, and a torque.
#[test]
fn a_straight_cantilever_of_six_cells_bends_and_twists_as_another_program_has_it() {
    let solid_of = |slant: fn(usize) -> f64| {
        let place = move |x: &[f64]| {
            let column = x[0].round() as usize;
            let inner = f64::from(u8::from(column > 0 && column < 6));
            vec![x[0] + inner * slant(column) * (x[1] - 0.1), x[1], x[2]]
        };
        block(Kind::Whole, &[6, 1, 1], &[6.0, 0.2, 0.1], place, 0.3, 1e7)
    };
    let (width, height) = (0.2, 0.1);
    let polar = width * height * (width * width + height * height) / 12.0;
    for (what, slant, expected) in [
        ("rectangles", (|_| 0.0) as fn(usize) -> f64, [0.988, 0.981, 0.858]),
        ("parallelograms", |_| 1.0, [0.628, 0.536, 0.840]),
        ("trapezoids", |column| if column % 2 == 1 { 1.0 } else { -1.0 }, [0.048, 0.031, 0.845]),
    ] {
        let solid = solid_of(slant);
        let rest = solid.probe().rest();
        let load = |of_node: &dyn Fn(f64, f64) -> [f64; 2]| {
            let mut load = DVector::zeros(rest.len());
            for (a, x) in rest.chunks_exact(3).enumerate().filter(|(_, x)| x[0] > 5.9) {
                let of_node = of_node((x[1] - 0.1).signum(), (x[2] - 0.05).signum());
                (load[3 * a + 1], load[3 * a + 2]) = (of_node[0], of_node[1]);
            }
            load
        };
        // A traction that grows with the place has `A h / 24` of its slope at a node.
        let turning = width * height / 24.0 / polar;
        let loads = [
            load(&|_, _| [0.25, 0.0]),
            load(&|_, _| [0.0, 0.25]),
            load(&|y, z| [-turning * height * z, turning * width * y]),
        ];
        let allowed = units(&rest, 3, |x, _| x[0] > 1e-9);
        let reference = [1.075_959_09e-1, 4.297_432_84e-1, 3.335_523_71e-2];
        let parts =
            loads.iter().zip(reference).map(|(load, fine)| compliance(&solid, &allowed, load).0 / fine);
        assert_parts(what, &parts.collect::<Vec<_>>(), &expected);
    }
}

// Cook 1974 in plane strain, the middle of the free side, with 2, 4 and 8 cells a side.
#[test]
fn cooks_membrane_of_few_quadrilaterals_rises_as_another_program_has_it() {
    for (poisson, fine, expected) in
        [(0.3, 21.944_815_67, [0.882, 0.959, 0.987]), (0.4999, 18.508_999_21, [0.851, 0.921, 0.968])]
    {
        let rise = |n: usize| {
            let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], isotropic("linear", 1.0, poisson));
            solid.mesh = json!({ "cooks_membrane": { "cells": [n, n], "element": "quadrilateral" } });
            sheared(solid, 48.0, 16.0, 1.0, 1, [48.0, 52.0])[1] / fine
        };
        assert_parts(&format!("nu = {poisson}"), &[2, 4, 8].map(rise), &expected);
    }
}

// MacNeal, Harder 1985: ten degrees of a thick cylinder with pressure inside, five cells.
#[test]
fn a_thick_cylinder_of_five_cells_does_not_lock() {
    let radii = [3.0, 3.5, 4.2, 5.2, 6.75, 9.0];
    let angle = 10f64.to_radians();
    for (poisson, expected) in [(0.3, 0.9904), (0.49, 0.9863), (0.499, 0.9860), (0.4999, 0.9860)] {
        let place = |x: &[f64]| {
            let (radius, turn) = (radii[x[0].round() as usize], angle * x[1]);
            vec![radius * turn.cos(), radius * turn.sin()]
        };
        let solid = block(Kind::Whole, &[5, 1], &[5.0, 1.0], place, poisson, 1000.0);
        let rest = solid.probe().rest();
        let nodes = rest.len() / 2;
        // Both sides slide along their radius.
        let allowed = DMatrix::from_fn(rest.len(), nodes, |row, node| {
            let x = &rest[2 * node..][..2];
            if row / 2 == node { x[row % 2] / x[0].hypot(x[1]) } else { 0.0 }
        });
        let inside: Vec<usize> = (0..nodes).filter(|a| rest[2 * a].hypot(rest[2 * a + 1]) < 3.1).collect();
        let mut load = DVector::zeros(rest.len());
        for a in &inside {
            load[2 * a] = 3.0 * (0.5 * angle).sin() * (0.5 * angle).cos();
            load[2 * a + 1] = 3.0 * (0.5 * angle).sin() * (0.5 * angle).sin();
        }
        let (_, moved) = compliance(&solid, &allowed, &load);
        let exact = (1.0 + poisson) * 9.0 / (1000.0 * 72.0) * (27.0 + (1.0 - 2.0 * poisson) * 3.0);
        let found = moved[2 * inside[0]].hypot(moved[2 * inside[0] + 1]) / exact;
        assert!((found - expected).abs() < 1e-3, "nu = {poisson}: {found}, expected {expected}");
    }
}

// A strip of 10 x 1 (x 1), one end held along x alone, the other sheared: work over that of Timoshenko's
// beam. Cells that bend by a moment of their own lack 1/(4 n^2) for n of them along the strip.
#[test]
fn strips_of_one_row_and_of_two_bend_as_a_beam_does() {
    for (d, poisson, cells, expected) in [
        (2, 0.0, [10, 1], 0.995),
        (2, 0.0, [20, 2], 0.997),
        (2, 0.3, [10, 1], 0.997),
        (2, 0.3, [20, 2], 0.998),
        (2, 0.49, [10, 1], 1.0),
        (2, 0.49, [20, 2], 0.998),
        (2, 0.3, [2, 1], 0.938),
        (2, 0.3, [5, 2], 0.987),
        (2, 0.49, [2, 1], 0.940),
        (2, 0.49, [5, 2], 0.983),
        (3, 0.0, [10, 1], 0.996),
        (3, 0.3, [10, 1], 0.995),
        (3, 0.49, [10, 1], 0.993),
        (3, 0.3, [2, 1], 0.924),
        (3, 0.3, [5, 2], 0.983),
        (3, 0.49, [5, 2], 0.971),
    ] {
        let counts = [cells[0], cells[1], cells[1]];
        let solid = block(Kind::Whole, &counts[..d], &[10.0, 1.0, 1.0][..d], <[f64]>::to_vec, poisson, 1.0);
        let rest = solid.probe().rest();
        let allowed = units(&rest, d, |x, c| match c {
            0 => x[0] > 1e-9,
            c => x[0] > 1e-9 || x[c] > 1e-9,
        });
        // Of bilinear sides: a half at nodes on a border.
        let border = |x: f64| if (1e-9..=1.0 - 1e-9).contains(&x) { 1.0 } else { 0.5 };
        let mut load = DVector::zeros(rest.len());
        for (a, x) in rest.chunks_exact(d).enumerate().filter(|(_, x)| x[0] > 9.9) {
            load[d * a + 1] = x[1..].iter().map(|x| border(*x) / cells[1] as f64).product();
        }
        let plane = if d == 2 { 1.0 - poisson * poisson } else { 1.0 };
        let beam = 4000.0 * plane + 24.0 * (1.0 + poisson);
        let found = compliance(&solid, &allowed, &load).0 / beam;
        assert!((found - expected).abs() < 6e-3, "{d}D {poisson} {cells:?}: {found}, expected {expected}");
    }
}

/// A displacement of the vertex at `place`, along `axis`, of a body in statics.
fn displaced(solid: &Solid, place: [f64; 3], axis: usize) -> f64 {
    let mut simulation = solid.simulation(method("quasi-static"), 1.0);
    let rest = simulation.state().x().to_vec();
    simulation.step().unwrap();
    let near = |x: &[f64]| x.iter().zip(place).all(|(x, at)| (x - at).abs() < 1e-9);
    let vertex = rest.chunks_exact(3).position(near).unwrap();
    simulation.state().x()[3 * vertex + axis] - rest[3 * vertex + axis]
}

// A square bar, clamped at one end, of one cell through its section: a cell twists by 0.844 of St. Venant's
// angle, whatever its length; the clamp holds the section of the first, which does not warp there.
#[test]
fn a_bar_twists_by_as_much_with_short_cells_as_with_long_ones() {
    let mut last = 0.0;
    for cells in [6, 12, 24, 48, 96] {
        let mut bar = Solid::grid(&[cells, 1, 1], &[6.0, 1.0, 1.0], isotropic("linear", 1e6, 0.3));
        bar = bar.of_kind(Kind::Whole);
        bar.pin = at_zero(3, 0);
        let edge = |min: [f64; 3], max: [f64; 3], force: [f64; 3]| {
            let place = json!({ "min": min, "max": max });
            json!({ "box": place, "force": force })
        };
        bar.load = json!([
            edge([6.0, 1.0, 0.0], [6.0, 1.0, 1.0], [0.0, 0.0, 0.5]),
            edge([6.0, 0.0, 0.0], [6.0, 0.0, 1.0], [0.0, 0.0, -0.5]),
            edge([6.0, 0.0, 1.0], [6.0, 1.0, 1.0], [0.0, -0.5, 0.0]),
            edge([6.0, 0.0, 0.0], [6.0, 1.0, 0.0], [0.0, 0.5, 0.0]),
        ]);
        let theory = 6.0 / (1e6 / 2.6 * 0.1406);
        let found = displaced(&bar, [6.0, 1.0, 1.0], 2) / 0.5 / theory;
        assert!(found > 0.81 && found < 0.845, "{cells}: {found}");
        assert!(last == 0.0 || (found / last - 1.0).abs() < 0.03, "{cells}: {found}, before {last}");
        last = found;
    }
}

// Kirchhoff's plate that three corners hold and the fourth bends to a saddle: w = F a^2 / (2 (1 - nu) D).
#[test]
fn plates_of_one_layer_bend_to_saddles_as_thin_ones_do() {
    for (cells, thickness) in [(8, 0.02), (4, 0.02), (8, 0.1), (16, 0.05)] {
        let mut plate =
            Solid::grid(&[cells, cells, 1], &[1.0, 1.0, thickness], isotropic("linear", 1e6, 0.3));
        plate = plate.of_kind(Kind::Whole);
        let corner = |x: f64, y: f64| json!({ "min": [x, y, 0.0], "max": [x, y, thickness] });
        // The lower side alone: the corners turn.
        let point = |x: f64, y: f64| json!({ "min": [x, y, 0.0], "max": [x, y, 0.0] });
        plate.pin = json!([
            { "box": point(0.0, 0.0) },
            { "box": point(1.0, 0.0), "axes": ["y", "z"] },
            { "box": point(0.0, 1.0), "axes": ["z"] },
        ]);
        plate.load = json!([{ "box": corner(1.0, 1.0), "force": [0.0, 0.0, 1e-3] }]);
        let stiffness = 1e6 * thickness.powi(3) / (12.0 * 0.91);
        let theory = 1e-3 / (2.0 * 0.7 * stiffness);
        let found = displaced(&plate, [1.0, 1.0, 0.0], 2) / theory;
        // Shear adds to thick ones.
        let most = 1.05 + 3.0 * thickness * thickness * cells as f64;
        assert!(found > 0.95 && found < most, "{cells} {thickness}: {found}");
    }
}
