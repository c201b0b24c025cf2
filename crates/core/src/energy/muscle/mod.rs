//! Muscles: active tension along the fibres of elements, prescribed over time.

mod kernels;
mod packs;
#[cfg(test)]
mod tests;

use std::ops::Range;

use self::kernels::{MuscleEnergyKernel, MuscleForceKernel, MusclePowerKernel};
use self::packs::FibrePack;
pub use self::packs::{FibrePoint, cell_fibres, simplex_fibres};
use super::elastic::centroids;
use super::patch::{Patches, Workspace};
use super::{
    Driven, EnergyKind, EnergyTerm, Fault, LoadTerm, Measurements, Stencils, TermProperties, TermViews,
};
use crate::lanes::{WIDTH, dispatch_compact};
use crate::material::Psd;
use crate::numbering::along_curve;

/// Times over the run at which a tension is looked at for its largest value: shorter peaks are missed.
const SAMPLES: u32 = 1000;
/// Places at which one that differs from place to place is, at most.
const PLACES: usize = 250;

/// Tension over place and time.
pub struct TensionField {
    /// The tension [Pa] by the rest position [m] and the time [s].
    pub field: Box<dyn Fn([f64; 3], f64) -> f64 + Send + Sync>,
    /// True if it changes with time.
    pub changes: bool,
    /// True if it differs from place to place.
    pub varies: bool,
    /// End of the run [s], up to which its largest value is looked for.
    pub until: f64,
}

/// Active tension `T` [Pa] of muscles along unit directions `a` of the rest shape, which passive elements
/// resist:
///
/// ```text
/// E = sum_e sum_q w_q T(X_q, t)/2 (|F_q a|^2 - 1)          [J]
/// P = T (F a) a^T,  S = T a a^T                            [Pa]
/// sigma = T/J (F a)(F a)^T                                 [Pa]
/// ```
///
/// The second Piola-Kirchhoff stress along the fibres is `T`, whatever their stretch: the active stress of
/// models of the heart (Land et al., *Verification of cardiac mechanics software*, Proceedings of the Royal
/// Society A 471, 20150641, 2015, problem 3). `F a = sum_i x_i (a . dN_i/dX)` is linear in the positions:
/// the energy is quadratic in them at each moment, its Hessian constant.
///
/// The energy is zero at rest, and changes with time by `dE/dt` at fixed positions, which is what the muscle
/// brings in.
pub struct ActiveTension<const D: usize, const N: usize> {
    name: String,
    patches: Patches<N>,
    /// Fibres of every pack, one after the other those of its quadrature points.
    packs: Vec<FibrePack<N>>,
    /// Quadrature points of an element.
    points: usize,
    /// Place of each point of each lane, where the tension varies.
    places: Vec<[f64; 3]>,
    tension: TensionField,
    /// Largest tension to be expected, not below zero [Pa].
    largest: f64,
    time: f64,
    workspace: Workspace<D>,
}

impl<const D: usize, const N: usize> ActiveTension<D, N> {
    /// Muscles of this name in the elements `elements` (vertices of the system), at rest at `rest` (flat, all
    /// vertices of the system) [m]. `fibres` gives the points of each element, as [`simplex_fibres`] and
    /// [`cell_fibres`] do, as many of each.
    ///
    /// # Panics
    /// If elements have different numbers of points.
    pub fn new(
        name: String,
        elements: &[[u32; N]],
        rest: &[f64],
        fibres: impl Fn(usize) -> Vec<FibrePoint<N>>,
        tension: TensionField,
    ) -> Self {
        let order = along_curve::<D>(&centroids(elements, rest));
        let patches = Patches::new::<D>(elements, &order, rest.len() / D);
        let first = if elements.is_empty() { vec![] } else { fibres(0) };
        // Lanes without an element have a place where the tension is known all the same.
        let (points, place) = (first.len(), first.first().map_or([0.0; 3], |point| point.place));
        let mut packs = vec![FibrePack::EMPTY; patches.index.len() * points];
        let mut places = vec![place; if tension.varies { packs.len() * WIDTH } else { 0 }];
        for (element, _, pack, lane) in patches.stencils() {
            let found = fibres(element);
            assert_eq!(found.len(), points, "points of element {element} of {name}");
            for (q, point) in found.iter().enumerate() {
                packs[pack * points + q].set(lane, point);
                if let Some(place) = places.get_mut((pack * points + q) * WIDTH + lane) {
                    *place = point.place;
                }
            }
        }
        let largest = largest(&tension, &places);
        let workspace = Workspace::new(&patches);
        let mut muscle =
            ActiveTension { name, patches, packs, points, places, tension, largest, time: 0.0, workspace };
        muscle.sample(0.0);
        muscle
    }

