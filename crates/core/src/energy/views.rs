//! Optional traits of energy terms, each implemented by the terms that support it and found by a query.

use std::ops::Range;

use super::{DeformationExtremes, ElementVisitor, EnergyTerm, Fault, ShapeProducts, Stencils};
use crate::element::{Barycentric, ElementState};
use crate::material::Psd;

/// Optional traits of a term; none by default.
pub trait TermViews {
    /// View as a term made of elements.
    fn elements(&self) -> Option<&dyn ElementTerm> {
        None
    }

    /// View of the gradient, if it lies in memory in a form that steps read directly.
    fn layout(&self) -> Option<&dyn ForceLayout> {
        None
    }

    /// View of the limit on the motion of vertices; `None` if any distance is allowed.
    fn limit(&self) -> Option<&dyn StepLimit> {
        None
    }

    /// View of the dependence on time, and of the power that the term supplies.
    fn driven(&mut self) -> Option<&mut dyn Driven> {
        None
    }

    /// View for measurements, if the term has better answers than its energy and its products.
    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        None
    }

    /// View as a load.
    fn load(&self) -> Option<&dyn LoadTerm> {
        None
    }

    /// View of the ties, if the term ties vertices to fixed positions or to one another.
    fn ties(&mut self) -> Option<&mut dyn TieTerm> {
        None
    }

    /// View of the contacts, if surfaces touch in the term.
    fn touching(&self) -> Option<&dyn TouchingSurfaces> {
        None
    }

    /// View of the contacts, if forces alone keep surfaces apart.
    fn watched(&self) -> Option<&dyn WatchedContacts> {
        None
    }

    /// View of Hessians by predicted stresses; `None` if the exact ones are as good.
    fn predicted(&self) -> Option<&dyn PredictedStresses> {
        None
    }

    /// View of stencils that change from one matrix to the next.
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        None
    }

    /// Mutable view of these stencils, to find them anew.
    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        None
    }
}

/// A term made of elements, which have a deformation and a stress.
pub trait ElementTerm {
    /// Name of the body.
    fn body(&self) -> &str;

    /// Number of elements.
    fn element_count(&self) -> usize;

    /// Passes deformation and stress of every element, with its number in the mesh, to `visit`, in any order.
    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState));

    /// Returns deformation and stress of every element, in the order of the mesh.
    fn element_states(&self, x: &[f64]) -> Vec<ElementState> {
        let mut numbered = Vec::with_capacity(self.element_count());
        self.each_state(x, &mut |number, state| numbered.push((number, state)));
        numbered.sort_by_key(|(number, _)| *number);
        numbered.into_iter().map(|(_, state)| state).collect()
    }

    /// Returns deformation and stress at the point `at` of an element, by its number in the mesh; `None`
    /// if there is no such element.
    fn state_at(&self, x: &[f64], element: usize, at: &Barycentric) -> Option<ElementState>;

    /// Number of nodes of an element.
    fn nodes(&self) -> usize;

    /// Passes every element, evaluated at these points, to `visit`, in any order. Elements with one state
    /// have it at all points.
    fn each_at(&self, x: &[f64], points: &[Barycentric], visit: &mut ElementVisitor<'_>);

    /// Returns the first element whose material is about to leave its domain at `x`, where energies and
    /// forces still are finite. Called only after a failure.
    fn near_fault(&self, x: &[f64]) -> Option<Fault> {
        let _ = x;
        None
    }

    /// Returns products of the shape functions of second-order solid elements, whose consistent masses
    /// are more accurate than lumped ones; `None` for all other elements.
    fn shape_products(&self) -> Option<ShapeProducts> {
        None
    }

    /// Returns the history of the elements, if their law remembers earlier steps.
    fn history(&self) -> Option<&dyn HistoryTerm> {
        None
    }
}

/// Gradients that a step reads in place, without adding them to others.
pub trait ForceLayout: Sync {
    /// Returns the rows that [`add_rows`](EnergyTerm::add_rows) would add for `count` vertices from
    /// `first` on, at most a block of a step, if memory has them in this form. A step reads them in place
    /// if no other term has rows.
    fn rows(&self, first: usize, count: usize) -> Option<&[f64]> {
        let _ = (first, count);
        None
    }

    /// Returns the acceleration [m/s^2], one component per dimension, if the last evaluated force gives
    /// every vertex the same acceleration, whatever its mass; otherwise `None`. A step adds it directly
    /// and does not ask for rows.
    fn acceleration(&self) -> Option<&[f64]> {
        None
    }
}

