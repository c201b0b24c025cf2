//! Warnings of features that behave differently than users may expect.

use super::body::BodyAssembly;
use super::meeting::{first_meeting, passes_through};
use crate::{Body, Load, OverTime, Scene};
use pliant::energy::SurfaceContact;
use pliant::quantity::{Rounded, counted};
use pliant::simulation::Simulation;
use pliant_mesh::FoldedNodes;

/// Depth behind a wall from which on a vertex counts as behind it, as a fraction of the size of the
/// scene.
pub(super) const BEHIND: f64 = 1e-9;

/// Largest contact force on a body at the start, as a multiple of its weight: in equilibrium it is the
/// weight, plus the weight of what lies on it.
const PUSHED: f64 = 2.0;

/// Friction coefficient above that of any real surface.
const ROUGHEST: f64 = 10.0;

/// One warning for each such feature, with a remedy.
pub(super) fn warnings(scene: &Scene, simulation: &Simulation, bodies: &[BodyAssembly]) -> Vec<String> {
    let walls = walls(scene).into_iter().chain(behind_walls(simulation));
    let meeting =
        through_each_other(scene, bodies).into_iter().chain(pushed_apart(scene, simulation, bodies));
    let folded = bodies.iter().filter_map(folded);
    let walls = walls.chain(super::driven::warning(scene, simulation, bodies));
    walls.chain(meeting).chain(rougher_than_rubber(scene)).chain(idle(scene)).chain(folded).collect()
}

/// Warns of cells with an angle above 180 degrees, which give inaccurate results.
fn folded(body: &BodyAssembly) -> Option<String> {
    let (FoldedNodes { count, worst, least }, block) = (body.mesh.folded_nodes()?, body.mesh.block()?);
    let are = if count == 1 { "is" } else { "are" };
    Some(format!(
        "`{}`: {count} of {} {} {are} folded at a corner, the most element {worst}, where det J is \
         {least:.3} of its mean: results are inaccurate there; move vertices until all angles are below 180 \
         degrees",
        body.name,
        block.cells().len(),
        block.kind.plural,
    ))
}

/// Warns of loads and muscles of zero: useful if a controller sets them at run time, otherwise without
/// effect.
fn idle(scene: &Scene) -> Vec<String> {
    let named = scene.body.iter().enumerate().map(|(i, body)| (body.name_or_default(i), body));
    let of_body = |(name, body): (String, &Body)| {
        let is_zero = |load: &&Load| {
            let mut vectors = load.vectors().into_iter();
            vectors.all(|(.., vector)| vector.iter().all(OverTime::is_zero))
                && load.pressure.as_ref().is_none_or(OverTime::is_zero)
        };
        let loads =
            body.load.iter().filter(is_zero).map(|load| format!("a load of `{name}`, its `{}`,", load.key()));
        let loads: Vec<String> = loads.collect();
        let muscles = body.muscle.iter().filter(|muscle| muscle.tension.is_zero());
        loads
            .into_iter()
            .chain(muscles.map(|_| format!("the tension of a muscle of `{name}`")))
            .collect::<Vec<_>>()
    };
    let said = |what: String| format!("{what} is zero: it has no effect until it is changed");
    named.flat_map(of_body).map(said).collect()
}

/// Warns of implausible friction coefficients: percentages or angles.
fn rougher_than_rubber(scene: &Scene) -> Option<String> {
    let contact = scene.contact.as_ref()?;
    let of_pairs = contact.pairs.iter().filter_map(|pair| pair.friction);
    let most = of_pairs.fold(contact.friction, f64::max);
    (most > ROUGHEST).then(|| {
        format!(
            "a coefficient of friction of {} exceeds that of all known surfaces (rubber on rubber: 1 to 2): \
             nothing will slide",
            Rounded::<4>(most)
        )
    })
}

