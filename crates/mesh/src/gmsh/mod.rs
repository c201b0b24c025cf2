//! Gmsh `.msh`, versions 2.1, 2.2 and 4.1, ASCII and binary:
//! <https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format>.
//!
//! The reader accepts `$MeshFormat`, `$PhysicalNames`, `$Entities`, `$Nodes` and `$Elements`, in that order,
//! and ignores every other section. Nodes are numbered in order of appearance, whatever their tags. Cells are
//! of first or second order.

mod elements;
mod groups;
mod nodes;
mod source;

use std::collections::BTreeMap;

use super::MeshError;
use super::cells::{FileCells, Names};
use super::file::{FileMesh, MeshInput};
use super::tokens::{FileFault, excerpt};
use nodes::GmshNodes;
use source::GmshSource;

/// Version of the layout of the sections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Version {
    /// 2.1 and 2.2: each element carries its tags.
    Two,
    /// 4.1: elements and nodes come in blocks, one per entity of the geometry.
    Four,
}

/// Tags of physical groups by dimension and tag of the entity.
type Entities = BTreeMap<(u64, i64), Vec<u64>>;

pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let mut source = GmshSource::new(input.bytes);
    let version = header(&mut source)?;
    let mut names = Names::new();
    let mut entities = Entities::new();
    let mut nodes: Option<GmshNodes> = None;
    let mut cells: Option<FileCells> = None;
    while let Some(section) = source.tokens.next() {
        match section {
            "$PhysicalNames" => groups::names(&mut source.tokens, &mut names)?,
            "$Entities" if version == Version::Four => groups::entities(&mut source, &mut entities)?,
            "$Nodes" if nodes.is_none() => nodes = Some(nodes::read(&mut source, version)?),
            "$Elements" if cells.is_none() => {
                let nodes = nodes.as_ref().ok_or_else(|| {
                    source.fault(MeshError::MissingSection { section: "$Nodes before $Elements" })
                })?;
                cells = Some(elements::read(&mut source, version, nodes, &entities, input.mid_nodes)?);
            }
            "$Nodes" | "$Elements" => {
                return Err(source
                    .tokens
                    .expected("each of the sections $Nodes and $Elements once", section));
            }
            _ => match section.strip_prefix('$') {
                // Other sections, such as `$PartitionedEntities`, do not describe the shape.
                Some(name) => source.skip_section(name)?,
                None => return Err(source.tokens.expected("the start of a section such as $Nodes", section)),
            },
        }
    }
    let missing = |section| source.fault(MeshError::MissingSection { section });
    let nodes = nodes.ok_or_else(|| missing("$Nodes"))?;
    let mut cells = cells.ok_or_else(|| missing("$Elements"))?;
    if version == Version::Two {
        cells.merge_repeated();
    }
    cells.into_file(nodes.xyz, nodes.places, &names, input.mid_nodes)
}

/// Reads `$MeshFormat`, `version file-type data-size`, in a binary file the integer 1, `$EndMeshFormat`.
fn header(source: &mut GmshSource) -> Result<Version, FileFault> {
    let tokens = &mut source.tokens;
    if tokens.clone().next() == Some("$NOD") {
        // Version 1 has no header.
        tokens.next();
        return Err(tokens.fault(MeshError::GmshVersion { version: "1".to_string() }));
    }
    tokens.keyword("$MeshFormat")?;
    let word = tokens.word("a format version")?;
    let version = match word {
        "2.1" | "2.2" => Version::Two,
        "4.1" => Version::Four,
        _ => return Err(tokens.fault(MeshError::GmshVersion { version: excerpt(word) })),
    };
    let expected = "the file type, 0 for ASCII or 1 for binary";
    let binary = match tokens.word(expected)? {
        "0" => false,
        "1" => true,
        word => return Err(tokens.expected(expected, word)),
    };
    let size = tokens.number::<u64>("the size of a number, 8")?;
    if binary {
        let size = if version == Version::Two { source::double_size(source, size)? } else { size };
        source.set_binary(size)?;
    }
    source.tokens.keyword("$EndMeshFormat")?;
    Ok(version)
}