/// Pair of primitives that limits a step the most.
#[derive(Clone, Debug, PartialEq)]
pub struct WayObstruction {
    /// Description of both.
    pub pair: String,
    /// Vertices of both.
    pub vertices: Vec<u32>,
    /// Description of the nearest contact of one of their bodies with a third.
    pub behind: Option<String>,
}

/// A limit on how far vertices may move at once.
pub trait StepLimit {
    /// Returns the largest fraction, in (0, 1], of the step from `x` to `x + dx` that stays where the
    /// energy is finite.
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64;

    /// True if positions beyond the limit have finite energies again, such as those behind a thin obstacle.
    /// Every motion must then respect the limit, that of explicit integrators included. An inverted element
    /// is detected by its energy and needs no such limit.
    fn guards_way(&self) -> bool {
        false
    }

    /// Returns the pair that limits the step from `x` to `x + dx` the most; `None` if the full step is
    /// free.
    fn obstruction(&self, x: &[f64], dx: &[f64]) -> Option<WayObstruction> {
        let _ = (x, dx);
        None
    }
}

/// A history-dependent term: `E(x; z, s)` with history variables `z` of the end of the last step and the time
/// `s` since then. They change at the end of an accepted step only; states store them.
pub trait HistoryTerm {
    /// Returns the history variables `z`.
    fn history(&self) -> Vec<f64>;

    /// Returns the number of history variables.
    fn history_len(&self) -> usize;

    /// Sets the history variables at the time `time` [s].
    fn set_history(&mut self, numbers: &[f64], time: f64);

    /// Updates the history variables at the end of a step to the positions `x` and the time `time` [s].
    /// Returns the energy dissipated by the update [J]: the energy at the same positions before it minus
    /// that after it.
    fn commit(&mut self, x: &[f64], time: f64) -> f64;

    /// Returns the dissipation rate at fixed positions, `-dE/ds` [W].
    fn loss_rate(&self, x: &[f64]) -> f64;

    /// Adds the derivatives of `p . dE/dx` with respect to the history variables.
    fn add_work_by_history(&self, x: &[f64], p: &[f64], by: &mut [f64]);

    /// Transposed derivative of [`commit`](Self::commit) at `x` and the last time set. Given the
    /// derivatives `after` with respect to the variables after the update, adds those with respect to the
    /// positions and to the present variables.
    fn add_commit_transposed(&self, x: &[f64], after: &[f64], by_x: &mut [f64], before: &mut [f64]);
}

/// Elements whose stresses after a Newton step are better predicted than evaluated.
pub trait PredictedStresses {
    /// Writes Hessians like [`stencil_hessians`](EnergyTerm::stencil_hessians), exact except for the
    /// stresses that rotate with `x`: they are those that the linearisation at `from` predicts,
    /// `S = S(from) + dS/dx (x - from)`.
    ///
    /// Pressures in nearly incompressible materials are the bulk modulus times a small change of volume.
    /// After a Newton step this change is in error by the square of the step, and the pressure by that times
    /// the bulk modulus, which makes the exact Hessian indefinite, or leads to huge steps. The predicted
    /// Hessian has no such part and agrees to second order: Magisano, Leonetti, Garcea 2017, "How to improve
    /// efficiency and robustness of the Newton method in geometrically non-linear structural problem
    /// discretized via displacement-based finite elements", Comput. Meth. Appl. Mech. Eng. 313, section 3.
    fn predicted_hessians(&self, stencils: Range<usize>, from: &[f64], x: &[f64], out: &mut [f64]);
}

/// A potential that depends on time, or a force that supplies energy.
pub trait Driven {
    /// Sets the time [s]. All later calls refer to the potential at that time, except
    /// [`add_rows`](EnergyTerm::add_rows), which continues with the last evaluated gradient.
    fn set_time(&mut self, time: f64) {
        let _ = time;
    }

    /// Returns the power of the force, `f . v` [W], at the last time set.
    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let _ = (x, v);
        0.0
    }

    /// Returns a bound on what the term may add at later times to the square of an angular frequency
    /// [1/s^2], in addition to its contribution at the last time set; `inverse_mass` [1/kg] of every
    /// coordinate, zero if it is fixed.
    fn stiffening(&self, inverse_mass: &[f64]) -> f64 {
        let _ = inverse_mass;
        0.0
    }

    /// Returns the history of the term, if its law remembers earlier steps.
    fn history_mut(&mut self) -> Option<&mut dyn HistoryTerm> {
        None
    }
}

