//! Export as NumPy's `.npz`: an uncompressed zip archive of arrays in the format `.npy` 1.0,
//! <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use std::io::{self, Write};

use super::{Export, ExportError};
use pliant::diagnostics::RecordedField;

/// Size limit of a zip archive without the extension for large ones.
const LARGEST: u64 = u32::MAX as u64;

impl Export {
    /// Writes these frames as arrays: `times` of shape `(frames,)` [s]; `positions` [m] and `velocities`
    /// [m/s] of shape `(frames, vertices, dimension)`, doubles; `rest` [m] of shape `(vertices,
    /// dimension)` if recorded; `bodies`, first vertex and number of vertices of each; and for each body
    /// those of `<body>.edges`, `.triangles`, `.tetrahedra`, .. and `.surface` that apply: rows of vertex
    /// indices, counted over all bodies. For each recorded measure of elements, `<body>.von-mises` and the
    /// like, of shape `(frames, elements)` or `(frames, elements, components)`; of vertices,
    /// `<body>.nodal-von-mises` and the like, of shape `(frames, vertices of the body)` or `(frames,
    /// vertices of the body, components)`.
    ///
    /// # Errors
    /// A frame that cannot be read; [`ExportError::TooLarge`] beyond 4 GB; a write error of the stream.
    pub fn write_npz(&mut self, frames: &[usize], out: &mut dyn Write) -> Result<(), ExportError> {
        let (vertices, dimension) = (self.trajectory.vertex_count(), self.trajectory.dimension());
        let state = [frames.len(), vertices, dimension];
        let mut size = 16 * state.iter().map(|n| *n as u64).product::<u64>();
        let measured = frames.first().map_or(Ok(vec![]), |first| self.trajectory.fields(*first))?;
        for (_, rows) in &measured {
            size = size.saturating_add(8 * frames.len() as u64 * rows.values.len() as u64);
        }
        if size > LARGEST / 2 {
            return Err(ExportError::TooLarge { format: ".npz", size, most: LARGEST / 2 });
        }
        let times: Vec<f64> = frames.iter().map(|&frame| self.trajectory.times()[frame]).collect();
        let mut archive = Archive { out, written: 0, directory: Vec::new(), count: 0 };
        archive.doubles("times", &[frames.len()], &times)?;
        let mut values = Vec::with_capacity(state.iter().product());
        for &frame in frames {
            values.extend(self.trajectory.positions(frame)?);
        }
        archive.doubles("positions", &state, &values)?;
        values.clear();
        for &frame in frames {
            values.extend(self.trajectory.velocities(frame)?);
        }
        archive.doubles("velocities", &state, &values)?;
        if let Some(rest) = self.trajectory.rest_positions()? {
            archive.doubles("rest", &[vertices, dimension], &rest)?;
        }
        self.topology(&mut archive)?;
        for (field, _) in measured {
            self.field(&field, frames, &mut archive)?;
        }
        Ok(archive.finish()?)
    }

    /// Writes the values of a field, body by body.
    fn field(
        &mut self,
        field: &RecordedField,
        frames: &[usize],
        archive: &mut Archive<'_>,
    ) -> Result<(), ExportError> {
        let (mut bodies, mut width) = (vec![], 0);
        let mut values: Vec<Vec<f64>> = vec![];
        for &frame in frames {
            let rows = self.trajectory.field(field, frame)?;
            values.resize_with(rows.bodies.len(), Vec::new);
            width = rows.fields.len();
            for (values, body) in values.iter_mut().zip(&rows.bodies) {
                values.extend(&rows.values[width * body.first..width * (body.first + body.count)]);
            }
            bodies = rows.bodies;
        }
        for (body, values) in bodies.iter().zip(&values) {
            let shape = [frames.len(), body.count, width];
            let shape = if width > 1 { &shape[..] } else { &shape[..2] };
            archive.doubles(&format!("{}.{}", body.name, field.name), shape, values)?;
        }
        Ok(())
    }

