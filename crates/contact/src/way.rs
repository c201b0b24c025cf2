//! How far all vertices may go along straight ways before anything touches.

use rayon::prelude::*;

use crate::broad_phase::Bounds;
use crate::candidates::CandidatePairs;
use crate::ccd::{GapLimit, safe_step, safe_step_to_half_space};
use crate::closest::Primitives;
use crate::contacts::{along_normal, rows};
use crate::model::{ContactLaw, ContactModel};
use crate::pair::{EdgeEdge, PointEdge, PointPoint, PointTriangle};
use crate::vector::{stay_apart, stay_apart_across};

/// Pairs that one task looks at.
const TASK: usize = 512;

/// Where a way ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WayEnd {
    /// Where a tenth of a gap is left.
    Gap,
    /// Where primitives without an inside pass through each other; half-spaces have one.
    Crossing,
}

/// Motion of all vertices from `x` to `x + dx`, flat `(n, D)` [m].
#[derive(Clone, Copy)]
pub(crate) struct Way<'a> {
    pub(crate) x: &'a [f64],
    pub(crate) dx: &'a [f64],
    pub(crate) ends: WayEnd,
}

/// What comes nearer than this part of the reach has crossed.
const CROSSED: f64 = 1e-6;
/// How often a search that has ended on the way is taken up again.
const CONTINUATIONS: usize = 10;

/// Two primitives by their vertices, and the part of a motion that they leave free.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Obstruction {
    pub(crate) part: f64,
    /// Vertices of the first primitive, and of the second.
    pub(crate) primitives: [Vec<u32>; 2],
}

/// Part of the straight ways of all vertices from `x` to `x + dx`, flat `(n, D)` [m], that these pairs,
/// half-spaces and balls leave free: to where a tenth to a twentieth of a gap is left.
pub fn free_part<const D: usize>(
    model: &ContactModel,
    pairs: &CandidatePairs,
    (x, dx): (&[f64], &[f64]),
) -> f64 {
    Way { x, dx, ends: WayEnd::Gap }.first::<D>(model, pairs).map_or(1.0, |first| first.part)
}

