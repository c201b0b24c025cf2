//! Scenes on other meshes: with more or fewer cells, and with other elements in them. Generators with numbers
//! of cells take other numbers; all other meshes are cut by the key `refine`.

use pliant_scene::{MeshSpec, Scene};
use serde_json::{Value, json};

/// Kind of elements that the cells of a mesh are made into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ElementFamily {
    /// Linear triangles or tetrahedra.
    Linear,
    /// Quadratic triangles or tetrahedra.
    Quadratic,
    /// Linear quadrilaterals or hexahedra.
    Quadrilateral,
    /// Quadratic quadrilaterals or hexahedra, of 9 or 27 nodes.
    QuadraticQuadrilateral,
}

impl ElementFamily {
    /// All families.
    pub const ALL: [ElementFamily; 4] = [
        ElementFamily::Linear,
        ElementFamily::Quadratic,
        ElementFamily::Quadrilateral,
        ElementFamily::QuadraticQuadrilateral,
    ];

    /// Family of a name, as commands and scenes take it.
    pub fn named(name: &str) -> Option<ElementFamily> {
        match name {
            "linear" => Some(ElementFamily::Linear),
            "quadratic" => Some(ElementFamily::Quadratic),
            "quadrilateral" | "hexahedron" => Some(ElementFamily::Quadrilateral),
            "quadratic-quadrilateral" | "quadratic-hexahedron" => Some(ElementFamily::QuadraticQuadrilateral),
            _ => None,
        }
    }

    /// Order of the shape functions.
    pub fn order(self) -> u32 {
        match self {
            ElementFamily::Linear | ElementFamily::Quadrilateral => 1,
            ElementFamily::Quadratic | ElementFamily::QuadraticQuadrilateral => 2,
        }
    }

    /// Name in a scene of this dimension, as [`named`](Self::named) takes it.
    pub fn name(self, dimension: usize) -> &'static str {
        match (self, dimension) {
            (ElementFamily::Linear, _) => "linear",
            (ElementFamily::Quadratic, _) => "quadratic",
            (ElementFamily::Quadrilateral, 2) => "quadrilateral",
            (ElementFamily::Quadrilateral, _) => "hexahedron",
            (ElementFamily::QuadraticQuadrilateral, 2) => "quadratic-quadrilateral",
            (ElementFamily::QuadraticQuadrilateral, _) => "quadratic-hexahedron",
        }
    }

    /// Elements in words.
    pub fn words(self, dimension: usize) -> &'static str {
        match (self, dimension) {
            (ElementFamily::Linear, 2) => "linear triangles",
            (ElementFamily::Linear, _) => "linear tetrahedra",
            (ElementFamily::Quadratic, 2) => "quadratic triangles",
            (ElementFamily::Quadratic, _) => "quadratic tetrahedra",
            (ElementFamily::Quadrilateral, 2) => "quadrilaterals",
            (ElementFamily::Quadrilateral, _) => "hexahedra",
            (ElementFamily::QuadraticQuadrilateral, 2) => "quadratic quadrilaterals",
            (ElementFamily::QuadraticQuadrilateral, _) => "quadratic hexahedra",
        }
    }

    /// Word that the cells of a mesh take, `None` for simplices.
    fn cell(self, dimension: usize) -> Option<&'static str> {
        match self {
            ElementFamily::Linear | ElementFamily::Quadratic => None,
            _ if dimension == 2 => Some("quadrilateral"),
            _ => Some("hexahedron"),
        }
    }
}

/// A key that makes a scene another run.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct RunKey {
    /// Path of the key.
    pub path: String,
    /// Value in TOML, words without quotes; `None` if the key is taken out.
    pub value: Option<String>,
}

impl RunKey {
    fn new(path: String, value: String) -> RunKey {
        RunKey { path, value: Some(value) }
    }

    fn without(path: String) -> RunKey {
        RunKey { path, value: None }
    }

    /// Keys that give `scene` this scheme and step [s].
    pub fn of_pace(scene: &Scene, scheme: &str, step: f64) -> Vec<RunKey> {
        let given =
            [("adaptive", scene.time.adaptive.is_some()), ("arc_length", scene.time.arc_length.is_some())];
        let without = given.iter().filter(|(_, is_given)| *is_given);
        let mut keys: Vec<RunKey> = without.map(|(key, _)| RunKey::without(format!("time.{key}"))).collect();
        keys.push(RunKey::new("time.integrator".into(), scheme.to_owned()));
        keys.push(RunKey::new("time.step".into(), format!("{step:?}")));
        keys
    }
}

impl std::fmt::Display for RunKey {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.value {
            Some(value) if value.contains(' ') => write!(formatter, "--set '{}={value}'", self.path),
            Some(value) => write!(formatter, "--set {}={value}", self.path),
            None => write!(formatter, "without {}", self.path),
        }
    }
}

