//! Bodies: what they are made of, and how they start.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    BendingSpec, BodyContactSpec, BodyMesh, CellOrder, DampingSpec, Load, MaterialAxesSpec, MembraneSpec,
    MeshSpec, MuscleSpec, ObstacleShape, OneOrMany, Pin, RepeatSpec, TransformSpec,
};
use pliant::energy::spring::{SpringFormula, SpringFormulaError};
use pliant::material::{MaterialSpec, Preset, Stress};
use pliant::quantity::Quantity;
use pliant::value::*;

/// One body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name, unique in the scene; used in the output. Default `body0`, `body1`, ...
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(regex(pattern = "^[A-Za-z0-9_-]{1,64}$"))]
    pub name: Option<String>,
    /// Its shape at rest.
    pub mesh: MeshSpec,
    /// Moves the shape: scaled, then rotated, then translated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transform: Option<TransformSpec>,
    /// Makes copies of the shape, after `transform`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeat: Option<RepeatSpec>,
    /// Finite elements: the material that fills the mesh's triangles or quadrilaterals (2D), tetrahedra
    /// or hexahedra (3D), or with `membrane` its triangles in 3D.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elastic: Option<MaterialSpec>,
    /// Factor of the energy density of `elastic` in each element, one for each or one for all: an element is
    /// as much stiffer as its factor says, with the same Poisson's ratio. Not with `membrane`
    /// or `stiffness_proportional` damping, nor in quadrilaterals and hexahedra.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<OneOrManyOf<Number>>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "items" = { "exclusiveMinimum": 0.0 }))]
    pub elastic_factor: Option<OneOrMany>,
    /// Axes of `elastic` in each element, by which its fibres and its components `C11`, `E12` go; those of
    /// the scene without it. For materials with directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elastic_axes: Option<MaterialAxesSpec>,
    /// Makes a sheet in 3D of finite elements: how thick it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub membrane: Option<MembraneSpec>,
    /// Order of the elements of `elastic`: 1 linear (the default), or 2 quadratic, with a node in the middle
    /// of every edge, of every face of hexahedra and of every quadrilateral and hexahedron, which bend
    /// without locking. Files of second order keep their nodes, curved sides included; all other meshes gain
    /// straight ones, numbered after the corners, and selections by place and by group hold them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 2))]
    pub order: Option<u8>,
    /// With `order = 2`, quadrilaterals and hexahedra without nodes in the middle of faces and cells, of 8
    /// and 20 nodes in place of 9 and 27: the material is evaluated at 4 and 8 points in place of 9 and 27.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub serendipity: bool,
    /// Number of times that every cell of the mesh is cut into cells of half its size: 4 triangles or
    /// quadrilaterals, 8 tetrahedra or hexahedra. Groups hold the parts of their cells; round shapes stay round.
    /// Not for files of second order, nor for `surface`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 8))]
    pub refine: Option<usize>,
    /// How the stress of `elastic` is computed; by the closed form without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<Stress>,
    /// Springs along the mesh's edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub springs: Option<SpringsSpec>,
    /// Resistance to bending of a sheet in 3D, at every edge between two triangles, or of a strand, at every
    /// vertex between two edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending: Option<BendingSpec>,
    /// What takes energy out of its deformation; nothing without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<DampingSpec>,
    /// Its mass.
    pub mass: MassSpec,
    /// Vertices that are held: where they are, or on a prescribed motion.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pin: Vec<Pin>,
    /// How it touches others, where the scene has `[contact]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<BodyContactSpec>,
    /// Active stress along fibres of a solid, over time: it contracts by itself. Several add up.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub muscle: Vec<MuscleSpec>,
    /// Forces from outside: point loads, traction, pressure, forces per volume.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub load: Vec<Load>,
    /// Where it starts; in its rest shape without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<PositionSpec>,
    /// Initial velocity; at rest without it. What is pinned stays at rest, or moves as its pin says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<VelocitySpec>,
    /// The obstacle that it stands for; no part of the text.
    #[serde(skip)]
    pub obstacle: Option<ObstacleShape>,
}

/// Springs along edges: `E = 1/2 k (l - l0)^2` each, or what `expression` says. Exactly one of `stiffness`,
/// `young` and `expression`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(rename = "Springs")]
pub struct SpringsSpec {
    /// Spring constant `k` [N/m]: one for all or one per edge.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<OneOrManyOf<Stiffness>>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "items" = { "exclusiveMinimum": 0.0 }))]
    pub stiffness: Option<OneOrMany>,
    /// `Y` with `k = Y l0` [N/m^2], as the lecture's program has it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Pressure>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub young: Option<f64>,
    /// The energy [J] of a spring: a formula of its length `l`, its rest length `l0` [m] and of `parameters`.
    /// At `l = l0` it has no energy and no tension.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expression: Option<String>,
    /// Numbers of the formula by their names.
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        with = "As::<BTreeMap<String, SpringParameter>>"
    )]
    pub parameters: BTreeMap<String, f64>,
    /// Rest length `l0` [m], one for all or one per edge; the mesh's edge lengths without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<OneOrManyOf<Length>>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "items" = { "exclusiveMinimum": 0.0 }))]
    pub rest_length: Option<OneOrMany>,
}

impl SpringsSpec {
    /// The energy by its formula, where it has one.
    ///
    /// # Errors
    /// [`SpringFormulaError`]: the text is no formula of what there is.
    pub fn formula(&self) -> Option<Result<SpringFormula, SpringFormulaError>> {
        let parameters: Vec<(&str, f64)> =
            self.parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        self.expression.as_ref().map(|text| SpringFormula::new(text, &parameters))
    }
}

