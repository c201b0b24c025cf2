//! Grabbing and dragging a vertex during a simulation (lecture 21).

use super::Simulation;
use crate::energy::attachment::{Attachment, AttachmentDashpots, Tie};
use crate::system::TermId;

/// Name of the ties of a grabbed vertex.
const GRAB: &str = "grab";
/// Lowest frequency [rad/s] of the spring with the mass it moves: its sag in gravity of 9.81 m/s^2 is 2.5
/// cm.
const SLOWEST: f64 = 20.0;
/// How often the spring is made four times softer for an explicit integrator.
const SOFTENINGS: u32 = 12;
/// Largest fraction of the velocity that the dashpot may take per explicit step.
const LARGEST_LOSS: f64 = 0.25;

/// Error if a vertex cannot be grabbed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GrabError {
    /// No vertex has this number.
    #[error("there is no vertex {vertex}; the scene has {count}, numbered from 0")]
    NoVertex {
        /// Vertex number in scene order.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// All its coordinates are pinned.
    #[error("vertex {vertex} is pinned; grab a free one, or turn the pin off")]
    Pinned {
        /// The vertex.
        vertex: u32,
    },
    /// The target has another dimension, or is not finite.
    #[error("the target {target:?} is not a point: it needs {dimension} finite coordinates [m]")]
    Target {
        /// The target [m].
        target: Vec<f64>,
        /// Dimension of the scene.
        dimension: usize,
    },
    /// Nothing is grabbed.
    #[error("no vertex is grabbed")]
    NotGrabbed,
}

/// Terms of the grabbed vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct GrabTerms {
    spring: TermId,
    /// Index of the dashpot among the dissipative terms; none before it is removed.
    dashpot: usize,
}

/// Spring and dashpot between the grabbed vertex and its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Stiffness `k` [N/m].
    pub stiffness: f64,
    /// Dashpot constant `c` [N s/m].
    pub dashpot: f64,
}

impl Simulation {
    /// Ties a vertex, in scene order, to `target` [m] by a spring of zero rest length and a dashpot;
    /// releases the vertex grabbed before. Implicit steps solve both with the rest.
    ///
    /// The spring is as stiff as the body at the vertex, and moves `mass` [kg] at 20 rad/s at least; the
    /// dashpot is critical for that mass. For explicit integrators both are weakened until the step is
    /// stable.
    ///
    /// # Errors
    /// [`GrabError`]; nothing is changed then.
    pub fn grab(&mut self, vertex: u32, target: &[f64], mass: f64) -> Result<Grip, GrabError> {
        let place = self.place_of(target)?;
        let (d, count) = (self.system.dimension(), self.system.mass().len());
        if vertex as usize >= count {
            return Err(GrabError::NoVertex { vertex, count });
        }
        let internal = self.numbering.internal(vertex);
        let coordinates = internal as usize * d..(internal as usize + 1) * d;
        if coordinates.clone().all(|i| self.system.inverse_mass()[i] == 0.0) {
            return Err(GrabError::Pinned { vertex });
        }
        self.let_go();
        let own = self.stiffness_at(coordinates);
        let tie = Tie { shares: vec![(internal, 1.0)], place };
        let grip = self.tie(&tie, own.max(SLOWEST * SLOWEST * mass), mass);
        self.changed();
        Ok(grip)
    }

    /// Moves the target of the grabbed vertex.
    ///
    /// # Errors
    /// [`GrabError::NotGrabbed`], [`GrabError::Target`]; nothing is changed then.
    pub fn drag(&mut self, target: &[f64]) -> Result<(), GrabError> {
        let place = self.place_of(target)?;
        let GrabTerms { spring, .. } = self.grab.ok_or(GrabError::NotGrabbed)?;
        self.system.move_places(spring, place);
        self.changed();
        Ok(())
    }

    /// Releases the grabbed vertex; returns whether there was one.
    pub fn let_go(&mut self) -> bool {
        let Some(GrabTerms { spring, dashpot }) = self.grab.take() else { return false };
        self.system.replace_term(spring, None);
        self.system.remove_dissipation(dashpot);
        self.changed();
        true
    }

    fn place_of(&self, target: &[f64]) -> Result<[f64; 3], GrabError> {
        let dimension = self.system.dimension();
        if target.len() != dimension || target.iter().any(|c| !c.is_finite()) {
            return Err(GrabError::Target { target: target.to_owned(), dimension });
        }
        let mut place = [0.0; 3];
        place[..dimension].copy_from_slice(target);
        Ok(place)
    }

    /// Returns the largest second derivative of the energy along an axis at these coordinates [N/m].
    fn stiffness_at(&mut self, coordinates: std::ops::Range<usize>) -> f64 {
        let mut unit = vec![0.0; self.state.x().len()];
        let mut product = unit.clone();
        let mut largest: f64 = 0.0;
        self.system.set_time(self.state.time);
        for i in coordinates {
            unit[i] = 1.0;
            self.system.hessian_product(self.state.x(), &unit, &mut product);
            unit[i] = 0.0;
            // If it is not finite, the minimum stiffness is used.
            largest = largest.max(product[i]);
        }
        if largest.is_finite() { largest } else { 0.0 }
    }

    /// Adds spring and dashpot, weakened until the integrator is stable.
    fn tie(&mut self, tie: &Tie, stiffness: f64, mass: f64) -> Grip {
        let is_limited = self.method.documentation.stability_limit.is_finite();
        let largest = LARGEST_LOSS * self.system.mass()[tie.shares[0].0 as usize] / self.step_size;
        let mut stiffness = stiffness;
        for attempt in 0..=SOFTENINGS {
            let critical = 2.0 * (stiffness * mass).sqrt();
            let dashpot = if is_limited { critical.min(largest) } else { critical };
            self.grab = Some(self.add_grip(tie, Grip { stiffness, dashpot }));
            if !is_limited || attempt == SOFTENINGS || self.is_stable() {
                return Grip { stiffness, dashpot };
            }
            self.let_go();
            stiffness *= 0.25;
        }
        unreachable!("the last attempt returns")
    }

    fn add_grip(&mut self, tie: &Tie, grip: Grip) -> GrabTerms {
        let (d, ties) = (self.system.dimension(), std::slice::from_ref(tie));
        let spring = Attachment::new(GRAB.into(), d, ties, grip.stiffness, 0.0);
        let dashpots = AttachmentDashpots::new(GRAB.into(), d, ties, grip.dashpot).in_all_directions();
        self.system.add_dissipation(Box::new(dashpots));
        let dashpot = self.system.dissipation().len() - 1;
        GrabTerms { spring: self.system.insert_term(Box::new(spring)), dashpot }
    }

    /// True if the step is below the stability limit of the current state. Preserves the limit stored at
    /// the start for messages.
    fn is_stable(&mut self) -> bool {
        let (kept, h) = (self.stability, self.step_size);
        let limit = self.stability_limit(h);
        self.stability = kept;
        limit.is_ok_and(|limit| h <= limit.step)
    }
}
