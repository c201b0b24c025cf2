//! Contact as a potential energy: a term of the equations of motion whose stencils change as bodies move.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pliant::energy::{
    ChangingStencils, ContactExtremes, ContactPlace, ContactShare, EnergyKind, EnergyTerm, Fault, LeastGap,
    Measurements, ShapedContact, Stencils, StepLimit, SurfaceContact, TermProperties, TermViews,
    TouchingPair, TouchingSurfaces, WatchedContacts, WayObstruction, add_stencil_product,
};
use pliant::lanes::{Lanes, spread};
use pliant::material::Psd;
use rayon::prelude::*;

use crate::barrier::PotentialForm;
use crate::candidates::CandidatePairs;
use crate::contacts::Contacts;
use crate::evaluation::{ContactTerm, EvaluatedContacts};
use crate::expected::{self, ExpectedInTurn, ForceForecast};
use crate::explicit::{self, SurfaceMobility};
use crate::hessian::PairBlocks;
use crate::merge::WeightedPair;
use crate::model::{ContactLaw, ContactModel};
use crate::mollifier::{MollifiedPair, mollified_inner_pair};
use crate::pair::PairGeometry;
use crate::report::{ContactReport, NearestContact};
use crate::rows::{StencilLists, TouchedRows};
use crate::search::{ContactSearch, typical_edge};
use crate::shape::{AreaRates, ForceOfContact, ShapeSink, ShapedPair};
use crate::vector::dot;
use crate::visit::{PackVisitor, PlaneGeometry};
use crate::way::{Obstruction, Way, WayEnd};

/// Contacts per task.
const TASK: usize = 256;

/// Contact search shared by energy and friction.
pub(crate) type SharedSearch<const D: usize> = Arc<Mutex<ContactSearch<D>>>;

/// Locks the search and ignores poisoning: its data is recomputed wherever it does not fit.
pub(crate) fn locked<const D: usize>(search: &SharedSearch<D>) -> MutexGuard<'_, ContactSearch<D>> {
    search.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Number of steps of motion for which candidates are gathered ahead: barriers, whose solves try several
/// guesses a step, and the cubic form, whose steps are short.
const STEPS_AHEAD: [f64; 2] = [4.0, 16.0];

/// Energy of all contacts.
///
/// Barrier: `E = sum kappa w m dhat B(q)`, which nothing crosses. Cubic form: `E = sum 2/3 kappa w m dhat
/// (1 - s)^3`, with finite forces, so that crossings are monitored.
pub struct ContactEnergy<const D: usize> {
    model: Arc<ContactModel>,
    form: PotentialForm,
    allows_crossing: bool,
    /// Area of each body [m^2], for the cubic form.
    areas: Vec<f64>,
    search: SharedSearch<D>,
    gradient: TouchedRows<D>,
    /// Contacts of the matrix.
    contacts: Contacts,
    lists: StencilLists,
}

impl<const D: usize> ContactEnergy<D> {
    /// Energy of the contacts of a model, in a system with the vertices of its surface. All of its laws
    /// must have the same form.
    pub fn new(model: Arc<ContactModel>) -> Self {
        let search = Arc::new(Mutex::new(ContactSearch::new(&model)));
        let form =
            if model.names.is_empty() { PotentialForm::Barrier } else { model.laws.of(0, 0).barrier.form };
        ContactEnergy {
            form,
            allows_crossing: false,
            areas: if form == PotentialForm::Cubic { explicit::areas(&model) } else { vec![] },
            gradient: TouchedRows::new(model.surface.bodies.len()),
            contacts: Contacts::default(),
            lists: StencilLists::new(),
            model,
            search,
        }
    }

    /// Lets surfaces of the cubic form cross each other and turns the crossing check off.
    pub fn allow_crossing(&mut self, allow: bool) {
        self.allows_crossing = allow;
    }

    /// Search to be shared with other terms that need the same contacts.
    pub(crate) fn search(&self) -> SharedSearch<D> {
        self.search.clone()
    }

    /// Contact model: bodies, obstacles and parameters.
    pub fn model(&self) -> &Arc<ContactModel> {
        &self.model
    }

