//! STL, ASCII and binary: facets in space.
//!
//! Read here and not with the `stl_io` crate: that one reports neither the line nor the offset of a fault.

use std::collections::HashMap;

use super::FormatError;
use super::cells::{Cells, Names};
use super::file::{FileMesh, Input};
use super::number_type::{Endian, NumberType};
use super::tokens::{Fault, Tokens, excerpt};

/// Bytes before the facets of a binary file: 80 of any content, and their number.
const HEADER: u64 = 84;
/// Bytes of a facet: normal, three vertices, two bytes that nobody agrees on.
const FACET: u64 = 50;

/// Reads the facets. Corners with the same coordinates, bit by bit, become one vertex; nothing else is merged. Normals
/// are passed over. The solids of an ASCII file that have a name become groups.
pub(super) fn read(input: &Input) -> Result<FileMesh, Fault> {
    let length = input.bytes.len() as u64;
    let announced = input.bytes.get(80..84).map(|bytes| NumberType::U32.decode(bytes, Endian::Little) as u64);
    // Binary files may begin with "solid" too; an ASCII file of just this length does not exist.
    let is_binary = announced.is_some_and(|facets| HEADER + FACET * facets == length);
    let mut surface = Surface::default();
    if is_binary || !input.bytes.trim_ascii_start().starts_with(b"solid") {
        binary(Tokens::of_bytes(input.bytes), &mut surface)?;
    } else {
        ascii(Tokens::of_bytes(input.bytes), &mut surface)?;
    }
    let Surface { xyz, places, cells, names, .. } = surface;
    cells.into_file(xyz, places, &names, input.mid_nodes)
}

#[derive(Default)]
struct Surface {
    xyz: Vec<f64>,
    places: Vec<super::file::Place>,
    /// Index of the vertex with these coordinates.
    known: HashMap<[u64; 3], u32>,
    cells: Cells,
    names: Names,
}

impl Surface {
    /// The vertex at this point.
    fn vertex(&mut self, tokens: &Tokens, x: [f64; 3]) -> Result<u32, Fault> {
        if let Some(&value) = x.iter().find(|x| !x.is_finite()) {
            return Err(tokens.fault(FormatError::NotFinite { value }));
        }
        // The sum makes 0 of -0.
        let key = x.map(|x| (x + 0.0).to_bits());
        let next = self.places.len() as u32;
        let vertex = *self.known.entry(key).or_insert(next);
        if vertex == next {
            self.xyz.extend(x);
            self.places.push(tokens.place(0));
        }
        Ok(vertex)
    }
}

fn binary(mut tokens: Tokens, surface: &mut Surface) -> Result<(), Fault> {
    tokens.set_binary();
    tokens.take(80, "the header")?;
    let count = NumberType::U32.decode(tokens.take(4, "the number of facets")?, Endian::Little) as u64;
    let found = tokens.remaining() as u64;
    if found != FACET * count {
        let what = "bytes after the number of facets";
        return Err(tokens.fault(FormatError::Count { what, expected: FACET * count, found }));
    }
    for _ in 0..count {
        let facet = tokens.take(FACET, "a facet")?;
        let mut corners = [0; 3];
        for (corner, bytes) in corners.iter_mut().zip(facet[12..48].as_chunks::<12>().0) {
            let coordinate = |axis: usize| NumberType::F32.decode(&bytes[4 * axis..], Endian::Little);
            *corner = surface.vertex(&tokens, [coordinate(0), coordinate(1), coordinate(2)])?;
        }
        surface.cells.push(&corners, tokens.place(0), &[]);
    }
    Ok(())
}

fn ascii(mut tokens: Tokens, surface: &mut Surface) -> Result<(), Fault> {
    while let Some(word) = tokens.next() {
        if !word.eq_ignore_ascii_case("solid") {
            return Err(tokens.expected("solid", word));
        }
        let name = tokens.rest_of_line();
        let solid = surface.names.len() as u64 + 1;
        let groups = [solid];
        let groups = if name.is_empty() { &[][..] } else { &groups };
        if !name.is_empty() {
            surface.names.insert((2, solid), name.to_string());
        }
        loop {
            let word = tokens.word("facet or endsolid")?;
            if word.eq_ignore_ascii_case("endsolid") {
                tokens.rest_of_line();
                break;
            }
            if !word.eq_ignore_ascii_case("facet") {
                return Err(tokens.expected("facet or endsolid", word));
            }
            let place = tokens.place(0);
            keyword(&mut tokens, "normal")?;
            for _ in 0..3 {
                tokens.number::<f64>("a component of the normal")?;
            }
            keyword(&mut tokens, "outer")?;
            keyword(&mut tokens, "loop")?;
            let mut corners = [0; 3];
            for corner in &mut corners {
                keyword(&mut tokens, "vertex")?;
                let mut x = [0.0; 3];
                for (x, expected) in x.iter_mut().zip(["x of a vertex", "y of a vertex", "z of a vertex"]) {
                    *x = tokens.number(expected)?;
                }
                *corner = surface.vertex(&tokens, x)?;
            }
            keyword(&mut tokens, "endloop")?;
            keyword(&mut tokens, "endfacet")?;
            surface.cells.push(&corners, place, groups);
        }
    }
    Ok(())
}

/// The next word, which must be this one in any case.
fn keyword(tokens: &mut Tokens, expected: &'static str) -> Result<(), Fault> {
    let word = tokens.word(expected)?;
    if word.eq_ignore_ascii_case(expected) { Ok(()) } else { Err(tokens.expected(expected, &excerpt(word))) }
}
