//! Generated shapes: counts, volumes against closed forms, quality, and groups that cover the boundary.

use std::f64::consts::PI;
use std::path::Path;

use super::geometry::measure;
use super::{Mesh, MeshError, build, predicted_size};
use crate::spec::*;

fn built(spec: &MeshSpec, dimension: usize) -> Mesh {
    let mesh = build(spec, dimension, Path::new(".")).unwrap_or_else(|error| panic!("{spec:?}: {error}"));
    let size = predicted_size(spec, dimension, Path::new(".")).unwrap();
    assert_eq!(size.vertices, mesh.vertex_count() as u64, "{spec:?}");
    assert_eq!(size.triangles, mesh.triangles.len() as u64, "{spec:?}");
    assert_eq!(size.tetrahedra, mesh.tetrahedra.len() as u64, "{spec:?}");
    assert_eq!(size.lines, mesh.lines.len() as u64 - extra_lines(spec), "{spec:?}");
    assert_eq!(spec.vertex_count(), Some(size.vertices));
    mesh
}

/// The notch repeats these lines of the top side in its own group.
fn extra_lines(spec: &MeshSpec) -> u64 {
    if let MeshSpec::NotchedBeam(beam) = spec { 2 * beam.cells[1] as u64 } else { 0 }
}

fn volume(mesh: &Mesh) -> f64 {
    mesh.quality().elements.unwrap().total_volume
}

fn ball(cells: usize) -> MeshSpec {
    MeshSpec::Ball(BallSpec { radius: 2.0, cells, centre: Some(vec![1.0, -2.0, 0.5]) })
}

fn sphere(cells: usize) -> MeshSpec {
    MeshSpec::Sphere(SphereSpec { radius: 2.0, cells, centre: None })
}

fn cylinder(cells: [usize; 2]) -> MeshSpec {
    MeshSpec::Cylinder(CylinderSpec { radius: 0.5, height: 3.0, cells, origin: Some(vec![1.0, 2.0, 3.0]) })
}

fn tube(cells: [usize; 3]) -> MeshSpec {
    MeshSpec::Tube(TubeSpec { inner_radius: 0.6, outer_radius: 1.0, height: 2.0, cells, origin: None })
}

fn annulus(cells: [usize; 2]) -> MeshSpec {
    MeshSpec::Annulus(AnnulusSpec {
        inner_radius: 1.0,
        outer_radius: 2.0,
        cells,
        centre: Some(vec![3.0, 0.0]),
        element: None,
    })
}

fn notched() -> MeshSpec {
    let cells = [6, 2, 4];
    MeshSpec::NotchedBeam(NotchedBeamSpec {
        length: 4.0,
        height: 1.0,
        depth: 0.25,
        width: 0.5,
        cells,
        element: None,
    })
}

fn elliptic(cells: [usize; 2]) -> MeshSpec {
    let [inner, outer] = [[2.0, 1.0], [3.25, 2.75]];
    MeshSpec::EllipticMembrane(EllipticMembraneSpec { cells, inner, outer, element: None })
}

/// Area of a regular polygon with `n` corners at distance 1 from its centre.
fn polygon(n: usize) -> f64 {
    0.5 * n as f64 * (2.0 * PI / n as f64).sin()
}

#[test]
fn prismatic_shapes_have_the_volume_of_their_polygons() {
    for n in [1, 2, 5] {
        let expected = 0.25 * polygon(6 * n) * 3.0;
        assert!((volume(&built(&cylinder([n, 4]), 3)) / expected - 1.0).abs() < 1e-13);
    }
    for around in [3, 4, 7, 24] {
        let expected = polygon(around) * (1.0 - 0.36) * 2.0;
        assert!((volume(&built(&tube([2, around, 3]), 3)) / expected - 1.0).abs() < 1e-13);
        let expected = polygon(around) * 3.0;
        assert!((volume(&built(&annulus([3, around]), 2)) / expected - 1.0).abs() < 1e-13);
    }
    for n in [2, 6] {
        let expected = polygon(4 * n) / 4.0 * (3.25 * 2.75 - 2.0);
        assert!((volume(&built(&elliptic([4, n]), 2)) / expected - 1.0).abs() < 1e-13);
    }
}

