//! A chain of interlinked rings, and the linking number of closed curves by Gauss's integral.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Rings of square section, each at a right angle to the one above.
pub(crate) struct LinkedRings {
    pub(crate) links: usize,
    /// Number of cells along a ring, and along each side of its section.
    pub(crate) cells: [usize; 2],
}

/// Radius of a ring's centre line, side of its section, distance of ring centres [m].
const RADIUS: f64 = 0.1;
const SIDE: f64 = 0.03;
const PITCH: f64 = 0.15;

impl LinkedRings {
    /// Points of a ring about the origin, section by section.
    fn points(&self) -> Vec<[f64; 3]> {
        let [along, across] = self.cells;
        let part = |i: usize| (i as f64 / across as f64 - 0.5) * SIDE;
        let of_section = |s: usize| {
            let (sin, cos) = (TAU * s as f64 / along as f64).sin_cos();
            let places = (0..=across).flat_map(|i| (0..=across).map(move |j| [i, j]));
            places.map(move |[i, j]| [(RADIUS + part(i)) * sin, part(j), (RADIUS + part(i)) * cos])
        };
        (0..along).flat_map(of_section).collect()
    }

    fn vertices_of_section(&self) -> usize {
        (self.cells[1] + 1).pow(2)
    }

    /// Six tetrahedra per cell about its diagonal.
    fn tetrahedra(&self) -> Vec<[usize; 4]> {
        let [along, across] = self.cells;
        let at =
            |s: usize, i: usize, j: usize| (s % along) * self.vertices_of_section() + i * (across + 1) + j;
        let mut all = vec![];
        for s in 0..along {
            for (i, j) in (0..across).flat_map(|i| (0..across).map(move |j| (i, j))) {
                for [a, b, c] in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
                    let mut corner = [0, 0, 0];
                    let mut cell = [at(s, i, j); 4];
                    for (k, axis) in [a, b, c].into_iter().enumerate() {
                        corner[axis] = 1;
                        cell[k + 1] = at(s + corner[0], i + corner[1], j + corner[2]);
                    }
                    // The axes along, out and across are left-handed: even permutations of them are
                    // mirrored.
                    if (b + 3 - a) % 3 == 1 {
                        cell.swap(2, 3);
                    }
                    all.push(cell);
                }
            }
        }
        all
    }

    /// Scene; the highest link is fixed.
    pub(crate) fn text(&self, contact: &str) -> String {
        let tetrahedra = format!("{:?}", self.tetrahedra());
        let mut text = format!(
            "dimension = 3\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 100.0 }}\n\
             world = {{ gravity = [0, 0, -9.81] }}\n{contact}\n"
        );
        for k in 0..self.links {
            let turned = |[x, y, z]: [f64; 3]| if k % 2 == 0 { [x, y, z] } else { [-y, x, z] };
            let down = PITCH * k as f64;
            let points: Vec<[f64; 3]> =
                self.points().into_iter().map(turned).map(|[x, y, z]| [x, y, z - down]).collect();
            let pin = if k == 0 { "pin = [{ box = { min = [-1, -1, 0.06], max = [1, 1, 1] } }]" } else { "" };
            let _ = write!(
                text,
                "[[body]]\nname = 'link{k}'\n\
                 mesh = {{ inline = {{ points = {points:?}, tetrahedra = {tetrahedra} }} }}\n\
                 elastic = {{ neo-hookean = {{ young = 1e7, poisson = 0.3 }} }}\nmass = {{ density = 1000 \
                 }}\n{pin}\n"
            );
        }
        text
    }

    /// Centre line of a link, from the positions of all vertices, flat [m].
    fn middle(&self, x: &[f64], link: usize) -> Vec<[f64; 3]> {
        let count = self.vertices_of_section();
        let numbers = 3 * count * self.cells[0];
        let mean = |section: &[f64]| {
            let mut sum = [0.0; 3];
            section.chunks(3).for_each(|p| (0..3).for_each(|k| sum[k] += p[k] / count as f64));
            sum
        };
        x[numbers * link..numbers * (link + 1)].chunks(3 * count).map(mean).collect()
    }

    /// Linking numbers of neighbouring links, at the positions `x`, flat [m].
    pub(crate) fn linking(&self, x: &[f64]) -> Vec<f64> {
        let lines: Vec<_> = (0..self.links).map(|k| self.middle(x, k)).collect();
        lines.windows(2).map(|pair| linking_number(&pair[0], &pair[1])).collect()
    }

    /// Height difference between the lowest link and that of a taut chain, relative to the length of the
    /// taut chain below the highest link.
    pub(crate) fn slack(&self, x: &[f64]) -> f64 {
        let taut = (2.0 * RADIUS - SIDE) * (self.links - 1) as f64;
        let lowest = self.middle(x, self.links - 1);
        let height = lowest.iter().map(|p| p[2]).sum::<f64>() / lowest.len() as f64;
        (height + taut).abs() / taut
    }
}

/// Gauss's integral of two closed polygons, exact for straight edges: the sum of the solid angles of
/// pairs of edges over `4 pi` (Klenin, Langowski 2000, *Computation of writhe in modeling of supercoiled
/// DNA*, Biopolymers 54, 307-317).
pub(crate) fn linking_number(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let minus = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| a[k] - b[k]);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let unit = |a: [f64; 3]| {
        let length = dot(a, a).sqrt();
        a.map(|a| if length > 0.0 { a / length } else { 0.0 })
    };
    let mut sum = 0.0;
    for i in 0..a.len() {
        for j in 0..b.len() {
            let (p, q) = (a[i], a[(i + 1) % a.len()]);
            let (r, s) = (b[j], b[(j + 1) % b.len()]);
            let [pr, ps, qr, qs] = [minus(r, p), minus(s, p), minus(r, q), minus(s, q)];
            let normals = [cross(pr, ps), cross(ps, qs), cross(qs, qr), cross(qr, pr)].map(unit);
            let angles = (0..4).map(|k| dot(normals[k], normals[(k + 1) % 4]).clamp(-1.0, 1.0).asin());
            let side = dot(cross(minus(s, r), minus(q, p)), pr);
            if side != 0.0 {
                sum += angles.sum::<f64>() * side.signum();
            }
        }
    }
    sum / (4.0 * PI)
}
