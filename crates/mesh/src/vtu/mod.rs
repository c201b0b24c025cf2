//! VTK's XML format for unstructured grids, `.vtu`:
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.
//!
//! Arrays may be ASCII, inline base 64, or appended, raw or in base 64; compressed by zlib or not.
//! `roxmltree`, which has hardly any dependencies and knows the line of every node, parses the XML;
//! `miniz_oxide` decompresses the blocks. The `vtkio` crate reports neither the line nor the cell of an
//! error.

mod array;

use roxmltree::{Document, Node};

use super::cells::{FileCells, Names};
use super::file::{FileMesh, MeshInput, Place};
use super::tokens::{FileFault, excerpt};
use super::{FormatError, MeshError, vtk_cells};
use array::{Array, Encoding};

/// Reads points and cells of all pieces, one after the other.
pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let (xml, appended) = split(input.bytes)?;
    let text = std::str::from_utf8(&xml).map_err(|error| {
        let line = xml[..error.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        FileFault::in_line(line as u32 + 1, xml_error("it is not UTF-8"))
    })?;
    if let Some((line, count)) = crowded_tag(text) {
        let message = format!("a tag has {count} attributes; at most {ATTRIBUTES} are read");
        return Err(FileFault::in_line(line, xml_error(&message)));
    }
    let document = Document::parse(text)
        .map_err(|error| FileFault::in_line(error.pos().row, xml_error(&error.to_string())))?;
    let file = File { document: &document };
    let root = document.root_element();
    if root.tag_name().name() != "VTKFile" {
        return Err(file.expected(root, "<VTKFile>", root.tag_name().name()));
    }
    if root.attribute("type") != Some("UnstructuredGrid") {
        let kind = root.attribute("type").unwrap_or("none");
        return Err(file.expected(root, "type=\"UnstructuredGrid\"", kind));
    }
    let encoding = Encoding::new(&file, root, appended)?;
    let grid = file.child(root, "UnstructuredGrid")?;
    let (mut xyz, mut places, mut cells) = (Vec::new(), Vec::new(), FileCells::default());
    for piece in grid.children().filter(|node| node.has_tag_name("Piece")) {
        file.piece(piece, &encoding, &mut xyz, &mut places, &mut cells)?;
    }
    cells.into_file(xyz, places, &Names::new(), input.mid_nodes)
}

/// Limit on the attributes of a tag. The parser compares each with all earlier ones; files of VTK have
/// ten.
const ATTRIBUTES: usize = 256;

/// Line and number of attributes of the first tag above the limit.
fn crowded_tag(xml: &str) -> Option<(u32, usize)> {
    const NO_TAGS: [(&str, &str); 3] = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
    let mut rest = xml;
    // The parser reports unclosed tags.
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        if let Some((open, close)) = NO_TAGS.iter().find(|(open, _)| rest.starts_with(open)) {
            rest = rest[open.len()..].split_once(close)?.1;
            continue;
        }
        let (mut quote, mut count) = (None, 0);
        let end = rest.bytes().position(|byte| {
            match (quote, byte) {
                (None, b'>') => return true,
                (None, b'"' | b'\'') => (quote, count) = (Some(byte), count + 1),
                (Some(open), _) if open == byte => quote = None,
                _ => {}
            }
            false
        });
        if count > ATTRIBUTES {
            let before = &xml[..xml.len() - rest.len()];
            return Some((before.matches('\n').count() as u32 + 1, count));
        }
        rest = &rest[end?..];
    }
    None
}

fn xml_error(message: &str) -> MeshError {
    FormatError::Xml { message: message.to_string() }.into()
}

/// Separates the appended data, which may be any bytes, from the XML around them.
fn split(bytes: &[u8]) -> Result<(Vec<u8>, &[u8]), FileFault> {
    let find = |bytes: &[u8], word: &[u8]| bytes.windows(word.len()).position(|window| window == word);
    let Some(element) = find(bytes, b"<AppendedData") else { return Ok((bytes.to_vec(), &[])) };
    let cut_off = |expected| {
        let line = bytes[..element].iter().filter(|&&b| b == b'\n').count() as u32 + 1;
        FileFault::in_line(line, MeshError::EndOfFile { expected })
    };
    let open =
        find(&bytes[element..], b">").ok_or_else(|| cut_off("the end of <AppendedData"))? + element + 1;
    let underscore = find(&bytes[open..], b"_").ok_or_else(|| cut_off("_ and the appended data"))? + open + 1;
    let word = b"</AppendedData";
    let close = bytes.windows(word.len()).rposition(|window| window == word);
    let close = close.filter(|&close| close >= underscore).ok_or_else(|| cut_off("</AppendedData>"))?;
    Ok(([&bytes[..open], &bytes[close..]].concat(), &bytes[underscore..close]))
}