/// Inscribed polyhedra: the errors of volume and area fall with the square of the edge length.
#[test]
fn balls_and_spheres_converge_with_the_square_of_the_edge_length() {
    let (solid, surface) = (4.0 / 3.0 * PI * 8.0, 4.0 * PI * 4.0);
    for (exact, shape) in [(solid, ball as fn(usize) -> MeshSpec), (surface, sphere)] {
        let error = |cells: usize| 1.0 - volume(&built(&shape(cells), 3)) / exact;
        let errors = [error(2), error(4), error(8)];
        assert!(errors[2] > 0.0, "inscribed");
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((1.9..2.1).contains(&order), "{errors:?}");
        }
    }
}

#[test]
fn benchmarks_have_their_corners_and_areas() {
    let cook = built(&MeshSpec::CooksMembrane(CooksMembraneSpec { cells: [4, 2], element: None }), 2);
    assert!((volume(&cook) - 1440.0).abs() < 1e-11);
    for (vertex, corner) in
        [(0, [0.0, 0.0]), (2, [0.0, 44.0]), (12, [48.0, 44.0]), (13, [48.0, 52.0]), (14, [48.0, 60.0])]
    {
        assert_eq!(cook.point(vertex), corner);
    }
    assert_eq!(cook.groups["right"].vertices, [12, 13, 14]);
    let tapered = TaperedBeamSpec { cells: [10, 4], length: 10.0, heights: [5.0, 1.0], element: None };
    let fv32 = built(&MeshSpec::TaperedBeam(tapered), 2);
    assert!((volume(&fv32) - 30.0).abs() < 1e-12);
    assert_eq!((fv32.point(0), fv32.point(4)), (&[0.0, -2.5][..], &[0.0, 2.5][..]));
    assert_eq!((fv32.point(50), fv32.point(54)), (&[10.0, -0.5][..], &[10.0, 0.5][..]));
    let le1 = built(&elliptic([2, 3]), 2);
    for (vertex, corner) in [(0, [2.0, 0.0]), (8, [3.25, 0.0]), (3, [0.0, 1.0]), (11, [0.0, 2.75])] {
        assert_eq!(le1.point(vertex), corner);
    }
    assert_eq!(le1.groups["inner"].vertices, [0, 1, 2, 3]);
    let beam = built(&notched(), 2);
    assert!((volume(&beam) - (4.0 - 0.5 * 0.5 * 0.25)).abs() < 1e-13);
    let notch: Vec<&[f64]> = beam.groups["notch"].vertices.iter().map(|&v| beam.point(v as usize)).collect();
    assert_eq!(notch, [[1.75, 1.0], [1.875, 0.875], [2.0, 0.75], [2.125, 0.875], [2.25, 1.0]]);
}

/// Quadrilateral meshes of plane shapes have the vertices, sides and area of the triangle meshes.
#[test]
fn mapped_rectangles_are_made_of_quadrilaterals_too() {
    for name in ["cooks_membrane", "tapered_beam", "elliptic_membrane", "notched_beam"] {
        let mut keys = serde_json::json!({ "cells": [4, 3] });
        if name == "notched_beam" {
            keys = serde_json::json!({
                "length": 4.0, "height": 1.0, "depth": 0.25, "width": 0.5, "cells": [3, 1, 2],
            });
        }
        let of = |element: Option<&str>| {
            let mut keys = keys.clone();
            element.into_iter().for_each(|element| keys["element"] = element.into());
            serde_json::from_value::<MeshSpec>(serde_json::json!({ name: keys })).unwrap()
        };
        let (halves, whole) = (built(&of(None), 2), built(&of(Some("quadrilateral")), 2));
        assert_eq!((&whole.points, &whole.lines), (&halves.points, &halves.lines), "{name}");
        assert_eq!(whole.groups, halves.groups, "{name}");
        assert_eq!((whole.triangles.len(), 2 * whole.element_count()), (0, halves.element_count()), "{name}");
        let area = whole.quality().elements.unwrap().total_volume;
        assert!((area / volume(&halves) - 1.0).abs() < 1e-13, "{name}: {area}");
        let size = crate::predicted_size(&of(Some("quadrilateral")), 2, Path::new("")).unwrap();
        assert_eq!((size.blocks, size.triangles), (whole.element_count() as u64, 0), "{name}");
        let wrong = crate::build(&of(Some("hexahedron")), 2, Path::new(""));
        assert!(matches!(wrong, Err(MeshError::WrongElement { found: "hexahedron", .. })), "{name}");
    }
}

