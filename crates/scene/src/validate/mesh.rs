//! Meshes.

use super::check::Checker;
use super::shapes;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{ClothSpec, DiskSpec, FileSpec, GridSpec, InlineSpec, MeshSpec, StrandSpec};
use pliant::algebra::direction;
use pliant_mesh::spec::{SurfaceSpec, WholeCell};

/// Number of vertices that 32-bit indices can count.
const MOST_VERTICES: u64 = u32::MAX as u64;

pub(super) fn mesh(check: &mut Checker, path: &KeyPath, mesh: &MeshSpec) {
    let path = path.key(mesh.name());
    match mesh {
        MeshSpec::Grid(spec) => grid(check, &path, spec),
        MeshSpec::Cloth(spec) => cloth(check, &path, spec),
        MeshSpec::Strand(spec) => strand(check, &path, spec),
        MeshSpec::Disk(spec) => disk(check, &path, spec),
        MeshSpec::Inline(spec) => inline(check, &path, spec),
        MeshSpec::File(spec) => file(check, &path, spec),
        MeshSpec::Surface(spec) => surface(check, &path, spec),
        shape => shapes::shape(check, &path, shape),
    }
    // Shapes with unknown counts have been reported before.
    let counted = mesh.file().is_none() && shapes::is_countable(mesh);
    if counted && mesh.vertex_count().is_none_or(|count| count > MOST_VERTICES) {
        let message = format!("this {} has more than {MOST_VERTICES} vertices", mesh.name());
        check.report(Problem::semantic(path, message).at_key());
    }
}

fn file(check: &mut Checker, path: &KeyPath, file: &FileSpec) {
    if file.path.as_os_str().is_empty() {
        let problem = Problem::semantic(path.key("path"), "`path` is empty");
        check.report(problem.with_help("name a mesh file, relative to the scene"));
    }
    if let Some(merge) = file.merge {
        check.number(&path.key("merge"), merge, "m");
    }
}

fn surface(check: &mut Checker, path: &KeyPath, surface: &SurfaceSpec) {
    if check.dimension == Some(2) {
        let message = "a surface encloses a solid in 3D, and `dimension` is 2";
        check.report(Problem::semantic(path.clone(), message).at_key());
        return;
    }
    if surface.path.as_os_str().is_empty() {
        let problem = Problem::semantic(path.key("path"), "`path` is empty");
        check.report(
            problem.with_help("name a file with a closed surface of triangles, relative to the scene"),
        );
    }
    match (surface.cells, surface.spacing) {
        (Some(cells), None) => {
            check.count(&path.key("cells"), cells);
        }
        (None, Some(spacing)) => {
            check.number(&path.key("spacing"), spacing, "m");
        }
        (given, _) => {
            let how = if given.is_some() { "both are given" } else { "neither is given" };
            let message = format!("a surface takes exactly one of `cells` and `spacing` [m], {how}");
            let problem = Problem::semantic(path.clone(), message).at_key();
            check.report(problem.with_help(
                "`cells` counts those along the longest side of the surface; `spacing` is the edge of one",
            ));
        }
    }
    if let Some(merge) = surface.merge {
        check.number(&path.key("merge"), merge, "m");
    }
}

fn grid(check: &mut Checker, path: &KeyPath, grid: &GridSpec) {
    let cells = path.key("cells");
    check.components(&cells, grid.cells.len());
    if let Some(axis) = grid.cells.iter().position(|&count| count == 0) {
        check.count(&cells.index(axis), 0);
    }
    match (grid.spacing, &grid.size) {
        (Some(spacing), None) => {
            check.number(&path.key("spacing"), spacing, "m");
        }
        (None, Some(size)) => {
            let path = path.key("size");
            check.components(&path, size.len());
            check.numbers(&path, size, "m");
        }
        (given, _) => {
            let how = if given.is_some() { "both are given" } else { "neither is given" };
            let message = format!("a grid takes exactly one of `spacing` [m] and `size` [m], {how}");
            let problem = Problem::semantic(path.clone(), message).at_key();
            check.report(problem.with_help(
                "`spacing` is the edge of a cell, a number; `size` is that of the box, one number per \
                 dimension",
            ));
        }
    }
    if let Some(origin) = &grid.origin {
        check.vector(&path.key("origin"), origin, "m");
    }
    whole_cells(check, path, grid.element);
}

/// Rejects an element whose dimension differs from the scene's.
pub(super) fn whole_cells(check: &mut Checker, path: &KeyPath, element: Option<WholeCell>) {
    let kind = element.map(WholeCell::kind);
    let wrong = kind.filter(|kind| check.dimension.is_some_and(|d| d != kind.dimension));
    if let Some(kind) = wrong {
        let (other, d) = if kind.dimension == 2 { ("hexahedron", 3) } else { ("quadrilateral", 2) };
        let message =
            format!("`element = \"{}\"` is for {}D, and `dimension` is {d}", kind.name, kind.dimension);
        let problem = Problem::semantic(path.key("element"), message);
        check
            .report(problem.with_help(format!("use `element = \"{other}\"`, or leave it out for simplices")));
    }
}

