//! Constants of materials that are no Lame parameters.

use pliant_scene::Scene;

use crate::by_parameters::compare;
use crate::differences::{compare_number, compare_numbers};
use crate::support::scene;

/// A stretched block that falls and turns, held at one end; of elements of this kind, of this material.
pub(crate) fn block(scheme: &str, (dimension, order, element): (usize, u32, &str), material: &str) -> Scene {
    let (cells, size, gravity, held, start) = match dimension {
        2 => ("[2, 1]", "[0.6, 0.3]", "[2.7, -9.81]", "[1, 0]", "[[1.4, 0.1], [-0.1, 0.8]]"),
        _ => (
            "[1, 1, 1]",
            "[0.5, 0.3, 0.4]",
            "[2.7, -9.81, 2.0]",
            "[1, 0, 0]",
            "[[1.4, 0.1, 0], [-0.1, 0.8, 0.1], [0, 0, 0.9]]",
        ),
    };
    let element = if element.is_empty() { String::new() } else { format!(", element = \"{element}\"") };
    let order = if element.is_empty() { format!("order = {order}") } else { String::new() };
    let text = format!(
        "[world]
         gravity = {gravity}
         [[body]]
         name = \"block\"
         mesh = {{ grid = {{ cells = {cells}, size = {size}{element} }} }}
         {order}
         elastic = {material}
         mass = {{ density = 1000.0 }}
         position = {{ affine = {{ matrix = {start} }} }}
         pin = [{{ half_space = {{ normal = {held}, offset = 0 }} }}]"
    );
    scene(scheme, dimension, [0.01, 1e-3], &text)
}

const KINDS: [(usize, u32, &str); 5] =
    [(2, 1, ""), (3, 1, ""), (2, 2, ""), (2, 1, "quadrilateral"), (3, 1, "hexahedron")];

/// Schemes and steps.
const RUNS: [(&str, u64); 3] = [("velocity-verlet", 40), ("implicit-euler", 12), ("quasi-static", 2)];

fn name(key: &str) -> String {
    format!("body.block.elastic.{key}")
}

#[test]
fn constants_of_mooney_and_rivlin_have_derivatives() {
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        let what = format!("{scheme}, {kind:?}");
        let taken = |c10: f64, c01: f64, poisson: f64| {
            let material =
                format!("{{ mooney-rivlin = {{ c10 = {c10:?}, c01 = {c01:?}, poisson = {poisson:?} }} }}");
            block(scheme, kind, &material)
        };
        compare_number(&what, |c10| taken(c10, 3e3, 0.4), (&name("c10"), 9e3, 9e3), (steps, 1e-6));
        compare_number(&what, |c01| taken(9e3, c01, 0.4), (&name("c01"), 3e3, 3e3), (steps, 1e-6));
        compare_number(&what, |nu| taken(9e3, 3e3, nu), (&name("poisson"), 0.4, 0.1), (steps, 1e-6));
        // The bulk modulus held, or changed.
        let pressed = |c10: f64, c01: f64, d1: f64| {
            block(
                scheme,
                kind,
                &format!("{{ mooney-rivlin = {{ c10 = {c10:?}, c01 = {c01:?}, d1 = {d1:?} }} }}"),
            )
        };
        compare_number(&what, |c10| pressed(c10, 3e3, 2e-5), (&name("c10"), 9e3, 9e3), (steps, 1e-6));
        compare_number(&what, |c01| pressed(9e3, c01, 2e-5), (&name("c01"), 3e3, 3e3), (steps, 1e-6));
        compare_number(&what, |d1| pressed(9e3, 3e3, d1), (&name("d1"), 2e-5, 2e-5), (steps, 1e-6));
        let scaled = |young: f64, c10: f64| {
            let further = format!("young = {young:?}, c10 = {c10:?}");
            let material = format!("{{ mooney-rivlin = {{ {further}, c01 = 0.2, poisson = 0.4 }} }}");
            block(scheme, kind, &material)
        };
        compare_number(&what, |young| scaled(young, 0.3), (&name("young"), 6e4, 6e4), (steps, 1e-6));
        compare_number(&what, |c10| scaled(6e4, c10), (&name("c10"), 0.3, 0.3), (steps, 1e-6));
    }
}

