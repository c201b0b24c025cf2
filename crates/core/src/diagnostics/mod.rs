//! What is measured of a state: energies, momenta, the worst element; and the stability limit of a step.

/// Measurements of one state. Sums run over all vertices in index order.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Diagnostics {
    /// Simulated time [s].
    pub time: f64,
    /// `sum 1/2 m |v|^2` [J].
    pub kinetic: f64,
    /// Energy of all elements and springs [J].
    pub elastic: f64,
    /// `-sum m g.x` plus the mutual energy of gravitating bodies [J].
    pub gravitational: f64,
    /// Sum of the above [J].
    pub total: f64,
    /// `sum m v` [kg m/s]; third component 0 in 2D.
    pub linear_momentum: [f64; 3],
    /// `sum m x cross v` about the origin [kg m^2/s]; in 2D only the third component.
    pub angular_momentum: [f64; 3],
    /// Smallest `det F` of any element; `None` without elements.
    pub min_j: Option<f64>,
    /// Number of elements with `det F <= 0`; `None` without elements.
    pub inverted: Option<u64>,
}
