//! Errors in meshes. Every message names the position, the value found, and the value expected.

use pliant::quantity::{Rounded, counted};
use std::path::PathBuf;

use super::{Cell, FileTag, FormatError, SurfaceError};

/// Error of a mesh that cannot be built, read or selected from. Indices count from 0.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The scene is neither two- nor three-dimensional.
    #[error("dimension is {dimension}; meshes are two- or three-dimensional")]
    Dimension {
        /// The requested dimension.
        dimension: usize,
    },
    /// A vector of the specification has the wrong length.
    #[error(
        "`{field}` has {found} components where the scene has {expected} dimensions; give {expected} numbers"
    )]
    Components {
        /// Name of the field, as in the scene.
        field: &'static str,
        /// Required number of components.
        expected: usize,
        /// Number of components found.
        found: usize,
    },
    /// A point written in the scene has the wrong number of coordinates.
    #[error("point {vertex} has {found} coordinates where the scene has {expected} dimensions")]
    PointComponents {
        /// Index of the point.
        vertex: usize,
        /// Required number of coordinates.
        expected: usize,
        /// Number of coordinates found.
        found: usize,
    },
    /// A number of the specification is NaN or infinite.
    #[error("`{field}` is {value}; it must be a finite number")]
    NotFinite {
        /// Name of the field.
        field: &'static str,
        /// The number.
        value: f64,
    },
    /// A length of the specification must be positive.
    #[error("`{field}` is {value}; it must be greater than 0")]
    NotPositive {
        /// Name of the field.
        field: &'static str,
        /// The number.
        value: f64,
    },
    /// A length of the specification must not be negative.
    #[error("`{field}` is {value}; it must not be negative")]
    Negative {
        /// Name of the field.
        field: &'static str,
        /// The number.
        value: f64,
    },
    /// A count of the specification must be at least one.
    #[error("`{field}` is 0; it must be at least 1")]
    ZeroCount {
        /// Name of the field.
        field: &'static str,
    },
    /// A grid needs exactly one of `spacing` and `size`.
    #[error("a grid takes exactly one of `spacing` and `size`; {} given", if *both { "both \
         are" } else { "none is" })]
    SpacingOrSize {
        /// True if both were given, false if none.
        both: bool,
    },
    /// The sides of a cloth span no area.
    #[error("the sides `u` and `v` of the cloth are parallel or of zero length; they must span an area")]
    ParallelSides,
    /// The sides of a two-dimensional cloth are clockwise.
    #[error("in 2D the side `v` of the cloth must lie counter-clockwise of `u`; exchange `u` and `v`")]
    ClockwiseSides,
    /// A strand whose ends coincide.
    #[error("`start` and `end` of the strand are the same point; they must differ")]
    ZeroLengthStrand,
    /// The hole of a disk is as large as the disk.
    #[error("`inner_radius` is {inner_radius}; it must be less than `radius` = {radius}")]
    InnerRadius {
        /// Inner radius [m].
        inner_radius: f64,
        /// Outer radius [m].
        radius: f64,
    },
    /// A thickness in a two-dimensional scene.
    #[error("`thickness` is {thickness}, which only a 3D scene can have; remove it or set `dimension = 3`")]
    ThicknessInPlane {
        /// Thickness [m].
        thickness: f64,
    },
    /// A mesh with more vertices or cells than 32-bit indices can number.
    #[error("the mesh would have {count} {what}; at most {} fit 32-bit indices", u32::MAX)]
    TooMany {
        /// `vertices`, `edges`, `triangles` or `tetrahedra`.
        what: &'static str,
        /// Number of them, saturated.
        count: u64,
    },
    /// The memory could not be allocated.
    #[error("the mesh would take {bytes} bytes, which this machine does not have; use fewer cells")]
    OutOfMemory {
        /// Number of bytes requested.
        bytes: u64,
    },

    /// A mesh without vertices.
    #[error("the mesh has no vertices")]
    Empty,
    /// A shape whose dimension differs from the scene's.
    #[error("a {shape} is {dimension}-dimensional; set `dimension = {dimension}`")]
    ShapeDimension {
        /// Name of the shape in the scene.
        shape: &'static str,
        /// Dimension of the shape.
        dimension: usize,
    },
    /// A length that must be less than another.
    #[error("`{field}` is {value}; it must be less than `{other}` = {bound}")]
    NotLess {
        /// Name of the field.
        field: &'static str,
        /// Value of the field [m].
        value: f64,
        /// Name of the field that bounds it.
        other: &'static str,
        /// Value of that field [m].
        bound: f64,
    },
    /// Too few cells for the shape.
    #[error("`{field}` is {count}; this shape needs at least {least}")]
    TooFew {
        /// Name of the field.
        field: &'static str,
        /// The number given.
        count: usize,
        /// The least possible.
        least: usize,
    },
    /// A factor of zero flattens the mesh.
    #[error("`{field}` is 0; it must be another number")]
    Zero {
        /// Name of the field.
        field: &'static str,
    },
    /// Tetrahedra in a two-dimensional scene.
    #[error("the mesh has {count} tetrahedra, but the scene is two-dimensional; set `dimension = 3`")]
    TetrahedraInPlane {
        /// Number of tetrahedra.
        count: usize,
    },
    /// Solid cells in a two-dimensional scene.
    #[error("the mesh has {count} {cells}, but the scene is two-dimensional; set `dimension = 3`")]
    SolidsInPlane {
        /// Number of cells.
        count: usize,
        /// Kind of the cells.
        cells: &'static str,
    },
    /// An element kind whose dimension differs from the scene's.
    #[error(
        "`element` is \"{found}\" where the scene has {dimension} dimensions; use \"{other}\", or leave \
         it out"
    )]
    WrongElement {
        /// The requested element kind.
        found: &'static str,
        /// Dimension of the scene.
        dimension: usize,
        /// The element kind of the scene's dimension.
        other: &'static str,
    },
    /// Cells of two kinds with the same dimension.
    #[error(
        "the mesh has {} and {}: cells of one dimension must be of one kind; split one kind into the other, \
         or make a body of each", cells[0], cells[1]
    )]
    MixedCells {
        /// Kinds of cells.
        cells: [&'static str; 2],
    },
    /// A surface in space with cells other than triangles.
    #[error(
        "the mesh is a surface of {count} {cells} in space: surfaces are made of triangles; split each in two"
    )]
    SheetOfCells {
        /// Number of cells.
        count: usize,
        /// Kind of the cells.
        cells: &'static str,
    },
    /// A cell with `det J <= 0` at a quadrature point.
    #[error(
        "{cell} is folded: det J is {least:.3} of its mean where it is integrated, and must be positive \
         there; move its vertices until all its angles are below 180 degrees"
    )]
    FoldedCell {
        /// The element.
        cell: Cell,
        /// Smallest `det J` in the element, as a fraction of its mean.
        least: f64,
    },
    /// `serendipity` for simplices.
    #[error("`serendipity` is for quadrilaterals and hexahedra, and the mesh has none; remove it")]
    NoSerendipity,
    /// Cells that cannot be cut.
    #[error("`refine` cuts cells of first order: {why}")]
    Refine {
        /// The reason.
        why: &'static str,
    },
    /// `serendipity` for cells that already have face or cell nodes.
    #[error("the mesh has {cells} with nodes in the middle of faces or cells; remove `serendipity`")]
    LagrangeCells {
        /// Kind of the cells.
        cells: &'static str,
    },
    /// A vertex off the plane of a two-dimensional scene.
    #[error("vertex {vertex} has z = {z}; in a two-dimensional scene every z must be 0")]
    OffPlane {
        /// Vertex index.
        vertex: usize,
        /// Coordinate z of the vertex [m].
        z: f64,
    },
    /// NaN or infinity as a coordinate.
    #[error("coordinate {axis} of vertex {vertex} is {value}; it must be a finite number")]
    NonFiniteCoordinate {
        /// Vertex index.
        vertex: usize,
        /// 0 is x, 1 is y, 2 is z.
        axis: usize,
        /// The coordinate.
        value: f64,
    },
    /// A cell with a vertex index out of range.
    #[error("{cell} uses vertex {vertex}, but the mesh has {}, numbered from 0",
        counted(*.count as u64, "vertex", "vertices"))]
    IndexOutOfRange {
        /// The cell.
        cell: Cell,
        /// The vertex index.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A cell that uses a vertex twice.
    #[error("{cell} uses vertex {vertex} more than once; its vertices must all differ")]
    RepeatedVertex {
        /// The cell.
        cell: Cell,
        /// The vertex.
        vertex: u32,
    },
    /// A repeated element: its stiffness and mass would count twice.
    #[error(
        "{cell} has the same vertices as {} {first}{}; every element counts once: remove the repeated",
        cell.noun(),
        if *count > 1 {
            let others = counted(*count as u64 - 1, "more element repeats", "more elements repeat");
            format!(", and {others} others")
        } else {
            String::new()
        }
    )]
    RepeatedCell {
        /// The repetition.
        cell: Cell,
        /// Index of the first occurrence.
        first: usize,
        /// Number of elements that repeat another.
        count: usize,
    },
    /// An element without area or volume: `|det Dm| <= 1e-12 h^d`.
    #[error(
        "{cell} is degenerate: its {} is {volume} {} at a longest edge of {size} m; move its vertices apart \
         or remove it",
        cell.measure().0, cell.measure().1, volume = Rounded::<4>(*.volume), size = Rounded::<4>(*.size)
    )]
    Degenerate {
        /// The element.
        cell: Cell,
        /// Signed volume or area [m^3 or m^2].
        volume: f64,
        /// Longest edge `h` [m].
        size: f64,
    },
    /// An element with its vertices in the wrong order.
    #[error(
        "{cell} is inverted: its {} is {volume} {} at a longest edge of {size} m; swap two of its vertices",
        cell.measure().0, cell.measure().1, volume = Rounded::<4>(*.volume), size = Rounded::<4>(*.size)
    )]
    Inverted {
        /// The element.
        cell: Cell,
        /// Signed volume or area [m^3 or m^2].
        volume: f64,
        /// Longest edge `h` [m].
        size: f64,
    },
    /// A second-order element folded by its curved sides.
    #[error(
        "{cell} is folded by its curved sides: its Jacobian determinant falls to {least:.4} of its mean, \
         and must be positive everywhere; move the nodes in the middle of its edges (in Gmsh: \
         `Mesh.HighOrderOptimize = 2;`), or use its corners only (`drop_mid_nodes = true` next to `path`)"
    )]
    Folded {
        /// The element.
        cell: Cell,
        /// Lower bound of `det J` in the element, as a fraction of its mean.
        least: f64,
    },
    /// A one-sided surface.
    #[error(
        "the surface has one side only (a Moebius band), which shows at the edge from vertex {} to {}: no \
         order of vertices puts the same side of all triangles up; cut it there, or do without `orient`",
        edge[0], edge[1]
    )]
    NotOrientable {
        /// An edge whose two triangles cannot be oriented consistently.
        edge: [u32; 2],
    },
    /// A mesh without elements after cleaning.
    #[error(
        "all {count} elements are degenerate: `drop_degenerate` would leave none; is the tolerance of \
         `merge` too large?"
    )]
    NothingLeft {
        /// Number of elements before cleaning.
        count: usize,
    },
    /// An edge between two vertices at the same place.
    #[error("edge {edge} joins vertices {} and {}, which are at the same position; a spring needs a length",
            vertices[0], vertices[1])]
    ZeroLengthEdge {
        /// Index into `edges`.
        edge: usize,
        /// Vertices of the edge.
        vertices: [u32; 2],
    },
    /// Unused vertices, which would have no mass.
    #[error(
        "{} to no element and no edge, the first is vertex {vertex}; remove what does not \
         belong there (Gmsh: give the bodies physical groups, so that only their vertices are saved)",
        counted(*.count as u64, "vertex belongs", "vertices belong")
    )]
    Unreferenced {
        /// Index of the first unused vertex.
        vertex: usize,
        /// Number of unused vertices.
        count: usize,
    },

    /// A selection by an unknown group name.
    #[error("there is no group `{name}`{}; {}", suggestion.as_ref().map(|s| format!(" (did you mean \
         `{s}`?)")).unwrap_or_default(),
            if known.is_empty() { "the mesh has no groups".to_string() } else { format!("the mesh has \
                 `{}`", known.join("`, `")) })]
    UnknownGroup {
        /// The unknown name.
        name: String,
        /// Known names.
        known: Vec<String>,
        /// The most similar known name, if one is similar.
        suggestion: Option<String>,
    },
    /// A selection by a vertex index out of range.
    #[error("the selection names vertex {vertex}, but the body has {}, numbered from 0",
        counted(*.count as u64, "vertex", "vertices"))]
    SelectedVertex {
        /// The vertex index.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A selection box whose lower bound is above its upper bound.
    #[error("`min` of the box is {min} on axis {axis}, above `max` = {max}; exchange them")]
    BoxReversed {
        /// 0 is x, 1 is y, 2 is z.
        axis: usize,
        /// Lower bound [m].
        min: f64,
        /// Upper bound [m].
        max: f64,
    },
    /// A half-space with a normal of zero length.
    #[error("`normal` is zero; it must point somewhere")]
    ZeroNormal,
    /// An empty selection.
    #[error("{selection} selects no vertex; the body spans {lower:?} to {upper:?}")]
    NothingSelected {
        /// The selection, in words.
        selection: String,
        /// Lower corner of the body [m].
        lower: Vec<f64>,
        /// Upper corner of the body [m].
        upper: Vec<f64>,
    },

    /// A surface load without a face to act on.
    #[error("{}", if *whole { "the mesh has no faces for it to act on" } else { "no face of the surface has \
         all its vertices in the selection" })]
    NoFace {
        /// True if the load is on the whole surface.
        whole: bool,
    },

    /// A surface that cannot be filled with a solid.
    #[error(transparent)]
    Surface(#[from] SurfaceError),

    /// The file could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A file of unknown format.
    #[error("{}: unknown mesh format; supported are {supported}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Supported formats with their extensions.
        supported: String,
    },
    /// An error in the content of a file.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// An error with its position in a file.
    #[error("{}{}: {}{source}{}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default(),
            tag.map(|t| format!("{t} of the file: ")).unwrap_or_default(),
            cures.iter().map(|cure| format!("; or {cure}")).collect::<String>())]
    InFile {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: Option<u32>,
        /// Number of the vertex or element in the file.
        tag: Option<FileTag>,
        /// Cleaning keys that would repair the file, and their effects.
        cures: Vec<&'static str>,
        /// The error.
        source: Box<MeshError>,
    },
    /// An unexpected word.
    #[error("expected {expected}, found `{found}`")]
    Expected {
        /// The expected text.
        expected: &'static str,
        /// The text found, shortened.
        found: String,
    },
    /// A truncated file.
    #[error("the file ends where {expected} should be; is it complete?")]
    EndOfFile {
        /// The expected text.
        expected: &'static str,
    },
    /// A Gmsh file without nodes or elements.
    #[error("the file has no section {section}; is it complete?")]
    MissingSection {
        /// The section.
        section: &'static str,
    },
    /// A Gmsh file of an unsupported version.
    #[error(
        "version {version} of the Gmsh format; supported are 2.1, 2.2 and 4.1 (in Gmsh: `Mesh.MshFileVersion = \
         4.1;`)"
    )]
    GmshVersion {
        /// Version stated in the file.
        version: String,
    },
    /// Elements of an unsupported type.
    #[error(
        "element {element} is a {name} (type {kind}); supported are points, lines, triangles, \
             quadrilaterals, tetrahedra and hexahedra of first order (in Gmsh: `Mesh.ElementOrder = 1;`), or \
             triangles and tetrahedra of second order with `order = 2` in the body, or with \
             `drop_mid_nodes = true` next to `path` to use the corners only"
    )]
    ElementType {
        /// Tag of the element in the file.
        element: u64,
        /// Gmsh's number of the type.
        kind: u64,
        /// Name of the type.
        name: &'static str,
    },
    /// Two nodes with the same tag.
    #[error("there are two nodes with the tag {node}; tags must differ")]
    RepeatedNode {
        /// The tag.
        node: u64,
    },
    /// An element with an undefined node.
    #[error("element {element} uses node {node}, which the file does not define")]
    UnknownNode {
        /// Tag of the element.
        element: u64,
        /// Tag of the node.
        node: u64,
    },
    /// An OBJ statement with an undefined vertex.
    #[error(
        "vertex {index} does not exist: {count} vertices stand above this line (1 is the first of them, -1 \
         the last)"
    )]
    ObjIndex {
        /// The number in the file.
        index: i64,
        /// Number of vertices defined so far.
        count: usize,
    },
    /// A cell or an entity in too many groups.
    #[error("a cell or an entity is in more than {limit} groups")]
    TooManyGroups {
        /// Maximum number of groups.
        limit: usize,
    },
}
