//! SIMD packs of pairs of primitives: positions, closest points, quick tests. Each pair has the same bits as
//! by itself.

use std::marker::PhantomData;

use pliant::lanes::{Kernel, Lanes, WIDTH, dispatch};

use crate::broad_phase::Bounds;
use crate::closest::Primitives;
use crate::vector::{are_apart, are_apart_across, smaller, stay_apart, stay_apart_across};

/// Values for every vertex of a pack of pairs, lane by lane.
pub(crate) type PackRows<const D: usize, const N: usize> = [[[f64; WIDTH]; D]; N];

/// Pack of a few items, padded with the last one.
#[inline(always)]
pub(crate) fn filled<T: Copy>(few: &[T]) -> [T; WIDTH] {
    let mut pack = [few[few.len() - 1]; WIDTH];
    pack[..few.len()].copy_from_slice(few);
    pack
}

/// Loads the rows of `x`, flat `(n, D)`, of the vertices of a pack.
#[inline(always)]
pub(crate) fn load_rows<L: Lanes, const D: usize, const N: usize>(
    x: &[f64],
    vertices: &[[u32; N]; WIDTH],
) -> [[L; D]; N] {
    let mut columns: PackRows<D, N> = [[[0.0; WIDTH]; D]; N];
    for lane in 0..WIDTH {
        for n in 0..N {
            let row = &x[vertices[lane][n] as usize * D..][..D];
            for k in 0..D {
                columns[n][k][lane] = row[k];
            }
        }
    }
    let mut rows = [[L::zero(); D]; N];
    for n in 0..N {
        for k in 0..D {
            rows[n][k] = L::load(&columns[n][k]);
        }
    }
    rows
}

/// Stores rows lane by lane.
#[inline(always)]
pub(crate) fn store_rows<L: Lanes, const D: usize, const N: usize>(rows: &[[L; D]; N]) -> PackRows<D, N> {
    let mut columns = [[[0.0; WIDTH]; D]; N];
    for n in 0..N {
        for k in 0..D {
            rows[n][k].store(&mut columns[n][k]);
        }
    }
    columns
}

/// Coefficients of closest points, and their squared distance [m^2].
pub(crate) type ClosestOfPair<const N: usize> = ([f64; N], f64);

/// Closest points of pairs of primitives, given by vertices, at the positions `x`, flat `(n, D)` [m].
pub(crate) fn closest_points<K: Primitives<D, N>, const D: usize, const N: usize>(
    x: &[f64],
    pairs: &[[u32; N]],
) -> Vec<ClosestOfPair<N>> {
    let mut found = Vec::with_capacity(pairs.len());
    dispatch(ClosestPointsKernel { pairs, x, found: &mut found, kind: PhantomData::<K> });
    found
}

struct ClosestPointsKernel<'a, K, const D: usize, const N: usize> {
    pairs: &'a [[u32; N]],
    x: &'a [f64],
    found: &'a mut Vec<ClosestOfPair<N>>,
    kind: PhantomData<K>,
}

impl<K: Primitives<D, N>, const D: usize, const N: usize> Kernel for ClosestPointsKernel<'_, K, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for pack in self.pairs.chunks(WIDTH) {
            let closest = K::closest(&load_rows::<L, D, N>(self.x, &filled(pack)));
            let squared_distance = closest.squared_distance.to_array();
            let mut coefficients = [[0.0; WIDTH]; N];
            for n in 0..N {
                closest.coefficients[n].store(&mut coefficients[n]);
            }
            for lane in 0..pack.len() {
                let mut own = [0.0; N];
                for n in 0..N {
                    own[n] = coefficients[n][lane];
                }
                self.found.push((own, squared_distance[lane]));
            }
        }
    }
}

/// Indices of the primitives whose boxes are closer to `query` than the root of `squared_reach` [m^2],
/// ascending. With `dx`, boxes enclose the paths from `x` to `x + dx`, flat `(n, D)` [m].
pub(crate) fn near_box<const D: usize, const N: usize>(
    primitives: &[[u32; N]],
    (x, dx): (&[f64], Option<&[f64]>),
    query: &Bounds<D>,
    squared_reach: f64,
) -> Vec<u32> {
    let mut found = vec![];
    dispatch(NearBoxKernel { primitives, x, dx, query, squared_reach, found: &mut found });
    found
}

