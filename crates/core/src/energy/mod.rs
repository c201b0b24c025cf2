//! Additive potentials: the energy of a system is the sum of these terms; forces and Hessians are its
//! derivatives.
//!
//! # How to add one
//! 1. Write a file in this folder that implements `EnergyTerm`; `examples/own_term.rs` is a whole one.
//!    `patch` gives it the loop over stencils, in an order that no thread changes.
//! 2. Implement what it has of `TermViews`: elements, step limit, dependence on time, measurements, history.
//! 3. Implicit integrators need `stencils` and `stencil_hessians`. Stencils that change as vertices move are
//!    `ChangingStencils`; `tests/changing_stencils.rs` compares such a term with a fixed one.
//! 4. A term that is generic over the dimension or a material is built in `crates/terms`, once for all
//!    crates, behind a function that returns `Box<dyn EnergyTerm>`.
//! 5. For scenes: a key (`crates/scene/src/schema`), its check (`validate`), its assembly
//!    (`crates/scene/src/assembly`), its sentence in `uses` of `assembly/report.rs`, and its derivatives
//!    (`crates/gradient/src/parameter` and `names`).
//! 6. Add a case to `tests/element_record.rs`, a scene to the list in `tests/engine/hessian.rs`, a case to
//!    `every_kind_of_force_resumes_with_the_same_bits` (`tests/checkpoints.rs`).

pub mod attachment;
pub mod batch;
pub mod elastic;
mod evaluated;
pub mod gravity;
pub mod gravity_over_time;
pub mod load;
pub mod measure;
pub mod muscle;
pub mod nbody;
pub mod patch;
mod rows;
pub mod spring;
mod views;

use crate::quantity::Rounded;
use std::ops::Range;

use crate::material::Psd;
pub use evaluated::{ElementVisitor, EvaluatedElement};
pub use views::{
    Approach, ChangingStencils, ContactExtremes, ContactPlace, ContactShare, Driven, ElementTerm,
    ForceLayout, HistoryTerm, LeastGap, LoadTerm, Measurements, Penetration, PredictedStresses,
    ShapedContact, StepLimit, SurfaceContact, TermViews, TieTerm, TouchingPair, TouchingSurfaces,
    WatchedContacts, WayObstruction,
};

/// Diagnostic sum to which an energy belongs. Every kind is part of the total.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnergyKind {
    /// Stored by deformation: elements, springs.
    Elastic,
    /// Potential energy in a gravitational field, uniform or mutual.
    Gravitational,
    /// Potential energy of loads, external forces of a scene, and of the tension of muscles.
    Load,
    /// Stored between surfaces that touch.
    Contact,
    /// Energy of a kind unknown to this crate, by its name.
    Other(&'static str),
}

/// Output of a user-defined material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialOutput {
    /// First Piola-Kirchhoff stress.
    Stress,
    /// Energy density.
    Density,
}

impl std::fmt::Display for MaterialOutput {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            MaterialOutput::Stress => "stress",
            MaterialOutput::Density => "density",
        })
    }
}

