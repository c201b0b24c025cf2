//! History-dependent elements: `E = sum_e sum_q w_q psi(F_q; z_q, s)`.
//!
//! Each quadrature point stores the history variables `z` of the end of the last step; `s` is the time
//! since then. The law updates `z` at the end of an accepted step. A law is one function of `F`, `z` and
//! `s`, generic in the numbers: the stress and its derivatives by dual numbers are exact, including those
//! with respect to the history of a step before.
//!
//! An incremental potential whose step ends where the next one begins, `P(F; z_n, s) = P(F; z_(n+1), 0)`,
//! has forces that do not jump between steps: Ortiz, Stainier 1999, "The variational formulation of
//! viscoplastic constitutive updates", Comput. Methods Appl. Mech. Engrg. 171, 419, equations (12) to (15).
//!
//! # How to add a law
//! 1. Implement `HistoryLaw<D, H>` for a type: `START`, `psi` and `advanced`, generic in the scalar.
//!    `crates/gradient/tests/adjoint/history.rs` has a Maxwell branch in 60 lines.
//! 2. Build `RememberingElements::new` with it: simplices of first or second order. Forces, matrix,
//!    checkpoints (`HistoryTerm`), the energy balance (`loss_rate`) and adjoints follow. Tangents are
//!    refused.
//! 3. Test it as that file does: relaxation under a fixed strain, saved states, the energy balance,
//!    gradients.
//! 4. No scene names a law with history yet. The first one needs a function in `crates/terms/src/lib.rs`, a
//!    key in `crates/scene/src/schema`, its branch in `elastic_terms` of
//!    `crates/scene/src/assembly/terms.rs`, and its parameters in `crates/gradient/src/names`.

use std::ops::Range;

use super::hessian::add_blocks;
use super::kinematics::{BLOCKS, Kinematics, rest_gradients};
use super::{Block, points_of};
use crate::algebra::{Dual, Mat};
use crate::element::{Barycentric, ElementState, quadrature_count};
use crate::energy::evaluated::visit_uniform;
use crate::energy::patch::Workspace;
use crate::energy::{
    Driven, ElementTerm, ElementVisitor, EnergyKind, EnergyTerm, Fault, HistoryTerm, Stencils,
    TermProperties, TermViews,
};
use crate::lanes::{Kernel, Lanes, Portable, WIDTH, dispatch_compact};
use crate::material::{Psd, Tangent};
use crate::scalar::Scalar;

/// Law of a point with `H` history variables.
pub trait HistoryLaw<const D: usize, const H: usize>: Send + Sync + 'static {
    /// History variables of a point that was never deformed.
    const START: [f64; H];

    /// Returns the energy density `psi(F; z, s)` [J/m^D], `s` [s] after the last update of the history
    /// `z`.
    fn psi<S: Scalar>(&self, f: &Mat<S, D>, past: &[S; H], s: S) -> S;

    /// Returns the history at the end of a step of `s` [s] that ends at `F`.
    fn advanced<S: Scalar>(&self, f: &Mat<S, D>, past: &[S; H], s: S) -> [S; H];
}

/// History variables of `WIDTH` points side by side.
type PastBlock<const H: usize> = [[f64; WIDTH]; H];

/// Simplices of first or second order with a history-dependent law.
pub struct RememberingElements<const D: usize, const N: usize, const H: usize, L> {
    body: String,
    law: L,
    elements: Kinematics<D, D, N>,
    /// `z` of every quadrature point, in the order of their blocks.
    past: Vec<PastBlock<H>>,
    /// Time of the last update of `past`, and the present time [s].
    said: f64,
    time: f64,
    workspace: Workspace<D>,
}

impl<const D: usize, const N: usize, const H: usize, L: HistoryLaw<D, H>> RememberingElements<D, N, H, L> {
    /// Creates the elements `elements` (global vertex indices) of `body` with the reference positions
    /// `rest` (flat, all vertices of the system) [m], never deformed before the time 0.
    ///
    /// # Panics
    /// If there is no simplex of `N` nodes in `D` dimensions, or an element has no positive volume at a
    /// quadrature point; meshes are checked before.
    pub fn new(body: &str, law: L, elements: &[[u32; N]], rest: &[f64]) -> Self {
        let elements = Kinematics::new(body, elements, rest, |vertices| points_of(rest, vertices));
        RememberingElements {
            body: body.into(),
            law,
            past: vec![L::START.map(|number| [number; WIDTH]); elements.rest.len()],
            said: 0.0,
            time: 0.0,
            workspace: Workspace::new(&elements.patches),
            elements,
        }
    }

    fn since(&self) -> f64 {
        self.time - self.said
    }

