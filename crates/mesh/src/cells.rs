//! Cells as a reader finds them: by dimension, with their positions in the file, named groups and
//! mid-edge nodes.

use std::collections::BTreeMap;

use super::file::{FileMesh, Place};
use super::quadratic::MidNodes;
use super::tokens::FileFault;
use super::topology::firsts;
use super::{FormatError, Group, Mesh};
use pliant::element::{CellBlock, CellKind};

/// Names of groups, by dimension and number.
pub(super) type Names = BTreeMap<(u8, u64), String>;

/// Number of the group of simplices with reference `number` in the file, named `triangle_3` and the like.
pub(super) fn reference(names: &mut Names, dimension: u8, number: i64) -> u64 {
    let kind = ["vertex", "edge", "triangle", "tetrahedron"][usize::from(dimension.min(3))];
    // Negative numbers stay distinct from positive ones.
    named(names, dimension, kind, number, number as u64)
}

/// Number of the group of cells of this kind with reference `number`, named `hexahedron_3` and the like.
/// It differs from the group of simplices with the same dimension and reference.
pub(super) fn block_reference(names: &mut Names, kind: &CellKind, number: i64) -> u64 {
    named(names, kind.dimension as u8, kind.name, number, number as u64 ^ (1 << 62))
}

fn named(names: &mut Names, dimension: u8, kind: &str, number: i64, key: u64) -> u64 {
    names.entry((dimension, key)).or_insert_with(|| format!("{kind}_{number}"));
    key
}

/// Mid-edge nodes of a cell in the order of [`quadratic`](super::quadratic), padded with zeros.
type Middles = [u32; 6];

/// Cells with `N` corners.
#[derive(Debug)]
pub(super) struct CellsOf<const N: usize> {
    pub vertices: Vec<[u32; N]>,
    pub places: Vec<Place>,
    /// Mid-edge nodes of each cell, `None` for a first-order cell; empty if all are of first order.
    middles: Vec<Option<Middles>>,
    /// Cells of each group, ascending.
    pub groups: BTreeMap<u64, Vec<u32>>,
}

impl<const N: usize> Default for CellsOf<N> {
    fn default() -> Self {
        CellsOf { vertices: Vec::new(), places: Vec::new(), middles: Vec::new(), groups: BTreeMap::new() }
    }
}

impl<const N: usize> CellsOf<N> {
    fn push(&mut self, vertices: [u32; N], middles: &[u32], place: Place, groups: &[u64]) {
        let cell = self.vertices.len() as u32;
        if !middles.is_empty() {
            let mut padded = Middles::default();
            padded[..middles.len()].copy_from_slice(middles);
            // Earlier first-order cells have no mid-edge nodes.
            self.middles.resize(self.vertices.len(), None);
            self.middles.push(Some(padded));
        } else if !self.middles.is_empty() {
            self.middles.push(None);
        }
        self.vertices.push(vertices);
        self.places.push(place);
        for &group in groups {
            self.groups.entry(group).or_default().push(cell);
        }
    }

    /// Mid-edge nodes of a cell; empty for a first-order cell.
    fn middles_of(&self, cell: usize) -> &[u32] {
        let middles = self.middles.get(cell).and_then(Option::as_ref);
        middles.map_or(&[], |middles| &middles[..N * (N - 1) / 2])
    }

    /// Mid-edge nodes of all cells.
    fn all_middles(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.middles.len()).flat_map(|cell| self.middles_of(cell).iter().copied())
    }

    fn merge_repeated(&mut self) {
        // Maps every cell to the first one with the same vertices.
        let first = firsts(&self.vertices, &[]);
        let mut kept = 0;
        let mut index = vec![0_u32; first.len()];
        for cell in 0..first.len() {
            if first[cell] as usize == cell {
                index[cell] = kept as u32;
                self.vertices[kept] = self.vertices[cell];
                self.places[kept] = self.places[cell];
                if let Some(&middles) = self.middles.get(cell) {
                    self.middles[kept] = middles;
                }
                kept += 1;
            } else {
                let at = index[first[cell] as usize];
                index[cell] = at;
                // A first-order cell gains the mid-edge nodes of a repeated cell of second order.
                if let Some(&middles) = self.middles.get(cell) {
                    self.middles[at as usize] = self.middles[at as usize].or(middles);
                }
            }
        }
        self.vertices.truncate(kept);
        self.places.truncate(kept);
        self.middles.truncate(kept);
        for cells in self.groups.values_mut() {
            cells.iter_mut().for_each(|cell| *cell = index[*cell as usize]);
            cells.sort_unstable();
            cells.dedup();
        }
    }

    fn renumber(&mut self, index: &[u32]) {
        self.middles.clear();
        self.vertices.iter_mut().flatten().for_each(|vertex| *vertex = index[*vertex as usize]);
    }
}

