//! Description of one contact: position, gap and forces.

use pliant::energy::{ContactShare, LeastGap, SurfaceContact};
use pliant::lanes::{Lanes, WIDTH};
use pliant::material::Psd;

use crate::closest::InnerKind;
use crate::contacts::Contacts;
use crate::friction::PairFriction;
use crate::merge::WeightedPair;
use crate::model::{ContactLaw, ContactModel};
use crate::mollifier::{MollifiedPair, mollified_inner_pair};
use crate::pair::PairGeometry;
use crate::vector::rows;
use crate::visit::{ContactVisitor, PackVisitor, PlaneGeometry};

/// Description of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactReport<const D: usize> {
    /// Number of vertices.
    pub count: usize,
    /// Vertices in the system.
    pub vertices: [u32; 4],
    /// Coefficients of the vertices in the vector from the second primitive to the first: those of the
    /// first are positive and add up to 1.
    pub coefficients: [f64; 4],
    /// Unit normal, from the second primitive towards the first.
    pub normal: [f64; D],
    /// Distance minus the radii [m].
    pub gap: f64,
    /// Depth of the half-space's contact plane behind the vertex that carries it [m]; included in the
    /// gap.
    pub depth: f64,
    /// Normal force, `-dE/dd` [N].
    pub force: f64,
    /// Friction coefficient.
    pub friction: f64,
}

impl<const D: usize> Default for ContactReport<D> {
    fn default() -> Self {
        ContactReport {
            count: 0,
            vertices: [0; 4],
            coefficients: [0.0; 4],
            normal: [0.0; D],
            gap: 0.0,
            depth: 0.0,
            force: 0.0,
            friction: 0.0,
        }
    }
}

impl<const D: usize> ContactReport<D> {
    /// Describes contact `i` at `x`, flat [m].
    pub(crate) fn of(contacts: &Contacts, model: &ContactModel, x: &[f64], i: usize) -> Self {
        let mut report = ContactReport::default();
        contacts.visit::<D>(model, x, i, &mut report);
        report
    }

    /// Describes all contacts at `x`, flat [m], in order.
    pub(crate) fn of_all(contacts: &Contacts, model: &ContactModel, x: &[f64]) -> Vec<Self> {
        let mut reports = ContactReports(Vec::with_capacity(contacts.len()));
        contacts.visit_packs::<D>(model, x, 0..contacts.len(), &mut reports);
        reports.0
    }

    /// Vertices of the first primitive and of the second.
    pub fn sides(&self) -> [Vec<u32>; 2] {
        let of = |first: bool| {
            let members = (0..self.count).filter(|i| {
                let c = self.coefficients[*i];
                c != 0.0 && (c > 0.0) == first
            });
            members.map(|i| self.vertices[i]).collect()
        };
        [of(true), of(false)]
    }
}

/// Contact with the smallest relative gap of those examined.
#[derive(Debug, Default)]
pub(crate) struct NearestContact {
    least: Option<([u32; 2], f64, f64)>,
    count: u64,
}

impl NearestContact {
    /// Examines one more contact.
    pub(crate) fn look_at<const D: usize>(&mut self, report: &ContactReport<D>, model: &ContactModel) {
        self.count += 1;
        let Some([a, b]) = report.bodies(model) else { return };
        let relative = report.gap / model.laws.of(a, b).barrier.reach;
        if self.least.is_none_or(|(.., least)| relative < least) {
            self.least = Some(([a, b], report.gap - report.depth, relative));
        }
    }

    /// Description at `time` [s].
    pub(crate) fn described(self, model: &ContactModel, time: f64) -> Option<LeastGap> {
        let (bodies, gap, relative) = self.least?;
        let bodies = bodies.map(|body| model.names[body as usize].clone());
        Some(LeastGap { bodies, gap, relative, time, most: self.count })
    }
}

impl<const D: usize> ContactReport<D> {
    /// Bodies of the first and the second primitive.
    pub(crate) fn bodies(&self, model: &ContactModel) -> Option<[u32; 2]> {
        let body = |side: f64| {
            let first = (0..self.count).find(|i| self.coefficients[*i] * side > 0.0)?;
            Some(model.body(self.vertices[first]))
        };
        Some([body(1.0)?, body(-1.0)?])
    }

