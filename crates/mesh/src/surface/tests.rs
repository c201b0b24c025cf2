//! Solids from spheres, tori, cubes, a rabbit: their volumes, angles, boundaries and skins.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use super::SurfaceError;
use crate::spec::{
    BodyMesh, CellOrder, MeshSpec, RepeatSpec, RotateSpec, SolidElement, SurfaceSpec, TransformSpec,
};
use crate::{Mesh, MeshError, SurfaceReport, build, build_body, predicted_size};
use pliant::value::OneOrMany;

/// Vertices and triangles of a surface.
type Shape = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Sizes of the smooth shapes [m].
const RADIUS: f64 = 1.0;
const RING: [f64; 2] = [1.0, 0.4];

/// A sphere of `2 n^2` quadrilaterals by longitude and latitude.
fn sphere(n: usize) -> Shape {
    let at = |i: usize, j: usize| {
        let (theta, phi) = (PI * j as f64 / n as f64, TAU * i as f64 / (2 * n) as f64);
        [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()].map(|x| RADIUS * x)
    };
    let mut points = vec![[0.0, 0.0, RADIUS], [0.0, 0.0, -RADIUS]];
    for j in 1..n {
        points.extend((0..2 * n).map(|i| at(i, j)));
    }
    let vertex = |i: usize, j: usize| match j {
        0 => 0,
        j if j == n => 1,
        j => (2 + (j - 1) * 2 * n + i % (2 * n)) as u32,
    };
    let mut triangles = vec![];
    for j in 0..n {
        for i in 0..2 * n {
            let [a, b, c, d] = [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)];
            triangles.extend(
                [[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]),
            );
        }
    }
    (points, triangles)
}

/// A torus of `2 n` by `n` quadrilaterals with an oblique axis.
fn torus(n: usize) -> Shape {
    let at = |i: usize, j: usize| {
        let (u, v) = (TAU * i as f64 / (2 * n) as f64, TAU * j as f64 / n as f64);
        let r = RING[0] + RING[1] * v.cos();
        let [x, y, z] = [r * u.cos(), r * u.sin(), RING[1] * v.sin()];
        [0.8 * x + 0.6 * z, y, 0.8 * z - 0.6 * x]
    };
    let points = (0..2 * n).flat_map(|i| (0..n).map(move |j| at(i, j))).collect();
    let vertex = |i: usize, j: usize| (i % (2 * n) * n + j % n) as u32;
    let mut triangles = vec![];
    for i in 0..2 * n {
        for j in 0..n {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (points, triangles)
}

/// An axis-aligned box.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> Shape {
    let points = (0..8).map(|i| [0, 1, 2].map(|c| if i >> c & 1 == 0 { low[c] } else { high[c] })).collect();
    let sides: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    (points, sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect())
}

fn turned((points, triangles): Shape) -> Shape {
    let turn = |[x, y, z]: [f64; 3]| {
        let [x, y] = [0.6 * x - 0.8 * y, 0.8 * x + 0.6 * y];
        [0.28 * x + 0.96 * z, y, 0.28 * z - 0.96 * x]
    };
    (points.into_iter().map(turn).collect(), triangles)
}

fn both(shapes: [Shape; 2]) -> Shape {
    let [(mut points, mut triangles), (more, others)] = shapes;
    let first = points.len() as u32;
    points.extend(more);
    triangles.extend(others.iter().map(|t| t.map(|v| first + v)));
    (points, triangles)
}

fn inwards((points, triangles): Shape) -> Shape {
    (points, triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect())
}

/// Writes the shape as OBJ.
fn text((points, triangles): &Shape) -> String {
    let points = points.iter().map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n"));
    let faces = triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    points.chain(faces).collect()
}

/// Mesh of an OBJ text with the given keys.
fn made(text: &str, spec: &SurfaceSpec) -> Result<Mesh, MeshError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), text).unwrap();
    let spec = MeshSpec::Surface(SurfaceSpec { path: "a.obj".into(), ..spec.clone() });
    let size = predicted_size(&spec, 3, folder.path())?;
    let mesh = build(&spec, 3, folder.path())?;
    let blocks: usize = mesh.blocks.iter().map(|block| block.len()).sum();
    assert!(size.vertices >= mesh.vertex_count() as u64, "{size:?} {}", mesh.vertex_count());
    assert!(size.tetrahedra >= mesh.tetrahedra.len() as u64, "{size:?} {}", mesh.tetrahedra.len());
    assert!(size.triangles + size.blocks >= (mesh.triangles.len() + blocks) as u64, "{size:?}");
    Ok(mesh)
}

