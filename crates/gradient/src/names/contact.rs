//! Numbers of contact, and numbers of a scene that its contact is made of.

use pliant::element::cross;
use pliant::topology::{BodyTopology, Topology};
use pliant_scene::assembly::{CONTACT_PART_OF_BODY, CONTACT_PART_OF_EDGE};
use pliant_scene::{Body, ContactSpec, ObstacleShape, Scene};

use super::constants::MaterialConstants;
use super::materials::young;
use crate::parameter::{ContactStiffness, FrictionCoefficient, PairStiffness, Parameter};

const STIFFNESS: &str = "contact.stiffness";
const FRICTION: &str = "contact.friction";

/// Names of the numbers of contact itself. One number says how all pairs rub, and rub they do.
pub(super) fn names(scene: &Scene) -> impl Iterator<Item = &'static str> {
    let contact = scene.contact.as_ref();
    let stiffness = contact.and_then(|contact| contact.stiffness).map(|_| STIFFNESS);
    let alike = contact.filter(|contact| contact.pairs.iter().all(|pair| pair.friction.is_none()));
    let friction = alike.filter(|contact| contact.friction > 0.0).map(|_| FRICTION);
    stiffness.into_iter().chain(friction)
}

/// The number of contact of this name.
pub(super) fn parameter(scene: &Scene, name: &str) -> Option<Box<dyn Parameter>> {
    let contact = scene.contact.as_ref()?;
    match names(scene).find(|known| *known == name)? {
        STIFFNESS => Some(Box::new(ContactStiffness::new(contact.stiffness?))),
        _ => Some(Box::new(FrictionCoefficient::new(contact.friction))),
    }
}

/// True if contact goes by the shape of this body at rest.
pub(super) fn goes_by_shape(scene: &Scene, spec: &Body) -> bool {
    collides(spec) && scene.acting_contact().is_some()
}

/// Part of a length by which others may be longer and still count as the least.
const ALIKE: f64 = 1e-9;

/// A length that goes by rest positions.
struct RestLength {
    /// [m]
    length: f64,
    /// Its derivatives by coordinates, by their numbers in the scene.
    slopes: Vec<(usize, f64)>,
}

impl RestLength {
    fn scaled(mut self, factor: f64) -> Self {
        self.length *= factor;
        self.slopes.iter_mut().for_each(|(_, slope)| *slope *= factor);
        self
    }

    /// The least length; of those that are alike the mean of their derivatives.
    fn least(all: Vec<RestLength>) -> Option<RestLength> {
        let length = all.iter().map(|one| one.length).reduce(f64::min)?;
        let alike: Vec<RestLength> =
            all.into_iter().filter(|one| one.length <= (1.0 + ALIKE) * length).collect();
        let part = 1.0 / alike.len() as f64;
        let slopes = alike.into_iter().flat_map(|one| one.slopes).map(|(i, slope)| (i, part * slope));
        Some(RestLength { length, slopes: slopes.collect() })
    }

    /// The diagonal of the bounding box of a body, [`scene_size`](pliant::algebra::scene_size): each of its
    /// sides is held by all the vertices in it alike.
    fn size(body: &BodyTopology, rest: &[f64], d: usize) -> RestLength {
        let vertices = || body.vertices.clone().map(|vertex| vertex as usize);
        let mut sides = vec![];
        for axis in 0..d {
            let at = |vertex: usize| rest[vertex * d + axis];
            let low = vertices().map(at).fold(f64::INFINITY, f64::min);
            let high = vertices().map(at).fold(f64::NEG_INFINITY, f64::max);
            for (end, sign) in [(low, -1.0), (high, 1.0)] {
                let near = |vertex: &usize| (at(*vertex) - end).abs() <= ALIKE * (high - low);
                let holding: Vec<usize> = vertices().filter(near).map(|vertex| vertex * d + axis).collect();
                sides.push((high - low, sign, holding));
            }
        }
        // Each axis has two ends.
        let length = (0.5 * sides.iter().map(|(side, ..)| side * side).sum::<f64>()).sqrt();
        let slopes = sides.into_iter().flat_map(|(side, sign, holding)| {
            let slope = sign * side / length / holding.len() as f64;
            holding.into_iter().map(move |i| (i, slope))
        });
        RestLength { length, slopes: slopes.collect() }
    }

