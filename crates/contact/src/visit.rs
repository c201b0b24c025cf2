//! Operations on contacts: visitors, and loops that hand them pairs one by one or in packs.

use std::marker::PhantomData;

use pliant::lanes::{Kernel, Lanes, WIDTH, dispatch};

use crate::merge::WeightedPair;
use crate::model::{ContactLaw, ContactModel};
use crate::mollifier::MollifiedPair;
use crate::packs::load_rows;
use crate::pair::{PairGeometry, PairKind};
use crate::vector::rows;

/// Geometry of a vertex and the plane of a half-space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneGeometry<const D: usize> {
    /// Unit normal, pointing out of the half-space.
    pub(crate) normal: [f64; D],
    /// `d = n . (x_p - x_o) + s`, negative inside [m].
    pub(crate) distance: f64,
    /// `s`: depth of the plane behind the vertex that carries the half-space [m].
    pub(crate) depth: f64,
}

/// Operation applied to every contact.
pub(crate) trait ContactVisitor<const D: usize> {
    /// Visits a pair whose closest points lie inside both primitives.
    fn pair<const N: usize, const P: usize>(
        &mut self,
        vertices: &[u32; N],
        pair: &PairGeometry<f64, D, N, P>,
        law: &ContactLaw,
        weight: f64,
    );

    /// Visits a vertex at a half-space; `vertices` are its own and the half-space's.
    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64);

    /// Visits nearly parallel edges at the positions `x` (3D).
    fn mollified(&mut self, pair: &MollifiedPair, x: &[[f64; 3]; 4], law: &ContactLaw);
}

/// Operation applied to contacts, one pack of pairs at a time.
pub(crate) trait PackVisitor<const D: usize> {
    /// Visits pairs of one kind and law whose closest points lie inside both primitives. One lane for
    /// each of `pairs`; the last pair fills the remaining lanes.
    fn pack<L: Lanes, const N: usize, const P: usize>(
        &mut self,
        pairs: &[WeightedPair<N>],
        geometry: &PairGeometry<L, D, N, P>,
        law: &ContactLaw,
        weight: L,
    );

    /// Visits a vertex at a half-space; `vertices` are its own and the half-space's.
    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64);

    /// Visits nearly parallel edges at the positions `x` (3D).
    fn mollified(&mut self, pair: &MollifiedPair, x: &[[f64; 3]; 4], law: &ContactLaw);
}

/// Visits pairs at the positions `x`, flat `(n, D)` [m].
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

/// Visits pairs at the positions `x`, flat `(n, D)` [m], one by one.
pub(crate) fn visit_each<K: PairKind<N, P>, const D: usize, const N: usize, const P: usize>(
    model: &ContactModel,
    x: &[f64],
    pairs: &[WeightedPair<N>],
    visitor: &mut impl ContactVisitor<D>,
) {
    for pair in pairs {
        let geometry = PairGeometry::of::<K>(&rows::<D, N>(x, &pair.vertices));
        let law = model.law(pair.vertices[0], pair.vertices[N - 1]);
        visitor.pair(&pair.vertices, &geometry, law, pair.weight);
    }
}

/// Visits pairs that share one law.
pub(crate) fn visit_pairs_of_law<K: PairKind<N, P>, const D: usize, const N: usize, const P: usize>(
    law: &ContactLaw,
    x: &[f64],
    pairs: &[WeightedPair<N>],
    visitor: &mut impl PackVisitor<D>,
) {
    dispatch(PairVisit { pairs, x, law, visitor, kind: PhantomData::<K> });
}

/// Kernel that visits pairs of one law.
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