/// Reason why a configuration has no finite energy or force.
#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// An element left the domain of its material, or its stress is not finite.
    Element {
        /// Name of the body.
        body: String,
        /// Index of the element in the body.
        element: usize,
        /// `det F` there.
        j: f64,
        /// True if a material that withstands inversion would have a finite energy there.
        material_would_help: bool,
    },
    /// A material that is a function of the user gives no finite number inside of its domain.
    Material {
        /// The number that it gives.
        what: MaterialOutput,
        /// Name of the body.
        body: String,
        /// Index of the element in the body.
        element: usize,
        /// `det F` there.
        j: f64,
    },
    /// A sheet in plane stress is stretched so far that its material has no thickness with free faces.
    Sheet {
        /// Name of the body.
        body: String,
        /// Index of the element in the body.
        element: usize,
        /// Largest stretch in its plane.
        stretch: f64,
    },
    /// A spring's force is not finite.
    Spring {
        /// Name of the body.
        body: String,
        /// Index of the spring in the body.
        spring: usize,
        /// Length [m].
        length: f64,
    },
    /// The bending element at these vertices has no finite force.
    Stencil {
        /// Kind of the element: `hinge`, `joint`.
        what: &'static str,
        /// Name of the body.
        body: String,
        /// Index of the element among those of the body.
        index: usize,
    },
    /// Time-dependent gravity has no finite value.
    Gravity {
        /// Time [s].
        time: f64,
    },
    /// A load has no finite value.
    Load {
        /// Description of the load.
        load: String,
        /// Time [s].
        time: f64,
    },
    /// A prescribed motion has no finite value.
    Motion {
        /// Name of the constraint.
        hold: String,
    },
    /// Surfaces are closer to each other than contact allows.
    Overlap {
        /// The two primitives and their bodies.
        pair: String,
        /// Distance between them [m].
        gap: f64,
    },
    /// Prescribed motion is blocked by an obstacle that cannot yield.
    Obstructed(Box<ObstructedMotion>),
    /// Open surfaces passed through each other.
    Crossing {
        /// The two primitives and their bodies.
        pair: String,
    },
    /// The straight path of a step crosses positions that a term does not allow.
    Way {
        /// Name of the term.
        term: String,
    },
    /// Two gravitating bodies are at the same position without softening.
    Pair {
        /// Index of the first vertex.
        first: usize,
        /// Index of the second vertex.
        second: usize,
    },
}

/// Prescribed motion that is blocked.
#[derive(Clone, Debug, PartialEq)]
pub struct ObstructedMotion {
    /// Name of the pin with the motion.
    pub pin: Option<String>,
    /// The two primitives that block each other, and their bodies.
    pub pair: String,
    /// Two further primitives that keep these bodies from yielding.
    pub behind: Option<String>,
}

/// Describes the determinant `j` of a deformation gradient in a message.
fn in_words(j: f64) -> String {
    match j.is_finite() {
        true => format!("J = {}", Rounded::<7>(j)),
        false => "a J that is not finite".into(),
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Fault::Element { body, element, j, .. } => {
                write!(f, "element {element} of `{body}` has {}", in_words(*j))
            }
            Fault::Material { what, body, element, j } => {
                write!(
                    f,
                    "the {what} that the material of `{body}` gives for element {element}, J = {j}, is not \
                     finite",
                    j = Rounded::<7>(*j)
                )
            }
            Fault::Sheet { body, element, stretch } => {
                write!(
                    f,
                    "element {element} of `{body}` is stretched {stretch} times, and its material becomes so \
                     thin there that it withstands no load; membranes of `neo-hookean` and \
                     `stable-neo-hookean` withstand any stretch",
                    stretch = Rounded::<4>(*stretch)
                )
            }
            Fault::Spring { body, spring, length } => {
                write!(f, "spring {spring} of `{body}` has length {length} m", length = Rounded::<7>(*length))
            }
            Fault::Stencil { what, body, index } => {
                write!(f, "{what} {index} of `{body}` has no finite force")
            }
            Fault::Gravity { time } => {
                write!(f, "gravity is not finite at t = {time} s", time = Rounded::<9>(*time))
            }
            Fault::Load { load, time } => {
                write!(f, "{load} is not finite at t = {time} s", time = Rounded::<9>(*time))
            }
            Fault::Motion { hold } => write!(f, "the motion of pin `{hold}` has no finite value"),
            Fault::Overlap { pair, gap } => write!(f, "{pair} are {gap} m apart", gap = Rounded::<4>(*gap)),
            Fault::Obstructed(motion) => {
                let ObstructedMotion { pin, pair, behind } = &**motion;
                if let Some(pin) = pin {
                    write!(f, "the motion of pin `{pin}` is blocked: ")?;
                }
                write!(f, "{pair} block each other")?;
                behind.as_ref().map_or(Ok(()), |behind| write!(f, ", and behind them {behind}"))
            }
            Fault::Crossing { pair } => write!(f, "{pair} cross during the step"),
            Fault::Way { term } => write!(f, "{term} does not allow the straight path of the step"),
            Fault::Pair { first, second } => {
                write!(f, "vertices {first} and {second} attract each other at the same position")
            }
        }
    }
}

