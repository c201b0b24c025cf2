//! Checks of single values and vectors.

use crate::bounds::NumberRange;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::OneOrMany;

/// Collects problems.
pub(super) struct Checker {
    /// `None` if the scene's dimension itself is wrong: no vector then has the right length.
    pub(super) dimension: Option<usize>,
    problems: Vec<Problem>,
}

/// Unit at the end of a message: ` [m]`, or nothing.
fn bracketed(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" [{unit}]") }
}

fn name(path: &KeyPath) -> &str {
    path.last_key().unwrap_or("scene")
}

impl Checker {
    pub(super) fn new(dimension: usize) -> Checker {
        let dimension = matches!(dimension, 2 | 3).then_some(dimension);
        Checker { dimension, problems: Vec::new() }
    }

    pub(super) fn into_problems(self) -> Vec<Problem> {
        self.problems
    }

    pub(super) fn report(&mut self, problem: Problem) {
        self.problems.push(problem);
    }

    /// Checks that a number is finite and within the schema's bounds at its path. Returns true if it is
    /// valid, so that dependent checks can be skipped otherwise.
    pub(super) fn number(&mut self, path: &KeyPath, value: f64, unit: &str) -> bool {
        let bounds = NumberRange::at(path);
        let right = bounds.allow(value);
        if !right {
            let message = format!("`{}` must be {bounds}, got {value:?}{}", name(path), bracketed(unit));
            self.report(Problem::semantic(path.clone(), message));
        }
        right
    }

    /// Adds a line of help to the last reported problem.
    pub(super) fn help(&mut self, help: &str) {
        self.problems.last_mut().into_iter().for_each(|problem| problem.help.push(help.to_owned()));
    }

    /// Checks that a count is within the schema's bounds at its path.
    pub(super) fn count(&mut self, path: &KeyPath, value: usize) -> bool {
        let bounds = NumberRange::at(path);
        let right = bounds.allow(value as f64);
        if !right {
            let message = format!("`{}` must be {}, got {value}", name(path), bounds.of_a_count());
            self.report(Problem::semantic(path.clone(), message));
        }
        right
    }

    /// Checks each number of a list, with the bounds of the first; reports the first invalid one.
    pub(super) fn numbers(&mut self, path: &KeyPath, values: &[f64], unit: &str) -> bool {
        if values.is_empty() {
            return true;
        }
        let bounds = NumberRange::at(&path.index(0));
        match values.iter().position(|&value| !bounds.allow(value)) {
            Some(index) => self.number(&path.index(index), values[index], unit),
            None => true,
        }
    }

    /// Checks a number for all, or a list with one for each of `count` items, if their number is known.
    pub(super) fn one_or_many(
        &mut self,
        path: &KeyPath,
        values: &OneOrMany,
        unit: &str,
        count: Option<(u64, &str)>,
    ) {
        let values = match values {
            OneOrMany::One(value) => {
                self.number(path, *value, unit);
                return;
            }
            OneOrMany::Many(values) => values,
        };
        self.numbers(path, values, unit);
        let Some((count, things)) = count else { return };
        if values.len() as u64 != count {
            let message =
                format!("`{}` lists {} numbers, but the body has {count} {things}", name(path), values.len());
            let problem = Problem::semantic(path.clone(), message);
            self.report(problem.with_help(format!("give one number for all, or {count}")));
        }
    }

    /// Checks that a list has one entry per dimension.
    pub(super) fn components(&mut self, path: &KeyPath, length: usize) -> bool {
        let right = self.dimension.is_none_or(|dimension| dimension == length);
        if let (false, Some(dimension)) = (right, self.dimension) {
            let numbers = if length == 1 { "number" } else { "numbers" };
            let message = format!(
                "`{}` has {length} {numbers}, but `dimension` is {dimension}: {dimension} are needed",
                name(path)
            );
            self.report(Problem::semantic(path.clone(), message));
        }
        right
    }

    /// Checks a vector: the scene's dimension and finite components.
    pub(super) fn vector(&mut self, path: &KeyPath, vector: &[f64], unit: &str) -> bool {
        self.components(path, vector.len()) & self.numbers(path, vector, unit)
    }

    /// Checks a list of vectors; reports the first invalid one.
    pub(super) fn vectors(&mut self, path: &KeyPath, vectors: &[Vec<f64>], unit: &str) {
        for (index, vector) in vectors.iter().enumerate() {
            if !self.vector(&path.index(index), vector, unit) {
                return;
            }
        }
    }

    /// Checks a direction: a non-zero vector.
    pub(super) fn direction(&mut self, path: &KeyPath, vector: &[f64], unit: &str) -> bool {
        if !self.vector(path, vector, unit) {
            return false;
        }
        let some = vector.iter().any(|&component| component != 0.0);
        if !some {
            let message = format!("`{}` is zero: it needs a direction", name(path));
            self.report(Problem::semantic(path.clone(), message));
        }
        some
    }
}
