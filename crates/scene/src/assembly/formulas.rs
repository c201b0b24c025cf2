//! Warnings of formulas: calls without a meaning, changes between steps, oscillations that statics omits.

use std::f64::consts::PI;

use super::body::BodyAssembly;
use crate::{Body, KeyPath, OverTime, Scene};
use pliant::material::Lame;
use pliant::quantity::{Rounded, Seconds};
use pliant::simulation::Simulation;

/// Maximum number of intervals of a run that are sampled.
const MOST_INTERVALS: f64 = 4000.0;
/// Sampling points within a step, in steps. They are no simple fractions, at all of which an oscillation
/// could vanish.
const WITHIN: [f64; 4] = [0.190_983, 0.381_966, 0.618_034, 0.809_017];
/// Limit on the fraction of a formula's variance that linear interpolation between the steps misses: it
/// misses this fraction of a sine with 2.6 steps a period, and a twentieth with 4.
const MISSED: f64 = 0.3;
/// Missed fraction at the recommended step size.
const FOLLOWED: f64 = 0.01;
/// Maximum number of halvings of the step to find it.
const HALVINGS: i32 = 10;
/// Number of turning points from which on a formula counts as oscillating.
const SWINGS: usize = 3;
/// Fraction of a body's lowest natural frequency below which inertia is small.
const SLOW: f64 = 0.5;

/// One warning for each formula that probably means something else.
pub(super) fn warnings(scene: &Scene, simulation: &Simulation, bodies: &[BodyAssembly]) -> Vec<String> {
    let mut formulas = scene.formulas();
    formulas.retain(|(_, formula)| formula.depends_on_time() || formula.depends_on_place());
    let degenerate = formulas.iter().flat_map(|(path, formula)| degenerate(path, formula));
    let mut warnings: Vec<String> = degenerate.collect();
    formulas.retain(|(_, formula)| formula.depends_on_time());
    let places = places(bodies);
    let steps_are_fixed = simulation.step_control().is_none() && scene.time.arc_length.is_none();
    if let Some(h) = scene.time.step.filter(|_| steps_are_fixed) {
        let fast = |(path, formula): &(KeyPath, &OverTime)| between_steps(path, formula, &places, h, scene);
        warnings.extend(formulas.iter().find_map(fast));
    }
    let is_static = simulation.method().is_static() && scene.time.arc_length.is_none();
    if let Some((slowest, body)) = slowest(scene, bodies).filter(|_| is_static) {
        let swings =
            |(path, formula): &(KeyPath, &OverTime)| swings(path, formula, &places, scene, (slowest, body));
        warnings.extend(formulas.iter().find_map(swings));
    }
    warnings
}

/// Two reference positions [m].
fn places(bodies: &[BodyAssembly]) -> [[f64; 3]; 2] {
    let points = bodies.iter().filter(|body| !body.is_obstacle).map(|body| &body.mesh);
    let mut all = points.flat_map(|mesh| [mesh.point(0), mesh.point(mesh.vertex_count() - 1)]);
    let first = all.next().unwrap_or_default();
    [first, all.next_back().unwrap_or(first)].map(|row| {
        let mut place = [0.0; 3];
        place.iter_mut().zip(row).for_each(|(x, given)| *x = *given);
        place
    })
}

fn degenerate(path: &KeyPath, formula: &OverTime) -> Vec<String> {
    let OverTime::Formula(formula) = formula else { return vec![] };
    formula.degenerate_calls().into_iter().map(|call| format!("`{path}`: {call}")).collect()
}

/// Warns of a formula that changes more within the steps than from one to the next.
fn between_steps(
    path: &KeyPath,
    formula: &OverTime,
    places: &[[f64; 3]; 2],
    h: f64,
    scene: &Scene,
) -> Option<String> {
    let duration = scene.time.duration;
    let worst = places.iter().max_by(|a, b| {
        let missed = |place: &[f64; 3]| missed(formula, *place, h, duration).unwrap_or(0.0);
        missed(a).total_cmp(&missed(b))
    })?;
    missed(formula, *worst, h, duration).filter(|missed| *missed > MISSED)?;
    let mut finer = (1..=HALVINGS).map(|halvings| h / 2.0_f64.powi(halvings));
    let enough = finer.find(|h| missed(formula, *worst, *h, duration).is_some_and(|m| m <= FOLLOWED));
    let advice = match enough {
        Some(h) => format!("use steps of {} s", Rounded::<3>(h)),
        None => "let it change over several steps".to_owned(),
    };
    Some(format!("`{path}` changes too fast for steps of {}, which do not resolve it: {advice}", Seconds(h)))
}

