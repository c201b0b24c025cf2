//! Scenes whose meshes are coarser: half the cells, a quarter of them.

use pliant_scene::{MeshSpec, Scene};
use serde_json::Value;

/// Paths of the numbers of cells of all bodies of a scene, with their values.
pub(super) struct CellCounts(Vec<(String, Vec<usize>)>);

impl CellCounts {
    /// Finds the cells of a scene.
    ///
    /// # Errors
    /// The reason for which a coarser mesh is not the same body.
    pub(super) fn of(scene: &Scene) -> Result<CellCounts, String> {
        if scene.contact.is_some() {
            return Err(
                "what touches differs between the meshes: errors with contact are not estimated".into()
            );
        }
        let mut counts = vec![];
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
            let cells: Option<Vec<usize>> = match keys.get("cells") {
                Some(Value::Array(cells)) => {
                    cells.iter().map(|cells| cells.as_u64().map(|cells| cells as usize)).collect()
                }
                Some(Value::Number(cells)) => cells.as_u64().map(|cells| vec![cells as usize]),
                _ => None,
            };
            let Some(cells) = cells.filter(|_| !matches!(body.mesh, MeshSpec::Disk(_))) else {
                return Err(format!(
                    "the mesh of `{name}` ({shape}) has no number of cells that can be halved"
                ));
            };
            if names_vertices(&spec) {
                return Err(format!(
                    "`{name}` selects vertices by their numbers, which are others on another mesh: select \
                     them by `box`, `half_space` or a group"
                ));
            }
            counts.push((format!("body.{i}.mesh.{shape}.cells"), cells));
        }
        if counts.is_empty() {
            return Err("no body has a mesh of cells".into());
        }
        Ok(CellCounts(counts))
    }

    /// Changes that divide the cells along every direction by `divisor`; `None` if it does not divide all.
    pub(super) fn divided(&self, divisor: usize) -> Option<Vec<(String, String)>> {
        let change = |(path, cells): &(String, Vec<usize>)| {
            let divided: Option<Vec<String>> =
                cells.iter().map(|n| (n % divisor == 0).then(|| (n / divisor).to_string())).collect();
            let divided = divided?;
            let value =
                if cells.len() == 1 { divided[0].clone() } else { format!("[{}]", divided.join(", ")) };
            Some((path.clone(), value))
        };
        self.0.iter().map(change).collect()
    }

    /// Cells of the first body over `divisor`, as `8x4`.
    pub(super) fn words(&self, divisor: usize) -> String {
        let cells: Vec<String> = self.0[0].1.iter().map(|n| (n / divisor).to_string()).collect();
        cells.join("x")
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