/// Cells of one kind other than simplices.
#[derive(Debug)]
pub(super) struct BlockOf {
    block: CellBlock,
    places: Vec<Place>,
    /// Cells of each group, ascending.
    groups: BTreeMap<u64, Vec<u32>>,
}

impl BlockOf {
    /// Merges cells with the same vertices.
    fn merge_repeated(&mut self) {
        let nodes = self.block.kind.nodes;
        let mut known: BTreeMap<Vec<u32>, u32> = BTreeMap::new();
        let mut index = Vec::with_capacity(self.block.len());
        for vertices in self.block.cells() {
            let mut key = vertices.to_vec();
            key.sort_unstable();
            let next = known.len() as u32;
            index.push(*known.entry(key).or_insert(next));
        }
        let (mut vertices, mut places) = (Vec::new(), Vec::new());
        for (cell, number) in index.iter().enumerate() {
            // First cell with these vertices.
            if *number as usize == places.len() {
                vertices.extend_from_slice(&self.block.vertices[cell * nodes..][..nodes]);
                places.push(self.places[cell]);
            }
        }
        (self.block.vertices, self.places) = (vertices, places);
        for cells in self.groups.values_mut() {
            cells.iter_mut().for_each(|cell| *cell = index[*cell as usize]);
            cells.sort_unstable();
            cells.dedup();
        }
    }
}

/// Cells of every dimension.
#[derive(Debug, Default)]
pub(super) struct FileCells {
    pub points: CellsOf<1>,
    pub lines: CellsOf<2>,
    pub triangles: CellsOf<3>,
    pub tetrahedra: CellsOf<4>,
    /// Cells other than simplices, by kind.
    pub blocks: Vec<BlockOf>,
    /// True if lines are springs even next to triangles, as in formats without solids.
    pub lines_are_springs: bool,
    /// Positions of the first cell of first order (points excepted) and of the first of second order,
    /// with its name.
    first_order: Option<Place>,
    second_order: Option<(Place, &'static str)>,
}

impl FileCells {
    /// Adds a first-order simplex with one to four vertices.
    pub(super) fn push(&mut self, vertices: &[u32], place: Place, groups: &[u64]) {
        if vertices.len() > 1 {
            self.first_order.get_or_insert(place);
        }
        self.enter(vertices, &[], place, groups);
    }

    /// Adds a cell of another kind.
    pub(super) fn push_kind(
        &mut self,
        kind: &'static CellKind,
        vertices: &[u32],
        place: Place,
        groups: &[u64],
    ) {
        match kind.order() {
            1 => _ = self.first_order.get_or_insert(place),
            _ => _ = self.second_order.get_or_insert((place, kind.name)),
        }
        let known = self.blocks.iter().position(|of| of.block.kind == kind);
        let known = known.unwrap_or_else(|| {
            let block = CellBlock { kind, vertices: Vec::new() };
            self.blocks.push(BlockOf { block, places: Vec::new(), groups: BTreeMap::new() });
            self.blocks.len() - 1
        });
        let of = &mut self.blocks[known];
        let cell = of.places.len() as u32;
        of.block.vertices.extend_from_slice(vertices);
        of.places.push(place);
        groups.iter().for_each(|group| of.groups.entry(*group).or_default().push(cell));
    }

    /// Adds a second-order simplex: two to four corners, then the mid-edge nodes in the order of
    /// [`quadratic`](super::quadratic).
    pub(super) fn push_quadratic(&mut self, corners: &[u32], middles: &[u32], place: Place, groups: &[u64]) {
        let name = match corners.len() {
            2 => "3-node line",
            3 => "6-node triangle",
            _ => "10-node tetrahedron",
        };
        self.second_order.get_or_insert((place, name));
        self.enter(corners, middles, place, groups);
    }