    /// The tensions at the time `time` [s].
    fn sample(&mut self, time: f64) {
        let ActiveTension { packs, places, tension, .. } = self;
        let everywhere = (tension.field)([0.0; 3], time);
        for (i, pack) in packs.iter_mut().enumerate() {
            pack.pull(|lane| match places.get(i * WIDTH + lane) {
                Some(place) => (tension.field)(*place, time),
                None => everywhere,
            });
        }
    }
}

/// The largest tension [Pa], as far as samples of it say, not below zero.
fn largest(tension: &TensionField, places: &[[f64; 3]]) -> f64 {
    let origin = if tension.varies { &[][..] } else { &[[0.0; 3]][..] };
    let looked = places.iter().step_by(places.len().div_ceil(PLACES).max(1)).chain(origin);
    let samples = if tension.changes { SAMPLES } else { 0 };
    let at = |sample: u32| tension.until * f64::from(sample) / f64::from(SAMPLES);
    let values = looked.flat_map(|place| (0..=samples).map(move |i| (tension.field)(*place, at(i))));
    values.filter(|tension| tension.is_finite()).fold(0.0, f64::max)
}

impl<const D: usize, const N: usize> EnergyTerm for ActiveTension<D, N> {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn properties(&self) -> TermProperties {
        TermProperties { changes_with_time: self.tension.changes, ..TermProperties::of(EnergyKind::Load) }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let ActiveTension { patches, packs, points, workspace, .. } = self;
        patches.sum(workspace, x, |patch, scratch| {
            dispatch_compact(MuscleEnergyKernel { patches, packs, points: *points, patch, scratch })
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let ActiveTension { patches, packs, points, workspace, .. } = self;
        patches.evaluate(workspace, x, None, |patch, scratch| {
            dispatch_compact(MuscleForceKernel { patches, packs, points: *points, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.patches.add_rows(&self.workspace, first, g);
    }

    /// The gradient is linear in the positions.
    fn add_hessian_product(&mut self, _x: &[f64], p: &[f64], y: &mut [f64]) {
        self.evaluate(p);
        self.add_rows(0, y);
    }

    fn stencils(&mut self) -> Stencils {
        self.patches.lanes()
    }

    /// `sum_q w_q T c_a c_b I` with `c_a = a . dN_a/dX`; projected, without points that push.
    fn stencil_hessians(&self, stencils: Range<usize>, _x: &[f64], psd: Psd, out: &mut [f64]) {
        let pairs = N * (N + 1) / 2;
        let lanes = self.patches.lanes_in(stencils).zip(out.chunks_exact_mut(pairs * D * D));
        for ((_, pack, lane), out) in lanes {
            let packs = &self.packs[pack * self.points..][..self.points];
            let mut blocks = out.chunks_exact_mut(D * D);
            for a in 0..N {
                for b in a..N {
                    let Some(block) = blocks.next() else { return };
                    let entry: f64 = packs.iter().map(|pack| pack.stiffness(lane, a, b, psd)).sum();
                    block.fill(0.0);
                    block.iter_mut().step_by(D + 1).for_each(|diagonal| *diagonal = entry);
                }
            }
        }
    }

    fn fault(&self, _x: &[f64]) -> Option<Fault> {
        let finite = self.packs.iter().all(FibrePack::is_finite);
        (!finite).then(|| Fault::Load { load: format!("the tension of {}", self.name), time: self.time })
    }
}

impl<const D: usize, const N: usize> TermViews for ActiveTension<D, N> {
    fn load(&self) -> Option<&dyn LoadTerm> {
        Some(self)
    }

    fn driven(&mut self) -> Option<&mut dyn Driven> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl<const D: usize, const N: usize> Driven for ActiveTension<D, N> {
    fn set_time(&mut self, time: f64) {
        if time != self.time {
            self.time = time;
            self.sample(time);
        }
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let ActiveTension { patches, packs, points, workspace, .. } = self;
        patches.sum_along(workspace, x, v, |patch, scratch| {
            dispatch_compact(MusclePowerKernel { patches, packs, points: *points, patch, scratch })
        })
    }

    /// By Gershgorin's circles of what the largest tension adds to that of now.
    fn stiffening(&self, inverse_mass: &[f64]) -> f64 {
        let mut circles = vec![0.0; inverse_mass.len() / D];
        for (_, vertices, pack, lane) in self.patches.stencils() {
            for point in &self.packs[pack * self.points..][..self.points] {
                let row = point.row_sums(lane, self.largest);
                vertices.iter().zip(row).for_each(|(vertex, sum)| circles[*vertex as usize] += sum);
            }
        }
        let weighed = circles.iter().zip(inverse_mass.chunks_exact(D));
        weighed.map(|(sum, inverse)| sum * inverse.iter().copied().fold(0.0, f64::max)).fold(0.0, f64::max)
    }
}

impl<const D: usize, const N: usize> LoadTerm for ActiveTension<D, N> {
    fn components(&self) -> usize {
        1
    }

    fn work(&self, x: &[f64], p: &[f64]) -> f64 {
        self.work_of(&|place, time| [(self.tension.field)(place, time), 0.0, 0.0], x, p)
    }

    fn add_unit_works(&self, x: &[f64], p: &[f64], works: &mut [f64]) {
        works[0] += self.work_of(&|_, _| [1.0, 0.0, 0.0], x, p);
    }

    /// `-sum w T c_i F a` on node `i`, with `c_i = a . dN_i/dX`.
    fn add_force_of(&self, value: &dyn Fn([f64; 3], f64) -> [f64; 3], x: &[f64], force: &mut [f64]) {
        for (_, vertices, pack, lane) in self.patches.stencils() {
            for i in pack * self.points..(pack + 1) * self.points {
                let place = self.places.get(i * WIDTH + lane).copied().unwrap_or_default();
                let (weight, slopes) = self.packs[i].fibre(lane);
                let pull = weight * value(place, self.time)[0];
                for c in 0..D {
                    let of = |vertex: &u32| *vertex as usize * D + c;
                    let image: f64 =
                        vertices.iter().zip(slopes).map(|(vertex, slope)| slope * x[of(vertex)]).sum();
                    vertices
                        .iter()
                        .zip(slopes)
                        .for_each(|(vertex, slope)| force[of(vertex)] -= pull * slope * image);
                }
            }
        }
    }

    fn add_force(&self, x: &[f64], force: &mut [f64]) {
        self.add_force_of(&|place, time| [(self.tension.field)(place, time), 0.0, 0.0], x, force);
    }
}

impl<const D: usize, const N: usize> Measurements for ActiveTension<D, N> {
    /// The tension of now in all of the volume, by fibres that shorten to nothing; what a change of it brings
    /// in counts where it is booked.
    fn scale(&mut self, _x: &[f64]) -> f64 {
        0.5 * self.packs.iter().map(FibrePack::strength).sum::<f64>()
    }
}
