mod arbitrary;
mod duration;
mod files;
mod millimetres;
mod overrides;
mod parse;
mod picture;
mod remedies;
mod semantic;
mod shapes;
mod units;
mod whole;

use super::{Problem, Scene, SceneError, Source};

/// A scene without a mistake, for mistakes to be put in.
const GOOD: &str = r#"dimension = 2

[time]
integrator = "symplectic-euler"
step = 1e-3
duration = 1.0

[world]
gravity = [0.0, -9.8]

[[body]]
name = "net"
mesh = { grid = { cells = [2, 3], spacing = 0.1 } }
springs = { stiffness = 100.0 }
mass = { per_vertex = 1.0 }
pin = [{ box = { min = [0.0, 0.0], max = [0.0, 1.0] } }]

[output]
rate = 60.0
channels = ["state"]
"#;

// Parts of it, to be replaced.
const MESH: &str = "{ grid = { cells = [2, 3], spacing = 0.1 } }";
const SPRINGS: &str = "{ stiffness = 100.0 }";
const MASS: &str = "{ per_vertex = 1.0 }";
const PIN: &str = "[{ box = { min = [0.0, 0.0], max = [0.0, 1.0] } }]";

/// `GOOD` with one text replaced by another.
fn changed(old: &str, new: &str) -> String {
    assert_eq!(GOOD.matches(old).count(), 1, "{old}");
    GOOD.replace(old, new)
}

fn read(text: &str) -> Result<Scene, SceneError> {
    Source::new("scene.toml", text).scene()
}

fn error(text: &str) -> SceneError {
    read(text).expect_err("the scene has a mistake")
}

/// `line:column message` of every problem.
fn briefly(error: &SceneError) -> Vec<String> {
    error
        .problems()
        .iter()
        .map(|p| format!("{}:{} {}: {}", p.line.unwrap(), p.column.unwrap(), p.path, p.message))
        .collect()
}
