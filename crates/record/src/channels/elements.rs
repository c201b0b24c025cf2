//! `/elements/<measure>`: deformation, strain or stress of every element, as `foxglove.PointCloud`.
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
use pliant::diagnostics::{MEASURES, Measure};
use pliant::observer::{Frame, Quantities};
use pliant::topology::{BodyTopology, Topology};

/// Channel number of the first [measure](MEASURES); each measure has its own, recorded or not.
const FIRST: u16 = 10;
const LAST: u16 = FIRST + MEASURES.len() as u16 - 1;

pub(super) const KIND: ChannelKind = ChannelKind { numbers: FIRST..=LAST, is_complete: true, encoders };

/// Columns before those of the measure.
pub(crate) const CENTROID: [&str; 3] = ["x", "y", "z"];

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

/// Encoder of `/elements/<measure>`.
struct ElementsChannel {
    number: u16,
    measure: &'static Measure,
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
    let is_asked = |measure: &Measure| options.channels.iter().any(|channel| channel.name() == measure.name);
    let mut asked = (FIRST..).zip(&MEASURES).filter(|(_, measure)| is_asked(measure)).peekable();
    if asked.peek().is_none() {
        return vec![];
    }
    let elements = Arc::new(RecordedElements::new(topology));
    let encoder = |(number, measure)| ElementsChannel {
        number,
        measure,
        cloud: Cloud::new(&columns(measure)),
        elements: elements.clone(),
        row: vec![],
    };
    asked.map(|asked| Box::new(encoder(asked)) as _).collect()
}

/// Topic of a measure, such as `/elements/von-mises`.
pub(crate) fn topic(measure: &Measure) -> String {
    format!("/elements/{}", measure.name)
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

impl ChannelEncoder for ElementsChannel {
    fn quantities(&self) -> Quantities {
        Quantities::STATE | Quantities::ELEMENTS
    }

    fn declaration(&self) -> Channel<'static> {
        let mut metadata = cloud::describe(&columns(self.measure), self.elements.count());
        metadata.extend(BTreeMap::from([
            ("row".to_owned(), "element".to_owned()),
            ("unit".to_owned(), self.measure.unit.to_owned()),
            // Strings and integers always have a JSON form.
            ("bodies".to_owned(), serde_json::to_string(&self.elements.bodies).unwrap_or_default()),
        ]));
        typed(self.number, &topic(self.measure), POINT_CLOUD, metadata)
    }

    fn bytes(&self) -> RecordingBytes {
        let message = 8 * (CENTROID.len() + self.measure.fields.len()) * self.elements.count();
        // Measures share their list of elements.
        let cells = self.elements.cells.iter().map(|(cells, _)| 4 * cells.len()).sum::<usize>();
        RecordingBytes { held: cells / Arc::strong_count(&self.elements), message }
    }

    fn encode(&mut self, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
        let states = frame.elements.unwrap_or_default();
        self.cloud.begin(log_time, states.len(), buffer);
        let cells = self.elements.cells.iter().flat_map(|(cells, corners)| cells.chunks_exact(*corners));
        for (cell, state) in cells.zip(states) {
            self.row.clear();
            self.row.extend(centroid(frame, cell));
            self.measure.write(state, &mut self.row);
            buffer.extend(self.row.iter().flat_map(|number| number.to_le_bytes()));
        }
    }
}

fn columns(measure: &Measure) -> Vec<&'static str> {
    [&CENTROID, measure.fields].concat()
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
