//! `$Nodes`: positions, and the index of every tag.

use super::Version;
use super::source::GmshSource;
use crate::MeshError;
use crate::file::Place;
use crate::tokens::FileFault;

/// Nodes in order of appearance.
#[derive(Debug, Default)]
pub(super) struct GmshNodes {
    /// Flat `(n, 3)` [m].
    pub xyz: Vec<f64>,
    /// Positions of the nodes in the file.
    pub places: Vec<Place>,
    /// Tag of each node.
    tags: Vec<u64>,
    /// Tag and index, ascending by tag; empty if tags are consecutive, as they nearly always are.
    sorted: Vec<(u64, u32)>,
}

impl GmshNodes {
    /// Index of the node with this tag.
    pub(super) fn index(&self, tag: u64) -> Option<u32> {
        if self.sorted.is_empty() {
            let index = tag.checked_sub(*self.tags.first()?)?;
            (index < self.tags.len() as u64).then_some(index as u32)
        } else {
            let position = self.sorted.binary_search_by_key(&tag, |entry| entry.0).ok()?;
            Some(self.sorted[position].1)
        }
    }

    fn push(&mut self, tag: u64, source: &GmshSource) -> Result<(), FileFault> {
        let count = self.places.len() as u64;
        if count >= u64::from(u32::MAX) {
            return Err(source.fault(MeshError::TooMany { what: "vertices", count: count + 1 }));
        }
        self.places.push(source.place(tag));
        self.tags.push(tag);
        Ok(())
    }

    /// Sorts the tags; two nodes with the same tag are an error.
    fn sort(&mut self) -> Result<(), FileFault> {
        if self.tags.windows(2).all(|pair| pair[0].checked_add(1) == Some(pair[1])) {
            return Ok(());
        }
        self.sorted = self.tags.iter().copied().zip(0..).collect();
        self.sorted.sort_unstable();
        match self.sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            None => Ok(()),
            Some(pair) => {
                let place = self.places[pair[1].1 as usize];
                Err(FileFault::at(place, MeshError::RepeatedNode { node: pair[1].0 }))
            }
        }
    }
}

/// Reads the section up to its end.
pub(super) fn read(source: &mut GmshSource, version: Version) -> Result<GmshNodes, FileFault> {
    let mut nodes = GmshNodes::default();
    match version {
        Version::Two => flat(source, &mut nodes)?,
        Version::Four => blocks(source, &mut nodes)?,
    }
    source.tokens.keyword("$EndNodes")?;
    nodes.sort()?;
    Ok(nodes)
}

/// Reads `count`, then `tag x y z`.
fn flat(source: &mut GmshSource, nodes: &mut GmshNodes) -> Result<(), FileFault> {
    // The count is a text word in binary files too.
    let count: u64 = source.tokens.number("the number of nodes")?;
    source.begin_numbers();
    for _ in 0..count {
        let tag = source.natural("the tag of a node")?;
        nodes.push(tag, source)?;
        position(source, &mut nodes.xyz)?;
    }
    Ok(())
}

fn position(source: &mut GmshSource, xyz: &mut Vec<f64>) -> Result<(), FileFault> {
    for expected in ["x of a node", "y of a node", "z of a node"] {
        xyz.push(source.real(expected)?);
    }
    Ok(())
}

/// Reads blocks of one entity each: `dimension tag parametric count`, the tags, then the positions.
fn blocks(source: &mut GmshSource, nodes: &mut GmshNodes) -> Result<(), FileFault> {
    source.begin_numbers();
    let blocks = source.size("the number of node blocks")?;
    for expected in ["the number of nodes", "the least node tag", "the greatest node tag"] {
        source.size(expected)?;
    }
    for _ in 0..blocks {
        let dimension = source.natural("the dimension of an entity")?;
        source.int("the tag of an entity")?;
        let parametric = source.natural("0, or 1 for parametric coordinates")?;
        let count = source.size("the number of nodes in the block")?;
        let first = nodes.places.len();
        for _ in 0..count {
            let tag = source.size("the tag of a node")?;
            nodes.push(tag, source)?;
        }
        for node in first..nodes.places.len() {
            position(source, &mut nodes.xyz)?;
            // Most errors of a node are errors of its position.
            nodes.places[node] = source.place(nodes.tags[node]);
            // A node also has its parameters: one on a curve, two on a surface, three in a volume.
            let parameters = if parametric == 0 { 0 } else { dimension.min(3) };
            for _ in 0..parameters {
                source.real("a parametric coordinate")?;
            }
        }
    }
    Ok(())
}