    fn topology(&self, archive: &mut Archive<'_>) -> Result<(), ExportError> {
        let ranges: Vec<u32> = self
            .bodies
            .bodies
            .iter()
            .flat_map(|body| [body.vertices.start, body.vertices.len() as u32])
            .collect();
        archive.numbers("bodies", 2, &ranges)?;
        for body in &self.bodies.bodies {
            let parts: [(&str, usize, &[u32]); 6] = [
                ("edges", 2, body.edges.as_flattened()),
                ("triangles", 3, body.triangles.as_flattened()),
                ("tetrahedra", 4, body.tetrahedra.as_flattened()),
                ("quadratic_triangles", 6, body.quadratic_triangles.as_flattened()),
                ("quadratic_tetrahedra", 10, body.quadratic_tetrahedra.as_flattened()),
                ("surface", 3, body.surface.as_flattened()),
            ];
            let blocks =
                body.blocks.iter().map(|block| (block.kind.name, block.kind.nodes, &block.vertices[..]));
            for (name, nodes, cells) in parts.into_iter().chain(blocks).filter(|part| !part.2.is_empty()) {
                archive.numbers(&format!("{}.{name}", body.name), nodes, cells)?;
            }
        }
        Ok(())
    }
}

/// Zip archive written sequentially; APPNOTE 6.3.10.
struct Archive<'a> {
    out: &'a mut dyn Write,
    written: u64,
    directory: Vec<u8>,
    count: u16,
}

impl Archive<'_> {
    fn doubles(&mut self, name: &str, shape: &[usize], values: &[f64]) -> io::Result<()> {
        self.array(name, "<f8", shape, values.iter().flat_map(|value| value.to_le_bytes()))
    }

    /// Writes rows of `nodes` integers.
    fn numbers(&mut self, name: &str, nodes: usize, values: &[u32]) -> io::Result<()> {
        let shape = [values.len() / nodes, nodes];
        self.array(name, "<u4", &shape, values.iter().flat_map(|value| value.to_le_bytes()))
    }

    fn array(
        &mut self,
        name: &str,
        kind: &str,
        shape: &[usize],
        bytes: impl Iterator<Item = u8>,
    ) -> io::Result<()> {
        let shape: Vec<String> = shape.iter().map(|n| format!("{n},")).collect();
        let shape = shape.join(" ");
        let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        // The data begin at a multiple of 64 bytes.
        while !(10 + header.len() + 1).is_multiple_of(64) {
            header.push(' ');
        }
        header.push('\n');
        let mut content = b"\x93NUMPY\x01\x00".to_vec();
        content.extend((header.len() as u16).to_le_bytes());
        content.extend(header.as_bytes());
        content.extend(bytes);
        self.entry(&format!("{name}.npy"), &content)
    }

    fn entry(&mut self, name: &str, content: &[u8]) -> io::Result<()> {
        let mut common = Vec::new();
        // Version 2.0, names in UTF-8, stored, 1 January 1980: the same frames give the same bytes.
        for number in [20_u16, 1 << 11, 0, 0, 0x21] {
            common.extend(number.to_le_bytes());
        }
        common.extend(crc32fast::hash(content).to_le_bytes());
        common.extend([(content.len() as u32).to_le_bytes(); 2].as_flattened());
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0; 2]);
        self.directory.extend(b"PK\x01\x02\x14\x00");
        self.directory.extend(&common);
        self.directory.extend([0; 10]);
        self.directory.extend((self.written as u32).to_le_bytes());
        self.directory.extend(name.as_bytes());
        self.count += 1;
        for part in [b"PK\x03\x04", &common[..], name.as_bytes(), content] {
            self.out.write_all(part)?;
            self.written += part.len() as u64;
        }
        Ok(())
    }

    fn finish(self) -> io::Result<()> {
        self.out.write_all(&self.directory)?;
        let mut end = b"PK\x05\x06\0\0\0\0".to_vec();
        end.extend([self.count.to_le_bytes(); 2].as_flattened());
        end.extend((self.directory.len() as u32).to_le_bytes());
        end.extend((self.written as u32).to_le_bytes());
        end.extend([0; 2]);
        self.out.write_all(&end)
    }
}
