//! Abaqus input decks, `.inp`, as CalculiX and mesh generators write them too: nodes, elements, sets and
//! surfaces.
//!
//! The reader accepts `*NODE`, `*ELEMENT`, `*NSET`, `*ELSET` (with `GENERATE`) and `*SURFACE` of
//! elements; sets and surfaces become groups of the same name. Keywords that generate nodes or elements
//! from others are rejected by name. Keywords of materials, steps and output are ignored: the scene
//! specifies parameters, loads and supports. A deck may have one part with one instance, whose
//! translation and rotation are applied; the part or the instance defines nodes and elements. Files of
//! `*INCLUDE` are [joined](super::include) beforehand. Source: "Abaqus Analysis User's Guide", sections
//! "Node definition", "Element definition", "Assembly definition", "Solid (continuum) elements" (order of
//! nodes, numbers of faces).
//! "Assembly definition", "Solid (continuum) elements" (order of nodes, numbers of faces).

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use super::cells::{FileCells, Names};
use super::file::{FileMesh, GROUPS_AT_ONCE, MeshInput, Place};
use super::tokens::{FileFault, excerpt};
use super::transform::rotation_about;
use super::{FormatError, MeshError, turn};
use pliant::element::{CellKind, HEX20, HEXAHEDRON, QUAD8, QUADRILATERAL};

/// Shape of an element type.
#[derive(Clone, Copy)]
enum DeckShape {
    /// Number of corners, number of mid-edge nodes.
    Simplex(usize, usize),
    Block(&'static CellKind),
}

impl DeckShape {
    fn nodes(self) -> usize {
        match self {
            DeckShape::Simplex(corners, middles) => corners + middles,
            DeckShape::Block(kind) => kind.nodes,
        }
    }

    fn dimension(self) -> u8 {
        match self {
            DeckShape::Simplex(corners, _) => corners as u8 - 1,
            DeckShape::Block(kind) => kind.dimension as u8,
        }
    }

    /// Nodes of face `S1`, `S2`, ..., as indices within the element, corners first.
    fn face(self, number: usize) -> Option<&'static [usize]> {
        let faces: &[&[usize]] = match (self, self.nodes()) {
            (DeckShape::Simplex(3, _), 3) => &[&[0, 1], &[1, 2], &[2, 0]],
            (DeckShape::Simplex(3, _), _) => &[&[0, 1, 3], &[1, 2, 4], &[2, 0, 5]],
            (DeckShape::Simplex(4, _), 4) => &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0]],
            (DeckShape::Simplex(4, _), _) => {
                &[&[0, 1, 2, 4, 5, 6], &[0, 3, 1, 7, 8, 4], &[1, 3, 2, 8, 9, 5], &[2, 3, 0, 9, 7, 6]]
            }
            (DeckShape::Block(_), 8) if self.dimension() == 2 => {
                &[&[0, 1, 4], &[1, 2, 5], &[2, 3, 6], &[3, 0, 7]]
            }
            (DeckShape::Block(_), 20) => &[
                &[0, 1, 2, 3, 8, 9, 10, 11],
                &[4, 7, 6, 5, 15, 14, 13, 12],
                &[0, 4, 5, 1, 16, 12, 17, 8],
                &[1, 5, 6, 2, 17, 13, 18, 9],
                &[2, 6, 7, 3, 18, 14, 19, 10],
                &[3, 7, 4, 0, 19, 15, 16, 11],
            ],
            (DeckShape::Block(_), 4) => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
            (DeckShape::Block(_), 8) => {
                &[&[0, 1, 2, 3], &[4, 7, 6, 5], &[0, 4, 5, 1], &[1, 5, 6, 2], &[2, 6, 7, 3], &[3, 7, 4, 0]]
            }
            _ => &[],
        };
        faces.get(number.checked_sub(1)?).copied()
    }
}