/// An external force that is linear in a value: a vector, a pressure, or the tension of a muscle.
pub trait LoadTerm {
    /// Number of components of the value: the dimension for a vector, one for a pressure or a tension.
    fn components(&self) -> usize;

    /// Returns the work `f . p` of the force `f` at `x` along `p`, at the last time set.
    fn work(&self, x: &[f64], p: &[f64]) -> f64;

    /// Adds to `works` the work along `p` of a unit of each component of the value, uniform over the load.
    fn add_unit_works(&self, x: &[f64], p: &[f64], works: &mut [f64]);

    /// Adds to `force` the force that the load would have with this value, a function of the reference
    /// position [m] and the last time set [s]; a single component is read from the first entry. The value
    /// may vary in space and in time only if that of the load does.
    fn add_force_of(&self, value: &dyn Fn([f64; 3], f64) -> [f64; 3], x: &[f64], force: &mut [f64]);

    /// Adds the force at `x`, at the last time set, to `force`.
    fn add_force(&self, x: &[f64], force: &mut [f64]);

    /// Adds to `force` the force of a uniform change of each component of the value.
    fn add_force_by(&self, change: &[f64], x: &[f64], force: &mut [f64]) {
        let mut value = [0.0; 3];
        value.iter_mut().zip(change).for_each(|(value, change)| *value = *change);
        self.add_force_of(&|_, _| value, x, force);
    }

    /// Adds to `rows`, flat over all vertices, the derivatives of the work of the force at `x` along `p`
    /// with respect to reference positions, at the last time set. Returns false if they are not
    /// available.
    fn add_work_by_shape(&self, x: &[f64], p: &[f64], rows: &mut [f64]) -> bool {
        let _ = (x, p, rows);
        false
    }

    /// Adds to `force` the change of the force at `x` if reference positions move by `change`, flat over all
    /// vertices: the transpose. Returns false if it is not available.
    fn add_force_by_shape(&self, x: &[f64], change: &[f64], force: &mut [f64]) -> bool {
        let _ = (x, change, force);
        false
    }

    /// Returns the work along `p` of the force [of such a value](Self::add_force_of).
    fn work_of(&self, value: &dyn Fn([f64; 3], f64) -> [f64; 3], x: &[f64], p: &[f64]) -> f64 {
        let mut force = vec![0.0; x.len()];
        self.add_force_of(value, x, &mut force);
        force.iter().zip(p).map(|(f, p)| f * p).sum()
    }
}

/// Queries of measurements: diagnostics, tolerances, the search for the largest frequency.
pub trait Measurements: EnergyTerm {
    /// Returns the energy scale of the term from `x` on [J]: the energy that it is expected to exchange,
    /// with which changes of the total are compared.
    fn scale(&mut self, x: &[f64]) -> f64 {
        self.energy(x).abs()
    }

    /// Evaluates like [`evaluate`](EnergyTerm::evaluate), before a measurement, and also returns the
    /// energy `E(x)` [J] if it is almost free with the gradient. The gradient is bit-identical.
    fn evaluate_with_energy(&mut self, x: &[f64]) -> (bool, Option<f64>) {
        (self.evaluate(x), None)
    }

    /// Adds like [`add_hessian_product`](EnergyTerm::add_hessian_product), for the search for the largest
    /// frequency, which is then corrected by one exact product. A term whose exact products are expensive
    /// may approximate; it then returns true.
    fn add_stiffness_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        self.add_hessian_product(x, p, y);
        false
    }

    /// Releases the memory for these products; no more of them will be requested.
    fn end_stiffness_products(&mut self) {}

    /// Returns the extremes of `det F`; `None` for terms without elements.
    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let _ = x;
        None
    }
}

/// Stencils that are recomputed as vertices move, such as those of contacts. Their blocks are added to
/// the matrix of all other stencils, whose structure is kept.
///
/// The energy or dissipation function itself must not depend on when stencils were last found: they determine
/// only which blocks of the matrix are not zero.
pub trait ChangingStencils: Sync {
    /// Begins a step of `dt` [s] from positions `x` [m] and velocities `v` [m/s]. Returns true if the
    /// stencils changed.
    fn begin_step(&mut self, x: &[f64], v: &[f64], dt: f64) -> bool {
        let _ = (x, v, dt);
        false
    }

    /// Finds the stencils at `x`, before a matrix is assembled there. Returns true if they changed.
    fn find(&mut self, x: &[f64]) -> bool;

    /// Records that the solution of the linear system at `x` is `step`, flat [m], during a nonlinear solve.
    /// From then on the blocks may be adapted to the target of that step, until [`forget`](Self::forget).
    /// Energy and gradient do not change.
    fn follow(&mut self, x: &[f64], step: &[f64]) {
        let _ = (x, step);
    }

