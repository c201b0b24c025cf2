//! Axes of materials in each element.

use pliant_scene::Scene;

use crate::by_parameters::compare;
use crate::constants;
use crate::differences::compare_numbers;
use crate::support::scattered;

const SCHEMES: [(&str, u64); 3] = [("velocity-verlet", 40), ("implicit-euler", 12), ("quasi-static", 2)];

/// Two families of fibres about the first axis, one nearer to it.
const FIBRES: &str =
    "{ holzapfel-gasser-ogden = { shear = 8e3, bulk = 5e4, k1 = 1e4, k2 = 1.2, dispersion = 0.1,
    fibres = [[1.0, 0.2], [1.0, -0.4]] } }";

/// The same axes and measures of them in a formula, the third axis too.
const FORMULA: &str =
    "{ expression = { psi = 'mu/2*(I1 - 3) - mu*log(J) + k/2*(I4 - 1)^2 + k*E12^2 + 3*k*E33^2',
    parameters = { mu = 2e4, k = 9e3 }, fibres = [[1, 0.5]] } }";

/// A stretched block that falls and turns, held at one end, its elements turned to these directions.
fn block(scheme: &str, dimension: usize, material: &str, axes: &str) -> Scene {
    let material = format!("{material}\nelastic_axes = {axes}\nelastic_factor = 1.3");
    constants::block(scheme, (dimension, 1, ""), &material)
}

/// The same of second order.
fn quadratic(scheme: &str, dimension: usize, material: &str, axes: &str) -> Scene {
    let material = format!("{material}\nelastic_axes = {axes}\nelastic_factor = 1.3");
    constants::block(scheme, (dimension, 2, ""), &material)
}

/// The same of quadrilaterals or hexahedra.
fn cells(scheme: &str, dimension: usize, material: &str, axes: &str) -> Scene {
    let kind = if dimension == 2 { "quadrilateral" } else { "hexahedron" };
    constants::block(scheme, (dimension, 1, kind), &format!("{material}\nelastic_axes = {axes}"))
}

/// Directions near this one, one for each simplex.
fn directions(dimension: usize, about: [f64; 3], seed: f64) -> Vec<f64> {
    directions_of(if dimension == 2 { 4 } else { 6 }, dimension, about, seed)
}

fn directions_of(count: usize, dimension: usize, about: [f64; 3], seed: f64) -> Vec<f64> {
    let off = scattered(dimension * count, seed);
    off.chunks(dimension)
        .flat_map(|off| off.iter().zip(about).map(|(off, about)| about + 0.4 * off))
        .collect()
}

fn listed(dimension: usize, directions: &[f64]) -> String {
    format!("{{ per_element = {:?} }}", directions.chunks(dimension).collect::<Vec<_>>())
}

fn name(key: &str) -> String {
    format!("body.block.elastic_axes.{key}_per_element")
}

#[test]
fn directions_of_axes_in_each_element_have_derivatives() {
    for (dimension, (scheme, steps)) in [2, 3].into_iter().flat_map(|d| SCHEMES.map(|run| (d, run))) {
        // At rest under its weight fibres of the block are slack.
        let materials = if scheme == "quasi-static" { &[FORMULA][..] } else { &[FIBRES, FORMULA] };
        for (i, material) in materials.iter().enumerate() {
            let what = format!("{scheme}, {dimension}D, {i}");
            // One that points against x too.
            for about in [[1.2, 0.4, 0.3], [-1.0, 0.2, -0.3]] {
                let first = directions(dimension, about, 1.0);
                let of_first = |first: &[f64]| {
                    block(scheme, dimension, material, &format!("{{ first = {} }}", listed(dimension, first)))
                };
                let size = vec![1.0; first.len()];
                compare_numbers(&what, of_first, (&name("first"), &first, &size), (steps, 1e-6));
            }
            if dimension == 3 {
                let first = directions(3, [1.2, 0.4, 0.3], 1.0);
                let second = directions(3, [0.3, 1.0, -0.5], 2.0);
                let of = |first: &[f64], second: &[f64]| {
                    let axes = format!("{{ first = {}, second = {} }}", listed(3, first), listed(3, second));
                    block(scheme, 3, material, &axes)
                };
                let size = vec![1.0; first.len()];
                compare_numbers(&what, |a| of(a, &second), (&name("first"), &first, &size), (steps, 1e-6));
                compare_numbers(&what, |b| of(&first, b), (&name("second"), &second, &size), (steps, 1e-6));
            }
        }
    }
}

