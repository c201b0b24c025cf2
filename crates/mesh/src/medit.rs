//! Medit `.mesh`, ASCII, versions 1 and 2: P. J. Frey, "MEDIT: An interactive mesh visualization software",
//! INRIA report RT-0253 (2001), appendix.
//!
//! The reader accepts `Vertices`, `Edges`, `Triangles`, `Quadrilaterals`, `Tetrahedra` and `Hexahedra`. Their
//! references become groups `vertex_3`, `edge_3`, `triangle_3`, `hexahedron_3`; equal references of different
//! kinds are unrelated. The reference 0 stands for no group.

use super::FormatError;
use super::cells::{FileCells, Names, block_reference, reference};
use super::file::{FileMesh, MeshInput, Place};
use super::tokens::{FileFault, Tokens};
use pliant::element::{CellKind, HEXAHEDRON, QUADRILATERAL};

/// True for a keyword that begins a section; sections that are not read are skipped up to the next one.
fn begins_section(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_alphabetic()) && word.parse::<f64>().is_err()
}

pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let mut tokens = Tokens::with_comments(input.bytes);
    header(&mut tokens)?;
    let mut mesh = Medit { dimension: 3, ..Medit::default() };
    let mut section = tokens.next();
    while let Some(name) = section {
        section = match name {
            "Dimension" => mesh.dimension(&mut tokens)?,
            "Vertices" => mesh.vertices(&mut tokens)?,
            "Edges" => mesh.cells::<2>(&mut tokens, None)?,
            "Triangles" => mesh.cells::<3>(&mut tokens, None)?,
            "Tetrahedra" => mesh.cells::<4>(&mut tokens, None)?,
            "Quadrilaterals" => mesh.cells::<4>(&mut tokens, Some(QUADRILATERAL.kind))?,
            "Hexahedra" | "Hexaedra" => mesh.cells::<8>(&mut tokens, Some(HEXAHEDRON.kind))?,
            "Prisms" | "Pyramids" | "TrianglesP2" | "TetrahedraP2" | "EdgesP2" => {
                let count: u64 = tokens.number("the number of cells")?;
                if count > 0 {
                    let found = format!("the section {name}");
                    let supported =
                        "write Edges, Triangles, Quadrilaterals, Tetrahedra and Hexahedra of first order";
                    return Err(tokens.fault(FormatError::Unsupported { found, supported }));
                }
                tokens.next()
            }
            "End" => break,
            name if begins_section(name) => skip(&mut tokens),
            name => return Err(tokens.expected("a section such as Vertices", name)),
        };
    }
    let Medit { xyz, places, cells, names, .. } = mesh;
    cells.into_file(xyz, places, &names, input.mid_nodes)
}

fn header(tokens: &mut Tokens) -> Result<(), FileFault> {
    tokens.keyword("MeshVersionFormatted")?;
    let version: u64 = tokens.number("the version of the format, 1 or 2")?;
    if !(1..=3).contains(&version) {
        let found = format!("version {version} of the format");
        return Err(tokens.fault(FormatError::Unsupported { found, supported: "supported are 1 and 2" }));
    }
    Ok(())
}

/// Skips to the word that begins the next section.
fn skip<'a>(tokens: &mut Tokens<'a>) -> Option<&'a str> {
    loop {
        match tokens.next() {
            Some(word) if !begins_section(word) => {}
            next => return next,
        }
    }
}

#[derive(Default)]
struct Medit {
    dimension: usize,
    xyz: Vec<f64>,
    places: Vec<Place>,
    cells: FileCells,
    names: Names,
}

impl Medit {
    fn dimension<'a>(&mut self, tokens: &mut Tokens<'a>) -> Result<Option<&'a str>, FileFault> {
        let expected = "the dimension, 2 or 3";
        self.dimension = tokens.number(expected)?;
        if !(2..=3).contains(&self.dimension) {
            return Err(tokens.expected(expected, &self.dimension.to_string()));
        }
        Ok(tokens.next())
    }

    /// Reads `x y [z] reference`.
    fn vertices<'a>(&mut self, tokens: &mut Tokens<'a>) -> Result<Option<&'a str>, FileFault> {
        let count: u64 = tokens.number("the number of vertices")?;
        for _ in 0..count {
            let axes = ["x of a vertex", "y of a vertex", "z of a vertex"];
            for (axis, expected) in axes.into_iter().enumerate() {
                self.xyz.push(if axis < self.dimension { tokens.number(expected)? } else { 0.0 });
            }
            let place = tokens.place(self.places.len() as u64 + 1);
            let vertex = self.places.len() as u32;
            self.places.push(place);
            let group: i64 = tokens.number("the reference of a vertex")?;
            if group != 0 {
                self.cells.push(&[vertex], place, &[reference(&mut self.names, 0, group)]);
            }
        }
        Ok(tokens.next())
    }

    /// Reads `vertices reference`, with vertices numbered from 1; `None` as kind stands for simplices.
    fn cells<'a, const N: usize>(
        &mut self,
        tokens: &mut Tokens<'a>,
        kind: Option<&'static CellKind>,
    ) -> Result<Option<&'a str>, FileFault> {
        let count: u64 = tokens.number("the number of cells")?;
        for cell in 0..count {
            let mut vertices = [0_u32; N];
            for vertex in &mut vertices {
                let number: i64 = tokens.number("the number of a vertex")?;
                let count = self.places.len() as u64;
                let index = number.checked_sub(1).and_then(|index| u64::try_from(index).ok());
                *vertex = match index {
                    Some(index) if index < count => index as u32,
                    _ => return Err(tokens.fault(FormatError::VertexNumber { number, count, first: 1 })),
                };
            }
            let place = tokens.place(cell + 1);
            let group: i64 = tokens.number("the reference of a cell")?;
            let names = &mut self.names;
            let number = match kind {
                _ if group == 0 => None,
                None => Some(reference(names, N as u8 - 1, group)),
                Some(kind) => Some(block_reference(names, kind, group)),
            };
            match kind {
                None => self.cells.push(&vertices, place, number.as_slice()),
                Some(kind) => self.cells.push_kind(kind, &vertices, place, number.as_slice()),
            }
        }
        Ok(tokens.next())
    }
}