/// Defaults are the dimensions of the benchmarks.
#[test]
fn the_defaults_are_those_of_nafems() {
    let spec: TaperedBeamSpec = serde_json::from_str(r#"{ "cells": [1, 1] }"#).unwrap();
    assert_eq!((spec.length, spec.heights), (10.0, [5.0, 1.0]));
    let spec: EllipticMembraneSpec = serde_json::from_str(r#"{ "cells": [1, 1] }"#).unwrap();
    assert_eq!((spec.inner, spec.outer), ([2.0, 1.0], [3.25, 2.75]));
}

/// Bounds on the mean ratio for cells about as long as wide; a grid has 0.756 in 3D and 0.866 in 2D.
/// Cook's membrane is sheared, and its reference values were computed with the less favourable split
/// (verification C9).
#[test]
fn elements_are_well_shaped() {
    let cook = MeshSpec::CooksMembrane(CooksMembraneSpec { cells: [16, 16], element: None });
    let tapered = TaperedBeamSpec { cells: [20, 6], length: 10.0, heights: [5.0, 1.0], element: None };
    for (spec, dimension, worst, average) in [
        (ball(2), 3, 0.65, 0.85),
        (ball(6), 3, 0.65, 0.85),
        (sphere(6), 3, 0.95, 0.99),
        (cylinder([3, 18]), 3, 0.65, 0.75),
        (tube([2, 24, 10]), 3, 0.6, 0.7),
        (annulus([5, 40]), 2, 0.75, 0.8),
        (elliptic([6, 12]), 2, 0.7, 0.8),
        (cook, 2, 0.25, 0.45),
        (MeshSpec::TaperedBeam(tapered), 2, 0.45, 0.75),
        (notched(), 2, 0.4, 0.75),
    ] {
        let q = built(&spec, dimension).quality().elements.unwrap();
        assert!(
            q.worst_mean_ratio > worst && q.average_mean_ratio > average,
            "{spec:?}: {} {}",
            q.worst_mean_ratio,
            q.average_mean_ratio
        );
    }
}

/// The groups cover the whole boundary, each with the right area.
#[test]
fn groups_cover_the_boundary_and_face_outwards() {
    for (spec, areas) in [
        (ball(3), vec![("surface", None)]),
        (
            cylinder([2, 3]),
            vec![
                ("bottom", Some(0.25 * polygon(12))),
                ("side", Some(12.0 * (PI / 12.0).sin() * 3.0)),
                ("top", Some(0.25 * polygon(12))),
            ],
        ),
        (
            tube([2, 9, 3]),
            vec![
                ("bottom", Some(polygon(9) * 0.64)),
                ("inner", Some(18.0 * 0.6 * (PI / 9.0).sin() * 2.0)),
                ("outer", Some(18.0 * (PI / 9.0).sin() * 2.0)),
                ("top", Some(polygon(9) * 0.64)),
            ],
        ),
    ] {
        let mesh = built(&spec, 3);
        assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), areas.iter().map(|a| a.0).collect::<Vec<_>>());
        let canonical = |cell: [u32; 3]| {
            let least = (0..3).min_by_key(|&i| cell[i]).unwrap();
            [cell[least], cell[(least + 1) % 3], cell[(least + 2) % 3]]
        };
        let sorted = |cells: &[[u32; 3]]| {
            let mut cells: Vec<[u32; 3]> = cells.iter().map(|&cell| canonical(cell)).collect();
            cells.sort_unstable();
            cells
        };
        assert_eq!(sorted(&mesh.triangles), sorted(&mesh.surface_triangles()), "with the same orientation");
        for (name, area) in areas {
            let group = &mesh.groups[name];
            assert_eq!(group.topological_dimension, 2);
            let cells = group.cells.iter().map(|&cell| mesh.triangles[cell as usize]);
            let found: f64 = cells.map(|cell| measure(&mesh.points, 3, cell).volume).sum();
            assert!(area.is_none_or(|area| (found / area - 1.0).abs() < 1e-13), "{name}: {found} {area:?}");
        }
    }
    for (spec, names) in [
        (annulus([2, 8]), vec!["inner", "outer"]),
        (elliptic([2, 3]), vec!["bottom", "inner", "left", "outer"]),
        (notched(), vec!["bottom", "left", "notch", "right", "top"]),
    ] {
        let mesh = built(&spec, 2);
        assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), names);
        let mut lines = mesh.lines.clone();
        lines.sort_unstable();
        lines.dedup();
        let mut outline = mesh.boundary_edges();
        outline.sort_unstable();
        assert_eq!(lines, outline, "counter-clockwise about the body");
    }
    let round = built(&ball(3), 3);
    for &vertex in &round.groups["surface"].vertices {
        let x = round.point(vertex as usize);
        let r = ((x[0] - 1.0).powi(2) + (x[1] + 2.0).powi(2) + (x[2] - 0.5).powi(2)).sqrt();
        assert!((r - 2.0).abs() < 4e-15);
    }
}