#[test]
fn constants_of_ogden_have_derivatives() {
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        let what = format!("{scheme}, {kind:?}");
        let taken = |young: &str, mu: &[f64], alpha: &[f64], poisson: f64| {
            let further = format!("mu = {mu:?}, alpha = {alpha:?}, poisson = {poisson:?}");
            block(scheme, kind, &format!("{{ ogden = {{ {young}{further} }} }}"))
        };
        let (mu, alpha) = ([2e4, 4e2, -3e3], [1.4, 4.5, -2.0]);
        let of_mu = |mu: &[f64]| taken("", mu, &alpha, 0.4);
        compare_numbers(&what, of_mu, (&name("mu"), &mu, &mu), (steps, 1e-6));
        let of_alpha = |alpha: &[f64]| taken("", &mu, alpha, 0.4);
        compare_numbers(&what, of_alpha, (&name("alpha"), &alpha, &alpha), (steps, 1e-6));
        let of_poisson = |poisson: f64| taken("", &mu, &alpha, poisson);
        compare_number(&what, of_poisson, (&name("poisson"), 0.4, 0.1), (steps, 1e-6));
        let of_young = |young: f64| taken(&format!("young = {young:?}, "), &mu, &alpha, 0.4);
        compare_number(&what, of_young, (&name("young"), 6e4, 6e4), (steps, 1e-6));
        let scaled = |mu: &[f64]| taken("young = 6e4, ", mu, &alpha, 0.4);
        compare_numbers(&what, scaled, (&name("mu"), &mu, &mu), (steps, 1e-6));
    }
}

// Fibres along which the block is stretched.
#[test]
fn constants_and_directions_of_fibres_have_derivatives() {
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        let what = format!("{scheme}, {kind:?}");
        let of = |numbers: [f64; 5], fibre: &[f64]| {
            let [shear, bulk, k1, k2, dispersion] = numbers;
            let of_fibres =
                format!("k1 = {k1:?}, k2 = {k2:?}, dispersion = {dispersion:?}, fibres = [{fibre:?}]");
            let constants = format!("shear = {shear:?}, bulk = {bulk:?}, {of_fibres}");
            block(scheme, kind, &format!("{{ holzapfel-gasser-ogden = {{ {constants} }} }}"))
        };
        let (numbers, fibre) = ([8e3, 5e4, 1e4, 1.2, 0.1], [1.0, -0.4]);
        for (i, key) in ["shear", "bulk", "k1", "k2", "dispersion"].iter().enumerate() {
            let changed = |number: f64| {
                let mut numbers = numbers;
                numbers[i] = number;
                of(numbers, &fibre)
            };
            compare_number(&what, changed, (&name(key), numbers[i], numbers[i]), (steps, 1e-6));
        }
        let turned = |fibre: &[f64]| of(numbers, fibre);
        compare_numbers(&what, turned, (&name("fibres"), &fibre, &[1.0; 2]), (steps, 1e-6));
        if kind.0 == 3 {
            let fibre = [1.0, -0.3, 0.2];
            compare_numbers(&what, turned, (&name("fibres"), &fibre, &[1.0; 3]), (steps, 1e-6));
        }
    }
}

#[test]
fn the_stiffness_of_models_for_teaching_has_a_derivative() {
    for (scheme, steps) in RUNS {
        for model in ["dirichlet", "displacement-gradient"] {
            let of = |k: f64| block(scheme, KINDS[0], &format!("{{ {model} = {{ stiffness = {k:?} }} }}"));
            compare_number(model, of, (&name("stiffness"), 2e4, 2e4), (steps, 1e-6));
        }
    }
}

#[test]
fn tangents_by_arrays_of_constants_are_the_transpose_of_gradients() {
    let material = "{ ogden = { mu = [2e4, 4e2, -3e3], alpha = [1.4, 4.5, -2.0], poisson = 0.4 } }";
    let keys = ["mu", "alpha", "poisson"].map(name);
    compare("ogden", &block("bdf2", KINDS[0], material), &keys.each_ref().map(|key| &key[..]), 12);
}
