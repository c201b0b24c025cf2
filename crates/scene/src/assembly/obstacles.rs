//! Obstacles as bodies: held, without mass, without anything inside.

use std::borrow::Cow;

use crate::schema::{
    Body, BoxSelection, GridSpec, InlineSpec, MassSpec, MeshSpec, ObstacleShape, ObstacleSpec, OneOrMany,
    Pin, Scene, SphereSpec,
};
use pliant::constraint::Wall;

/// Corners of the polygon that a disk is drawn as.
const CORNERS: usize = 48;
/// Cells along each side of the faces of an icosahedron that a ball is drawn as.
const CELLS: usize = 10;
/// Name of what holds an obstacle.
const HOLD: &str = "motion";

impl Scene {
    /// The scene with its obstacles among the bodies, where contact makes them act.
    pub(super) fn with_obstacles(&self) -> Cow<'_, Scene> {
        if self.contact.is_none() { Cow::Borrowed(self) } else { Cow::Owned(among_bodies(self)) }
    }
}

/// The scene with its obstacles, and the walls that contact turns into obstacles, among the bodies.
fn among_bodies(scene: &Scene) -> Scene {
    let mut whole = scene.clone();
    for (i, wall) in whole.world.walls.drain(..).enumerate() {
        let shape = ObstacleShape::HalfSpace(wall);
        let spec = ObstacleSpec { name: Some(format!("wall{i}")), shape, motion: None };
        whole.body.push(body(scene, &spec, i));
    }
    for (i, obstacle) in scene.obstacle.iter().enumerate() {
        whole.body.push(body(scene, obstacle, i));
    }
    whole
}

/// The body that stands for an obstacle.
fn body(scene: &Scene, obstacle: &ObstacleSpec, index: usize) -> Body {
    let bounds = |sign: f64| vec![sign * f64::INFINITY; scene.dimension];
    let pin = Pin {
        corners: Some(BoxSelection { min: bounds(-1.0), max: bounds(1.0) }),
        name: Some(HOLD.into()),
        motion: obstacle.motion.clone(),
        ..Pin::default()
    };
    Body {
        name: Some(obstacle.name_or_default(index)),
        mesh: mesh(scene.dimension, &obstacle.shape),
        transform: None,
        repeat: None,
        elastic: None,
        membrane: None,
        order: None,
        nodal_integration: None,
        stress: None,
        springs: None,
        bending: None,
        damping: None,
        mass: MassSpec::PerVertex(OneOrMany::One(0.0)),
        pin: vec![pin],
        contact: None,
        load: vec![],
        position: None,
        velocity: None,
        obstacle: Some(obstacle.shape.clone()),
    }
}

/// What is drawn of an obstacle; half-spaces are their one vertex.
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
                let (sin, cos) = angle.sin_cos();
                vec![ball.centre[0] + ball.radius * cos, ball.centre[1] + ball.radius * sin]
            };
            let centre = CORNERS as u32;
            let triangle = |i: usize| [centre, i as u32, ((i + 1) % CORNERS) as u32];
            let corners = (0..CORNERS).map(corner).chain([ball.centre.clone()]);
            points(corners.collect(), (0..CORNERS).map(triangle).collect())
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
