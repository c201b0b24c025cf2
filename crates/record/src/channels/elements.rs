//! `/elements/<measure>`: deformation, strain or stress of every element, or the estimated error of its
//! stress, as `foxglove.PointCloud`.
//!
//! One row for each element, body after body, in the order of the body's elements: the present centroid,
//! then the numbers of the measure, all doubles. The channel's metadata state the kind of row (`row =
//! "element"`), the bodies (`bodies`, in JSON: name, first row, number of rows), and the `unit`.

use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::Channel;
use serde::{Deserialize, Serialize};

use super::{ChannelEncoder, ChannelKind, Encoders};
use crate::Options;
use crate::cloud::{self, Cloud};
use crate::declaration::typed;
use crate::memory::RecordingBytes;
use crate::protobuf::POINT_CLOUD;
use pliant::diagnostics::{ERROR_MEASURE, MEASURES, Measure};
use pliant::observer::{Frame, Quantities};
use pliant::topology::{BodyTopology, Topology};

/// Channel number of the first [measure](MEASURES); each measure has its own, recorded or not.
const FIRST: u16 = 10;
/// Channel number of the [error](ERROR_MEASURE).
const LAST: u16 = 49;

pub(super) const KIND: ChannelKind = ChannelKind { numbers: FIRST..=LAST, is_complete: true, encoders };

/// Columns before those of the measure, here and in `/vertices/<measure>`.
pub(crate) const PLACE: [&str; 3] = ["x", "y", "z"];

/// Range of rows of one body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BodyRows {
    /// Name of the body.
    pub name: String,
    /// First row.
    pub first: usize,
    /// Number of rows.
    pub count: usize,
}

/// Encoder of `/elements/<measure>`, of measures computed from a `T`.
struct ElementsChannel<T: 'static> {
    number: u16,
    measure: &'static Measure<T>,
    /// Values of the elements in a frame.
    values: for<'a> fn(&Frame<'a>) -> Option<&'a [T]>,
    needs: Quantities,
    cloud: Cloud,
    elements: Arc<RecordedElements>,
    /// Numbers of one row.
    row: Vec<f64>,
}

/// Elements that have rows.
struct RecordedElements {
    /// Vertices of the elements of each body, one after the other, and their number per element.
    cells: Vec<(Vec<u32>, usize)>,
    bodies: Vec<BodyRows>,
}

fn encoders(options: &Options, topology: &Topology) -> Encoders {
    let is_asked = |name: &str| options.channels.iter().any(|channel| channel.name() == name);
    let mut asked = (FIRST..).zip(&MEASURES).filter(|(_, measure)| is_asked(measure.name)).peekable();
    let has_error = is_asked(ERROR_MEASURE.name);
    if asked.peek().is_none() && !has_error {
        return vec![];
    }
    let elements = Arc::new(RecordedElements::new(topology));
    let mut encoders: Encoders = vec![];
    for (number, measure) in asked {
        let needs = Quantities::ELEMENTS;
        let of_measure = (number, measure);
        encoders.push(Box::new(ElementsChannel::new(of_measure, |frame| frame.elements, needs, &elements)));
    }
    if has_error {
        let needs = Quantities::STRESS_ERROR;
        let of_error = (LAST, &ERROR_MEASURE);
        encoders.push(Box::new(ElementsChannel::new(of_error, |frame| frame.stress_error, needs, &elements)));
    }
    encoders
}

impl<T> ElementsChannel<T> {
    fn new(
        (number, measure): (u16, &'static Measure<T>),
        values: for<'a> fn(&Frame<'a>) -> Option<&'a [T]>,
        needs: Quantities,
        elements: &Arc<RecordedElements>,
    ) -> Self {
        let (cloud, elements) = (Cloud::new(&columns(measure)), elements.clone());
        ElementsChannel { number, measure, values, needs, cloud, elements, row: vec![] }
    }
}

/// Number of elements that have rows.
pub(crate) fn count(topology: &Topology) -> usize {
    elements_of(topology).map(|(_, cells, corners)| cells.len() / corners).sum()
}

/// Bodies with elements, their vertices, and the number per element.
fn elements_of(topology: &Topology) -> impl Iterator<Item = (&BodyTopology, &[u32], usize)> {
    topology.bodies.iter().filter_map(|body| {
        let (cells, corners) = body.elements(topology.dimension)?;
        Some((body, cells, corners))
    })
}

impl RecordedElements {
    fn new(topology: &Topology) -> Self {
        let (mut cells, mut bodies, mut first) = (Vec::new(), Vec::new(), 0);
        for (body, of_body, corners) in elements_of(topology) {
            let count = of_body.len() / corners;
            bodies.push(BodyRows { name: body.name.clone(), first, count });
            cells.push((of_body.to_vec(), corners));
            first += count;
        }
        RecordedElements { cells, bodies }
    }

    fn count(&self) -> usize {
        self.bodies.iter().map(|body| body.count).sum()
    }
}

impl<T> ChannelEncoder for ElementsChannel<T> {
    fn quantities(&self) -> Quantities {
        Quantities::STATE | self.needs
    }

    fn declaration(&self) -> Channel<'static> {
        let mut metadata = cloud::describe(&columns(self.measure), self.elements.count());
        metadata.extend(BTreeMap::from([
            ("row".to_owned(), "element".to_owned()),
            ("unit".to_owned(), self.measure.unit.to_owned()),
            // Strings and integers always have a JSON form.
            ("bodies".to_owned(), serde_json::to_string(&self.elements.bodies).unwrap_or_default()),
        ]));
        typed(self.number, &self.measure.of_elements().topic(), POINT_CLOUD, metadata)
    }

    fn bytes(&self) -> RecordingBytes {
        let message = 8 * (PLACE.len() + self.measure.fields.len()) * self.elements.count();
        // Measures share their list of elements.
        let cells = self.elements.cells.iter().map(|(cells, _)| 4 * cells.len()).sum::<usize>();
        RecordingBytes { held: cells / Arc::strong_count(&self.elements), message }
    }

    fn encode(&mut self, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
        let values = (self.values)(frame).unwrap_or_default();
        self.cloud.begin(log_time, values.len(), buffer);
        let cells = self.elements.cells.iter().flat_map(|(cells, corners)| cells.chunks_exact(*corners));
        for (cell, value) in cells.zip(values) {
            self.row.clear();
            self.row.extend(centroid(frame, cell));
            self.measure.write(value, &mut self.row);
            buffer.extend(self.row.iter().flat_map(|number| number.to_le_bytes()));
        }
    }
}

/// Columns of a measure.
pub(super) fn columns<T>(measure: &Measure<T>) -> Vec<&'static str> {
    [&PLACE, measure.fields].concat()
}

/// Mean of the element's vertices.
fn centroid(frame: &Frame<'_>, cell: &[u32]) -> [f64; 3] {
    let mut mean = [0.0; 3];
    for &vertex in cell {
        let x = &frame.x[vertex as usize * frame.dimension..][..frame.dimension];
        mean.iter_mut().zip(x).for_each(|(mean, x)| *mean += x / cell.len() as f64);
    }
    mean
}
