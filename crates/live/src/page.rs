//! The page of a running scene: that of a recording of one frame.

use std::path::Path;

use pliant_record::McapRecorder;
use pliant_scene::Channel;
use pliant_scene::experiment::Experiment;
use pliant_view::drawing::{Colouring, Drawing};
use pliant_view::page::{LiveSocket, PageBudget, ViewerPage};

use crate::LiveError;
use crate::recording::{options, record};
use crate::scratch::ScratchFolder;

/// Measures of elements that bodies can be coloured by, beside those of the scene.
const MEASURES: [Channel; 4] =
    [Channel::Jacobian, Channel::PrincipalStretches, Channel::VonMises, Channel::EnergyDensity];

/// The page, the title on it, and the names of colourings by a measure of elements.
pub(crate) struct LivePage {
    pub(crate) html: String,
    pub(crate) title: String,
    pub(crate) measures: Vec<String>,
}

impl LivePage {
    /// The page of the present state, which asks for `socket`.
    ///
    /// # Errors
    /// The system gives no temporary folder, or the recording in it cannot be written or read.
    pub(crate) fn new(experiment: &mut Experiment, socket: &LiveSocket) -> Result<LivePage, LiveError> {
        let folder = ScratchFolder::new()?;
        let name = Path::new(experiment.source().name()).file_stem().unwrap_or("scene".as_ref());
        let path = folder.path().join(name).with_extension("mcap");
        let options = options(experiment, channels(experiment));
        let mut recorder = McapRecorder::create(&path, &options, experiment.topology())?;
        record(&mut recorder, experiment)?;
        recorder.finish()?;
        let mut drawing = Drawing::without_skins(&path, experiment.source().directory())?;
        let page = ViewerPage::live(&mut drawing, &PageBudget::default(), socket)?;
        let of_measures = |colouring: &Colouring| matches!(colouring, Colouring::Measure { .. });
        let measures = drawing.colourings().into_iter().filter(of_measures);
        let measures = measures.map(|colouring| colouring.to_string()).collect();
        Ok(LivePage { html: page.html, title: drawing.title().to_owned(), measures })
    }
}

fn channels(experiment: &Experiment) -> Vec<Channel> {
    let mut channels = experiment.scene().output.channels.clone();
    let has_elements = !experiment.simulation().element_states().is_empty();
    let further = MEASURES.into_iter().filter(|_| has_elements);
    for channel in [Channel::State, Channel::Energy].into_iter().chain(further) {
        if !channels.contains(&channel) {
            channels.push(channel);
        }
    }
    channels.retain(|channel| *channel != Channel::Mesh);
    channels
}
