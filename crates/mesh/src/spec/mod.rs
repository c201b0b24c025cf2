//! Reference shapes, as a user writes them.

use std::path::PathBuf;

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};

use pliant::element::{CellBlock, CellKind, HEXAHEDRON, QUADRILATERAL};
use pliant::value::*;

mod selection;
mod shapes;
mod surface;
mod transform;

pub use selection::*;
pub use shapes::*;
pub use surface::*;
pub use transform::*;

/// Bound of the schema on each entry of a list: above 0.
pub fn positive_entries(schema: &mut Schema) {
    if let Some(entries) = schema.get_mut("items").and_then(|items| items.as_object_mut()) {
        entries.insert("exclusiveMinimum".to_owned(), 0.0.into());
    }
}

/// Order of the cells of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellOrder {
    /// First order.
    #[default]
    Linear,
    /// Second order, of quadrilaterals and hexahedra with all nodes of Lagrange's functions.
    Quadratic,
    /// Second order, of quadrilaterals and hexahedra without nodes in the middle of faces and cells.
    Serendipity,
}

impl CellOrder {
    /// True if there are nodes in the middle of edges.
    pub fn is_quadratic(self) -> bool {
        self != CellOrder::Linear
    }
}

/// The mesh of a body: its shape, and how that is refined, moved and repeated.
#[derive(Clone, Copy, Debug)]
pub struct BodyMesh<'a> {
    /// Its shape.
    pub shape: &'a MeshSpec,
    /// Order of its cells.
    pub order: CellOrder,
    /// Number of times that its cells are cut into cells of half the size.
    pub refine: usize,
    /// Where it is, where that is not where the shape has it.
    pub transform: Option<&'a TransformSpec>,
    /// How often it is there, where that is more than once.
    pub repeat: Option<&'a RepeatSpec>,
}

/// The shape of a body at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshSpec {
    /// A box of cells: two triangles or a quadrilateral each in 2D, six tetrahedra or a hexahedron each
    /// in 3D.
    Grid(GridSpec),
    /// A rectangular sheet of triangles in 3D (or 2D) with springs along both diagonals of every cell.
    Cloth(ClothSpec),
    /// A polyline.
    Strand(StrandSpec),
    /// Points spread at random over a disk or annulus.
    Disk(DiskSpec),
    /// A mesh file: Gmsh `.msh` (2.1, 2.2 or 4.1), VTK `.vtk` and `.vtu`, Abaqus `.inp`, TetGen `.node` with
    /// `.ele`, Medit `.mesh`, `.ply`, `.stl`, Wavefront `.obj`.
    File(FileSpec),
    /// A solid from the closed surface of a mesh file, filled with tetrahedra or hexahedra.
    Surface(SurfaceSpec),
    /// Vertices and cells written in the scene.
    Inline(InlineSpec),
    /// A ball of tetrahedra.
    Ball(BallSpec),
    /// The surface of a ball: triangles in 3D.
    Sphere(SphereSpec),
    /// A cylinder of tetrahedra.
    Cylinder(CylinderSpec),
    /// A hollow cylinder of tetrahedra.
    Tube(TubeSpec),
    /// A ring of triangles in 2D.
    Annulus(AnnulusSpec),
    /// Cook's membrane, in 2D.
    CooksMembrane(CooksMembraneSpec),
    /// A beam that tapers, in 2D; by default that of NAFEMS FV32.
    TaperedBeam(TaperedBeamSpec),
    /// A beam with a V-shaped notch, in 2D.
    NotchedBeam(NotchedBeamSpec),
    /// A quarter of an elliptic ring, in 2D; by default that of NAFEMS LE1.
    EllipticMembrane(EllipticMembraneSpec),
}