/// Shape of an element type, from its name without the suffixes of the formulation.
fn shape(name: &str) -> Option<DeckShape> {
    // Suffixes (hybrid, modified, reduced, incompatible modes, thermal): other formulations on the same
    // nodes.
    let base = name.trim_end_matches(['H', 'M', 'R', 'I', 'T', 'S', 'E', 'P', 'V']);
    let base = if base.ends_with(|c: char| c.is_ascii_digit()) { base } else { name };
    Some(match base {
        "MASS" | "SPRINGA" => return None,
        "T2D2" | "T3D2" | "B21" | "B31" | "R2D2" => DeckShape::Simplex(2, 0),
        "T2D3" | "T3D3" | "B22" | "B32" => DeckShape::Simplex(2, 1),
        "CPS3" | "CPE3" | "S3" | "M3D3" | "STRI3" | "R3D3" | "SFM3D3" | "DS3" => DeckShape::Simplex(3, 0),
        "CPS6" | "CPE6" | "M3D6" | "STRI65" | "SFM3D6" => DeckShape::Simplex(3, 3),
        "C3D4" | "DC3D4" => DeckShape::Simplex(4, 0),
        "C3D10" | "DC3D10" => DeckShape::Simplex(4, 6),
        "CPS4" | "CPE4" | "S4" | "M3D4" | "R3D4" | "SFM3D4" => DeckShape::Block(QUADRILATERAL.kind),
        "C3D8" | "DC3D8" => DeckShape::Block(HEXAHEDRON.kind),
        "CPS8" | "CPE8" | "M3D8" => DeckShape::Block(QUAD8.kind),
        "C3D20" | "DC3D20" => DeckShape::Block(HEX20.kind),
        _ => return None,
    })
}

/// A keyword line: name and parameters in upper case; values of parameters keep their case.
pub(super) struct Keyword<'a> {
    pub(super) name: String,
    parameters: Vec<(String, Cow<'a, str>)>,
    line: u32,
}

impl Keyword<'_> {
    fn has(&self, parameter: &str) -> bool {
        self.parameters.iter().any(|(name, _)| name == parameter)
    }

    pub(super) fn get(&self, parameter: &str) -> Option<&str> {
        let found = self.parameters.iter().find(|(name, _)| name == parameter);
        found.map(|(_, value)| value.trim_matches('"')).filter(|value| !value.is_empty())
    }
}

/// An element as read from the deck.
struct DeckElement {
    shape: DeckShape,
    nodes: Range<usize>,
    place: Place,
    /// Numbers of the groups that contain the element.
    groups: Vec<u64>,
}

/// A set: its name as first written, and its members by their numbers in the deck.
#[derive(Default)]
struct DeckSet {
    name: String,
    members: Vec<u64>,
}

/// Sets by their names in upper case: Abaqus ignores case.
#[derive(Default)]
struct DeckSets {
    by_name: BTreeMap<String, DeckSet>,
    /// Number of members that set lines have named so far.
    members: usize,
}

impl DeckSets {
    fn get(&self, name: &str) -> Option<&DeckSet> {
        self.by_name.get(&name.trim_matches('"').to_ascii_uppercase())
    }

    /// The set of this name, created if it does not exist.
    fn named(&mut self, name: &str) -> &mut DeckSet {
        let set = self.by_name.entry(name.to_ascii_uppercase()).or_default();
        if set.name.is_empty() {
            name.clone_into(&mut set.name);
        }
        set
    }
}

#[derive(Default)]
struct Deck {
    xyz: Vec<f64>,
    places: Vec<Place>,
    index: HashMap<u64, u32>,
    elements: Vec<DeckElement>,
    /// Node indices of all elements, concatenated.
    nodes: Vec<u32>,
    element_index: HashMap<u64, u32>,
    node_sets: DeckSets,
    element_sets: DeckSets,
    /// Name of the surface, element or set, name of the face, line.
    surfaces: Vec<(String, String, String, u32)>,
    parts: u32,
    instances: u32,
    /// True between `*ASSEMBLY` and its end: nodes defined there are reference points, except inside of
    /// an instance.
    in_assembly: bool,
    in_instance: bool,
    /// Data lines of the instance: translation, then two points of the axis and the angle [degrees].
    placement: Vec<Vec<f64>>,
    /// True after the first `*STEP`: the model is complete.
    in_step: bool,
    /// Keywords of the model that do not belong to the mesh, each once, in order of appearance.
    passed_over: Vec<String>,
}

