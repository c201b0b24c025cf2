//! Every derivative that a shipped scene offers by a number of its text, against a difference.
//!
//! Names without a number in the text (positions, velocities, forces of every step, pins, arrays that a scene
//! may give per element or per vertex, rest positions) have tests of their own: `differences`, `each_step`,
//! `shapes`.

use std::collections::BTreeMap;
use std::path::Path;

use pliant::simulation::Simulation;
use pliant_gradient::{ParameterSelection, UNLIMITED, check, gradient, names};
use pliant_scene::Scene;
use serde_json::Value;

use crate::differences::ScatteredLoss;
use crate::solid::assembled;
use crate::support::{scattered, solve_exactly};

/// Larger scenes take long.
const MOST_COORDINATES: usize = 500;

/// Steps of every run.
const STEPS: u64 = 4;

/// Numbers of one name that are compared.
const MOST_NUMBERS: usize = 3;

/// Largest relative difference between a derivative and the best of the differences.
const TOLERANCE: f64 = 1e-5;

/// Difference of losses, relative to their terms, that rounding and solves may leave.
const NOISE: f64 = 3e-12;

/// The value of a key; bodies are keys by their names.
fn value_at<'a>(scene: &'a mut Value, key: &str, bodies: &[String]) -> Option<&'a mut Value> {
    let mut words: Vec<String> = key.split('.').map(str::to_owned).collect();
    if words[0] == "body" {
        words[1] = bodies.iter().position(|name| *name == words[1])?.to_string();
    }
    words.iter().try_fold(scene, |value, word| match value {
        Value::Array(values) => values.get_mut(word.parse::<usize>().ok()?),
        Value::Object(values) => values.get_mut(word),
        _ => None,
    })
}

/// The numbers of a value, in their order; `None` where it has others.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Number(number) => Some(vec![number.as_f64()?]),
        Value::Array(values) => values.iter().map(Value::as_f64).collect(),
        _ => None,
    }
}

/// The value with its number `i` changed.
fn with_number(value: &Value, i: usize, number: f64) -> Value {
    match value {
        Value::Array(values) => {
            let mut values = values.clone();
            values[i] = number.into();
            Value::Array(values)
        }
        _ => number.into(),
    }
}

/// A start that is not at rest: parameters of springs and materials matter from the second step on.
fn started(scene: &Scene) -> Simulation {
    let mut simulation = assembled(scene).0;
    if simulation.method().is_static() {
        return simulation;
    }
    let velocities = scattered(simulation.state().v().len(), 7.0);
    let free: Vec<bool> = simulation.system().inverse_mass().iter().map(|w| *w > 0.0).collect();
    for ((v, change), free) in simulation.state_mut().v_mut().iter_mut().zip(&velocities).zip(free) {
        *v += if free { 0.05 * change } else { 0.0 };
    }
    if simulation.method().documentation.solves > 0 {
        solve_exactly(&mut simulation);
    }
    simulation
}

/// The difference quotient nearest to `found`, over several steps, and the noise of that quotient.
fn nearest(found: f64, size: f64, mut loss: impl FnMut(f64) -> Option<(f64, f64)>) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64)> = None;
    for power in 2..6 {
        let h = size * 0.1_f64.powi(power);
        let [(ahead, terms), (behind, _)] = [loss(h)?, loss(-h)?];
        let [(far_ahead, _), (far_behind, _)] = [loss(2.0 * h)?, loss(-2.0 * h)?];
        let quotient = (8.0 * (ahead - behind) - (far_ahead - far_behind)) / (12.0 * h);
        let noise = NOISE * terms / h;
        if best.is_none_or(|(best, _)| (quotient - found).abs() < (best - found).abs()) {
            best = Some((quotient, noise));
        }
    }
    best
}

#[test]
fn every_number_that_a_scene_offers_has_the_derivative_that_differences_have() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "toml"));
    files.sort();
    let (mut compared, mut faults, mut failed) = (BTreeMap::<String, usize>::new(), vec![], vec![]);
    for file in files {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let scene = Scene::from_path(&file).unwrap_or_else(|error| panic!("{name}: {error}"));
        let (mut simulation, topology) = assembled(&scene);
        if simulation.state().x().len() > MOST_COORDINATES || check(&mut simulation).is_err() {
            continue;
        }
        let bodies: Vec<String> = scene.body.iter().enumerate().map(|(i, b)| b.name_or_default(i)).collect();
        let document = serde_json::to_value(&scene).unwrap();
        let offered = names(&scene, &topology);
        let given: Vec<(&String, Value, Vec<f64>)> = offered
            .iter()
            .filter_map(|key| {
                let value = value_at(&mut document.clone(), key, &bodies)?.clone();
                let found = numbers(&value)?;
                Some((key, value, found))
            })
            .collect();
        if given.is_empty() {
            continue;
        }
        let keys: Vec<&String> = given.iter().map(|(key, ..)| *key).collect();
        let mut selection =
            ParameterSelection::new(&scene, &topology, simulation.numbering(), &keys).unwrap();
        let mut loss = ScatteredLoss::new(STEPS, started(&scene));
        let run = gradient(&mut started(&scene), STEPS, &mut loss, selection.parameters(), UNLIMITED);
        let Ok(found) = run else {
            failed.push(name);
            continue;
        };
        for ((key, value, numbers), part) in given.iter().zip(selection.parts(&found)) {
            if part.len() != numbers.len() {
                continue;
            }
            for (i, number) in numbers.iter().enumerate().take(MOST_NUMBERS) {
                let size = if *number == 0.0 { 1.0 } else { number.abs() };
                let of = |change: f64| {
                    let mut document = document.clone();
                    *value_at(&mut document, key, &bodies)? = with_number(value, i, number + change);
                    let scene: Scene = serde_json::from_value(document).ok()?;
                    Some(loss.of_perturbed(&mut started(&scene)))
                };
                let Some((difference, noise)) = nearest(part[i], size, of) else { continue };
                let error = (part[i] - difference).abs();
                if error > TOLERANCE * part[i].abs().max(difference.abs()) + noise {
                    faults.push(format!("{name}: {key} {i}: {:e}, difference {difference:e}", part[i]));
                }
                let kind = key.rsplit('.').next().unwrap().to_owned();
                *compared.entry(kind).or_default() += usize::from(difference.abs() > 10.0 * noise);
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    // Runs that fail from a start that is not at rest.
    assert_eq!(failed, [] as [&str; 0]);
    assert!(compared.values().sum::<usize>() > 50, "{compared:?}");
}
