//! Checks for features without an adjoint.

use pliant::constraint::Hold;
use pliant::integrator::{Method, Scheme};
use pliant::simulation::Simulation;

use crate::GradientError;

/// Refuses a simulation whose steps have no adjoint; called first by [`gradient`](crate::gradient()).
///
/// # Errors
/// [`GradientError::Unsupported`].
pub fn check(simulation: &mut Simulation) -> Result<(), GradientError> {
    let found = obstacle(simulation).or_else(|| obstacle_among_dissipation(simulation));
    match found.or_else(|| obstacle_to_linearisation(simulation)) {
        Some((what, remedy)) => Err(GradientError::Unsupported { what, remedy }),
        None => Ok(()),
    }
}

/// True if the vertices of a constraint rotate.
pub(crate) fn turns(hold: &Hold) -> bool {
    hold.motion().is_some_and(|motion| motion.rotation().is_some())
}

/// First unsupported feature, and its remedy.
fn obstacle(simulation: &Simulation) -> Option<(String, &'static str)> {
    let system = simulation.system();
    let named = |what: &str, remedy| Some((what.to_owned(), remedy));
    if simulation.path().is_some() {
        return named(
            "paths by arc length",
            "the load of a state is an unknown there, found at an arc length that depends on earlier \
             solves, which has no adjoint; use a fixed `step` instead of `arc_length`",
        );
    }
    let axes = |hold: &&Hold| hold.axes()[..system.dimension()].iter().all(|held| *held);
    if system.constraints().iter().filter(|hold| turns(hold)).any(|hold| !axes(&hold)) {
        return named("prescribed rotation of a pin with `axes`", "remove `axes` of the pin");
    }
    if system.constraints().iter().any(|hold| hold.drive().is_some()) {
        return named("pins that `move` has set in motion", "give them a motion in the scene");
    }
    obstacle_among_terms(simulation)
}

/// First force that is not the gradient of an energy, and whose products are not its derivatives.
fn obstacle_among_terms(simulation: &Simulation) -> Option<(String, &'static str)> {
    let mut terms = simulation.system().terms().iter();
    let found = terms.find(|term| term.properties().approximates)?;
    let remedy = "the force of a tree jumps if a particle changes its cell, and it is not the gradient of \
                  an energy; use the direct sum, without `tree`";
    Some((found.name(), remedy))
}

/// First obstacle of a linearised step: its matrix must be that of exact products.
fn obstacle_to_linearisation(simulation: &mut Simulation) -> Option<(String, &'static str)> {
    if !matches!(simulation.method().scheme, Scheme::Linearised(_)) {
        return None;
    }
    const REMEDY: &str = "use `implicit-euler`";
    let system = simulation.system();
    if system.is_damped() && system.has_prescribed_motion() {
        return Some(("linearised steps with damping and prescribed motion".into(), REMEDY));
    }
    // Arbitrary vector without pattern or symmetry.
    let x = simulation.state().x().to_vec();
    let p: Vec<f64> = (0..x.len()).map(|i| (12.9898 * (i as f64 + 1.0)).sin()).collect();
    let unknown = simulation.system_mut().terms_mut().find_map(|term| {
        let mut product = vec![0.0; x.len()];
        term.add_hessian_product(&x, &p, &mut product);
        let is_curved = product.iter().any(|y| *y != 0.0);
        let is_whole = !term.stencils().vertices.is_empty() && term.properties().is_conservative;
        let is_contact = term.touching().is_some() || term.changing().is_some();
        (is_contact || is_curved && !is_whole).then(|| term.name())
    });
    Some((format!("linearised steps with {}", unknown?), REMEDY))
}

/// True if position-dependent quantities of dissipative terms, such as normal forces of friction, are
/// lagged at the beginning of the step in all solves.
pub(crate) fn holds_start(simulation: &mut Simulation) -> bool {
    let solves_stages = match simulation.method().scheme {
        Scheme::Dirk(_) | Scheme::Alpha(_) | Scheme::Bdf2(_) | Scheme::QuasiStatic => true,
        Scheme::Splitting(_) | Scheme::RungeKutta(_) | Scheme::Collocation(_) => false,
        Scheme::Linearised(_) | Scheme::GaussRadau(_) => false,
    };
    solves_stages && simulation.system_mut().most_renewals() == Some(1)
}

/// First dissipative term whose derivative by positions is not known.
fn obstacle_among_dissipation(simulation: &mut Simulation) -> Option<(String, &'static str)> {
    let (x, zero) = (simulation.state().x().to_vec(), vec![0.0; simulation.state().x().len()]);
    let mut y = zero.clone();
    let mut terms = simulation.system_mut().dissipation_mut();
    let unknown = terms.find_map(|term| {
        let known = term.add_position_product(&x, &zero, &zero, &mut y);
        (!known).then(|| term.name())
    });
    let remedy = "damping of elements and of springs, mass-proportional damping, `ether_drag`, and friction \
                  with a given `threshold_speed` have one";
    Some((unknown?, remedy))
}

/// Error of a step to `time` [s] whose adjoint or tangent equations are singular.
pub(crate) fn singular(method: &Method, step: u64, time: f64) -> GradientError {
    match method.scheme {
        Scheme::Linearised(_) => GradientError::Unsupported {
            what: format!(
                "the linearised step {step}, whose matrix is not positive definite and was projected"
            ),
            remedy: "use `implicit-euler`, or a smaller `step`",
        },
        _ => GradientError::Singular { step, time },
    }
}
