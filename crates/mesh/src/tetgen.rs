//! TetGen's pair of `.node` and `.ele`, and that of Triangle:
//! <https://wias-berlin.de/software/tetgen/fformats.html>.
//!
//! Numbers start at 0 or at 1. Boundary markers of vertices become groups `vertex_3`; the first attribute
//! of cells, if it is an integer, becomes groups `tetrahedron_3` or `triangle_3`; 0 means no group.

use super::FormatError;
use super::cells::{FileCells, Names, reference};
use super::file::{FileMesh, MeshInput, Place};
use super::geometry::measure;
use super::tokens::{FileFault, Tokens};

/// Reads both files. TetGen's own tetrahedra are left-handed in this library's node order: if all are,
/// two vertices of each are exchanged. A mesh of mixed orientation stays unchanged and is rejected later.
pub(super) fn read(input: &MeshInput) -> Result<FileMesh, FileFault> {
    let (mut cells, mut names) = (FileCells::default(), Names::new());
    let nodes = Tokens::with_comments(input.nodes);
    let nodes =
        nodes_of(nodes, &mut cells, &mut names).map_err(|fault| FileFault { in_nodes: true, ..fault })?;
    elements(Tokens::with_comments(input.bytes), &nodes, &mut cells, &mut names)?;
    let left = |cell: &[u32; 4]| measure(&nodes.xyz, 3, *cell).relative < 0.0;
    if cells.tetrahedra.vertices.iter().all(left) {
        cells.tetrahedra.vertices.iter_mut().for_each(|cell| cell.swap(2, 3));
    }
    let mut file = cells.into_file(nodes.xyz, nodes.places, &names, input.mid_nodes)?;
    file.vertices_in_nodes = true;
    Ok(file)
}

struct TetgenNodes {
    xyz: Vec<f64>,
    places: Vec<Place>,
    /// Number of the first vertex, 0 or 1.
    first: u64,
}

/// Reads `count dimension attributes markers`, then `number x y [z] [attributes] [marker]`.
fn nodes_of(mut tokens: Tokens, cells: &mut FileCells, names: &mut Names) -> Result<TetgenNodes, FileFault> {
    let count: u64 = tokens.number("the number of nodes")?;
    let dimension: u64 = tokens.number("the dimension of the nodes, 2 or 3")?;
    if !(2..=3).contains(&dimension) {
        return Err(tokens.expected("the dimension of the nodes, 2 or 3", &dimension.to_string()));
    }
    let attributes: u64 = tokens.number("the number of attributes of a node")?;
    let markers: u64 = tokens.number("0, or 1 for boundary markers")?;
    let mut nodes = TetgenNodes { xyz: Vec::new(), places: Vec::new(), first: 0 };
    for vertex in 0..count {
        let number: u64 = tokens.number("the number of a node")?;
        let place = tokens.place(number);
        if vertex == 0 {
            nodes.first = number.min(1);
        }
        in_sequence(&tokens, "vertex", nodes.first + vertex, number)?;
        let axes = ["x of a node", "y of a node", "z of a node"];
        for (axis, expected) in axes.into_iter().enumerate() {
            nodes.xyz.push(if axis < dimension as usize { tokens.number(expected)? } else { 0.0 });
        }
        nodes.places.push(place);
        for _ in 0..attributes {
            tokens.number::<f64>("an attribute of a node")?;
        }
        if markers > 0 {
            let marker: i64 = tokens.number("the boundary marker of a node")?;
            if marker != 0 {
                cells.push(&[vertex as u32], place, &[reference(names, 0, marker)]);
            }
        }
    }
    Ok(nodes)
}

/// Reads `count corners attributes`, then `number corners [attributes]`.
fn elements(
    mut tokens: Tokens,
    nodes: &TetgenNodes,
    cells: &mut FileCells,
    names: &mut Names,
) -> Result<(), FileFault> {
    let count: u64 = tokens.number("the number of elements")?;
    let corners: usize = tokens.number("the number of nodes of an element")?;
    if !(3..=4).contains(&corners) {
        let found = format!("an element with {corners} nodes");
        let supported = "triangles with 3 and tetrahedra with 4 nodes are";
        return Err(tokens.fault(FormatError::Unsupported { found, supported }));
    }
    let attributes: u64 = tokens.number("the number of attributes of an element")?;
    for element in 0..count {
        let number: u64 = tokens.number("the number of an element")?;
        let place = tokens.place(number);
        in_sequence(&tokens, "element", nodes.first + element, number)?;
        let mut vertices = [0_u32; 4];
        for vertex in &mut vertices[..corners] {
            let number: i64 = tokens.number("the number of a node")?;
            let index = u64::try_from(number).ok().and_then(|number| number.checked_sub(nodes.first));
            let count = nodes.places.len() as u64;
            *vertex = match index {
                Some(index) if index < count => index as u32,
                _ => {
                    let first = nodes.first;
                    return Err(tokens.fault(FormatError::VertexNumber { number, count, first }));
                }
            };
        }
        // The first attribute is the group.
        let mut group = 0;
        for attribute in 0..attributes {
            let value: f64 = tokens.number("an attribute of an element")?;
            if attribute == 0 && value.fract() == 0.0 {
                group = value as i64;
            }
        }
        let groups = [if group == 0 { 0 } else { reference(names, corners as u8 - 1, group) }];
        cells.push(&vertices[..corners], place, if group == 0 { &[] } else { &groups });
    }
    Ok(())
}

fn in_sequence(tokens: &Tokens, what: &'static str, expected: u64, found: u64) -> Result<(), FileFault> {
    if found == expected {
        Ok(())
    } else {
        Err(tokens.fault(FormatError::Sequence { what, expected, found }))
    }
}