    /// Energies and gradients of all contacts at `x`, in order.
    fn terms(&self, x: &[f64], with_gradient: bool) -> Vec<ContactTerm<D>> {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        let task = |task: usize| {
            let numbers = task * TASK..((task + 1) * TASK).min(contacts.len());
            let mut terms = EvaluatedContacts { with_gradient, terms: Vec::with_capacity(numbers.len()) };
            contacts.visit_packs::<D>(&self.model, x, numbers, &mut terms);
            terms.terms
        };
        let tasks = contacts.len().div_ceil(TASK);
        if tasks < 2 {
            return (0..tasks).flat_map(task).collect();
        }
        (0..tasks).into_par_iter().map(task).collect::<Vec<_>>().concat()
    }

    /// Obstruction with the smallest free fraction of the path.
    fn first_on_way(&self, x: &[f64], dx: &[f64], ends: WayEnd) -> Option<Obstruction> {
        let way = Way { x, dx, ends };
        let mut search = locked(&self.search);
        let reach = if ends == WayEnd::Crossing { 0.0 } else { search.reach };
        way.first::<D>(&self.model, search.on_way(&self.model, (x, dx), reach))
    }

    /// Contact at `x` between one of these two bodies and a third with the smallest relative gap.
    fn nearest_beside(&self, bodies: [u32; 2], x: &[f64]) -> Option<[Vec<u32>; 2]> {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        let part = |i: usize| {
            let report = ContactReport::<D>::of(contacts, &self.model, x, i);
            let [a, b] = report.bodies(&self.model)?;
            let is_beside = bodies.contains(&a) != bodies.contains(&b);
            is_beside.then(|| (report.gap / self.model.laws.of(a, b).barrier.reach, report.sides()))
        };
        let nearest = (0..contacts.len()).filter_map(part).min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|(_, sides)| sides)
    }

    /// Names of two primitives.
    fn named_pair(&self, [a, b]: &[Vec<u32>; 2]) -> String {
        format!("{} and {}", self.model.named(a), self.model.named(b))
    }
}

/// Blocks `d2E/dx_i dx_j`, `i <= j`, of the contacts of a list, row by row.
struct ContactBlocks<'a, const D: usize> {
    psd: Psd,
    /// Predicted contact forces; `None` if tangents are wanted.
    expected: Option<ExpectedInTurn<'a>>,
    /// Output of the contacts still to come.
    out: &'a mut [f64],
}

/// Largest number of block entries of a contact: four vertices in 3D.
const MOST_ENTRIES: usize = 10 * 9;

impl<'a, const D: usize> ContactBlocks<'a, D> {
    /// Splits off the output of the next contacts.
    fn take(&mut self, numbers: usize) -> &'a mut [f64] {
        let (out, rest) = std::mem::take(&mut self.out).split_at_mut(numbers);
        self.out = rest;
        out
    }
}

impl<const D: usize> PackVisitor<D> for ContactBlocks<'_, D> {
    #[inline(always)]
    fn pack<L: Lanes, const N: usize, const P: usize>(
        &mut self,
        pairs: &[WeightedPair<N>],
        geometry: &PairGeometry<L, D, N, P>,
        law: &ContactLaw,
        weight: L,
    ) {
        let mut of_distance = law.barrier.at(geometry.squared_distance, weight);
        if let Some(expected) = &mut self.expected {
            let of_gap = law.barrier.by_gap(geometry.distance, weight);
            let stiffness = expected.stiffnesses(pairs, &law.barrier, geometry.distance, &of_gap);
            // By the distance the second derivative is 4 d^2 E'' + 2 E', derivatives by its square.
            let (c, squared) = (L::splat, geometry.squared_distance);
            of_distance.curvature = (stiffness - c(2.0) * of_distance.slope) / (c(4.0) * squared);
        }
        let blocks: PairBlocks<L, D, N> = geometry.hessian(&of_distance, self.psd);
        let mut packs = [L::zero(); MOST_ENTRIES];
        let mut count = 0;
        for a in 0..N {
            for b in a..N {
                for k in 0..D {
                    for l in 0..D {
                        packs[count] = blocks[a][b][k][l];
                        count += 1;
                    }
                }
            }
        }
        spread(&packs[..count], 0..pairs.len(), self.take(count * pairs.len()));
    }

    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64) {
        let curvature = match &mut self.expected {
            Some(expected) => expected.stiffness(vertices, &law.barrier, plane.distance, weight),
            None => law.barrier.at_signed(plane.distance, weight).curvature,
        };
        let blocks = self.take(3 * D * D).chunks_exact_mut(D * D).zip([curvature, -curvature, curvature]);
        for (out, curvature) in blocks {
            for k in 0..D {
                for l in 0..D {
                    out[k * D + l] = curvature * plane.normal[k] * plane.normal[l];
                }
            }
        }
    }

    fn mollified(&mut self, pair: &MollifiedPair, x: &[[f64; 3]; 4], law: &ContactLaw) {
        let found = mollified_inner_pair(x, &pair.inner, &law.barrier, pair.weight, pair.limit, self.psd);
        let mut rows = self.take(10 * D * D).chunks_exact_mut(D);
        for i in 0..4 {
            for j in i..4 {
                for k in 0..D {
                    let Some(row) = rows.next() else { return };
                    row.copy_from_slice(&found.hessian[3 * i + k][3 * j..][..D]);
                }
            }
        }
    }
}