impl Way<'_> {
    /// Obstruction that leaves the least of the way free; `None` where all of it is. The same for any number
    /// of threads.
    pub(crate) fn first<const D: usize>(
        &self,
        model: &ContactModel,
        pairs: &CandidatePairs,
    ) -> Option<Obstruction> {
        let surface = &model.surface;
        let edge = |e: u32| surface.edges[e as usize];
        let of_points = |&[p, q]: &[u32; 2]| self.pair::<PointPoint, D, 2>(model, [p, q]);
        let at_point = least(&pairs.point_point, of_points).map(|(part, i)| {
            let [p, q] = pairs.point_point[i];
            Obstruction { part, primitives: [vec![p], vec![q]] }
        });
        let of_edge = |&[p, e]: &[u32; 2]| {
            let [a, b] = edge(e);
            self.pair::<PointEdge, D, 3>(model, [p, a, b])
        };
        let at_lone_edge = least(&pairs.point_edge, of_edge).map(|(part, i)| {
            let [p, e] = pairs.point_edge[i];
            Obstruction { part, primitives: [vec![p], edge(e).to_vec()] }
        });
        let mut by_pairs = nearest(at_point, at_lone_edge);
        if D == 3 {
            let of_triangle = |&[p, t]: &[u32; 2]| {
                let [a, b, c] = surface.triangles[t as usize];
                self.pair::<PointTriangle, 3, 4>(model, [p, a, b, c])
            };
            let of_edges = |&[e, f]: &[u32; 2]| {
                let ([a, b], [c, d]) = (edge(e), edge(f));
                self.pair::<EdgeEdge, 3, 4>(model, [a, b, c, d])
            };
            let at_triangle = least(&pairs.point_triangle, of_triangle).map(|(part, i)| {
                let [p, t] = pairs.point_triangle[i];
                Obstruction { part, primitives: [vec![p], surface.triangles[t as usize].to_vec()] }
            });
            let at_edge = least(&pairs.edge_edge, of_edges).map(|(part, i)| {
                let [e, f] = pairs.edge_edge[i];
                Obstruction { part, primitives: [edge(e).to_vec(), edge(f).to_vec()] }
            });
            by_pairs = nearest(by_pairs, nearest(at_triangle, at_edge));
        }
        nearest(nearest(by_pairs, self.planes::<D>(model)), self.balls::<D>(model))
    }

    fn pair<K: Primitives<D, N>, const D: usize, const N: usize>(
        &self,
        model: &ContactModel,
        vertices: [u32; N],
    ) -> f64 {
        let dx = rows::<D, N>(self.dx, &vertices);
        // What moves as one never meets.
        if dx.iter().all(|d| *d == dx[0]) {
            return 1.0;
        }
        let law = model.law(vertices[0], vertices[N - 1]);
        let x = rows::<D, N>(self.x, &vertices);
        if self.ends == WayEnd::Crossing {
            let near = CROSSED * law.barrier.reach;
            return if stay_apart(&x, &dx, K::FIRST, near) {
                1.0
            } else {
                crossing::<K, D, N>(&x, &dx, near)
            };
        }
        let near = law.barrier.reach + law.barrier.offset;
        if stay_apart(&x, &dx, K::FIRST, near) || stay_apart_across(&x, &dx, K::FIRST, near) {
            return 1.0;
        }
        safe_step::<K, f64, D, N>(&x, &dx, &gap(law), 1.0).time
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
                let reached = Bounds::<D>::of_vertices(vertices, self.x, Some((self.dx, &[0.0; D])))
                    .grown(barrier.reach + barrier.offset);
                model.touch(model.body(vertices[0]), ball.body) && reached.meets(&centre)
            };
            let mut stop = |part: f64, vertices: &[u32]| {
                if part < 1.0 {
                    let primitives = [vertices.to_vec(), vec![ball.vertex]];
                    least = nearest(least.take(), Some(Obstruction { part, primitives }));
                }
            };
            let surface = &model.surface;
            for &[a, b, c] in surface.triangles.iter().filter(|t| meets(*t)) {
                stop(self.pair::<PointTriangle, 3, 4>(model, [ball.vertex, a, b, c]), &[a, b, c]);
            }
            for [a, b] in surface.lone_edges().map(|e| surface.edges[e as usize]).filter(|e| meets(e)) {
                stop(self.pair::<PointEdge, D, 3>(model, [ball.vertex, a, b]), &[a, b]);
            }
            for &p in surface.particles.iter().filter(|p| meets(&[**p])) {
                stop(self.pair::<PointPoint, D, 2>(model, [ball.vertex, p]), &[p]);
            }
        }
        least
    }
}

/// The part of the motion from `x` to `x + dx` after which two primitives are nearer than `near` [m]; 1 where
/// they never are. One that cannot be shown to be free counts as not free.
fn crossing<K: Primitives<D, N>, const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    dx: &[[f64; D]; N],
    near: f64,
) -> f64 {
    let (mut at, mut rest, mut time) = (*x, *dx, 0.0);
    for _ in 0..CONTINUATIONS {
        let part = safe_step::<K, f64, D, N>(&at, &rest, &GapLimit { reach: near, offset: 0.0 }, 1.0).time;
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

/// The least part below 1 over all pairs and the number of the pair, the first of those that are equal.
fn least<T: Sync>(pairs: &[T], part: impl Fn(&T) -> f64 + Sync) -> Option<(f64, usize)> {
    let smaller = |a: Option<(f64, usize)>, b: (f64, usize)| match a {
        Some(a) if a.0 <= b.0 => Some(a),
        _ => Some(b),
    };
    let of_task = |(task, pairs): (usize, &[T])| {
        let parts = pairs.iter().enumerate().map(|(i, pair)| (part(pair), task * TASK + i));
        parts.filter(|(part, _)| *part < 1.0).fold(None, smaller)
    };
    let tasks: Vec<_> = pairs.par_chunks(TASK).enumerate().map(of_task).collect();
    tasks.into_iter().flatten().fold(None, smaller)
}

fn gap(law: &ContactLaw) -> GapLimit {
    GapLimit { reach: law.barrier.reach, offset: law.barrier.offset }
}

/// The one that leaves less, the first where they are equal.
fn nearest(a: Option<Obstruction>, b: Option<Obstruction>) -> Option<Obstruction> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.part < a.part { b } else { a }),
        (a, b) => a.or(b),
    }
}
