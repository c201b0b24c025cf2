//! Step limit: how far all vertices may move along straight paths before anything touches.

use pliant::lanes::{Kernel, Lanes, WIDTH, dispatch};
use rayon::prelude::*;
use std::marker::PhantomData;

use crate::barrier::PotentialForm;
use crate::broad_phase::Bounds;
use crate::candidates::CandidatePairs;
use crate::ccd::{GapLimit, safe_step, safe_step_to_half_space};
use crate::closest::Primitives;
use crate::model::{ContactLaw, ContactModel};
use crate::packs::{Screen, filled, load_rows, near_box, screen};
use crate::pair::{EdgeEdge, PointEdge, PointPoint, PointTriangle};
use crate::vector::{along_normal, rows};

/// Pairs per task.
const TASK: usize = 512;

/// Condition that ends a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WayEnd {
    /// A tenth of a gap is left.
    Gap,
    /// Primitives without an inside cross each other, or go deep into radii that a barrier keeps free.
    /// Half-spaces have an inside and are exempt.
    Crossing,
}

/// Motion of all vertices from `x` to `x + dx`, flat `(n, D)` [m].
#[derive(Clone, Copy)]
pub(crate) struct Way<'a> {
    pub(crate) x: &'a [f64],
    pub(crate) dx: &'a [f64],
    pub(crate) ends: WayEnd,
}

/// Pairs closer than this fraction of the activation distance have crossed.
const CROSSED: f64 = 1e-6;
/// Fraction of the radii that straight paths stay out of unless something rotates by more than 120
/// degrees.
const CORE: f64 = 0.5;
/// Limit on the restarts of a search that ended on the path.
const CONTINUATIONS: usize = 10;

/// Two primitives, given by vertices, and the fraction of a motion that they leave free.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Obstruction {
    pub(crate) part: f64,
    /// Vertices of the first primitive, and of the second.
    pub(crate) primitives: [Vec<u32>; 2],
}

/// Fraction of the straight motion of all vertices from `x` to `x + dx`, flat `(n, D)` [m], that these
/// pairs, half-spaces and balls leave free: it ends where a tenth to a twentieth of a gap is left.
pub fn free_part<const D: usize>(
    model: &ContactModel,
    pairs: &CandidatePairs,
    (x, dx): (&[f64], &[f64]),
) -> f64 {
    Way { x, dx, ends: WayEnd::Gap }.first::<D>(model, pairs).map_or(1.0, |first| first.part)
}

