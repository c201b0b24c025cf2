//! `$PhysicalNames` and `$Entities`: what the named groups are made of.

use super::Entities;
use crate::mesh::MeshError;
use crate::mesh::cells::Names;
use crate::mesh::file::GROUPS_AT_ONCE;
use crate::mesh::tokens::{Fault, Tokens, excerpt};

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