    /// Calls `visit` with the vertices of every element, each of its points, and the block and lane of
    /// the point's history.
    fn each_point(
        &self,
        x: &[f64],
        mut visit: impl FnMut(&[u32; N], &HistoryPoint<D, N, H>, (usize, usize)),
    ) {
        let count = quadrature_count::<D, N>();
        for (_, vertices, pack, lane) in self.elements.patches.stencils() {
            for (q, point) in self.points(x, &vertices, (pack, lane)).enumerate() {
                visit(&vertices, &point, (pack * count + q, lane));
            }
        }
    }

    /// Returns the state of an element at the means of the deformation gradients and of the histories of
    /// its points. The out-of-plane stress in 2D is unknown: NaN.
    fn state(&self, x: &[f64], vertices: &[u32; N], lane: (usize, usize)) -> ElementState {
        let part = 1.0 / quadrature_count::<D, N>() as f64;
        let (mut f, mut past) = (Mat::zero(), [0.0; H]);
        for point in self.points(x, vertices, lane) {
            f += point.f.scale(part);
            past.iter_mut().zip(point.past).for_each(|(mean, number)| *mean += part * number);
        }
        let (mut deformation_gradient, mut first_piola) = (Mat::identity(), Mat::diagonal(&[f64::NAN; 3]));
        let stress = stress(&self.law, &f, &past, self.since());
        for i in 0..D {
            deformation_gradient[i][..D].copy_from_slice(&f[i]);
            first_piola[i][..D].copy_from_slice(&stress[i]);
        }
        let energy_density = self.law.psi(&f, &past, self.since());
        ElementState { deformation_gradient, first_piola, energy_density, plane: D == 2 }
    }

    fn points(
        &self,
        x: &[f64],
        vertices: &[u32; N],
        (pack, lane): (usize, usize),
    ) -> impl Iterator<Item = HistoryPoint<D, N, H>> {
        let first = pack * quadrature_count::<D, N>();
        let points = self.elements.at_points(x, vertices, (pack, lane)).enumerate();
        points.map(move |(q, (f, inverse, weight))| {
            let gradients = rest_gradients::<D, N>(q, &inverse);
            let past = self.past[first + q].map(|lanes| lanes[lane]);
            HistoryPoint { f: Mat(f), gradients, weight, past }
        })
    }
}

/// Quadrature point: `F`, gradients of the shape functions, weight and history.
struct HistoryPoint<const D: usize, const N: usize, const H: usize> {
    f: Mat<f64, D>,
    gradients: [[f64; D]; N],
    weight: f64,
    past: [f64; H],
}

/// Returns `P = dpsi/dF` by dual numbers.
#[inline(always)]
fn stress<S: Scalar, L: HistoryLaw<D, H>, const D: usize, const H: usize>(
    law: &L,
    f: &Mat<S, D>,
    past: &[S; H],
    s: S,
) -> Mat<S, D> {
    let past = past.map(Dual::constant);
    let mut p = Mat::zero();
    for k in 0..D {
        for l in 0..D {
            let mut direction = Mat::zero();
            direction[k][l] = S::one();
            p[k][l] = law.psi(&Dual::along(f, &direction), &past, Dual::constant(s)).derivative;
        }
    }
    p
}

/// Task on blocks of `F` with the histories of their points.
enum LawTask<'a, const D: usize> {
    /// Writes the energy densities.
    Density(&'a [Block<D>], &'a mut [[f64; WIDTH]]),
    /// Overwrites each `F` with `P`.
    Stress(&'a mut [Block<D>]),
    /// Overwrites each `dF` with `dP`.
    Change(&'a [Block<D>], &'a mut [Block<D>]),
}

struct LawKernel<'a, L, const D: usize, const H: usize> {
    law: &'a L,
    past: &'a [PastBlock<H>],
    since: f64,
    task: LawTask<'a, D>,
}

impl<L: HistoryLaw<D, H>, const D: usize, const H: usize> Kernel for LawKernel<'_, L, D, H> {
    type Output = ();

    #[inline(always)]
    fn run<W: Lanes>(self) {
        let LawKernel { law, past, since, task } = self;
        let since = W::splat(since);
        match task {
            LawTask::Density(f, psi) => {
                for ((f, past), psi) in f.iter().zip(past).zip(psi) {
                    law.psi(&f.load::<W>(), &loaded(past), since).store(psi);
                }
            }
            LawTask::Stress(f) => {
                for (f, past) in f.iter_mut().zip(past) {
                    f.store(&stress(law, &f.load::<W>(), &loaded(past), since));
                }
            }
            LawTask::Change(f, df) => {
                for ((f, past), df) in f.iter().zip(past).zip(df) {
                    let past = loaded::<W, H>(past).map(Dual::constant);
                    let along = Dual::along(&f.load::<W>(), &df.load::<W>());
                    df.store(&Dual::parts(&stress(law, &along, &past, Dual::constant(since))).1);
                }
            }
        }
    }
}

