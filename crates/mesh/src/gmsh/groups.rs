//! `$PhysicalNames` and `$Entities`: definitions of the named groups.

use super::Entities;
use super::source::GmshSource;
use crate::MeshError;
use crate::cells::Names;
use crate::file::GROUPS_AT_ONCE;
use crate::tokens::{FileFault, Tokens, excerpt};

/// Reads `dimension tag "name"` lines up to the end of the section.
pub(super) fn names(tokens: &mut Tokens, names: &mut Names) -> Result<(), FileFault> {
    let count: u64 = tokens.number("the number of physical names")?;
    for _ in 0..count {
        let dimension: u8 = tokens.number("the dimension of a physical group")?;
        if dimension > 3 {
            let error =
                MeshError::Expected { expected: "a dimension from 0 to 3", found: dimension.to_string() };
            return Err(tokens.fault(error));
        }
        let tag = tokens.number("the tag of a physical group")?;
        // Names may be in any encoding; numbers are ASCII.
        let quoted = String::from_utf8_lossy(tokens.rest_of_line_bytes());
        let quoted = quoted.trim();
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

/// Reads the physical groups of every entity. A negative tag stands for the opposite orientation, which
/// Gmsh does not apply to the elements of this format; neither does this reader.
pub(super) fn entities(source: &mut GmshSource, entities: &mut Entities) -> Result<(), FileFault> {
    source.begin_numbers();
    let mut counts = [0_u64; 4];
    for count in &mut counts {
        *count = source.size("the number of entities of one dimension")?;
    }
    for (dimension, &count) in (0..).zip(&counts) {
        for _ in 0..count {
            let tag = source.int("the tag of an entity")?;
            // A point has a position, other entities have a bounding box.
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                source.real("a coordinate of an entity")?;
            }
            let groups = physical(source)?;
            if dimension > 0 {
                let bounding = source.size("the number of bounding entities")?;
                for _ in 0..bounding {
                    source.int("the tag of a bounding entity")?;
                }
            }
            entities.insert((dimension, tag), groups);
        }
    }
    source.tokens.keyword("$EndEntities")
}

/// Tags of the physical groups of an entity, ascending, each once.
fn physical(source: &mut GmshSource) -> Result<Vec<u64>, FileFault> {
    let mut groups = Vec::new();
    let count = source.size("the number of physical groups of an entity")?;
    for _ in 0..count {
        let group = source.int("the tag of a physical group")?;
        if groups.len() >= GROUPS_AT_ONCE {
            return Err(source.fault(MeshError::TooManyGroups { limit: GROUPS_AT_ONCE }));
        }
        groups.push(group.unsigned_abs());
    }
    groups.sort_unstable();
    groups.dedup();
    Ok(groups)
}