/// Number of cells relative to a scene's own, along every direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellScale {
    /// Numerator.
    pub times: usize,
    /// Denominator.
    pub parts: usize,
}

impl CellScale {
    /// The scene's own cells.
    pub const ONE: CellScale = CellScale { times: 1, parts: 1 };

    /// `times` as many cells.
    pub fn finer(times: usize) -> CellScale {
        CellScale { times, parts: 1 }
    }

    /// A part of the cells.
    pub fn coarser(parts: usize) -> CellScale {
        CellScale { times: 1, parts }
    }

    /// The number of cells for `n`; `None` if it is not whole.
    fn of(self, n: usize) -> Option<usize> {
        (n * self.times).is_multiple_of(self.parts).then_some(n * self.times / self.parts)
    }
}

/// Bodies of a scene whose meshes have cells.
#[derive(Clone, Debug)]
pub struct CellMeshes {
    dimension: usize,
    bodies: Vec<CellMesh>,
}

/// Mesh of one body.
#[derive(Clone, Debug)]
struct CellMesh {
    body: usize,
    /// Name of the shape.
    shape: String,
    count: CellCount,
}

/// Way in which the number of cells is given.
#[derive(Clone, Debug)]
enum CellCount {
    /// Cells along each direction, and `element` chooses what they are made into.
    Given(Vec<usize>),
    /// The mesh has this many cells, cut as often as `refine` says: quadrilaterals or hexahedra, or
    /// simplices.
    Cut { cells: usize, refine: usize, whole: bool },
}

impl CellScale {
    /// Number of times that cells are halved for a mesh that is cut `refine` times by itself.
    fn cuts(self, refine: usize) -> Option<usize> {
        let times = self.times << refine;
        let is_power = times.is_multiple_of(self.parts) && (times / self.parts).is_power_of_two();
        is_power.then(|| (times / self.parts).ilog2() as usize)
    }
}

impl CellMeshes {
    /// Finds the cells of a scene.
    ///
    /// # Errors
    /// The reason for which another mesh is not the same problem.
    pub fn of(scene: &Scene) -> Result<CellMeshes, String> {
        if scene.contact.is_some() {
            return Err(
                "what touches differs between the meshes: errors with contact are not estimated".into()
            );
        }
        let mut bodies = vec![];
        for (i, body) in scene.body.iter().enumerate() {
            let name = body.name_or_default(i);
            if body.springs.is_some() {
                return Err(format!(
                    "`{name}` has springs, which are no continuum that finer meshes approach"
                ));
            }
            if body.bending.is_some() {
                return Err(format!("bending of `{name}` depends on its triangles"));
            }
            let spec = serde_json::to_value(body).unwrap_or_default();
            let mesh = spec.get("mesh").and_then(Value::as_object);
            let Some((shape, keys)) = mesh.and_then(|mesh| mesh.iter().next()) else { continue };
            let whole = |cells: &Value| cells.as_u64().map(|cells| cells as usize);
            let cells: Option<Vec<usize>> = match keys.get("cells") {
                Some(Value::Array(cells)) => cells.iter().map(whole).collect(),
                Some(number) => whole(number).map(|cells| vec![cells]),
                _ => None,
            };
            let count = match cells {
                Some(cells) => CellCount::Given(cells),
                None => {
                    let cut = |why: String| format!("the mesh of `{name}` ({shape}) cannot be cut: {why}");
                    if matches!(body.mesh, MeshSpec::Surface(_)) {
                        return Err(cut("a surface is embedded in its cells".into()));
                    }
                    let mesh = pliant_mesh::build(&body.mesh, scene.dimension, &scene.directory);
                    let mesh = mesh.map_err(|error| cut(error.to_string()))?;
                    let (cells, whole) = (mesh.element_count(), mesh.block().is_some());
                    if cells == 0 {
                        return Err(cut("it has no cells".into()));
                    }
                    CellCount::Cut { cells, refine: body.refine.unwrap_or(0), whole }
                }
            };
            if names_vertices(&spec) {
                return Err(format!(
                    "`{name}` selects vertices by their numbers, which are others on another mesh: select \
                     them by `box`, `half_space` or a group"
                ));
            }
            bodies.push(CellMesh { body: i, shape: shape.clone(), count });
        }
        if bodies.is_empty() {
            return Err("no body has a mesh of cells".into());
        }
        Ok(CellMeshes { dimension: scene.dimension, bodies })
    }

