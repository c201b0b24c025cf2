//! Isosurface stuffing: tetrahedra that fill a closed surface, with boundary vertices on it.
//!
//! Source: F. Labelle and J. R. Shewchuk, Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral
//! Angles, ACM Transactions on Graphics 26 (3), 2007. Edges of a body-centred cubic lattice are cut where the
//! surface crosses them. A lattice point close to a cut is moved to it. The remainder of each tetrahedron is
//! one of a few stencils. All dihedral angles are between 10.78 and 164.74 degrees for any surface.

use std::collections::HashMap;

use rayon::prelude::*;

use super::closed::ClosedSurface;
use super::lattice::CubicLattice;
use crate::geometry::{cross, dot, subtract};

/// Warp threshold: a cut moves a lattice point closer than this fraction of a long edge, or of a short
/// one. These values have the best angles (section 3 there).
const LONG: f64 = 0.24999;
const SHORT: f64 = 0.41189;

/// Position of a lattice point relative to the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LatticeSide {
    Inside,
    On,
    Outside,
}

/// A point where the surface crosses an edge.
struct Cut {
    /// Ends of the edge, the inner one first.
    ends: [u32; 2],
    is_long: bool,
    /// Fraction of the edge from its inner end.
    share: f64,
    place: [f64; 3],
}

/// Corner of a tetrahedron: a lattice point, or a cut, numbered after all lattice points.
type StencilCorner = u32;

/// Tetrahedra with corners numbered from 0, and the positions of these [m].
pub(super) struct Stuffing {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) tetrahedra: Vec<[u32; 4]>,
}

/// Fills a surface; `inside` marks the inner lattice points.
pub(super) fn stuff(surface: &ClosedSurface, lattice: &CubicLattice, inside: &[bool]) -> Stuffing {
    let cuts = cuts(surface, lattice, inside);
    let place = |is_inside: &bool| if *is_inside { LatticeSide::Inside } else { LatticeSide::Outside };
    let mut stencils = StuffedCells {
        lattice,
        places: inside.iter().map(place).collect(),
        moved: HashMap::new(),
        of_edge: cuts.iter().zip(0..).map(|(cut, i)| (cut.ends, i)).collect(),
        cuts: &cuts,
        cells: vec![],
    };
    stencils.warp();
    lattice.for_each_tetrahedron(|cell| stencils.add(cell));
    stencils.numbered()
}

/// Cuts all edges between inside and outside.
fn cuts(surface: &ClosedSurface, lattice: &CubicLattice, inside: &[bool]) -> Vec<Cut> {
    let mut edges = vec![];
    lattice.for_each_edge(|[a, b], is_long| match (inside[a as usize], inside[b as usize]) {
        (true, false) => edges.push(([a, b], is_long)),
        (false, true) => edges.push(([b, a], is_long)),
        _ => {}
    });
    let cut = |&(ends, is_long): &([u32; 2], bool)| {
        let [inner, outer] = ends.map(|point| lattice.place(point));
        // Winding numbers and intersections are exact, so that the edge must cross the surface.
        let share = surface.exit(&inner, &outer).expect("a closed surface lies between inside and outside");
        let place = [0, 1, 2].map(|c| inner[c] + share * (outer[c] - inner[c]));
        Cut { ends, is_long, share, place }
    };
    edges.par_iter().map(cut).collect()
}

/// Tetrahedra made so far.
struct StuffedCells<'a> {
    lattice: &'a CubicLattice,
    places: Vec<LatticeSide>,
    /// Moved lattice points, each with its cut.
    moved: HashMap<u32, u32>,
    of_edge: HashMap<[u32; 2], u32>,
    cuts: &'a [Cut],
    cells: Vec<[StencilCorner; 4]>,
}

