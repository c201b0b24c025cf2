//! A model that gives its energy density alone has the same stress and Hessian as with closed forms.

use super::{EnergyAlone, Probe, difference, eigenvalues, flat, models, samples, stress_scale};
use crate::algebra::tests::sample::largest;
use crate::material::{Domain, Material, MaterialSpec, MaterialVisitor, Psd};

struct Alone;

impl<const D: usize> MaterialVisitor<D> for Alone {
    type Output = Box<dyn Probe<D>>;
    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        Box::new(EnergyAlone(material))
    }
}

/// Calls `check` with every model, the model's energy density alone, and deformations of its domain.
fn with_every_model<const D: usize>(
    check: impl Fn(&MaterialSpec, &dyn Probe<D>, &dyn Probe<D>, &crate::algebra::Mat<f64, D>),
) {
    for (spec, model) in models::<D>() {
        let alone = spec.visit(Alone);
        for f in samples::<D>(model.domain() == Domain::Everywhere) {
            check(&spec, &*model, &*alone, &f);
        }
    }
}

// lecture 1 and 20
#[test]
fn derivatives_of_an_energy_alone_are_those_in_closed_form() {
    fn check<const D: usize>() {
        with_every_model::<D>(|spec, model, alone, f| {
            let error = largest(&(model.pk1(f) - alone.pk1(f))) / stress_scale(model, f);
            assert!(error < 1e-11, "{} {D}D: stress off by {error:e} {f:?}", spec.name());
            let (closed, found) = (model.hessian(f, Psd::Exact), alone.hessian(f, Psd::Exact));
            let error = difference(&closed, &found);
            assert!(error < 1e-9, "{} {D}D: Hessian off by {error:e} {f:?}", spec.name());
        });
    }
    check::<2>();
    check::<3>();
}

// Projection on a convex cone does not increase the distance of two tensors.
#[test]
fn the_numeric_projection_is_the_analytic_one() {
    fn check<const D: usize>() {
        with_every_model::<D>(|spec, model, alone, f| {
            let size = flat(&model.hessian(f, Psd::Exact)).norm();
            let (analytic, numeric) = (model.hessian(f, Psd::Projected), alone.hessian(f, Psd::Projected));
            let error = (flat(&analytic) - flat(&numeric)).norm() / size;
            assert!(error < 1e-9, "{} {D}D: off by {error:e} {f:?}", spec.name());
            assert!(eigenvalues(&numeric)[0] > -1e-13 * size, "{} {D}D: {f:?}", spec.name());
        });
    }
    check::<2>();
    check::<3>();
}
