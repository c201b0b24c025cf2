//! Protocol: incoming commands, outgoing states and frames.

use pliant::diagnostics::{MEASURES, Measure};
use pliant::simulation::Simulation;
use pliant_scene::experiment::{Experiment, ExperimentCommand};
use serde_json::{Value, json};

/// First word of a frame, `PTRM`.
const MAGIC: u32 = 0x4D52_5450;
/// Size of the header before the positions [bytes].
const HEADER: usize = 40;

/// Size limit of a command [bytes].
const LONGEST: usize = 64 << 10;

/// Message from the page.
#[derive(Debug, PartialEq)]
pub(crate) struct Request {
    /// Command number, counted up by the page.
    pub(crate) command: u32,
    pub(crate) action: Action,
}

/// Content of a message.
#[derive(Debug, PartialEq)]
pub(crate) enum Action {
    Pause,
    Continue,
    Step(u64),
    /// Simulated seconds per second; `None` for maximum speed.
    Speed(Option<f64>),
    Record(String),
    StopRecording,
    /// Element measure to send with frames.
    Measure(Option<String>),
    Experiment(ExperimentCommand),
}

impl Request {
    /// Parses a message.
    ///
    /// # Errors
    /// The command number, if any, and the error message.
    pub(crate) fn read(text: &str) -> Result<Request, (Option<u32>, String)> {
        if text.len() > LONGEST {
            return Err((None, format!("{} bytes are too many: {LONGEST} at most", text.len())));
        }
        let value: Value = serde_json::from_str(text).map_err(|error| (None, format!("no JSON: {error}")))?;
        let command = value["command"].as_u64().and_then(|number| u32::try_from(number).ok());
        let Some(number) = command else {
            return Err((None, "a message has a `command`, its number from 1".into()));
        };
        let action = Action::read(&value).map_err(|message| (command, message))?;
        Ok(Request { command: number, action })
    }
}

impl Action {
    fn read(value: &Value) -> Result<Action, String> {
        let text = |key: &str| value[key].as_str().map(str::to_owned).ok_or(format!("`{key}` is a text"));
        Ok(match value["do"].as_str().ok_or("`do` is a text")? {
            "pause" => Action::Pause,
            "continue" => Action::Continue,
            "step" => match value.get("count") {
                None => Action::Step(1),
                Some(count) => Action::Step(count.as_u64().ok_or("`count` is a number of steps")?),
            },
            "speed" => Action::Speed(match &value["value"] {
                Value::Null => None,
                speed => Some(
                    speed
                        .as_f64()
                        .filter(|s| s.is_finite() && *s > 0.0)
                        .ok_or("`value` is a positive speed, or null")?,
                ),
            }),
            "record" => Action::Record(text("path")?),
            "stop-recording" => Action::StopRecording,
            "measure" => Action::Measure(match &value["name"] {
                Value::Null => None,
                _ => Some(text("name")?),
            }),
            _ => {
                Action::Experiment(serde_json::from_value(value.clone()).map_err(|error| error.to_string())?)
            }
        })
    }

    /// True if only the last of consecutive ones counts.
    pub(crate) fn is_drag(&self) -> bool {
        matches!(self, Action::Experiment(ExperimentCommand::Drag { .. }))
    }

    /// True if the action may change values of controls.
    pub(crate) fn changes_controls(&self) -> bool {
        use ExperimentCommand::{Integrator, Pin, Set};
        matches!(self, Action::Experiment(Set { .. } | Pin { .. } | Integrator { .. }))
    }
}

/// Reply to a command; `refused` is the message if it was rejected.
pub(crate) fn reply(command: Option<u32>, refused: Option<&str>) -> String {
    match refused {
        None => json!({ "type": "reply", "command": command, "ok": true }),
        Some(message) => json!({ "type": "reply", "command": command, "ok": false, "message": message }),
    }
    .to_string()
}

/// Present controls and integrator.
pub(crate) fn controls(experiment: &Experiment) -> Value {
    let (_, present) = experiment.integrators();
    json!({ "type": "controls", "controls": experiment.controls(), "integrator": present })
}

/// First message, to a page with this number of coordinates.
pub(crate) fn hello(
    experiment: &Experiment,
    coordinates: usize,
    title: &str,
    measures: &[String],
    state: &Value,
) -> String {
    let (integrators, _) = experiment.integrators();
    let mut hello = controls(experiment);
    let further = json!({
        "type": "hello",
        "title": title,
        "dimension": experiment.topology().dimension,
        "vertex_count": coordinates / experiment.topology().dimension,
        "time_step": experiment.simulation().step_size(),
        "integrators": integrators,
        "measures": measures,
        "state": state,
    });
    if let (Some(hello), Value::Object(further)) = (hello.as_object_mut(), further) {
        hello.extend(further);
    }
    hello.to_string()
}