#[inline(always)]
fn loaded<W: Lanes, const H: usize>(past: &PastBlock<H>) -> [W; H] {
    let mut numbers = [W::zero(); H];
    for i in 0..H {
        numbers[i] = W::load(&past[i]);
    }
    numbers
}

impl<const D: usize, const N: usize, const H: usize, L: HistoryLaw<D, H>> EnergyTerm
    for RememberingElements<D, N, H, L>
{
    fn name(&self) -> String {
        format!("elements of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties {
            fills_space: D == 3,
            changes_with_time: true,
            remembers: true,
            ..TermProperties::of(EnergyKind::Elastic)
        }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let since = self.since();
        let RememberingElements { law, elements, past, workspace, .. } = self;
        elements.patches.sum(workspace, x, |patch, scratch| {
            let (mut blocks, mut psi) = ([Block::ZERO; BLOCKS], [[0.0; WIDTH]; BLOCKS]);
            let mut sum = [0.0; WIDTH];
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut blocks);
                let (psi, past) = (&mut psi[..f.len()], &past[piece.blocks()]);
                dispatch_compact(LawKernel { law, past, since, task: LawTask::Density(f, psi) });
                piece.add_weighted(psi, &mut sum);
            }
            Portable::load(&sum).horizontal_sum()
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let since = self.since();
        let RememberingElements { law, elements, past, workspace, .. } = self;
        elements.patches.evaluate(workspace, x, None, |patch, scratch| {
            let mut blocks = [Block::ZERO; BLOCKS];
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut blocks);
                let past = &past[piece.blocks()];
                dispatch_compact(LawKernel { law, past, since, task: LawTask::Stress(f) });
                piece.add_forces(f, &mut scratch.gradient);
            }
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.elements.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let since = self.since();
        let RememberingElements { law, elements, past, workspace, .. } = self;
        elements.patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            let (mut f, mut df) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut f);
                let df = piece.deform(&scratch.direction, &mut df);
                let past = &past[piece.blocks()];
                dispatch_compact(LawKernel { law, past, since, task: LawTask::Change(f, df) });
                piece.add_forces(df, &mut scratch.gradient);
            }
        });
        self.add_rows(0, y);
    }

    fn stencils(&mut self) -> Stencils {
        self.elements.patches.lanes()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        let since = Dual::constant(self.since());
        let entries = N * (N + 1) / 2 * D * D;
        let lanes = self.elements.patches.lanes_in(stencils).zip(out.chunks_exact_mut(entries));
        for ((vertices, pack, lane), out) in lanes {
            out.fill(0.0);
            for point in self.points(x, &vertices, (pack, lane)) {
                let mut tangent = Tangent::<D>::zero();
                for (k, l) in (0..D).flat_map(|k| (0..D).map(move |l| (k, l))) {
                    let mut along = Mat::zero();
                    along[k][l] = 1.0;
                    let past = point.past.map(Dual::constant);
                    let change =
                        Dual::parts(&stress(&self.law, &Dual::along(&point.f, &along), &past, since)).1;
                    for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
                        tangent.0[i][j][k][l] = change[i][j];
                    }
                }
                if psd == Psd::Projected {
                    tangent = tangent.projected();
                }
                add_blocks(&tangent, point.weight, &point.gradients, out);
            }
        }
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        for (element, vertices, pack, lane) in self.elements.patches.stencils() {
            for point in self.points(x, &vertices, (pack, lane)) {
                if !stress(&self.law, &point.f, &point.past, self.since()).norm_squared().is_finite() {
                    let (body, j) = (self.body.clone(), point.f.determinant());
                    return Some(Fault::Element { body, element, j, material_would_help: true });
                }
            }
        }
        None
    }
}

impl<const D: usize, const N: usize, const H: usize, L: HistoryLaw<D, H>> TermViews
    for RememberingElements<D, N, H, L>
{
    fn driven(&mut self) -> Option<&mut dyn Driven> {
        Some(self)
    }

    fn elements(&self) -> Option<&dyn ElementTerm> {
        Some(self)
    }
}

