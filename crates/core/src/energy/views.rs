//! Optional traits of energy terms, each implemented by the terms that support it and found by a query.

use std::ops::Range;

use super::{DeformationExtremes, EnergyTerm, Fault, ShapeProducts, Stencils};
use crate::element::{Barycentric, ElementState};
use crate::material::Psd;

/// The further traits that a term has; none, if it overrides nothing.
pub trait TermViews {
    /// Its elements.
    fn elements(&self) -> Option<&dyn ElementTerm> {
        None
    }

    /// Its gradient, where it lies in memory in a form that steps read directly.
    fn layout(&self) -> Option<&dyn ForceLayout> {
        None
    }

    /// How far vertices may move; `None`: any distance.
    fn limit(&self) -> Option<&dyn StepLimit> {
        None
    }

    /// Its dependence on time, and the power that it supplies.
    fn driven(&mut self) -> Option<&mut dyn Driven> {
        None
    }

    /// Answers to measurements, where the term has better ones than its energy and its products.
    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        None
    }

    /// Its value, where it is a load.
    fn load(&self) -> Option<&dyn LoadTerm> {
        None
    }

    /// Its ties, where it ties vertices to places or to one another.
    fn ties(&mut self) -> Option<&mut dyn TieTerm> {
        None
    }

    /// Its contacts, where surfaces touch in it.
    fn touching(&self) -> Option<&dyn TouchingSurfaces> {
        None
    }

    /// Its contacts, where forces alone keep surfaces apart.
    fn watched(&self) -> Option<&dyn WatchedContacts> {
        None
    }

    /// Its Hessians by predicted stresses; `None` where the exact ones are as good.
    fn predicted(&self) -> Option<&dyn PredictedStresses> {
        None
    }

    /// Its stencils that change from one matrix to the next.
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        None
    }

    /// What it remembers of earlier steps.
    fn history(&self) -> Option<&dyn HistoryTerm> {
        None
    }

    /// What it remembers of earlier steps, to be changed.
    fn history_mut(&mut self) -> Option<&mut dyn HistoryTerm> {
        None
    }

    /// The same, to find them anew.
    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        None
    }
}

/// A term made of elements, in which deformation and stress are known.
pub trait ElementTerm {
    /// Name of the body that they fill.
    fn body(&self) -> &str;

    /// True if the material of the body is in the elements alone, and no part of it at the nodes.
    fn is_whole(&self) -> bool {
        true
    }

    /// Number of elements.
    fn element_count(&self) -> usize;

    /// Shows deformation and stress of every element with its number in the mesh, in any order.
    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState));

    /// Deformation and stress of every element, in the order of the mesh.
    fn element_states(&self, x: &[f64]) -> Vec<ElementState> {
        let mut numbered = Vec::with_capacity(self.element_count());
        self.each_state(x, &mut |number, state| numbered.push((number, state)));
        numbered.sort_by_key(|(number, _)| *number);
        numbered.into_iter().map(|(_, state)| state).collect()
    }

    /// Deformation and stress at the point `at` of an element, by its number in the mesh; `None` if there is
    /// no such element.
    fn state_at(&self, x: &[f64], element: usize, at: &Barycentric) -> Option<ElementState>;

    /// The first element whose material is about to leave its domain at `x`, where energies and forces still
    /// are finite; called only after something went wrong.
    fn near_fault(&self, x: &[f64]) -> Option<Fault> {
        let _ = x;
        None
    }

    /// Products of the shape functions of solid elements of second order, whose consistent masses are more
    /// accurate than lumped ones; `None` for all other elements.
    fn shape_products(&self) -> Option<ShapeProducts> {
        None
    }
}

/// Gradients that a step reads where they are, instead of adding them to others.
pub trait ForceLayout: Sync {
    /// Rows that [`add_rows`](EnergyTerm::add_rows) would add for `count` vertices from `first` on, at most
    /// a
    /// block of a step, where that lies in memory as it is. A step reads it there, if no other term has rows.
    fn rows(&self, first: usize, count: usize) -> Option<&[f64]> {
        let _ = (first, count);
        None
    }