/// Extremes of the deformation over the elements of one term.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeformationExtremes {
    /// Smallest `det F`.
    pub min_j: f64,
    /// Number of elements with `det F <= 0`.
    pub inverted: u64,
}

impl DeformationExtremes {
    /// Extremes over no elements.
    pub const NONE: Self = DeformationExtremes { min_j: f64::INFINITY, inverted: 0 };

    /// Returns the extremes over both sets of elements.
    pub fn merge(self, other: Self) -> Self {
        DeformationExtremes {
            min_j: if self.min_j < other.min_j { self.min_j } else { other.min_j },
            inverted: self.inverted + other.inverted,
        }
    }
}

/// Groups of vertices that a term couples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stencils {
    /// Number of vertices of a stencil.
    pub size: usize,
    /// Vertices of the stencils, flat `(stencils, size)`.
    pub vertices: Vec<u32>,
}

/// Adds the product of a stencil's Hessian with `p` to `y`, flat `(n, D)`. The Hessian is given by its blocks
/// `d2E/dx_a dx_b` with `a <= b`, row by row, as in [`ChangingStencils::blocks`].
pub fn add_stencil_product<const D: usize>(vertices: &[u32], blocks: &[f64], p: &[f64], y: &mut [f64]) {
    let mut blocks = blocks.chunks_exact(D * D);
    for (i, a) in vertices.iter().enumerate() {
        for b in &vertices[i..] {
            let Some(block) = blocks.next() else { return };
            let (row, column) = (*a as usize * D, *b as usize * D);
            for k in 0..D {
                for l in 0..D {
                    y[row + k] += block[k * D + l] * p[column + l];
                    if a != b {
                        y[column + l] += block[k * D + l] * p[row + k];
                    }
                }
            }
        }
    }
}

/// Consistent masses for unit density: `integral of N_a N_b` [m^2, m^3] over each reference element, of the
/// shape functions of its vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapeProducts {
    /// Vertices of an element.
    pub nodes: usize,
    /// Vertices of the elements, flat `(elements, nodes)`.
    pub vertices: Vec<u32>,
    /// Products `integral of N_a N_b`, flat `(elements, nodes, nodes)`.
    pub products: Vec<f64>,
}

impl ShapeProducts {
    /// Returns vertices and products, by rows, of each element.
    fn elements(&self) -> impl Iterator<Item = (&[u32], &[f64])> {
        let nodes = self.nodes.max(1);
        self.vertices.chunks_exact(nodes).zip(self.products.chunks_exact(nodes * nodes))
    }

    /// Calls `visit(a, b, product)` for every pair of vertices of every element.
    pub fn each(&self, mut visit: impl FnMut(u32, u32, f64)) {
        for (vertices, products) in self.elements() {
            for (a, row) in vertices.iter().zip(products.chunks_exact(vertices.len())) {
                vertices.iter().zip(row).for_each(|(b, product)| visit(*a, *b, *product));
            }
        }
    }

    /// Calls `visit(a, share)` for every vertex of every element with its lumped share of the element, see
    /// [`MassRule::lumped`](crate::element::MassRule::lumped).
    pub fn each_lumped(&self, mut visit: impl FnMut(u32, f64)) {
        for (vertices, products) in self.elements() {
            let diagonal = || products.iter().step_by(vertices.len() + 1);
            let (volume, trace) = (products.iter().sum::<f64>(), diagonal().sum::<f64>());
            vertices.iter().zip(diagonal()).for_each(|(a, m)| visit(*a, volume * m / trace));
        }
    }
}

/// Constant properties of a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TermProperties {
    /// Diagnostic sum to which the energy belongs.
    pub kind: EnergyKind,
    /// True if each vertex of the term acts on all others: matrices are then full.
    pub couples_all: bool,
    /// True if the term consists of tetrahedra: factors of its Hessian have much more fill-in than those
    /// of sheets and strands.
    pub fills_space: bool,
    /// True if the potential depends on time; [`Driven::set_time`] is called only if it does.
    pub changes_with_time: bool,
    /// True if the term has a [history](ElementTerm::history).
    pub remembers: bool,
    /// True if the force is the gradient of [`energy`](EnergyTerm::energy). If not, the energy is zero, the
    /// gradient still is minus the force, and Hessian products are those of its derivative, which is not
    /// symmetric.
    pub is_conservative: bool,
    /// True if force and Hessian products are independent approximations: the products are not derivatives of
    /// the force.
    pub approximates: bool,
}

