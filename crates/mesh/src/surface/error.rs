//! Errors in surfaces that cannot be filled with a solid mesh.

use pliant::quantity::{Rounded, counted};
/// Error of a surface that cannot be filled with a solid. Triangles and vertices count from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// A mesh without a surface.
    #[error(
        "the file has no triangles but {count} {found}: a solid is made from a closed surface of \
         triangles, or from a solid mesh, whose boundary is one"
    )]
    NoTriangles {
        /// `edges` or `points`.
        found: &'static str,
        /// Number of them.
        count: usize,
    },
    /// Edges with a triangle on one side only.
    #[error(
        "the surface is open: {count} of its edges have one triangle, the first from vertex {} to {} of \
         triangle {triangle}, at {}; close its holes (in Blender: fill holes), or join vertices at the \
         same position by `merge` next to `path`", edge[0], edge[1], at(place)
    )]
    Open {
        /// The triangle.
        triangle: usize,
        /// The edge, in the direction of the triangle.
        edge: [u32; 2],
        /// Middle of the edge [m].
        place: [f64; 3],
        /// Number of such edges.
        count: usize,
    },
    /// Two neighbouring triangles with opposite orientations.
    #[error(
        "triangle {triangle} and its neighbour at the edge from vertex {} to {}, at {}, have opposite \
         orientations: every triangle must be counter-clockwise seen from outside; `orient = true` next to \
         `path` turns the others", edge[0], edge[1], at(place)
    )]
    OppositeSides {
        /// The first triangle.
        triangle: usize,
        /// Common edge.
        edge: [u32; 2],
        /// Middle of the edge [m].
        place: [f64; 3],
    },
    /// An edge of more than two triangles that do not pair up.
    #[error(
        "{count} triangles meet at the edge from vertex {} to {} of triangle {triangle}, at {}, and \
         their orientations there do not pair up: inside and outside are undefined; remove what does not \
         belong to the surface", edge[0], edge[1], at(place)
    )]
    OddEdge {
        /// The first triangle.
        triangle: usize,
        /// Common edge.
        edge: [u32; 2],
        /// Middle of the edge [m].
        place: [f64; 3],
        /// Number of triangles at the edge.
        count: usize,
    },
    /// A surface that encloses a negative volume.
    #[error(
        "the surface is inverted: its volume is {volume} m^3, and its triangles must be \
         counter-clockwise seen from outside; `orient = true` next to `path` turns them",
        volume = Rounded::<4>(*.volume)
    )]
    InsideOut {
        /// Signed volume [m^3].
        volume: f64,
    },
    /// Two intersecting triangles.
    #[error(
        "triangles {} and {} of the surface cross each other, at {}{}; where parts overlap on purpose, \
         `union = true` next to `path` fills what any of them encloses", triangles[0], triangles[1],
        at(place), more(*count)
    )]
    Crossing {
        /// The triangles.
        triangles: [usize; 2],
        /// Centroid of the first [m].
        place: [f64; 3],
        /// Number of crossing pairs.
        count: usize,
    },
    /// A point with a winding number other than 0 and 1.
    #[error(
        "the surface winds {winding} times around {}: it must go around the inside once; parts that overlap \
         need `union = true` next to `path`, and the surface of a cavity must be clockwise seen from the \
         cavity's outside",
        at(place)
    )]
    Winding {
        /// Winding number.
        winding: i16,
        /// Position of the point [m].
        place: [f64; 3],
    },
    /// A part thinner than the cells.
    #[error(
        "the surface is thinner than the cells where triangle {triangle} is, at {}: cells of {spacing} \
         m leave {}; {}", at(place), away(*distance), finer(*thickness, *cells),
        spacing = Rounded::<4>(*.spacing)
    )]
    Thin {
        /// The triangle.
        triangle: usize,
        /// Centroid of the triangle [m].
        place: [f64; 3],
        /// Distance of the centroid from the solid [m]; infinite without a solid.
        distance: f64,
        /// Edge length of a cell [m].
        spacing: f64,
        /// Thickness of the part [m].
        thickness: Option<f64>,
        /// Sufficient number of cells.
        cells: usize,
    },
    /// A solid whose number of pieces differs from the surface's.
    #[error(
        "with cells of {spacing} m the solid is in {found} pieces, held together by no face, where the \
         surface encloses {expected}: it is thinner than the cells near {}, or parts are nearer to each \
         other than these; try `cells = {cells}`",
        at(place),
        spacing = Rounded::<4>(*.spacing)
    )]
    Pieces {
        /// Number of pieces that the surface encloses.
        expected: usize,
        /// Number of pieces of the solid.
        found: usize,
        /// Centroid of the smallest piece [m].
        place: [f64; 3],
        /// Edge length of a cell [m].
        spacing: f64,
        /// Number of cells that may suffice.
        cells: usize,
    },
    /// Neither or both of the keys for the cell size.
    #[error(
        "a surface takes exactly one of `cells` and `spacing`; {} given",
        if *both { "both are" } else { "none is" }
    )]
    CellsOrSpacing {
        /// True if both were given, false if none.
        both: bool,
    },
    /// Cells larger than the surface.
    #[error(
        "`spacing` is {spacing} m, and the longest side of the surface {side} m; give a smaller one",
        spacing = Rounded::<4>(*.spacing), side = Rounded::<4>(*.side)
    )]
    LargeSpacing {
        /// Edge length of a cell [m].
        spacing: f64,
        /// Longest side of the bounding box [m].
        side: f64,
    },
    /// More cells than 32-bit indices can number.
    #[error(
        "`spacing` is {spacing} m, and the longest side of the surface {side} m: {count} {what}; if the \
         file is in millimetres, give `spacing` in them too, and the body `transform = {{ scale = 1e-3 }}`",
        spacing = Rounded::<4>(*.spacing), side = Rounded::<4>(*.side)
    )]
    SmallSpacing {
        /// Edge length of a cell [m].
        spacing: f64,
        /// Longest side of the bounding box [m].
        side: f64,
        /// `vertices`, `points of the lattice`.
        what: &'static str,
        /// Number of them, saturated.
        count: u64,
    },
}

impl SurfaceError {
    /// Index of the triangle that the error names, if any.
    pub(crate) fn triangle(&self) -> Option<usize> {
        match self {
            SurfaceError::Open { triangle, .. }
            | SurfaceError::OppositeSides { triangle, .. }
            | SurfaceError::OddEdge { triangle, .. }
            | SurfaceError::Thin { triangle, .. } => Some(*triangle),
            SurfaceError::Crossing { triangles, .. } => Some(triangles[0]),
            _ => None,
        }
    }
}

/// Formats a position: `(0.1, -2, 3.5) m`, with four digits.
fn at(place: &[f64; 3]) -> String {
    let [x, y, z] = place.map(|x| format!("{x:.3e}").parse::<f64>().unwrap_or(x));
    format!("({x}, {y}, {z}) m")
}

fn more(count: usize) -> String {
    match count {
        0 | 1 => String::new(),
        count => format!(", and {}", counted(count as u64 - 1, "more pair does", "more pairs do")),
    }
}

fn away(distance: f64) -> String {
    if distance.is_finite() {
        format!("the solid {distance} m away from it", distance = Rounded::<4>(distance))
    } else {
        "no solid".to_owned()
    }
}

fn finer(thickness: Option<f64>, cells: usize) -> String {
    let thick = thickness.map_or(String::new(), |thickness| {
        format!("it is {thickness} m thick there, ", thickness = Rounded::<4>(thickness))
    });
    format!("{thick}`cells = {cells}` or more would do")
}
