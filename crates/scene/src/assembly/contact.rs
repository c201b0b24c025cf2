//! Assembly of contact: from `[contact]` and obstacles to contact terms.

mod impacts;
mod summary;

use std::cmp::Ordering;
use std::sync::Arc;

use super::body::BodyAssembly;
use crate::schema::{Body, ContactSpec, ObstacleShape, Scene};
use crate::{KeyPath, Problem};
use pliant::algebra::scene_size;
use pliant::constraint::Wall;
use pliant::numbering::Numbering;
use pliant::quantity::Rounded;
use pliant::system::System;
use pliant_contact::barrier::{Barrier, PotentialForm};
use pliant_contact::candidates::BodyPairs;
use pliant_contact::explicit::SurfaceMobility;
use pliant_contact::model::{ContactLaw, ContactLaws, ContactModel, Duplicates, SolidBall, SolidHalfSpace};
use pliant_contact::start::LeastDistance;
use pliant_contact::surface::{ContactSurface, SurfacePrimitives};
use pliant_contact::terms::{self, ContactTerms, ExplicitOptions, StartFaults};

use impacts::ImpactDurations;
pub use impacts::advice_on_gain;
pub use summary::ContactSummary;
use summary::{
    ContactStart, DistanceOrigin, ExplicitContactSummary, PairLaw, SelfContact, StartGap, StiffnessOrigin,
    StoppedApproach,
};

/// Reach of contact, as a part of the size of the smallest body.
pub const CONTACT_PART_OF_BODY: f64 = 1e-3;
/// And at most this part of the shortest edge.
pub const CONTACT_PART_OF_EDGE: f64 = 0.25;
/// Part of a number by which others may differ from it and still count as alike.
const ALIKE: f64 = 1e-9;
/// Threshold of friction: this part of the size of the scene in a second.
const THRESHOLD: f64 = 1e-3;
/// Number of times that normal forces of friction are renewed, unless the scene says.
const FRICTION_ITERATIONS: u32 = 20;
/// Contact of a body with itself begins at this part of the least distance at rest.
const PART_OF_REST: f64 = 0.5;
/// Part of the largest stable step of contact alone that explicit steps are, where nothing says how stiff it
/// is: `f` in `kappa = f^2 dhat / (h^2 R)`.
const PART_OF_CRITICAL: f64 = 0.3;
/// Part of the reach of walls without `[contact]` that lies before their planes: what starts on one is held
/// from the first iteration on, by a hundredth of the stiffness of a body of a thousand reaches.
const PART_BEFORE_WALL: f64 = 1e-6;
/// Bad starts that are told one by one.
const MOST_TOLD: usize = 3;

/// What explicit steps ask of contact.
struct ExplicitDesign {
    /// [s]; `None` where it follows the error.
    step: Option<f64>,
    mobility: SurfaceMobility,
}

