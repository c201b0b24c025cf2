//! Solids from surfaces.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FileSpec;
use pliant::value::*;

/// A solid from the closed surface of a file: its inside is filled with tetrahedra whose corners lie on the
/// surface, all dihedral angles between 10.7 and 164.8 degrees, or with whole cubes. Exactly one of `cells`
/// and `spacing`. Groups: `surface`, and those of triangles in the file.
///
/// The surface must be closed, counter-clockwise seen from outside, and cross itself nowhere; those of
/// cavities are clockwise. Of a file with solid cells it is their boundary. It is cleaned by the same keys
/// as `file`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceSpec {
    /// Path, relative to the scene file: any format that `file` reads.
    pub path: PathBuf,
    /// Number of cells along the longest side of the box around the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub cells: Option<usize>,
    /// Edge length of a cell [m], in coordinates of the file, before any `transform`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub spacing: Option<f64>,
    /// Elements; `tetrahedron` without it. Hexahedra are whole cubes whose middle is inside: their boundary
    /// is stairs, and their volume is not that of the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<SolidElement>,
    /// False if the surface of the file does not ride along: recordings then hold, and pictures show, the
    /// boundary of the elements.
    #[serde(default = "rides_along", skip_serializing_if = "Clone::clone")]
    pub skin: bool,
    /// True if parts of the surface may overlap: inside is what any of them encloses.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub union: bool,
    /// True if only the corners of cells of second order are used; without it such cells are an error.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub drop_mid_nodes: bool,
    /// Vertices no farther than this from one before them in the file become that one [m]; 0 for those at
    /// exactly the same place. In coordinates of the file, before any `transform`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("minimum" = 0.0))]
    pub merge: Option<f64>,
    /// True if triangles without an area are left out, those that name a vertex twice, and those that repeat
    /// another.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub drop_degenerate: bool,
    /// True if vertices that no triangle uses are left out.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub drop_unused: bool,
    /// True if triangles are turned counter-clockwise, seen from outside, in each piece by itself.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub orient: bool,
}

/// Element that a surface is filled with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SolidElement {
    /// 4 nodes, fitted to the surface.
    #[default]
    Tetrahedron,
    /// 8 nodes, whole cubes.
    Hexahedron,
}

fn rides_along() -> bool {
    true
}

impl Default for SurfaceSpec {
    fn default() -> Self {
        SurfaceSpec {
            path: PathBuf::new(),
            cells: None,
            spacing: None,
            element: None,
            skin: true,
            union: false,
            drop_mid_nodes: false,
            merge: None,
            drop_degenerate: false,
            drop_unused: false,
            orient: false,
        }
    }
}

impl SurfaceSpec {
    /// Elements, where the scene does not say.
    pub fn element_or_default(&self) -> SolidElement {
        self.element.unwrap_or_default()
    }

    /// How its file is read.
    pub(crate) fn file(&self) -> FileSpec {
        FileSpec {
            path: self.path.clone(),
            drop_mid_nodes: self.drop_mid_nodes,
            merge: self.merge,
            drop_degenerate: self.drop_degenerate,
            drop_unused: self.drop_unused,
            orient: self.orient,
        }
    }
}