    /// The acceleration [m/s^2], one component per dimension, that the force last evaluated is for every
    /// vertex, whatever its mass. A step adds it as it is and does not ask for rows. `None`: the force is
    /// another for each vertex.
    fn acceleration(&self) -> Option<&[f64]> {
        None
    }
}

/// Two primitives that leave the least of a way free.
#[derive(Clone, Debug, PartialEq)]
pub struct WayObstruction {
    /// Both in words.
    pub pair: String,
    /// Their vertices.
    pub vertices: Vec<u32>,
    /// The nearest contact of one of their bodies with a third, in words.
    pub behind: Option<String>,
}

/// A bound on how far vertices may move at once.
pub trait StepLimit {
    /// The largest part of the step from `x` to `x + dx` that stays where the energy is finite: in (0, 1].
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64;

    /// True if places beyond the limit have finite energies again, as those behind a thin obstacle: every
    /// motion must then ask, that of explicit schemes included. An element that is turned inside out shows in
    /// its energy, and need not guard the way.
    fn guards_way(&self) -> bool {
        false
    }

    /// Obstruction that leaves the least of the way from `x` to `x + dx` free; `None` where all of it is.
    fn obstruction(&self, x: &[f64], dx: &[f64]) -> Option<WayObstruction> {
        let _ = (x, dx);
        None
    }
}

/// A term whose law remembers: `E(x; z, s)` with numbers `z` of the end of the last step and the time `s` since
/// then. They change at the end of a step, and of no step that is rejected; states hold them.
pub trait HistoryTerm {
    /// Its numbers `z`.
    fn history(&self) -> Vec<f64>;

    /// How many they are.
    fn history_len(&self) -> usize;

    /// Says what they are, at the time `time` [s].
    fn set_history(&mut self, numbers: &[f64], time: f64);

    /// Takes the numbers that the step to the positions `x` and the time `time` [s] ends with. Gives the
    /// energy that is lost there [J]: the energy at the same positions before, less that after.
    fn commit(&mut self, x: &[f64], time: f64) -> f64;

    /// Energy that is lost in a second at fixed positions, `-dE/ds` [W].
    fn loss_rate(&self, x: &[f64]) -> f64;

    /// Adds the derivatives of `p . dE/dx` by its numbers.
    fn add_work_by_history(&self, x: &[f64], p: &[f64], by: &mut [f64]);

    /// Takes derivatives `after` by the numbers that [`commit`](Self::commit) would leave at `x` and the time
    /// last said back: adds those by the positions, and by the numbers now.
    fn add_commit_transposed(&self, x: &[f64], after: &[f64], by_x: &mut [f64], before: &mut [f64]);
}

/// Elements whose stresses after a step of Newton's method are better predicted than taken.
pub trait PredictedStresses {
    /// Writes Hessians as [`stencil_hessians`](EnergyTerm::stencil_hessians) does, exact but for the
    /// stresses that turn with `x`: they are those that the linearisation at `from` predicts there, `S =
    /// S(from) + dS/dx (x
    /// - from)`.
    ///
    /// Pressures of what is nearly incompressible are the bulk modulus times a small change of volume. After
    /// a step of Newton's method it is off by the square of the step, and the pressure by that times the bulk
    /// modulus, which makes the exact Hessian indefinite, or points far away. The predicted one has no such
    /// part, and is the same to second order: Magisano, Leonetti, Garcea 2017, "How to improve efficiency and
    /// robustness of the Newton method in geometrically non-linear structural problem discretized via
    /// displacement-based finite elements", Comput. Meth. Appl. Mech. Eng. 313, section 3.
    fn predicted_hessians(&self, stencils: Range<usize>, from: &[f64], x: &[f64], out: &mut [f64]);
}

/// A potential that depends on time, or a force that brings energy in.
pub trait Driven {
    /// Says what time it is [s]. Whatever is asked from then on is about the potential of that time, but for
    /// [`add_rows`](EnergyTerm::add_rows), which goes on with the gradient last evaluated.
    fn set_time(&mut self, time: f64) {
        let _ = time;
    }