impl ExplicitDesign {
    /// `None` where steps are solved.
    fn new(
        scene: &Scene,
        contact: &ContactSpec,
        parties: &[ContactParty<'_>],
        surface: &ContactSurface,
        mass: &[f64],
    ) -> Result<Option<Self>, Vec<Problem>> {
        if !contact.has_explicit_law(scene.time.integrator) {
            return Ok(None);
        }
        let step = contact.designed_step.or(scene.time.step);
        let soft = |party: &ContactParty<'_>| party.young.is_none() && !party.is_obstacle() && party.collides;
        if let (None, None, Some(party)) = (step, contact.stiffness, parties.iter().find(|p| soft(p))) {
            let message = format!(
                "cannot choose how stiff contact of `{}` is: it has no Young's modulus, and the step size \
                 is adaptive",
                party.body.name
            );
            let problem = Problem::semantic(KeyPath::root().key("contact"), message);
            return Err(vec![problem.with_help("give `stiffness`, a pressure, or a fixed `step` in [time]")]);
        }
        let inverse_mass = |v: u32| if mass[v as usize] > 0.0 { 1.0 / mass[v as usize] } else { 0.0 };
        let mobility = SurfaceMobility::new(surface, parties.len(), inverse_mass);
        Ok(Some(ExplicitDesign { step, mobility }))
    }

    /// `kappa = f^2 dhat / (h^2 R)` [Pa] of two bodies; `None` where no step is known, or neither moves.
    fn stiffness(&self, reach: f64, a: u32, b: u32) -> Option<f64> {
        let mobility = self.mobility.of_pair(a, b);
        let h = self.step.filter(|_| mobility > 0.0)?;
        Some(PART_OF_CRITICAL * PART_OF_CRITICAL * reach / (h * h * mobility))
    }

    fn summary<const D: usize>(
        &self,
        scene: &Scene,
        contact: &ContactSpec,
        model: &ContactModel,
        velocity: &[f64],
    ) -> ExplicitContactSummary {
        let count = model.names.len() as u32;
        let row = |v: u32| &velocity[v as usize * D..][..D];
        // Balls and half-spaces are no surfaces: the one vertex that carries each moves as all of it.
        let vertices = |body: u32| {
            let exact = model.balls.iter().map(|ball| (ball.body, ball.vertex));
            let exact = exact.chain(model.half_spaces.iter().map(|plane| (plane.body, plane.vertex)));
            let exact = exact.filter(move |(of, _)| *of == body).map(|(_, vertex)| vertex);
            let of_body = move |v: &u32| model.body(*v) == body;
            model.surface.vertices.iter().copied().filter(of_body).chain(exact)
        };
        let mean = |body: u32| {
            let mut sum = [0.0; D];
            vertices(body).for_each(|v| (0..D).for_each(|k| sum[k] += row(v)[k]));
            let vertices = vertices(body).count().max(1) as f64;
            sum.map(|s| s / vertices)
        };
        let speed =
            |v: &[f64], u: &[f64; D]| v.iter().zip(u).map(|(v, u)| (v - u) * (v - u)).sum::<f64>().sqrt();
        let fastest = |body: u32, u: &[f64; D]| vertices(body).map(|v| speed(row(v), u)).fold(0.0, f64::max);
        let mut pairs = vec![];
        for a in 0..count {
            for b in (a..count).filter(|b| model.touch(a, *b)) {
                let stopped = model.laws.of(a, b).barrier.stopped_speed(self.mobility.mass_to_stop(a, b));
                let u = mean(b);
                let bodies = [a, b].map(|body| model.names[body as usize].clone());
                pairs.push(StoppedApproach { bodies, stopped, at_start: fastest(a, &u) + fastest(b, &u) });
            }
        }
        let most = contact.pairs.iter().filter_map(|pair| pair.friction).fold(contact.friction, f64::max);
        let gravity = super::gravity::strength_at_start(scene);
        ExplicitContactSummary {
            step: self.step,
            pairs,
            raises_threshold: model.laws.has_friction()
                && contact.threshold_speed.is_none()
                && self.step.is_some(),
            borne_threshold: 2.0 * most * gravity * self.step.unwrap_or(0.0),
        }
    }
}

/// Adds contact to `system`; `surveys` where it is looked at how near bodies are at the start.
///
/// # Errors
/// Bodies that overlap or cross at the start, strands and particles without a thickness that would meet,
/// explicit steps that follow the error where nothing says how stiff contact is.
pub(super) fn add<const D: usize>(
    scene: &Scene,
    bodies: &[BodyAssembly],
    numbering: &Numbering,
    (rest, position, velocity): (&[f64], &[f64], &[f64]),
    system: &mut System,
    surveys: bool,
) -> Result<Option<ContactSummary>, Vec<Problem>> {
    let Some(contact) = &scene.contact else { return Ok(None) };
    let parties: Vec<ContactParty> =
        bodies.iter().zip(&scene.body).map(|(body, spec)| ContactParty::new::<D>(body, spec)).collect();
    if !contact.of_walls {
        without_thickness(contact, &parties)?;
    }
    let mut surface = surface::<D>(&parties, numbering, rest, system.mass().len());
    let (distance, distance_origin) = match contact.distance {
        Some(distance) => (distance, DistanceOrigin::Given),
        None => reach::<D>(&parties, &surface),
    };
    surface.thicken(parties.iter().map(|party| party.radius + party.obstacle_radius()).collect(), distance);
    let design = ExplicitDesign::new(scene, contact, &parties, &surface, system.mass())?;
    let (parties, explicit) = (&parties[..], design.as_ref());
    let choice = StiffnessChoice { scene, contact, parties, numbering, explicit, distance };
    let (mut model, mut origins) = model::<D>(&choice, surface);
    coincident::<D>(&model, position)?;
    let least = terms::least_distances(D, &model, rest);
    let with_itself = shrink(&mut model, parties, &least);
    if let (Some(design), None) = (&design, contact.stiffness) {
        for i in 0..parties.len() as u32 {
            let barrier = &mut model.laws.of_mut(i, i).barrier;
            let most = design.stiffness(barrier.reach, i, i).unwrap_or(f64::INFINITY);
            if most < barrier.stiffness {
                barrier.stiffness = most;
                origins[i as usize * parties.len() + i as usize] = StiffnessOrigin::ExplicitStep;
            }
        }
    }
    overlaps(scene, &model, parties, position)?;
    let mut report = report(&choice, (&model, origins), distance_origin, with_itself);
    if design.is_none() && !scene.time.integrator.method().is_static() {
        report.impacts = ImpactDurations::new(&model, parties, system, scene.time.step);
    }
    report.start = surveys.then(|| {
        let survey = terms::survey(D, &model, position);
        let least = survey.least.map(|(gap, primitives)| StartGap {
            gap,
            between: primitives.each_ref().map(|primitive| model.named(primitive)),
        });
        ContactStart { candidates: survey.candidates, least }
    });
    let model = Arc::new(model);
    let step = design.as_ref().and_then(|design| design.step).filter(|_| contact.threshold_speed.is_none());
    let options = ExplicitOptions {
        allows_crossing: contact.allow_penetration,
        borne: step.map(|step| (step, system.mass())),
    };
    let ContactTerms { energy, friction } = terms::contact_terms(D, model.clone(), options);
    report.explicit = design.map(|design| {
        // Moved vertices start as their motion says, those of obstacles among them.
        let (mut x, mut v) = (position.to_vec(), velocity.to_vec());
        system.prescribe(0.0, &mut x, &mut v);
        design.summary::<D>(scene, contact, &model, &v)
    });
    if let Some(friction) = friction {
        system.add_dissipation(friction);
    }
    system.add_term(energy);
    Ok(Some(report))
}

/// A body or an obstacle as contact sees it.
struct ContactParty<'a> {
    body: &'a BodyAssembly,
    spec: &'a Body,
    /// Triangles of its surface, in the plane edges of its outline, edges of strands, particles; vertices
    /// from 0.
    faces: Vec<Vec<u32>>,
    /// Half its thickness [m].
    radius: f64,
    /// Young's modulus of it, or of the continuum that it is like [Pa]; `None` for obstacles.
    young: Option<f64>,
    collides: bool,
    with_itself: bool,
}