    /// Restores exact second derivatives after [`follow`](Self::follow).
    fn forget(&mut self) {}

    /// Returns pairs of vertices that stencils are likely to have in steps from `x` on, to predict the
    /// memory of a matrix. No result depends on this guess.
    fn likely_pairs(&self, x: &[f64]) -> Vec<[u32; 2]> {
        let _ = x;
        vec![]
    }

    /// Returns the stencils last found, in lists of one size each; the vertices of a stencil are
    /// distinct.
    fn lists(&self) -> &[Stencils];

    /// Writes the blocks of some stencils of a list at `(x, v)` to `out`, in the layout of
    /// [`stencil_hessians`](EnergyTerm::stencil_hessians): `d2E/dx2` [N/m] of an energy, `d2R/dv2` [N
    /// s/m] of a dissipation function. `v` is empty for energies. Called from several threads.
    fn blocks(&self, list: usize, stencils: Range<usize>, at: (&[f64], &[f64]), psd: Psd, out: &mut [f64]);
}

/// A term that ties vertices to fixed positions, or to one another, at one rest length.
pub trait TieTerm {
    /// Moves all fixed positions to `place` [m].
    fn move_places(&mut self, place: [f64; 3]);

    /// Adds the derivative of `dE/dx` at the positions `x`, flat, with respect to the rest length [N/m];
    /// nothing for a length of zero, which has no direction.
    fn add_gradient_by_rest_length(&self, x: &[f64], rows: &mut [f64]);
}

/// Two primitives of surfaces that touch.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SurfaceContact {
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// Closest points of the two [m]; third component 0 in 2D. A half-space has the foot point on its
    /// plane, a ball the point on its surface.
    pub points: [[f64; 3]; 2],
    /// Unit vector from the second to the first.
    pub normal: [f64; 3],
    /// Distance of the two minus the radii [m]; negative behind a wall that pushes from its plane on.
    pub gap: f64,
    /// Gap as a fraction of the activation distance: 1 where contact begins.
    pub relative_gap: f64,
    /// Normal force [N].
    pub force: f64,
    /// Friction force on the first [N], at the present velocities: `-mu lambda f1(|v_T|) t` with the
    /// direction `t` in which it slips over the second. The second has the opposite force. Zero in
    /// recordings without it.
    #[serde(default)]
    pub friction: [f64; 3],
}

/// Sums of contact forces at a vertex, and the area of the surface there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactShare {
    /// Sum of its shares of the magnitudes of normal forces [N].
    pub normal: f64,
    /// Sum of its shares of normal forces [N]; third component 0 in 2D.
    pub push: [f64; 3],
    /// Sum of its shares of friction forces on it [N]; third component 0 in 2D.
    pub friction: [f64; 3],
    /// Present area of the surface at the vertex [m^2]: a third of its triangles, a quarter of its
    /// quadrilaterals, in 2D half of its edges, one metre deep. Of a vertex that is pushed, each is projected
    /// along the push: sides of a block have no part in the area that it stands on. Zero for a vertex of no
    /// surface.
    pub area: f64,
}

/// A pair of closest primitives that touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TouchingPair {
    /// Vertices in the system, at most four; unused entries are the largest number.
    pub vertices: [u32; 4],
    /// True if the pair slides, at the friction regularisation velocity or above; false if it sticks;
    /// `None` without friction.
    pub slides: Option<bool>,
}

/// A term in which surfaces touch.
pub trait TouchingSurfaces {
    /// Returns open surfaces that pass through each other on the straight path `from` one configuration
    /// `to` another [m]; `None` if there are none, or if they are allowed to.
    fn crossing(&self, from: &[f64], to: &[f64]) -> Option<Fault>;

    /// Returns all pairs in contact at `x` and their friction state at `v`, flat [m] and [m/s], in a
    /// fixed order.
    fn pairs(&self, x: &[f64], v: &[f64]) -> Vec<TouchingPair>;

    /// Returns all contacts at `x` and `v`, flat [m] and [m/s], in a fixed order.
    fn contacts(&self, x: &[f64], v: &[f64]) -> Vec<SurfaceContact>;

    /// Adds the contact forces at `x` and `v`, flat [m] and [m/s], to the shares of the vertices, as the
    /// closest points divide them, and the areas of the surface.
    fn add_shares(&self, x: &[f64], v: &[f64], shares: &mut [ContactShare]);

