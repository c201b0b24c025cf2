//! `/probe/<name>`: a [reading](pliant::probe::Reading) as one JSON object per frame, for plots.

use mcap::Channel;

use super::channel::{PROBES, json_channel};
use super::container::Message;
use pliant::observer::Frame;
use pliant::probe::{Probe, Reading};

/// The probes of a recording.
#[derive(Debug)]
pub(super) struct Probes {
    probes: Vec<(u16, Probe, Vec<u8>)>,
}

impl Probes {
    pub(super) fn new(probes: &[Probe]) -> Self {
        Probes { probes: (PROBES..).zip(probes).map(|(id, probe)| (id, probe.clone(), Vec::new())).collect() }
    }

    /// Whether any of them reads the states of points.
    pub(super) fn wants_points(&self) -> bool {
        self.probes.iter().any(|(_, probe, _)| probe.point.is_some())
    }

    /// Declares the channels, each with what its probe has.
    pub(super) fn channels(&self) -> impl Iterator<Item = Channel<'static>> {
        self.probes.iter().map(|(id, probe, _)| {
            let in_element = probe.point.map(|_| [0.5; 6]);
            let row = Reading {
                green_strain: in_element,
                corotated_strain: in_element,
                cauchy_stress: in_element,
                energy_density: probe.point.map(|_| 0.5),
                ..Reading::default()
            };
            let row = serde_json::to_value(row).unwrap_or_default();
            json_channel(*id, &format!("/probe/{}", probe.name), "pliant.Probe", &row)
        })
    }

    pub(super) fn encode_frame(&mut self, frame: &Frame<'_>) {
        for (_, probe, buffer) in &mut self.probes {
            buffer.clear();
            let written = serde_json::to_writer(buffer, &probe.read(frame));
            debug_assert!(written.is_ok(), "a vector grows as a reading is written into it");
        }
    }

    /// The messages encoded last.
    pub(super) fn messages(&self, sequence: u32, log_time: u64) -> impl Iterator<Item = Message<'_>> {
        self.probes.iter().map(move |(id, _, buffer)| Message::new(*id, sequence, log_time, buffer))
    }
}