impl TermProperties {
    /// Properties of a short-range conservative term that does not depend on time.
    pub const fn of(kind: EnergyKind) -> Self {
        TermProperties {
            kind,
            couples_all: false,
            fills_space: false,
            changes_with_time: false,
            remembers: false,
            is_conservative: true,
            approximates: false,
        }
    }

    /// True if the term supplies external energy: [`Driven::power`] is its rate.
    pub const fn supplies(self) -> bool {
        self.changes_with_time && !self.remembers || !self.is_conservative
    }
}

/// One additive potential `E(x)`, or `E(x, t)`.
///
/// Arrays are flat `(n, dimension)`; the term knows its dimension. Evaluations take `&mut self` because the
/// term owns its scratch memory: a step allocates nothing. The traits of [`TermViews`] have the methods that
/// only some terms support.
pub trait EnergyTerm: TermViews + Send + Sync {
    /// Name for reports, e.g. `corotated elements of beam`.
    fn name(&self) -> String;

    /// Returns the kind of the term and the properties that solvers and measurements need.
    fn properties(&self) -> TermProperties;

    /// Returns the energy `E(x)` [J]; `+inf` outside the domain of a barrier material. Bit-identical for
    /// any number of threads.
    fn energy(&mut self, x: &[f64]) -> f64;

    /// Computes `dE/dx` [N] at `x` and stores it for [`add_rows`](Self::add_rows). Returns true if all of
    /// it is finite. Bit-identical for any number of threads. [`energy`](Self::energy) and the other
    /// measurements do not change the stored gradient.
    fn evaluate(&mut self, x: &[f64]) -> bool;

    /// Adds rows of the last evaluated gradient to `g`, flat `(vertices, dimension)`: as many as `g` has,
    /// from vertex `first` on. A step calls this block by block, from several threads, and every vertex
    /// once. Remaining work per vertex is done here, while the rows are in the cache.
    fn add_rows(&self, first: usize, g: &mut [f64]);

    /// Adds `dE/dx` [N] at `x` to `g`.
    fn add_gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.evaluate(x);
        self.add_rows(0, g);
    }

    /// Adds the product `d2E/dx2 p` [N] of the exact Hessian at `x` to `y`; overwrites the last evaluated
    /// gradient.
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]);

    /// Adds the product with the transposed Hessian, which is equal if the term is
    /// [conservative](TermProperties::is_conservative). Returns `p . dE/dx`, the work of the gradient along
    /// `p`, if it is available at no further cost, otherwise `None`.
    fn add_transposed_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> Option<f64> {
        self.add_hessian_product(x, p, y);
        None
    }

    /// Returns the stencils of the Hessian: groups of vertices, all of the same size, each with a dense
    /// Hessian of its own. Only implicit integrators call this, before
    /// [`stencil_hessians`](Self::stencil_hessians). Stencils that change while a simulation runs are in
    /// [`ChangingStencils`] instead.
    ///
    /// A term without stencils has no second derivative, or omits it from the matrix: Newton's method then
    /// still converges to the right solution, but more slowly.
    fn stencils(&mut self) -> Stencils {
        Stencils::default()
    }

    /// Writes the Hessians [N/m] of these stencils at `x` to `out`: for each stencil of vertices `v_0, v_1,
    /// ..`, for each pair `a <= b` in the order `00, 01, .., 11, ..`, the block `d2E / dx_(v_a) dx_(v_b)`,
    /// `dimension x dimension` by rows. Called from several threads.
    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        let _ = (stencils, x, psd, out);
    }

    /// Returns the first vertex or element at which `x` has no finite energy or force; called only after a
    /// failure.
    fn fault(&self, x: &[f64]) -> Option<Fault>;
}
