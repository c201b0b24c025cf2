//! The TOML schema of a scene, as plain data in SI units.
//!
//! Externally tagged tables throughout: internally tagged, flattened and untagged enums lose the position of an
//! error in the text.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::integrator::IntegratorSpec;
use crate::material::MaterialSpec;

mod one_or_many;

pub use one_or_many::OneOrMany;

/// A scene: bodies, the world around them, how time advances, what is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// One line that says what this is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Space dimension, 2 (plane strain) or 3.
    pub dimension: usize,
    /// How time advances.
    pub time: Time,
    /// Gravity, walls, drag: what acts on every body.
    #[serde(default)]
    pub world: World,
    /// The bodies, at least one.
    #[serde(default)]
    pub body: Vec<Body>,
    /// What is written, and how often.
    #[serde(default)]
    pub output: Output,
    /// Directory that files named in the scene are relative to: where the scene file is. No part of the text.
    #[serde(skip)]
    pub directory: PathBuf,
}

/// How time advances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// The scheme, by name; `pliant list integrators` shows all.
    pub integrator: IntegratorSpec,
    /// Time step [s].
    pub step: f64,
    /// Simulated time to run [s].
    pub duration: f64,
    /// Run although the step is above the stability limit; the run then ends by itself once it has blown up.
    #[serde(default)]
    pub allow_unstable: bool,
}

/// What acts on every body.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// Uniform gravitational acceleration [m/s^2], one number per dimension.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<Vec<f64>>,
    /// Rigid half-spaces that vertices cannot enter.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<Wall>,
    /// Newtonian attraction between all vertices of bodies without elements and springs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nbody: Option<NBody>,
    /// Ether drag [1/s]: velocities decay as `exp(-ether_drag * t)`, rigid motion included.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ether_drag: Option<f64>,
}

/// A rigid half-space: a vertex with `normal . x < offset` is put back on the plane, its normal velocity zeroed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Points out of the wall; need not be of unit length.
    pub normal: Vec<f64>,
    /// `normal . x` on the plane [m, after the normal is scaled to unit length].
    pub offset: f64,
}

/// Newtonian gravity `E = -G m_i m_j / sqrt(r^2 + softening^2)` between every pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NBody {
    /// Gravitational constant `G` [m^3 / (kg s^2)].
    pub constant: f64,
    /// Plummer softening length [m].
    #[serde(default)]
    pub softening: f64,
}

/// One body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name, unique in the scene; used in the output. Default `body0`, `body1`, ...
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its shape at rest.
    pub mesh: MeshSpec,
    /// Finite elements: the material that fills the mesh's triangles (2D) or tetrahedra (3D).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elastic: Option<MaterialSpec>,
    /// How the stress of `elastic` is computed.
    #[serde(default, skip_serializing_if = "Stress::is_default")]
    pub stress: Stress,
    /// Springs along the mesh's edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub springs: Option<Springs>,
    /// Its mass.
    pub mass: MassSpec,
    /// Vertices that never move.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pin: Vec<Selection>,
    /// Where it starts; in its rest shape without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<PositionSpec>,
    /// Initial velocity; at rest without it. Pinned vertices stay at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<VelocitySpec>,
}

impl Body {
    /// Its name, or `body0`, `body1`, ... by its index.
    pub fn name_or_default(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("body{index}"))
    }
}

/// How the stress `P` of a material is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stress {
    /// By the model's closed form.
    #[default]
    Analytic,
    /// By automatic differentiation of its energy density.
    Autodiff,
}

impl Stress {
    fn is_default(&self) -> bool {
        *self == Stress::default()
    }
}

/// Springs along edges: `E = 1/2 k (l - l0)^2` each. Exactly one of `stiffness` and `young`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Springs {
    /// Spring constant `k` [N/m]: one for all or one per edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<OneOrMany>,
    /// `Y` with `k = Y l0` [N/m^2], as the lecture's program has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub young: Option<f64>,
    /// Rest length `l0` [m], one for all or one per edge; the mesh's edge lengths without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest_length: Option<OneOrMany>,
}

/// The mass of a body, lumped to its vertices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MassSpec {
    /// Density [kg/m^3] (2D: kg/m^2 per metre of thickness; springs without cells: kg/m of edge): each element gives
    /// an equal share to its vertices.
    Density(f64),
    /// Mass of each vertex [kg]: one number for all or a list.
    PerVertex(OneOrMany),
    /// Total mass [kg], shared equally between the vertices.
    Total(f64),
}

/// A set of vertices of a body, by their rest positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Selection {
    /// All vertices with `min <= X <= max` (tolerance 1e-9 of the body's size).
    Box(BoxSelection),
    /// All vertices with `normal . X <= offset` (tolerance 1e-9 of the body's size).
    HalfSpace(Wall),
    /// These vertices, by index in the body.
    Vertices(Vec<u32>),
    /// A named group of the mesh.
    Group(String),
}

