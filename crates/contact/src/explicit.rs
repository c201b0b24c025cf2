//! Contact in explicit steps: the stiffness it adds, the impacts it can stop, and measured extremes.

use pliant::energy::{Approach, ContactExtremes, Penetration};

use crate::contacts::Contacts;
use crate::model::ContactModel;
use crate::report::{ContactReport, NearestContact};
use crate::surface::{ContactSurface, VertexKind};

/// Surface mobility of bodies: areas over masses [m^2/kg] of their vertices.
///
/// A flat contact whose energy has the second derivative `k` [N/m^3] per area adds at most `k (w_a/m_a +
/// w_b/m_b)` to a squared angular frequency: `(u_a - u_b)^2 <= (1 + t) u_a^2 + (1 + 1/t) u_b^2` for every
/// `t`, and the integral of the square of a linear function is at most that of its corner values. No
/// contact area exceeds the surface of either body.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceMobility {
    /// Area [m^2] and inverse mass [1/kg] of the moving vertices of each body.
    moving: Vec<Vec<[f64; 2]>>,
    /// Area of each body [m^2]; infinite for half-spaces and balls.
    areas: Vec<f64>,
    /// Number of sides from which other thin bodies touch each body; 1 for solids.
    sides: Vec<f64>,
    /// Number of vertices of each body.
    vertices: Vec<u32>,
}

/// Effective number of sides of a particle among particles: six neighbours in 2D, twelve in 3D, each
/// weighted by the square of its direction cosine along one direction.
const SIDES_OF_PARTICLE: [f64; 2] = [3.0, 4.0];
/// Effective number of sides of a strand: parallel strands pack as particles in 2D do.
const SIDES_OF_WIRE: f64 = 3.0;

impl SurfaceMobility {
    /// Mobilities of `bodies` bodies; `inverse_mass` [1/kg] of every vertex of the system, 0 where it is
    /// fixed.
    pub fn new(surface: &ContactSurface, bodies: usize, inverse_mass: impl Fn(u32) -> f64) -> Self {
        let (mut moving, mut areas) = (vec![vec![]; bodies], vec![0.0; bodies]);
        let (mut sides, mut vertices) = (vec![1.0f64; bodies], vec![0; bodies]);
        for &v in &surface.vertices {
            let body = surface.bodies[v as usize] as usize;
            let (area, inverse) = (surface.vertex_areas[v as usize], inverse_mass(v));
            vertices[body] += 1;
            areas[body] += area;
            if area * inverse > 0.0 {
                moving[body].push([area, inverse]);
            }
            let from = match surface.kinds[v as usize] {
                VertexKind::Particle => SIDES_OF_PARTICLE[surface.dimension - 2],
                VertexKind::Wire => SIDES_OF_WIRE,
                VertexKind::Face if surface.inner_vertices[v as usize] => 1.0,
                // Boundary vertices belong to sheets, which have two sides.
                VertexKind::Face => 2.0,
            };
            sides[body] = sides[body].max(from);
        }
        areas.iter_mut().filter(|area| **area == 0.0).for_each(|area| *area = f64::INFINITY);
        SurfaceMobility { moving, areas, sides, vertices }
    }

    /// Areas over masses of the vertices of `a` in contact with `b` [m^2/kg].
    fn against(&self, a: u32, b: u32) -> impl Iterator<Item = f64> + '_ {
        let most = self.areas[b as usize];
        self.moving[a as usize].iter().map(move |[area, inverse]| area.min(most) * inverse)
    }

    /// `R` [m^2/kg]: contact of the two bodies with the second derivative `k` [N/m^3] per area adds at
    /// most `k R` to a squared angular frequency.
    pub fn of_pair(&self, a: u32, b: u32) -> f64 {
        let [side_a, side_b] = [a, b].map(|body| self.sides[body as usize]);
        if a == b && self.vertices[a as usize] < 2 {
            return 0.0;
        }
        let both_thin = side_a > 1.0 && side_b > 1.0;
        let part = |a: u32, b: u32, sides: f64| {
            self.against(a, b).fold(0.0, f64::max) * if both_thin { sides } else { 1.0 }
        };
        part(a, b, side_a) + part(b, a, side_b)
    }

    /// Largest mass per area that contact of the two has to stop [kg/m^2]; infinite if neither moves.
    pub fn mass_to_stop(&self, a: u32, b: u32) -> f64 {
        let least = |a: u32, b: u32| {
            let least = self.against(a, b).fold(f64::INFINITY, f64::min);
            if least.is_finite() { least } else { 0.0 }
        };
        1.0 / (least(a, b) + least(b, a))
    }
}

/// Largest contribution of contact to a squared angular frequency [1/s^2] while no gap closes: `4 kappa /
/// dhat R`, maximum over all pairs of bodies.
pub fn stiffening(model: &ContactModel, mobility: &SurfaceMobility) -> f64 {
    let count = model.names.len() as u32;
    let mut most: f64 = 0.0;
    for a in 0..count {
        for b in (a..count).filter(|b| model.touch(a, *b)) {
            let barrier = &model.laws.of(a, b).barrier;
            most = most.max(4.0 * barrier.stiffness / barrier.reach * mobility.of_pair(a, b));
        }
    }
    most
}