/// Keywords of materials, supports, loads and connections, which the scene must specify.
const OF_THE_MODEL: [&str; 16] = [
    "MATERIAL",
    "SHELL SECTION",
    "BEAM SECTION",
    "BOUNDARY",
    "CLOAD",
    "DLOAD",
    "DSLOAD",
    "TEMPERATURE",
    "INITIAL CONDITIONS",
    "AMPLITUDE",
    "CONTACT PAIR",
    "TIE",
    "EQUATION",
    "MPC",
    "COUPLING",
    "RIGID BODY",
];

pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let mut deck = Deck::default();
    let mut keyword: Option<Keyword> = None;
    // Data fields of the keyword, joined if an element continues on the next line.
    let mut open: Vec<String> = Vec::new();
    let mut pending = String::new();
    let mut line = 0;
    for bytes in input.bytes.split(|byte| *byte == b'\n') {
        line += 1;
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim();
        if text.is_empty() || text.starts_with("**") {
            continue;
        }
        if text.starts_with('*') || !pending.is_empty() {
            pending.push_str(text);
            // A keyword line that ends with a comma continues on the next line.
            if text.ends_with(',') {
                continue;
            }
            deck.end_data(keyword.as_ref(), &mut open, line)?;
            let next = parse_keyword(&pending, line);
            deck.begin(&next)?;
            keyword = Some(next);
            pending.clear();
        } else if let Some(keyword) = &keyword {
            let fields = text.trim_end_matches(',').split(',').map(|field| field.trim().to_owned());
            open.extend(fields);
            deck.data(keyword, &mut open, line)?;
        } else {
            let found = excerpt(text);
            let expected = "a keyword of Abaqus, such as `*NODE`";
            return Err(FileFault::in_line(line, MeshError::Expected { expected, found }));
        }
    }
    deck.end_data(keyword.as_ref(), &mut open, line)?;
    deck.into_file(input)
}

pub(super) fn parse_keyword(text: &str, line: u32) -> Keyword<'static> {
    let mut fields = text.split(',');
    let name = fields.next().unwrap_or_default().trim_start_matches('*').trim();
    let name = name.split_whitespace().collect::<Vec<_>>().join(" ").to_ascii_uppercase();
    let parameters = fields.map(|field| {
        let (name, value) = field.split_once('=').unwrap_or((field, ""));
        let name: String = name.split_whitespace().collect();
        (name.to_ascii_uppercase(), Cow::Owned(value.trim().to_owned()))
    });
    Keyword { name, parameters: parameters.collect(), line }
}

fn number<T: std::str::FromStr>(field: &str, expected: &'static str, line: u32) -> Result<T, FileFault> {
    // Fortran writes exponents with D.
    let plain = field.replace(['d', 'D'], "e");
    let found = || MeshError::Expected { expected, found: excerpt(field) };
    plain.parse().map_err(|_| FileFault::in_line(line, found()))
}

fn unsupported(line: u32, found: String, supported: &'static str) -> FileFault {
    FileFault::in_line(line, FormatError::Unsupported { found, supported })
}

const FLAT: &str = "one part with one instance is; write the deck without parts (in Abaqus/CAE \
                    `setValues(noPartsInputFile=ON)` of the model)";