/// A box of cells. Vertex `(i, j, k)` has index `(i (ny + 1) + j) (nz + 1) + k`. Exactly one of `spacing` and
/// `size`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Number of cells along each axis.
    #[schemars(length(min = 2, max = 3), inner(range(min = 1)))]
    pub cells: Vec<usize>,
    /// Edge length of a cell [m], the same along each axis.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub spacing: Option<f64>,
    /// Size of the box [m].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 3), transform = positive_entries)]
    pub size: Option<Vec<f64>>,
    /// Lower corner [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub origin: Option<Vec<f64>>,
    /// Elements that cells are made into: 2 triangles or 6 tetrahedra each without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<WholeCell>,
}

/// Element that is a whole cell of a generated mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WholeCell {
    /// 4 nodes, in 2D.
    Quadrilateral,
    /// 8 nodes, in 3D.
    Hexahedron,
}

impl WholeCell {
    /// Its kind.
    pub fn kind(self) -> &'static CellKind {
        match self {
            WholeCell::Quadrilateral => QUADRILATERAL.kind,
            WholeCell::Hexahedron => HEXAHEDRON.kind,
        }
    }
}

impl GridSpec {
    /// Kind of the cells, where they are no simplices.
    pub fn cell_kind(&self) -> Option<&'static CellKind> {
        self.element.map(WholeCell::kind)
    }
}

/// A rectangular sheet. Vertex `(i, j)` has index `i (n1 + 1) + j`, at `origin + i/n0 u + j/n1 v`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClothSpec {
    /// Number of cells along `u` and `v`.
    #[schemars(inner(range(min = 1)))]
    pub cells: [usize; 2],
    /// Corner [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub origin: Vec<f64>,
    /// First side [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub u: Vec<f64>,
    /// Second side [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub v: Vec<f64>,
}

/// A straight chain of equal segments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrandSpec {
    /// Number of segments.
    #[schemars(range(min = 1))]
    pub segments: usize,
    /// First end [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub start: Vec<f64>,
    /// Last end [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub end: Vec<f64>,
}

/// Points spread at random, uniformly over the area of a disk or annulus in the x-y plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiskSpec {
    /// Number of points.
    #[schemars(range(min = 1))]
    pub count: usize,
    /// Outer radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Inner radius [m].
    #[serde(default, with = "As::<Length>")]
    #[schemars(range(min = 0.0))]
    pub inner_radius: f64,
    /// Centre [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub centre: Option<Vec<f64>>,
    /// Thickness in z [m], 3D only: z is uniform in +-thickness/2.
    #[serde(default, with = "As::<Length>")]
    #[schemars(range(min = 0.0))]
    pub thickness: f64,
    /// Seed of the random numbers; the same seed gives the same points everywhere.
    #[serde(default)]
    pub seed: u64,
}

/// A mesh file. What is wrong in it is refused, or mended by the keys beside `path`, in this order:
/// `merge`, `drop_degenerate`, `drop_unused`, `orient`. Vertices keep the order of the file, and numbers of
/// vertices elsewhere in the scene count those that are left; `check` says how many are gone, and from
/// which number on the others have moved up.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSpec {
    /// Path, relative to the scene file.
    pub path: PathBuf,
    /// True if only the corners of cells of second order are used; without it such cells are an error,
    /// unless the body says `order = 2` and uses them as they are. With both, the sides become straight.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub drop_mid_nodes: bool,
    /// Vertices no farther than this from one before them in the file become that one [m]; 0 for those at
    /// exactly the same place. In coordinates of the file, before any `transform`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("minimum" = 0.0))]
    pub merge: Option<f64>,
    /// Whether cells without a volume, an area or a length are left out, cells that name a vertex twice,
    /// and cells that repeat another, whose groups that one then is in.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub drop_degenerate: bool,
    /// True if vertices that no element and no edge uses are left out.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub drop_unused: bool,
    /// True if cells of negative volume get their vertices in the right order. Triangles in space get the
    /// same side up as their neighbours: the outer one where they enclose a volume, otherwise the one that
    /// most of them have.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub orient: bool,
}