struct NearBoxKernel<'a, const D: usize, const N: usize> {
    primitives: &'a [[u32; N]],
    x: &'a [f64],
    dx: Option<&'a [f64]>,
    query: &'a Bounds<D>,
    squared_reach: f64,
    found: &'a mut Vec<u32>,
}

impl<const D: usize, const N: usize> Kernel for NearBoxKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let reach = L::splat(self.squared_reach);
        let mut first = 0;
        for pack in self.primitives.chunks(WIDTH) {
            // Boxes of a pack of primitives, including end positions.
            let vertices = filled(pack);
            let from = load_rows::<L, D, N>(self.x, &vertices);
            let (mut low, mut high) = (from[0], from[0]);
            for n in 1..N {
                for k in 0..D {
                    (low[k], high[k]) = (smaller(from[n][k], low[k]), high[k].max(from[n][k]));
                }
            }
            if let Some(dx) = self.dx {
                let way = load_rows::<L, D, N>(dx, &vertices);
                for n in 0..N {
                    for k in 0..D {
                        let to = from[n][k] + way[n][k];
                        (low[k], high[k]) = (smaller(to, low[k]), high[k].max(to));
                    }
                }
            }
            // Squared distances to the query.
            let mut squared = L::zero();
            for k in 0..D {
                let below = L::splat(self.query.low[k]) - high[k];
                let along = below.max(low[k] - L::splat(self.query.high[k])).max(L::zero());
                squared = along.mul_add(along, squared);
            }
            let near = L::mask_to_bits(squared.lt(reach));
            for lane in 0..pack.len() as u32 {
                if near >> lane & 1 == 1 {
                    self.found.push(first + lane);
                }
            }
            first += WIDTH as u32;
        }
    }
}

/// Selection of quick tests that drop pairs which do not come near.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Screen {
    /// Compare boxes.
    pub(crate) boxes: bool,
    /// Project on the direction between the means of both primitives.
    pub(crate) across: bool,
    /// Compare motions: vertices that move as one never meet.
    pub(crate) motion: bool,
}

/// Marks pairs, given by vertices, that may come near. False if a test shows a pair to be farther apart
/// than `reach` [m] at `x`, or on the whole path to `x + dx`, flat `(n, D)` [m].
pub(crate) fn screen<K: Primitives<D, N>, const D: usize, const N: usize>(
    pairs: &[[u32; N]],
    (x, dx): (&[f64], Option<&[f64]>),
    reach: impl Fn(&[u32; N]) -> f64,
    by: Screen,
) -> Vec<bool> {
    let reach: Vec<f64> = pairs.iter().map(reach).collect();
    let mut kept = Vec::with_capacity(pairs.len());
    dispatch(ScreenKernel { pairs, x, dx, reach: &reach, by, kept: &mut kept, kind: PhantomData::<K> });
    kept
}

struct ScreenKernel<'a, K, const D: usize, const N: usize> {
    pairs: &'a [[u32; N]],
    x: &'a [f64],
    dx: Option<&'a [f64]>,
    reach: &'a [f64],
    by: Screen,
    kept: &'a mut Vec<bool>,
    kind: PhantomData<K>,
}

impl<K: Primitives<D, N>, const D: usize, const N: usize> Kernel for ScreenKernel<'_, K, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (pack, own) in self.pairs.chunks(WIDTH).zip(self.reach.chunks(WIDTH)) {
            let vertices = filled(pack);
            let (x, reach) = (load_rows::<L, D, N>(self.x, &vertices), L::load(&filled(own)));
            let mut apart = 0;
            if let Some(dx) = self.dx {
                let dx = load_rows::<L, D, N>(dx, &vertices);
                if self.by.motion {
                    let mut motion = L::zero();
                    for i in 1..N {
                        for k in 0..D {
                            motion = motion.max((dx[i][k] - dx[0][k]).abs());
                        }
                    }
                    apart |= !L::mask_to_bits(L::zero().lt(motion));
                }
                if self.by.boxes {
                    apart |= L::mask_to_bits(stay_apart(&x, &dx, K::FIRST, reach));
                }
                if self.by.across {
                    apart |= L::mask_to_bits(stay_apart_across(&x, &dx, K::FIRST, reach));
                }
            } else {
                if self.by.boxes {
                    apart |= L::mask_to_bits(are_apart(&x, K::FIRST, reach));
                }
                if self.by.across {
                    apart |= L::mask_to_bits(are_apart_across(&x, K::FIRST, reach));
                }
            }
            for lane in 0..pack.len() {
                self.kept.push(apart >> lane & 1 == 0);
            }
        }
    }
}