impl<'a> ContactParty<'a> {
    fn new<const D: usize>(body: &'a BodyAssembly, spec: &'a Body) -> Self {
        let said = spec.contact.clone().unwrap_or_default();
        let faces = match &spec.obstacle {
            Some(ObstacleShape::HalfSpace(_) | ObstacleShape::Ball(_)) => vec![],
            // Its axis comes last.
            Some(ObstacleShape::Capsule(_)) => {
                let end = body.mass.len() as u32;
                vec![vec![end - 2, end - 1]]
            }
            _ => faces::<D>(body),
        };
        let radius = said.radius.unwrap_or(0.5 * body.thickness.unwrap_or(0.0));
        let collides = said.collides.unwrap_or(true);
        ContactParty {
            body,
            spec,
            faces,
            radius,
            young: young(body, spec, radius),
            collides,
            with_itself: collides && spec.obstacle.is_none() && said.with_itself.unwrap_or(true),
        }
    }

    fn is_obstacle(&self) -> bool {
        self.spec.obstacle.is_some()
    }

    /// `xi` of an obstacle that is round.
    fn obstacle_radius(&self) -> f64 {
        match &self.spec.obstacle {
            Some(ObstacleShape::Ball(ball)) => ball.radius,
            Some(ObstacleShape::Capsule(capsule)) => capsule.radius,
            _ => 0.0,
        }
    }

    /// True if it is made of strands or particles.
    fn is_thin(&self) -> bool {
        !self.is_obstacle() && self.body.mesh.element_dimension() < 2
    }

