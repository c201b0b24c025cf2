//! What touches what, and by which laws: the surface of all bodies, obstacles without a surface of their own,
//! and a law for every two bodies.

use crate::barrier::Barrier;
use crate::candidates::BodyPairs;
use crate::contacts::rows;
use crate::merge::Duplicates;
use crate::surface::ContactSurface;

/// Half-space that nothing enters, `n . (x - x_o) + s >= 0` with `x_o` a vertex of the system: it goes where
/// that vertex goes, and does not turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidHalfSpace {
    /// The vertex that carries it.
    pub vertex: u32,
    /// Unit normal out of it.
    pub normal: [f64; 3],
    /// `s`: depth of its plane behind that vertex [m].
    pub depth: f64,
    /// Its body.
    pub body: u32,
}

impl SolidHalfSpace {
    /// Signed distance [m] of vertex `p` from its plane at `x`, flat `(n, D)` [m].
    #[inline]
    pub(crate) fn distance<const D: usize>(&self, x: &[f64], p: u32) -> f64 {
        let [p, o] = rows::<D, 2>(x, &[p, self.vertex]);
        (0..D).map(|k| self.normal[k] * (p[k] - o[k])).sum::<f64>() + self.depth
    }
}

/// Ball about a vertex of the system; its radius is part of the laws of its body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolidBall {
    /// The vertex at its centre.
    pub vertex: u32,
    /// Its body.
    pub body: u32,
}

/// Law of contact of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactLaw {
    /// Normal force.
    pub barrier: Barrier,
    /// Coefficient of friction `mu`.
    pub friction: f64,
}

/// A law for every two bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactLaws {
    count: usize,
    laws: Vec<ContactLaw>,
}

impl ContactLaws {
    /// The laws of `count` bodies by `law(a, b)`, which is symmetric.
    pub fn new(count: usize, law: impl Fn(usize, usize) -> ContactLaw) -> Self {
        let laws = (0..count * count).map(|i| law(i / count, i % count)).collect();
        ContactLaws { count, laws }
    }

    /// Law of two bodies.
    #[inline]
    pub fn of(&self, a: u32, b: u32) -> &ContactLaw {
        &self.laws[a as usize * self.count + b as usize]
    }

    /// The same, to be changed.
    pub fn of_mut(&mut self, a: u32, b: u32) -> &mut ContactLaw {
        &mut self.laws[a as usize * self.count + b as usize]
    }

    /// True if any two bodies rub.
    pub fn has_friction(&self) -> bool {
        self.laws.iter().any(|law| law.friction > 0.0)
    }
}

/// Bodies and obstacles that touch.
#[derive(Clone, Debug)]
pub struct ContactModel {
    /// Surface of all bodies and of obstacles that have one.
    pub surface: ContactSurface,
    /// Obstacles of planes.
    pub half_spaces: Vec<SolidHalfSpace>,
    /// Obstacles of balls.
    pub balls: Vec<SolidBall>,
    /// Bodies that may touch each other, and themselves.
    pub pairs: BodyPairs,
    /// Laws of every two bodies.
    pub laws: ContactLaws,
    /// Counting of pairs that share closest points.
    pub duplicates: Duplicates,
    /// `e`: speed below which friction grows smoothly from zero [m/s].
    pub threshold_speed: f64,
    /// Number of times that a solve takes the normal forces of friction anew.
    pub friction_iterations: u32,
    /// Bodies that touch themselves from nearer on than others, because they are near themselves at rest.
    pub shortened: Vec<u32>,
    /// Names of the bodies.
    pub names: Vec<String>,
    /// Number of each vertex of the system in its body.
    pub labels: Vec<u32>,
}

impl ContactModel {
    /// Largest gap at which the surfaces of any two bodies act on each other [m]; half-spaces and balls are
    /// no surfaces.
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

    /// The square of the largest distance from the centre of a ball at which what it touches acts on it
    /// [m^2], and of what rounding adds to that.
    pub(crate) fn squared_reach_of(&self, ball: &SolidBall) -> f64 {
        let touched = (0..self.names.len() as u32).filter(|body| self.touch(*body, ball.body));
        let reach = touched.map(|body| self.laws.of(body, ball.body).barrier.squared_reach());
        reach.fold(0.0, f64::max) * (1.0 + 1e-9)
    }

    /// Largest distance, radii included, at which any body acts on itself [m].
    pub fn own_reach(&self) -> f64 {
        let own = (0..self.names.len() as u32).filter(|body| self.touch(*body, *body));
        let distances = own.map(|body| {
            let barrier = &self.laws.of(body, body).barrier;
            barrier.reach + barrier.offset
        });
        distances.fold(0.0, f64::max)
    }

    /// Law of the pair of two vertices of the system.
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

    /// A primitive in words: a vertex, an edge or a triangle by its numbers in its body, an obstacle by its
    /// name.
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

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let surface = &self.surface;
        4 * (surface.vertices.len() + surface.bodies.len() + surface.triangles.len() * 6)
            + surface.edges.len() * 40
            + surface.vertex_areas.len() * 9
    }
}
