//! A running scene without a server.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

use pliant::simulation::Simulation;
use pliant_files::clock::Instant;
use pliant_scene::Source;
use pliant_scene::experiment::{Experiment, StepFailure};
use pliant_view::page::LiveLink;

use crate::LiveError;
use crate::outbox::{Outbox, Outgoing};
use crate::page::LivePage;
use crate::session::{Incoming, LiveSession, LiveSettings};

/// Message to the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LiveMessage {
    /// JSON.
    Text(String),
    /// A frame.
    Frame(Vec<u8>),
}

/// Running scene whose owner carries messages to and from its page, and gives it time to run. It records
/// from the start on.
pub struct EmbeddedScene {
    session: LiveSession,
    outbox: Arc<Outbox>,
    commands: Sender<Incoming>,
    page: String,
    /// Number of the connected page; 0 if there is none.
    connected: u64,
}

impl EmbeddedScene {
    /// Assembles the scene, which records to a file below `folder`.
    ///
    /// # Errors
    /// [`LiveError`]: the scene cannot be simulated, its page cannot be built, or the recording cannot be
    /// started.
    pub fn new(source: Source, folder: &Path) -> Result<EmbeddedScene, LiveError> {
        let mut experiment = Experiment::new(source)?;
        let recording = PathBuf::from("run.mcap");
        let LivePage { html: page, title, measures } = LivePage::new(&mut experiment, &LiveLink::Port)?;
        let (commands, queue) = channel();
        let outbox = Arc::new(Outbox::default());
        let (speed, folder) = (Some(1.0), folder.to_owned());
        let settings = LiveSettings { title, measures, speed, paused: false, folder, records_anew: true };
        let mut session = LiveSession::new(experiment, settings, Arc::clone(&outbox), queue);
        session.record(&recording)?;
        Ok(EmbeddedScene { session, outbox, commands, page, connected: 0 })
    }

    /// HTML of the page, which waits for a `MessagePort`.
    pub fn page(&self) -> &str {
        &self.page
    }

    /// Connects a page, in place of one that was connected: the first messages to it are waiting then.
    pub fn connect(&mut self) {
        self.outbox.disconnect(self.connected);
        self.connected = self.outbox.connect().unwrap_or(0);
        self.session.greet();
        self.session.publish();
    }

    /// Takes a message from the page, JSON, to be executed in [`advance`](Self::advance).
    pub fn command(&self, text: &str) {
        // The receiver is in the session.
        let _ = self.commands.send(Incoming::read(self.connected, text, &self.outbox));
    }

    /// Executes waiting commands and takes steps for about `time`; returns the time until it should be
    /// called again.
    pub fn advance(&mut self, time: Duration) -> Duration {
        let start = Instant::now();
        loop {
            self.session.turn(Duration::ZERO);
            let wait = self.session.wait();
            if !wait.is_zero() || start.elapsed() >= time {
                return wait;
            }
        }
    }

    /// Takes a message to the page, if one is waiting.
    pub fn message(&mut self) -> Option<LiveMessage> {
        loop {
            match self.outbox.take()? {
                Outgoing::Text(text) => return Some(LiveMessage::Text(text)),
                Outgoing::Frame(frame) => return Some(LiveMessage::Frame(frame)),
                // Answers to pings of sockets.
                Outgoing::Pong(_) => {}
            }
        }
    }

    /// MCAP file of the run so far, or of the last recording that the page has ended.
    ///
    /// # Errors
    /// An error of writing or reading.
    pub fn recorded(&mut self) -> Result<Vec<u8>, LiveError> {
        self.session.recorded()
    }

    /// Takes steps without a page and without a recording.
    ///
    /// # Errors
    /// A step that was not taken.
    pub fn run(&mut self, steps: u64) -> Result<(), StepFailure> {
        let experiment = self.session.experiment_mut();
        for _ in 0..steps {
            experiment.step();
            if let Some(failure) = experiment.failure() {
                return Err(failure.clone());
            }
        }
        Ok(())
    }

