//! Assembly of obstacles: fixed bodies without mass and without energy terms.

use std::borrow::Cow;

use crate::schema::{
    Body, BoxSelection, GridSpec, InlineSpec, MassSpec, MeshSpec, ObstacleShape, ObstacleSpec, OneOrMany,
    Pin, Scene, SphereSpec,
};
use pliant::algebra::unit;
use pliant::constraint::Wall;

/// Number of corners of the polygon that represents a disk or round ends.
const CORNERS: usize = 48;
/// Number of cells along each edge of the icosahedron that represents a ball.
const CELLS: usize = 10;

impl Scene {
    /// Scene with its obstacles added to the bodies, if contact is active.
    pub(super) fn with_obstacles(&self) -> Cow<'_, Scene> {
        let Some(contact) = self.acting_contact() else { return Cow::Borrowed(self) };
        let mut whole = among_bodies(self);
        whole.contact = Some(contact.into_owned());
        Cow::Owned(whole)
    }
}

/// Scene with its obstacles, and the walls that contact turns into obstacles, added to the bodies.
fn among_bodies(scene: &Scene) -> Scene {
    let mut whole = scene.clone();
    for (i, wall) in whole.world.walls.drain(..).enumerate() {
        let shape = ObstacleShape::HalfSpace(wall);
        let spec = ObstacleSpec { name: Some(ObstacleSpec::name_of_wall(i)), shape, motion: None };
        let mut wall = body(scene, &spec, i);
        // The reaction has the name of the wall, as without contact.
        wall.pin[0].name = Some(String::new());
        whole.body.push(wall);
    }
    for (i, obstacle) in scene.obstacle.iter().enumerate() {
        whole.body.push(body(scene, obstacle, i));
    }
    whole
}

/// Body that represents an obstacle.
fn body(scene: &Scene, obstacle: &ObstacleSpec, index: usize) -> Body {
    let bounds = |sign: f64| vec![sign * f64::INFINITY; scene.dimension];
    let pin = Pin {
        corners: Some(BoxSelection { min: bounds(-1.0), max: bounds(1.0) }),
        name: Some(ObstacleSpec::PIN.into()),
        motion: obstacle.motion.clone(),
        ..Pin::default()
    };
    Body {
        name: Some(obstacle.name_or_default(index)),
        pin: vec![pin],
        obstacle: Some(obstacle.shape.clone()),
        ..Body::new(mesh(scene.dimension, &obstacle.shape), MassSpec::PerVertex(OneOrMany::One(0.0)))
    }
}

/// Drawn mesh of an obstacle; a half-space is a single vertex.
fn mesh(dimension: usize, shape: &ObstacleShape) -> MeshSpec {
    match shape {
        ObstacleShape::HalfSpace(half_space) => {
            let foot = Wall::new(&half_space.normal, half_space.offset).foot();
            points(vec![foot[..dimension].to_vec()], vec![])
        }
        ObstacleShape::Ball(ball) if dimension == 3 => MeshSpec::Sphere(SphereSpec {
            radius: ball.radius,
            cells: CELLS,
            centre: Some(ball.centre.clone()),
        }),
        ObstacleShape::Ball(ball) => {
            let corner = |i: usize| {
                let angle = std::f64::consts::TAU * i as f64 / CORNERS as f64;
                let (sin, cos) = libm::sincos(angle);
                vec![ball.centre[0] + ball.radius * cos, ball.centre[1] + ball.radius * sin]
            };
            let centre = CORNERS as u32;
            let triangle = |i: usize| [centre, i as u32, ((i + 1) % CORNERS) as u32];
            let corners = (0..CORNERS).map(corner).chain([ball.centre.clone()]);
            points(corners.collect(), (0..CORNERS).map(triangle).collect())
        }
        ObstacleShape::Capsule(capsule) => {
            let [a, b] = [0, 1].map(|end| {
                let mut row = [0.0; 3];
                row.iter_mut().zip(&capsule.axis[end]).for_each(|(x, given)| *x = *given);
                row
            });
            if dimension == 3 { capsule_in_space(a, b, capsule.radius) } else { strip(a, b, capsule.radius) }
        }
        ObstacleShape::Box(corners) => MeshSpec::Grid(GridSpec {
            cells: vec![1; dimension],
            size: Some(corners.max.iter().zip(&corners.min).map(|(max, min)| max - min).collect()),
            origin: Some(corners.min.clone()),
            ..GridSpec::default()
        }),
        ObstacleShape::Mesh(mesh) => (**mesh).clone(),
    }
}