fn of_cells(cells: usize) -> SurfaceSpec {
    SurfaceSpec { cells: Some(cells), ..SurfaceSpec::default() }
}

fn solid(shape: &Shape, cells: usize) -> Mesh {
    made(&text(shape), &of_cells(cells)).unwrap_or_else(|error| panic!("{error}"))
}

fn report(mesh: &Mesh) -> SurfaceReport {
    mesh.surface_report().unwrap()
}

/// Angles are within the published bounds on every shape, smooth and sharp.
#[test]
fn dihedral_angles_are_within_the_published_bounds() {
    let shapes = [sphere(24), torus(24), turned(cuboid([0.0; 3], [1.0, 0.7, 0.45]))];
    for shape in &shapes {
        for cells in [7, 11, 16] {
            let [least, most] = report(&solid(shape, cells)).dihedral.unwrap();
            assert!(least > 10.7 && most < 164.8, "{cells}: {least} {most}");
        }
    }
}

/// With three times as many cells errors are 9 times smaller: the volume is of order 2, and nearly so the
/// distance of the skin, a maximum.
#[test]
fn volume_and_distance_are_of_order_two() {
    for (shape, exact) in [
        (sphere(40), 4.0 / 3.0 * PI * RADIUS.powi(3)),
        (torus(40), 2.0 * PI * PI * RING[0] * RING[1].powi(2)),
    ] {
        let errors = [6, 18].map(|cells| {
            let report = report(&solid(&shape, cells));
            assert!((report.volume / exact - 1.0).abs() < 1e-2, "{}", report.volume);
            [1.0 - report.solid_volume / report.volume, report.distance]
        });
        let orders = [0, 1].map(|i| (errors[0][i] / errors[1][i]).ln() / 3.0_f64.ln());
        assert!((orders[0] - 2.0).abs() < 0.3 && orders[1] > 1.5, "{errors:?} {orders:?}");
    }
}

/// A box of whole cells is filled exactly.
#[test]
fn boxes_along_the_lattice_are_filled_exactly() {
    for element in [SolidElement::Tetrahedron, SolidElement::Hexahedron] {
        let spec = SurfaceSpec { element: Some(element), ..of_cells(4) };
        let mesh = made(&text(&cuboid([0.1; 3], [1.1, 0.6, 0.85])), &spec).unwrap();
        let report = report(&mesh);
        assert!((report.solid_volume - 0.375).abs() < 1e-12, "{report:?}");
        assert!((report.volume - 0.375).abs() < 1e-12 && report.distance < 1e-12, "{report:?}");
        assert_eq!(report.fitted, element == SolidElement::Tetrahedron);
        let faces = mesh.surface_triangles();
        assert!(mesh.boundary_edges().is_empty() && !faces.is_empty());
    }
}

