//! `/probe/<name>`: a [reading](pliant::probe::Reading) as one JSON object per frame, for plots.

use mcap::Channel;

use super::{ChannelEncoder, ChannelKind, Encoders};
use crate::Options;
use crate::declaration::{json_channel, write_json};
use pliant::observer::{Frame, Quantities};
use pliant::probe::{Probe, Reading};
use pliant::topology::Topology;

/// Channel number of the first probe; the others follow.
const FIRST: u16 = 100;

pub(super) const KIND: ChannelKind = ChannelKind { numbers: FIRST..=u16::MAX, is_complete: true, encoders };

/// Encoder of `/probe/<name>`.
struct ProbeChannel {
    number: u16,
    probe: Probe,
}

fn encoders(options: &Options, _: &Topology) -> Encoders {
    let probes = (FIRST..).zip(&options.probes);
    probes.map(|(number, probe)| Box::new(ProbeChannel { number, probe: probe.clone() }) as _).collect()
}

/// Topic of the probe with this name.
pub(crate) fn topic(name: &str) -> String {
    format!("{TOPICS}{name}")
}

/// Name of the probe with this topic; `None` for other topics.
pub(crate) fn name_in(topic: &str) -> Option<&str> {
    topic.strip_prefix(TOPICS)
}

/// Prefix of all probe topics.
const TOPICS: &str = "/probe/";

impl ChannelEncoder for ProbeChannel {
    fn quantities(&self) -> Quantities {
        self.probe.quantities()
    }

    /// The schema has the fields of the probe.
    fn declaration(&self) -> Channel<'static> {
        let in_element = self.probe.point.map(|_| [0.5; 6]);
        let row = Reading {
            green_strain: in_element,
            corotated_strain: in_element,
            cauchy_stress: in_element,
            energy_density: self.probe.point.map(|_| 0.5),
            nodal_stress: self.probe.reads_nodal_stress.then_some([0.5; 6]),
            nodal_von_mises: self.probe.reads_nodal_stress.then_some(0.5),
            ..Reading::default()
        };
        json_channel(self.number, &topic(&self.probe.name), "pliant.Probe", &row)
    }

    fn encode(&mut self, frame: &Frame<'_>, _: u64, buffer: &mut Vec<u8>) {
        write_json(&self.probe.read(frame), buffer);
    }
}
