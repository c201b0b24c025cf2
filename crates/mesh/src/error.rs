//! Errors in meshes. Every message names the position, the value found, and the value expected.

use pliant::quantity::{Rounded, counted};
use std::path::PathBuf;

use super::{Cell, FileTag, FormatError, SurfaceError};

/// Why a mesh could not be built, read or selected from. Indices count from 0.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The scene is neither two- nor three-dimensional.
    #[error("dimension is {dimension}; meshes are two- or three-dimensional")]
    Dimension {
        /// The dimension asked for.
        dimension: usize,
    },
    /// A vector of the specification has the wrong length.
    #[error(
        "`{field}` has {found} components where the scene has {expected} dimensions; give {expected} numbers"
    )]
    Components {
        /// Name of the field, as in the scene.
        field: &'static str,
        /// Components there must be.
        expected: usize,
        /// Components there are.
        found: usize,
    },
    /// A point written in the scene has the wrong number of coordinates.
    #[error("point {vertex} has {found} coordinates where the scene has {expected} dimensions")]
    PointComponents {
        /// Index of the point.
        vertex: usize,
        /// Coordinates there must be.
        expected: usize,
        /// Coordinates there are.
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
        /// Both were given; otherwise none.
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
    /// Only three-dimensional disks are thick.
    #[error("`thickness` is {thickness}, which only a 3D scene can have; remove it or set `dimension = 3`")]
    ThicknessInPlane {
        /// Thickness [m].
        thickness: f64,
    },
    /// Indices are 32 bits wide.
    #[error("the mesh would have {count} {what}; at most {} fit 32-bit indices", u32::MAX)]
    TooMany {
        /// `vertices`, `edges`, `triangles` or `tetrahedra`.
        what: &'static str,
        /// How many there would be, saturated.
        count: u64,
    },
    /// The allocator refused.
    #[error("the mesh would take {bytes} bytes, which this machine does not have; use fewer cells")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: u64,
    },

    /// A mesh without vertices.
    #[error("the mesh has no vertices")]
    Empty,
    /// A shape of another dimension than the scene.
    #[error("a {shape} is {dimension}-dimensional; set `dimension = {dimension}`")]
    ShapeDimension {
        /// The choice in the scene.
        shape: &'static str,
        /// The dimension it needs.
        dimension: usize,
    },
    /// A length that must be less than another.
    #[error("`{field}` is {value}; it must be less than `{other}` = {bound}")]
    NotLess {
        /// Name of the field.
        field: &'static str,
        /// Its value [m].
        value: f64,
        /// Name of the field that bounds it.
        other: &'static str,
        /// The value of that [m].
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
    /// Solids do not fit the plane.
    #[error("the mesh has {count} tetrahedra, but the scene is two-dimensional; set `dimension = 3`")]
    TetrahedraInPlane {
        /// Number of tetrahedra.
        count: usize,
    },
    /// Solids do not fit the plane.
    #[error("the mesh has {count} {cells}, but the scene is two-dimensional; set `dimension = 3`")]
    SolidsInPlane {
        /// Number of cells.
        count: usize,
        /// Their kind.
        cells: &'static str,
    },
    /// An element of another dimension than the scene's.
    #[error(
        "`element` is \"{found}\" where the scene has {dimension} dimensions; use \"{other}\", or leave \
         it out"
    )]
    WrongElement {
        /// The element.
        found: &'static str,
        /// Dimension of the scene.
        dimension: usize,
        /// The element of that dimension.
        other: &'static str,
    },
    /// Cells of two kinds and the same dimension.
    #[error(
        "the mesh has {} and {}: cells of one dimension must be of one kind; split one kind into the other, \
         or make a body of each", cells[0], cells[1]
    )]
    MixedCells {
        /// Kinds of cells.
        cells: [&'static str; 2],
    },
    /// A surface in space of cells that are no triangles.
    #[error(
        "the mesh is a surface of {count} {cells} in space: surfaces are made of triangles; split each in two"
    )]
    SheetOfCells {
        /// Number of cells.
        count: usize,
        /// Their kind.
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
        /// Least `det J` in it, as a fraction of its mean.
        least: f64,
    },
    /// Cells of serendipity of simplices.
    #[error("`serendipity` is for quadrilaterals and hexahedra, and the mesh has none; remove it")]
    NoSerendipity,
    /// Cells that have the nodes that those of serendipity are without.
    #[error("the mesh has {cells} with nodes in the middle of faces or cells; remove `serendipity`")]
    LagrangeCells {
        /// Their kind.
        cells: &'static str,
    },
    /// A vertex off the plane of a two-dimensional scene.
    #[error("vertex {vertex} has z = {z}; in a two-dimensional scene every z must be 0")]
    OffPlane {
        /// Vertex index.
        vertex: usize,
        /// Its z [m].
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
    /// A cell names a vertex that is not there.
    #[error("{cell} uses vertex {vertex}, but the mesh has {}, numbered from 0",
        counted(*.count as u64, "vertex", "vertices"))]
    IndexOutOfRange {
        /// The cell.
        cell: Cell,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A cell names a vertex twice.
    #[error("{cell} uses vertex {vertex} more than once; its vertices must all differ")]
    RepeatedVertex {
        /// The cell.
        cell: Cell,
        /// The vertex.
        vertex: u32,
    },
    /// An element that is there twice: its stiffness and its mass would count twice.
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
        /// The second of them.
        cell: Cell,
        /// Index of the first.
        first: usize,
        /// How many elements repeat another.
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
        /// Its signed volume or area [m^3 or m^2].
        volume: f64,
        /// Its longest edge `h` [m].
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
        /// Its signed volume or area [m^3 or m^2].
        volume: f64,
        /// Its longest edge `h` [m].
        size: f64,
    },
    /// An element of second order that its curved sides fold.
    #[error(
        "{cell} is folded by its curved sides: its Jacobian determinant falls to {least:.4} of its mean, \
         and must be positive everywhere; move the nodes in the middle of its edges (in Gmsh: \
         `Mesh.HighOrderOptimize = 2;`), or use its corners only (`drop_mid_nodes = true` beside `path`)"
    )]
    Folded {
        /// The element.
        cell: Cell,
        /// Lower bound of the least `det J` in it, as a fraction of its mean.
        least: f64,
    },
    /// A surface with one side.
    #[error(
        "the surface has one side only (a Moebius band), which shows at the edge from vertex {} to {}: no \
         order of vertices puts the same side of all triangles up; cut it there, or do without `orient`",
        edge[0], edge[1]
    )]
    NotOrientable {
        /// An edge that two triangles cannot both run through in opposite ways.
        edge: [u32; 2],
    },
    /// A mesh of which cleaning leaves no element.
    #[error(
        "all {count} elements are degenerate: `drop_degenerate` would leave none; is the tolerance of \
         `merge` too large?"
    )]
    NothingLeft {
        /// How many there were.
        count: usize,
    },
    /// An edge between two vertices at the same place.
    #[error("edge {edge} joins vertices {} and {}, which are at the same place; a spring needs a length",
            vertices[0], vertices[1])]
    ZeroLengthEdge {
        /// Index into `edges`.
        edge: usize,
        /// Its ends.
        vertices: [u32; 2],
    },
    /// Vertices that no element and no edge uses would have no mass.
    #[error(
        "{} to no element and no edge, the first is vertex {vertex}; remove what does not \
         belong there (Gmsh: give the bodies physical groups, so that only their vertices are saved)",
        counted(*.count as u64, "vertex belongs", "vertices belong")
    )]
    Unreferenced {
        /// The first of them.
        vertex: usize,
        /// How many there are.
        count: usize,
    },

    /// A selection by a name that the mesh does not have.
    #[error("there is no group `{name}`{}; {}", suggestion.as_ref().map(|s| format!(" (did you mean \
         `{s}`?)")).unwrap_or_default(),
            if known.is_empty() { "the mesh has no groups".to_string() } else { format!("the mesh has \
                 `{}`", known.join("`, `")) })]
    UnknownGroup {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
        /// The nearest of them, if one is near.
        suggestion: Option<String>,
    },
    /// A selection by an index that is not there.
    #[error("the selection names vertex {vertex}, but the body has {}, numbered from 0",
        counted(*.count as u64, "vertex", "vertices"))]
    SelectedVertex {
        /// The index.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A box whose lower corner is above the upper one.
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
    /// A selection that selects nothing.
    #[error("{selection} selects no vertex; the body spans {lower:?} to {upper:?}")]
    NothingSelected {
        /// The selection, in words.
        selection: String,
        /// Lower corner of the body [m].
        lower: Vec<f64>,
        /// Upper corner of the body [m].
        upper: Vec<f64>,
    },

    /// A load on a surface that has no face.
    #[error("{}", if *whole { "the mesh has no faces for it to act on" } else { "no face of the surface has \
         all its vertices in the selection" })]
    NoFace {
        /// True if the whole surface was meant.
        whole: bool,
    },

    /// A surface that cannot be made a solid.
    #[error(transparent)]
    Surface(#[from] SurfaceError),

    /// The file could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        source: std::io::Error,
    },
    /// A file of no known format.
    #[error("{}: unknown mesh format; supported are {supported}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The formats there are, with their extensions.
        supported: String,
    },
    /// The text of a file is no mesh of its format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A fault in a file, and where.
    #[error("{}{}: {}{source}{}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default(),
            tag.map(|t| format!("{t} of the file: ")).unwrap_or_default(),
            cures.iter().map(|cure| format!("; or {cure}")).collect::<String>())]
    InFile {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: Option<u32>,
        /// Name, in the file, of the vertex or element at fault.
        tag: Option<FileTag>,
        /// Keys beside `path` that would mend it, and what they do.
        cures: Vec<&'static str>,
        /// The fault.
        source: Box<MeshError>,
    },
    /// A word that makes no sense where it stands.
    #[error("expected {expected}, found `{found}`")]
    Expected {
        /// The expected text.
        expected: &'static str,
        /// The text found, shortened.
        found: String,
    },
    /// The file is cut off.
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
    /// A Gmsh file of another version.
    #[error(
        "version {version} of the Gmsh format; supported are 2.1, 2.2 and 4.1 (in Gmsh: `Mesh.MshFileVersion = \
         4.1;`)"
    )]
    GmshVersion {
        /// The version that the file states.
        version: String,
    },
    /// Elements that are not linear simplices.
    #[error(
        "element {element} is a {name} (type {kind}); supported are points, lines, triangles, \
             quadrilaterals, tetrahedra and hexahedra of first order (in Gmsh: `Mesh.ElementOrder = 1;`), or \
             triangles and tetrahedra of second order with `order = 2` in the body, or with \
             `drop_mid_nodes = true` beside `path` to use the corners only"
    )]
    ElementType {
        /// Its tag in the file.
        element: u64,
        /// Gmsh's number for the type.
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
    /// An element that names a node that is not there.
    #[error("element {element} uses node {node}, which the file does not define")]
    UnknownNode {
        /// Tag of the element.
        element: u64,
        /// Tag of the node.
        node: u64,
    },
    /// An OBJ statement that names a vertex that is not there.
    #[error(
        "vertex {index} does not exist: {count} vertices stand above this line (1 is the first of them, -1 \
         the last)"
    )]
    ObjIndex {
        /// The number in the file.
        index: i64,
        /// Vertices defined so far.
        count: usize,
    },
    /// More named groups on one thing than a reader follows.
    #[error("a cell or an entity is in more than {limit} groups")]
    TooManyGroups {
        /// The most there may be.
        limit: usize,
    },
}
