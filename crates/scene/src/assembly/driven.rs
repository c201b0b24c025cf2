//! Warning of prescribed motion through walls.

use super::body::BodyAssembly;
use super::pins::PinPlan;
use super::warnings::BEHIND;
use crate::{Body, ObstacleShape, ObstacleSpec, Pin, Scene};
use pliant::constraint::Wall;
use pliant::quantity::Rounded;
use pliant::simulation::Simulation;

/// Number of intervals at whose ends the motion is sampled.
const MOMENTS: u32 = 200;

/// A moving pin, a wall, and the pin's largest depth behind it [m] with its time [s].
struct DrivenPin<'a> {
    body: &'a BodyAssembly,
    pin: &'a PinPlan,
    wall: &'a (String, Wall),
    deepest: (f64, f64),
}

/// Warns of the pin whose motion leads farthest behind a wall that it starts in front of: nothing stops
/// prescribed motion.
pub(super) fn warning(scene: &Scene, simulation: &Simulation, bodies: &[BodyAssembly]) -> Option<String> {
    let (system, numbering) = (simulation.system(), simulation.numbering());
    if !system.has_prescribed_motion() || scene.time.arc_length.is_some() {
        return None;
    }
    let (d, least, walls) =
        (system.dimension(), BEHIND * simulation.length_scale(), walls(scene, simulation, bodies));
    // Pairs of a moving pin and a wall.
    let collides = |spec: &Body| spec.contact.as_ref().and_then(|contact| contact.collides).unwrap_or(true);
    let all = scene.body.iter().zip(bodies).filter(|(spec, _)| spec.obstacle.is_none() && collides(spec));
    let moving = all.flat_map(|(_, body)| {
        let moving = body.held.iter().filter(|pin| pin.spec.motion.is_some());
        moving.map(move |pin| (body, pin))
    });
    let mut driven: Vec<DrivenPin<'_>> = moving
        .flat_map(|(body, pin)| {
            walls.iter().map(move |wall| DrivenPin { body, pin, wall, deepest: (f64::MIN, 0.0) })
        })
        .collect();
    if driven.is_empty() {
        return None;
    }
    // Largest depth of each pair over the run.
    let (mut x, mut v) = (simulation.state().x().to_vec(), vec![0.0; simulation.state().x().len()]);
    for moment in 0..=MOMENTS {
        let t = scene.time.duration * f64::from(moment) / f64::from(MOMENTS);
        system.prescribe(t, &mut x, &mut v);
        let row =
            |body: &BodyAssembly, vertex: &u32| numbering.internal(body.first_vertex + vertex) as usize * d;
        for DrivenPin { body, pin, wall: (_, wall), deepest } in &mut driven {
            if pin.spec.until.is_none_or(|until| t <= until) {
                let depths = pin.vertices.iter().map(|vertex| wall.depth(&x[row(body, vertex)..][..d]));
                let depth = depths.fold(f64::MIN, f64::max);
                *deepest = if depth > deepest.0 { (depth, t) } else { *deepest };
            }
        }
        // A pin behind the wall at the start is intended.
        if moment == 0 {
            driven.retain(|driven| driven.deepest.0 <= least);
        }
    }
    let worst = driven.into_iter().max_by(|a, b| a.deepest.0.total_cmp(&b.deepest.0))?;
    let DrivenPin { body, pin, wall: (name, _), deepest: (depth, t) } = worst;
    (depth > least).then(|| {
        format!(
            "the motion of pin `{}` goes {} m behind `{name}`, at t = {} s: walls do not stop prescribed \
             motion",
            Pin::hold_name(&body.name, &pin.name),
            Rounded::<3>(depth),
            Rounded::<3>(t)
        )
    })
}

/// Walls and half-spaces that do not move, with their names.
fn walls(scene: &Scene, simulation: &Simulation, bodies: &[BodyAssembly]) -> Vec<(String, Wall)> {
    let walls = simulation.system().walls().iter().enumerate();
    let walls = walls.map(|(i, wall)| (ObstacleSpec::name_of_wall(i), wall.clone()));
    let still = |spec: &Body| spec.pin.iter().all(|pin| pin.motion.is_none());
    let obstacles = scene.body.iter().zip(bodies).filter_map(|(spec, body)| match &spec.obstacle {
        Some(ObstacleShape::HalfSpace(half_space)) if still(spec) => {
            Some((body.name.clone(), Wall::new(&half_space.normal, half_space.offset)))
        }
        _ => None,
    });
    walls.chain(obstacles).collect()
}
