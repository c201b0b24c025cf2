//! Contact model: the surface of all bodies, obstacles without a surface mesh, and contact parameters for
//! every pair of bodies.

use crate::barrier::Barrier;
use crate::candidates::BodyPairs;
use crate::surface::ContactSurface;
use crate::vector::rows;

/// Rigid half-space obstacle, free region `n . (x - x_o) + s >= 0` with `x_o` a vertex of the system: it
/// translates with that vertex and does not rotate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidHalfSpace {
    /// Vertex that carries the half-space.
    pub vertex: u32,
    /// Unit normal, pointing out of the half-space.
    pub normal: [f64; 3],
    /// `s`: depth of the plane behind that vertex [m].
    pub depth: f64,
    /// Body of the half-space.
    pub body: u32,
}

impl SolidHalfSpace {
    /// Signed distance [m] of vertex `p` from the plane at `x`, flat `(n, D)` [m].
    #[inline]
    pub(crate) fn distance<const D: usize>(&self, x: &[f64], p: u32) -> f64 {
        let [p, o] = rows::<D, 2>(x, &[p, self.vertex]);
        (0..D).map(|k| self.normal[k] * (p[k] - o[k])).sum::<f64>() + self.depth
    }
}

/// Rigid ball centred at a vertex of the system; its radius is the offset of its body's laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolidBall {
    /// Vertex at the centre.
    pub vertex: u32,
    /// Body of the ball.
    pub body: u32,
}

/// Contact parameters of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
    /// Normal contact energy.
    pub barrier: Barrier,
    /// Friction coefficient `mu`.
    pub friction: f64,
}

/// Contact parameters of every pair of bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactLaws {
    count: usize,
    laws: Vec<ContactLaw>,
}

impl ContactLaws {
    /// Tabulates `law(a, b)`, which must be symmetric, for `count` bodies.
    pub fn new(count: usize, law: impl Fn(usize, usize) -> ContactLaw) -> Self {
        let laws = (0..count * count).map(|i| law(i / count, i % count)).collect();
        ContactLaws { count, laws }
    }

    /// Contact parameters of two bodies.
    #[inline]
    pub fn of(&self, a: u32, b: u32) -> &ContactLaw {
        &self.laws[a as usize * self.count + b as usize]
    }

    /// Contact parameters of two bodies, mutable.
    pub fn of_mut(&mut self, a: u32, b: u32) -> &mut ContactLaw {
        &mut self.laws[a as usize * self.count + b as usize]
    }

    /// True if any pair of bodies has friction.
    pub fn has_friction(&self) -> bool {
        self.laws.iter().any(|law| law.friction > 0.0)
    }
}

/// Treatment of pairs that share closest points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Duplicates {
    /// Counts every pair.
    Sum,
    /// Counts each position once.
    Max,
}

/// Contact model of all bodies and obstacles.
#[derive(Clone, Debug)]
pub struct ContactModel {
    /// Surface of all bodies and of meshed obstacles.
    pub surface: ContactSurface,
    /// Half-space obstacles.
    pub half_spaces: Vec<SolidHalfSpace>,
    /// Ball obstacles.
    pub balls: Vec<SolidBall>,
    /// Pairs of bodies that may touch, and bodies with self-contact.
    pub pairs: BodyPairs,
    /// Contact parameters of every pair of bodies.
    pub laws: ContactLaws,
    /// Treatment of pairs that share closest points.
    pub duplicates: Duplicates,
    /// `e`: friction regularisation velocity, below which friction grows smoothly from zero [m/s].
    pub threshold_speed: f64,
    /// Limit on the updates of lagged friction forces in a solve.
    pub friction_iterations: u32,
    /// Bodies with a shortened activation distance for self-contact, because they are close to themselves
    /// in the reference configuration.
    pub shortened: Vec<u32>,
    /// Names of the bodies.
    pub names: Vec<String>,
    /// Index of each vertex of the system within its body.
    pub labels: Vec<u32>,
}

impl ContactModel {
    /// Largest activation distance between meshed surfaces of any two bodies [m]; half-spaces and balls
    /// are not included.
    pub fn surface_reach(&self) -> f64 {
        let exact = |body: &u32| {
            self.half_spaces.iter().any(|h| h.body == *body) || self.balls.iter().any(|b| b.body == *body)
        };
        let with_surface: Vec<u32> = (0..self.names.len() as u32).filter(|body| !exact(body)).collect();
        let mut largest: f64 = 0.0;
        for (i, a) in with_surface.iter().enumerate() {
            for b in with_surface[i..].iter().filter(|b| self.touch(*a, **b)) {
                largest = largest.max(self.laws.of(*a, *b).barrier.reach);
            }
        }
        largest
    }

    /// Squared largest distance from the centre of a ball at which any body interacts with it [m^2], with
    /// a margin for rounding.
    pub(crate) fn squared_reach_of(&self, ball: &SolidBall) -> f64 {
        let touched = (0..self.names.len() as u32).filter(|body| self.touch(*body, ball.body));
        let reach = touched.map(|body| self.laws.of(body, ball.body).barrier.squared_reach());
        reach.fold(0.0, f64::max) * (1.0 + 1e-9)
    }

    /// Largest distance, radii included, at which any body interacts with itself [m].
    pub fn own_reach(&self) -> f64 {
        let own = (0..self.names.len() as u32).filter(|body| self.touch(*body, *body));
        let distances = own.map(|body| {
            let barrier = &self.laws.of(body, body).barrier;
            barrier.reach + barrier.offset
        });
        distances.fold(0.0, f64::max)
    }

    /// Contact parameters of the bodies of two vertices of the system.
    #[inline]
    pub fn law(&self, a: u32, b: u32) -> &ContactLaw {
        self.laws.of(self.body(a), self.body(b))
    }

    /// Body of a vertex of the system.
    #[inline]
    pub fn body(&self, vertex: u32) -> u32 {
        self.surface.bodies[vertex as usize]
    }

    /// True if two bodies may touch.
    #[inline]
    pub fn touch(&self, a: u32, b: u32) -> bool {
        self.pairs.touch(a, b)
    }

    /// Names a primitive in a message: a vertex, edge or triangle by its indices in its body, an obstacle
    /// by its name.
    pub fn named(&self, vertices: &[u32]) -> String {
        let Some(&first) = vertices.first() else { return String::new() };
        let body = &self.names[self.body(first) as usize];
        let is_obstacle = |vertex| vertex == first;
        if self.half_spaces.iter().any(|h| is_obstacle(h.vertex))
            || self.balls.iter().any(|b| is_obstacle(b.vertex))
        {
            return format!("`{body}`");
        }
        let numbers: Vec<String> = vertices.iter().map(|v| self.labels[*v as usize].to_string()).collect();
        let kind = ["vertex", "edge", "triangle"][(vertices.len() - 1).min(2)];
        format!("{kind} {} of `{body}`", numbers.join("-"))
    }
}