impl Way<'_> {
    /// Obstruction with the smallest free fraction; `None` if the whole path is free. Independent of the
    /// number of threads.
    pub(crate) fn first<const D: usize>(
        &self,
        model: &ContactModel,
        pairs: &CandidatePairs,
    ) -> Option<Obstruction> {
        let surface = &model.surface;
        let edge = |e: u32| surface.edges[e as usize];
        // Particle pairs and point-edge pairs.
        let at_point =
            self.least::<PointPoint, D, 2>(model, &pairs.point_point, |pair| pair).map(|(part, i)| {
                let [p, q] = pairs.point_point[i];
                Obstruction { part, primitives: [vec![p], vec![q]] }
            });
        let of_edge = |[p, e]: [u32; 2]| {
            let [a, b] = edge(e);
            [p, a, b]
        };
        let at_lone_edge =
            self.least::<PointEdge, D, 3>(model, &pairs.point_edge, of_edge).map(|(part, i)| {
                let [p, e] = pairs.point_edge[i];
                Obstruction { part, primitives: [vec![p], edge(e).to_vec()] }
            });
        let mut by_pairs = nearest(at_point, at_lone_edge);
        if D == 3 {
            // In 3D also point-triangle and edge-edge pairs.
            let of_triangle = |[p, t]: [u32; 2]| {
                let [a, b, c] = surface.triangles[t as usize];
                [p, a, b, c]
            };
            let of_edges = |[e, f]: [u32; 2]| {
                let ([a, b], [c, d]) = (edge(e), edge(f));
                [a, b, c, d]
            };
            let at_triangle = self.least::<PointTriangle, 3, 4>(model, &pairs.point_triangle, of_triangle);
            let at_triangle = at_triangle.map(|(part, i)| {
                let [p, t] = pairs.point_triangle[i];
                Obstruction { part, primitives: [vec![p], surface.triangles[t as usize].to_vec()] }
            });
            let at_edge = self.least::<EdgeEdge, 3, 4>(model, &pairs.edge_edge, of_edges).map(|(part, i)| {
                let [e, f] = pairs.edge_edge[i];
                Obstruction { part, primitives: [edge(e).to_vec(), edge(f).to_vec()] }
            });
            by_pairs = nearest(by_pairs, nearest(at_triangle, at_edge));
        }
        nearest(nearest(by_pairs, self.planes::<D>(model)), self.balls::<D>(model))
    }

    /// Smallest fraction below 1 over all pairs, and the index of its pair, the first of equal ones.
    /// `vertices` gives the vertices of a pair.
    fn least<K: Primitives<D, N>, const D: usize, const N: usize>(
        &self,
        model: &ContactModel,
        pairs: &[[u32; 2]],
        vertices: impl Fn([u32; 2]) -> [u32; N] + Sync,
    ) -> Option<(f64, usize)> {
        let of_task = |(task, pairs): (usize, &[[u32; 2]])| {
            let pairs: Vec<[u32; N]> = pairs.iter().map(|pair| vertices(*pair)).collect();
            let by = Screen { boxes: true, across: self.ends == WayEnd::Gap, motion: true };
            let reach = |v: &[u32; N]| self.near(model.law(v[0], v[N - 1]));
            let may_meet = screen::<K, D, N>(&pairs, (self.x, Some(self.dx)), reach, by);
            let numbered = (task * TASK..).zip(pairs).zip(may_meet);
            let near: Vec<_> = numbered.filter(|(_, may_meet)| *may_meet).map(|(pair, _)| pair).collect();
            if self.ends == WayEnd::Crossing {
                let part = |v: &[u32; N]| {
                    let limit = passed(model.law(v[0], v[N - 1]));
                    crossing::<K, D, N>(&rows(self.x, v), &rows(self.dx, v), &limit)
                };
                return smallest(near.iter().map(|(i, v)| (part(v), *i)));
            }
            let mut parts = Vec::with_capacity(near.len());
            let law = |v: &[u32; N]| gap(model.law(v[0], v[N - 1]));
            for near in near.chunk_by(|a, b| law(&a.1) == law(&b.1)) {
                let gap = law(&near[0].1);
                let way = *self;
                dispatch(Collisions::<K, D, N> { way, near, gap, parts: &mut parts, of: PhantomData });
            }
            smallest(parts.into_iter().zip(near).map(|(part, (i, _))| (part, i)))
        };
        let tasks: Vec<_> = pairs.par_chunks(TASK).enumerate().map(of_task).collect();
        smallest(tasks.into_iter().flatten())
    }

    /// Distance at which a pair is examined [m].
    fn near(&self, law: &ContactLaw) -> f64 {
        let GapLimit { reach, offset } = match self.ends {
            WayEnd::Crossing => passed(law),
            WayEnd::Gap => gap(law),
        };
        reach + offset
    }

    fn planes<const D: usize>(&self, model: &ContactModel) -> Option<Obstruction> {
        let mut least = None;
        if self.ends == WayEnd::Crossing {
            return least;
        }
        for half_space in &model.half_spaces {
            for &p in model.surface.vertices.iter().filter(|&&p| model.touch(model.body(p), half_space.body))
            {
                let vertices = [p, half_space.vertex];
                let distance = half_space.distance::<D>(self.x, p);
                let [dp, d_o] = rows::<D, 2>(self.dx, &vertices);
                let mut away = dp;
                (0..D).for_each(|k| away[k] -= d_o[k]);
                let motion = along_normal(&half_space.normal, &away);
                let law = model.law(p, half_space.vertex);
                if distance + motion.min(0.0) > law.barrier.reach + law.barrier.offset {
                    continue;
                }
                let part = safe_step_to_half_space(distance, motion, &gap(law), 1.0);
                if part < 1.0 {
                    let primitives = [vec![p], vec![half_space.vertex]];
                    least = nearest(least, Some(Obstruction { part, primitives }));
                }
            }
        }
        least
    }

    fn balls<const D: usize>(&self, model: &ContactModel) -> Option<Obstruction> {
        let mut least = None;
        for ball in &model.balls {
            let centre = Bounds::<D>::of_vertices(&[ball.vertex], self.x, Some((self.dx, &[0.0; D])));
            let meets = |vertices: &[u32]| {
                let barrier = &model.law(vertices[0], ball.vertex).barrier;
                let reached = Bounds::<D>::of_vertices(vertices, self.x, Some((self.dx, &[0.0; D])));
                // Tolerance for the rounding of distances.
                let near = reached.squared_distance(&centre) <= barrier.squared_reach() * (1.0 + 1e-9);
                near && model.touch(model.body(vertices[0]), ball.body)
            };
            let surface = &model.surface;
            let at = |part: f64, vertices: &[u32]| {
                Some(Obstruction { part, primitives: [vertices.to_vec(), vec![ball.vertex]] })
            };
            // Triangles.
            let ways = (self.x, Some(self.dx));
            let near = near_box::<D, 3>(&surface.triangles, ways, &centre, model.squared_reach_of(ball));
            let touches = |t: &u32| model.touch(model.body(surface.triangles[*t as usize][0]), ball.body);
            let near: Vec<_> = near.into_iter().filter(touches).map(|t| [ball.vertex, t]).collect();
            let of_triangle = |[ball, t]: [u32; 2]| {
                let [a, b, c] = surface.triangles[t as usize];
                [ball, a, b, c]
            };
            let first = self.least::<PointTriangle, 3, 4>(model, &near, of_triangle);
            let triangle = |i: usize| &surface.triangles[near[i][1] as usize];
            least = nearest(least, first.and_then(|(part, i)| at(part, triangle(i))));
            // Lone edges.
            let edge = |e: u32| surface.edges[e as usize];
            let near: Vec<_> =
                surface.lone_edges().filter(|e| meets(&edge(*e))).map(|e| [ball.vertex, e]).collect();
            let of_edge = |[ball, e]: [u32; 2]| {
                let [a, b] = edge(e);
                [ball, a, b]
            };
            let first = self.least::<PointEdge, D, 3>(model, &near, of_edge);
            least = nearest(least, first.and_then(|(part, i)| at(part, &edge(near[i][1]))));
            // Particles.
            let particles = surface.particles.iter().filter(|p| meets(&[**p]));
            let near: Vec<_> = particles.map(|p| [ball.vertex, *p]).collect();
            let first = self.least::<PointPoint, D, 2>(model, &near, |pair| pair);
            least = nearest(least, first.and_then(|(part, i)| at(part, &near[i][1..])));
        }
        least
    }
}