impl<const D: usize, const N: usize, const H: usize, L: HistoryLaw<D, H>> ElementTerm
    for RememberingElements<D, N, H, L>
{
    fn body(&self) -> &str {
        &self.body
    }

    fn element_count(&self) -> usize {
        self.elements.patches.stencils().count()
    }

    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState)) {
        for (element, vertices, pack, lane) in self.elements.patches.stencils() {
            visit(element, self.state(x, &vertices, (pack, lane)));
        }
    }

    /// Returns the same state everywhere in the element.
    fn state_at(&self, x: &[f64], element: usize, _: &Barycentric) -> Option<ElementState> {
        let mut stencils = self.elements.patches.stencils();
        let (_, vertices, pack, lane) = stencils.find(|(number, ..)| *number == element)?;
        Some(self.state(x, &vertices, (pack, lane)))
    }

    fn nodes(&self) -> usize {
        N
    }

    fn each_at(&self, x: &[f64], points: &[Barycentric], visit: &mut ElementVisitor<'_>) {
        for (number, vertices, pack, lane) in self.elements.patches.stencils() {
            visit_uniform((number, &vertices), self.state(x, &vertices, (pack, lane)), points, visit);
        }
    }

    fn history(&self) -> Option<&dyn HistoryTerm> {
        Some(self)
    }
}

impl<const D: usize, const N: usize, const H: usize, L: HistoryLaw<D, H>> Driven
    for RememberingElements<D, N, H, L>
{
    fn set_time(&mut self, time: f64) {
        self.time = time;
    }

    fn history_mut(&mut self) -> Option<&mut dyn HistoryTerm> {
        Some(self)
    }
}

impl<const D: usize, const N: usize, const H: usize, L: HistoryLaw<D, H>> HistoryTerm
    for RememberingElements<D, N, H, L>
{
    fn history(&self) -> Vec<f64> {
        self.past.as_flattened().as_flattened().to_vec()
    }

    fn history_len(&self) -> usize {
        self.past.len() * H * WIDTH
    }

    fn set_history(&mut self, numbers: &[f64], time: f64) {
        self.past.as_flattened_mut().as_flattened_mut().copy_from_slice(numbers);
        (self.said, self.time) = (time, time);
    }

    fn commit(&mut self, x: &[f64], time: f64) -> f64 {
        self.time = time;
        let (since, mut lost, mut past) = (self.since(), 0.0, self.past.clone());
        self.each_point(x, |_, point, (block, lane)| {
            let next = self.law.advanced(&point.f, &point.past, since);
            let before = self.law.psi(&point.f, &point.past, since);
            lost += point.weight * (before - self.law.psi(&point.f, &next, 0.0));
            past[block].iter_mut().zip(next).for_each(|(lanes, number)| lanes[lane] = number);
        });
        (self.past, self.said) = (past, time);
        lost
    }

    fn loss_rate(&self, x: &[f64]) -> f64 {
        let since = Dual { value: self.since(), derivative: 1.0 };
        let mut rate = 0.0;
        self.each_point(x, |_, point, _| {
            let f = Dual::along(&point.f, &Mat::zero());
            let past = point.past.map(Dual::constant);
            rate -= point.weight * self.law.psi(&f, &past, since).derivative;
        });
        rate
    }

    fn add_work_by_history(&self, x: &[f64], p: &[f64], by: &mut [f64]) {
        let since = Dual::constant(Dual::constant(self.since()));
        self.each_point(x, |vertices, point, (block, lane)| {
            let p: [[f64; D]; N] = points_of(p, vertices);
            let mut g = Mat::zero();
            for (row, slope) in p.iter().zip(&point.gradients) {
                (0..D).for_each(|i| (0..D).for_each(|j| g[i][j] += row[i] * slope[j]));
            }
            // d/dz of P : G, along both at once.
            let along = Dual::along(&point.f, &g);
            let f = Dual::along(&along, &Mat::zero());
            for h in 0..H {
                let mut past = point.past.map(|number| Dual::constant(Dual::constant(number)));
                past[h].derivative = Dual::constant(1.0);
                let second = self.law.psi(&f, &past, since).derivative.derivative;
                by[(block * H + h) * WIDTH + lane] += point.weight * second;
            }
        });
    }

    fn add_commit_transposed(&self, x: &[f64], after: &[f64], by_x: &mut [f64], before: &mut [f64]) {
        let since = Dual::constant(self.since());
        self.each_point(x, |vertices, point, (block, lane)| {
            let place = |h: usize| (block * H + h) * WIDTH + lane;
            let along = |next: [Dual<f64>; H]| -> f64 {
                next.iter().enumerate().map(|(h, number)| number.derivative * after[place(h)]).sum()
            };
            let still = Dual::along(&point.f, &Mat::zero());
            let past = point.past.map(Dual::constant);
            for h in 0..H {
                let mut past = past;
                past[h].derivative = 1.0;
                before[place(h)] += along(self.law.advanced(&still, &past, since));
            }
            for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
                let mut f = still;
                f[i][j].derivative = 1.0;
                let by_entry = along(self.law.advanced(&f, &past, since));
                for (vertex, slope) in vertices.iter().zip(&point.gradients) {
                    by_x[*vertex as usize * D + i] += by_entry * slope[j];
                }
            }
        });
    }
}