impl Deck {
    /// Handles a keyword line.
    fn begin(&mut self, keyword: &Keyword) -> Result<(), FileFault> {
        let line = keyword.line;
        match keyword.name.as_str() {
            "PART" => self.parts += 1,
            "INSTANCE" => (self.instances, self.in_instance) = (self.instances + 1, true),
            "END INSTANCE" => self.in_instance = false,
            "STEP" => self.in_step = true,
            "ASSEMBLY" => self.in_assembly = true,
            "END ASSEMBLY" => self.in_assembly = false,
            "NODE" if keyword.get("SYSTEM").is_some_and(|system| !system.eq_ignore_ascii_case("R")) => {
                let found = "`SYSTEM` of `*NODE`, cylindrical or spherical coordinates,".to_owned();
                return Err(unsupported(line, found, "write Cartesian coordinates"));
            }
            "ELEMENT" => {
                let name = keyword.get("TYPE").unwrap_or("").to_ascii_uppercase();
                if shape(&name).is_none() {
                    let found = format!("the element type {name:?}");
                    let supported = "read are lines (T3D2, B31), triangles (CPS3, CPE3, S3, M3D3; CPS6, \
                                     CPE6), quadrilaterals (CPS4, CPE4, S4, M3D4), tetrahedra (C3D4, C3D10) \
                                     and hexahedra (C3D8), in all their formulations";
                    return Err(unsupported(line, found, supported));
                }
            }
            // Steps contain loads and output.
            "INCLUDE" if self.in_step => {}
            "INCLUDE" | "NGEN" | "NFILL" | "NCOPY" | "NMAP" | "ELGEN" | "ELCOPY" => {
                let found = format!("`*{}`", keyword.name);
                return Err(unsupported(line, found, "write every node and element into one file"));
            }
            name if OF_THE_MODEL.contains(&name) && !self.passed_over.iter().any(|told| told == name) => {
                self.passed_over.push(name.to_owned());
            }
            _ => {}
        }
        if self.parts > 1 || self.instances > 1 {
            return Err(unsupported(line, "a deck of several parts or instances".to_owned(), FLAT));
        }
        Ok(())
    }

    /// Handles the fields of a data line; an element may take several lines.
    fn data(&mut self, keyword: &Keyword, fields: &mut Vec<String>, line: u32) -> Result<(), FileFault> {
        match keyword.name.as_str() {
            "NODE" if !self.in_assembly || self.in_instance => self.node(keyword, fields, line)?,
            "ELEMENT" => {
                let name = keyword.get("TYPE").unwrap_or("").to_ascii_uppercase();
                let Some(shape) = shape(&name) else { return Ok(()) };
                if fields.len() <= shape.nodes() {
                    return Ok(());
                }
                self.element(keyword, shape, fields, line)?;
            }
            "NSET" => {
                enter_set(&mut self.node_sets, keyword, "NSET", fields, line, &self.index)?;
            }
            "ELSET" => {
                enter_set(&mut self.element_sets, keyword, "ELSET", fields, line, &self.element_index)?;
            }
            "SURFACE" if keyword.get("TYPE").is_none_or(|of| of.eq_ignore_ascii_case("ELEMENT")) => {
                let name = keyword.get("NAME").unwrap_or("surface").to_owned();
                let face = fields.get(1).cloned().unwrap_or_default().to_ascii_uppercase();
                self.surfaces.push((name, fields[0].clone(), face, line));
            }
            "INSTANCE" => self.place(fields, line)?,
            _ => {}
        }
        fields.clear();
        Ok(())
    }

    /// Ends the data of a keyword: the last element must be complete.
    fn end_data(
        &mut self,
        keyword: Option<&Keyword>,
        fields: &mut Vec<String>,
        line: u32,
    ) -> Result<(), FileFault> {
        let unfinished = !fields.is_empty() && keyword.is_some_and(|keyword| keyword.name == "ELEMENT");
        if unfinished {
            let nodes = keyword.and_then(|keyword| shape(&keyword.get("TYPE")?.to_ascii_uppercase()));
            let expected = nodes.map_or(0, |shape| shape.nodes() as u64);
            let count = FormatError::Count {
                what: "nodes of an element of its type",
                expected,
                found: fields.len() as u64 - 1,
            };
            return Err(FileFault::in_line(line.saturating_sub(1).max(1), count));
        }
        fields.clear();
        Ok(())
    }

