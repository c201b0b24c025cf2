//! `/vertices/<measure>`: recovered stress at every vertex, as `foxglove.PointCloud`.
//!
//! One row for each vertex of the recording, in the order of `/state`: its present position, then the
//! numbers of the measure, all doubles. Numbers are NaN at vertices of no element. The channel's metadata
//! state the kind of row (`row = "vertex"`), the bodies with elements (`bodies`, in JSON: name, first row,
//! number of rows), and the `unit`.

use std::collections::BTreeMap;

use mcap::Channel;

use super::elements::{BodyRows, PLACE, columns};
use super::{ChannelEncoder, ChannelKind, Encoders};
use crate::Options;
use crate::cloud::{self, Cloud};
use crate::declaration::typed;
use crate::memory::RecordingBytes;
use crate::protobuf::POINT_CLOUD;
use pliant::diagnostics::{Measure, NODAL_MEASURES, SymmetricTensor};
use pliant::observer::{Frame, Quantities};
use pliant::topology::Topology;

/// Channel number of the first [measure](NODAL_MEASURES); each measure has its own, recorded or not.
const FIRST: u16 = 50;
const LAST: u16 = FIRST + NODAL_MEASURES.len() as u16 - 1;

pub(super) const KIND: ChannelKind = ChannelKind { numbers: FIRST..=LAST, is_complete: true, encoders };

/// Encoder of `/vertices/<measure>`.
struct VerticesChannel {
    number: u16,
    measure: &'static Measure<SymmetricTensor>,
    cloud: Cloud,
    bodies: Vec<BodyRows>,
    vertex_count: usize,
    /// Numbers of one row.
    row: Vec<f64>,
}

fn encoders(options: &Options, topology: &Topology) -> Encoders {
    let is_asked = |name: &str| options.channels.iter().any(|channel| channel.name() == name);
    let asked = (FIRST..).zip(&NODAL_MEASURES).filter(|(_, measure)| is_asked(measure.name));
    let with_elements = topology.bodies.iter().filter(|body| body.elements(topology.dimension).is_some());
    let bodies = with_elements.map(|body| {
        let (first, count) = (body.vertices.start as usize, body.vertices.len());
        BodyRows { name: body.name.clone(), first, count }
    });
    let encoder = |(number, measure)| VerticesChannel {
        number,
        measure,
        cloud: Cloud::new(&columns(measure)),
        bodies: bodies.clone().collect(),
        vertex_count: topology.vertex_count,
        row: vec![],
    };
    asked.map(|asked| Box::new(encoder(asked)) as _).collect()
}

impl ChannelEncoder for VerticesChannel {
    fn quantities(&self) -> Quantities {
        Quantities::STATE | Quantities::NODAL_STRESS
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
        let stress = frame.nodal_stress.unwrap_or_default();
        self.cloud.begin(log_time, stress.len(), buffer);
        for (place, stress) in frame.x.chunks_exact(frame.dimension).zip(stress) {
            self.row.clear();
            self.row.extend(place);
            self.row.resize(PLACE.len(), 0.0);
            self.measure.write(stress, &mut self.row);
            buffer.extend(self.row.iter().flat_map(|number| number.to_le_bytes()));
        }
    }
}
