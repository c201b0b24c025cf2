//! Locking-free elements (nodal averaging).

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Body, NodalIntegrationSpec};
use pliant::material::MaterialSpec;

/// `1 - 2 nu` at least.
const CLOSEST: f64 = 1e-7;

/// `nodal_integration` of `body`, which is at `body_path`.
pub(super) fn nodal(check: &mut Checker, body_path: &KeyPath, nodal: &NodalIntegrationSpec, body: &Body) {
    let path = &body_path.key("nodal_integration");
    let part = nodal.stabilisation_or_default();
    if !check.number(&path.key("stabilisation"), part, "") {
        check.help("0.2 is good for most");
    }
    let mut report = |message: String, help: &str| {
        check.report(Problem::semantic(path.clone(), message).at_key().with_help(help));
    };
    match &body.elastic {
        None => report(
            "`nodal_integration` is one of finite elements: it needs `elastic`, which this body does not \
             have"
                .into(),
            "remove `nodal_integration`, or add `elastic`",
        ),
        Some(material @ MaterialSpec::ExpressedEnergy(_)) => report(
            format!("`{}` cannot be split into two materials of its kind", material.name()),
            "use `order = 2`, or a material of `pliant list materials` with a Poisson's ratio",
        ),
        Some(material) if material.lame().is_none() => report(
            format!(
                "`{}` knows no Poisson's ratio and does not lock: nothing can be split \
                     off",
                material.name()
            ),
            "remove `nodal_integration`",
        ),
        Some(material) if material.check().is_ok() => {
            // 1 - 2 nu = mu / (lambda + mu): what is split off is lost in the rounding of the rest.
            let close = material.lame().is_some_and(|lame| lame.mu < CLOSEST * (lame.lambda + lame.mu));
            if close {
                report(
                    format!("the Poisson's ratio of `{}` is too close to 0.5 to be split", material.name()),
                    "use at most 0.4999999",
                );
            }
        }
        Some(_) => {}
    }
    if body.membrane.is_some() {
        report(
            "`nodal_integration` is for solids, and this body is a `membrane`".into(),
            "remove `nodal_integration`",
        );
    }
    if body.is_quadratic() {
        report(
            "`nodal_integration` is for linear elements, and this body is of `order` 2, whose elements do \
             not lock"
                .into(),
            "remove it, or use `order = 1`",
        );
    }
}