    /// Reads a translation `x, y, z`, or two points of an axis and the angle of the rotation about it.
    fn place(&mut self, fields: &[String], line: u32) -> Result<(), FileFault> {
        let count = if self.placement.is_empty() { 3 } else { 7 };
        if self.placement.len() == 2 || fields.len() > count || count == 7 && fields.len() < count {
            let what = "numbers that place an instance, 3 to move and 7 to turn it";
            let (expected, found) = (count as u64, fields.len() as u64);
            return Err(FileFault::in_line(line, FormatError::Count { what, expected, found }));
        }
        let expected = "a number that places an instance";
        let mut numbers = vec![0.0_f64; count];
        for (value, field) in numbers.iter_mut().zip(fields).filter(|(_, field)| !field.is_empty()) {
            *value = number(field, expected, line)?;
        }
        let on_axis = numbers.len() == 7 && (0..3).any(|c| numbers[c] != numbers[3 + c]);
        if numbers.iter().any(|value| !value.is_finite()) || numbers.len() == 7 && !on_axis {
            let expected = "finite numbers, and two points that differ on the axis of a rotation";
            return Err(FileFault::in_line(line, MeshError::Expected { expected, found: fields.join(", ") }));
        }
        self.placement.push(numbers);
        Ok(())
    }

    /// Translates, then rotates the nodes of the instance.
    fn placed(&mut self) {
        let [translation, turn @ ..] = &self.placement[..] else { return };
        // A point on the axis, and the rotation matrix.
        let turn = turn.first().and_then(|turn| {
            let degrees = turn[6];
            let cosine_and_sine = if degrees.fract() == 0.0 && degrees.abs() < f64::from(u32::MAX) {
                turn::of_fraction(degrees.rem_euclid(360.0) as usize, 360)
            } else {
                turn::of_angle(degrees.to_radians())
            };
            let axis = [0, 1, 2].map(|c| turn[3 + c] - turn[c]);
            Some(([turn[0], turn[1], turn[2]], rotation_about(axis, cosine_and_sine)?))
        });
        for point in self.xyz.as_chunks_mut::<3>().0 {
            *point = [0, 1, 2].map(|c| point[c] + translation[c]);
            if let Some((foot, rows)) = turn {
                let arm = [0, 1, 2].map(|c| point[c] - foot[c]);
                let turned = rows.map(|row| row[0] * arm[0] + row[1] * arm[1] + row[2] * arm[2]);
                *point = [0, 1, 2].map(|c| foot[c] + turned[c]);
            }
        }
    }

    /// Reads `number, x, y, z`.
    fn node(&mut self, keyword: &Keyword, fields: &[String], line: u32) -> Result<(), FileFault> {
        let tag: u64 = number(&fields[0], "the number of a node", line)?;
        let next = self.places.len() as u32;
        for axis in 0..3 {
            let field = fields.get(1 + axis).map_or("", String::as_str);
            let value = if field.is_empty() { 0.0 } else { number(field, "a coordinate of a node", line)? };
            self.xyz.push(value);
        }
        if self.index.insert(tag, next).is_some() {
            return Err(FileFault::in_line(line, MeshError::RepeatedNode { node: tag }));
        }
        self.places.push(Place { tag, line });
        if let Some(name) = keyword.get("NSET") {
            self.node_sets.named(name).members.push(tag);
        }
        Ok(())
    }

