//! Page of a running scene, built like that of a recording with one frame.

use std::path::Path;

use pliant_record::McapRecorder;
use pliant_scene::Channel;
use pliant_scene::experiment::Experiment;
use pliant_view::drawing::{Colouring, Drawing};
use pliant_view::page::{LiveLink, PageBudget, ViewerPage};

use crate::LiveError;
use crate::recording::{options, record};
use crate::scratch::ScratchFolder;

/// Element measures for colouring, in addition to those of the scene.
const MEASURES: [Channel; 4] =
    [Channel::Jacobian, Channel::PrincipalStretches, Channel::VonMises, Channel::EnergyDensity];

/// Page with its title, and the names of colourings by element measures.
pub(crate) struct LivePage {
    pub(crate) html: String,
    pub(crate) title: String,
    pub(crate) measures: Vec<String>,
}

impl LivePage {
    /// Builds the page of the present state, which connects to `link`.
    ///
    /// # Errors
    /// The system has no temporary directory, or the recording in it cannot be written or read.
    pub(crate) fn new(experiment: &mut Experiment, link: &LiveLink) -> Result<LivePage, LiveError> {
        let folder = ScratchFolder::new()?;
        let name = Path::new(experiment.source().name()).file_stem().unwrap_or("scene".as_ref());
        let path = folder.path().join(name).with_extension("mcap");
        let options = options(experiment, channels(experiment));
        let mut recorder = McapRecorder::create(&path, &options, experiment.topology())?;
        record(&mut recorder, experiment)?;
        recorder.finish()?;
        let mut drawing = Drawing::without_skins(&path, experiment.source().directory())?;
        let page = ViewerPage::live(&mut drawing, &PageBudget::default(), link)?;
        let of_measures = |colouring: &Colouring| matches!(colouring, Colouring::Field { .. });
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
    // What is computed at vertices for recordings is not computed while a page is served.
    let is_shown = |channel: &Channel| !channel.is_recovered() && !channel.is_of_contact();
    channels.retain(|channel| *channel != Channel::Mesh && is_shown(channel));
    channels
}