    /// The scene with other numbers of cells, and other elements in bodies with a strain energy; `None` if
    /// a number is not whole, or a mesh has no such elements.
    pub fn scene(&self, scene: &Scene, scale: CellScale, family: Option<ElementFamily>) -> Option<Scene> {
        let mut scene = scene.clone();
        for CellMesh { body, shape, count } in &self.bodies {
            let body = &mut scene.body[*body];
            let family = family.filter(|_| body.elastic.is_some() && body.membrane.is_none());
            let mut mesh = serde_json::to_value(&body.mesh).ok()?;
            let keys = mesh.get_mut(shape)?.as_object_mut()?;
            match count {
                CellCount::Given(cells) => {
                    let scaled: Vec<usize> = cells.iter().map(|n| scale.of(*n)).collect::<Option<_>>()?;
                    let is_list = matches!(keys.get("cells"), Some(Value::Array(_)));
                    keys.insert("cells".into(), if is_list { json!(scaled) } else { json!(scaled[0]) });
                    if let Some(family) = family {
                        keys.remove("element");
                        if let Some(cell) = family.cell(self.dimension) {
                            keys.insert("element".into(), json!(cell));
                        }
                    }
                }
                CellCount::Cut { refine, whole, .. } => {
                    if family.is_some_and(|family| family.cell(self.dimension).is_some() != *whole) {
                        return None;
                    }
                    body.refine = Some(scale.cuts(*refine)?).filter(|refine| *refine > 0);
                }
            }
            if let Some(family) = family {
                body.order = (family.order() > 1).then_some(2);
                body.serendipity = false;
            }
            body.mesh = serde_json::from_value(mesh).ok()?;
        }
        Some(scene)
    }

    /// Keys that [`scene`](Self::scene) changes.
    pub fn keys(&self, scene: &Scene, scale: CellScale, family: ElementFamily) -> Vec<RunKey> {
        let mut keys = vec![];
        for CellMesh { body, shape, count } in &self.bodies {
            let spec = &scene.body[*body];
            let has_family = spec.elastic.is_some() && spec.membrane.is_none();
            match count {
                CellCount::Given(cells) => {
                    let scaled: Vec<String> =
                        cells.iter().filter_map(|n| scale.of(*n)).map(|n| n.to_string()).collect();
                    let value =
                        if scaled.len() > 1 { format!("[{}]", scaled.join(", ")) } else { scaled.concat() };
                    keys.push(RunKey::new(format!("body.{body}.mesh.{shape}.cells"), value));
                    let element = format!("body.{body}.mesh.{shape}.element");
                    let mesh = serde_json::to_value(&spec.mesh).unwrap_or_default();
                    match family.cell(self.dimension).filter(|_| has_family) {
                        Some(cell) => keys.push(RunKey::new(element, cell.to_owned())),
                        None if has_family && mesh[shape].get("element").is_some() => {
                            keys.push(RunKey::without(element));
                        }
                        None => {}
                    }
                }
                CellCount::Cut { refine, .. } => {
                    let refine = scale.cuts(*refine).unwrap_or(0);
                    if refine > 0 || spec.refine.is_some() {
                        keys.push(RunKey::new(format!("body.{body}.refine"), refine.to_string()));
                    }
                }
            }
            if has_family && (family.order() > 1 || spec.order.is_some()) {
                keys.push(RunKey::new(format!("body.{body}.order"), family.order().to_string()));
            }
            if has_family && spec.serendipity {
                keys.push(RunKey::without(format!("body.{body}.serendipity")));
            }
        }
        keys
    }

    /// Cells of the first body: `8x4`, or their number.
    pub fn words(&self, scale: CellScale) -> String {
        match &self.bodies[0].count {
            CellCount::Given(cells) => {
                let cells = cells.iter().filter_map(|n| scale.of(*n));
                cells.map(|n| n.to_string()).collect::<Vec<_>>().join("x")
            }
            CellCount::Cut { cells, refine, .. } => {
                let cuts = scale.cuts(*refine).unwrap_or(0);
                (cells << (self.dimension * cuts)).to_string()
            }
        }
    }

    /// Number of directions in which cells are halved.
    pub fn directions(&self) -> usize {
        match &self.bodies[0].count {
            CellCount::Given(cells) if cells.len() > 1 => cells.len(),
            _ => self.dimension,
        }
    }

    /// Largest number of parts, at most `most`, a power of 2, that divides all numbers of cells.
    pub fn common_parts(&self, most: usize) -> usize {
        let divides = |parts: usize| {
            self.bodies.iter().all(|body| match &body.count {
                CellCount::Given(cells) => cells.iter().all(|n| n.is_multiple_of(parts)),
                CellCount::Cut { refine, .. } => parts <= 1 << refine,
            })
        };
        std::iter::successors(Some(most), |parts| Some(parts / 2)).find(|parts| divides(*parts)).unwrap_or(1)
    }
}

/// True if a key `vertices` or `vertex` is somewhere in a body.
fn names_vertices(value: &Value) -> bool {
    match value {
        Value::Object(keys) => keys.iter().any(|(key, value)| {
            (matches!(&key[..], "vertices" | "vertex") && !value.is_null()) || names_vertices(value)
        }),
        Value::Array(values) => values.iter().any(names_vertices),
        _ => false,
    }
}