/// The document, and its errors.
struct File<'a, 'input> {
    document: &'a Document<'input>,
}

impl<'a, 'input> File<'a, 'input> {
    fn line(&self, node: Node) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    fn fault(&self, node: Node, error: impl Into<MeshError>) -> FileFault {
        FileFault::in_line(self.line(node), error)
    }

    fn expected(&self, node: Node, expected: &'static str, found: &str) -> FileFault {
        self.fault(node, MeshError::Expected { expected, found: excerpt(found) })
    }

    fn child(&self, node: Node<'a, 'input>, name: &'static str) -> Result<Node<'a, 'input>, FileFault> {
        let child = node.children().find(|child| child.has_tag_name(name));
        child.ok_or_else(|| self.fault(node, xml_error(&format!("<{name}> is missing in this element"))))
    }

    /// An array of `Cells` by name.
    fn named(&self, node: Node<'a, 'input>, name: &str) -> Result<Node<'a, 'input>, FileFault> {
        let is = |child: &Node| child.has_tag_name("DataArray") && child.attribute("Name") == Some(name);
        let message = || format!("<DataArray Name=\"{name}\"> is missing in this element");
        node.children().find(is).ok_or_else(|| self.fault(node, xml_error(&message())))
    }

    /// An attribute that is a count.
    fn count(&self, node: Node, name: &'static str) -> Result<u64, FileFault> {
        let value = node.attribute(name).unwrap_or("nothing");
        let message = || xml_error(&format!("{name} must be a whole number, found `{}`", excerpt(value)));
        value.trim().parse().map_err(|_| self.fault(node, message()))
    }

    fn agree(&self, node: Node, what: &'static str, expected: u64, found: u64) -> Result<(), FileFault> {
        if expected == found {
            Ok(())
        } else {
            Err(self.fault(node, FormatError::Count { what, expected, found }))
        }
    }

    fn piece(
        &self,
        piece: Node<'a, 'input>,
        encoding: &Encoding,
        xyz: &mut Vec<f64>,
        places: &mut Vec<Place>,
        cells: &mut FileCells,
    ) -> Result<(), FileFault> {
        let first = places.len();
        let points = self.child(self.child(piece, "Points")?, "DataArray")?;
        let count = self.count(piece, "NumberOfPoints")?;
        let expected = count.saturating_mul(3);
        let array = Array::read(self, points, encoding, expected)?;
        self.agree(points, "coordinates, three for each point", expected, array.values.len() as u64)?;
        xyz.extend(&array.values);
        places.extend((0..count).map(|vertex| array.place(3 * vertex as usize, vertex + 1)));

        // Cells: offsets into the connectivity, and types.
        let element = self.child(piece, "Cells")?;
        let cell_count = self.count(piece, "NumberOfCells")?;
        let nodes = ["connectivity", "offsets", "types"].map(|name| self.named(element, name));
        let [connectivity, offsets, types] = nodes;
        let (connectivity, offsets, types) = (connectivity?, offsets?, types?);
        let ends = Array::read(self, offsets, encoding, cell_count)?;
        let kinds = Array::read(self, types, encoding, cell_count)?;
        // An invalid last offset makes the array empty, which contradicts the offsets.
        let size = ends.values.last().map_or(0, |last| *last as u64);
        let vertices = Array::read(self, connectivity, encoding, size)?;
        self.agree(offsets, "offsets, one for each cell", cell_count, ends.values.len() as u64)?;
        self.agree(types, "types, one for each cell", cell_count, kinds.values.len() as u64)?;
        let mut start = 0;
        for (cell, (&end, &kind)) in ends.values.iter().zip(&kinds.values).enumerate() {
            let place = ends.place(cell, cell as u64 + 1);
            let end = super::number_type::index(end, vertices.values.len() + 1);
            let Some(end) = end.map(|end| end as usize).filter(|&end| end >= start) else {
                let expected = "an offset that ascends, up to the size of `connectivity`";
                let found = ends.values[cell].to_string();
                return Err(FileFault::in_line(place.line, MeshError::Expected { expected, found }));
            };
            let place = if end > start { vertices.place(start, cell as u64 + 1) } else { place };
            let numbers = &vertices.values[start..end];
            vtk_cells::enter(cells, kind, numbers, first..places.len(), place)
                .map_err(|error| FileFault::in_line(place.line, error))?;
            start = end;
        }
        let size = vertices.values.len() as u64;
        self.agree(offsets, "the last offset, which is the size of `connectivity`", size, start as u64)
    }
}
