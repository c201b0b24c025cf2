//! Numbers of contact, and numbers of a scene that its contact is made of.

use pliant::topology::{BodyTopology, Topology};
use pliant_scene::assembly::{CONTACT_PART_OF_BODY, CONTACT_PART_OF_EDGE};
use pliant_scene::{Body, ContactSpec, ObstacleShape, Scene};

use super::constants::MaterialConstants;
use crate::parameter::{ContactStiffness, FrictionCoefficient, Parameter};

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

/// True if the stiffness of contact is Young's modulus of this body, of all pairs that touch: it alone
/// collides, with itself and with obstacles, in steps that are solved.
pub(super) fn is_as_stiff(scene: &Scene, spec: &Body) -> bool {
    let Some(contact) = scene.acting_contact().filter(|contact| contact.stiffness.is_none()) else {
        return false;
    };
    let mut others = scene.body.iter().filter(|body| !std::ptr::eq(*body, spec));
    let is_plain = spec.membrane.is_none() && spec.nodal_integration.is_none();
    is_plain
        && collides(spec)
        && !others.any(collides)
        && !contact.has_explicit_law(scene.time.integrator)
        && spec.elastic.as_ref().is_some_and(|material| material.lame().is_some())
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

/// That distance [m], and its derivatives by the rest positions of a body, flat, where they decide it.
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
/// Without a `distance` in `[contact]` that goes by the shape of the smallest body at rest, or by its shortest
/// edge. Without a `stiffness` its `kappa` is the modulus of the softer body, or goes by masses and areas: in the steps of
/// explicit schemes, and of bodies without a modulus.
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
    let has_modulus = match &spec.elastic {
        Some(material) => material.lame().is_some(),
        None => spec.springs.is_some(),
    };
    let by_masses = contact.has_explicit_law(scene.time.integrator) || !has_modulus;
    let decides = match key.split_once('.') {
        None => key == "rest" && by_masses,
        Some(("mass", _)) => by_masses,
        Some(("springs", _)) => true,
        Some(("elastic", key)) => {
            let constants = spec.elastic.as_ref().and_then(MaterialConstants::of);
            let is_constant = constants.is_some_and(|constants| constants.keys().any(|known| known == key));
            is_constant || key == "young" && !is_as_stiff(scene, spec)
        }
        _ => false,
    };
    (decides && contact.stiffness.is_none())
        .then_some("has no derivative where it decides how stiff contact is: give a `stiffness` in [contact]")
}