/// Present energies [J].
pub(crate) fn energy(simulation: &mut Simulation) -> Value {
    let now = simulation.diagnostics();
    let mut energy = json!({ "kinetic": now.kinetic, "elastic": now.elastic, "total": now.total });
    if now.gravitational != 0.0 {
        energy["gravitational"] = now.gravitational.into();
    }
    for (name, further) in now.further_energies() {
        energy[name] = further.into();
    }
    if let Some(balance) = now.balance {
        energy["balance"] = (now.total - balance.net()).into();
    }
    energy
}

/// Element measure with the given colouring name, and the index of its field.
pub(crate) fn measure(name: &str) -> Option<(&'static Measure, usize)> {
    MEASURES.iter().find_map(|measure| {
        let field = measure.fields.iter().position(|field| match measure.fields {
            [_] => name == measure.name,
            _ => name.strip_prefix(measure.name).and_then(|rest| rest.strip_prefix(' ')) == Some(field),
        });
        field.map(|field| (measure, field))
    })
}

/// Encodes a frame: header, positions, speeds, and a measure of each element. Vertices are those of the
/// page, which began with positions `start` [m]; since then walls, the last ones, may have become bodies
/// or ceased to be.
pub(crate) fn frame(
    simulation: &Simulation,
    start: &[f64],
    command: u32,
    measure: Option<(&Measure, usize)>,
) -> Vec<u8> {
    let (mut x, mut v) = (simulation.positions().into_owned(), simulation.velocities().into_owned());
    let d = simulation.system().dimension();
    x.extend(start.iter().skip(x.len()));
    x.truncate(start.len());
    v.resize(start.len(), 0.0);
    let elements = measure.map_or(vec![], |measure| element_values(simulation, measure));
    let (state, vertices) = (simulation.state(), x.len() / d);
    let mut bytes = Vec::with_capacity(HEADER + 4 * (x.len() + vertices + elements.len()));
    bytes.extend([MAGIC, command].map(u32::to_le_bytes).as_flattened());
    bytes.extend(state.step.to_le_bytes());
    bytes.extend(state.time.to_le_bytes());
    let counts = [vertices as u32, d as u32, elements.len() as u32, 0];
    bytes.extend(counts.map(u32::to_le_bytes).as_flattened());
    let speed = |row: &[f64]| row.iter().map(|c| c * c).sum::<f64>().sqrt();
    let numbers = x.iter().copied().chain(v.chunks_exact(d).map(speed)).chain(elements);
    numbers.for_each(|number| bytes.extend((number as f32).to_le_bytes()));
    bytes
}

fn element_values(simulation: &Simulation, (measure, field): (&Measure, usize)) -> Vec<f64> {
    let mut numbers = vec![];
    let value = |state: &pliant::diagnostics::ElementState| {
        numbers.clear();
        measure.write(state, &mut numbers);
        numbers[field]
    };
    simulation.element_states().iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_or_refused_with_their_number() {
        let read = |text: &str| Request::read(text).map(|request| request.action);
        assert_eq!(read(r#"{"command":1,"do":"step"}"#), Ok(Action::Step(1)));
        assert_eq!(read(r#"{"command":1,"do":"speed","value":null}"#), Ok(Action::Speed(None)));
        let drag = ExperimentCommand::Drag { target: vec![0.5, 1.0] };
        let text = r#"{"command":2,"do":"drag","target":[0.5,1]}"#;
        assert_eq!(read(text), Ok(Action::Experiment(drag)));
        assert_eq!(
            read(r#"{"command":3,"do":"go-back"}"#),
            Ok(Action::Experiment(ExperimentCommand::GoBack))
        );
        for (text, number) in [
            ("{", None),
            ("[1]", None),
            (r#"{"do":"pause"}"#, None),
            (r#"{"command":7}"#, Some(7)),
            (r#"{"command":7,"do":"fly"}"#, Some(7)),
            (r#"{"command":7,"do":"speed","value":-1}"#, Some(7)),
            (r#"{"command":7,"do":"grab","vertex":-1,"target":[0,0]}"#, Some(7)),
        ] {
            assert_eq!(Request::read(text).unwrap_err().0, number, "{text}");
        }
    }

    #[test]
    fn measures_are_found_by_the_names_of_colourings() {
        let found = |name| measure(name).map(|(measure, field)| (measure.name, field));
        assert_eq!(found("jacobian"), Some(("jacobian", 0)));
        assert_eq!(found("cauchy-stress xy"), Some(("cauchy-stress", 3)));
        assert_eq!((found("cauchy-stress"), found("speed")), (None, None));
    }
}
