//! `/elements/<measure>`: deformation, strain or stress of every element, as `foxglove.PointCloud`.
//!
//! One row for each element of each body that has any, body after body, each in the order of its cells: where its centroid is
//! now, then the numbers of the measure, doubles all. The channel's metadata say what a row is (`row = "element"`), which bodies
//! the rows are of (`bodies`, in JSON: name, first row, number of rows), and the `unit`.

use std::collections::BTreeMap;

use mcap::Channel;
use serde::{Deserialize, Serialize};

use super::channel::{ELEMENTS, typed};
use super::cloud::{self, Cloud};
use super::container::Message;
use super::protobuf::POINT_CLOUD;
use pliant::diagnostics::{ElementState, MEASURES, Measure};
use pliant::observer::Frame;
use pliant::topology::Topology;

/// Columns before those of the measure.
pub(super) const PLACE: [&str; 3] = ["x", "y", "z"];

/// The rows of one body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BodyRows {
    /// Name of the body.
    pub name: String,
    /// Its first row.
    pub first: usize,
    /// Number of its rows.
    pub count: usize,
}

/// What is recorded of the elements.
#[derive(Debug)]
pub(super) struct Elements {
    /// Vertices of the elements of each body, one after the other, and how many an element has.
    cells: Vec<(Vec<u32>, usize)>,
    bodies: Vec<BodyRows>,
    channels: Vec<Recorded>,
    /// Numbers of one row.
    row: Vec<f64>,
}

/// One channel.
#[derive(Debug)]
struct Recorded {
    id: u16,
    measure: &'static Measure,
    cloud: Cloud,
    buffer: Vec<u8>,
}

impl Elements {
    /// `None` if no channel of `asked` is about elements.
    pub(super) fn new(asked: &[pliant_scene::Channel], topology: &Topology) -> Option<Self> {
        let is_asked = |measure: &Measure| asked.iter().any(|channel| channel.name() == measure.name);
        let named = MEASURES.iter().zip(ELEMENTS..).filter(|(measure, _)| is_asked(measure));
        let channels: Vec<Recorded> = named
            .map(|(measure, id)| Recorded {
                id,
                measure,
                cloud: Cloud::new(&columns(measure)),
                buffer: Vec::new(),
            })
            .collect();
        if channels.is_empty() {
            return None;
        }
        let (mut cells, mut bodies, mut first) = (Vec::new(), Vec::new(), 0);
        for body in &topology.bodies {
            let Some((of_body, corners)) = body.elements(topology.dimension) else { continue };
            let count = of_body.len() / corners;
            bodies.push(BodyRows { name: body.name.clone(), first, count });
            cells.push((of_body.to_vec(), corners));
            first += count;
        }
        Some(Elements { cells, bodies, channels, row: Vec::new() })
    }

    /// Number of elements.
    pub(super) fn count(&self) -> usize {
        self.bodies.iter().map(|body| body.count).sum()
    }

    /// Declares the channels.
    pub(super) fn channels(&self) -> impl Iterator<Item = Channel<'static>> {
        self.channels.iter().map(|recorded| {
            let Recorded { id, measure, .. } = recorded;
            let mut metadata = cloud::describe(&columns(measure), self.count());
            metadata.extend(BTreeMap::from([
                ("row".to_owned(), "element".to_owned()),
                ("unit".to_owned(), measure.unit.to_owned()),
                // Strings and integers always have a JSON form.
                ("bodies".to_owned(), serde_json::to_string(&self.bodies).unwrap_or_default()),
            ]));
            let mut channel = typed((*id, ""), POINT_CLOUD, metadata);
            channel.topic = topic(measure);
            channel
        })
    }

    /// Encodes a frame; `states` has as many entries as there are elements.
    pub(super) fn encode_frame(&mut self, frame: &Frame<'_>, states: &[ElementState], log_time: u64) {
        for Recorded { measure, cloud, buffer, .. } in &mut self.channels {
            cloud.begin(log_time, states.len(), buffer);
            let cells = self.cells.iter().flat_map(|(cells, corners)| cells.chunks_exact(*corners));
            for (cell, state) in cells.zip(states) {
                self.row.clear();
                self.row.extend(centroid(frame, cell));
                measure.write(state, &mut self.row);
                buffer.extend(self.row.iter().flat_map(|number| number.to_le_bytes()));
            }
        }
    }

    /// The messages encoded last.
    pub(super) fn messages(&self, sequence: u32, log_time: u64) -> impl Iterator<Item = Message<'_>> {
        self.channels
            .iter()
            .map(move |recorded| Message::new(recorded.id, sequence, log_time, &recorded.buffer))
    }
}

/// `/elements/von-mises`.
pub(super) fn topic(measure: &Measure) -> String {
    format!("/elements/{}", measure.name)
}

fn columns(measure: &Measure) -> Vec<&'static str> {
    [&PLACE, measure.fields].concat()
}

/// The mean of the vertices.
fn centroid(frame: &Frame<'_>, cell: &[u32]) -> [f64; 3] {
    let mut mean = [0.0; 3];
    for &vertex in cell {
        let x = &frame.x[vertex as usize * frame.dimension..][..frame.dimension];
        mean.iter_mut().zip(x).for_each(|(mean, x)| *mean += x / cell.len() as f64);
    }
    mean
}