/// Warns of a body that starts closer to another than contact lets it rest. The barrier's energy throws
/// it; the balance includes this energy, but it is unintended. Statics finds equilibrium from any start.
fn pushed_apart(scene: &Scene, simulation: &Simulation, bodies: &[BodyAssembly]) -> Option<String> {
    if scene.contact.is_none() || simulation.method().is_static() {
        return None;
    }
    let contacts = simulation.contacts();
    let (system, numbering) = (simulation.system(), simulation.numbering());
    let gravity = super::gravity::strength_at_start(scene);
    let weight_of_all = gravity * bodies.iter().flat_map(|body| &body.mass).sum::<f64>();
    let of_body = |i: usize| {
        let (body, spec) = (&bodies[i], &scene.body[i]);
        let mut vertices = body.vertices();
        let moves = |v: u32| !system.is_pinned(numbering.internal(v) as usize);
        if spec.obstacle.is_some() || !vertices.any(moves) {
            return None;
        }
        let (mut force, mut total) = ([0.0; 3], 0.0);
        let mut least: Option<&SurfaceContact> = None;
        for contact in contacts.iter().filter(|contact| contact.bodies[0] != contact.bodies[1]) {
            let Some(side) = contact.bodies.iter().position(|name| *name == body.name) else { continue };
            let sign = if side == 0 { 1.0 } else { -1.0 };
            (0..3).for_each(|k| force[k] += sign * contact.force * contact.normal[k]);
            total += contact.force;
            least = least.filter(|least| least.relative_gap <= contact.relative_gap).or(Some(contact));
        }
        let contact = least?;
        let force = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        let weight = body.mass.iter().sum::<f64>() * gravity;
        if force > PUSHED * weight {
            return Some((force, weight, body, contact));
        }
        // Forces from several sides cancel and squeeze the body; a resting body carries at most the total
        // weight.
        (total > PUSHED * weight_of_all).then_some((total, weight, body, contact))
    };
    let pushed = (0..bodies.len()).filter_map(of_body);
    let (force, weight, body, contact) = pushed.max_by(|a, b| (a.0 * b.1).total_cmp(&(b.0 * a.1)))?;
    let other = &contact.bodies[usize::from(contact.bodies[0] == body.name)];
    let beside = match weight > 0.0 {
        true => format!("{} times its weight of {} N", Rounded::<3>(force / weight), Rounded::<3>(weight)),
        false => "and nothing holds it there".to_owned(),
    };
    if contact.gap < 0.0 {
        // A wall, which bodies may touch at the start.
        return Some(format!(
            "`{}` starts {} m behind `{other}`: the wall pushes it out with {} N, {beside}; start it on the \
             wall",
            body.name,
            Rounded::<3>(-contact.gap),
            Rounded::<4>(force)
        ));
    }
    Some(format!(
        "`{}` starts {} m from `{other}`, {} % of the activation distance: contact pushes it with {} N, \
         {beside}; start it farther away, or use a smaller [contact] `distance`",
        body.name,
        Rounded::<3>(contact.gap),
        Rounded::<3>(100.0 * contact.relative_gap),
        Rounded::<4>(force)
    ))
}

/// Warns of bodies whose boxes overlap at the start: without contact or an attachment they pass through
/// each other.
fn through_each_other(scene: &Scene, bodies: &[BodyAssembly]) -> Option<String> {
    if !passes_through(scene) {
        return None;
    }
    let solid: Vec<&BodyAssembly> =
        bodies.iter().filter(|body| !(body.is_particles() || body.is_obstacle)).collect();
    let [a, b] = first_meeting(solid.iter().map(|body| &body.position[..]), scene.dimension)?;
    Some(format!(
        "the bounding boxes of `{}` and `{}` meet, and nothing makes bodies collide: add `contact = {{}}` to \
         the scene",
        solid[a].name, solid[b].name
    ))
}

/// Warns of a vertex that starts behind a wall. The first step moves it back without a motion, which adds
/// energy from no source.
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
        "{} behind a wall, vertex {} by {depth} m behind wall {wall}: the first step moves them back, and \
         the energy balance does not include this work; move the bodies or the wall",
        counted(behind.len() as u64, "vertex starts", "vertices start"),
        simulation.numbering().original(vertex as u32),
        depth = Rounded::<4>(depth)
    ))
}

/// Warns of walls without contact. They act at the end of a step, and an implicit step computes its end
/// without them.
fn walls(scene: &Scene) -> Option<String> {
    let method = scene.time.integrator.method().documentation;
    let are_put_back = scene.acting_contact().is_none() && method.solves > 0;
    (are_put_back && !scene.world.walls.is_empty()).then(|| {
        format!(
            "`{}` solves a step as if there were no walls, and vertices are moved back afterwards: resting \
             bodies sink into a wall, more so at larger steps; `implicit-euler`, `bdf2`, `tr-bdf2` and \
             `sdirk2` hold walls in the solve",
            method.name
        )
    })
}