    /// Reads `number, nodes`.
    fn element(
        &mut self,
        keyword: &Keyword,
        shape: DeckShape,
        fields: &[String],
        line: u32,
    ) -> Result<(), FileFault> {
        let tag: u64 = number(&fields[0], "the number of an element", line)?;
        if fields.len() != shape.nodes() + 1 {
            let (expected, found) = (shape.nodes() as u64, fields.len() as u64 - 1);
            let what = "nodes of an element of its type";
            return Err(FileFault::in_line(line, FormatError::Count { what, expected, found }));
        }
        let first = self.nodes.len();
        for field in &fields[1..] {
            let node: u64 = number(field, "the number of a node", line)?;
            let index = self.index.get(&node).copied();
            let index = index
                .ok_or_else(|| FileFault::in_line(line, MeshError::UnknownNode { element: tag, node }))?;
            self.nodes.push(index);
        }
        let nodes = first..self.nodes.len();
        self.element_index.insert(tag, self.elements.len() as u32);
        self.elements.push(DeckElement { shape, nodes, place: Place { tag, line }, groups: Vec::new() });
        if let Some(name) = keyword.get("ELSET") {
            self.element_sets.named(name).members.push(tag);
        }
        Ok(())
    }

    /// Builds the file mesh: cells with their groups, faces of surfaces, nodes of sets.
    fn into_file(mut self, input: &MeshInput) -> Result<FileMesh, FileFault> {
        self.placed();
        let mut groups = DeckGroups::default();
        for set in self.element_sets.by_name.values() {
            for tag in &set.members {
                let Some(&index) = self.element_index.get(tag) else { continue };
                let element = &mut self.elements[index as usize];
                let group = groups.number(element.shape.dimension(), &set.name);
                if !element.groups.contains(&group) {
                    element.groups.push(group);
                }
            }
        }
        let mut cells = FileCells::default();
        for element in &self.elements {
            let nodes = &self.nodes[element.nodes.clone()];
            enter(&mut cells, element.shape, nodes, element.place, &element.groups);
        }
        for (name, of, face, line) in &self.surfaces {
            self.surface(&mut cells, &mut groups, name, of, face, *line)?;
        }
        for set in self.node_sets.by_name.values() {
            let group = groups.number(0, &set.name);
            for tag in &set.members {
                if let Some(&vertex) = self.index.get(tag) {
                    cells.push(&[vertex], self.places[vertex as usize], &[group]);
                }
            }
        }
        cells.merge_repeated();
        let mut file = cells.into_file(self.xyz, self.places, &groups.names, input.mid_nodes)?;
        file.mesh.passed_over = self.passed_over.iter().map(|name| format!("*{name}")).collect();
        Ok(file)
    }

    /// Adds the faces of one line of a surface.
    fn surface(
        &self,
        cells: &mut FileCells,
        groups: &mut DeckGroups,
        name: &str,
        of: &str,
        face: &str,
        line: u32,
    ) -> Result<(), FileFault> {
        let by_number =
            of.parse().ok().filter(|tag| self.element_index.contains_key(tag)).map(|tag| vec![tag]);
        let set = || self.element_sets.get(of);
        let members = by_number.or_else(|| set().map(|set| set.members.clone())).ok_or_else(|| {
            let expected = "the number of an element or the name of an element set";
            FileFault::in_line(line, MeshError::Expected { expected, found: excerpt(of) })
        })?;
        // Adds the named face of each element, or the whole element for a side of a shell.
        for tag in members {
            let Some(&index) = self.element_index.get(&tag) else { continue };
            let element = &self.elements[index as usize];
            let nodes = &self.nodes[element.nodes.clone()];
            let whole = matches!(face, "SPOS" | "SNEG");
            let at = face.strip_prefix('S').and_then(|number| number.parse().ok());
            let corners = at.and_then(|number| element.shape.face(number));
            let (shape, nodes): (DeckShape, Vec<u32>) = match corners {
                _ if whole => (element.shape, nodes.to_vec()),
                Some(corners) => {
                    let shape = match (element.shape, corners.len()) {
                        (DeckShape::Block(_), 4) => DeckShape::Block(QUADRILATERAL.kind),
                        (DeckShape::Block(_), 8) => DeckShape::Block(QUAD8.kind),
                        (DeckShape::Block(_), 3) => DeckShape::Simplex(2, 1),
                        (_, 2) => DeckShape::Simplex(2, 0),
                        (DeckShape::Simplex(3, _), _) => DeckShape::Simplex(2, 1),
                        (_, count) => DeckShape::Simplex(3, count - 3),
                    };
                    (shape, corners.iter().map(|&corner| nodes[corner]).collect())
                }
                None => {
                    let expected = "a face of the element, such as `S1`";
                    return Err(FileFault::in_line(
                        line,
                        MeshError::Expected { expected, found: excerpt(face) },
                    ));
                }
            };
            let group = groups.number(shape.dimension(), name);
            enter(cells, shape, &nodes, Place { tag: 0, line }, &[group]);
        }
        Ok(())
    }
}