impl<const D: usize> EnergyTerm for ContactEnergy<D> {
    fn name(&self) -> String {
        "contact".into()
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Contact)
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        // An empty sum would be -0.
        self.terms(x, false).iter().fold(0.0, |sum, term| sum + term.energy)
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.gradient.clear();
        let mut finite = true;
        for term in self.terms(x, true) {
            finite &= term.energy.is_finite();
            self.gradient.add(&term.vertices[..term.count], &term.gradient);
        }
        finite
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.gradient.add_to(first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        for (range, vertices) in contacts.ranges().into_iter().zip(contacts.vertices()) {
            let size = vertices.len() / range.len().max(1);
            let each = (size * (size + 1) / 2 * D * D).max(1);
            let mut blocks = vec![0.0; range.len() * each];
            let mut visitor = ContactBlocks::<D> { psd: Psd::Exact, expected: None, out: &mut blocks };
            contacts.visit_packs::<D>(&self.model, x, range, &mut visitor);
            for (vertices, blocks) in vertices.chunks_exact(size.max(1)).zip(blocks.chunks_exact(each)) {
                add_stencil_product::<D>(vertices, blocks, p, y);
            }
        }
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        let mut terms = EvaluatedContacts { with_gradient: false, terms: vec![] };
        contacts.visit_packs::<D>(&self.model, x, 0..contacts.len(), &mut terms);
        let first = terms.terms.iter().position(|term| !term.energy.is_finite())?;
        let gap = ContactReport::<D>::of(contacts, &self.model, x, first);
        Some(Fault::Overlap { pair: self.named_pair(&gap.sides()), gap: gap.gap })
    }
}

impl<const D: usize> TermViews for ContactEnergy<D> {
    fn limit(&self) -> Option<&dyn StepLimit> {
        (self.form == PotentialForm::Barrier).then_some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        if self.form == PotentialForm::Cubic { Some(self) } else { None }
    }

    fn watched(&self) -> Option<&dyn WatchedContacts> {
        (self.form == PotentialForm::Cubic).then_some(self)
    }

    fn touching(&self) -> Option<&dyn TouchingSurfaces> {
        Some(self)
    }

    fn changing(&self) -> Option<&dyn ChangingStencils> {
        Some(self)
    }

    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        Some(self)
    }
}

impl<const D: usize> StepLimit for ContactEnergy<D> {
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        self.first_on_way(x, dx, WayEnd::Gap).map_or(1.0, |first| first.part)
    }

    fn guards_way(&self) -> bool {
        true
    }

    fn obstruction(&self, x: &[f64], dx: &[f64]) -> Option<WayObstruction> {
        let first = self.first_on_way(x, dx, WayEnd::Gap)?;
        let bodies = first.primitives.each_ref().map(|primitive| self.model.body(primitive[0]));
        Some(WayObstruction {
            pair: self.named_pair(&first.primitives),
            vertices: first.primitives.concat(),
            behind: self.nearest_beside(bodies, x).map(|sides| self.named_pair(&sides)),
        })
    }
}