    /// Friction with the present normal force and the regularisation velocity `threshold` [m/s]; `None`
    /// without friction.
    pub fn rubbing(&self, threshold: f64) -> Option<PairFriction<f64, D, 4>> {
        // Negative weights subtract duplicates: they have no friction.
        let limit = self.friction * self.force.max(0.0);
        let ContactReport { coefficients, normal, .. } = *self;
        (limit > 0.0).then_some(PairFriction { coefficients, normal, limit, threshold })
    }

    /// True if the contact slides at the velocities `v`, flat [m/s], at `threshold` [m/s] or faster;
    /// `None` without friction.
    pub(crate) fn slides(&self, threshold: f64, v: &[f64]) -> Option<bool> {
        let slip = self.rubbing(threshold)?.slip(&rows::<D, 4>(v, &self.vertices));
        Some(slip.iter().map(|component| component * component).sum::<f64>() >= threshold * threshold)
    }

    /// Friction force on the first primitive at the velocities `v`, flat [m/s]; third component 0 in 2D
    /// [N].
    fn friction_force(&self, threshold: f64, v: &[f64]) -> [f64; 3] {
        let mut force = [0.0; 3];
        if let Some(pair) = self.rubbing(threshold) {
            let on_first = pair.force(&rows::<D, 4>(v, &self.vertices));
            force[..D].copy_from_slice(&on_first);
        }
        force
    }

    /// Adds the forces on its vertices at the velocities `v`, flat [m/s].
    pub(crate) fn add_shares(&self, threshold: f64, v: &[f64], shares: &mut [ContactShare]) {
        let friction = self.friction_force(threshold, v);
        for (vertex, c) in self.vertices.iter().zip(self.coefficients).take(self.count) {
            let share = &mut shares[*vertex as usize];
            share.normal += c.abs() * self.force;
            share.push.iter_mut().zip(self.normal).for_each(|(sum, n)| *sum += c * self.force * n);
            share.friction.iter_mut().zip(friction).for_each(|(sum, friction)| *sum += c * friction);
        }
    }

    /// Contact at the positions `x` and velocities `v`, flat [m] and [m/s], with the names of its bodies.
    pub fn described(&self, model: &ContactModel, x: &[f64], v: &[f64]) -> SurfaceContact {
        let [first, second] = self.sides();
        let body = |side: &[u32]| side.first().map_or(0, |v| model.body(*v));
        let (a, b) = (body(&first), body(&second));
        let barrier = &model.laws.of(a, b).barrier;
        let mut points = [[0.0; 3]; 2];
        for i in 0..self.count {
            let side = usize::from(self.coefficients[i] < 0.0);
            for k in 0..D {
                points[side][k] += self.coefficients[i].abs() * x[self.vertices[i] as usize * D + k];
            }
        }
        let mut normal = [0.0; 3];
        normal[..D].copy_from_slice(&self.normal);
        // Half-spaces and balls are represented by one vertex: their contact point is the foot of the
        // other side's.
        for side in 0..2 {
            let of_side = [a, b][side];
            let is_plane = model.half_spaces.iter().any(|h| h.body == of_side);
            if is_plane || model.balls.iter().any(|ball| ball.body == of_side) {
                let towards = if side == 0 { 1.0 } else { -1.0 };
                let distance = self.gap - self.depth;
                (0..3).for_each(|k| {
                    points[side][k] = points[1 - side][k] + towards * distance * normal[k];
                });
            }
        }
        SurfaceContact {
            bodies: [a, b].map(|body| model.names[body as usize].clone()),
            points,
            normal,
            gap: self.gap - self.depth,
            relative_gap: self.gap / barrier.reach,
            force: self.force,
            friction: self.friction_force(model.threshold_speed, v),
        }
    }
}