    /// The simulation.
    pub fn simulation(&self) -> &Simulation {
        self.session.experiment().simulation()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"
        title = "Two points"
        dimension = 2
        [time]
        integrator = "symplectic-euler"
        step = 1e-3
        duration = 1.0
        [world]
        gravity = [0.0, -9.81]
        [[body]]
        name = "points"
        mesh = { inline = { points = [[0.0, 0.0], [1.0, 0.0]], edges = [[0, 1]] } }
        mass = { total = 1.0 }
        springs = { stiffness = 10.0 }
        [output]
        rate = 100.0
    "#;

    fn texts(scene: &mut EmbeddedScene) -> (Vec<serde_json::Value>, usize) {
        let (mut texts, mut frames) = (vec![], 0);
        while let Some(message) = scene.message() {
            match message {
                LiveMessage::Text(text) => texts.push(serde_json::from_str(&text).unwrap()),
                LiveMessage::Frame(frame) => {
                    assert!(frame.starts_with(b"PTRM"));
                    frames += 1;
                }
            }
        }
        (texts, frames)
    }

    fn frames(recording: &[u8], folder: &Path) -> u64 {
        let path = folder.join("copy.mcap");
        std::fs::write(&path, recording).unwrap();
        pliant_record::read::info(&path).unwrap().frames
    }

    #[test]
    fn a_page_is_greeted_and_obeyed_and_the_run_is_recorded() {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = EmbeddedScene::new(Source::new("a.toml", SCENE), folder.path()).unwrap();
        assert!(scene.page().contains(r#"<script type="application/json" id="live">{"port":true}</script>"#));
        scene.connect();
        let (greeting, _) = texts(&mut scene);
        assert_eq!(greeting[0]["type"], "hello");
        assert_eq!(greeting[0]["vertex_count"], 2);

        // As fast as it can, until 200 steps have been taken.
        scene.command(r#"{"command":1,"do":"speed","value":null}"#);
        while scene.simulation().state().step < 200 {
            assert_eq!(scene.advance(Duration::ZERO), Duration::ZERO);
        }
        scene.command(r#"{"command":2,"do":"pause"}"#);
        let paused = texts(&mut scene).0;
        assert!(
            paused.iter().any(|text| text["type"] == "reply" && text["command"] == 2 && text["ok"] == true)
        );
        assert!(!scene.advance(Duration::ZERO).is_zero());
        let (step, recorded) = (scene.simulation().state().step, scene.recorded().unwrap());
        assert_eq!(frames(&recorded, folder.path()), 1 + step / 10);

        // One step more, although it is paused; the recording has gone on.
        scene.command(r#"{"command":3,"do":"step","count":10}"#);
        while scene.simulation().state().step < step + 10 {
            scene.advance(Duration::ZERO);
        }
        assert_eq!(frames(&scene.recorded().unwrap(), folder.path()), 2 + step / 10);

        // It begins anew at the start; a page that connects later is greeted too.
        scene.command(r#"{"command":4,"do":"reset"}"#);
        scene.advance(Duration::ZERO);
        assert_eq!(frames(&scene.recorded().unwrap(), folder.path()), 1);
        scene.connect();
        scene.command("no JSON");
        scene.advance(Duration::ZERO);
        let (again, _) = texts(&mut scene);
        assert_eq!((&again[0]["type"], &again[0]["state"]["step"]), (&"hello".into(), &0.into()));
        assert!(again.iter().any(|text| text["type"] == "reply" && text["ok"] == false));
    }

    #[test]
    fn a_scene_that_cannot_be_simulated_has_a_place() {
        let folder = tempfile::tempdir().unwrap();
        let text = SCENE.replace("dimension = 2", "dimension = 4");
        let error = EmbeddedScene::new(Source::new("a.toml", text), folder.path()).err().unwrap();
        let LiveError::Scene(error) = error else { unreachable!("{error}") };
        assert_eq!((error.line(), error.column()), (Some(3), Some(21)));
    }
}
