//! PLY, ASCII and binary: <https://paulbourke.net/dataformats/ply/>, after G. Turk's description of 1994.
//!
//! This reader replaces the `ply-rs` crates, which keep a table of strings for every vertex and report
//! neither the line nor the offset of an error.

use super::FormatError;
use super::cells::{FileCells, Names};
use super::file::{FileMesh, MeshInput, Place};
use super::number_type::{Endian, NumberType, index};
use super::tokens::{FileFault, Tokens, excerpt};

/// Reads the elements `vertex` (x, y, z), `face` (polygons: fans of triangles about the first vertex,
/// right for convex polygons) and `edge`; other elements and properties are skipped.
pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let mut tokens = Tokens::of_bytes(input.bytes);
    let header = PlyHeader::read(&mut tokens)?;
    if header.encoding.is_some() {
        tokens.set_binary();
    }
    let (mut xyz, mut places) = (Vec::new(), Vec::new());
    let mut cells = FileCells::default();
    cells.lines_are_springs = true;
    for element in &header.elements {
        element.read(&mut tokens, header.encoding, &mut xyz, &mut places, &mut cells)?;
    }
    cells.into_file(xyz, places, &Names::new(), input.mid_nodes)
}

/// Byte order of a binary file; `None` for ASCII.
type Encoding = Option<Endian>;

#[derive(Debug)]
struct Property {
    name: String,
    /// Type of the length of a list; `None` for a single number.
    length: Option<NumberType>,
    value: NumberType,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Debug)]
struct PlyHeader {
    encoding: Encoding,
    elements: Vec<Element>,
}

fn number_type(tokens: &mut Tokens) -> Result<NumberType, FileFault> {
    Ok(match tokens.word("the type of a property")? {
        "char" | "int8" => NumberType::I8,
        "uchar" | "uint8" => NumberType::U8,
        "short" | "int16" => NumberType::I16,
        "ushort" | "uint16" => NumberType::U16,
        "int" | "int32" => NumberType::I32,
        "uint" | "uint32" => NumberType::U32,
        "float" | "float32" => NumberType::F32,
        "double" | "float64" => NumberType::F64,
        word => return Err(tokens.expected("a type such as float or int", word)),
    })
}

impl PlyHeader {
    fn read(tokens: &mut Tokens) -> Result<PlyHeader, FileFault> {
        tokens.keyword("ply")?;
        let word = statement(tokens, "format")?;
        if word != "format" {
            return Err(tokens.expected("format", word));
        }
        let expected = "ascii, binary_little_endian or binary_big_endian";
        let encoding = match tokens.word(expected)? {
            "ascii" => None,
            "binary_little_endian" => Some(Endian::Little),
            "binary_big_endian" => Some(Endian::Big),
            word => return Err(tokens.expected(expected, word)),
        };
        tokens.keyword("1.0")?;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            match statement(tokens, "end_header")? {
                "element" => {
                    let name = tokens.word("the name of an element")?.to_string();
                    let count = tokens.number("the number of elements")?;
                    if name == "tristrips" && count > 0 {
                        let (found, supported) =
                            ("the element tristrips".into(), "write triangles as `face`");
                        return Err(tokens.fault(FormatError::Unsupported { found, supported }));
                    }
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                "property" => {
                    let property = property(tokens)?;
                    let Some(element) = elements.last_mut() else {
                        return Err(tokens.expected("an element before its properties", "property"));
                    };
                    element.properties.push(property);
                }
                "end_header" => {
                    tokens.end_line();
                    return Ok(PlyHeader { encoding, elements });
                }
                word => return Err(tokens.expected("element, property or end_header", word)),
            }
        }
    }
}

/// First word of the next header line, comments skipped.
fn statement<'a>(tokens: &mut Tokens<'a>, expected: &'static str) -> Result<&'a str, FileFault> {
    loop {
        match tokens.word(expected)? {
            "comment" | "obj_info" => tokens.rest_of_line_bytes(),
            word => return Ok(word),
        };
    }
}

/// Reads `list <type of length> <type> <name>` or `<type> <name>`.
fn property(tokens: &mut Tokens) -> Result<Property, FileFault> {
    let before = tokens.clone();
    let mut length = None;
    if tokens.word("the type of a property")? == "list" {
        length = Some(number_type(tokens)?);
        if length.is_some_and(NumberType::is_real) {
            return Err(tokens.expected("a whole-number type for the length of a list", "a real one"));
        }
    } else {
        *tokens = before;
    }
    let value = number_type(tokens)?;
    let name = tokens.word("the name of a property")?.to_string();
    Ok(Property { name, length, value })
}

fn number(
    tokens: &mut Tokens,
    encoding: Encoding,
    kind: NumberType,
    expected: &'static str,
) -> Result<f64, FileFault> {
    match encoding {
        None => tokens.number(expected),
        Some(endian) => Ok(kind.decode(tokens.take(kind.size() as u64, expected)?, endian)),
    }
}

/// Meaning of a property.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Coordinate(usize),
    Polygon,
    End(usize),
    Other,
}

