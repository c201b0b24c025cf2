//! Main loop of a running scene: commands, steps, frames, recordings.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use pliant::diagnostics::Measure;
use pliant_files::clock::Instant;
use pliant_record::Recorded;
use pliant_scene::experiment::{Experiment, ExperimentCommand};
use serde_json::{Value, json};

use crate::LiveError;
use crate::outbox::Outbox;
use crate::pace::Pace;
use crate::protocol::{self, Action, Request};
use crate::recording::{self, LiveRecording};

/// Interval between frames.
const FRAME: Duration = Duration::from_millis(16);
/// Interval between states without a command.
const STATE: Duration = Duration::from_millis(50);
/// Time to wait for commands if no step is due.
const IDLE: Duration = Duration::from_millis(20);
/// Shorter waits are skipped: the next steps catch up.
const SHORTEST: Duration = Duration::from_millis(1);

/// Message from the page with this number.
pub(crate) struct Incoming {
    pub(crate) page: u64,
    pub(crate) request: Result<Request, (Option<u32>, String)>,
}

/// Settings of a session.
pub(crate) struct LiveSettings {
    pub(crate) title: String,
    pub(crate) measures: Vec<String>,
    pub(crate) speed: Option<f64>,
    pub(crate) paused: bool,
    /// Directory that contains all recordings.
    pub(crate) folder: PathBuf,
    /// True if a recording that ends because time goes back begins anew.
    pub(crate) records_anew: bool,
}

impl Incoming {
    /// Reads a text from `page`. A pause is acknowledged immediately: the present step may take long.
    pub(crate) fn read(page: u64, text: &str, outbox: &Outbox) -> Incoming {
        let request = Request::read(text);
        if let Ok(Request { command, action: Action::Pause }) = &request
            && outbox.page() == page
        {
            outbox.text(protocol::reply(Some(*command), None));
        }
        Incoming { page, request }
    }
}

pub(crate) struct LiveSession {
    experiment: Experiment,
    settings: LiveSettings,
    outbox: Arc<Outbox>,
    queue: Receiver<Incoming>,
    /// Positions of the page's vertices [m]: walls that are no longer bodies are drawn there.
    start: Vec<f64>,
    pace: Pace,
    paused: bool,
    /// Number of steps to take although paused.
    asked_steps: u64,
    measure: Option<(&'static Measure, usize)>,
    recording: Option<LiveRecording>,
    recorded: Vec<Recorded>,
    /// Greeted page, and its last executed command.
    page: u64,
    last_command: u32,
    /// True if a frame, or a state, has not been shown.
    frame_is_due: bool,
    state_is_due: bool,
    frame_shown: Instant,
    state_shown: Instant,
}

impl LiveSession {
    pub(crate) fn new(
        experiment: Experiment,
        settings: LiveSettings,
        outbox: Arc<Outbox>,
        queue: Receiver<Incoming>,
    ) -> LiveSession {
        let (now, time) = (Instant::now(), experiment.simulation().state().time);
        LiveSession {
            pace: Pace::new(settings.speed, time),
            paused: settings.paused,
            start: experiment.simulation().positions().into_owned(),
            experiment,
            settings,
            outbox,
            queue,
            asked_steps: 0,
            measure: None,
            recording: None,
            recorded: vec![],
            page: 0,
            last_command: 0,
            frame_is_due: false,
            state_is_due: false,
            frame_shown: now,
            state_shown: now,
        }
    }

    /// Starts a recording.
    ///
    /// # Errors
    /// A recording is active, the path is outside the directory, or the file exists or cannot be written.
    pub(crate) fn record(&mut self, path: &Path) -> Result<(), LiveError> {
        if let Some(recording) = &self.recording {
            return Err(LiveError::Recording { path: recording.path.clone() });
        }
        self.recording = Some(LiveRecording::begin(&self.settings.folder, path, &mut self.experiment)?);
        Ok(())
    }

    /// The experiment.
    pub(crate) fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// The experiment, to be stepped without a page.
    pub(crate) fn experiment_mut(&mut self) -> &mut Experiment {
        &mut self.experiment
    }

    /// The experiment at its end, and the completed recordings.
    #[cfg(feature = "server")]
    pub(crate) fn into_parts(self) -> (Experiment, Vec<Recorded>) {
        (self.experiment, self.recorded)
    }

