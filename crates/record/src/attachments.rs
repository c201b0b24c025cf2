//! Attachments and metadata at the beginning of a recording: scene, topology, units and counts.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::McapResult;
use serde::{Deserialize, Serialize};

use super::container::Container;
use super::{FORMAT_VERSION, LIBRARY, Options};
use pliant::element::CellBlock;
use pliant::topology::{BodyKind, BodyTopology, Skin, Topology};

/// Name of the metadata record.
pub(super) const METADATA: &str = "pliant";
/// Name of the attachment with the scene's text.
pub(super) const SCENE: &str = "scene.toml";
/// Name of the attachment with the reference positions.
pub(super) const REST: &str = "rest.f64";
/// Name of the attachment with the masses of vertices.
pub(super) const MASS: &str = "mass.f64";

/// Summary of a body, stored in files and shown by `info`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BodySummary {
    /// Name.
    pub name: String,
    /// Kind of its elements.
    pub kind: BodyKind,
    /// First vertex.
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertices: u32,
    /// Number of springs and segments.
    pub edges: usize,
    /// Number of triangles that are elements.
    pub triangles: usize,
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Elements that are not simplices, by kind.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockSummary>,
}

/// Summary of the elements of one kind, stored in files and shown by `info`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockSummary {
    /// Name of the kind, such as `hexahedron`.
    pub kind: String,
    /// Number of elements.
    pub cells: usize,
}

impl From<&BodyTopology> for BodySummary {
    fn from(body: &BodyTopology) -> Self {
        BodySummary {
            name: body.name.clone(),
            kind: body.kind,
            first_vertex: body.vertices.start,
            vertices: body.vertices.end.saturating_sub(body.vertices.start),
            edges: body.edges.len(),
            triangles: body.triangles.len(),
            tetrahedra: body.tetrahedra.len(),
            blocks: body.blocks.iter().map(BlockSummary::from).collect(),
        }
    }
}

impl From<&CellBlock> for BlockSummary {
    fn from(block: &CellBlock) -> Self {
        BlockSummary { kind: block.kind.name.to_owned(), cells: block.len() }
    }
}

/// Writes metadata and attachments.
pub(super) fn write<W: Write + Seek>(
    container: &mut Container<W>,
    options: &Options,
    topology: &Topology,
) -> McapResult<()> {
    container.metadata(METADATA, metadata(options, topology))?;
    let binary = "application/octet-stream";
    if !options.scene_text.is_empty() {
        container.attach(SCENE, "application/toml", Cow::Borrowed(options.scene_text.as_bytes()))?;
    }
    for (name, numbers) in [(REST, &topology.rest_positions), (MASS, &topology.masses)] {
        if !numbers.is_empty() {
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            container.attach(name, binary, Cow::Owned(bytes))?;
        }
    }
    for body in &topology.bodies {
        let blocks = body.blocks.iter().map(|block| (Cow::Borrowed(&block.vertices[..]), block.kind.suffix));
        for (cells, suffix) in &cells_of(body).into_iter().chain(blocks).collect::<Vec<_>>() {
            if !cells.is_empty() {
                let bytes: Vec<u8> = cells.iter().flat_map(|index| index.to_le_bytes()).collect();
                container.attach(
                    &format!("topology/{}.{suffix}.u32", body.name),
                    binary,
                    Cow::Owned(bytes),
                )?;
            }
        }
        if let Some(skin) = &body.skin {
            write_skin(container, &body.name, skin)?;
        }
    }
    Ok(())
}

/// Writes the triangles of an embedded surface, the element of each, and `width` nodes and weights for
/// each vertex.
fn write_skin<W: Write + Seek>(container: &mut Container<W>, name: &str, skin: &Skin) -> McapResult<()> {
    let lists = [
        (skin.triangles.as_flattened(), "skin"),
        (&skin.elements[..], "skin_element"),
        (&skin.nodes[..], "skin_node"),
    ];
    let mut attach = |suffix: &str, bytes: Vec<u8>| {
        let name = format!("topology/{name}.{suffix}");
        container.attach(&name, "application/octet-stream", Cow::Owned(bytes))
    };
    for (list, suffix) in lists {
        attach(&format!("{suffix}.u32"), list.iter().flat_map(|number| number.to_le_bytes()).collect())?;
    }
    attach("skin_weight.f64", skin.weights.iter().flat_map(|weight| weight.to_le_bytes()).collect())
}

fn cells_of(body: &BodyTopology) -> [(Cow<'_, [u32]>, &'static str); 4] {
    // Stored once: the surface of cloth and of 2D bodies consists of all of their triangles.
    let surface = if body.surface == body.triangles { &[] } else { body.surface.as_slice() };
    let (triangles, tetrahedra) = (body.triangles.as_flattened(), body.tetrahedra.as_flattened());
    [
        (Cow::Borrowed(body.edges.as_flattened()), "edge"),
        match body.triangle_middles.as_slice() {
            [] => (Cow::Borrowed(triangles), "tri"),
            middles => (Cow::Owned(joined(&body.triangles, middles)), "tri6"),
        },
        match body.tetrahedron_middles.as_slice() {
            [] => (Cow::Borrowed(tetrahedra), "tet"),
            middles => (Cow::Owned(joined(&body.tetrahedra, middles)), "tet10"),
        },
        (Cow::Borrowed(surface.as_flattened()), "surface"),
    ]
}

/// Corners and midside nodes of each element, one after the other.
fn joined<const A: usize, const B: usize>(corners: &[[u32; A]], middles: &[[u32; B]]) -> Vec<u32> {
    corners
        .iter()
        .zip(middles)
        .flat_map(|(corners, middles)| corners.iter().chain(middles))
        .copied()
        .collect()
}

fn metadata(options: &Options, topology: &Topology) -> BTreeMap<String, String> {
    let bodies: Vec<BodySummary> = topology.bodies.iter().map(BodySummary::from).collect();
    let up = if topology.dimension == 2 { "+y" } else { "+z" };
    let own = [
        ("format_version", FORMAT_VERSION.to_string()),
        ("library", LIBRARY.to_owned()),
        ("units", "SI: m, kg, s".to_owned()),
        ("up", up.to_owned()),
        ("dtype", "<f8".to_owned()),
        ("dimension", topology.dimension.to_string()),
        ("vertex_count", topology.vertex_count.to_string()),
        // Strings and integers always have a JSON form.
        ("bodies", serde_json::to_string(&bodies).unwrap_or_default()),
    ];
    let mut metadata: BTreeMap<String, String> =
        own.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
    metadata.extend(options.metadata.clone());
    if let Some(title) = &options.title {
        metadata.insert("title".to_owned(), title.clone());
    }
    metadata
}