/// Measurements of the cubic form.
impl<const D: usize> Measurements for ContactEnergy<D> {
    /// Adds nothing: [`stiffening`](WatchedContacts::stiffening) bounds every contact, present or future.
    fn add_stiffness_product(&mut self, _: &[f64], _: &[f64], _: &mut [f64]) -> bool {
        false
    }
}

impl<const D: usize> WatchedContacts for ContactEnergy<D> {
    fn extremes(&self, (x, v): (&[f64], &[f64]), inverse_mass: &[f64], time: f64) -> ContactExtremes {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        explicit::extremes::<D>((&self.model, &self.areas), contacts, (x, v), inverse_mass, time)
    }

    fn stiffening(&self, inverse_mass: &[f64]) -> f64 {
        let of = |v: u32| inverse_mass[v as usize * D..][..D].iter().copied().fold(0.0, f64::max);
        explicit::stiffening(
            &self.model,
            &SurfaceMobility::new(&self.model.surface, self.model.names.len(), of),
        )
    }
}

impl<const D: usize> TouchingSurfaces for ContactEnergy<D> {
    fn crossing(&self, from: &[f64], to: &[f64]) -> Option<Fault> {
        if self.allows_crossing {
            return None;
        }
        let dx: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        let first = self.first_on_way(from, &dx, WayEnd::Crossing)?;
        Some(Fault::Crossing { pair: self.named_pair(&first.primitives) })
    }

    fn pairs(&self, x: &[f64], v: &[f64]) -> Vec<TouchingPair> {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        let pair = |i| {
            let report = ContactReport::<D>::of(contacts, &self.model, x, i);
            let vertices = expected::key(&report.vertices[..report.count]);
            TouchingPair { vertices, slides: report.slides(self.model.threshold_speed, v) }
        };
        (0..contacts.len()).map(pair).collect()
    }

    fn contacts(&self, x: &[f64], v: &[f64]) -> Vec<SurfaceContact> {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        let described = |i| {
            let report = ContactReport::<D>::of(contacts, &self.model, x, i);
            report.described(&self.model, x, v)
        };
        (0..contacts.len()).map(described).collect()
    }

    fn add_shares(&self, x: &[f64], v: &[f64], shares: &mut [ContactShare]) {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        for report in ContactReport::<D>::of_all(contacts, &self.model, x) {
            report.add_shares(self.model.threshold_speed, v, shares);
        }
        self.model.surface.each_area(x, |vertex, area, normal| {
            let share = &mut shares[vertex as usize];
            let size = dot(&share.push, &share.push).sqrt();
            // A vertex without a push, or between two that cancel, has its whole area.
            let part = if size > 0.0 { dot(&share.push, &normal).abs() / size } else { 1.0 };
            share.area += part * area;
        });
        self.model.surface.projected_areas().for_each(|(vertex, area)| shares[vertex as usize].area += area);
    }

    fn nearest(&self, x: &[f64], time: f64) -> Option<LeastGap> {
        let mut search = locked(&self.search);
        let contacts = search.contacts_at(&self.model, x);
        let mut nearest = NearestContact::default();
        for i in 0..contacts.len() {
            let report = ContactReport::<D>::of(contacts, &self.model, x, i);
            nearest.look_at(&report, &self.model);
        }
        nearest.described(&self.model, time)
    }

    fn conflict(&self, x: &[f64]) -> Option<String> {
        crate::start::conflict::<D>(&self.model, x)
    }

    fn shaped(&self) -> Option<&dyn ShapedContact> {
        // Activation distances shortened for self-contact depend on the reference configuration, too.
        self.model.shortened.is_empty().then_some(self)
    }
}