    fn enter(&mut self, vertices: &[u32], middles: &[u32], place: Place, groups: &[u64]) {
        match *vertices {
            [a] => self.points.push([a], middles, place, groups),
            [a, b] => self.lines.push([a, b], middles, place, groups),
            [a, b, c] => self.triangles.push([a, b, c], middles, place, groups),
            [a, b, c, d] => self.tetrahedra.push([a, b, c, d], middles, place, groups),
            _ => {}
        }
    }

    /// Merges cells with the same corners into one that belongs to all their groups: some formats write a
    /// cell once for each of its groups.
    pub(super) fn merge_repeated(&mut self) {
        self.points.merge_repeated();
        self.lines.merge_repeated();
        self.triangles.merge_repeated();
        self.tetrahedra.merge_repeated();
        self.blocks.iter_mut().for_each(BlockOf::merge_repeated);
    }

    /// Assembles the mesh of the file: `xyz` is flat `(n, 3)` [m], `vertices` are the vertices' positions
    /// in the file. Groups without a name are named by their number.
    ///
    /// # Errors
    /// Second-order cells unless `mid_nodes` says how to treat them; cells of both orders.
    pub(super) fn into_file(
        mut self,
        mut xyz: Vec<f64>,
        mut vertices: Vec<Place>,
        names: &Names,
        mid_nodes: MidNodes,
    ) -> Result<FileMesh, FileFault> {
        match (self.first_order, self.second_order, mid_nodes) {
            (_, None, _) => {}
            (_, Some((place, name)), MidNodes::Refuse) => {
                return Err(FileFault::at(place, FormatError::SecondOrder { name }));
            }
            (_, Some(_), MidNodes::Drop) => self.drop_middles(&mut xyz, &mut vertices),
            (Some(place), Some(_), MidNodes::Keep) => {
                return Err(FileFault::at(place, FormatError::MixedOrder));
            }
            (None, Some(_), MidNodes::Keep) => {}
        }
        Ok(self.assemble(xyz, vertices, names))
    }

    /// Drops mid-edge nodes that are not corners of any cell.
    fn drop_middles(&mut self, xyz: &mut Vec<f64>, places: &mut Vec<Place>) {
        let count = places.len();
        let mut dropped = vec![false; count];
        let middles = self.lines.all_middles().chain(self.triangles.all_middles());
        let middles = middles.chain(self.tetrahedra.all_middles());
        let of_blocks = self
            .blocks
            .iter()
            .flat_map(|of| of.block.cells().flat_map(|cell| &cell[of.block.kind.corners..]));
        let middles = middles.chain(of_blocks.copied());
        middles.for_each(|vertex| dropped[vertex as usize] = true);
        let corners = self.points.vertices.as_flattened().iter();
        let corners = corners.chain(self.lines.vertices.as_flattened());
        let corners = corners.chain(self.triangles.vertices.as_flattened());
        let corners = corners.chain(self.tetrahedra.vertices.as_flattened());
        self.blocks.iter_mut().for_each(|of| of.block = of.block.of_first_order());
        let corners = corners.chain(self.blocks.iter().flat_map(|of| &of.block.vertices));
        corners.for_each(|&vertex| dropped[vertex as usize] = false);
        let (mut index, mut kept) = (vec![0_u32; count], 0);
        for vertex in 0..count {
            index[vertex] = kept as u32;
            if !dropped[vertex] {
                xyz.copy_within(3 * vertex..3 * vertex + 3, 3 * kept);
                places[kept] = places[vertex];
                kept += 1;
            }
        }
        xyz.truncate(3 * kept);
        places.truncate(kept);
        self.points.renumber(&index);
        self.lines.renumber(&index);
        self.triangles.renumber(&index);
        self.tetrahedra.renumber(&index);
        let blocks = self.blocks.iter_mut().flat_map(|of| &mut of.block.vertices);
        blocks.for_each(|vertex| *vertex = index[*vertex as usize]);
    }