    /// Takes commands, waiting up to `wait` for the first, and a step if one is due; sends what is due.
    pub(crate) fn turn(&mut self, wait: Duration) {
        self.greet();
        self.take_commands(wait);
        if self.wait().is_zero() {
            self.step();
        }
        self.publish();
    }

    /// Greets a newly connected page.
    pub(crate) fn greet(&mut self) {
        let page = self.outbox.page();
        if page == self.page {
            return;
        }
        (self.page, self.last_command, self.measure) = (page, 0, None);
        if page != 0 {
            let state = self.state();
            let LiveSettings { title, measures, .. } = &self.settings;
            self.outbox.text(protocol::hello(&self.experiment, self.start.len(), title, measures, &state));
            self.frame_is_due = true;
        }
    }

    /// Time until the next step is due.
    pub(crate) fn wait(&mut self) -> Duration {
        if self.asked_steps > 0 {
            return Duration::ZERO;
        }
        if self.paused {
            return IDLE;
        }
        let wait = self.pace.wait(self.experiment.simulation().state().time);
        if wait < SHORTEST { Duration::ZERO } else { wait.min(IDLE) }
    }

    /// Executes waiting commands, waiting up to `wait` for the first.
    fn take_commands(&mut self, wait: Duration) {
        let first = match wait.is_zero() {
            true => self.queue.try_recv(),
            false => self.queue.recv_timeout(wait).map_err(|_| TryRecvError::Empty),
        };
        let Ok(first) = first else { return };
        let waiting: Vec<Incoming> = std::iter::once(first).chain(self.queue.try_iter()).collect();
        let is_drag =
            |incoming: &Incoming| incoming.request.as_ref().is_ok_and(|request| request.action.is_drag());
        let superseded: Vec<bool> = (0..waiting.len())
            .map(|i| is_drag(&waiting[i]) && waiting.get(i + 1).is_some_and(is_drag))
            .collect();
        for (incoming, superseded) in waiting.into_iter().zip(superseded) {
            // A page may have connected and sent a command during the wait.
            self.greet();
            if incoming.page == self.page && !superseded {
                self.answer(incoming.request);
            }
        }
    }

    fn answer(&mut self, request: Result<Request, (Option<u32>, String)>) {
        let Request { command, action } = match request {
            Ok(request) => request,
            Err((command, message)) => return self.outbox.text(protocol::reply(command, Some(&message))),
        };
        let is_acknowledged = action.is_drag() || action == Action::Pause;
        let changes_controls = action.changes_controls();
        let refused = self.execute(action).err();
        self.last_command = command;
        (self.state_is_due, self.frame_is_due) = (true, true);
        // A drag is acknowledged by the next frame, a pause when it is read.
        if refused.is_some() || !is_acknowledged {
            self.outbox.text(protocol::reply(Some(command), refused.as_deref()));
        }
        if refused.is_none() && changes_controls {
            self.outbox.text(protocol::controls(&self.experiment).to_string());
        }
    }

    /// Executes a command; the error is the message of a rejection.
    fn execute(&mut self, action: Action) -> Result<(), String> {
        let text = |error: LiveError| error.to_string();
        match action {
            Action::Pause => (self.paused, self.asked_steps) = (true, 0),
            Action::Continue => {
                self.paused = false;
                self.restart_pace();
            }
            Action::Step(count) => {
                self.paused = true;
                self.asked_steps = self.asked_steps.saturating_add(count);
            }
            Action::Speed(speed) => {
                self.pace.speed = speed;
                self.restart_pace();
            }
            Action::Record(path) => self.record(Path::new(&path)).map_err(text)?,
            Action::StopRecording => self.end_recording().map_err(text)?,
            Action::Measure(name) => self.measure = self.measure_of(name)?,
            Action::Experiment(command) => self.execute_in_experiment(&command)?,
        }
        Ok(())
    }