impl Element {
    fn roles(&self) -> Vec<Role> {
        let role = |property: &Property| match (&self.name[..], &property.name[..], property.length.is_some())
        {
            ("vertex", "x", false) => Role::Coordinate(0),
            ("vertex", "y", false) => Role::Coordinate(1),
            ("vertex", "z", false) => Role::Coordinate(2),
            ("face", "vertex_indices" | "vertex_index", true) => Role::Polygon,
            ("edge", "vertex1", false) => Role::End(0),
            ("edge", "vertex2", false) => Role::End(1),
            _ => Role::Other,
        };
        self.properties.iter().map(role).collect()
    }

    /// Rejects an element without its required properties.
    fn complete(&self, tokens: &Tokens, roles: &[Role]) -> Result<(), FileFault> {
        let needed: &[(Role, &str)] = match &self.name[..] {
            "vertex" => &[(Role::Coordinate(0), "x"), (Role::Coordinate(1), "y"), (Role::Coordinate(2), "z")],
            "face" => &[(Role::Polygon, "list vertex_indices")],
            "edge" => &[(Role::End(0), "vertex1"), (Role::End(1), "vertex2")],
            _ => &[],
        };
        for &(role, name) in needed {
            if !roles.contains(&role) {
                let found = format!("the element {} without the property {name}", self.name);
                let supported = "vertices have x, y, z, faces vertex_indices, edges vertex1 and vertex2";
                return Err(tokens.fault(FormatError::Unsupported { found, supported }));
            }
        }
        let whole =
            |property: &&Property| matches!(&property.name[..], "x" | "y" | "z") && !property.value.is_real();
        if let Some(property) = self.properties.iter().find(whole).filter(|_| self.name == "vertex") {
            let found = format!("the coordinate {} as whole number", property.name);
            return Err(tokens.fault(FormatError::Unsupported { found, supported: "use float or double" }));
        }
        Ok(())
    }

    fn read(
        &self,
        tokens: &mut Tokens,
        encoding: Encoding,
        xyz: &mut Vec<f64>,
        places: &mut Vec<Place>,
        cells: &mut FileCells,
    ) -> Result<(), FileFault> {
        let roles = self.roles();
        if self.count > 0 {
            self.complete(tokens, &roles)?;
        }
        // An element without properties takes no bytes, however large its count.
        for i in 0..if self.properties.is_empty() { 0 } else { self.count } {
            // Values of one item, by the roles of its properties.
            let (mut x, mut ends, mut polygon, mut place) = ([0.0; 3], [0.0; 2], Vec::new(), None);
            for (property, &role) in self.properties.iter().zip(&roles) {
                let length = match property.length {
                    None => 1,
                    Some(kind) => length(tokens, encoding, kind)?,
                };
                for _ in 0..length {
                    let value = number(tokens, encoding, property.value, "the value of a property")?;
                    place.get_or_insert_with(|| tokens.place(i + 1));
                    match role {
                        Role::Coordinate(axis) => x[axis] = value,
                        Role::End(end) => ends[end] = value,
                        Role::Polygon => polygon.push(value),
                        Role::Other => {}
                    }
                }
            }
            let place = place.unwrap_or_else(|| tokens.place(i + 1));
            // Adds the item.
            match &self.name[..] {
                "vertex" => {
                    xyz.extend(x);
                    places.push(place);
                }
                "edge" => {
                    let [a, b] = [vertex(tokens, ends[0], places)?, vertex(tokens, ends[1], places)?];
                    cells.push(&[a, b], place, &[]);
                }
                "face" => fan(tokens, &polygon, places, place, cells)?,
                _ => {}
            }
        }
        Ok(())
    }
}

/// Reads the length of a list.
fn length(tokens: &mut Tokens, encoding: Encoding, kind: NumberType) -> Result<u64, FileFault> {
    let expected = "the length of a list";
    let length = number(tokens, encoding, kind, expected)?;
    if length >= 0.0 && length.fract() == 0.0 {
        Ok(length as u64)
    } else {
        Err(tokens.expected(expected, &length.to_string()))
    }
}

fn vertex(tokens: &Tokens, number: f64, places: &[Place]) -> Result<u32, FileFault> {
    index(number, places.len()).ok_or_else(|| {
        if number.fract() == 0.0 {
            let count = places.len() as u64;
            tokens.fault(FormatError::VertexNumber { number: number as i64, count, first: 0 })
        } else {
            tokens.expected("the index of a vertex", &excerpt(&number.to_string()))
        }
    })
}

/// Splits a polygon into triangles about its first vertex.
fn fan(
    tokens: &Tokens,
    polygon: &[f64],
    places: &[Place],
    place: Place,
    cells: &mut FileCells,
) -> Result<(), FileFault> {
    let corners = polygon.iter().map(|&number| vertex(tokens, number, places));
    let corners = corners.collect::<Result<Vec<u32>, FileFault>>()?;
    let [first, rest @ ..] = &corners[..] else {
        return Err(tokens.expected("three vertices of a face", "none"));
    };
    if rest.len() < 2 {
        return Err(tokens.expected("three vertices of a face", "fewer"));
    }
    for pair in rest.windows(2) {
        cells.push(&[*first, pair[0], pair[1]], place, &[]);
    }
    Ok(())
}
