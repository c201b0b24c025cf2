//! Errors in the text of mesh files, beyond those that [`MeshError`](super::MeshError) has for all formats.

/// Why the content of a file is no mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// A part of the format, or a format variant, that is not read.
    #[error("{found} is not read; {supported}")]
    Unsupported {
        /// Contents of the file.
        found: String,
        /// Contents that would be read.
        supported: &'static str,
    },
    /// A file of another kind than its extension says.
    #[error("this is {found}; {advice}")]
    Other {
        /// Its kind.
        found: &'static str,
        /// Advice.
        advice: &'static str,
    },
    /// A cell that names a vertex that is not there.
    #[error("there is no vertex {number}: the file has {count}, numbered from {first}")]
    VertexNumber {
        /// The number in the file.
        number: i64,
        /// Number of vertices.
        count: u64,
        /// Number of the first vertex.
        first: u64,
    },
    /// Things are numbered one after the other in this format.
    #[error(
        "this {what} has the number {found} where {expected} comes next; number them one after the other"
    )]
    Sequence {
        /// `vertex` or `tetrahedron`.
        what: &'static str,
        /// The number that must come.
        expected: u64,
        /// The number there.
        found: u64,
    },
    /// Two counts that must agree.
    #[error("{what}: {found}, but it must be {expected}")]
    Count {
        /// The things counted.
        what: &'static str,
        /// How many there must be.
        expected: u64,
        /// How many there are.
        found: u64,
    },
    /// A coordinate that is no number.
    #[error("a coordinate is {value}; it must be a finite number")]
    NotFinite {
        /// The coordinate.
        value: f64,
    },
    /// A cell with nodes in the middle of its edges where only corners are wanted.
    #[error(
        "a {name} has nodes in the middle of its edges, and the elements of a body are of first order; set \
         `order = 2` in the body to use them, or `drop_mid_nodes = true` beside `path` to use the corners \
         only"
    )]
    SecondOrder {
        /// The cell.
        name: &'static str,
    },
    /// Cells of first and of second order in one mesh.
    #[error(
        "this cell has no nodes in the middle of its edges while others have; all cells must be of one order"
    )]
    MixedOrder,
    /// XML that is none.
    #[error("the XML is broken: {message}")]
    Xml {
        /// Message of the parser.
        message: String,
    },
    /// An array of numbers that cannot be decoded.
    #[error("the array `{array}` cannot be read: {problem}")]
    Array {
        /// Its name.
        array: String,
        /// The mistake, and what would be right.
        problem: String,
    },
}
