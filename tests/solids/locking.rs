//! Warnings of locking and of bending that is too soft, by their cause; none where neither is.

use pliant_scene::Scene;
use pliant_scene::assembly::{Report, UnstableStep};
use serde_json::{Value, json};

use super::benchmarks::sheared;
use crate::support::method;
use crate::support::solid::{Kind, Solid, at_zero, isotropic};

/// Warnings of one body with these keys.
fn warnings(dimension: usize, body: Value) -> Vec<String> {
    let scene: Scene = serde_json::from_value(json!({
        "dimension": dimension,
        "time": { "integrator": "implicit-euler", "step": 1e-3, "duration": 0.01 },
        "body": [body],
    }))
    .unwrap();
    let Report { warnings, .. } =
        scene.assemble(UnstableStep::Accept).map_err(|p| format!("{p:?}")).unwrap().report;
    warnings
}

/// A body of linear elements, and other keys.
fn body(mesh: Value, elastic: Value, others: Value) -> Value {
    let mut body = json!({ "mesh": mesh, "elastic": elastic, "mass": { "density": 1000.0 } });
    body.as_object_mut().unwrap().extend(others.as_object().unwrap().clone());
    body
}

fn grid(cells: &[usize], size: &[f64]) -> Value {
    json!({ "grid": { "cells": cells, "size": size } })
}

/// A grid of quadrilaterals or hexahedra in place of simplices.
fn whole(mut grid: Value) -> Value {
    let flat = grid["grid"]["cells"].as_array().unwrap().len() == 2;
    grid["grid"]["element"] = json!(if flat { "quadrilateral" } else { "hexahedron" });
    grid
}

/// A cube that does not bend.
fn cube(dimension: usize) -> Value {
    grid(&vec![2; dimension], &vec![1.0; dimension])
}

#[test]
fn nearly_incompressible_linear_elements_are_said_to_lock_whatever_their_ratio_is_from() {
    for dimension in [2, 3] {
        let locks = |elastic: Value, others: Value| {
            let warnings = warnings(dimension, body(cube(dimension), elastic, others));
            warnings.iter().filter(|text| text.contains("Poisson's ratio")).count() == 1
                && warnings.len() == 1
        };
        let materials = [
            isotropic("linear", 1e6, 0.45),
            isotropic("neo-hookean", 1e6, 0.49),
            json!({ "mooney-rivlin": { "c10": 1e5, "c01": 1e4, "poisson": 0.495 } }),
            json!({ "ogden": { "mu": [1e5], "alpha": [2.0], "poisson": 0.4999 } }),
            json!({ "stable-neo-hookean": { "preset": "silicone" } }),
            json!({ "hencky": { "preset": "rubber" } }),
        ];
        for elastic in materials {
            assert!(locks(elastic.clone(), json!({})), "{dimension}D, {elastic}");
            let second = warnings(dimension, body(cube(dimension), elastic.clone(), json!({ "order": 2 })));
            assert!(second.is_empty(), "{second:?}");
            let whole = warnings(dimension, body(whole(cube(dimension)), elastic.clone(), json!({})));
            assert!(whole.is_empty(), "{whole:?}");
        }
        let free = [
            isotropic("linear", 1e6, 0.449),
            json!({ "arap": { "young": 1e6 } }),
            json!({ "neo-hookean": { "preset": "steel" } }),
        ];
        for elastic in free {
            assert!(!locks(elastic.clone(), json!({})), "{dimension}D, {elastic}");
        }
    }
    // In plane stress the thickness gives way.
    let plane = json!({ "linear": { "young": 1e6, "poisson": 0.49, "plane": "stress" } });
    assert!(warnings(2, body(cube(2), plane, json!({}))).is_empty());
    let sheet = json!({ "membrane": { "thickness": 0.01 } });
    let cloth = json!({ "cloth": {
        "cells": [4, 4], "origin": [0.0, 0.0, 0.0], "u": [1.0, 0.0, 0.0], "v": [0.0, 1.0, 0.0],
    } });
    let silk = body(cloth, isotropic("neo-hookean", 1e6, 0.49), sheet);
    assert!(warnings(3, silk).is_empty());
}