fn cloth(check: &mut Checker, path: &KeyPath, cloth: &ClothSpec) {
    for (index, &count) in cloth.cells.iter().enumerate() {
        check.count(&path.key("cells").index(index), count);
    }
    check.vector(&path.key("origin"), &cloth.origin, "m");
    let u = check.direction(&path.key("u"), &cloth.u, "m");
    let v = check.direction(&path.key("v"), &cloth.v, "m");
    if !u || !v || check.dimension.is_none() {
        return;
    }
    let parallel = |sine: f64| sine.abs() <= 1e-12;
    let sine = sine_of_angle(&cloth.u, &cloth.v);
    if parallel(sine) {
        let problem = Problem::semantic(path.key("v"), "`u` and `v` are parallel: they span no sheet");
        check.report(problem);
    } else if check.dimension == Some(2) && sine < 0.0 {
        let message = "in 2D `v` must be counter-clockwise from `u`, else every triangle is inverted";
        check.report(Problem::semantic(path.key("v"), message).with_help("exchange `u` and `v`"));
    }
}

/// Sine of the angle from `u` to `v`: signed in 2D, non-negative in 3D.
fn sine_of_angle(u: &[f64], v: &[f64]) -> f64 {
    // Unit vectors, because squares of very long or short sides overflow or underflow.
    let [a, b] = [u, v].map(|side| direction(side).unwrap_or([f64::NAN; 3]));
    let cross = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
    match u.len() {
        2 => cross(0, 1),
        _ => (cross(1, 2).powi(2) + cross(2, 0).powi(2) + cross(0, 1).powi(2)).sqrt(),
    }
}

fn strand(check: &mut Checker, path: &KeyPath, strand: &StrandSpec) {
    check.count(&path.key("segments"), strand.segments);
    let start = check.vector(&path.key("start"), &strand.start, "m");
    let end = check.vector(&path.key("end"), &strand.end, "m");
    if start && end && strand.start == strand.end {
        let message = "`start` and `end` are the same point: the strand has no length";
        check.report(Problem::semantic(path.key("end"), message));
    }
}

fn disk(check: &mut Checker, path: &KeyPath, disk: &DiskSpec) {
    check.count(&path.key("count"), disk.count);
    let radius = check.number(&path.key("radius"), disk.radius, "m");
    let inner = check.number(&path.key("inner_radius"), disk.inner_radius, "m");
    if radius && inner && disk.inner_radius >= disk.radius {
        let message = format!(
            "`inner_radius` must be less than `radius`, got {:?} and {:?} [m]",
            disk.inner_radius, disk.radius
        );
        check.report(Problem::semantic(path.key("inner_radius"), message));
    }
    if let Some(centre) = &disk.centre {
        check.vector(&path.key("centre"), centre, "m");
    }
    let thickness = path.key("thickness");
    if check.number(&thickness, disk.thickness, "m") && disk.thickness > 0.0 && check.dimension == Some(2) {
        let problem = Problem::semantic(thickness, "`thickness` is for 3D only, and `dimension` is 2");
        check.report(problem);
    }
}

fn inline(check: &mut Checker, path: &KeyPath, inline: &InlineSpec) {
    let points = path.key("points");
    if inline.points.is_empty() {
        check.report(Problem::semantic(points.clone(), "`points` is empty: the body needs a vertex"));
    }
    check.vectors(&points, &inline.points, "m");
    let count = inline.points.len();
    cells(check, &path.key("edges"), &inline.edges, count);
    cells(check, &path.key("triangles"), &inline.triangles, count);
    cells(check, &path.key("tetrahedra"), &inline.tetrahedra, count);
    cells(check, &path.key("quadrilaterals"), &inline.quadrilaterals, count);
    cells(check, &path.key("hexahedra"), &inline.hexahedra, count);
    if check.dimension == Some(2) && !inline.hexahedra.is_empty() {
        let message = "`hexahedra` are for 3D only, and `dimension` is 2";
        check.report(Problem::semantic(path.key("hexahedra"), message).at_key());
    }
    if check.dimension == Some(2) && !inline.tetrahedra.is_empty() {
        let message = "`tetrahedra` are for 3D only, and `dimension` is 2";
        check.report(Problem::semantic(path.key("tetrahedra"), message).at_key());
    }
}

/// Checks that vertices exist and differ within each cell; reports the first invalid cell.
fn cells<const N: usize>(check: &mut Checker, path: &KeyPath, cells: &[[u32; N]], count: usize) {
    for (index, cell) in cells.iter().enumerate() {
        for (corner, &vertex) in cell.iter().enumerate() {
            let place = path.index(index).index(corner);
            if vertex as usize >= count {
                check.report(no_such_vertex(place, vertex, count as u64));
                return;
            }
            if cell[..corner].contains(&vertex) {
                check.report(Problem::semantic(place, format!("vertex {vertex} occurs twice in this cell")));
                return;
            }
        }
    }
}

pub(super) fn no_such_vertex(path: KeyPath, vertex: u32, count: u64) -> Problem {
    let problem = Problem::semantic(path, format!("there is no vertex {vertex}: the body has {count}"));
    match count {
        0 => problem,
        _ => problem.with_help(format!("vertices are counted from 0 to {}", count - 1)),
    }
}
