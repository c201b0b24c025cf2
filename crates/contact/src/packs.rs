//! Pairs of one kind, a pack at a time. Every one has the bits that it has by itself.

use std::marker::PhantomData;

use pliant::lanes::{Kernel, Lanes, WIDTH, dispatch};

use crate::closest::Primitives;
use crate::contacts::PlaneGeometry;
use crate::merge::{MollifiedPair, WeightedPair};
use crate::model::{ContactLaw, ContactModel};
use crate::pair::{PairGeometry, PairKind};

/// Numbers of every vertex of a pack of pairs, lane by lane.
pub(crate) type PackRows<const D: usize, const N: usize> = [[[f64; WIDTH]; D]; N];

/// Something to be done with contacts, with those of pairs a pack at a time.
pub(crate) trait PackVisitor<const D: usize> {
    /// Pairs whose closest points lie inside of both primitives, of one kind and one law: as many lanes as
    /// there are `pairs`, the last of which fills the rest up.
    fn pack<L: Lanes, const N: usize, const P: usize>(
        &mut self,
        pairs: &[WeightedPair<N>],
        geometry: &PairGeometry<L, D, N, P>,
        law: &ContactLaw,
        weight: L,
    );

    /// A vertex at a half-space, and the half-space's.
    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64);

    /// Nearly parallel edges at the positions `x`; in space.
    fn mollified(&mut self, pair: &MollifiedPair, x: &[[f64; 3]; 4], law: &ContactLaw);
}

/// Rows of `x`, flat `(n, D)`, of the vertices of a pack.
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

/// The lanes of the rows of every vertex.
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

/// Shows pairs at the positions `x`, flat `(n, D)` [m].
pub(crate) fn visit_pairs<K: PairKind<N, P>, const D: usize, const N: usize, const P: usize>(
    model: &ContactModel,
    x: &[f64],
    pairs: &[WeightedPair<N>],
    visitor: &mut impl PackVisitor<D>,
) {
    let bodies = |pair: &WeightedPair<N>| [pair.vertices[0], pair.vertices[N - 1]].map(|v| model.body(v));
    for pairs in pairs.chunk_by(|a, b| bodies(a) == bodies(b)) {
        let [a, b] = bodies(&pairs[0]);
        visit_pairs_of_law::<K, D, N, P>(model.laws.of(a, b), x, pairs, visitor);
    }
}

/// The same of pairs of one law.
pub(crate) fn visit_pairs_of_law<K: PairKind<N, P>, const D: usize, const N: usize, const P: usize>(
    law: &ContactLaw,
    x: &[f64],
    pairs: &[WeightedPair<N>],
    visitor: &mut impl PackVisitor<D>,
) {
    dispatch(PairVisit { pairs, x, law, visitor, kind: PhantomData::<K> });
}

/// Visit of pairs of one law.
struct PairVisit<'a, V, K, const D: usize, const N: usize, const P: usize> {
    pairs: &'a [WeightedPair<N>],
    x: &'a [f64],
    law: &'a ContactLaw,
    visitor: &'a mut V,
    kind: PhantomData<K>,
}

impl<V: PackVisitor<D>, K: PairKind<N, P>, const D: usize, const N: usize, const P: usize> Kernel
    for PairVisit<'_, V, K, D, N, P>
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for pack in self.pairs.chunks(WIDTH) {
            let (mut vertices, mut weights) = ([[0; N]; WIDTH], [0.0; WIDTH]);
            for lane in 0..WIDTH {
                let pair = &pack[lane.min(pack.len() - 1)];
                (vertices[lane], weights[lane]) = (pair.vertices, pair.weight);
            }
            let x = load_rows::<L, D, N>(self.x, &vertices);
            let geometry = PairGeometry::of::<K>(&x);
            self.visitor.pack(pack, &geometry, self.law, L::load(&weights));
        }
    }
}

/// Coefficients of closest points, and their squared distance [m^2].
pub(crate) type ClosestOfPair<const N: usize> = ([f64; N], f64);

/// Closest points of pairs of primitives by their vertices, at the positions `x`, flat `(n, D)` [m].
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
            let mut vertices = [pack[pack.len() - 1]; WIDTH];
            vertices[..pack.len()].copy_from_slice(pack);
            let closest = K::closest(&load_rows::<L, D, N>(self.x, &vertices));
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
