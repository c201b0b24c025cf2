//! Legacy VTK, ASCII and binary, versions up to 5.1:
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>.
//!
//! The reader accepts `UNSTRUCTURED_GRID` and `POLYDATA`, up to their data arrays, which do not describe the
//! shape. It replaces the `vtkio` crate, whose messages name neither the line nor the cell of an error, and
//! which has a dozen dependencies.

use super::cells::{FileCells, Names};
use super::file::{FileMesh, MeshInput, Place};
use super::number_type::{Endian, NumberType};
use super::tokens::{FileFault, Tokens};
use super::vtk_cells::{self, ListKind};
use super::{FormatError, MeshError};

/// Reads the whole file.
pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let mut tokens = Tokens::of_bytes(input.bytes);
    let VtkHeader { binary, modern, unstructured } = header(&mut tokens)?;
    let mut grid = VtkGrid { tokens, binary, modern, ..VtkGrid::new(input.bytes) };
    while let Some(section) = grid.tokens.next() {
        match section {
            "POINTS" => grid.points()?,
            "CELLS" => grid.cells = grid.lists()?,
            "CELL_TYPES" => grid.types()?,
            "VERTICES" => grid.typed(ListKind::Vertices)?,
            "LINES" => grid.typed(ListKind::Lines)?,
            "POLYGONS" => grid.typed(ListKind::Polygons)?,
            "FIELD" => grid.field()?,
            // Data arrays come last.
            "POINT_DATA" | "CELL_DATA" => break,
            "TRIANGLE_STRIPS" => {
                let supported = "write triangles as POLYGONS";
                return Err(grid.unsupported("the section TRIANGLE_STRIPS".into(), supported));
            }
            word => return Err(grid.tokens.expected("a section such as POINTS or CELLS", word)),
        }
    }
    for (missing, section) in
        [(grid.points.is_none(), "POINTS"), (unstructured && grid.types.is_none(), "CELL_TYPES")]
    {
        if missing {
            return Err(grid.tokens.fault(MeshError::MissingSection { section }));
        }
    }
    grid.finish(input)
}

/// Contents of the first lines.
struct VtkHeader {
    /// True if numbers are binary.
    binary: bool,
    /// True if cells are lists with offsets, as since version 5.
    modern: bool,
    /// True for an unstructured grid, which must have cells; false for polygonal data, which may have
    /// none.
    unstructured: bool,
}

fn header(tokens: &mut Tokens) -> Result<VtkHeader, FileFault> {
    let version = tokens.end_line();
    let Some(version) = version.strip_prefix("# vtk DataFile Version ") else {
        return Err(FileFault::in_line(1, expected("# vtk DataFile Version", version)));
    };
    let modern = version.trim().split('.').next().and_then(|major| major.parse::<u32>().ok());
    let modern = modern.ok_or_else(|| FileFault::in_line(1, expected("a version such as 4.2", version)))?;
    tokens.end_line();
    let binary = match tokens.word("ASCII or BINARY")? {
        "ASCII" => false,
        "BINARY" => true,
        word => return Err(tokens.expected("ASCII or BINARY", word)),
    };
    tokens.keyword("DATASET")?;
    let dataset = tokens.word("the type of the dataset")?;
    if !matches!(dataset, "UNSTRUCTURED_GRID" | "POLYDATA") {
        let found = format!("the dataset {dataset}");
        let supported = "supported are UNSTRUCTURED_GRID and POLYDATA";
        return Err(tokens.fault(FormatError::Unsupported { found, supported }));
    }
    if binary {
        tokens.set_binary();
    }
    Ok(VtkHeader { binary, modern: modern >= 5, unstructured: dataset == "UNSTRUCTURED_GRID" })
}

fn expected(expected: &'static str, found: &str) -> MeshError {
    MeshError::Expected { expected, found: super::tokens::excerpt(found) }
}

fn number_type(tokens: &Tokens, name: &str) -> Result<NumberType, FileFault> {
    Ok(match name {
        "char" => NumberType::I8,
        "unsigned_char" => NumberType::U8,
        "short" => NumberType::I16,
        "unsigned_short" => NumberType::U16,
        "int" => NumberType::I32,
        "unsigned_int" => NumberType::U32,
        // VTK writes this type with 32 bits.
        "vtkIdType" => NumberType::I32,
        "long" | "vtktypeint64" => NumberType::I64,
        "unsigned_long" | "vtktypeuint64" => NumberType::U64,
        "float" => NumberType::F32,
        "double" => NumberType::F64,
        word => return Err(tokens.expected("a type such as double or int", word)),
    })
}

