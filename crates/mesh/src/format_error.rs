//! Errors in the content of mesh files, beyond those of [`MeshError`](super::MeshError) for all formats.

/// Error in the content of a mesh file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// An unsupported part or variant of the format.
    #[error("{found} is not read; {supported}")]
    Unsupported {
        /// Contents of the file.
        found: String,
        /// Supported contents.
        supported: &'static str,
    },
    /// A file whose content does not match its extension.
    #[error("this is {found}; {advice}")]
    Other {
        /// Actual kind of the file.
        found: &'static str,
        /// Advice.
        advice: &'static str,
    },
    /// A cell with a vertex number out of range.
    #[error("there is no vertex {number}: the file has {count}, numbered from {first}")]
    VertexNumber {
        /// The number in the file.
        number: i64,
        /// Number of vertices.
        count: u64,
        /// Number of the first vertex.
        first: u64,
    },
    /// A gap in consecutive numbers.
    #[error("this {what} has number {found}, expected {expected}: number them consecutively")]
    Sequence {
        /// `vertex` or `tetrahedron`.
        what: &'static str,
        /// Expected number.
        expected: u64,
        /// Number found.
        found: u64,
    },
    /// Two counts that disagree.
    #[error("{what}: {found}, but it must be {expected}")]
    Count {
        /// Items counted.
        what: &'static str,
        /// Expected count.
        expected: u64,
        /// Count found.
        found: u64,
    },
    /// A coordinate that is not finite.
    #[error("a coordinate is {value}; it must be a finite number")]
    NotFinite {
        /// The coordinate.
        value: f64,
    },
    /// A cell with mid-edge nodes where only corners are accepted.
    #[error(
        "a {name} has nodes in the middle of its edges, and the elements of a body are of first order; set \
         `order = 2` in the body to use them, or `drop_mid_nodes = true` next to `path` to use the corners \
         only"
    )]
    SecondOrder {
        /// The cell.
        name: &'static str,
    },
    /// Cells of first and second order in one mesh.
    #[error("this cell has no mid-edge nodes, but others have; all cells must be of one order")]
    MixedOrder,
    /// Malformed XML.
    #[error("the XML is broken: {message}")]
    Xml {
        /// Message of the parser.
        message: String,
    },
    /// An array of numbers that cannot be decoded.
    #[error("the array `{array}` cannot be read: {problem}")]
    Array {
        /// Name of the array.
        array: String,
        /// The mistake and the remedy.
        problem: String,
    },
}