/// Adds one cell.
fn enter(cells: &mut FileCells, shape: DeckShape, nodes: &[u32], place: Place, groups: &[u64]) {
    match shape {
        DeckShape::Simplex(_, 0) => cells.push(nodes, place, groups),
        DeckShape::Simplex(corners, _) => {
            let (corners, middles) = nodes.split_at(corners);
            cells.push_quadratic(corners, middles, place, groups);
        }
        DeckShape::Block(kind) => cells.push_kind(kind, nodes, place, groups),
    }
}

/// Groups by their dimension and name.
#[derive(Default)]
struct DeckGroups {
    names: Names,
    numbers: HashMap<(u8, String), u64>,
}

impl DeckGroups {
    /// Number of a group, created if it does not exist.
    fn number(&mut self, dimension: u8, name: &str) -> u64 {
        let next = self.names.len() as u64 + 1;
        let number = *self.numbers.entry((dimension, name.to_owned())).or_insert(next);
        if number == next {
            self.names.insert((dimension, number), name.to_owned());
        }
        number
    }
}

/// Adds the members on one line of a set: numbers, earlier sets, or `first, last, increment`.
fn enter_set(
    sets: &mut DeckSets,
    keyword: &Keyword,
    key: &str,
    fields: &[String],
    line: u32,
    known: &HashMap<u64, u32>,
) -> Result<(), FileFault> {
    let Some(name) = keyword.get(key) else {
        let expected = "the name of a set, `NSET=` or `ELSET=`";
        return Err(FileFault::in_line(
            keyword.line,
            MeshError::Expected { expected, found: keyword.name.clone() },
        ));
    };
    let mut members = Vec::new();
    // Members: an arithmetic sequence, or numbers and names of earlier sets.
    if keyword.has("GENERATE") {
        let of = |i: usize| fields.get(i).map_or("", String::as_str);
        let (first, last): (u64, u64) =
            (number(of(0), "the first number", line)?, number(of(1), "the last number", line)?);
        let step: u64 = if of(2).is_empty() { 1 } else { number(of(2), "an increment", line)? };
        let many = last.saturating_sub(first) / step.max(1);
        if step == 0 || many > known.len() as u64 {
            let what = "numbers that GENERATE makes, of which the deck has fewer";
            let (expected, found) = (known.len() as u64, many.saturating_add(1));
            return Err(FileFault::in_line(line, FormatError::Count { what, expected, found }));
        }
        members.extend((first..=last).step_by(step as usize).filter(|tag| known.contains_key(tag)));
    } else {
        for field in fields.iter().filter(|field| !field.is_empty()) {
            let number = field.parse().ok().filter(|tag| known.contains_key(tag));
            match (number, sets.get(field)) {
                (Some(tag), _) => members.push(tag),
                (None, Some(set)) => members.extend(&set.members),
                (None, None) => {
                    let expected =
                        "the number of something in the deck, or the name of a set before this line";
                    return Err(FileFault::in_line(
                        line,
                        MeshError::Expected { expected, found: excerpt(field) },
                    ));
                }
            }
        }
    }
    sets.members += members.len();
    // The limit stops short lines that repeat large sets.
    if sets.members > GROUPS_AT_ONCE * (known.len() + 1) {
        return Err(FileFault::in_line(line, MeshError::TooManyGroups { limit: GROUPS_AT_ONCE }));
    }
    sets.named(name).members.extend(members);
    Ok(())
}