/// Surface area of each body [m^2]; infinite for half-spaces and balls.
pub(crate) fn areas(model: &ContactModel) -> Vec<f64> {
    SurfaceMobility::new(&model.surface, model.names.len(), |_| 0.0).areas
}

/// Share of one vertex in a contact.
struct Share {
    vertex: u32,
    /// Area of the vertex that the contact stands for [m^2].
    area: f64,
    /// Approach speed of the two sides [m/s].
    speed: f64,
    /// Stored energy relative to that of a closed gap.
    stored: f64,
    /// Mean inverse mass of the other side [1/kg].
    other: f64,
    /// `mu lambda |c| sum_j |c_j|` over the moving vertices [N].
    friction: f64,
    bodies: [u32; 2],
}

/// Smallest gap, deepest penetration, and the approach closest to the stoppable speed, at `x` [m] and `v`
/// [m/s].
pub(crate) fn extremes<const D: usize>(
    (model, areas): (&ContactModel, &[f64]),
    contacts: &Contacts,
    (x, v): (&[f64], &[f64]),
    inverse_mass: &[f64],
    time: f64,
) -> ContactExtremes {
    // Nearest and deepest contacts, and the share of each moving vertex in each contact.
    let mut found = ContactExtremes::default();
    let names = |[a, b]: [u32; 2]| [a, b].map(|body| model.names[body as usize].clone());
    let mobility = |v: u32| inverse_mass[v as usize * D..][..D].iter().copied().fold(0.0, f64::max);
    let mut shares: Vec<Share> = vec![];
    let mut deepest: Option<([u32; 2], f64)> = None;
    let mut nearest = NearestContact::default();
    for i in 0..contacts.len() {
        let report = ContactReport::<D>::of(contacts, model, x, i);
        let vertices = &report.vertices[..report.count];
        nearest.look_at(&report, model);
        let Some([a, b]) = report.bodies(model) else { continue };
        if report.gap < 0.0 && deepest.is_none_or(|(_, gap)| report.gap < gap) {
            deepest = Some(([a, b], report.gap));
        }
        let barrier = &model.laws.of(a, b).barrier;
        let left = 1.0 - report.gap / barrier.reach;
        // Negative weights subtract duplicates.
        if report.force <= 0.0 || left <= 0.0 {
            continue;
        }
        let weight = report.force / (2.0 * barrier.stiffness * left * left);
        // Approach speed, and inverse masses by side.
        let (mut speed, mut sides, mut moving) = (0.0, [0.0; 2], 0.0);
        for (i, &vertex) in vertices.iter().enumerate() {
            let c = report.coefficients[i];
            let along: f64 = (0..D).map(|k| report.normal[k] * v[vertex as usize * D + k]).sum();
            speed -= c * along;
            sides[usize::from(c < 0.0)] += c.abs() * mobility(vertex);
            moving += if mobility(vertex) > 0.0 { c.abs() } else { 0.0 };
        }
        for (i, &vertex) in vertices.iter().enumerate() {
            let c = report.coefficients[i];
            if c != 0.0 && mobility(vertex) > 0.0 {
                let other = sides[usize::from(c > 0.0)];
                let (area, stored) = (weight * c.abs(), left.powi(3));
                let friction = report.friction * report.force * c.abs() * moving;
                shares.push(Share { vertex, area, speed, stored, other, friction, bodies: [a, b] });
            }
        }
    }
    // Sums over the contacts of each vertex.
    found.least = nearest.described(model, time);
    found.deepest = deepest.map(|(bodies, gap)| Penetration { bodies: names(bodies), depth: -gap, time });
    // Stable: sums are in the order of the contacts.
    shares.sort_by_key(|share| share.vertex);
    for of_vertex in shares.chunk_by(|a, b| a.vertex == b.vertex) {
        let vertex = of_vertex[0].vertex;
        let area: f64 = of_vertex.iter().map(|share| share.area).sum();
        let mean =
            |of: fn(&Share) -> f64| of_vertex.iter().map(|share| share.area * of(share)).sum::<f64>() / area;
        let [a, b] = of_vertex[0].bodies;
        let barrier = &model.laws.of(a, b).barrier;
        let other = if model.body(vertex) == a { b } else { a };
        let full = model.surface.vertex_areas[vertex as usize].min(areas[other as usize]);
        let mass = 1.0 / (full * (mobility(vertex) + mean(|share| share.other)));
        let friction = 2.0 * mobility(vertex) * of_vertex.iter().map(|share| share.friction).sum::<f64>();
        found.friction = found.friction.max(friction);
        let (speed, stopped) = (mean(|share| share.speed).max(0.0), barrier.stopped_speed(mass));
        // Stored energy counts as speed already taken.
        let speed = (speed * speed + mean(|share| share.stored) * stopped * stopped).sqrt();
        if speed.is_finite() && stopped > 0.0 {
            let bodies = names([a, b]);
            let hardest = Some(Approach { bodies, speed, stopped, time });
            found.merge(ContactExtremes { hardest, ..ContactExtremes::default() });
        }
    }
    found
}
