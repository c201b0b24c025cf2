//! Loads.

use super::check::Checker;
use super::motion;
use super::pins::{formula, formulas, one_selection};
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::Body;

pub(super) fn loads(check: &mut Checker, path: &KeyPath, body: &Body, duration: f64) {
    for (index, load) in body.load.iter().enumerate() {
        let path = path.index(index);
        if let Some(selection) = one_selection(check, &path, load.selections(), false) {
            motion::selection(check, &path, &selection, body.vertex_count());
        }
        let vectors = load.vectors();
        let mut keys: Vec<&str> = vectors.iter().map(|(key, ..)| *key).collect();
        keys.extend(load.pressure.as_ref().map(|_| "pressure"));
        if keys.len() != 1 {
            let keys: Vec<String> = keys.iter().map(|key| format!("`{key}`")).collect();
            let found = if keys.is_empty() { "none".to_owned() } else { keys.join(" and ") };
            let problem =
                Problem::semantic(path.clone(), format!("a load is one force, this one has {found}"));
            let help =
                "give exactly one of `force`, `force_per_vertex`, `body_force`, `traction` and `pressure`";
            check.report(problem.with_help(help));
        }
        for (key, unit, vector) in vectors {
            let path = path.key(key);
            check.components(&path, vector.len());
            formulas(check, &path, vector, unit, duration);
        }
        if let Some(pressure) = &load.pressure {
            formula(check, &path.key("pressure"), pressure, "Pa", duration);
        }
    }
}
