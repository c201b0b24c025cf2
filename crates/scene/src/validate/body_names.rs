//! Lookup of bodies by name, for references to them.

use std::collections::HashMap;

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::Scene;
use crate::suggest;

/// Limit on the number of bodies for which an unknown name gets suggestions: every such name is compared
/// with all bodies.
const MOST_SUGGESTED: usize = 100;

/// Names of all bodies.
pub(super) struct BodyNames {
    names: Vec<String>,
    /// Index of the first body of each name.
    index: HashMap<String, usize>,
}

impl BodyNames {
    pub(super) fn of(scene: &Scene) -> BodyNames {
        let names: Vec<String> =
            scene.body.iter().enumerate().map(|(i, body)| body.name_or_default(i)).collect();
        let index = names.iter().cloned().enumerate().rev().map(|(i, name)| (name, i)).collect();
        BodyNames { names, index }
    }

    pub(super) fn count(&self) -> usize {
        self.names.len()
    }

    /// Index of the body of this name; reports an unknown name.
    pub(super) fn known(&self, check: &mut Checker, path: &KeyPath, name: &str) -> Option<usize> {
        let found = self.index.get(name).copied();
        if found.is_none() {
            let mut problem = Problem::semantic(path.clone(), format!("there is no body {name:?}"));
            if self.count() <= MOST_SUGGESTED {
                let known: Vec<&str> = self.names.iter().map(String::as_str).collect();
                problem.help.extend(suggest::help(name, &known, "bodies"));
            }
            check.report(problem);
        }
        found
    }
}