/// The boundary of the solid is closed, points outwards, and has its corners on the surface.
#[test]
fn the_boundary_is_closed_and_lies_on_the_surface() {
    let shape = torus(20);
    let mesh = solid(&shape, 12);
    assert!(mesh.boundary_edges().is_empty());
    let surface = super::ClosedSurface::new(&Mesh {
        dimension: 3,
        points: shape.0.concat(),
        triangles: shape.1,
        ..Mesh::default()
    });
    let surface = surface.unwrap();
    for vertex in &mesh.groups["surface"].vertices {
        let (_, square) = surface.nearest(&mesh.nodes::<3, 1>(&[*vertex])[0]).unwrap();
        assert!(square.sqrt() < 1e-14, "{vertex}: {}", square.sqrt());
    }
    let boundary = Mesh {
        triangles: mesh.surface_triangles(),
        ..Mesh { dimension: 3, points: mesh.points.clone(), ..Mesh::default() }
    };
    let enclosed = super::ClosedSurface::new(&boundary).unwrap().volume();
    assert!((enclosed / report(&mesh).solid_volume - 1.0).abs() < 1e-13);
}

/// The bits do not depend on the order of triangles and corners nor on the number of threads.
#[test]
fn solids_do_not_depend_on_the_order_of_triangles_or_on_threads() {
    let (points, mut triangles) = torus(14);
    let first = solid(&(points.clone(), triangles.clone()), 9);
    triangles.reverse();
    triangles.iter_mut().for_each(|triangle| triangle.rotate_left(1));
    let shape = (points, triangles);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let second = one.install(|| solid(&shape, 9));
    assert!(first.points == second.points && first.tetrahedra == second.tetrahedra);
    assert_eq!(first.groups, second.groups);
}

/// A homogeneous deformation of the nodes deforms the skin likewise, for both orders and for hexahedra.
#[test]
fn skins_follow_affine_motions() {
    let shape = turned(cuboid([0.0; 3], [1.0, 0.7, 0.45]));
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), text(&shape)).unwrap();
    for (element, quadratic) in [
        (SolidElement::Tetrahedron, false),
        (SolidElement::Tetrahedron, true),
        (SolidElement::Hexahedron, false),
        (SolidElement::Hexahedron, true),
    ] {
        let spec = SurfaceSpec { path: "a.obj".into(), element: Some(element), ..of_cells(9) };
        let spec = MeshSpec::Surface(spec);
        let transform = TransformSpec {
            scale: Some(OneOrMany::Many(vec![2.0, -1.0, 0.5])),
            rotate: Some(RotateSpec { axis: Some(vec![1.0, 2.0, 3.0]), angle: 0.7 }),
            ..TransformSpec::default()
        };
        let repeat = RepeatSpec { count: vec![2, 1, 1], spacing: vec![5.0, 0.0, 0.0] };
        let order = if quadratic { CellOrder::Quadratic } else { CellOrder::Linear };
        let body =
            BodyMesh { shape: &spec, order, refine: 0, transform: Some(&transform), repeat: Some(&repeat) };
        let mesh = build_body(&body, 3, folder.path()).unwrap();
        let skin = mesh.skin.as_ref().unwrap();
        assert_eq!(skin.vertex_count(), 2 * shape.0.len());
        let count = mesh.element_count() as u32;
        assert!(skin.elements.iter().all(|e| *e < count) && skin.elements.iter().any(|e| 2 * e >= count));
        let alone = BodyMesh { transform: None, repeat: None, ..body };
        let at_rest = build_body(&alone, 3, folder.path()).unwrap().skin_points();
        let far = at_rest.iter().zip(&shape.0).flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| (a - b).abs());
        assert!(far.fold(0.0, f64::max) < 1e-13);
        let move_point = |x: &[f64; 3]| [x[0] + 0.3 * x[1] - 2.0, 0.1 * x[0] - 0.9 * x[2], x[1] + 1.7 * x[2]];
        let moved: Vec<f64> = mesh.points.as_chunks::<3>().0.iter().flat_map(move_point).collect();
        for (vertex, rest) in mesh.skin_points().iter().enumerate() {
            let (found, expected) = (skin.interpolated::<3>(vertex, &moved), move_point(rest));
            assert!((0..3).all(|c| (found[c] - expected[c]).abs() < 1e-13), "{found:?} {expected:?}");
        }
        // Mirrored, the skin still encloses a positive volume: twice that of the shape, scaled.
        assert!((report(&mesh).volume / (2.0 * 0.315) - 1.0).abs() < 1e-12);
    }
}

