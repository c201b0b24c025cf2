//! `$PhysicalNames`, `$Entities`, and the named groups they make.

use std::collections::BTreeMap;

use super::cells::{Cells, CellsOf};
use super::nodes::Nodes;
use super::{Entities, Names};
use crate::mesh::file::{FileMesh, GROUPS_AT_ONCE};
use crate::mesh::tokens::{Fault, Tokens, excerpt};
use crate::mesh::{Group, Mesh, MeshError};

/// Reads `dimension tag "name"` lines up to the end of the section.
pub(super) fn names(tokens: &mut Tokens, names: &mut Names) -> Result<(), Fault> {
    let count: u64 = tokens.number("the number of physical names")?;
    for _ in 0..count {
        let dimension: u8 = tokens.number("the dimension of a physical group")?;
        if dimension > 3 {
            let error =
                MeshError::Expected { expected: "a dimension from 0 to 3", found: dimension.to_string() };
            return Err(tokens.fault(error));
        }
        let tag = tokens.number("the tag of a physical group")?;
        let quoted = tokens.rest_of_line();
        match quoted.strip_prefix('"').and_then(|name| name.strip_suffix('"')) {
            Some(name) => names.insert((dimension, tag), name.to_string()),
            None => {
                let error =
                    MeshError::Expected { expected: "a name in double quotes", found: excerpt(quoted) };
                return Err(tokens.fault(error));
            }
        };
    }
    tokens.keyword("$EndPhysicalNames")
}

/// Reads which physical groups every entity is in. A negative tag asks for the opposite orientation, which Gmsh does
/// not apply to the elements of this format; neither do we.
pub(super) fn entities(tokens: &mut Tokens, entities: &mut Entities) -> Result<(), Fault> {
    let mut counts = [0_u64; 4];
    for count in &mut counts {
        *count = tokens.number("the number of entities of one dimension")?;
    }
    for (dimension, &count) in counts.iter().enumerate() {
        for _ in 0..count {
            let tag: i64 = tokens.number("the tag of an entity")?;
            // A point has a position, everything else a bounding box.
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                tokens.number::<f64>("a coordinate of an entity")?;
            }
            let mut groups = Vec::new();
            let physical: u64 = tokens.number("the number of physical groups of an entity")?;
            for _ in 0..physical {
                let group: i64 = tokens.number("the tag of a physical group")?;
                if groups.len() >= GROUPS_AT_ONCE {
                    return Err(tokens.fault(MeshError::TooManyGroups { limit: GROUPS_AT_ONCE }));
                }
                groups.push(group.unsigned_abs());
            }
            if dimension > 0 {
                let bounding: u64 = tokens.number("the number of bounding entities")?;
                for _ in 0..bounding {
                    tokens.number::<i64>("the tag of a bounding entity")?;
                }
            }
            groups.sort_unstable();
            groups.dedup();
            entities.insert((dimension as u8, tag), groups);
        }
    }
    tokens.keyword("$EndEntities")
}

/// Puts nodes, cells and groups together. Groups without a name are called by their number.
pub(super) fn assemble(nodes: Nodes, cells: Cells, names: &Names) -> FileMesh {
    let mut groups = BTreeMap::new();
    // Names of groups without cells stay known, so that a message can tell "empty" from "unknown".
    for ((dimension, _), name) in names {
        let group = Group { topological_dimension: usize::from(*dimension), ..Group::default() };
        groups.insert(name.clone(), group);
    }
    enter(&mut groups, &cells.points, 0, names);
    enter(&mut groups, &cells.lines, 1, names);
    enter(&mut groups, &cells.triangles, 2, names);
    enter(&mut groups, &cells.tetrahedra, 3, names);
    for group in groups.values_mut() {
        for indices in [&mut group.cells, &mut group.vertices] {
            indices.sort_unstable();
            indices.dedup();
        }
    }
    let Cells { lines, triangles, tetrahedra, .. } = cells;
    let mut file = FileMesh { xyz: nodes.xyz, vertices: nodes.places, ..FileMesh::default() };
    file.mesh =
        Mesh { triangles: triangles.vertices, tetrahedra: tetrahedra.vertices, groups, ..Mesh::default() };
    file.triangles = triangles.places;
    file.tetrahedra = tetrahedra.places;
    if file.mesh.triangles.is_empty() && file.mesh.tetrahedra.is_empty() {
        file.mesh.edges = lines.vertices;
        file.edges = lines.places;
    } else {
        file.mesh.lines = lines.vertices;
        file.lines = lines.places;
    }
    file
}

/// Enters the groups of one dimension. Called with ascending dimensions: the highest one's cells stay.
fn enter<const N: usize>(
    groups: &mut BTreeMap<String, Group>,
    cells: &CellsOf<N>,
    dimension: u8,
    names: &Names,
) {
    for (&tag, members) in &cells.groups {
        let name = names.get(&(dimension, tag)).cloned().unwrap_or_else(|| tag.to_string());
        let group = groups.entry(name).or_default();
        if group.topological_dimension != usize::from(dimension) {
            group.cells.clear();
            group.topological_dimension = usize::from(dimension);
        }
        let vertices = members.iter().flat_map(|&cell| cells.vertices[cell as usize]);
        group.vertices.extend(vertices);
        if dimension == 0 {
            group.cells.extend(members.iter().map(|&cell| cells.vertices[cell as usize][0]));
        } else {
            group.cells.extend(members);
        }
    }
}
