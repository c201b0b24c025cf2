//! `/vertices/<measure>`: recovered stress, or traction of contact, at every vertex, as
//! `foxglove.PointCloud`.
//!
//! One row for each vertex of the recording, in the order of `/state`: its present position, then the
//! numbers of the measure, all doubles. Numbers are NaN at vertices of no element, or of no surface. The
//! channel's metadata state the kind of row (`row = "vertex"`), the bodies (`bodies`, in JSON: name, first
//! row, number of rows; of a stress those with elements), and the `unit`.

use std::collections::BTreeMap;

use mcap::Channel;

use super::elements::{BodyRows, PLACE, columns};
use super::{ChannelEncoder, ChannelKind, Encoders};
use crate::Options;
use crate::cloud::{self, Cloud};
use crate::declaration::typed;
use crate::memory::RecordingBytes;
use crate::protobuf::POINT_CLOUD;
use pliant::diagnostics::{CONTACT_MEASURES, Measure, NODAL_MEASURES};
use pliant::observer::{Frame, Quantities};
use pliant::topology::{BodyTopology, Topology};

/// Channel number of the first [measure of stress](NODAL_MEASURES); each measure has its own, recorded or
/// not.
const FIRST: u16 = 50;
/// Channel number of the first [measure of contact](CONTACT_MEASURES).
const FIRST_OF_CONTACT: u16 = FIRST + NODAL_MEASURES.len() as u16;
const LAST: u16 = FIRST_OF_CONTACT + CONTACT_MEASURES.len() as u16 - 1;

pub(super) const KIND: ChannelKind = ChannelKind { numbers: FIRST..=LAST, is_complete: true, encoders };

/// Encoder of `/vertices/<measure>`, of measures computed from a `T`.
struct VerticesChannel<T: 'static> {
    number: u16,
    measure: &'static Measure<T>,
    /// Values of the vertices in a frame.
    values: for<'a> fn(&Frame<'a>) -> Option<&'a [T]>,
    needs: Quantities,
    cloud: Cloud,
    bodies: Vec<BodyRows>,
    vertex_count: usize,
    /// Numbers of one row.
    row: Vec<f64>,
}

fn encoders(options: &Options, topology: &Topology) -> Encoders {
    let is_asked = |name: &str| options.channels.iter().any(|channel| channel.name() == name);
    let mut encoders: Encoders = vec![];
    for of in (FIRST..).zip(&NODAL_MEASURES).filter(|(_, measure)| is_asked(measure.name)) {
        let needs = Quantities::NODAL_STRESS;
        encoders.push(Box::new(VerticesChannel::new(of, |frame| frame.nodal_stress, needs, topology)));
    }
    for of in (FIRST_OF_CONTACT..).zip(&CONTACT_MEASURES).filter(|(_, measure)| is_asked(measure.name)) {
        let needs = Quantities::CONTACT_TRACTIONS;
        encoders.push(Box::new(VerticesChannel::new(of, |frame| frame.contact_tractions, needs, topology)));
    }
    encoders
}

impl<T> VerticesChannel<T> {
    fn new(
        (number, measure): (u16, &'static Measure<T>),
        values: for<'a> fn(&Frame<'a>) -> Option<&'a [T]>,
        needs: Quantities,
        topology: &Topology,
    ) -> Self {
        let is_of_elements = needs == Quantities::NODAL_STRESS;
        let has_rows = |body: &&BodyTopology| !is_of_elements || body.elements(topology.dimension).is_some();
        let rows = |body: &BodyTopology| {
            let (first, count) = (body.vertices.start as usize, body.vertices.len());
            BodyRows { name: body.name.clone(), first, count }
        };
        let bodies = topology.bodies.iter().filter(has_rows).map(rows).collect();
        let (cloud, vertex_count) = (Cloud::new(&columns(measure)), topology.vertex_count);
        VerticesChannel { number, measure, values, needs, cloud, bodies, vertex_count, row: vec![] }
    }
}

impl<T> ChannelEncoder for VerticesChannel<T> {
    fn quantities(&self) -> Quantities {
        Quantities::STATE | self.needs
    }

    fn declaration(&self) -> Channel<'static> {
        let mut metadata = cloud::describe(&columns(self.measure), self.vertex_count);
        metadata.extend(BTreeMap::from([
            ("row".to_owned(), "vertex".to_owned()),
            ("unit".to_owned(), self.measure.unit.to_owned()),
            // Strings and integers always have a JSON form.
            ("bodies".to_owned(), serde_json::to_string(&self.bodies).unwrap_or_default()),
        ]));
        typed(self.number, &self.measure.of_vertices().topic(), POINT_CLOUD, metadata)
    }

    fn bytes(&self) -> RecordingBytes {
        let columns = PLACE.len() + self.measure.fields.len();
        RecordingBytes { held: 0, message: 8 * columns * self.vertex_count }
    }

    fn encode(&mut self, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
        let values = (self.values)(frame).unwrap_or_default();
        self.cloud.begin(log_time, values.len(), buffer);
        for (place, value) in frame.x.chunks_exact(frame.dimension).zip(values) {
            self.row.clear();
            self.row.extend(place);
            self.row.resize(PLACE.len(), 0.0);
            self.measure.write(value, &mut self.row);
            buffer.extend(self.row.iter().flat_map(|number| number.to_le_bytes()));
        }
    }
}