/// Fraction of a formula's variance that linear interpolation between the steps misses; `None` if the
/// formula is constant or has no value.
fn missed(formula: &OverTime, place: [f64; 3], h: f64, duration: f64) -> Option<f64> {
    let steps = (duration / h).round().max(1.0);
    let intervals = steps.min(MOST_INTERVALS);
    let (mut count, mut sum, mut squares, mut errors) = (0.0, 0.0, 0.0, 0.0);
    for interval in 0..intervals as u64 {
        let step = (interval as f64 * (steps / intervals)).floor();
        let [from, to] = [step, step + 1.0].map(|step| formula.value(place, step * h));
        for within in WITHIN {
            let value = formula.value(place, (step + within) * h);
            let missed = value - (from + within * (to - from));
            count += 1.0;
            sum += value;
            squares += value * value;
            errors += missed * missed;
        }
    }
    let variance = squares - sum * sum / count;
    // For a constant the variance is a rounding error.
    (variance.is_finite() && variance > 1e-20 * squares).then(|| errors / variance)
}

/// Lowest natural frequency of an elastic body [rad/s], estimated, and the body's name. The estimate is a
/// cantilever's with the body's length `L` and smallest extent `t`: `1.015 sqrt(E / rho) t / L^2`.
fn slowest<'a>(scene: &Scene, bodies: &'a [BodyAssembly]) -> Option<(f64, &'a str)> {
    let of_body = |(spec, body): (&Body, &'a BodyAssembly)| {
        let mesh = &body.mesh;
        if body.thickness.is_some() || mesh.element_dimension() != mesh.dimension {
            return None;
        }
        let Lame { lambda, mu } = spec.elastic.as_ref()?.lame()?;
        let young = mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu);
        let density = body.mass.iter().sum::<f64>() / mesh.lumped_measure().iter().sum::<f64>();
        let (lower, upper) = mesh.bounding_box();
        let extents = || lower.iter().zip(&upper).map(|(low, high)| high - low);
        let (thickness, length) = (extents().fold(f64::INFINITY, f64::min), extents().fold(0.0, f64::max));
        let frequency = 1.015 * (young / density).sqrt() * thickness / (length * length);
        frequency.is_finite().then_some((frequency, &body.name[..]))
    };
    scene.body.iter().zip(bodies).filter_map(of_body).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Warns of a formula that oscillates about as fast as a body's natural frequency in statics, which omits
/// inertia.
fn swings(
    path: &KeyPath,
    formula: &OverTime,
    places: &[[f64; 3]; 2],
    scene: &Scene,
    (slowest, body): (f64, &str),
) -> Option<String> {
    let duration = scene.time.duration;
    let turns = places.iter().map(|place| turns(formula, *place, duration)).max().unwrap_or(0);
    let frequency = PI * turns as f64 / duration;
    (turns >= SWINGS && frequency > SLOW * slowest).then(|| {
        format!(
            "`{path}` oscillates at about {} rad/s, and the lowest natural frequency of `{body}` is about \
             {} rad/s: quasi-static runs neglect inertia, which matters here; use a dynamic integrator",
            Rounded::<2>(frequency),
            Rounded::<2>(slowest)
        )
    })
}

/// Number of turning points of a formula.
fn turns(formula: &OverTime, place: [f64; 3], duration: f64) -> usize {
    let samples = MOST_INTERVALS as u32;
    let at = |i: u32| formula.value(place, duration * f64::from(i) / f64::from(samples));
    let values: Vec<f64> = (0..=samples).map(at).collect();
    let largest = values.iter().fold(0.0, |m: f64, value| m.max(value.abs()));
    let differences = values.windows(2).map(|pair| pair[1] - pair[0]);
    let moves: Vec<f64> = differences.filter(|d| d.abs() > 1e-9 * largest).collect();
    moves.windows(2).filter(|pair| (pair[0] > 0.0) != (pair[1] > 0.0)).count()
}