#[test]
fn faults_of_the_specification_are_told_apart() {
    let fault = |spec: MeshSpec, dimension| build(&spec, dimension, Path::new(".")).unwrap_err();
    for spec in [ball(1), sphere(1), cylinder([1, 1]), tube([1, 3, 1])] {
        assert!(matches!(fault(spec, 2), MeshError::ShapeDimension { dimension: 3, .. }));
    }
    for spec in [annulus([1, 3]), notched(), elliptic([1, 1])] {
        assert!(matches!(fault(spec, 3), MeshError::ShapeDimension { dimension: 2, .. }));
    }
    for (spec, dimension) in [(ball(0), 3), (sphere(0), 3), (cylinder([1, 0]), 3), (elliptic([0, 1]), 2)] {
        assert!(matches!(fault(spec, dimension), MeshError::ZeroCount { field: "cells" }));
    }
    assert!(matches!(fault(annulus([1, 2]), 2), MeshError::TooFew { count: 2, least: 3, .. }));
    assert!(matches!(fault(tube([1, 2, 1]), 3), MeshError::TooFew { count: 2, least: 3, .. }));
    assert!(matches!(fault(ball(1 << 20), 3), MeshError::TooMany { .. }));
    let ring =
        AnnulusSpec { inner_radius: 2.0, outer_radius: 2.0, cells: [1, 3], centre: None, element: None };
    assert!(matches!(fault(MeshSpec::Annulus(ring), 2), MeshError::NotLess { field: "inner_radius", .. }));
    let flat = BallSpec { radius: -1.0, cells: 1, centre: None };
    assert!(matches!(fault(MeshSpec::Ball(flat), 3), MeshError::NotPositive { field: "radius", .. }));
    let away = CylinderSpec { radius: 1.0, height: 1.0, cells: [1, 1], origin: Some(vec![0.0; 2]) };
    assert!(matches!(fault(MeshSpec::Cylinder(away), 3), MeshError::Components { field: "origin", .. }));
    let MeshSpec::NotchedBeam(beam) = notched() else { panic!() };
    let deep = NotchedBeamSpec { depth: 1.0, ..beam.clone() };
    assert!(matches!(fault(MeshSpec::NotchedBeam(deep), 2), MeshError::NotLess { field: "depth", .. }));
    let wide = NotchedBeamSpec { width: 4.0, ..beam };
    assert!(matches!(fault(MeshSpec::NotchedBeam(wide), 2), MeshError::NotLess { field: "width", .. }));
}
