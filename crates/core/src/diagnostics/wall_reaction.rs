//! Reaction forces of walls.

use super::Reaction;
use crate::algebra::dot;
use crate::constraint::Wall;
use crate::system::{System, WallImpulses};

/// Sweeps over the walls that a vertex touches; one suffices unless there are several.
const SWEEPS: usize = 1000;
/// Rounding of the distance from a wall, in units in the last place of the position.
const ULPS: f64 = 16.0;

/// Forces of walls.
pub(super) struct WallForces {
    /// Reaction of each wall.
    pub(super) reactions: Vec<Reaction>,
    /// Forces at all vertices, flat [N].
    pub(super) at_vertices: Vec<f64>,
}

impl WallForces {
    /// Computes the mean forces over the last step from its impulses.
    pub(super) fn of_last_step(system: &System, impulses: &WallImpulses, coordinates: usize) -> Self {
        let mut at_vertices = vec![0.0; coordinates];
        impulses.held.iter().for_each(|(i, impulse)| at_vertices[*i] += impulse / impulses.h);
        let walls = system.walls().iter().zip(&impulses.walls).enumerate();
        let reactions = walls.map(|(i, (wall, parts))| {
            let [force, moment] = parts.map(|part| part.map(|p| p / impulses.h));
            Reaction { name: format!("wall{i}"), force, moment, about: wall.foot() }
        });
        WallForces { reactions: reactions.collect(), at_vertices }
    }

    /// Computes the current contact forces in the state `x`, `v` with steps of `h` [s]; `system` holds
    /// the force and the dissipation there. A vertex that touches a wall and is pressed against it by all
    /// other forces is supported there.
    ///
    /// A vertex touches a wall if its distance and separation speed are at most those it could reach from
    /// rest on the wall in one step: where several walls meet, the last one applied moves a resting
    /// vertex off the others by that much.
    pub(super) fn new(system: &System, h: f64, x: &[f64], v: &[f64]) -> Self {
        let (d, drag, walls) = (system.dimension(), system.ether_drag(), system.walls());
        let name = |i: usize| format!("wall{i}");
        let mut reactions: Vec<Reaction> =
            walls.iter().enumerate().map(|(i, wall)| Reaction::none(name(i), wall.foot())).collect();
        let mut at_vertices = vec![0.0; x.len()];
        let all: Vec<u32> = (0..system.mass().len() as u32).collect();
        system.visit_gradient(&all, |vertex, gradient| {
            let rows = vertex * d..(vertex + 1) * d;
            let (x, v, weight) = (&x[rows.clone()], &v[rows.clone()], &system.inverse_mass()[rows.clone()]);
            let m = system.mass()[vertex];
            let mut force = [0.0; 3];
            for c in (0..d).filter(|c| weight[*c] != 0.0) {
                force[c] = -gradient[c] - drag * m * v[c];
            }
            let fall = h * dot(&force, &force).sqrt() / m;
            let touched: Vec<Contact> = (0..walls.len())
                .filter_map(|i| Contact::new(i, &walls[i], weight, x, v, [h * fall, fall]))
                .collect();
            for (contact, size) in touched.iter().zip(pressed(&touched, force)) {
                let push = contact.normal.map(|n| size * n);
                reactions[contact.wall].add(push, walls[contact.wall].moment(x, push));
                at_vertices[rows.clone()].iter_mut().zip(push).for_each(|(sum, f)| *sum += f);
            }
        });
        WallForces { reactions, at_vertices }
    }
}

/// A wall that a vertex touches.
struct Contact {
    wall: usize,
    normal: [f64; 3],
    /// Normal restricted to free coordinates.
    free: [f64; 3],
}

impl Contact {
    /// Returns `None` if the vertex is farther away [m] or separates faster [m/s] than `most`, or is
    /// constrained along the normal.
    fn new(
        index: usize,
        wall: &Wall,
        weight: &[f64],
        x: &[f64],
        v: &[f64],
        most: [f64; 2],
    ) -> Option<Contact> {
        let (mut normal, mut free) = ([0.0; 3], [0.0; 3]);
        normal[..x.len()].copy_from_slice(wall.normal());
        for c in (0..x.len()).filter(|c| weight[*c] != 0.0) {
            free[c] = normal[c];
        }
        let (away, speed) = (-wall.depth(x), dot(&normal, v));
        let reach = x.iter().fold(wall.offset().abs(), |m, x| m.max(x.abs()));
        let near = away <= most[0] + ULPS * f64::EPSILON * reach && speed <= most[1];
        (near && free != [0.0; 3]).then_some(Contact { wall: index, normal, free })
    }
}

/// Computes the pushing force of each wall [N]: non-negative, and such that together they minimise the
/// remainder of `force`.
fn pressed(touched: &[Contact], mut force: [f64; 3]) -> Vec<f64> {
    let mut sizes = vec![0.0; touched.len()];
    for _ in 0..SWEEPS {
        let mut changed = false;
        for (size, Contact { free, .. }) in sizes.iter_mut().zip(touched) {
            let next = f64::max(*size - dot(free, &force) / dot(free, free), 0.0);
            let change = next - *size;
            (0..3).for_each(|c| force[c] += change * free[c]);
            changed |= change.abs() > f64::EPSILON * next;
            *size = next;
        }
        if !changed {
            break;
        }
    }
    sizes
}

impl Reaction {
    /// Creates a zero reaction about a point.
    fn none(name: String, about: [f64; 3]) -> Self {
        Reaction { name, force: [0.0; 3], moment: [0.0; 3], about }
    }

    /// Adds a force and its moment.
    fn add(&mut self, force: [f64; 3], moment: [f64; 3]) {
        for c in 0..3 {
            self.force[c] += force[c];
            self.moment[c] += moment[c];
        }
    }
}