    /// Lengths of the edges of the surface of a body, in the plane of its outline.
    fn edges(body: &BodyTopology, rest: &[f64], d: usize) -> Vec<RestLength> {
        let sides = body.surface.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut sides: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        sides.sort_unstable();
        let edges = sides.chunk_by(|a, b| a == b).filter(|same| d == 3 || same.len() == 1);
        let of_edge = |same: &[[u32; 2]]| {
            let [a, b] = same[0].map(|vertex| vertex as usize * d);
            let along = |k: usize| rest[b + k] - rest[a + k];
            let length = (0..d).map(|k| along(k) * along(k)).sum::<f64>().sqrt();
            let slopes = (0..d).flat_map(|k| [(b + k, along(k) / length), (a + k, -along(k) / length)]);
            RestLength { length, slopes: slopes.collect() }
        };
        edges.map(of_edge).collect()
    }
}

/// Young's moduli of bodies that collide, of materials that have one.
fn moduli(scene: &Scene) -> Vec<(String, f64)> {
    let bodies = scene.body.iter().enumerate().filter(|(_, body)| collides(body));
    let modulus = |(i, body): (usize, &Body)| {
        let lame = body.elastic.as_ref()?.lame()?;
        Some((body.name_or_default(i), lame.young_and_poisson().0))
    };
    bodies.filter_map(modulus).collect()
}

/// True if numbers are as good as equal.
fn are_alike(a: f64, b: f64) -> bool {
    (a - b).abs() <= ALIKE * b.abs()
}

/// Young's modulus of the body of this name as the stiffness of contact is that of the softer of two bodies,
/// where neither the scene gives one nor explicit steps bear less. Of two that are alike it is half each of
/// their moduli, the mean of the derivatives from both sides.
pub(super) fn by_modulus(scene: &Scene, spec: &Body, name: &str) -> Option<PairStiffness> {
    let contact = scene.acting_contact().filter(|contact| contact.stiffness.is_none())?;
    let own = spec.elastic.as_ref().and_then(young).filter(|_| goes_by_modulus(&contact, spec))?;
    let (moduli, name) = (moduli(scene), name.to_owned());
    Some(PairStiffness::new(move |bodies, stiffness| {
        if !bodies.contains(&&name[..]) || !are_alike(stiffness, own) {
            return 0.0;
        }
        let is_other = |(other, young): &(String, f64)| {
            *other != name && bodies.contains(&&other[..]) && are_alike(*young, own)
        };
        if moduli.iter().any(is_other) { 0.5 / own } else { 1.0 / own }
    }))
}

/// True if what contact takes of a body for its stiffness is the modulus of its material alone.
fn goes_by_modulus(contact: &ContactSpec, spec: &Body) -> bool {
    let is_plain = spec.membrane.is_none() && spec.nodal_integration.is_none();
    is_plain
        && collides(spec)
        && contact.stiffness.is_none()
        && spec
            .elastic
            .as_ref()
            .is_some_and(|material| young(material).is_some() && material.lame().is_some())
}

/// Areas and masses of the vertices on the surface of a body.
struct SurfaceMasses {
    name: String,
    /// Of each vertex [m^2], [kg].
    vertices: Vec<[f64; 2]>,
    /// [m^2]
    area: f64,
}

