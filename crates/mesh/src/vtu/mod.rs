//! VTK's XML format for unstructured grids, `.vtu`:
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.
//!
//! Arrays may be ASCII, base 64 in their place, or appended, raw or in base 64; compressed by zlib or not.
//! The XML is parsed by `roxmltree`, which has no dependencies to speak of and knows the line of everything,
//! the compressed blocks are unpacked by `miniz_oxide`. The `vtkio` crate says neither the line nor the cell
//! of a fault.

mod array;

use roxmltree::{Document, Node};

use super::cells::{FileCells, Names};
use super::file::{FileMesh, MeshInput, Place};
use super::tokens::{FileFault, excerpt};
use super::{FormatError, MeshError, vtk_cells};
use array::{Array, Encoding};

/// Reads the whole file: points and cells of all pieces, one after the other.
pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let (xml, appended) = split(input.bytes)?;
    let text = std::str::from_utf8(&xml).map_err(|error| {
        let line = xml[..error.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        FileFault::in_line(line as u32 + 1, xml_error("it is not UTF-8"))
    })?;
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

fn xml_error(message: &str) -> MeshError {
    FormatError::Xml { message: message.to_string() }.into()
}

/// The appended data, which may be any bytes, apart from the XML about them.
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

/// The document, and what is said of its faults.
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

    /// An array of `Cells` by its name.
    fn named(&self, node: Node<'a, 'input>, name: &str) -> Result<Node<'a, 'input>, FileFault> {
        let is = |child: &Node| child.has_tag_name("DataArray") && child.attribute("Name") == Some(name);
        let message = || format!("<DataArray Name=\"{name}\"> is missing in this element");
        node.children().find(is).ok_or_else(|| self.fault(node, xml_error(&message())))
    }

    /// A count in an attribute.
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
        let array = Array::read(self, points, encoding)?;
        let expected = count.saturating_mul(3);
        self.agree(points, "coordinates, three for each point", expected, array.values.len() as u64)?;
        xyz.extend(&array.values);
        places.extend((0..count).map(|vertex| array.place(3 * vertex as usize, vertex + 1)));

        let element = self.child(piece, "Cells")?;
        let cell_count = self.count(piece, "NumberOfCells")?;
        let nodes = ["connectivity", "offsets", "types"].map(|name| self.named(element, name));
        let [connectivity, offsets, types] = nodes;
        let (connectivity, offsets, types) = (connectivity?, offsets?, types?);
        let vertices = Array::read(self, connectivity, encoding)?;
        let ends = Array::read(self, offsets, encoding)?;
        let kinds = Array::read(self, types, encoding)?;
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