#[test]
fn directions_of_axes_in_each_element_of_second_order_have_derivatives() {
    for (dimension, (scheme, steps)) in [2, 3].into_iter().flat_map(|d| SCHEMES.map(|run| (d, run))) {
        let first = directions(dimension, [1.2, 0.4, 0.3], 1.0);
        let of = |first: &[f64]| {
            quadratic(scheme, dimension, FORMULA, &format!("{{ first = {} }}", listed(dimension, first)))
        };
        let (what, size) = (format!("{scheme}, {dimension}D"), vec![1.0; first.len()]);
        compare_numbers(&what, of, (&name("first"), &first, &size), (steps, 1e-6));
    }
}

#[test]
fn directions_of_axes_in_each_cell_have_derivatives() {
    for (dimension, (scheme, steps)) in [2, 3].into_iter().flat_map(|d| SCHEMES.map(|run| (d, run))) {
        let materials = if scheme == "quasi-static" { &[FORMULA][..] } else { &[FIBRES, FORMULA] };
        for (i, material) in materials.iter().enumerate() {
            let what = format!("{scheme}, {dimension}D, {i}");
            let count = if dimension == 2 { 2 } else { 1 };
            let first = directions_of(count, dimension, [1.2, 0.4, 0.3], 1.0);
            let size = vec![1.0; first.len()];
            let of_first = |first: &[f64]| {
                cells(scheme, dimension, material, &format!("{{ first = {} }}", listed(dimension, first)))
            };
            compare_numbers(&what, of_first, (&name("first"), &first, &size), (steps, 1e-6));
            if dimension == 3 {
                let second = directions_of(count, 3, [0.3, 1.0, -0.5], 2.0);
                let of = |first: &[f64], second: &[f64]| {
                    let axes = format!("{{ first = {}, second = {} }}", listed(3, first), listed(3, second));
                    cells(scheme, 3, material, &axes)
                };
                compare_numbers(&what, |a| of(a, &second), (&name("first"), &first, &size), (steps, 1e-6));
                compare_numbers(&what, |b| of(&first, b), (&name("second"), &second, &size), (steps, 1e-6));
            }
        }
    }
}

#[test]
fn tangents_by_directions_of_axes_are_the_transpose_of_gradients() {
    let axes = "{ first = { direction = ['cos(X)', 'sin(X)', 0.2] }, second = { direction = [0, 0, 1] } }";
    for material in [FIBRES, FORMULA] {
        compare("axes", &block("bdf2", 3, material, axes), &[&name("first"), &name("second")], 12);
        compare("quadratic", &quadratic("bdf2", 3, material, axes), &[&name("first"), &name("second")], 12);
        compare("cells", &cells("bdf2", 3, material, axes), &[&name("first"), &name("second")], 12);
    }
}

/// Constants of materials whose axes turn from one element to the next.
#[test]
fn constants_of_turned_materials_have_derivatives() {
    let axes = "{ first = { direction = ['cos(3*X)', 'sin(3*X)'] } }";
    for (scheme, steps) in SCHEMES {
        let of =
            |k1: &[f64]| block(scheme, 2, &FIBRES.replace("k1 = 1e4", &format!("k1 = {:?}", k1[0])), axes);
        compare_numbers(scheme, of, ("body.block.elastic.k1", &[1e4], &[1e4]), (steps, 1e-6));
        let of =
            |k1: &[f64]| cells(scheme, 2, &FIBRES.replace("k1 = 1e4", &format!("k1 = {:?}", k1[0])), axes);
        compare_numbers(scheme, of, ("body.block.elastic.k1", &[1e4], &[1e4]), (steps, 1e-6));
    }
}