impl<const D: usize> ContactVisitor<D> for ContactReport<D> {
    fn pair<const N: usize, const P: usize>(
        &mut self,
        vertices: &[u32; N],
        pair: &PairGeometry<f64, D, N, P>,
        law: &ContactLaw,
        weight: f64,
    ) {
        let of_distance = law.barrier.at(pair.squared_distance, weight);
        self.count = N;
        self.vertices[..N].copy_from_slice(vertices);
        self.coefficients[..N].copy_from_slice(&pair.coefficients);
        self.normal = pair.normal;
        self.gap = pair.distance - law.barrier.offset;
        self.force = -2.0 * pair.distance * of_distance.slope;
        self.friction = law.friction;
    }

    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64) {
        self.count = 2;
        self.vertices[..2].copy_from_slice(vertices);
        self.coefficients[..2].copy_from_slice(&[1.0, -1.0]);
        self.normal = plane.normal;
        (self.gap, self.depth) = (plane.distance - law.barrier.offset, plane.depth);
        self.force = -law.barrier.at_signed(plane.distance, weight).slope;
        self.friction = law.friction;
    }

    fn mollified(&mut self, pair: &MollifiedPair, x: &[[f64; 3]; 4], law: &ContactLaw) {
        // The distance is that of the inner pair; the force fades with the mollifier.
        let found = mollified_inner_pair(x, &pair.inner, &law.barrier, pair.weight, pair.limit, Psd::Exact);
        let inner = pair.inner;
        let points = inner.slots.map(|slot| x[slot]);
        let (c, normal, distance) = match inner.kind {
            InnerKind::PointPoint => {
                flat(&PairGeometry::<f64, 3, 2, 0>::of::<crate::pair::PointPoint>(&[points[0], points[1]]))
            }
            InnerKind::PointEdge => flat(&PairGeometry::<f64, 3, 3, 1>::of::<crate::pair::PointEdge>(&[
                points[0], points[1], points[2],
            ])),
            _ => flat(&PairGeometry::<f64, 3, 4, 2>::of::<crate::pair::EdgeEdge>(&points)),
        };
        (self.count, self.vertices) = (4, pair.vertices);
        self.coefficients = [0.0; 4];
        for i in 0..inner.vertices() {
            self.coefficients[inner.slots[i]] = c[i];
        }
        self.normal.copy_from_slice(&normal[..D]);
        self.gap = distance - law.barrier.offset;
        self.friction = law.friction;
        // m E = m(c) E(d): the ratio to the energy without the mollifier is m.
        let whole = law.barrier.at(distance * distance, pair.weight);
        let part = if whole.energy != 0.0 { found.value / whole.energy } else { 0.0 };
        self.force = -2.0 * distance * whole.slope * part;
    }
}

/// Reports of contacts, in the order visited.
struct ContactReports<const D: usize>(Vec<ContactReport<D>>);

impl<const D: usize> PackVisitor<D> for ContactReports<D> {
    #[inline(always)]
    fn pack<L: Lanes, const N: usize, const P: usize>(
        &mut self,
        pairs: &[WeightedPair<N>],
        geometry: &PairGeometry<L, D, N, P>,
        law: &ContactLaw,
        weight: L,
    ) {
        let of_distance = law.barrier.at(geometry.squared_distance, weight);
        let gaps = (geometry.distance - L::splat(law.barrier.offset)).to_array();
        let forces = (L::splat(-2.0) * geometry.distance * of_distance.slope).to_array();
        let (mut coefficients, mut normal) = ([[0.0; WIDTH]; N], [[0.0; WIDTH]; D]);
        for n in 0..N {
            geometry.coefficients[n].store(&mut coefficients[n]);
        }
        for k in 0..D {
            geometry.normal[k].store(&mut normal[k]);
        }
        for lane in 0..pairs.len() {
            let mut report = ContactReport { count: N, friction: law.friction, ..ContactReport::default() };
            (report.gap, report.force) = (gaps[lane], forces[lane]);
            for n in 0..N {
                report.vertices[n] = pairs[lane].vertices[n];
                report.coefficients[n] = coefficients[n][lane];
            }
            for k in 0..D {
                report.normal[k] = normal[k][lane];
            }
            self.0.push(report);
        }
    }

    fn plane(&mut self, vertices: &[u32; 2], plane: &PlaneGeometry<D>, law: &ContactLaw, weight: f64) {
        let mut report = ContactReport::default();
        report.plane(vertices, plane, law, weight);
        self.0.push(report);
    }

    fn mollified(&mut self, pair: &MollifiedPair, x: &[[f64; 3]; 4], law: &ContactLaw) {
        let mut report = ContactReport::default();
        report.mollified(pair, x, law);
        self.0.push(report);
    }
}

/// Coefficients, normal and distance of a pair in space.
fn flat<const N: usize, const P: usize>(pair: &PairGeometry<f64, 3, N, P>) -> ([f64; 4], [f64; 3], f64) {
    let mut coefficients = [0.0; 4];
    coefficients[..N].copy_from_slice(&pair.coefficients);
    (coefficients, pair.normal, pair.distance)
}