    /// The power of its force, `f . v` [W], at the time last said.
    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let _ = (x, v);
        0.0
    }

    /// Bound of what it may yet add to the square of an angular frequency [1/s^2], beside what it does at the
    /// time last said; `inverse_mass` [1/kg] of every coordinate, zero where it is held.
    fn stiffening(&self, inverse_mass: &[f64]) -> f64 {
        let _ = inverse_mass;
        0.0
    }
}

/// A force from outside that is linear in a value: a vector, a pressure, or the tension of a muscle.
pub trait LoadTerm {
    /// Components of the value: as many as dimensions of a vector, one of a pressure or a tension.
    fn components(&self) -> usize;

    /// The work `f . p` of its force `f` at `x` along `p`, at the time last said.
    fn work(&self, x: &[f64], p: &[f64]) -> f64;

    /// Adds to `works` the work along `p` of a unit of each component of the value, the same everywhere on
    /// the load.
    fn add_unit_works(&self, x: &[f64], p: &[f64], works: &mut [f64]);

    /// Adds to `force` what its force would be if this were its value, by the place at rest [m] and the time
    /// last said [s]; of a single component the first is looked at. The value may differ from place to place,
    /// and change with time, only where that of the load does.
    fn add_force_of(&self, value: &dyn Fn([f64; 3], f64) -> [f64; 3], x: &[f64], force: &mut [f64]);

    /// Adds to `force` its force at `x`, at the time last said.
    fn add_force(&self, x: &[f64], force: &mut [f64]);

    /// Adds to `force` that of what is added to each component of the value, the same everywhere on the load.
    fn add_force_by(&self, change: &[f64], x: &[f64], force: &mut [f64]) {
        let mut value = [0.0; 3];
        value.iter_mut().zip(change).for_each(|(value, change)| *value = *change);
        self.add_force_of(&|_, _| value, x, force);
    }

    /// Adds to `rows`, flat of all vertices, how the work of its force at `x` along `p` changes with rest
    /// positions, at the time last said; false where this is not known.
    fn add_work_by_shape(&self, x: &[f64], p: &[f64], rows: &mut [f64]) -> bool {
        let _ = (x, p, rows);
        false
    }

    /// Adds to `force` what is added to its force at `x` where rest positions move by `change`, flat of all
    /// vertices: the transpose; false where this is not known.
    fn add_force_by_shape(&self, x: &[f64], change: &[f64], force: &mut [f64]) -> bool {
        let _ = (x, change, force);
        false
    }

    /// The work along `p` of the force [of such a value](Self::add_force_of).
    fn work_of(&self, value: &dyn Fn([f64; 3], f64) -> [f64; 3], x: &[f64], p: &[f64]) -> f64 {
        let mut force = vec![0.0; x.len()];
        self.add_force_of(value, x, &mut force);
        force.iter().zip(p).map(|(f, p)| f * p).sum()
    }
}

/// Answers to measurements: diagnostics, tolerances, the search of the largest frequency.
pub trait Measurements: EnergyTerm {
    /// How much energy this term can be expected to turn over from `x` on [J]: what a change of the total is
    /// compared with.
    fn scale(&mut self, x: &[f64]) -> f64 {
        self.energy(x).abs()
    }

    /// As [`evaluate`](EnergyTerm::evaluate), before a measurement: with the energy `E(x)` [J] where it comes
    /// almost for free with the gradient. The gradient has the same bits as without.
    fn evaluate_with_energy(&mut self, x: &[f64]) -> (bool, Option<f64>) {
        (self.evaluate(x), None)
    }

    /// As [`add_hessian_product`](EnergyTerm::add_hessian_product), for the search of the largest frequency,
    /// which is then corrected by one exact product: a term whose exact products are expensive may
    /// approximate. It then returns true.
    fn add_stiffness_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        self.add_hessian_product(x, p, y);
        false
    }

    /// No more of these products will be asked for: memory for them can go.
    fn end_stiffness_products(&mut self) {}

    /// Extremes of `det F`; `None` for terms without elements.
    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let _ = x;
        None
    }
}

