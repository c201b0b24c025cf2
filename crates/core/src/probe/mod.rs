//! Probes: material points of bodies that are tracked through a run.

mod table;

pub use table::{Table, TableColumn, columns, row, titles, written_at};

use crate::diagnostics::{ElementState, Measure, NODAL_MEASURES, SymmetricTensor};
use crate::observer::{Frame, Quantities};

/// A point with fixed weights of vertices: `x = sum_a w_a x_a`.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Name.
    pub name: String,
    /// Body of the probe.
    pub body: String,
    /// Vertices that carry the point, as frames number them.
    pub vertices: Vec<u32>,
    /// Weights of the vertices, which sum to 1.
    pub weights: Vec<f64>,
    /// Reference position [m]; in 2D the third component is 0.
    pub rest: [f64; 3],
    /// Index in [`Frame::points`], for a point in a finite element.
    pub point: Option<usize>,
    /// True if readings have the recovered stress, interpolated from these vertices.
    pub reads_nodal_stress: bool,
}

/// Reading of a probe in one frame.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Reading {
    /// Simulated time [s].
    pub time: f64,
    /// Position [m]; in 2D the third component is 0, here and below.
    pub position: [f64; 3],
    /// Velocity [m/s].
    pub velocity: [f64; 3],
    /// Displacement from the reference position [m].
    pub displacement: [f64; 3],
    /// Green strain: xx, yy, zz, xy, yz, xz; `None` outside of finite elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub green_strain: Option<[f64; 6]>,
    /// Corotated strain `S - I`, `F = R S`: xx, yy, zz, xy, yz, xz; `None` outside of finite elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corotated_strain: Option<[f64; 6]>,
    /// Cauchy stress [Pa]: xx, yy, zz, xy, yz, xz; `None` outside of finite elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cauchy_stress: Option<[f64; 6]>,
    /// Strain energy density [J/m^3]; `None` outside of finite elements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_density: Option<f64>,
    /// Cauchy stress recovered at vertices and interpolated [Pa]: xx, yy, zz, xy, yz, xz; `None` if the probe
    /// does not read it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodal_stress: Option<SymmetricTensor>,
    /// Von Mises stress of `nodal_stress` [Pa].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodal_von_mises: Option<f64>,
}

impl Probe {
    /// Returns the quantities of a frame that a reading needs.
    pub fn quantities(&self) -> Quantities {
        Quantities::STATE
            | Quantities::POINTS.only_if(self.point.is_some())
            | Quantities::NODAL_STRESS.only_if(self.reads_nodal_stress)
    }

    /// Reads the probe in a frame with the [`quantities`](Self::quantities).
    pub fn read(&self, frame: &Frame<'_>) -> Reading {
        let position = self.mix(frame.x, frame.dimension);
        let mut displacement = position;
        displacement.iter_mut().zip(self.rest).for_each(|(u, rest)| *u -= rest);
        let state = self.point.and_then(|point| frame.points?.get(point));
        let nodal_stress = frame.nodal_stress.filter(|_| self.reads_nodal_stress);
        let nodal_stress = nodal_stress.map(|stress| self.mixed(|vertex| &stress[vertex]));
        Reading {
            time: frame.time,
            position,
            velocity: self.mix(frame.v, frame.dimension),
            displacement,
            green_strain: state.and_then(|state| measured("green-strain", state)),
            corotated_strain: state.and_then(|state| measured("corotated-strain", state)),
            cauchy_stress: state.and_then(|state| measured("cauchy-stress", state)),
            energy_density: state.map(|state| state.energy_density),
            nodal_stress,
            nodal_von_mises: nodal_stress.and_then(|stress| von_mises(&stress)),
        }
    }

    /// Weighted sum of rows of a flat array.
    fn mix(&self, rows: &[f64], dimension: usize) -> [f64; 3] {
        self.mixed(|vertex| &rows[vertex * dimension..][..dimension])
    }

    /// Weighted sum of the rows of the vertices.
    fn mixed<'a, const N: usize>(&self, row: impl Fn(usize) -> &'a [f64]) -> [f64; N] {
        let mut sum = [0.0; N];
        for (&vertex, weight) in self.vertices.iter().zip(&self.weights) {
            sum.iter_mut().zip(row(vertex as usize)).for_each(|(sum, value)| *sum += weight * value);
        }
        sum
    }
}

/// Returns the quantities of a frame that readings of these probes need.
pub fn quantities(probes: &[Probe]) -> Quantities {
    probes.iter().map(Probe::quantities).collect()
}

fn von_mises(stress: &SymmetricTensor) -> Option<f64> {
    let mut numbers = Vec::with_capacity(1);
    NODAL_MEASURES[0].write(stress, &mut numbers);
    numbers.pop()
}

fn measured(name: &str, state: &ElementState) -> Option<[f64; 6]> {
    let mut numbers = Vec::with_capacity(6);
    Measure::named(name)?.write(state, &mut numbers);
    numbers.try_into().ok()
}
