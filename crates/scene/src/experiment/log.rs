//! Commands and the steps between them, to be repeated.

use super::ExperimentCommand;

/// A command, and when it was executed.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LoggedCommand {
    /// Number of steps that had been tried before it.
    pub after: u64,
    /// The command.
    #[serde(flatten)]
    pub command: ExperimentCommand,
}

/// Commands of an experiment, in order. As text it is JSON, one object a line: the scene, the commands, the
/// number of steps.
#[derive(Clone, Debug, PartialEq)]
pub struct CommandLog {
    /// Text of the scene at the beginning.
    pub scene: String,
    /// The commands that were not refused.
    pub commands: Vec<LoggedCommand>,
    /// Number of steps that were tried.
    pub steps: u64,
}

/// A text is no log.
#[derive(Debug, thiserror::Error)]
#[error("line {line} of the log: {message}")]
pub struct LogError {
    /// Line, from 1.
    pub line: usize,
    /// Message.
    pub message: String,
}

#[derive(serde::Serialize, serde::Deserialize)]
struct LogHead {
    scene: String,
}

#[derive(serde::Serialize, serde::Deserialize)]
struct LogEnd {
    steps: u64,
}

impl CommandLog {
    pub(super) fn new(scene: &str) -> CommandLog {
        CommandLog { scene: scene.to_owned(), commands: vec![], steps: 0 }
    }

    /// The text.
    ///
    /// # Errors
    /// None of content: strings and finite numbers can be written.
    pub fn to_json_lines(&self) -> serde_json::Result<String> {
        let mut lines = vec![serde_json::to_string(&LogHead { scene: self.scene.clone() })?];
        for command in &self.commands {
            lines.push(serde_json::to_string(command)?);
        }
        lines.push(serde_json::to_string(&LogEnd { steps: self.steps })?);
        Ok(lines.join("\n") + "\n")
    }

    /// Back from that text.
    ///
    /// # Errors
    /// [`LogError`]: a line is not what it should be.
    pub fn from_json_lines(text: &str) -> Result<CommandLog, LogError> {
        let lines: Vec<&str> = text.lines().collect();
        let [first, commands @ .., last] = &lines[..] else {
            return Err(LogError {
                line: 1,
                message: "it has a line for the scene and one for steps".into(),
            });
        };
        let LogHead { scene } = parsed(1, first)?;
        let commands = commands.iter().enumerate().map(|(i, line)| parsed(i + 2, line));
        let commands = commands.collect::<Result<_, _>>()?;
        let LogEnd { steps } = parsed(lines.len(), last)?;
        Ok(CommandLog { scene, commands, steps })
    }
}

fn parsed<T: serde::de::DeserializeOwned>(line: usize, text: &str) -> Result<T, LogError> {
    serde_json::from_str(text).map_err(|error| LogError { line, message: error.to_string() })
}