/// Stencils that are found anew as vertices move: of contacts. Their blocks are added to the matrix of all
/// other stencils, whose structure is kept.
///
/// The energy or dissipation function itself must not depend on when stencils were found last: they say which
/// blocks of the matrix are not zero, and nothing else.
pub trait ChangingStencils: Sync {
    /// Begins a step of `dt` [s] from positions `x` [m] and velocities `v` [m/s]; whether the stencils are
    /// others now.
    fn begin_step(&mut self, x: &[f64], v: &[f64], dt: f64) -> bool {
        let _ = (x, v, dt);
        false
    }

    /// Finds the stencils at `x`, before a matrix is assembled there; whether they are others than before.
    fn find(&mut self, x: &[f64]) -> bool;

    /// Takes note that the solution of the linear system at `x` is `step`, flat [m], while a nonlinear one is
    /// being solved: from then on its blocks may lead to where that points, until it [forgets](Self::forget).
    /// Energy and gradient are the same all the while.
    fn follow(&mut self, x: &[f64], step: &[f64]) {
        let _ = (x, step);
    }

    /// Ends that: blocks are second derivatives again.
    fn forget(&mut self) {}

    /// Pairs of vertices that stencils are likely to have in steps from `x` on, for a prediction of what a
    /// matrix takes: a guess, which no result depends on.
    fn likely_pairs(&self, x: &[f64]) -> Vec<[u32; 2]> {
        let _ = x;
        vec![]
    }

    /// The stencils last found, lists of one size each; the vertices of a stencil are distinct.
    fn lists(&self) -> &[Stencils];

    /// Writes the blocks of some stencils of a list at `(x, v)` to `out`, as
    /// [`stencil_hessians`](EnergyTerm::stencil_hessians) lays them out: of `d2E/dx2` [N/m] for an energy, of
    /// `d2R/dv2` [N s/m] for a dissipation function. `v` is empty where nothing dissipates. Called from
    /// several threads.
    fn blocks(&self, list: usize, stencils: Range<usize>, at: (&[f64], &[f64]), psd: Psd, out: &mut [f64]);
}

/// A term that ties vertices to places, or to one another, at one rest length.
pub trait TieTerm {
    /// Moves all of its places to `place` [m].
    fn move_places(&mut self, place: [f64; 3]);

    /// Adds the derivative of `dE/dx` at the positions `x`, flat, by the rest length [N/m]; nothing where the
    /// length is zero, which has no direction.
    fn add_gradient_by_rest_length(&self, x: &[f64], rows: &mut [f64]);
}

/// Two primitives of surfaces that touch.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SurfaceContact {
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// Closest points of the two [m]; third component 0 in 2D. Of a half-space the foot on its plane, of a
    /// ball that on its surface.
    pub points: [[f64; 3]; 2],
    /// Unit vector from the second to the first.
    pub normal: [f64; 3],
    /// Their distance less the radii [m]; below zero behind a wall that pushes from its plane on.
    pub gap: f64,
    /// The part of the reach that the gap is: 1 where they begin to push.
    pub relative_gap: f64,
    /// Normal force [N].
    pub force: f64,
    /// Friction on the first [N], at the present velocities: `-mu lambda f1(|v_T|) t` with the direction `t`
    /// in which it slips over the second; the second has the opposite. Zero in recordings without it.
    #[serde(default)]
    pub friction: [f64; 3],
}

/// A pair of closest primitives that touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TouchingPair {
    /// Its vertices in the system, at most four; the rest is the largest number.
    pub vertices: [u32; 4],
    /// True if it slides, at the threshold speed of friction or above; false where it sticks, `None` where
    /// nothing rubs.
    pub slides: Option<bool>,
}

/// A term in which surfaces touch.
pub trait TouchingSurfaces {
    /// Surfaces without an inside that pass through each other on the straight way `from` one configuration
    /// `to` another [m]; `None` where none do, or where they may.
    fn crossing(&self, from: &[f64], to: &[f64]) -> Option<Fault>;