fn refused(shape: &Shape, spec: &SurfaceSpec) -> (SurfaceError, Option<u32>) {
    match made(&text(shape), spec).unwrap_err() {
        MeshError::InFile { line, source, .. } => match *source {
            MeshError::Surface(error) => (error, line),
            other => panic!("{other}"),
        },
        other => panic!("{other}"),
    }
}

#[test]
fn surfaces_that_enclose_nothing_are_refused_with_the_place() {
    let cube = cuboid([0.0; 3], [1.0; 3]);
    let mut open = cube.clone();
    open.1.remove(5);
    let (error, line) = refused(&open, &of_cells(4));
    assert!(matches!(error, SurfaceError::Open { count: 3, .. }), "{error}");
    // The file lists eight vertices before the triangles.
    assert_eq!(line, error.triangle().map(|i| i as u32 + 9));
    let mut turned = cube.clone();
    turned.1[3].swap(0, 1);
    let (error, _) = refused(&turned, &of_cells(4));
    assert!(matches!(error, SurfaceError::OppositeSides { .. }), "{error}");
    assert!(made(&text(&turned), &SurfaceSpec { orient: true, ..of_cells(4) }).is_ok());
    let (error, _) = refused(&inwards(cube.clone()), &of_cells(4));
    assert_eq!(error, SurfaceError::InsideOut { volume: -1.0 });
    // A fin on an edge, one of its triangles turned: three of the edge's four triangles have one direction.
    let mut fin = cube;
    fin.0.extend([[0.5, -1.0, 0.2], [0.5, -1.0, -0.5]]);
    fin.1.extend([[1, 0, 8], [1, 0, 9], [0, 8, 9], [1, 9, 8]]);
    let (error, _) = refused(&fin, &of_cells(4));
    assert!(matches!(error, SurfaceError::OddEdge { count: 4, .. }), "{error}");
    let edges = made("v 0 0 0\nv 1 0 0\nl 1 2\n", &of_cells(4)).unwrap_err();
    assert!(edges.to_string().contains("no triangles but 1 edges"), "{edges}");
}

#[test]
fn crossing_parts_are_refused_or_united() {
    let overlapping = both([cuboid([0.0; 3], [1.0; 3]), cuboid([0.3, 0.2, 0.4], [1.3, 0.7, 0.8])]);
    let (error, _) = refused(&overlapping, &of_cells(13));
    assert!(matches!(error, SurfaceError::Crossing { count: 2.., .. }), "{error}");
    let united = made(&text(&overlapping), &SurfaceSpec { union: true, ..of_cells(13) }).unwrap();
    // 1 + 0.3 * 0.5 * 0.4, chamfered edges aside.
    let volume = report(&united).solid_volume;
    assert!((volume - 1.06).abs() < 0.01, "{volume}");
    // A part within another has winding number two inside; a part that faces inwards bounds a cavity.
    let nested = both([cuboid([0.0; 3], [1.0; 3]), cuboid([0.25; 3], [0.75; 3])]);
    let (error, _) = refused(&nested, &of_cells(8));
    assert!(matches!(error, SurfaceError::Winding { winding: 2, .. }), "{error}");
    let hollow = both([cuboid([0.0; 3], [1.0; 3]), inwards(cuboid([0.25; 3], [0.75; 3]))]);
    assert!((report(&solid(&hollow, 8)).solid_volume - 0.875).abs() < 1e-12);
}

