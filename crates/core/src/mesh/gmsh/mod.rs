//! Gmsh `.msh`, versions 2.2 and 4.1, ASCII: <https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format>.
//!
//! `$MeshFormat`, `$PhysicalNames`, `$Entities`, `$Nodes` and `$Elements` are read, in that order, every other section
//! is passed over. Nodes are numbered in order of appearance, whatever their tags. Cells are of first or second order.

mod elements;
mod groups;
mod nodes;

use std::collections::BTreeMap;

use super::MeshError;
use super::cells::{Cells, Names};
use super::file::{FileMesh, Input};
use super::tokens::{Fault, Tokens, excerpt};
use nodes::Nodes;

/// Layout of the sections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Version {
    /// 2.2: each element carries its tags.
    Two,
    /// 4.1: elements and nodes come in blocks, one per entity of the geometry.
    Four,
}

/// Tags of physical groups by dimension and tag of the entity.
type Entities = BTreeMap<(u8, i64), Vec<u64>>;

/// Reads the whole file.
pub(super) fn read(input: &Input) -> Result<FileMesh, Fault> {
    // Names may be in any encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(input.bytes);
    let mut tokens = Tokens::new(&text);
    tokens.keyword("$MeshFormat")?;
    let version = header(&mut tokens)?;
    let mut names = Names::new();
    let mut entities = Entities::new();
    let mut nodes: Option<Nodes> = None;
    let mut cells: Option<Cells> = None;
    while let Some(section) = tokens.next() {
        match section {
            "$PhysicalNames" => groups::names(&mut tokens, &mut names)?,
            "$Entities" if version == Version::Four => groups::entities(&mut tokens, &mut entities)?,
            "$Nodes" if nodes.is_none() => nodes = Some(nodes::read(&mut tokens, version)?),
            "$Elements" if cells.is_none() => {
                let nodes = nodes.as_ref().ok_or_else(|| {
                    tokens.fault(MeshError::MissingSection { section: "$Nodes before $Elements" })
                })?;
                cells = Some(elements::read(&mut tokens, version, nodes, &entities, input.mid_nodes)?);
            }
            "$Nodes" | "$Elements" => {
                return Err(tokens.fault(MeshError::Expected {
                    expected: "each of the sections $Nodes and $Elements once",
                    found: section.to_string(),
                }));
            }
            _ => skip(&mut tokens, section)?,
        }
    }
    let missing = |section| tokens.fault(MeshError::MissingSection { section });
    let nodes = nodes.ok_or_else(|| missing("$Nodes"))?;
    let mut cells = cells.ok_or_else(|| missing("$Elements"))?;
    if version == Version::Two {
        cells.merge_repeated();
    }
    cells.into_file(nodes.xyz, nodes.places, &names, input.mid_nodes)
}

/// `version file-type data-size`.
fn header(tokens: &mut Tokens) -> Result<Version, Fault> {
    let word = tokens.word("a format version")?;
    let version = match word {
        "2.2" => Version::Two,
        "4.1" => Version::Four,
        _ => return Err(tokens.fault(MeshError::GmshVersion { version: excerpt(word) })),
    };
    match tokens.word("the file type, 0 for ASCII")? {
        "0" => {}
        "1" => return Err(tokens.fault(MeshError::Binary)),
        word => {
            let error = MeshError::Expected { expected: "the file type, 0 for ASCII", found: excerpt(word) };
            return Err(tokens.fault(error));
        }
    }
    tokens.number::<u64>("the size of a real number, 8")?;
    tokens.keyword("$EndMeshFormat")?;
    Ok(version)
}

/// Passes over a section that says nothing about the shape, such as `$PartitionedEntities`.
fn skip(tokens: &mut Tokens, section: &str) -> Result<(), Fault> {
    let Some(name) = section.strip_prefix('$') else {
        let error = MeshError::Expected {
            expected: "the start of a section such as $Nodes",
            found: excerpt(section),
        };
        return Err(tokens.fault(error));
    };
    while let Some(word) = tokens.next() {
        if word.strip_prefix("$End") == Some(name) {
            return Ok(());
        }
    }
    Err(tokens.fault(MeshError::EndOfFile { expected: "the end of a section" }))
}
