//! Contact terms and checks with the dimension chosen at run time, on top of the generic code.

use std::sync::Arc;

use pliant::dissipation::DissipativeTerm;
use pliant::energy::EnergyTerm;

use crate::energy::ContactEnergy;
use crate::friction_term::FrictionTerm;
use crate::model::ContactModel;
use crate::start::{self, BadStart, LeastDistance, StartSurvey};

/// True if this build, `--cfg lecture`, has no contact: scenes with contact are to be refused.
pub const IS_LEFT_OUT: bool = cfg!(lecture);

/// Terms of the contacts of one model.
pub struct ContactTerms {
    /// Contact energy.
    pub energy: Box<dyn EnergyTerm>,
    /// Friction, if any pair has some.
    pub friction: Option<Box<dyn DissipativeTerm>>,
}

/// Options of contact in explicit steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExplicitOptions<'a> {
    /// True if surfaces may cross undetected.
    pub allows_crossing: bool,
    /// Step size [s] and mass [kg] of every vertex, which raise the friction regularisation velocity, see
    /// [`FrictionTerm::raise_threshold`].
    pub borne: Option<(f64, &'a [f64])>,
}

/// Builds energy and friction of the contacts of `model` in 2 or 3 dimensions.
pub fn contact_terms(
    dimension: usize,
    model: Arc<ContactModel>,
    options: ExplicitOptions<'_>,
) -> ContactTerms {
    if IS_LEFT_OUT {
        unreachable!("scenes with contact are refused");
    }
    match dimension {
        2 => terms_in::<2>(model, options),
        _ => terms_in::<3>(model, options),
    }
}

fn terms_in<const D: usize>(model: Arc<ContactModel>, options: ExplicitOptions<'_>) -> ContactTerms {
    let mut energy = ContactEnergy::<D>::new(model);
    energy.allow_crossing(options.allows_crossing);
    let friction = energy.model().laws.has_friction().then(|| {
        let mut friction = FrictionTerm::new(&energy);
        if let Some((step, mass)) = options.borne {
            friction.raise_threshold(step, mass);
        }
        Box::new(friction) as Box<dyn DissipativeTerm>
    });
    ContactTerms { energy: Box::new(energy), friction }
}

/// Defects of an initial configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StartFaults {
    /// Pairs that cross or are closer than their radii allow, each with a description.
    pub pairs: Vec<(BadStart, String)>,
    /// Bodies inside closed ones, the inner first; not determined if `pairs` is not empty.
    pub enclosed: Vec<[u32; 2]>,
}

/// Defects of the positions `x`, flat `(n, dimension)` [m], found by [`start::bad_starts`] and
/// [`start::enclosed_bodies`].
pub fn start_faults(dimension: usize, model: &ContactModel, x: &[f64]) -> StartFaults {
    if IS_LEFT_OUT {
        unreachable!("scenes with contact are refused");
    }
    match dimension {
        2 => start_faults_in::<2>(model, x),
        _ => start_faults_in::<3>(model, x),
    }
}

fn start_faults_in<const D: usize>(model: &ContactModel, x: &[f64]) -> StartFaults {
    let described = |bad: BadStart| {
        let words = bad.described::<D>(model);
        (bad, words)
    };
    let pairs: Vec<_> = start::bad_starts::<D>(model, x).into_iter().map(described).collect();
    let enclosed = if pairs.is_empty() { start::enclosed_bodies::<D>(model, x) } else { vec![] };
    StartFaults { pairs, enclosed }
}

/// Candidates and the smallest gap at `x`, flat `(n, dimension)` [m], found by [`start::survey`].
pub fn survey(dimension: usize, model: &ContactModel, x: &[f64]) -> StartSurvey {
    if IS_LEFT_OUT {
        unreachable!("scenes with contact are refused");
    }
    match dimension {
        2 => start::survey::<2>(model, x),
        _ => start::survey::<3>(model, x),
    }
}

/// Smallest distances of bodies from themselves in the reference configuration, found by
/// [`start::least_distances`].
pub fn least_distances(dimension: usize, model: &ContactModel, rest: &[f64]) -> Vec<Option<LeastDistance>> {
    if IS_LEFT_OUT {
        unreachable!("scenes with contact are refused");
    }
    match dimension {
        2 => start::least_distances::<2>(model, rest),
        _ => start::least_distances::<3>(model, rest),
    }
}
