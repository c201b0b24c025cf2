//! Plan of a study of meshes and steps.

use pliant::integrator::IntegratorSpec;
use pliant_scene::{KeyPath, Problem, Scene};

use super::RefinementError;
use crate::quantity::{ElementFamily, QuantityOfInterest};
use crate::study::Contender;

/// Default number of meshes.
const LEVELS: usize = 3;
/// Default budget [s].
const BUDGET: f64 = 60.0;
/// Default schemes: the usual explicit one, and implicit ones of order 1, 2 and 4.
const USUAL: [&str; 4] = ["velocity-verlet", "implicit-euler", "tr-bdf2", "gauss2"];

/// Plan of a study of meshes and steps.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinementPlan {
    /// Number of meshes, each with twice the cells along every direction of the one before; the first is the
    /// scene's own.
    pub levels: usize,
    /// Elements; those that the scene's mesh has, without any.
    pub families: Vec<ElementFamily>,
    /// Schemes, without effect in statics.
    pub contenders: Vec<Contender>,
    /// Quantities of interest; displacements of all probes at the end, without any.
    pub quantities: Vec<QuantityOfInterest>,
    /// Wall time of the whole study [s].
    pub budget: f64,
    /// Number of timed runs per row; `None`: as many as take a fifth of a second, at most three.
    pub repeats: Option<usize>,
    /// Number of threads for steps.
    pub threads: usize,
}

impl RefinementPlan {
    /// Plan of `scene`, with defaults for everything that its `[study]` does not say.
    ///
    /// # Errors
    /// An entry of `study.elements` or `study.of` is none.
    pub fn of(scene: &Scene) -> Result<RefinementPlan, RefinementError> {
        let spec = scene.study.clone().unwrap_or_default();
        let path = KeyPath::root().key("study");
        let mut problems = vec![];
        let mut families = vec![];
        for (i, name) in spec.elements.iter().enumerate() {
            match ElementFamily::named(name) {
                Some(family) => families.push(family),
                None => {
                    let known = ElementFamily::ALL.map(|family| family.name(scene.dimension)).join(", ");
                    let message = format!("`{name}` is no kind of elements: there are {known}");
                    problems.push(Problem::semantic(path.clone().key("elements").index(i), message));
                }
            }
        }
        let mut quantities = vec![];
        for (i, text) in spec.of.iter().enumerate() {
            match text.parse() {
                Ok(quantity) => quantities.push(quantity),
                Err(error) => {
                    let error: crate::quantity::NoQuantity = error;
                    problems.push(Problem::semantic(path.clone().key("of").index(i), error.to_string()));
                }
            }
        }
        if !problems.is_empty() {
            return Err(RefinementError::Plan(problems));
        }
        let mut contenders: Vec<Contender> = spec.integrators.iter().map(|spec| (*spec).into()).collect();
        if contenders.is_empty() {
            let name = |spec: &&IntegratorSpec| USUAL.contains(&spec.method().documentation.name);
            contenders = IntegratorSpec::ALL.iter().filter(name).map(|spec| (*spec).into()).collect();
            let own = scene.time.integrator.method();
            if contenders.iter().all(|contender| contender.method != own) {
                contenders.push(scene.time.integrator.into());
            }
        }
        Ok(RefinementPlan {
            levels: spec.refine.unwrap_or(LEVELS),
            families,
            contenders,
            quantities,
            budget: BUDGET,
            repeats: None,
            threads: 1,
        })
    }
}