/// The sum `p + s u`.
fn beyond(p: [f64; 3], s: f64, u: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| p[k] + s * u[k])
}

/// Unit vector from `a` to `b`.
fn direction(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    unit(&beyond(b, -1.0, a)).0
}

/// Strip with round ends; the last two vertices are the ends of its axis.
fn strip(a: [f64; 3], b: [f64; 3], radius: f64) -> MeshSpec {
    let u = direction(a, b);
    let n = [-u[1], u[0], 0.0];
    let half = CORNERS / 2;
    // From left of the axis around `a` to its right, then around `b` back.
    let around = |centre: [f64; 3], sign: f64, i: usize| {
        let (sin, cos) = libm::sincos(std::f64::consts::PI * i as f64 / half as f64);
        beyond(beyond(centre, sign * radius * cos, n), -sign * radius * sin, u)
    };
    let corners = (0..=half).map(|i| around(a, 1.0, i)).chain((0..=half).map(|i| around(b, -1.0, i)));
    let count = half as u32;
    let (first, second) = (2 * count + 2, 2 * count + 3);
    let fans = (0..count).map(|i| [first, i, i + 1]);
    let fans = fans.chain((count + 1..=2 * count).map(|i| [second, i, i + 1]));
    let (left, right) = ([0, 2 * count + 1], [count, count + 1]);
    let middle = [
        [left[0], first, second],
        [left[0], second, left[1]],
        [first, right[0], right[1]],
        [first, right[1], second],
    ];
    let rows = corners.chain([a, b]).map(|row| row[..2].to_vec());
    points(rows.collect(), fans.chain(middle).collect())
}

/// Surface of a cylinder with round ends.
fn capsule_in_space(a: [f64; 3], b: [f64; 3], radius: f64) -> MeshSpec {
    let u = direction(a, b);
    let least = (0..3).min_by(|&i, &j| u[i].abs().total_cmp(&u[j].abs())).unwrap_or(0);
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let v = direction([0.0; 3], beyond(axis, -u[least], u));
    let w = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let (around, along) = (CORNERS / 2, CORNERS / 8);
    let mut rows = vec![beyond(a, -radius, u)];
    for ring in 0..2 * along {
        let (centre, latitude) = if ring < along { (a, ring + 1) } else { (b, ring) };
        let (sin, cos) = libm::sincos(std::f64::consts::FRAC_PI_2 * latitude as f64 / along as f64);
        for i in 0..around {
            let (sine, cosine) = libm::sincos(std::f64::consts::TAU * i as f64 / around as f64);
            let middle = beyond(centre, -radius * cos, u);
            rows.push(beyond(beyond(middle, radius * sin * cosine, v), radius * sin * sine, w));
        }
    }
    rows.push(beyond(b, radius, u));
    let (around, rings, last) = (around as u32, 2 * along as u32, rows.len() as u32 - 1);
    let at = |ring: u32, i: u32| 1 + ring * around + i % around;
    let mut triangles = vec![];
    for i in 0..around {
        triangles.push([0, at(0, i + 1), at(0, i)]);
        triangles.push([last, at(rings - 1, i), at(rings - 1, i + 1)]);
        for ring in 0..rings - 1 {
            let [p, q, r, s] = [at(ring, i), at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i)];
            triangles.extend([[p, q, r], [p, r, s]]);
        }
    }
    points(rows.iter().map(|row| row.to_vec()).collect(), triangles)
}

fn points(points: Vec<Vec<f64>>, triangles: Vec<[u32; 3]>) -> MeshSpec {
    MeshSpec::Inline(InlineSpec {
        points,
        triangles,
        edges: vec![],
        tetrahedra: vec![],
        quadrilaterals: vec![],
        hexahedra: vec![],
    })
}