impl SurfaceMasses {
    fn new(name: String, body: &BodyTopology, topology: &Topology) -> Self {
        let (rest, d) = (&topology.rest_positions[..], topology.dimension);
        let mut areas = vec![0.0; body.vertices.len()];
        let mut add = |vertices: &[usize], area: f64| {
            let first = body.vertices.start as usize;
            vertices.iter().for_each(|v| areas[v - first] += area / vertices.len() as f64);
        };
        if d == 2 {
            for edge in RestLength::edges(body, rest, d) {
                let ends = [edge.slopes[0].0 / d, edge.slopes[1].0 / d];
                add(&ends, edge.length);
            }
        } else {
            for corners in body.surface.iter().map(|corners| corners.map(|v| v as usize)) {
                let [a, b, c] = corners.map(|v| std::array::from_fn(|k| rest[v * d + k]));
                let sides = [b, c].map(|end: [f64; 3]| std::array::from_fn(|k| end[k] - a[k]));
                let normal = cross(sides[0], sides[1]);
                add(&corners, 0.5 * normal.iter().map(|n| n * n).sum::<f64>().sqrt());
            }
        }
        let masses = &topology.masses[body.vertices.start as usize..body.vertices.end as usize];
        let vertices = areas.iter().zip(masses).filter(|(area, mass)| **area > 0.0 && **mass > 0.0);
        let vertices = vertices.map(|(area, mass)| [*area, *mass]).collect();
        SurfaceMasses { name, vertices, area: areas.iter().sum() }
    }

    /// Most area over mass of a vertex in contact with a surface of this area [m^2/kg].
    fn mobility(&self, area: f64) -> f64 {
        self.vertices.iter().map(|[own, mass]| own.min(area) / mass).fold(0.0, f64::max)
    }

    /// Most mass of a vertex for its area [kg/m^2].
    fn densest(&self) -> f64 {
        self.vertices.iter().map(|[area, mass]| mass / area).fold(0.0, f64::max)
    }
}

/// The density of the body of this name, or its mass, that is `number`, as the stiffness of contact goes by
/// masses: in explicit steps `kappa = f^2 dhat / (h^2 R)`, `R` the sum of the areas over masses of both
/// bodies, of bodies without a modulus `dhat / h^2` times the larger mass for an area.
pub(super) fn by_density(
    scene: &Scene,
    topology: &Topology,
    (spec, name): (&Body, &str),
    number: f64,
) -> Option<PairStiffness> {
    let contact = scene.acting_contact().filter(|contact| contact.stiffness.is_none())?;
    if !collides(spec) || !goes_by_masses(scene, &contact, spec) || !is_of_solids(scene) {
        return None;
    }
    let is_explicit = contact.has_explicit_law(scene.time.integrator);
    let bodies = scene.body.iter().zip(&topology.bodies).enumerate().filter(|(_, (spec, _))| collides(spec));
    let surfaces: Vec<SurfaceMasses> =
        bodies.map(|(i, (spec, body))| SurfaceMasses::new(spec.name_or_default(i), body, topology)).collect();
    let (moduli, name) = (moduli(scene), name.to_owned());
    Some(PairStiffness::new(move |bodies, stiffness| {
        let found = |name: &str| surfaces.iter().find(|surface| surface.name == name);
        let Some(own) = found(&name).filter(|_| bodies.contains(&&name[..])) else { return 0.0 };
        let of_pair = moduli.iter().filter(|(body, _)| bodies.contains(&&body[..]));
        let softer = of_pair.map(|(_, young)| *young).fold(f64::INFINITY, f64::min);
        if stiffness >= (1.0 - ALIKE) * softer {
            return 0.0;
        }
        let other = bodies.into_iter().find(|body| *body != name).and_then(found);
        let part = match (other, is_explicit) {
            (None, _) => 1.0,
            (Some(other), true) => {
                let [own, other] = [own.mobility(other.area), other.mobility(own.area)];
                own / (own + other)
            }
            (Some(other), false) if are_alike(own.densest(), other.densest()) => 0.5,
            (Some(other), false) => f64::from(u8::from(own.densest() > other.densest())),
        };
        part / number
    }))
}

/// True if what contact takes of all that collides for its stiffness are moduli of materials and masses of
/// surfaces without a thickness.
fn is_of_solids(scene: &Scene) -> bool {
    let is_solid = |body: &Body| body.elastic.is_some() && body.membrane.is_none();
    scene.body.iter().filter(|body| collides(body)).all(is_solid)
}

/// True if the stiffness of contact of a body goes, or may go, by masses.
fn goes_by_masses(scene: &Scene, contact: &ContactSpec, spec: &Body) -> bool {
    let has_modulus = match &spec.elastic {
        Some(material) => material.lame().is_some(),
        None => spec.springs.is_some(),
    };
    contact.has_explicit_law(scene.time.integrator) || !has_modulus
}