#[test]
fn few_cells_through_what_bends_are_counted_and_many_or_thick_ones_are_not() {
    let steel = || json!({ "corotated": { "preset": "steel" } });
    let said = |dimension: usize, mesh: Value, others: Value| {
        let warnings = warnings(dimension, body(mesh, steel(), others));
        assert!(warnings.len() < 2, "{warnings:?}");
        warnings.into_iter().next()
    };
    for (cells, size, count, thickness) in [
        (vec![20, 2], vec![10.0, 1.0], "2.0", "1"),
        (vec![3, 50], vec![0.1, 0.5], "3.0", "0.1"),
        (vec![40, 2, 2], vec![1.0, 0.05, 0.05], "2.0", "0.05"),
        (vec![8, 8, 1], vec![1.0, 1.0, 0.1], "1.0", "0.1"),
    ] {
        let text = said(cells.len(), grid(&cells, &size), json!({})).unwrap_or_else(|| panic!("{cells:?}"));
        let counted = format!("{count} linear elements through its thickness of {thickness} m");
        assert!(text.contains(&counted) && text.contains("use `order = 2` in the body, or quadri"), "{text}");
        assert_eq!(said(cells.len(), grid(&cells, &size), json!({ "order": 2 })), None);
        assert_eq!(said(cells.len(), whole(grid(&cells, &size)), json!({})), None);
    }
    let ring = json!({ "annulus": { "inner_radius": 0.9, "outer_radius": 1.0, "cells": [2, 80] } });
    assert!(said(2, ring, json!({})).unwrap().contains("2.0 linear elements through"));
    let tube =
        json!({ "tube": { "inner_radius": 0.9, "outer_radius": 1.0, "height": 3.0, "cells": [1, 24, 8] } });
    assert!(said(3, tube, json!({})).unwrap().contains("too stiff in bending"));
    // Enough cells; cubes, balls and short blocks of few.
    for (dimension, mesh) in [
        (2, grid(&[40, 4], &[10.0, 1.0])),
        (3, grid(&[20, 4, 4], &[1.0, 0.1, 0.1])),
        (2, grid(&[1, 1], &[1.0, 1.0])),
        (3, grid(&[1, 1, 1], &[1.0, 1.0, 1.0])),
        (3, grid(&[2, 3, 2], &[1.0, 2.0, 1.0])),
        (3, json!({ "ball": { "radius": 1.0, "cells": 2 } })),
        (2, json!({ "cooks_membrane": { "cells": [4, 4] } })),
    ] {
        assert_eq!(said(dimension, mesh, json!({})), None);
    }
}

/// Thin shells of second order whose straight sides are off their curve are said to bend too stiffly, those
/// of more elements, thick and flat ones not.
#[test]
fn facets_of_second_order_are_said_to_bend_too_stiffly() {
    let said = |mesh: Value| {
        let order = json!({ "order": 2 });
        warnings(3, body(mesh, isotropic("neo-hookean", 1e6, 0.3), order))
    };
    let tube = |thickness: f64, around: usize| {
        let radii = [1.0 - thickness, 1.0];
        let cells = [1, around, 8];
        let [inner, outer] = radii;
        json!({ "tube": { "inner_radius": inner, "outer_radius": outer, "height": 3.0, "cells": cells } })
    };
    // A mesh that somebody else made: its vertices alone say where the curve was.
    let straight = |thickness: f64, around: usize| {
        let solid = Solid { mesh: tube(thickness, around), ..Solid::grid(&[1, 1, 1], &[1.0; 3], json!({})) };
        Solid::inline(&solid.mesh(), json!({})).mesh
    };
    let found = said(straight(0.02, 16));
    assert!(found.len() == 1 && found[0].contains("facets"), "{found:?}");
    let flat = grid(&[20, 20, 1], &[1.0, 1.0, 0.01]);
    for none in [straight(0.02, 64), straight(0.1, 16), tube(0.02, 16), flat] {
        let found = said(none);
        assert!(found.is_empty(), "{found:?}");
    }
}

/// Slender bodies of a few cells: those that are trapezoids are said to bend too stiffly, parallelograms not.
#[test]
fn trapezoids_of_few_rows_are_said_to_bend_too_stiffly() {
    for dimension in [2, 3] {
        let said = |slant: fn(usize) -> f64, rows: usize| {
            let cells = [12, rows, rows];
            let size = [6.0, 1.0, 1.0];
            let elastic = isotropic("linear", 1e6, 0.3);
            let mut mesh = Solid::grid(&cells[..dimension], &size[..dimension], elastic.clone());
            mesh = mesh.of_kind(Kind::Whole);
            let mut whole = mesh.mesh();
            for x in whole.points.chunks_exact_mut(dimension) {
                let column = (2.0 * x[0]).round() as usize;
                x[0] += slant(column) * (x[1] - 0.5);
            }
            let solid = Solid::inline(&whole, elastic.clone());
            warnings(dimension, body(solid.mesh, elastic, json!({})))
        };
        let trapezoids = |column: usize| if column % 2 == 1 { 0.3 } else { -0.3 };
        let found = said(trapezoids, 1);
        assert!(found.len() == 1 && found[0].contains("not parallelograms"), "{found:?}");
        for none in [said(|_| 0.0, 1), said(|_| 0.3, 1), said(trapezoids, 5)] {
            assert!(none.is_empty(), "{none:?}");
        }
    }
}

/// Deflection of the end of a cantilever, in the plane under a shear, in space under its weight.
fn deflection(solid: Solid, size: &[f64]) -> f64 {
    match size {
        [length, height] => sheared(solid, *length, *height, 1.0, 1, [*length, *height])[1],
        _ => hung(solid, size),
    }
}