/// Fraction of the motion from `x` to `x + dx` after which two primitives are closer than `limit`, or
/// than both ends of the path allow; 1 if they never are. A motion that cannot be shown to be free counts
/// as crossing.
fn crossing<K: Primitives<D, N>, const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    dx: &[[f64; D]; N],
    limit: &GapLimit,
) -> f64 {
    let (mut at, mut rest, mut time) = (*x, *dx, 0.0);
    let mut to = *x;
    for i in 0..N {
        (0..D).for_each(|k| to[i][k] += dx[i][k]);
    }
    let [start, end] = [x, &to].map(|x| K::closest(x).squared_distance.sqrt());
    let offset = limit.offset.min(CORE * start.min(end));
    let near = offset + limit.reach.min(end - offset);
    for _ in 0..CONTINUATIONS {
        let gap = GapLimit { reach: near - offset, offset };
        let part = safe_step::<K, f64, D, N>(&at, &rest, &gap, 1.0).time;
        if part >= 1.0 {
            return 1.0;
        }
        for i in 0..N {
            for k in 0..D {
                at[i][k] += part * rest[i][k];
                rest[i][k] *= 1.0 - part;
            }
        }
        time += (1.0 - time) * part;
        if part == 0.0 || K::closest(&at).squared_distance < near * near {
            return time;
        }
    }
    time
}

/// Smallest fraction below 1, the first of equal ones.
fn smallest(parts: impl Iterator<Item = (f64, usize)>) -> Option<(f64, usize)> {
    let below = parts.filter(|(part, _)| *part < 1.0);
    below.reduce(|least, next| if next.0 < least.0 { next } else { least })
}

/// Collision detection of pairs of one law on a path, pack by pack.
struct Collisions<'a, K, const D: usize, const N: usize> {
    way: Way<'a>,
    /// Pairs that may meet, with their indices.
    near: &'a [(usize, [u32; N])],
    gap: GapLimit,
    /// Output: the free fraction of each pair.
    parts: &'a mut Vec<f64>,
    of: PhantomData<K>,
}

impl<K: Primitives<D, N>, const D: usize, const N: usize> Kernel for Collisions<'_, K, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for pack in self.near.chunks(WIDTH) {
            let (pairs, mut vertices) = (filled(pack), [[0; N]; WIDTH]);
            for lane in 0..WIDTH {
                (_, vertices[lane]) = pairs[lane];
            }
            let (x, dx) = (load_rows(self.way.x, &vertices), load_rows(self.way.dx, &vertices));
            let time = safe_step::<K, L, D, N>(&x, &dx, &self.gap, L::splat(1.0)).time;
            let mut parts = [0.0; WIDTH];
            time.store(&mut parts);
            self.parts.extend_from_slice(&parts[..pack.len()]);
        }
    }
}

fn gap(law: &ContactLaw) -> GapLimit {
    GapLimit { reach: law.barrier.reach, offset: law.barrier.offset }
}

/// Limit below which a pair has crossed: barriers keep all of the radii free, but not along the straight
/// path.
fn passed(law: &ContactLaw) -> GapLimit {
    let ContactLaw { barrier, .. } = law;
    let core = if barrier.form == PotentialForm::Barrier { CORE * barrier.offset } else { 0.0 };
    GapLimit { reach: CROSSED * barrier.reach, offset: core }
}

/// The obstruction with the smaller free fraction, the first if equal.
fn nearest(a: Option<Obstruction>, b: Option<Obstruction>) -> Option<Obstruction> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.part < a.part { b } else { a }),
        (a, b) => a.or(b),
    }
}