/// Numbers, and the position of each `stride`th one.
#[derive(Default)]
struct VtkNumbers {
    values: Vec<f64>,
    places: Vec<Place>,
}

/// Vertices of all cells, concatenated.
#[derive(Default)]
struct Lists {
    vertices: Vec<f64>,
    places: Vec<Place>,
    /// Start of each cell, and the end of the last.
    offsets: Vec<usize>,
}

struct VtkGrid<'a> {
    tokens: Tokens<'a>,
    binary: bool,
    modern: bool,
    points: Option<VtkNumbers>,
    cells: Lists,
    types: Option<VtkNumbers>,
    /// Cells of `POLYDATA`.
    typed: Vec<(ListKind, Lists)>,
}

impl<'a> VtkGrid<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        VtkGrid {
            tokens: Tokens::of_bytes(bytes),
            binary: false,
            modern: false,
            points: None,
            cells: Lists::default(),
            types: None,
            typed: Vec::new(),
        }
    }

    fn unsupported(&self, found: String, supported: &'static str) -> FileFault {
        self.tokens.fault(FormatError::Unsupported { found, supported })
    }

    fn count(&self, what: &'static str, expected: u64, found: u64) -> Result<(), FileFault> {
        if expected == found {
            Ok(())
        } else {
            Err(self.tokens.fault(FormatError::Count { what, expected, found }))
        }
    }

    /// Reads the next `count` numbers.
    fn numbers(&mut self, kind: NumberType, count: u64, stride: usize) -> Result<VtkNumbers, FileFault> {
        let expected = "a number";
        let mut numbers = VtkNumbers::default();
        if self.binary {
            self.tokens.end_line();
        }
        for i in 0..count {
            numbers.values.push(if self.binary {
                kind.decode(self.tokens.take(kind.size() as u64, expected)?, Endian::Big)
            } else {
                self.tokens.number(expected)?
            });
            if i.is_multiple_of(stride as u64) {
                numbers.places.push(self.tokens.place(0));
            }
        }
        Ok(numbers)
    }

    /// Reads `POINTS n type`.
    fn points(&mut self) -> Result<(), FileFault> {
        let count: u64 = self.tokens.number("the number of points")?;
        let name = self.tokens.word("the type of the coordinates")?;
        let kind = number_type(&self.tokens, name)?;
        self.points = Some(self.numbers(kind, count.saturating_mul(3), 3)?);
        self.pass_metadata(3);
        Ok(())
    }

    /// Skips the metadata that may follow an array: `METADATA`, a name for each component (which may be
    /// an empty line), then other lines up to an empty one.
    fn pass_metadata(&mut self, components: u64) {
        let before = self.tokens.clone();
        if self.tokens.next() != Some("METADATA") {
            self.tokens = before;
            return;
        }
        self.tokens.end_line();
        loop {
            match self.tokens.end_line() {
                "" => return,
                "COMPONENT_NAMES" => {
                    for _ in 0..components.min(self.tokens.remaining() as u64) {
                        self.tokens.end_line();
                    }
                }
                _ => {}
            }
        }
    }

    /// Reads `CELLS n size` and for each cell the number of its vertices and the vertices; from version 5
    /// on `CELLS n size` with `n` offsets and `size` vertices.
    fn lists(&mut self) -> Result<Lists, FileFault> {
        let count: u64 = self.tokens.number("the number of cells")?;
        let size: u64 = self.tokens.number("the size of the list of cells")?;
        if self.modern { self.by_offsets(count, size) } else { self.by_lengths(count, size) }
    }

    fn by_lengths(&mut self, count: u64, size: u64) -> Result<Lists, FileFault> {
        let VtkNumbers { values, places } = self.numbers(NumberType::I32, size, 1)?;
        let mut lists = Lists { offsets: vec![0], ..Lists::default() };
        let mut at = 0;
        while at < values.len() {
            let length = super::number_type::index(values[at], values.len() - at);
            let length = length.ok_or_else(|| {
                let place = places[at];
                let what = "numbers that this cell says it has, and the list has left";
                let (expected, found) = ((values.len() - at - 1) as u64, values[at] as u64);
                self.at(place, FormatError::Count { what, expected, found })
            })? as usize;
            lists.vertices.extend(&values[at + 1..at + 1 + length]);
            lists.places.extend(&places[at + 1..at + 1 + length]);
            lists.offsets.push(lists.vertices.len());
            at += 1 + length;
        }
        self.count("cells in the list", count, lists.offsets.len() as u64 - 1)?;
        Ok(lists)
    }

    fn by_offsets(&mut self, count: u64, size: u64) -> Result<Lists, FileFault> {
        self.tokens.keyword("OFFSETS")?;
        let name = self.tokens.word("the type of the offsets")?;
        let kind = number_type(&self.tokens, name)?;
        let offsets = self.numbers(kind, count, 1)?;
        self.pass_metadata(1);
        self.tokens.keyword("CONNECTIVITY")?;
        let name = self.tokens.word("the type of the connectivity")?;
        let kind = number_type(&self.tokens, name)?;
        let VtkNumbers { values: vertices, places } = self.numbers(kind, size, 1)?;
        self.pass_metadata(1);
        let mut lists = Lists { vertices, places, offsets: Vec::new() };
        for (&offset, &place) in offsets.values.iter().zip(&offsets.places) {
            let least = lists.offsets.last().copied().unwrap_or(0);
            match super::number_type::index(offset, lists.vertices.len() + 1) {
                Some(offset) if offset as usize >= least => lists.offsets.push(offset as usize),
                _ => {
                    return Err(self
                        .at(place, expected("an offset that ascends, up to the size", &offset.to_string())));
                }
            }
        }
        let last = lists.offsets.last().copied().unwrap_or(0);
        self.count("the last offset, which is the size of CONNECTIVITY", size, last as u64)?;
        Ok(lists)
    }

    fn at(&self, place: Place, error: impl Into<MeshError>) -> FileFault {
        let byte = self.binary.then_some(place.tag);
        FileFault { byte, ..FileFault::in_line(place.line, error) }
    }

    fn types(&mut self) -> Result<(), FileFault> {
        let count: u64 = self.tokens.number("the number of cell types")?;
        self.types = Some(self.numbers(NumberType::I32, count, 1)?);
        self.pass_metadata(1);
        Ok(())
    }

    fn typed(&mut self, kind: ListKind) -> Result<(), FileFault> {
        let lists = self.lists()?;
        self.typed.push((kind, lists));
        Ok(())
    }

    /// Reads `FIELD name n`, then `n` times `name components tuples type` and the numbers.
    fn field(&mut self) -> Result<(), FileFault> {
        self.tokens.word("the name of a field")?;
        let arrays: u64 = self.tokens.number("the number of arrays")?;
        for _ in 0..arrays {
            self.tokens.word("the name of an array")?;
            let components: u64 = self.tokens.number("the number of components")?;
            let tuples: u64 = self.tokens.number("the number of tuples")?;
            let name = self.tokens.word("the type of an array")?;
            let kind = number_type(&self.tokens, name)?;
            self.numbers(kind, components.saturating_mul(tuples), 1)?;
            self.pass_metadata(components);
        }
        Ok(())
    }

    fn finish(mut self, input: &MeshInput) -> Result<FileMesh, FileFault> {
        let mut cells = FileCells::default();
        let VtkNumbers { values, places } = self.points.take().unwrap_or_default();
        let count = places.len();
        let lists = std::mem::take(&mut self.cells);
        let types = self.types.take().unwrap_or_default();
        let number = lists.offsets.len().saturating_sub(1) as u64;
        self.count("cell types", number, types.values.len() as u64)?;
        for (i, bounds) in lists.offsets.windows(2).enumerate() {
            // A cell without vertices has the position of its type.
            let place = lists.places.get(bounds[0]).filter(|_| bounds[1] > bounds[0]).copied();
            let place = place.unwrap_or(types.places[i]);
            vtk_cells::enter(
                &mut cells,
                types.values[i],
                &lists.vertices[bounds[0]..bounds[1]],
                0..count,
                place,
            )
            .map_err(|error| self.at(place, error))?;
        }
        for (kind, lists) in &self.typed {
            for bounds in lists.offsets.windows(2) {
                let place = lists.places.get(bounds[0]).copied().unwrap_or_default();
                let vertices = &lists.vertices[bounds[0]..bounds[1]];
                vtk_cells::enter(&mut cells, kind.cell_type(), vertices, 0..count, place)
                    .map_err(|error| self.at(place, error))?;
            }
        }
        cells.into_file(values, places, &Names::new(), input.mid_nodes)
    }
}