#[test]
fn parts_thinner_than_cells_are_refused_with_a_number_of_cells_that_does() {
    let flag = turned(both([cuboid([0.0; 3], [1.0; 3]), cuboid([3.0, 0.0, 0.0], [4.0, 1.0, 0.1])]));
    let (error, line) = refused(&flag, &of_cells(8));
    let SurfaceError::Thin { cells, thickness, triangle, .. } = error else { panic!("{error}") };
    assert!((thickness.unwrap() - 0.1).abs() < 1e-12 && triangle >= 12 && line.is_some());
    assert_eq!(solid(&flag, cells).contents().pieces, 2);
    // One surface of two cubes and a thin bridge: the bridge is lost, the cubes are not.
    let near = both([cuboid([0.0; 3], [1.0; 3]), cuboid([1.01, 0.0, 0.0], [2.01, 1.0, 1.0])]);
    let (error, _) = refused(&near, &of_cells(8));
    assert!(matches!(error, SurfaceError::Pieces { expected: 2, found: 1, .. }), "{error}");
}

#[test]
fn keys_that_do_not_fit_are_refused() {
    let cube = text(&cuboid([0.0; 3], [1.0; 3]));
    let fault = |spec: SurfaceSpec| made(&cube, &spec).unwrap_err();
    let none = SurfaceSpec::default;
    let both = SurfaceSpec { spacing: Some(0.1), ..of_cells(3) };
    for (spec, expected) in [(none(), false), (both, true)] {
        let error = fault(spec);
        assert!(
            matches!(error, MeshError::Surface(SurfaceError::CellsOrSpacing { both }) if both == expected),
            "{error}"
        );
    }
    let spacing = |spacing| SurfaceSpec { spacing: Some(spacing), ..none() };
    assert!(matches!(fault(spacing(0.0)), MeshError::NotPositive { field: "spacing", .. }));
    assert!(matches!(fault(spacing(1.5)), MeshError::Surface(SurfaceError::LargeSpacing { .. })));
    assert!(matches!(fault(of_cells(0)), MeshError::ZeroCount { field: "cells" }));
    assert!(matches!(fault(of_cells(5000)), MeshError::TooMany { .. }));
    let fine = fault(spacing(1e-6));
    assert!(
        matches!(&fine, MeshError::Surface(SurfaceError::SmallSpacing { side: 1.0, .. }))
            && fine.to_string().contains("millimetres"),
        "{fine}"
    );
    let folder = tempfile::tempdir().unwrap();
    let plane = MeshSpec::Surface(SurfaceSpec { path: "a.obj".into(), ..of_cells(2) });
    assert!(matches!(build(&plane, 2, folder.path()), Err(MeshError::ShapeDimension { dimension: 3, .. })));
}

/// Groups of the file become groups of the nearest boundary faces.
#[test]
fn groups_of_the_surface_are_groups_of_the_solid() {
    let (points, triangles) = cuboid([0.0; 3], [1.0; 3]);
    let faces = |triangles: &[[u32; 3]]| {
        triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)).collect::<String>()
    };
    let text = text(&(points, vec![]))
        + "g left\n"
        + &faces(&triangles[..2])
        + "g others\n"
        + &faces(&triangles[2..]);
    for element in [SolidElement::Tetrahedron, SolidElement::Hexahedron] {
        let mesh = made(&text, &SurfaceSpec { element: Some(element), ..of_cells(4) }).unwrap();
        let left = &mesh.groups["left"];
        assert!(left.vertices.iter().all(|v| mesh.point(*v as usize)[0].abs() < 1e-12));
        let in_plane = (0..mesh.vertex_count()).filter(|v| mesh.point(*v)[0].abs() < 1e-12).count();
        assert_eq!(left.vertices.len(), in_plane);
        let all = mesh.groups["surface"].cells.len();
        assert_eq!(left.cells.len() + mesh.groups["others"].cells.len(), all);
    }
}

/// The boundary of a solid file is filled anew: the scan of a rabbit, whose ears need fine cells.
#[test]
fn thin_ears_of_a_solid_file_are_refused() {
    let spec = SurfaceSpec { path: "bunny.msh".into(), ..of_cells(14) };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/meshes");
    let error = build(&MeshSpec::Surface(spec), 3, &folder).unwrap_err();
    assert!(error.to_string().contains("is thinner than the cells where triangle"), "{error}");
}
