//! Wavefront OBJ: vertices, polygons, polylines, groups and objects.
//!
//! This reader replaces the `tobj` crate. `tobj` gives every group vertices of its own, so that a mesh falls
//! apart along its groups; turns polylines of three vertices into triangles; drops vertices that no face uses
//! and with them the numbering; reports no lines; by default rounds positions to single precision; and
//! overflows on some indices.

use std::collections::BTreeMap;

use super::file::{FileMesh, GROUPS_AT_ONCE, MeshInput, Place};
use super::tokens::{FileFault, excerpt};
use super::{Group, Mesh, MeshError};

/// Reads `v`, `f`, `l`, `g` and `o`; other statements (normals, texture coordinates, materials) do not
/// describe the shape and are skipped. A polygon becomes a fan of triangles about its first vertex, which
/// is right for convex polygons. Cells belong to the current object and to every current group; vertices
/// keep the order of the file.
pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    // Names may be in any encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(input.bytes);
    let mut reader = ObjReader::default();
    let mut continued = String::new();
    for (i, line) in text.lines().enumerate() {
        reader.line = u32::try_from(i + 1).unwrap_or(u32::MAX);
        match line.trim_end().strip_suffix('\\') {
            Some(start) => {
                continued.push_str(start);
                continued.push(' ');
            }
            None if continued.is_empty() => reader.statement(line)?,
            None => {
                continued.push_str(line);
                reader.statement(&std::mem::take(&mut continued))?;
            }
        }
    }
    reader.statement(&continued)?;
    Ok(reader.finish())
}

#[derive(Default)]
struct ObjReader {
    file: FileMesh,
    line: u32,
    object: Option<usize>,
    current: Vec<usize>,
    /// Numbers of the names, in order of appearance.
    numbers: BTreeMap<String, usize>,
    members: Vec<[Vec<u32>; 2]>,
}

impl ObjReader {
    fn fault(&self, error: MeshError) -> FileFault {
        FileFault::in_line(self.line, error)
    }

    fn statement(&mut self, line: &str) -> Result<(), FileFault> {
        let mut words = line.split_whitespace().take_while(|word| !word.starts_with('#'));
        match words.next() {
            Some("v") => self.vertex(words),
            Some("f") => self.polygon(words),
            Some("l") => self.polyline(words),
            Some("g") => {
                self.current.clear();
                for name in words {
                    let number = self.number(name);
                    if !self.current.contains(&number) {
                        self.current.push(number);
                    }
                    if self.current.len() > GROUPS_AT_ONCE {
                        return Err(self.fault(MeshError::TooManyGroups { limit: GROUPS_AT_ONCE }));
                    }
                }
                Ok(())
            }
            Some("o") => {
                // Names of objects may contain spaces.
                let name = line.trim().trim_start_matches('o').trim();
                self.object = if name.is_empty() { None } else { Some(self.number(name)) };
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Number of a name; a new name gets the next free number.
    fn number(&mut self, name: &str) -> usize {
        let next = self.members.len();
        let number = *self.numbers.entry(name.to_string()).or_insert(next);
        if number == next {
            self.members.push(Default::default());
        }
        number
    }

    /// Reads `v x y z`; a weight or a colour may follow.
    fn vertex<'a>(&mut self, mut words: impl Iterator<Item = &'a str>) -> Result<(), FileFault> {
        for expected in ["x of a vertex", "y of a vertex", "z of a vertex"] {
            let word = words.next().unwrap_or("");
            let value = word
                .parse::<f64>()
                .map_err(|_| self.fault(MeshError::Expected { expected, found: excerpt(word) }))?;
            self.file.xyz.push(value);
        }
        self.file.vertices.push(Place { tag: self.file.vertices.len() as u64 + 1, line: self.line });
        Ok(())
    }

    /// Index of a vertex, numbered from 1, or backwards from -1; in `i/t/n` the texture and the normal
    /// are ignored.
    fn index(&self, word: &str) -> Result<u32, FileFault> {
        let count = self.file.vertices.len();
        let number = word.split('/').next().unwrap_or("");
        let index: i64 = number.parse().map_err(|_| {
            self.fault(MeshError::Expected { expected: "the number of a vertex", found: excerpt(word) })
        })?;
        let position = if index > 0 { index - 1 } else { index.saturating_add(count as i64) };
        match usize::try_from(position) {
            Ok(position) if index != 0 && position < count => Ok(position as u32),
            _ => Err(self.fault(MeshError::ObjIndex { index, count })),
        }
    }

    fn polygon<'a>(&mut self, mut words: impl Iterator<Item = &'a str>) -> Result<(), FileFault> {
        let expected = "three vertices of a face";
        let mut next = |reader: &Self| match words.next() {
            Some(word) => reader.index(word).map(Some),
            None => Ok(None),
        };
        let (Some(first), Some(mut last), Some(mut corner)) = (next(self)?, next(self)?, next(self)?) else {
            return Err(self.fault(MeshError::Expected { expected, found: "fewer".to_string() }));
        };
        loop {
            self.member(1, self.file.mesh.triangles.len());
            self.file.mesh.triangles.push([first, last, corner]);
            self.file.triangles.push(Place { tag: 0, line: self.line });
            last = corner;
            match next(self)? {
                Some(index) => corner = index,
                None => return Ok(()),
            }
        }
    }

    fn polyline<'a>(&mut self, mut words: impl Iterator<Item = &'a str>) -> Result<(), FileFault> {
        let expected = "two vertices of a line";
        let fewer = || MeshError::Expected { expected, found: "fewer".to_string() };
        let mut last = self.index(words.next().ok_or_else(|| self.fault(fewer()))?)?;
        let mut next = self.index(words.next().ok_or_else(|| self.fault(fewer()))?)?;
        loop {
            self.member(0, self.file.mesh.edges.len());
            self.file.mesh.edges.push([last, next]);
            self.file.edges.push(Place { tag: 0, line: self.line });
            last = next;
            match words.next() {
                Some(word) => next = self.index(word)?,
                None => return Ok(()),
            }
        }
    }

    /// Adds a new cell to the current object and groups.
    fn member(&mut self, kind: usize, cell: usize) {
        for &number in self.current.iter().chain(self.object.iter()) {
            // The object may have the name of a group.
            let cells = &mut self.members[number][kind];
            if cells.last() != Some(&(cell as u32)) {
                cells.push(cell as u32);
            }
        }
    }

    fn finish(self) -> FileMesh {
        let ObjReader { mut file, numbers, mut members, .. } = self;
        for (name, number) in numbers {
            let [edges, triangles] = std::mem::take(&mut members[number]);
            let group = group(&file.mesh, edges, triangles);
            file.mesh.groups.insert(name, group);
        }
        file
    }
}

fn group(mesh: &Mesh, edges: Vec<u32>, triangles: Vec<u32>) -> Group {
    let mut vertices: Vec<u32> = edges.iter().flat_map(|&i| mesh.edges[i as usize]).collect();
    vertices.extend(triangles.iter().flat_map(|&i| mesh.triangles[i as usize]));
    vertices.sort_unstable();
    vertices.dedup();
    let (topological_dimension, cells) = if triangles.is_empty() { (1, edges) } else { (2, triangles) };
    Group { topological_dimension, cells, vertices }
}
