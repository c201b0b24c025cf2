//! Resistance to bending.

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{BendingRest, BendingSpec, Body, OneOrMany};

/// Checks `bending` at `path` of `body`.
pub(super) fn bending(check: &mut Checker, path: &KeyPath, bending: &BendingSpec, body: &Body) {
    if let Some(stiffness) = bending.stiffness {
        check.number(&path.key("stiffness"), stiffness.value, "");
    }
    let (young, thickness) = (bending.young, bending.thickness);
    if young.is_some() != thickness.is_some() || bending.stiffness.is_some() == young.is_some() {
        let message = "`bending` takes either `stiffness`, or `young` [Pa] and `thickness` [m]";
        check.report(Problem::semantic(path.clone(), message).at_key());
    }
    for (key, value, unit) in [("young", young, "Pa"), ("thickness", thickness, "m")] {
        if let Some(value) = value {
            check.number(&path.key(key), value, unit);
        }
    }
    if let Some(poisson) = bending.poisson {
        let path = path.key("poisson");
        if check.number(&path, poisson, "") && bending.stiffness.is_some() {
            let message = "`poisson` goes with `young`: `stiffness` holds it already";
            check.report(Problem::semantic(path, message).at_key());
        }
    }
    if let Some(BendingRest::Angle(angles)) = &bending.rest {
        let path = path.key("rest").key("angle");
        check.one_or_many(&path, angles, "rad", None);
        let all = match angles {
            OneOrMany::One(angle) => std::slice::from_ref(angle),
            OneOrMany::Many(angles) => angles,
        };
        if let Some(angle) = all.iter().find(|a| a.abs() >= std::f64::consts::PI) {
            let message = format!("a rest angle must be between -pi and pi, got {angle:?} [rad]");
            check.report(Problem::semantic(path, message));
        }
    }
    if body.elastic.is_some() && body.membrane.is_none() {
        let message = "`bending` is for membranes, and sheets and strands of springs; the elements of a \
                       solid resist bending already";
        check.report(Problem::semantic(path.clone(), message).at_key());
    }
}