impl<const D: usize> ContactEnergy<D> {
    /// Visits every contact, and every friction pair, in terms of the reference configuration.
    fn each_shaped(&self, at: ContactPlace<'_>, visit: &mut dyn FnMut(&ShapedPair<'_, D>)) {
        let mut search = locked(&self.search);
        let reach = search.reach;
        let mut show = |search: &mut ContactSearch<D>, x: &[f64], of: ForceOfContact<'_>| {
            let one = Contacts::default();
            let mut sink = ShapeSink { model: &self.model, x, of, one, visit: &mut *visit };
            let candidates = search.candidates_at(&self.model, x);
            let planes = Contacts::find_each::<D>(&self.model, candidates, x, reach, &mut sink);
            sink.planes(&planes);
        };
        show(&mut search, at.x, ForceOfContact::Energy);
        if self.model.laws.has_friction() {
            let x = at.held.unwrap_or(at.x);
            let contacts = search.contacts_at(&self.model, x).clone();
            show(&mut search, x, ForceOfContact::Friction(at.v, &contacts));
        }
    }
}

impl<const D: usize> ShapedContact for ContactEnergy<D> {
    fn add_work_by_shape(&self, at: ContactPlace<'_>, p: &[f64], rest: &[f64], rows: &mut [f64]) {
        let surface = &self.model.surface;
        let mut by = AreaRates::zero(surface);
        self.each_shaped(at, &mut |pair| pair.add_work(surface, p, &mut by));
        surface.add_by_rest(&by, rest, rows);
    }

    fn add_gradient_by_shape(&self, at: ContactPlace<'_>, change: &[f64], rest: &[f64], rows: &mut [f64]) {
        let surface = &self.model.surface;
        let mut changes = surface.area_changes(change, rest);
        self.each_shaped(at, &mut |pair| pair.add_change(surface, &mut changes, rows));
    }
}

impl<const D: usize> ChangingStencils for ContactEnergy<D> {
    fn begin_step(&mut self, _: &[f64], v: &[f64], dt: f64) -> bool {
        let square = |row: &[f64]| row.iter().map(|v| v * v).sum::<f64>();
        let fastest = v.chunks_exact(D).map(square).fold(0.0, f64::max).sqrt();
        let [solved, explicit] = STEPS_AHEAD;
        let steps = if self.form == PotentialForm::Cubic { explicit } else { solved };
        locked(&self.search).expect_motion(steps * fastest * dt);
        false
    }

    fn find(&mut self, x: &[f64]) -> bool {
        let mut search = locked(&self.search);
        self.contacts.clone_from(search.contacts_at(&self.model, x));
        self.lists.replace(self.contacts.vertices())
    }

    fn follow(&mut self, x: &[f64], step: &[f64]) {
        if self.form != PotentialForm::Barrier {
            return;
        }
        let mut search = locked(&self.search);
        let mut forecast = ForceForecast::new(&search.expected, step);
        self.contacts.visit_packs::<D>(&self.model, x, 0..self.contacts.len(), &mut forecast);
        search.expected = Arc::new(forecast.end());
    }

    /// Vertex pairs of primitives of different pieces that are closer than a typical edge length plus the
    /// reach at `x`. Farther pieces and self-folding have none.
    fn likely_pairs(&self, x: &[f64]) -> Vec<[u32; 2]> {
        let (model, surface) = (&self.model, &self.model.surface);
        let piece = surface.pieces();
        let mut allowed = model.pairs.clone();
        for (body, divided) in (0..).zip(surface.divided(&piece, model.names.len())) {
            allowed.set(body, body, divided && allowed.touch(body, body));
        }
        let near = typical_edge(surface) + model.surface_reach();
        let found = CandidatePairs::gather::<D>(surface, &allowed, x, None, near);
        let mut pairs = found.vertex_pairs(surface);
        pairs.retain(|pair| piece[pair[0] as usize] != piece[pair[1] as usize]);
        pairs
    }

    fn forget(&mut self) {
        locked(&self.search).expected = Arc::default();
    }

    fn lists(&self) -> &[Stencils] {
        self.lists.all()
    }

    fn blocks(
        &self,
        list: usize,
        stencils: Range<usize>,
        (x, _): (&[f64], &[f64]),
        psd: Psd,
        out: &mut [f64],
    ) {
        let first = self.contacts.ranges()[list].start;
        let expected = locked(&self.search).expected.clone();
        let expected = (!expected.is_empty()).then(|| ExpectedInTurn::new(&expected));
        let mut blocks = ContactBlocks::<D> { psd, expected, out };
        let numbers = first + stencils.start..first + stencils.end;
        self.contacts.visit_packs::<D>(&self.model, x, numbers, &mut blocks);
    }
}