    fn execute_in_experiment(&mut self, command: &ExperimentCommand) -> Result<(), String> {
        let goes_back = matches!(command, ExperimentCommand::Reset | ExperimentCommand::GoBack);
        // Time in a recording cannot go back.
        let ended = self.recording.as_ref().filter(|_| goes_back).map(|recording| recording.path.clone());
        if goes_back {
            self.end_recording().map_err(|error| error.to_string())?;
        }
        let vertices = self.experiment.topology().vertex_count;
        self.experiment.execute(command).map_err(|error| error.to_string())?;
        // A recording keeps the same vertices throughout.
        if self.experiment.topology().vertex_count != vertices
            && let Some(recording) = &self.recording
        {
            let path = recording.path.display();
            let ended = format!("the recording {path} has ended: walls became bodies, or ceased to be");
            self.end_recording().map_err(|error| error.to_string())?;
            self.outbox.text(protocol::reply(None, Some(&ended)));
        }
        if goes_back {
            self.asked_steps = 0;
            self.restart_pace();
        }
        if let Some(path) = ended.filter(|_| self.settings.records_anew) {
            recording::forget(&self.settings.folder, &path).map_err(|error| error.to_string())?;
            self.record(&path).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    fn measure_of(&self, name: Option<String>) -> Result<Option<(&'static Measure, usize)>, String> {
        let Some(name) = name else { return Ok(None) };
        let measures = &self.settings.measures;
        let known = measures.contains(&name).then(|| protocol::measure(&name)).flatten();
        known.map(Some).ok_or_else(|| format!("there is no measure `{name}`; there are {measures:?}"))
    }

    fn restart_pace(&mut self) {
        self.pace.restart(self.experiment.simulation().state().time);
    }

    fn step(&mut self) {
        self.asked_steps = self.asked_steps.saturating_sub(1);
        if self.experiment.step() {
            let recorded =
                self.recording.as_mut().map(|recording| recording.after_step(&mut self.experiment));
            if let Some(Err(error)) = recorded {
                // Its frames so far stay in the unfinished file.
                self.recording = None;
                self.outbox.text(protocol::reply(None, Some(&error.to_string())));
            }
        } else if !self.experiment.simulation().system().is_stopped() {
            (self.paused, self.asked_steps, self.state_is_due) = (true, 0, true);
        }
        self.frame_is_due = true;
        self.state_is_due |= self.paused && self.asked_steps == 0;
    }

    /// Content of a complete file: that of the active recording so far, or else the last one.
    ///
    /// # Errors
    /// There is none; an error of writing or reading.
    pub(crate) fn recorded(&mut self) -> Result<Vec<u8>, LiveError> {
        match (&mut self.recording, self.recorded.last()) {
            (Some(recording), _) => recording.so_far(),
            (None, Some(recorded)) => recording::content(&recorded.path),
            (None, None) => Err(LiveError::NothingRecorded),
        }
    }

    /// Finishes the recording, if one is active.
    ///
    /// # Errors
    /// A write error.
    pub(crate) fn end_recording(&mut self) -> Result<(), LiveError> {
        if let Some(recording) = self.recording.take() {
            self.recorded.push(recording.end(&self.experiment)?);
        }
        Ok(())
    }

    /// Sends frames and states that are due.
    pub(crate) fn publish(&mut self) {
        if self.page == 0 {
            return;
        }
        let elapsed = self.state_shown.elapsed();
        if self.state_is_due || (self.frame_is_due && elapsed >= STATE) {
            let state = self.state().to_string();
            self.outbox.text(state);
            (self.state_is_due, self.state_shown) = (false, Instant::now());
        }
        if self.frame_is_due && self.frame_shown.elapsed() >= FRAME && self.outbox.wants_frame() {
            let simulation = self.experiment.simulation();
            let frame = protocol::frame(simulation, &self.start, self.last_command, self.measure);
            self.outbox.frame(frame);
            (self.frame_is_due, self.frame_shown) = (false, Instant::now());
        }
    }

    fn state(&mut self) -> Value {
        let energy = protocol::energy(self.experiment.simulation_mut());
        let state = self.experiment.simulation().state();
        let (step, time) = (state.step, state.time);
        json!({
            "type": "state",
            "command": self.last_command,
            "step": step,
            "time": time,
            "paused": self.paused && self.asked_steps == 0,
            "speed": self.pace.speed,
            "pace": self.pace.reached(time),
            "recording": self.recording.as_ref().map(|recording| &recording.path),
            "energy": energy,
            "fault": self.experiment.failure(),
            "can_go_back": self.experiment.can_go_back(),
            "grabbed": self.experiment.grabbed(),
        })
    }
}
