//! Values that colour a body.

use std::fmt;

use pliant::diagnostics::{FieldRows, RecordedField};
use pliant_record::read::RecordedRows;

use super::{DrawError, Drawing};

/// Quantity that bodies are coloured by.
#[derive(Clone, Copy, Debug)]
pub enum Colouring {
    /// One colour for each body.
    Body,
    /// Speed of a vertex [m/s].
    Speed,
    /// Distance of a vertex from its reference position [m].
    Displacement,
    /// Component of a recorded field of elements or vertices.
    Field {
        /// The field.
        of: RecordedField,
        /// Index of the component.
        field: usize,
    },
}

impl Colouring {
    /// Unit, `1` if dimensionless.
    pub fn unit(&self) -> &'static str {
        match self {
            Colouring::Body => "1",
            Colouring::Speed => "m/s",
            Colouring::Displacement => "m",
            Colouring::Field { of, .. } => of.unit,
        }
    }
}

/// Writes the name: `body`, `speed`, `displacement`, `von-mises`, `cauchy-stress xx`.
impl fmt::Display for Colouring {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Colouring::Body => f.write_str("body"),
            Colouring::Speed => f.write_str("speed"),
            Colouring::Displacement => f.write_str("displacement"),
            Colouring::Field { of, field } => match of.fields {
                [_] => f.write_str(of.name),
                fields => write!(f, "{} {}", of.name, fields[*field]),
            },
        }
    }
}

/// Values of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Scalars {
    /// Unit, `1` if dimensionless.
    pub unit: String,
    /// Values of each body, in the order of [`Drawing::bodies`].
    pub bodies: Vec<BodyScalars>,
}

/// Values of one body.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyScalars {
    /// The body has no such values.
    None,
    /// One value for each of its vertices, then of its embedded surface.
    Vertices(Vec<f64>),
    /// One value for each of its elements.
    Elements(Vec<f64>),
}

impl BodyScalars {
    /// Values of the body; empty if there are none.
    pub fn values(&self) -> &[f64] {
        match self {
            BodyScalars::None => &[],
            BodyScalars::Vertices(values) | BodyScalars::Elements(values) => values,
        }
    }
}

impl Scalars {
    /// Smallest and largest finite value over all bodies; `None` if there are none.
    pub fn range(&self) -> Option<(f64, f64)> {
        let values = self.bodies.iter().flat_map(BodyScalars::values).filter(|value| value.is_finite());
        values.fold(None, |range, &value| {
            let (low, high) = range.unwrap_or((value, value));
            Some((value.min(low), value.max(high)))
        })
    }
}

impl Drawing {
    /// Colourings available for this recording, [`Colouring::Body`] first.
    pub fn colourings(&self) -> Vec<Colouring> {
        let mut found = vec![Colouring::Body, Colouring::Speed];
        found.extend(self.rest.is_some().then_some(Colouring::Displacement));
        for of in RecordedField::all().filter(|field| self.topics.contains(&field.topic())) {
            found.extend((0..of.fields.len()).map(|field| Colouring::Field { of, field }));
        }
        found
    }

    /// Values of a colouring in a frame; for [`Colouring::Body`] the body's index at each vertex.
    ///
    /// # Errors
    /// [`DrawError::Colouring`] if the recording lacks the data; those of [`frame`](Self::frame).
    pub fn scalars(&mut self, colouring: &Colouring, frame: usize) -> Result<Scalars, DrawError> {
        let bodies = match colouring {
            Colouring::Body => self.body_numbers(),
            Colouring::Speed => {
                let v = self.frame(frame)?.v;
                self.of_vertices(&lengths(&v))
            }
            Colouring::Displacement => {
                let x = self.frame(frame)?.x;
                let Some(rest) = &self.rest else {
                    return Err(self.cannot_colour(colouring, "rest positions were not recorded"));
                };
                let moved: Vec<f64> = x.iter().zip(rest).map(|(x, rest)| x - rest).collect();
                self.of_vertices(&lengths(&moved))
            }
            Colouring::Field { of, field } => {
                let rows = self.trajectory.field(of, frame)?;
                let (found, reason) = match of.rows {
                    FieldRows::Elements => {
                        (self.of_elements(&rows, *field), "its rows are not those of its elements")
                    }
                    FieldRows::Vertices => {
                        (self.of_nodes(&rows, *field), "its rows are not those of its vertices")
                    }
                };
                found.ok_or_else(|| self.cannot_colour(colouring, reason))?
            }
        };
        Ok(Scalars { unit: colouring.unit().to_owned(), bodies })
    }

    fn cannot_colour(&self, colouring: &Colouring, reason: &str) -> DrawError {
        let (path, colouring) = (self.path.clone(), colouring.to_string());
        DrawError::Colouring { path, colouring, reason: reason.to_owned() }
    }

    fn body_numbers(&self) -> Vec<BodyScalars> {
        let of = |(number, body): (usize, &super::DrawnBody)| {
            BodyScalars::Vertices(vec![number as f64; body.vertex_count() + body.skin.len()])
        };
        self.bodies.iter().enumerate().map(of).collect()
    }

    fn of_vertices(&self, values: &[f64]) -> Vec<BodyScalars> {
        let of = |range: &std::ops::Range<u32>| &values[range.start as usize..range.end as usize];
        let of_body = |body: &super::DrawnBody| [of(&body.vertices), of(&body.skin)].concat();
        self.bodies.iter().map(|body| BodyScalars::Vertices(of_body(body))).collect()
    }

    /// Values by element; `None` if the numbers of rows and elements differ.
    fn of_elements(&self, rows: &RecordedRows, field: usize) -> Option<Vec<BodyScalars>> {
        let width = rows.fields.len();
        let of = |body: &super::DrawnBody| {
            let Some(found) = rows.bodies.iter().find(|found| found.name == body.name) else {
                return Some(BodyScalars::None);
            };
            let last = found.first.checked_add(found.count)?.checked_mul(width)?;
            let values = rows.values.get(found.first * width..last)?;
            let values = component(values, field, width);
            (values.len() == body.element_count()).then_some(BodyScalars::Elements(values))
        };
        self.bodies.iter().map(of).collect()
    }

    /// Values by vertex of the bodies with elements; `None` if the numbers of rows and vertices differ.
    fn of_nodes(&self, rows: &RecordedRows, field: usize) -> Option<Vec<BodyScalars>> {
        let values = component(&rows.values, field, rows.fields.len());
        if values.len() != self.vertex_count() {
            return None;
        }
        let mut of_bodies = self.of_vertices(&self.recorded.with_skins::<1>(values));
        for (scalars, body) in of_bodies.iter_mut().zip(&self.bodies) {
            if rows.bodies.iter().all(|found| found.name != body.name) {
                *scalars = BodyScalars::None;
            }
        }
        Some(of_bodies)
    }
}

/// One component of rows of this width.
fn component(values: &[f64], field: usize, width: usize) -> Vec<f64> {
    values.iter().skip(field).step_by(width).copied().collect()
}

/// Norms of rows of three.
fn lengths(rows: &[f64]) -> Vec<f64> {
    rows.chunks_exact(3).map(|row| row.iter().map(|c| c * c).sum::<f64>().sqrt()).collect()
}