    /// All pairs that touch at `x` and how they rub at `v`, flat [m] and [m/s], in a fixed order.
    fn pairs(&self, x: &[f64], v: &[f64]) -> Vec<TouchingPair>;

    /// All contacts at `x` and `v`, flat [m] and [m/s], in a fixed order.
    fn contacts(&self, x: &[f64], v: &[f64]) -> Vec<SurfaceContact>;

    /// What cannot be at `x`, flat [m], in words: surfaces that cross or overlap.
    fn conflict(&self, x: &[f64]) -> Option<String>;

    /// The contact at `x`, flat [m], at `time` [s] that has the least part of its distance left; `None` where
    /// nothing touches.
    fn nearest(&self, x: &[f64], time: f64) -> Option<LeastGap>;

    /// Its dependence on the shape at rest, where that is known.
    fn shaped(&self) -> Option<&dyn ShapedContact> {
        None
    }
}

/// Place where contact is looked at.
#[derive(Clone, Copy, Debug)]
pub struct ContactPlace<'a> {
    /// Positions, flat [m].
    pub x: &'a [f64],
    /// Velocities, flat [m/s].
    pub v: &'a [f64],
    /// Positions whose normal forces and closest points friction has, where these are others.
    pub held: Option<&'a [f64]>,
}

/// Contact that goes by the shape at rest, by the areas that its primitives stand for.
pub trait ShapedContact {
    /// Adds to `rows`, flat of all vertices, the derivatives by rest positions, at `rest`, of the work along
    /// `p` of the gradients `dE/dx + dR/dv` of contact and of its friction, laws as they are.
    fn add_work_by_shape(&self, at: ContactPlace<'_>, p: &[f64], rest: &[f64], rows: &mut [f64]);

    /// Adds to `rows` what is added to these gradients where rest positions move by `change`, flat: the
    /// transpose.
    fn add_gradient_by_shape(&self, at: ContactPlace<'_>, change: &[f64], rest: &[f64], rows: &mut [f64]);
}

/// Surfaces that were nearest to each other for the distance from which on they push.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LeastGap {
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// Distance less the radii [m]; below zero behind a wall that pushes from its plane on.
    pub gap: f64,
    /// Its part of the distance from which on they push.
    pub relative: f64,
    /// When [s].
    pub time: f64,
    /// Most pairs of primitives that touched at a time.
    pub most: u64,
}

/// A contact whose gap was closed.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Penetration {
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// How far one was inside of the other, radii included [m].
    pub depth: f64,
    /// When [s].
    pub time: f64,
}

/// Surfaces that came towards each other.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Approach {
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// How fast [m/s]: the speed of a vertex before the forces of contact took a part of it.
    pub speed: f64,
    /// Speed above which its gap may close [m/s].
    pub stopped: f64,
    /// When [s].
    pub time: f64,
}

/// The worst of contact: the least gap, and of surfaces that forces alone keep apart what they bore.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContactExtremes {
    /// Least gap; `None` where nothing touched.
    pub least: Option<LeastGap>,
    /// Deepest contact; `None` where no gap was closed.
    pub deepest: Option<Penetration>,
    /// Approach that took the largest part of what contact stops; `None` where nothing touched.
    pub hardest: Option<Approach>,
    /// Largest `2 sum mu lambda |c| / m` of a vertex [m/s^2], over its contacts and the vertices that move
    /// with it: times the step it is the threshold speed of friction that explicit steps bear.
    pub friction: f64,
}

impl ContactExtremes {
    /// Takes the worse of both; of those that are equal the first.
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

/// A term whose surfaces forces alone keep apart: a step may lead through them.
pub trait WatchedContacts {
    /// The worst contacts at positions `x` [m] and velocities `v` [m/s] at `time` [s]; `inverse_mass` [1/kg]
    /// of every coordinate, zero where it is held.
    fn extremes(&self, state: (&[f64], &[f64]), inverse_mass: &[f64], time: f64) -> ContactExtremes;

    /// Most that contact adds to the square of an angular frequency [1/s^2], now or later, as long as no gap
    /// is closed.
    fn stiffening(&self, inverse_mass: &[f64]) -> f64;
}