/// The mass of a body, lumped to its vertices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MassSpec {
    /// Density [kg/m^3] (2D: kg/m^2 per metre of thickness; sheets of springs: kg/m^2; springs without cells:
    /// kg/m of edge; a `membrane` takes it by area too, if the unit says so): each element gives an equal
    /// share to its vertices, one of second order positive shares in proportion to the diagonal of its mass
    /// matrix.
    Density(
        #[serde(with = "As::<Density>")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        Quantity,
    ),
    /// Mass of each vertex [kg]: one number for all or a list.
    PerVertex(
        #[serde(with = "As::<OneOrManyOf<Mass>>")]
        #[schemars(extend("exclusiveMinimum" = 0.0, "items" = { "exclusiveMinimum": 0.0 }))]
        OneOrMany,
    ),
    /// Total mass [kg], shared equally between the vertices.
    Total(
        #[serde(with = "As::<Mass>")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        f64,
    ),
    /// The density of a well-known material, for solids, membranes, and bodies in 2D (which are one metre
    /// thick); `pliant list presets` shows them.
    Preset(Preset),
}

/// Initial positions of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PositionSpec {
    /// `x = centre + matrix (X - centre) + translation`, pinned vertices included.
    Affine(AffinePosition),
    /// One point per vertex [m].
    PerVertex(#[serde(with = "As::<Vec<Vec<Length>>>")] Vec<Vec<f64>>),
    /// One displacement from the rest position per vertex [m].
    Displacement(#[serde(with = "As::<Vec<Vec<Length>>>")] Vec<Vec<f64>>),
}

/// A uniform deformation of the rest shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AffinePosition {
    /// The deformation gradient, by rows; the identity without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<Vec<Vec<f64>>>,
    /// The point that `matrix` leaves where it is [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    pub centre: Option<Vec<f64>>,
    /// Then moved by this [m].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    pub translation: Option<Vec<f64>>,
}

/// Initial velocities of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VelocitySpec {
    /// `v = linear + angular x (X - centre of mass)`.
    Rigid(RigidVelocity),
    /// One vector per vertex [m/s].
    PerVertex(#[serde(with = "As::<Vec<Vec<Velocity>>>")] Vec<Vec<f64>>),
    /// Tangential speed [m/s] about `centre` in the x-y plane, counter-clockwise, the same at every radius.
    Tangential(TangentialVelocity),
}

/// Velocity field of a rigid body.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigidVelocity {
    /// Velocity of the centre of mass [m/s].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Velocity>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub linear: Option<Vec<f64>>,
    /// Angular velocity [rad/s]: one number in 2D (counter-clockwise), three in 3D.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        with = "As::<Option<OneOrManyOf<AngularVelocity>>>"
    )]
    pub angular: Option<OneOrMany>,
}

/// Rotation at constant speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TangentialVelocity {
    /// Speed [m/s].
    #[serde(with = "As::<Velocity>")]
    pub speed: f64,
    /// Centre [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub centre: Option<Vec<f64>>,
}

impl Body {
    /// A body of this shape and mass and nothing else; further fields by `..Body::new(mesh, mass)`.
    pub fn new(mesh: MeshSpec, mass: MassSpec) -> Self {
        Body {
            name: None,
            mesh,
            transform: None,
            repeat: None,
            elastic: None,
            elastic_factor: None,
            elastic_axes: None,
            membrane: None,
            order: None,
            serendipity: false,
            refine: None,
            stress: None,
            springs: None,
            bending: None,
            damping: None,
            mass,
            pin: vec![],
            contact: None,
            muscle: vec![],
            load: vec![],
            position: None,
            velocity: None,
            obstacle: None,
        }
    }

    /// The name, or `body0`, `body1`, ... by the index in the scene.
    pub fn name_or_default(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("body{index}"))
    }

    /// Number of vertices, copies included; `None` for a file, with nodes in the middle of edges, and for
    /// more than can be counted.
    pub fn vertex_count(&self) -> Option<u64> {
        if self.is_quadratic() {
            return None;
        }
        self.mesh.vertex_count()?.checked_mul(self.copies())
    }

    /// Number of copies of the mesh; saturates.
    pub fn copies(&self) -> u64 {
        self.repeat.as_ref().map_or(1, RepeatSpec::copies)
    }

    /// True if its elements are of second order.
    pub fn is_quadratic(&self) -> bool {
        self.order == Some(2)
    }

    /// Order of its elements.
    pub fn cell_order(&self) -> CellOrder {
        match (self.is_quadratic(), self.serendipity) {
            (false, _) => CellOrder::Linear,
            (true, false) => CellOrder::Quadratic,
            (true, true) => CellOrder::Serendipity,
        }
    }

    /// Its mesh, and what becomes of it.
    pub fn body_mesh(&self) -> BodyMesh<'_> {
        let (transform, repeat) = (self.transform.as_ref(), self.repeat.as_ref());
        let refine = self.refine.unwrap_or(0);
        BodyMesh { shape: &self.mesh, order: self.cell_order(), refine, transform, repeat }
    }

    /// How the stress of `elastic` is computed.
    pub fn stress_or_default(&self) -> Stress {
        self.stress.unwrap_or_default()
    }

    /// True if nothing holds its vertices together: no elements, no springs. Mutual attraction
    /// (`world.nbody`) acts on these bodies only.
    pub fn is_particles(&self) -> bool {
        self.elastic.is_none() && self.springs.is_none() && self.obstacle.is_none()
    }
}