/// True if the distance from which on surfaces push goes by the shape of bodies without a thickness alone,
/// and is the one length beside theirs.
fn goes_by_sizes(scene: &Scene, contact: &ContactSpec) -> bool {
    let is_plain = |body: &Body| {
        let radius = body.contact.as_ref().and_then(|contact| contact.radius);
        body.elastic.is_some() && body.membrane.is_none() && radius.unwrap_or(0.0) == 0.0
    };
    let is_round =
        |shape: &ObstacleShape| matches!(shape, ObstacleShape::Ball(_) | ObstacleShape::Capsule(_));
    contact.distance.is_none()
        && scene.body.iter().filter(|body| collides(body)).all(is_plain)
        && !scene.obstacle.iter().any(|obstacle| is_round(&obstacle.shape))
}

/// Default distance of contact [m], and its derivatives by the rest positions of a body, flat, where they
/// decide it.
pub(super) fn reach(scene: &Scene, topology: &Topology, body: &BodyTopology) -> Option<(f64, Vec<f64>)> {
    scene.acting_contact().filter(|contact| goes_by_sizes(scene, contact))?;
    let (rest, d) = (&topology.rest_positions[..], topology.dimension);
    let bodies = scene.body.iter().zip(&topology.bodies);
    let colliding: Vec<&BodyTopology> =
        bodies.filter(|(spec, _)| collides(spec)).map(|(_, body)| body).collect();
    let sizes = colliding.iter().map(|body| RestLength::size(body, rest, d)).collect();
    let edges = colliding.iter().flat_map(|body| RestLength::edges(body, rest, d)).collect();
    let size = RestLength::least(sizes)?.scaled(CONTACT_PART_OF_BODY);
    let edge = RestLength::least(edges)?.scaled(CONTACT_PART_OF_EDGE);
    let decides = if size.length <= edge.length { size } else { edge };
    let first = body.vertices.start as usize * d;
    let mut slopes = vec![0.0; body.vertices.len() * d];
    for (i, slope) in decides.slopes {
        if let Some(sum) = i.checked_sub(first).and_then(|i| slopes.get_mut(i)) {
            *sum += slope;
        }
    }
    slopes.iter().any(|slope| *slope != 0.0).then_some((decides.length, slopes))
}

/// True unless the body says that it touches nothing.
fn collides(spec: &Body) -> bool {
    spec.contact.as_ref().and_then(|contact| contact.collides) != Some(false)
}

/// Why contact leaves the derivative by this key of a body unknown; `None` where it does not.
///
/// Without a `distance` in `[contact]` that goes by the smallest body at rest, or by the shortest edge, and
/// is not the one length beside theirs where there are thicknesses. Without a `stiffness` its `kappa` is the
/// modulus of the softer body, or goes by masses and areas: in the steps of explicit schemes, and of bodies
/// without a modulus.
pub(super) fn obstacle(scene: &Scene, spec: &Body, key: &str) -> Option<&'static str> {
    let contact = scene.acting_contact()?;
    if !collides(spec) {
        return None;
    }
    if key == "membrane.thickness" && !contact.of_walls {
        return Some("has no derivative where surfaces touch: contact keeps half of it away");
    }
    if key == "rest" && contact.distance.is_none() && !goes_by_sizes(scene, &contact) {
        return Some(
            "has no derivative where it decides how near surfaces with a thickness touch: give a `distance` \
             in [contact]",
        );
    }
    let by_masses = goes_by_masses(scene, &contact, spec);
    let decides = match key.split_once('.') {
        None => key == "rest" && by_masses,
        Some(("mass", "per_vertex")) => by_masses,
        Some(("mass", _)) => by_masses && !is_of_solids(scene),
        Some(("springs", _)) => true,
        Some(("elastic", key)) => {
            let constants = spec.elastic.as_ref().and_then(MaterialConstants::of);
            let is_constant = constants.is_some_and(|constants| constants.keys().any(|known| known == key));
            is_constant || key == "young" && !goes_by_modulus(&contact, spec)
        }
        _ => false,
    };
    (decides && contact.stiffness.is_none())
        .then_some("has no derivative where it decides how stiff contact is: give a `stiffness` in [contact]")
}