/// Deflection as a part of that of quadratic elements.
fn part(solid: Solid, size: &[f64]) -> f64 {
    deflection(solid.clone(), size) / deflection(solid.of_order(2), size)
}

/// Deflection of the end of a cantilever in space under its weight.
pub(super) fn hung(mut solid: Solid, size: &[f64]) -> f64 {
    (solid.pin, solid.gravity) = (at_zero(3, 0), Some(vec![0.0, 0.0, -1e-3]));
    let mut simulation = solid.simulation(method("quasi-static"), 1.0);
    let rest = simulation.state().x().to_vec();
    simulation.step().unwrap();
    let near = |x: &[f64]| x.iter().zip(size).all(|(x, end)| (x - end).abs() < 1e-9);
    let end = rest.chunks_exact(3).position(near).unwrap();
    simulation.state().x()[3 * end + 2] - rest[3 * end + 2]
}

// The factor of the message: 1 + 4/n^2 for n square cells through the thickness, within a fifth of it.
#[test]
fn bending_is_as_much_too_stiff_as_the_message_says() {
    for (size, most) in [(vec![10.0, 1.0], 6usize), (vec![10.0, 1.0, 1.0], 3)] {
        for n in 1..=most {
            let mut cells = vec![n; size.len()];
            cells[0] = 10 * n;
            let solid = Solid::grid(&cells, &size, isotropic("linear", 1e6, 0.3));
            let (stiffness, said) = (1.0 / part(solid, &size), 1.0 + 4.0 / (n * n) as f64);
            assert!(
                (stiffness / said - 1.0).abs() < 0.2,
                "{}D, {n} cells: {stiffness}, said {said}",
                size.len()
            );
        }
    }
}

// And both that are named as remedies agree within a tenth on the same two cells, where linear triangles have
// half or less.
#[test]
fn what_is_named_in_place_does_not_lock() {
    for poisson in [0.3, 0.49] {
        let size = [10.0, 1.0];
        let solid = Solid::grid(&[20, 2], &size, isotropic("linear", 1e6, poisson));
        let quadratic = deflection(solid.clone().of_order(2), &size);
        let [linear, whole] =
            [solid.clone(), solid.of_whole_cells()].map(|solid| deflection(solid, &size) / quadratic);
        assert!(linear < 0.6, "nu = {poisson}: {linear}");
        assert!((whole - 1.0).abs() < 0.1, "nu = {poisson}: {whole}");
    }
}

// Whole cells bend as a beam does, in single rows whatever their width along it is: deflections over theory.
// Of two rows cells know less than all of their own bending, and in space are sheared where they bend to a
// saddle.
#[test]
fn whole_cells_bend_as_a_beam_does() {
    let plane = |poisson: f64| 1e7 / (1.0 - poisson * poisson);
    let stress = json!({ "linear": { "young": 1e7, "poisson": 0.3, "plane": "stress" } });
    for (cells, elastic, modulus, within) in [
        (vec![30, 1], isotropic("linear", 1e7, 0.3), plane(0.3), 2e-3),
        (vec![60, 1], isotropic("linear", 1e7, 0.0), 1e7, 2e-3),
        (vec![60, 1], isotropic("neo-hookean", 1e7, 0.49), plane(0.49), 2e-3),
        (vec![90, 1], isotropic("corotated", 1e7, 0.3), plane(0.3), 2e-3),
        (vec![60, 2], stress, 1e7, 7e-2),
        (vec![30, 1, 1], isotropic("linear", 1e7, 0.3), 1e7, 5e-3),
        (vec![60, 1, 1], isotropic("linear", 1e7, 0.49), 1e7, 5e-3),
        (vec![60, 2, 1], isotropic("stable-neo-hookean", 1e7, 0.3), 1e7, 3e-2),
        (vec![60, 2, 2], isotropic("linear", 1e7, 0.3), 1e7, 5e-2),
    ] {
        let (d, size) = (cells.len(), [6.0, 0.2, 0.2]);
        let name = format!("{cells:?}, {elastic}");
        let mut solid = Solid::grid(&cells, &size[..d], elastic).of_whole_cells();
        let (mut normal, mut traction) = (vec![0.0; d], vec![0.0; d]);
        (normal[0], traction[1]) = (-1.0, 1e-3);
        solid.pin = at_zero(d, 0);
        let end = json!({ "normal": normal, "offset": -size[0] });
        solid.load = json!([{ "half_space": end, "traction": traction }]);
        let mut simulation = solid.simulation(method("quasi-static"), 1.0);
        let rest = simulation.state().x().to_vec();
        simulation.step().unwrap();
        let last = rest.len() - d + 1;
        let theory = 1e-3 * size[0].powi(3) / (3.0 * modulus * size[1].powi(2) / 12.0);
        let measured = (simulation.state().x()[last] - rest[last]) / theory;
        assert!((measured - 1.0).abs() < within, "{name}: {measured} of theory");
    }
}