    /// Describes an inadmissible state at `x`, flat [m]: surfaces that cross or overlap.
    fn conflict(&self, x: &[f64]) -> Option<String>;

    /// Returns the contact at `x`, flat [m], at `time` [s] with the smallest gap relative to its
    /// activation distance; `None` without contact.
    fn nearest(&self, x: &[f64], time: f64) -> Option<LeastGap>;

    /// View of the dependence on the reference configuration, if it is available.
    fn shaped(&self) -> Option<&dyn ShapedContact> {
        None
    }
}

/// State at which contact is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct ContactPlace<'a> {
    /// Positions, flat [m].
    pub x: &'a [f64],
    /// Velocities, flat [m/s].
    pub v: &'a [f64],
    /// Positions from which friction takes its normal forces and closest points, if they differ from `x`.
    pub held: Option<&'a [f64]>,
}

/// Contact that depends on the reference configuration, through the areas of its primitives.
pub trait ShapedContact {
    /// Adds to `rows`, flat over all vertices, the derivatives with respect to reference positions, at
    /// `rest`, of the work along `p` of the gradients `dE/dx + dR/dv` of contact and of its friction, at
    /// unchanged parameters.
    fn add_work_by_shape(&self, at: ContactPlace<'_>, p: &[f64], rest: &[f64], rows: &mut [f64]);

    /// Adds to `rows` the change of these gradients if reference positions move by `change`, flat (the
    /// transpose).
    fn add_gradient_by_shape(&self, at: ContactPlace<'_>, change: &[f64], rest: &[f64], rows: &mut [f64]);
}

/// Least gap relative to the activation distance, and the surfaces that had it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LeastGap {
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// Distance minus the radii [m]; negative behind a wall that pushes from its plane on.
    pub gap: f64,
    /// Gap as a fraction of the activation distance.
    pub relative: f64,
    /// Time [s].
    pub time: f64,
    /// Largest number of pairs of primitives in contact at one time.
    pub most: u64,
}

/// Contact whose gap closed.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Penetration {
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// Penetration depth, radii included [m].
    pub depth: f64,
    /// Time [s].
    pub time: f64,
}

/// Approach of two surfaces.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Approach {
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// Approach speed [m/s]: that of a vertex before contact forces reduced it.
    pub speed: f64,
    /// Speed above which the gap may close [m/s].
    pub stopped: f64,
    /// Time [s].
    pub time: f64,
}

/// Extremes of contact: the least gap, and the loads on surfaces that only forces keep apart.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContactExtremes {
    /// Least gap; `None` if nothing touched.
    pub least: Option<LeastGap>,
    /// Deepest contact; `None` if no gap closed.
    pub deepest: Option<Penetration>,
    /// Approach closest to the limit of contact, `speed / stopped`; `None` without contact.
    pub hardest: Option<Approach>,
    /// Largest `2 sum mu lambda |c| / m` of a vertex [m/s^2], over its contacts and the vertices that move
    /// with it: times the step it is the smallest friction regularisation velocity that explicit steps
    /// withstand.
    pub friction: f64,
}

impl ContactExtremes {
    /// Merges the extremes: keeps the worse of both, the first if they are equal.
    pub fn merge(&mut self, other: ContactExtremes) {
        self.least = match (self.least.take(), other.least) {
            (Some(one), Some(other)) => {
                let most = one.most.max(other.most);
                let least = if other.relative < one.relative { other } else { one };
                Some(LeastGap { most, ..least })
            }
            (one, other) => one.or(other),
        };
        let depth = |p: &Option<Penetration>| p.as_ref().map_or(0.0, |p| p.depth);
        if depth(&other.deepest) > depth(&self.deepest) {
            self.deepest = other.deepest;
        }
        let part = |a: &Option<Approach>| a.as_ref().map_or(0.0, |a| a.speed / a.stopped);
        if part(&other.hardest) > part(&self.hardest) {
            self.hardest = other.hardest;
        }
        self.friction = self.friction.max(other.friction);
    }
}

/// Term that keeps surfaces apart by forces only: a step may lead through them.
pub trait WatchedContacts {
    /// Returns the worst contacts at positions `x` [m] and velocities `v` [m/s] at `time` [s];
    /// `inverse_mass` [1/kg] of every coordinate, zero if it is fixed.
    fn extremes(&self, state: (&[f64], &[f64]), inverse_mass: &[f64], time: f64) -> ContactExtremes;

    /// Returns a bound on what contact adds to the square of an angular frequency [1/s^2], now or later,
    /// as long as no gap closes.
    fn stiffening(&self, inverse_mass: &[f64]) -> f64;
}