impl StuffedCells<'_> {
    /// Moves each lattice point with a close cut to that cut, the nearest of several.
    fn warp(&mut self) {
        let mut nearest: HashMap<u32, (f64, u32)> = HashMap::new();
        for (cut, number) in self.cuts.iter().zip(0..) {
            let (least, length) = if cut.is_long { (LONG, 1.0) } else { (SHORT, 0.75_f64.sqrt()) };
            for (end, share) in [(cut.ends[0], cut.share), (cut.ends[1], 1.0 - cut.share)] {
                let found = nearest.get(&end).is_none_or(|(distance, _)| share * length < *distance);
                if share < least && found {
                    nearest.insert(end, (share * length, number));
                }
            }
        }
        for (point, (_, cut)) in nearest {
            self.places[point as usize] = LatticeSide::On;
            self.moved.insert(point, cut);
        }
    }

    /// Adds the inner part of a lattice tetrahedron.
    fn add(&mut self, cell: [u32; 4]) {
        let places = &self.places;
        let of = |place: LatticeSide| -> Vec<u32> {
            cell.into_iter().filter(|point| places[*point as usize] == place).collect()
        };
        let (inner, outer) = (of(LatticeSide::Inside), of(LatticeSide::Outside));
        match (&inner[..], &outer[..]) {
            ([], _) => {}
            (_, []) => self.push(cell),
            // One inner point: the tetrahedron is shortened to its cuts.
            ([a], _) => {
                let corner = |point: u32| if outer.contains(&point) { self.cut(*a, point) } else { point };
                let corners = cell.map(corner);
                self.push(corners);
            }
            // Two inner points, one outer and one on the surface: a pyramid, split in two.
            (&[a, b], &[out]) => {
                let Some(on) = cell.into_iter().find(|point| ![a, b, out].contains(point)) else { return };
                let (cut_a, cut_b) = (self.cut(a, out), self.cut(b, out));
                let (from, to, other, beside) =
                    if self.goes_from_first(a, b, out) { (a, cut_b, b, cut_a) } else { (b, cut_a, a, cut_b) };
                self.push([on, from, to, other]);
                self.push([on, from, to, beside]);
            }
            // Three inner points: a wedge.
            (&[a, b, c], &[out]) => {
                let upper = [a, b, c].map(|point| self.cut(point, out));
                let from_lower = |i: usize, j: usize| self.goes_from_first(inner[i], inner[j], out);
                let diagonals = [from_lower(0, 1), from_lower(1, 2), from_lower(2, 0)];
                self.push_wedge([a, b, c], upper, diagonals);
            }
            // Two inner and two outer points: a wedge between the inner ends.
            (&[a, b], &[first, second]) => {
                let lower = [a, self.cut(a, first), self.cut(a, second)];
                let upper = [b, self.cut(b, first), self.cut(b, second)];
                let (to_first, from_second) =
                    (self.goes_from_first(a, b, first), !self.goes_from_first(a, b, second));
                // Between the cuts the shorter diagonal is chosen if both leave a wedge of tetrahedra.
                let length = |x: StencilCorner, y: StencilCorner| {
                    let offset = subtract(self.place(x), self.place(y));
                    dot(offset, offset)
                };
                let across = if to_first == from_second {
                    !to_first
                } else {
                    length(lower[1], upper[2]) <= length(lower[2], upper[1])
                };
                self.push_wedge(lower, upper, [to_first, across, from_second]);
            }
            _ => {}
        }
    }

    /// Diagonal of the inner part of the triangle `a`, `b`, `outer`: true if it runs from `a` to the cut
    /// on the opposite side, false if from `b`. Both tetrahedra at the triangle agree: the diagonal ends
    /// at the cut on the long edge; between two short edges it starts from the point with even indices.
    fn goes_from_first(&self, a: u32, b: u32, outer: u32) -> bool {
        let is_long = |point: u32| {
            self.of_edge.get(&[point, outer]).is_some_and(|cut| self.cuts[*cut as usize].is_long)
        };
        match (is_long(a), is_long(b)) {
            (true, _) => false,
            (_, true) => true,
            _ => self.lattice.is_even(a),
        }
    }

    fn cut(&self, inner: u32, outer: u32) -> StencilCorner {
        self.places.len() as u32 + self.of_edge[&[inner, outer]]
    }

    /// Adds the three tetrahedra between two triangles. `diagonals` belong to the quadrilaterals over the
    /// sides 01, 12, 20 of the lower triangle: true if they rise from the side's first corner.
    fn push_wedge(&mut self, lower: [StencilCorner; 3], upper: [StencilCorner; 3], diagonals: [bool; 3]) {
        // At one lower corner the diagonals of both adjacent sides begin.
        let Some(i) = (0..3).find(|&i| diagonals[i] && !diagonals[(i + 2) % 3]) else { return };
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        self.push([lower[i], upper[0], upper[1], upper[2]]);
        let (from, to, other, beside) = if diagonals[j] { (j, k, k, j) } else { (k, j, j, k) };
        self.push([lower[i], lower[from], upper[to], lower[other]]);
        self.push([lower[i], lower[from], upper[to], upper[beside]]);
    }

    fn place(&self, corner: StencilCorner) -> [f64; 3] {
        match (corner as usize).checked_sub(self.places.len()) {
            Some(cut) => self.cuts[cut].place,
            None => match self.moved.get(&corner) {
                Some(cut) => self.cuts[*cut as usize].place,
                None => self.lattice.place(corner),
            },
        }
    }

    /// Adds a right-handed tetrahedron.
    fn push(&mut self, mut cell: [StencilCorner; 4]) {
        let [a, b, c, d] = cell.map(|corner| self.place(corner));
        let [ab, ac, ad] = [b, c, d].map(|x| subtract(x, a));
        if dot(ab, cross(ac, ad)) < 0.0 {
            cell.swap(2, 3);
        }
        self.cells.push(cell);
    }

    /// Numbers the corners from 0, in the order of the cubes.
    fn numbered(self) -> Stuffing {
        let cube = |corner: StencilCorner| match (corner as usize).checked_sub(self.places.len()) {
            Some(cut) => self.lattice.cube_of(self.cuts[cut].ends[0]),
            None => self.lattice.cube_of(corner),
        };
        let mut used: Vec<(usize, StencilCorner)> =
            self.cells.as_flattened().iter().map(|corner| (cube(*corner), *corner)).collect();
        used.par_sort_unstable();
        used.dedup();
        let number: HashMap<StencilCorner, u32> =
            used.iter().zip(0..).map(|((_, corner), i)| (*corner, i)).collect();
        let points = used.iter().map(|(_, corner)| self.place(*corner)).collect();
        let tetrahedra = self.cells.iter().map(|cell| cell.map(|corner| number[&corner])).collect();
        Stuffing { points, tetrahedra }
    }
}
