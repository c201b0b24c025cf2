//! `$Nodes`: positions, and the index of every tag.

use super::Version;
use crate::mesh::MeshError;
use crate::mesh::file::Place;
use crate::mesh::tokens::{Fault, Tokens};

/// Nodes in order of appearance.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    /// Flat `(n, 3)` [m].
    pub xyz: Vec<f64>,
    /// Tag and line of each.
    pub places: Vec<Place>,
    /// Tag and index, ascending; empty where tags are consecutive, as they nearly always are.
    sorted: Vec<(u64, u32)>,
}

impl Nodes {
    /// Index of the node with this tag.
    pub(super) fn index(&self, tag: u64) -> Option<u32> {
        if self.sorted.is_empty() {
            let index = tag.checked_sub(self.places.first()?.tag)?;
            (index < self.places.len() as u64).then_some(index as u32)
        } else {
            let position = self.sorted.binary_search_by_key(&tag, |entry| entry.0).ok()?;
            Some(self.sorted[position].1)
        }
    }

    fn push(&mut self, tag: u64, tokens: &Tokens) -> Result<(), Fault> {
        let count = self.places.len() as u64;
        if count >= u64::from(u32::MAX) {
            return Err(tokens.fault(MeshError::TooMany { what: "vertices", count: count + 1 }));
        }
        self.places.push(Place { tag, line: tokens.line });
        Ok(())
    }

    /// Makes tags findable; two nodes with the same tag are a fault.
    fn sort(&mut self) -> Result<(), Fault> {
        if self.places.windows(2).all(|pair| pair[0].tag.checked_add(1) == Some(pair[1].tag)) {
            return Ok(());
        }
        self.sorted = self.places.iter().enumerate().map(|(i, place)| (place.tag, i as u32)).collect();
        self.sorted.sort_unstable();
        match self.sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            None => Ok(()),
            Some(pair) => {
                let line = self.places[pair[1].1 as usize].line;
                Err(Fault::in_line(line, MeshError::RepeatedNode { node: pair[1].0 }))
            }
        }
    }
}

/// Reads the section up to its end.
pub(super) fn read(tokens: &mut Tokens, version: Version) -> Result<Nodes, Fault> {
    let mut nodes = Nodes::default();
    match version {
        Version::Two => {
            let count: u64 = tokens.number("the number of nodes")?;
            for _ in 0..count {
                let tag = tokens.number("the tag of a node")?;
                nodes.push(tag, tokens)?;
                position(tokens, &mut nodes.xyz)?;
            }
        }
        Version::Four => blocks(tokens, &mut nodes)?,
    }
    tokens.keyword("$EndNodes")?;
    nodes.sort()?;
    Ok(nodes)
}

fn position(tokens: &mut Tokens, xyz: &mut Vec<f64>) -> Result<(), Fault> {
    for expected in ["x of a node", "y of a node", "z of a node"] {
        xyz.push(tokens.number(expected)?);
    }
    Ok(())
}

/// Blocks of one entity each: `dimension tag parametric count`, the tags, then the positions.
fn blocks(tokens: &mut Tokens, nodes: &mut Nodes) -> Result<(), Fault> {
    let blocks: u64 = tokens.number("the number of node blocks")?;
    for expected in ["the number of nodes", "the least node tag", "the greatest node tag"] {
        tokens.number::<u64>(expected)?;
    }
    for _ in 0..blocks {
        let dimension: u8 = tokens.number("the dimension of an entity")?;
        tokens.number::<i64>("the tag of an entity")?;
        let parametric: u8 = tokens.number("0, or 1 for parametric coordinates")?;
        let count: u64 = tokens.number("the number of nodes in the block")?;
        let first = nodes.places.len();
        for _ in 0..count {
            let tag = tokens.number("the tag of a node")?;
            nodes.push(tag, tokens)?;
        }
        for place in first..nodes.places.len() {
            position(tokens, &mut nodes.xyz)?;
            // Faults of a node are most likely faults of its position.
            nodes.places[place].line = tokens.line;
            // A node on a curve repeats its place as one parameter, on a surface as two, in a volume as three.
            let parameters = if parametric == 0 { 0 } else { dimension.min(3) };
            for _ in 0..parameters {
                tokens.number::<f64>("a parametric coordinate")?;
            }
        }
    }
    Ok(())
}
