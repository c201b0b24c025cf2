//! STL, ASCII and binary: facets in space.
//!
//! This reader replaces the `stl_io` crate, which reports neither the line nor the offset of an error.

use std::collections::HashMap;

use super::FormatError;
use super::cells::{FileCells, Names};
use super::file::{FileMesh, MeshInput, without_mark};
use super::number_type::{Endian, NumberType};
use super::tokens::{FileFault, Tokens, excerpt};

/// Size of the header of a binary file [bytes]: 80 with arbitrary content, and the number of facets.
const HEADER: u64 = 84;
/// Size of a facet [bytes]: normal, three vertices, two bytes without agreed meaning.
const FACET: u64 = 50;

/// Reads the facets. Corners with bit-identical coordinates become one vertex; nothing else is merged.
/// Normals are skipped. Named solids of an ASCII file become groups.
pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let mut surface = Surface::default();
    if is_binary(input.bytes) {
        binary(Tokens::of_bytes(input.bytes), &mut surface)?;
    } else {
        ascii(Tokens::of_bytes(input.bytes), &mut surface)?;
    }
    let Surface { xyz, places, cells, names, .. } = surface;
    cells.into_file(xyz, places, &names, input.mid_nodes)
}

/// True for a binary file, which may begin with "solid" too. No ASCII file has exactly the length that
/// its bytes 80 to 83 would announce. If the length does not fit, a file that begins with "solid" and has
/// no zero byte is ASCII.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    let announced = bytes.get(80..84).map(|bytes| NumberType::U32.decode(bytes, Endian::Little) as u64);
    let fits = announced.is_some_and(|facets| HEADER + FACET * facets == bytes.len() as u64);
    let start = without_mark(bytes).trim_ascii_start();
    let is_text =
        start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !start.contains(&0);
    fits || !is_text
}

#[derive(Default)]
struct Surface {
    xyz: Vec<f64>,
    places: Vec<super::file::Place>,
    /// Index of the vertex, by its coordinates' bits.
    known: HashMap<[u64; 3], u32>,
    cells: FileCells,
    names: Names,
}

impl Surface {
    /// Index of the vertex at this point.
    fn vertex(&mut self, tokens: &Tokens, x: [f64; 3]) -> Result<u32, FileFault> {
        if let Some(&value) = x.iter().find(|x| !x.is_finite()) {
            return Err(tokens.fault(FormatError::NotFinite { value }));
        }
        // Adding 0.0 turns -0 into 0.
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

fn binary(mut tokens: Tokens, surface: &mut Surface) -> Result<(), FileFault> {
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

/// Reads solids until the end of the text. Writers differ in the case of words, write `end solid` for
/// `endsolid`, omit the normal or write NaN for it.
fn ascii(mut tokens: Tokens, surface: &mut Surface) -> Result<(), FileFault> {
    while let Some(word) = tokens.next() {
        if !word.eq_ignore_ascii_case("solid") {
            return Err(tokens.expected("solid", word));
        }
        solid(&mut tokens, surface)?;
    }
    Ok(())
}

/// Reads the rest of a solid: name and facets.
fn solid(tokens: &mut Tokens, surface: &mut Surface) -> Result<(), FileFault> {
    let name = tokens.rest_of_line();
    let number = surface.names.len() as u64 + 1;
    let groups = [number];
    let groups = if name.is_empty() { &[][..] } else { &groups };
    if !name.is_empty() {
        surface.names.insert((2, number), name.to_string());
    }
    let expected = "facet or endsolid";
    loop {
        let word = tokens.word(expected)?;
        if word.eq_ignore_ascii_case("facet") {
            let place = tokens.place(0);
            let corners = facet(tokens, surface)?;
            surface.cells.push(&corners, place, groups);
        } else if is_end(tokens, word, "solid") {
            tokens.rest_of_line();
            return Ok(());
        } else {
            return Err(tokens.expected(expected, word));
        }
    }
}

/// Reads the rest of a facet: normal, which is ignored, and corners.
fn facet(tokens: &mut Tokens, surface: &mut Surface) -> Result<[u32; 3], FileFault> {
    let mut word = tokens.word("normal")?;
    if word.eq_ignore_ascii_case("normal") {
        for _ in 0..3 {
            tokens.word("a component of the normal")?;
        }
        word = tokens.word("outer")?;
    }
    if word.eq_ignore_ascii_case("outer") {
        keyword(tokens, "loop")?;
    } else if !word.eq_ignore_ascii_case("outerloop") {
        return Err(tokens.expected("outer loop", word));
    }
    let mut corners = [0; 3];
    for corner in &mut corners {
        keyword(tokens, "vertex")?;
        let mut x = [0.0; 3];
        for (x, expected) in x.iter_mut().zip(["x of a vertex", "y of a vertex", "z of a vertex"]) {
            *x = tokens.number(expected)?;
        }
        *corner = surface.vertex(tokens, x)?;
    }
    end(tokens, "loop", "endloop")?;
    end(tokens, "facet", "endfacet")?;
    Ok(corners)
}

/// Reads a word, which must be `expected` in any case.
fn keyword(tokens: &mut Tokens, expected: &'static str) -> Result<(), FileFault> {
    let word = tokens.word(expected)?;
    if word.eq_ignore_ascii_case(expected) { Ok(()) } else { Err(tokens.expected(expected, &excerpt(word))) }
}

/// Reads the end of `what`, in one word or two.
fn end(tokens: &mut Tokens, what: &str, expected: &'static str) -> Result<(), FileFault> {
    let word = tokens.word(expected)?;
    if is_end(tokens, word, what) { Ok(()) } else { Err(tokens.expected(expected, word)) }
}

/// True if `word`, or `word` and the next one (which is then consumed), end `what`.
fn is_end(tokens: &mut Tokens, word: &str, what: &str) -> bool {
    let Some((start, rest)) = word.split_at_checked(3) else { return false };
    if !start.eq_ignore_ascii_case("end") {
        return false;
    }
    rest.eq_ignore_ascii_case(what)
        || rest.is_empty() && tokens.next().is_some_and(|next| next.eq_ignore_ascii_case(what))
}