    fn assemble(self, xyz: Vec<f64>, vertices: Vec<Place>, names: &Names) -> FileMesh {
        let mut groups = BTreeMap::new();
        // Groups without cells keep their names, so that a message can tell "empty" from "unknown".
        for ((dimension, _), name) in names {
            let group = Group { topological_dimension: usize::from(*dimension), ..Group::default() };
            groups.insert(name.clone(), group);
        }
        enter(&mut groups, &self.points, 0, names);
        enter(&mut groups, &self.lines, 1, names);
        enter(&mut groups, &self.triangles, 2, names);
        enter(&mut groups, &self.tetrahedra, 3, names);
        let mut blocks: Vec<&BlockOf> = self.blocks.iter().collect();
        blocks.sort_by_key(|of| of.block.kind.dimension);
        blocks.into_iter().for_each(|of| enter_block(&mut groups, of, names));
        for group in groups.values_mut() {
            for indices in [&mut group.cells, &mut group.vertices] {
                indices.sort_unstable();
                indices.dedup();
            }
        }
        // The mesh, with the positions of its cells in the file.
        let FileCells { lines, triangles, tetrahedra, blocks, lines_are_springs, .. } = self;
        let mut file = FileMesh { xyz, vertices, ..FileMesh::default() };
        file.mesh = Mesh {
            triangle_middles: triangles.middles.iter().flatten().map(|&[a, b, c, ..]| [a, b, c]).collect(),
            tetrahedron_middles: tetrahedra.middles.into_iter().flatten().collect(),
            triangles: triangles.vertices,
            tetrahedra: tetrahedra.vertices,
            groups,
            ..Mesh::default()
        };
        for BlockOf { block, places, .. } in blocks {
            file.mesh.blocks.push(block);
            file.blocks.push(places);
        }
        file.triangles = triangles.places;
        file.tetrahedra = tetrahedra.places;
        // Lines are springs in formats without solids, and in files without other cells.
        let only_lines =
            file.mesh.triangles.is_empty() && file.mesh.tetrahedra.is_empty() && file.mesh.blocks.is_empty();
        if lines_are_springs || only_lines {
            file.mesh.edges = lines.vertices;
            file.edges = lines.places;
        } else {
            file.mesh.lines = lines.vertices;
            file.lines = lines.places;
        }
        file
    }
}

/// Adds the groups of a block. Called after those of simplices, with ascending dimensions: a name used in
/// several dimensions keeps the cells of the highest.
fn enter_block(groups: &mut BTreeMap<String, Group>, of: &BlockOf, names: &Names) {
    let (dimension, nodes) = (of.block.kind.dimension, of.block.kind.nodes);
    for (&tag, members) in &of.groups {
        let name = names.get(&(dimension as u8, tag)).cloned().unwrap_or_else(|| tag.to_string());
        let group = groups.entry(name).or_default();
        for &cell in members {
            group.vertices.extend(&of.block.vertices[cell as usize * nodes..][..nodes]);
        }
        if group.topological_dimension > dimension && !group.cells.is_empty() {
            continue;
        }
        if group.topological_dimension != dimension {
            group.cells.clear();
            group.topological_dimension = dimension;
        }
        group.cells.extend(members);
    }
}

/// Adds the groups of one dimension. Called with ascending dimensions: the highest dimension wins.
fn enter<const N: usize>(
    groups: &mut BTreeMap<String, Group>,
    cells: &CellsOf<N>,
    dimension: u8,
    names: &Names,
) {
    for (&tag, members) in &cells.groups {
        let name = names.get(&(dimension, tag)).cloned().unwrap_or_else(|| tag.to_string());
        let group = groups.entry(name).or_default();
        if group.topological_dimension != usize::from(dimension) {
            group.cells.clear();
            group.topological_dimension = usize::from(dimension);
        }
        for &cell in members {
            group.vertices.extend(cells.vertices[cell as usize]);
            group.vertices.extend(cells.middles_of(cell as usize));
        }
        if dimension == 0 {
            group.cells.extend(members.iter().map(|&cell| cells.vertices[cell as usize][0]));
        } else {
            group.cells.extend(members);
        }
    }
}