/// An axis-aligned box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxSelection {
    /// Lower corner [m].
    pub min: Vec<f64>,
    /// Upper corner [m].
    pub max: Vec<f64>,
}

/// Initial positions of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PositionSpec {
    /// `x = centre + matrix (X - centre) + translation`, pinned vertices included.
    Affine(AffinePosition),
    /// One point per vertex [m].
    PerVertex(Vec<Vec<f64>>),
    /// One displacement from the rest position per vertex [m].
    Displacement(Vec<Vec<f64>>),
}

/// A uniform deformation of the rest shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AffinePosition {
    /// The deformation gradient, by rows; the identity without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<Vec<Vec<f64>>>,
    /// The point that `matrix` leaves where it is [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<Vec<f64>>,
    /// Then moved by this [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<Vec<f64>>,
}

/// Initial velocities of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VelocitySpec {
    /// `v = linear + angular x (X - centre of mass)`.
    Rigid(RigidVelocity),
    /// One vector per vertex [m/s].
    PerVertex(Vec<Vec<f64>>),
    /// Tangential speed [m/s] about `centre` in the x-y plane, counter-clockwise, the same at every radius.
    Tangential(TangentialVelocity),
}

/// Velocity field of a rigid body.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigidVelocity {
    /// Velocity of the centre of mass [m/s].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linear: Option<Vec<f64>>,
    /// Angular velocity [rad/s]: one number in 2D (counter-clockwise), three in 3D.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angular: Option<Vec<f64>>,
}

/// Rotation at constant speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TangentialVelocity {
    /// Speed [m/s].
    pub speed: f64,
    /// Centre [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<Vec<f64>>,
}

/// The shape of a body at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshSpec {
    /// A box of cells: two triangles each in 2D, six tetrahedra each in 3D.
    Grid(GridSpec),
    /// A rectangular sheet of triangles in 3D (or 2D) with springs along both diagonals of every cell.
    Cloth(ClothSpec),
    /// A polyline.
    Strand(StrandSpec),
    /// Points spread at random over a disk or annulus.
    Disk(DiskSpec),
    /// A mesh file: Gmsh `.msh` (2.2 or 4.1, ASCII) or Wavefront `.obj`.
    File(FileSpec),
    /// Vertices and cells written in the scene.
    Inline(InlineSpec),
}

/// A box of cells. Vertex `(i, j, k)` has index `(i (ny + 1) + j) (nz + 1) + k`. Exactly one of `spacing` and `size`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Number of cells along each axis.
    pub cells: Vec<usize>,
    /// Edge length of a cell [m], the same along each axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing: Option<f64>,
    /// Size of the box [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<Vec<f64>>,
    /// Lower corner [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Vec<f64>>,
}

/// A rectangular sheet. Vertex `(i, j)` has index `i (n1 + 1) + j`, at `origin + i/n0 u + j/n1 v`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClothSpec {
    /// Number of cells along `u` and `v`.
    pub cells: [usize; 2],
    /// Corner [m].
    pub origin: Vec<f64>,
    /// First side [m].
    pub u: Vec<f64>,
    /// Second side [m].
    pub v: Vec<f64>,
}

/// A straight chain of equal segments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrandSpec {
    /// Number of segments.
    pub segments: usize,
    /// First end [m].
    pub start: Vec<f64>,
    /// Last end [m].
    pub end: Vec<f64>,
}

/// Points spread at random, uniformly over the area of a disk or annulus in the x-y plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiskSpec {
    /// Number of points.
    pub count: usize,
    /// Outer radius [m].
    pub radius: f64,
    /// Inner radius [m].
    #[serde(default)]
    pub inner_radius: f64,
    /// Centre [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<Vec<f64>>,
    /// Thickness in z [m], 3D only: z is uniform in +-thickness/2.
    #[serde(default)]
    pub thickness: f64,
    /// Seed of the random numbers; the same seed gives the same points everywhere.
    #[serde(default)]
    pub seed: u64,
}

/// A mesh file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSpec {
    /// Path, relative to the scene file.
    pub path: PathBuf,
}

/// Vertices and cells written in the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InlineSpec {
    /// Rest positions [m].
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
}

/// What is written, and how often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Frames per simulated second.
    pub rate: f64,
    /// What each frame holds.
    pub channels: Vec<Channel>,
}

impl Default for Output {
    fn default() -> Self {
        Output { rate: 60.0, channels: vec![Channel::State, Channel::Mesh, Channel::Energy] }
    }
}

/// One kind of output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// Positions and velocities of every vertex, on `/state`.
    State,
    /// Triangles and lines for a viewer, on `/mesh`.
    Mesh,
    /// Energies and momenta, on `/energy`.
    Energy,
}
