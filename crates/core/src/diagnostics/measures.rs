//! Element quantities that can be recorded, by name: deformation, and the strains and stresses derived
//! from it.
//!
//! # How to add one
//! 1. Add a row to `MEASURES`: name, unit, components, and how it is computed from an `ElementState`.
//! 2. Add its entry to `channels!` in `crates/scene/src/schema/channel.rs`, with the same name and no
//!    sentences. Recordings, exports, colours of pictures and probes know it from there.
//! 3. Compare it with closed forms in `tests/engine/element_state.rs`, and print the scene format anew.
//!
//! Measures of recovered stresses are in `NODAL_MEASURES`, those of their error in `ERROR_MEASURE`, those of
//! contact in `CONTACT_MEASURES`.

use crate::algebra::Mat;
use crate::element::{ElementState, von_mises};
use crate::energy::ContactShare;

/// A measure of deformation, strain or stress, computed from a `T`.
#[derive(Clone, Copy, Debug)]
pub struct Measure<T = ElementState> {
    /// Name of the channel in a scene, of the topic after `/elements/`, and of the cell data in exports.
    pub name: &'static str,
    /// Unit; `1` if dimensionless.
    pub unit: &'static str,
    /// Names of its components, in their order.
    pub fields: &'static [&'static str],
    write: fn(&T, &mut Vec<f64>),
}

const SCALAR: &[&str] = &["value"];
const STRETCHES: &[&str] = &["1", "2", "3"];
const VECTOR: &[&str] = &["x", "y", "z"];
const TENSOR: &[&str] = &["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];
/// Component order of a symmetric tensor in VTK.
const SYMMETRIC: &[&str] = &["xx", "yy", "zz", "xy", "yz", "xz"];

/// All measures.
pub const MEASURES: [Measure; 9] = [
    Measure {
        name: "deformation-gradient",
        unit: "1",
        fields: TENSOR,
        write: |state, out| out.extend(state.deformation_gradient.0.as_flattened()),
    },
    Measure { name: "jacobian", unit: "1", fields: SCALAR, write: |state, out| out.push(state.j()) },
    Measure {
        name: "principal-stretches",
        unit: "1",
        fields: STRETCHES,
        write: |state, out| out.extend(state.principal_stretches()),
    },
    Measure {
        name: "green-strain",
        unit: "1",
        fields: SYMMETRIC,
        write: |state, out| symmetric(&state.green_strain(), out),
    },
    Measure {
        name: "corotated-strain",
        unit: "1",
        fields: SYMMETRIC,
        write: |state, out| symmetric(&state.corotated_strain(), out),
    },
    Measure {
        name: "first-piola",
        unit: "Pa",
        fields: TENSOR,
        write: |state, out| out.extend(state.first_piola.0.as_flattened()),
    },
    Measure {
        name: "cauchy-stress",
        unit: "Pa",
        fields: SYMMETRIC,
        write: |state, out| symmetric(&state.cauchy_stress().symmetric(), out),
    },
    Measure {
        name: "von-mises",
        unit: "Pa",
        fields: SCALAR,
        write: |state, out| out.push(state.von_mises_stress()),
    },
    Measure {
        name: "energy-density",
        unit: "J/m^3",
        fields: SCALAR,
        write: |state, out| out.push(state.energy_density),
    },
];

/// Symmetric tensor: xx, yy, zz, xy, yz, xz, the order of VTK.
pub type SymmetricTensor = [f64; 6];

/// Measures of the recovered Cauchy stress at vertices.
pub const NODAL_MEASURES: [Measure<SymmetricTensor>; 2] = [
    Measure {
        name: "nodal-von-mises",
        unit: "Pa",
        fields: SCALAR,
        write: |stress, out| {
            let [xx, yy, zz, xy, yz, xz] = *stress;
            out.push(von_mises(&Mat([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])));
        },
    },
    Measure { name: "nodal-stress", unit: "Pa", fields: SYMMETRIC, write: |stress, out| out.extend(stress) },
];

/// Traction of contact at a vertex of a surface: forces per present area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactTraction {
    /// Normal force per area [Pa]; forces on both sides of a sheet add up.
    pub pressure: f64,
    /// Friction per area [Pa]; third component 0 in 2D.
    pub shear: [f64; 3],
}

impl ContactTraction {
    /// Divides the forces at a vertex by its area; NaN without an area.
    pub(crate) fn of(share: &ContactShare) -> Self {
        let per_area = |force: f64| if share.area > 0.0 { force / share.area } else { f64::NAN };
        ContactTraction { pressure: per_area(share.normal), shear: share.friction.map(per_area) }
    }
}