    /// Mass for its area of each vertex [kg/m^2], by its number in the simulation, where it has a thickness
    /// or the reach `distance` [m] gives it one.
    fn densities<'s>(
        &'s self,
        surface: &'s ContactSurface,
        numbering: &'s Numbering,
    ) -> impl Iterator<Item = f64> + 's {
        let of = |(v, mass): (u32, &f64)| {
            let area = surface.vertex_areas[numbering.internal(self.body.first_vertex + v) as usize];
            if area > 0.0 { mass / area } else { 0.0 }
        };
        (0..).zip(&self.body.mass).map(of)
    }
}

/// Primitives of a body that touch.
fn faces<const D: usize>(body: &BodyAssembly) -> Vec<Vec<u32>> {
    match body.mesh.element_dimension() {
        0 => (0..body.mesh.vertex_count() as u32).map(|v| vec![v]).collect(),
        1 => body.mesh.edges.iter().map(|edge| edge.to_vec()).collect(),
        _ if D == 3 => body.mesh.flat_faces(),
        _ => outline(&body.mesh.drawn_triangles()).iter().map(|edge| edge.to_vec()).collect(),
    }
}

/// Edges with one triangle beside them.
fn outline(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    sides.sort_unstable();
    sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

/// Young's modulus of a material; of springs that of the continuum that they are like: of a sheet `sum k l^2
/// / (3 A t)` with a thickness `t` of two radii, or of a hundredth of their length, of a strand the mean of
/// `k l / (pi t^2 / 4)`.
fn young(body: &BodyAssembly, spec: &Body, radius: f64) -> Option<f64> {
    if let Some(material) = &spec.elastic {
        return Some(material.lame()?.young_and_poisson().0);
    }
    if body.springs.is_empty() {
        return None;
    }
    let count = body.rest_length.len() as f64;
    let mean = body.rest_length.iter().sum::<f64>() / count;
    let thickness = if radius > 0.0 { 2.0 * radius } else { 1e-2 * mean };
    let springs = body.stiffness.iter().zip(&body.rest_length);
    if body.mesh.element_dimension() < 2 {
        let section = 0.25 * std::f64::consts::PI * thickness * thickness;
        return Some(springs.map(|(k, l)| k * l).sum::<f64>() / (count * section));
    }
    let squares = springs.map(|(k, l)| k * l * l);
    let area: f64 = body.mesh.lumped_measure().iter().sum();
    Some(squares.sum::<f64>() / (3.0 * area * thickness))
}

/// Strands and particles that could meet each other, or themselves, as lines and points without a thickness:
/// the gap between them would be all that there is of them.
fn without_thickness(contact: &ContactSpec, parties: &[ContactParty<'_>]) -> Result<(), Vec<Problem>> {
    let thin = |i: &usize| {
        let party = &parties[*i];
        party.is_thin() && party.collides && party.radius == 0.0
    };
    let parts: Vec<usize> = (0..parties.len()).filter(thin).collect();
    let apart = |a: usize, b: usize| {
        contact.pairs.iter().any(|pair| {
            let names = [&parties[a].body.name, &parties[b].body.name];
            let is_pair = pair.between.iter().eq(names) || pair.between.iter().rev().eq(names);
            is_pair && pair.contact == Some(false)
        })
    };
    let problem = |&i: &usize| {
        let party = &parties[i];
        let with_itself = party.with_itself && party.faces.len() > 1 && !apart(i, i);
        let other = parts.iter().find(|&&j| j != i && !apart(i, j));
        let whom = match other {
            _ if with_itself => "each other",
            Some(j) => &format!("those of `{}`", parties[*j].body.name),
            None => return None,
        };
        let what = if party.body.mesh.element_dimension() == 0 { "particles" } else { "strands" };
        let message = format!(
            "the {what} of `{}` have no thickness, with which they could touch {whom}",
            party.body.name
        );
        let problem = Problem::semantic(KeyPath::root().key("body").index(i), message);
        Some(problem.with_help(
            "give it: `contact = { radius = \"1 mm\" }` in this body; or let them pass, by `contact = { \
             self = false }` and by [contact] `pairs = [{ between = [...], contact = false }]`",
        ))
    };
    let problems: Vec<Problem> = parts.iter().filter_map(problem).collect();
    if problems.is_empty() { Ok(()) } else { Err(problems) }
}

/// Surface of all that collides, in the numbers of the simulation.
fn surface<const D: usize>(
    parties: &[ContactParty<'_>],
    numbering: &Numbering,
    rest: &[f64],
    vertices: usize,
) -> ContactSurface {
    let mut bodies = vec![0; vertices];
    let (mut triangles, mut quadrilaterals, mut edges, mut particles) = (vec![], vec![], vec![], vec![]);
    for (i, party) in (0..).zip(parties) {
        let internal = |v: u32| numbering.internal(party.body.first_vertex + v);
        (0..party.body.mass.len() as u32).for_each(|v| bodies[internal(v) as usize] = i);
        for face in party.faces.iter().filter(|_| party.collides) {
            match face[..] {
                [a, b, c, d] => quadrilaterals.push([a, b, c, d].map(internal)),
                [a, b, c] => triangles.push([a, b, c].map(internal)),
                [a, b] => edges.push([a, b].map(internal)),
                [p] => particles.push(internal(p)),
                _ => {}
            }
        }
    }
    let primitives = SurfacePrimitives {
        triangles: &triangles,
        quadrilaterals: &quadrilaterals,
        edges: &edges,
        particles: &particles,
    };
    if D == 3 {
        ContactSurface::in_space(&primitives, rest, &bodies)
    } else {
        ContactSurface::in_plane(&primitives, rest, &bodies)
    }
}

/// Size at rest of all bodies without obstacles [m].
fn size_of_bodies(parties: &[ContactParty<'_>], dimension: usize) -> f64 {
    let bodies = parties.iter().filter(|party| !party.is_obstacle());
    let points: Vec<f64> = bodies.flat_map(|party| party.body.mesh.points.iter().copied()).collect();
    scene_size(&points, dimension)
}

/// The smallest body that collides and is no cloud of points, and its size [m].
fn smallest(parties: &[ContactParty<'_>], dimension: usize) -> Option<(String, f64)> {
    let bodies = parties.iter().filter(|party| party.collides && !party.is_obstacle());
    let solid = bodies.filter(|party| party.body.mesh.element_dimension() > 0);
    let sizes = solid.map(|party| (&party.body.name, scene_size(&party.body.mesh.points, dimension)));
    sizes.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(name, size)| (name.clone(), size))
}

/// Reach where the scene gives none [m], and where it comes from.
fn reach<const D: usize>(parties: &[ContactParty<'_>], surface: &ContactSurface) -> (f64, DistanceOrigin) {
    let is_body = |i: usize| !parties[i].is_obstacle();
    let name = |i: usize| parties[i].body.name.clone();
    let bodies = (0..parties.len()).filter(|i| parties[*i].collides && is_body(*i));
    let sizes = bodies.map(|i| (scene_size(&parties[i].body.mesh.points, D), i));
    let body_of = |edge: &[u32; 2]| surface.bodies[edge[0] as usize] as usize;
    let edges = surface.edges.iter().zip(&surface.squared_lengths);
    let lengths = edges.map(|(edge, square)| (square.sqrt(), body_of(edge))).filter(|(_, i)| is_body(*i));
    let (smallest, of_body) = least_of(sizes);
    let (shortest, of_edge) = least_of(lengths);
    if CONTACT_PART_OF_BODY * smallest <= CONTACT_PART_OF_EDGE * shortest {
        let origin = of_body.map_or(DistanceOrigin::Given, |i| DistanceOrigin::SmallestBody(name(i)));
        (CONTACT_PART_OF_BODY * smallest, origin)
    } else {
        let origin = of_edge.map_or(DistanceOrigin::Given, |i| DistanceOrigin::ShortestEdge(name(i)));
        (CONTACT_PART_OF_EDGE * shortest, origin)
    }
}

/// Least of these numbers, and the first that has it but for rounding.
fn least_of(numbers: impl Iterator<Item = (f64, usize)> + Clone) -> (f64, Option<usize>) {
    let least = numbers.clone().map(|(number, _)| number).fold(f64::INFINITY, f64::min);
    let mut alike = numbers.filter(|(number, _)| number - least <= ALIKE * least.abs());
    (least, alike.next().map(|(_, of)| of))
}

/// Choice of the stiffness of contact.
struct StiffnessChoice<'a> {
    scene: &'a Scene,
    contact: &'a ContactSpec,
    parties: &'a [ContactParty<'a>],
    numbering: &'a Numbering,
    explicit: Option<&'a ExplicitDesign>,
    /// `dhat` [m].
    distance: f64,
}

impl StiffnessChoice<'_> {
    /// Stiffness of two bodies [Pa], and where it comes from.
    fn of(&self, surface: &ContactSurface, a: usize, b: usize) -> (f64, StiffnessOrigin) {
        if let Some(given) = self.contact.stiffness {
            return (given, StiffnessOrigin::Given);
        }
        let modulus = |i: usize| self.parties[i].young.map(|young| (young, i));
        let (softer, of) = least_of([a, b].into_iter().filter_map(modulus));
        let origin = |i: usize| StiffnessOrigin::Modulus(self.parties[i].body.name.clone());
        let softer = of.map(|i| (softer, origin(i)));
        let Some(design) = self.explicit else {
            return softer.unwrap_or_else(|| {
                let time = &self.scene.time;
                let h = self.contact.designed_step.or(time.step).unwrap_or(time.duration);
                let parties = if a == b { &[a][..] } else { &[a, b] };
                let each = parties.iter().flat_map(|i| self.parties[*i].densities(surface, self.numbering));
                (self.distance * each.fold(f64::NEG_INFINITY, f64::max) / (h * h), StiffnessOrigin::Masses)
            });
        };
        let by_step = design.stiffness(self.distance, a as u32, b as u32);
        let by_step = by_step.map(|stiffness| (stiffness, StiffnessOrigin::ExplicitStep));
        let least = softer.into_iter().chain(by_step).reduce(|a, b| if b.0 < a.0 { b } else { a });
        // Two that do not move never touch.
        least.unwrap_or((1.0, StiffnessOrigin::Nothing))
    }
}

/// The model, and where the stiffnesses of its laws come from, of the bodies `a <= b` at `a * bodies + b`.
fn model<const D: usize>(
    choice: &StiffnessChoice<'_>,
    surface: ContactSurface,
) -> (ContactModel, Vec<StiffnessOrigin>) {
    let StiffnessChoice { scene, contact, parties, numbering, explicit, distance } = *choice;
    let names: Vec<String> = parties.iter().map(|party| party.body.name.clone()).collect();
    let index = |name: &String| names.iter().position(|other| other == name);
    let mut pairs = BodyPairs::all(parties.len());
    let mut friction = vec![contact.friction; parties.len() * parties.len()];
    let is_wall = |i: usize| parties[i].is_obstacle() && i < parties.len() - scene.obstacle.len();
    for a in 0..parties.len() {
        for b in 0..parties.len() {
            let (one, other) = (&parties[a], &parties[b]);
            let meets = if contact.of_walls {
                one.is_obstacle() != other.is_obstacle()
            } else {
                !(one.is_obstacle() && other.is_obstacle())
            };
            let touch = one.collides && other.collides && meets;
            pairs.set(a as u32, b as u32, touch && (a != b || one.with_itself));
            // Walls have no friction by themselves.
            if is_wall(a) || is_wall(b) {
                friction[a * parties.len() + b] = 0.0;
            }
        }
    }
    for pair in &contact.pairs {
        let [Some(a), Some(b)] = [0, 1].map(|i| pair.between.get(i).and_then(index)) else { continue };
        if let Some(touch) = pair.contact {
            pairs.set(a as u32, b as u32, touch);
        }
        for (a, b) in [(a, b), (b, a)] {
            let friction = &mut friction[a * parties.len() + b];
            *friction = pair.friction.unwrap_or(*friction);
        }
    }
    let count = parties.len();
    let mut stiffness = vec![0.0; count * count];
    let mut origins = vec![StiffnessOrigin::Given; count * count];
    for a in 0..count {
        for b in a..count {
            let (kappa, origin) = choice.of(&surface, a, b);
            (stiffness[a * count + b], stiffness[b * count + a]) = (kappa, kappa);
            origins[a * count + b] = origin;
        }
    }
    let laws = ContactLaws::new(count, |a, b| {
        let (one, other) = (&parties[a], &parties[b]);
        let stiffness = stiffness[a * count + b];
        let form = if explicit.is_some() { PotentialForm::Cubic } else { PotentialForm::Barrier };
        let radii = one.radius + other.radius + one.obstacle_radius() + other.obstacle_radius();
        // Vertices, not skins, stop at walls, as where these put them back.
        let offset = if contact.of_walls { 0.0 } else { radii };
        let barrier = Barrier { form, stiffness, reach: distance, offset };
        ContactLaw { barrier, friction: friction[a * parties.len() + b] }
    });
    let (mut half_spaces, mut balls) = (vec![], vec![]);
    for (body, party) in (0..).zip(parties) {
        let at = |v: u32| numbering.internal(party.body.first_vertex + v);
        match &party.spec.obstacle {
            Some(ObstacleShape::HalfSpace(half_space)) => {
                let wall = Wall::new(&half_space.normal, half_space.offset);
                let mut normal = [0.0; 3];
                normal.iter_mut().zip(wall.normal()).for_each(|(n, unit)| *n = *unit);
                let depth = if contact.of_walls { (1.0 - PART_BEFORE_WALL) * distance } else { 0.0 };
                half_spaces.push(SolidHalfSpace { vertex: at(0), normal, depth, body });
            }
            // The centre comes last.
            Some(ObstacleShape::Ball(_)) => {
                balls.push(SolidBall { vertex: at(party.body.mass.len() as u32 - 1), body });
            }
            _ => {}
        }
    }
    let mut labels = vec![0; surface.bodies.len()];
    for party in parties {
        for v in 0..party.body.mass.len() as u32 {
            labels[numbering.internal(party.body.first_vertex + v) as usize] = v;
        }
    }
    let model = ContactModel {
        surface,
        half_spaces,
        balls,
        pairs,
        laws,
        duplicates: if contact.counts_duplicates { Duplicates::Sum } else { Duplicates::Max },
        threshold_speed: contact.threshold_speed.unwrap_or(THRESHOLD * size_of_bodies(parties, D)),
        friction_iterations: contact.friction_iterations.unwrap_or(FRICTION_ITERATIONS),
        shortened: vec![],
        names,
        labels,
    };
    (model, origins)
}

/// Shortens the reach and the radii of bodies that are near themselves at rest, so that nothing pushes there.
fn shrink(
    model: &mut ContactModel,
    parties: &[ContactParty<'_>],
    least: &[Option<LeastDistance>],
) -> Vec<SelfContact> {
    let mut shrunk = vec![];
    for (i, party) in parties.iter().enumerate() {
        let Some(LeastDistance { distance, primitives }) = &least[i] else { continue };
        let between = primitives.each_ref().map(|primitive| model.named(primitive));
        let barrier = &mut model.laws.of_mut(i as u32, i as u32).barrier;
        let part = PART_OF_REST * distance / (barrier.reach + barrier.offset);
        if part < 1.0 && party.with_itself {
            barrier.reach *= part;
            barrier.offset *= part;
            let (body, gap, least) = (party.body.name.clone(), barrier.reach, *distance);
            shrunk.push(SelfContact { body, gap, least, between });
            model.shortened.push(i as u32);
        }
    }
    shrunk
}

/// Particles of touching bodies that start at one place: looked for before all pairs of them are.
fn coincident<const D: usize>(model: &ContactModel, position: &[f64]) -> Result<(), Vec<Problem>> {
    let place = |v: u32| &position[v as usize * D..][..D];
    let order = |a: &u32, b: &u32| {
        let places = place(*a).iter().zip(place(*b)).map(|(a, b)| (a + 0.0).total_cmp(&(b + 0.0)));
        places.fold(Ordering::Equal, Ordering::then).then(a.cmp(b))
    };
    let mut particles = model.surface.particles.clone();
    particles.sort_unstable_by(order);
    let touch = |pair: &&[u32]| {
        place(pair[0]) == place(pair[1]) && model.touch(model.body(pair[0]), model.body(pair[1]))
    };
    let mut found = particles.windows(2).filter(touch);
    let Some(&[a, b]) = found.next() else { return Ok(()) };
    let at: Vec<String> = place(a).iter().map(|x| Rounded::<6>(*x).to_string()).collect();
    let body = model.body(a);
    let (a, b, more) = (model.named(&[a]), model.named(&[b]), found.count());
    let more = match more {
        0 => String::new(),
        more => format!("; {more} more particles share a position"),
    };
    let path = KeyPath::root().key("body").index(body as usize);
    let message = format!("{a} and {b} start at the same position, ({}) m{more}", at.join(", "));
    let help = "move them apart, or switch their contact off: `contact = { self = false }` in the body";
    Err(vec![Problem::semantic(path, message).with_help(help)])
}

/// Keys of a body that say where its surface is at the start.
const CAUSES_OF_OVERLAP: [&str; 6] = ["mesh", "transform", "repeat", "position", "order", "contact"];

/// Starts that are none.
fn overlaps(
    scene: &Scene,
    model: &ContactModel,
    parties: &[ContactParty<'_>],
    position: &[f64],
) -> Result<(), Vec<Problem>> {
    let StartFaults { pairs: found, enclosed } = terms::start_faults(scene.dimension, model, position);
    let root = KeyPath::root();
    let bodies = parties.iter().filter(|party| !party.is_obstacle()).count();
    let own = |body: u32| ((body as usize) < bodies).then(|| root.key("body").index(body as usize));
    let path = |body: u32| own(body).unwrap_or_else(|| root.key("contact"));
    // Of all that a body is, its place and its thickness.
    let causes = |pair: [u32; 2]| -> Vec<KeyPath> {
        let of = |body: u32| match own(body) {
            Some(path) => CAUSES_OF_OVERLAP.map(|key| path.key(key)).to_vec(),
            None => vec![root.key("obstacle"), root.key("world").key("walls")],
        };
        let of_contact = ["distance", "pairs"].map(|key| root.key("contact").key(key));
        pair.into_iter().flat_map(of).chain(of_contact).collect()
    };
    let help = match scene.contact.as_ref().is_some_and(|contact| contact.of_walls) {
        true => "move the body out of the wall by `transform` or `position`, or the wall by its `offset`",
        false => {
            "move them apart by `transform` or `position`, or switch their contact off: [contact] `pairs = \
             [{ between = [...], contact = false }]`"
        }
    };
    let mut problems = vec![];
    for (bad, words) in found.iter().take(MOST_TOLD) {
        let message = format!("{words} at the start");
        let [first, second] = [0, 1].map(|side| model.body(bad.primitives[side][0]));
        problems.push(Problem::semantic(path(first), message).caused_by(causes([first, second])));
    }
    for [inner, outer] in enclosed {
        let (inner_name, outer_name) = (&model.names[inner as usize], &model.names[outer as usize]);
        let message = format!("`{inner_name}` lies inside `{outer_name}`");
        problems.push(Problem::semantic(path(inner), message).caused_by(causes([inner, outer])));
    }
    if let Some(last) = problems.last_mut() {
        if found.len() > MOST_TOLD {
            last.message += &format!("; {} more pairs", found.len() - MOST_TOLD);
        }
        last.help.push(help.into());
        return Err(problems);
    }
    Ok(())
}

fn report(
    choice: &StiffnessChoice<'_>,
    (model, origins): (&ContactModel, Vec<StiffnessOrigin>),
    distance_origin: DistanceOrigin,
    with_itself: Vec<SelfContact>,
) -> ContactSummary {
    let (parties, surface) = (choice.parties, &model.surface);
    let law = |a: usize, b: usize| {
        let law = model.laws.of(a as u32, b as u32);
        PairLaw {
            bodies: [a, b].map(|body| model.names[body].clone()),
            stiffness: law.barrier.stiffness,
            origin: origins[a * parties.len() + b].clone(),
            friction: law.friction,
        }
    };
    let all = (0..parties.len()).flat_map(|a| (a..parties.len()).map(move |b| (a, b)));
    let touching = all.filter(|(a, b)| model.touch(*a as u32, *b as u32));
    ContactSummary {
        of_walls: choice.contact.of_walls,
        explicit: None,
        impacts: None,
        start: None,
        size: size_of_bodies(parties, surface.dimension),
        smallest: smallest(parties, surface.dimension),
        distance: choice.distance,
        distance_origin,
        pairs: touching.map(|(a, b)| law(a, b)).collect(),
        with_itself,
        threshold_speed: model.laws.has_friction().then_some(model.threshold_speed),
        vertices: surface.vertices.len(),
        faces: if surface.dimension == 2 { surface.edges.len() } else { surface.triangles.len() },
    }
}