/// Vertices and cells written in the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InlineSpec {
    /// Rest positions [m].
    #[serde(with = "As::<Vec<Vec<Length>>>")]
    #[schemars(length(min = 1), inner(length(min = 2, max = 3)))]
    pub points: Vec<Vec<f64>>,
    /// Edges, by vertex index.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub edges: Vec<[u32; 2]>,
    /// Triangles.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub triangles: Vec<[u32; 3]>,
    /// Tetrahedra.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tetrahedra: Vec<[u32; 4]>,
    /// Quadrilaterals in 2D, vertices counter-clockwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub quadrilaterals: Vec<[u32; 4]>,
    /// Hexahedra: the vertices of the bottom, counter-clockwise seen from above, then those above them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hexahedra: Vec<[u32; 8]>,
}

impl InlineSpec {
    /// Its cells that are no simplices, by kind.
    pub fn blocks(&self) -> Vec<CellBlock> {
        let blocks = [
            CellBlock { kind: QUADRILATERAL.kind, vertices: self.quadrilaterals.concat() },
            CellBlock { kind: HEXAHEDRON.kind, vertices: self.hexahedra.concat() },
        ];
        blocks.into_iter().filter(|block| !block.is_empty()).collect()
    }
}

impl MeshSpec {
    /// The name of the choice, as in the scene.
    pub fn name(&self) -> &'static str {
        match self {
            MeshSpec::Grid(_) => "grid",
            MeshSpec::Cloth(_) => "cloth",
            MeshSpec::Strand(_) => "strand",
            MeshSpec::Disk(_) => "disk",
            MeshSpec::File(_) => "file",
            MeshSpec::Surface(_) => "surface",
            MeshSpec::Inline(_) => "inline",
            MeshSpec::Ball(_) => "ball",
            MeshSpec::Sphere(_) => "sphere",
            MeshSpec::Cylinder(_) => "cylinder",
            MeshSpec::Tube(_) => "tube",
            MeshSpec::Annulus(_) => "annulus",
            MeshSpec::CooksMembrane(_) => "cooks_membrane",
            MeshSpec::TaperedBeam(_) => "tapered_beam",
            MeshSpec::NotchedBeam(_) => "notched_beam",
            MeshSpec::EllipticMembrane(_) => "elliptic_membrane",
        }
    }

    /// The mesh file that it is made from.
    pub fn file(&self) -> Option<&std::path::Path> {
        match self {
            MeshSpec::File(file) => Some(&file.path),
            MeshSpec::Surface(surface) => Some(&surface.path),
            _ => None,
        }
    }

    /// Number of vertices; `None` for a file or a surface of one, for more than can be counted, and for
    /// shapes that cannot be.
    pub fn vertex_count(&self) -> Option<u64> {
        let nodes = |cells: &[usize]| {
            cells.iter().try_fold(1_u64, |product, &n| product.checked_mul((n as u64).checked_add(1)?))
        };
        match self {
            MeshSpec::Grid(grid) => nodes(&grid.cells),
            MeshSpec::Cloth(cloth) => nodes(&cloth.cells),
            MeshSpec::Strand(strand) => nodes(&[strand.segments]),
            MeshSpec::Disk(disk) => Some(disk.count as u64),
            MeshSpec::Inline(inline) => Some(inline.points.len() as u64),
            MeshSpec::File(_) | MeshSpec::Surface(_) => None,
            MeshSpec::Ball(_) | MeshSpec::Sphere(_) | MeshSpec::Cylinder(_) | MeshSpec::Tube(_) => {
                self.predicted(3)
            }
            MeshSpec::Annulus(_)
            | MeshSpec::CooksMembrane(_)
            | MeshSpec::TaperedBeam(_)
            | MeshSpec::NotchedBeam(_)
            | MeshSpec::EllipticMembrane(_) => self.predicted(2),
        }
    }

    /// Number of vertices of a generated shape of this dimension.
    fn predicted(&self, dimension: usize) -> Option<u64> {
        let size = crate::predicted_size(self, dimension, std::path::Path::new(""));
        size.ok().map(|size| size.vertices)
    }
}