/// Measures of contact at vertices.
pub const CONTACT_MEASURES: [Measure<ContactTraction>; 2] = [
    Measure {
        name: "contact-pressure",
        unit: "Pa",
        fields: SCALAR,
        write: |traction, out| out.push(traction.pressure),
    },
    Measure {
        name: "contact-shear",
        unit: "Pa",
        fields: VECTOR,
        write: |traction, out| out.extend(traction.shear),
    },
];

/// Estimated error of the stress of elements, [`StressError`](super::recovery::StressError).
pub const ERROR_MEASURE: Measure<f64> =
    Measure { name: "zz", unit: "sqrt(J)", fields: SCALAR, write: |error, out| out.push(*error) };

impl Measure {
    /// Returns the measure of this name; `None` if there is none.
    pub fn named(name: &str) -> Option<&'static Measure> {
        MEASURES.iter().find(|measure| measure.name == name)
    }
}

impl<T> Measure<T> {
    /// Appends its components to `out`, in the order of the [`fields`](Self::fields).
    pub fn write(&self, value: &T, out: &mut Vec<f64>) {
        (self.write)(value, out);
    }

    /// Returns the field of a recording that holds this measure of elements.
    pub const fn of_elements(&self) -> RecordedField {
        RecordedField { name: self.name, unit: self.unit, fields: self.fields, rows: FieldRows::Elements }
    }

    /// Returns the field of a recording that holds this measure of vertices.
    pub const fn of_vertices(&self) -> RecordedField {
        RecordedField { name: self.name, unit: self.unit, fields: self.fields, rows: FieldRows::Vertices }
    }
}

/// Rows of a field in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldRows {
    /// One for each finite element, body after body.
    Elements,
    /// One for each vertex of the simulation.
    Vertices,
}

/// A field of numbers in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordedField {
    /// Name of the channel in a scene, of the data in exports, and of the colours in pictures.
    pub name: &'static str,
    /// Unit; `1` if dimensionless.
    pub unit: &'static str,
    /// Names of its components, in their order.
    pub fields: &'static [&'static str],
    /// What has a row.
    pub rows: FieldRows,
}

impl RecordedField {
    /// Returns all fields that a recording can have.
    pub fn all() -> impl Iterator<Item = RecordedField> {
        let elements = MEASURES.iter().map(Measure::of_elements).chain([ERROR_MEASURE.of_elements()]);
        let vertices = NODAL_MEASURES.iter().map(Measure::of_vertices);
        elements.chain(vertices).chain(CONTACT_MEASURES.iter().map(Measure::of_vertices))
    }

    /// Returns the field of this name; `None` if there is none.
    pub fn named(name: &str) -> Option<RecordedField> {
        RecordedField::all().find(|field| field.name == name)
    }

    /// Returns the topic of its channel, such as `/elements/von-mises`.
    pub fn topic(&self) -> String {
        let rows = match self.rows {
            FieldRows::Elements => "elements",
            FieldRows::Vertices => "vertices",
        };
        format!("/{rows}/{}", self.name)
    }
}

fn symmetric(matrix: &Mat<f64, 3>, out: &mut Vec<f64>) {
    out.extend(symmetric_tensor(matrix));
}

/// Returns the components of a symmetric matrix.
pub(crate) fn symmetric_tensor(matrix: &Mat<f64, 3>) -> SymmetricTensor {
    [matrix[0][0], matrix[1][1], matrix[2][2], matrix[0][1], matrix[1][2], matrix[0][2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_measure_writes_as_many_numbers_as_it_has_fields() {
        let deformation_gradient = Mat([[1.1, 0.2, 0.0], [0.0, 0.9, 0.3], [0.1, 0.0, 1.2]]);
        let first_piola = Mat([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]);
        let state = ElementState { deformation_gradient, first_piola, energy_density: 7.0, plane: false };
        for measure in &MEASURES {
            let mut out = vec![];
            measure.write(&state, &mut out);
            assert_eq!(out.len(), measure.fields.len(), "{}", measure.name);
        }
        let written = |name: &str| {
            let mut out = vec![];
            MEASURES.iter().find(|measure| measure.name == name).unwrap().write(&state, &mut out);
            out
        };
        assert_eq!(written("first-piola"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        let e = state.green_strain();
        // yz is the fifth: 1/2 (F_12 F_13 + F_22 F_23 + F_32 F_33) by hand.
        assert!((written("green-strain")[4] - 0.5 * (0.9 * 0.3)).abs() < 1e-15 && e[1][2] == e[2][1]);
    }
}
