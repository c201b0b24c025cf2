//! Warnings of features that work otherwise than one would think.

use super::body::BodyAssembly;
use crate::Scene;
use pliant::quantity::Rounded;
use pliant::simulation::Simulation;

/// Vertices are behind a wall where they are farther behind it than this part of the size of the scene.
const BEHIND: f64 = 1e-9;

/// One sentence for each such thing, with what would do better.
pub(super) fn warnings(scene: &Scene, simulation: &Simulation, bodies: &[BodyAssembly]) -> Vec<String> {
    let walls = walls(scene).into_iter().chain(behind_walls(simulation));
    walls.chain(through_each_other(scene, bodies)).collect()
}

/// Bodies whose boxes meet at the start pass through each other, unless contact or an attachment says what
/// they do.
fn through_each_other(scene: &Scene, bodies: &[BodyAssembly]) -> Option<String> {
    if scene.contact.is_some() || !scene.attachment.is_empty() {
        return None;
    }
    let solid: Vec<(&str, Vec<[f64; 2]>)> = bodies
        .iter()
        .filter(|body| !body.is_particles())
        .map(|body| (body.name.as_str(), bounds(&body.position, body.mesh.dimension)))
        .collect();
    let meet = |a: &[[f64; 2]], b: &[[f64; 2]]| a.iter().zip(b).all(|(a, b)| a[0] <= b[1] && b[0] <= a[1]);
    for (i, (name, own)) in solid.iter().enumerate() {
        if let Some((other, _)) = solid[..i].iter().find(|(_, others)| meet(own, others)) {
            return Some(format!(
                "the boxes around `{other}` and `{name}` meet, and nothing makes bodies collide: `contact = {{}}` in the \
                 scene does"
            ));
        }
    }
    None
}

/// Least and largest coordinate along each axis.
fn bounds(x: &[f64], dimension: usize) -> Vec<[f64; 2]> {
    let along = |axis: usize| x.iter().skip(axis).step_by(dimension).copied();
    let of =
        |axis| [along(axis).fold(f64::INFINITY, f64::min), along(axis).fold(f64::NEG_INFINITY, f64::max)];
    (0..dimension).map(of).collect()
}

/// A vertex that starts behind a wall is put back in the first step, which is no motion, and stores energy
/// that comes from nowhere.
fn behind_walls(simulation: &Simulation) -> Option<String> {
    let (system, x) = (simulation.system(), simulation.state().x());
    let (d, least) = (system.dimension(), BEHIND * simulation.length_scale());
    let depths = system.walls().iter().enumerate().flat_map(|(i, wall)| {
        let free = (0..system.mass().len()).filter(|v| !system.is_pinned(*v));
        free.map(move |v| (i, v, wall.depth(&x[v * d..][..d]))).filter(|(.., depth)| *depth > least)
    });
    let mut behind: Vec<(usize, usize, f64)> = depths.collect();
    behind.sort_by(|a, b| b.2.total_cmp(&a.2));
    let &(wall, vertex, depth) = behind.first()?;
    Some(format!(
        "{} behind a wall, vertex {} by {depth} m behind wall {wall}: the first step puts them back there, \
         and the energy that this takes is not in the balance; move the bodies or the wall",
        match behind.len() {
            1 => "1 vertex starts".to_owned(),
            count => format!("{count} vertices start"),
        },
        simulation.numbering().original(vertex as u32),
        depth = Rounded::<4>(depth)
    ))
}

/// Walls act on the end of a step. A step that is solved has found its end without them.
fn walls(scene: &Scene) -> Option<String> {
    let method = scene.time.integrator.method().documentation;
    if scene.world.walls.is_empty() || method.solves == 0 {
        return None;
    }
    let name = method.name;
    Some(if method.order == 0 {
        format!(
            "`{name}` looks for equilibrium as if there were no walls, and vertices are put back afterwards: what it \
             finds is no equilibrium of bodies that touch one; an explicit scheme with damping, `velocity-verlet`, \
             comes to rest there; or say `contact = {{}}`, and walls are part of the solve"
        )
    } else {
        format!(
            "`{name}` solves a step as if there were no walls, and vertices are put back afterwards: what rests on a \
             wall is too soft there, and sinks in, the more the larger the step; an explicit scheme, \
             `velocity-verlet`, does better; or say `contact = {{}}`, and walls are part of the solve"
        )
    })
}
