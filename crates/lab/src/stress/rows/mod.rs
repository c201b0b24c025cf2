//! Rows of the suite: one file each.

mod column;
mod contact;
mod dt_sweep;
mod explicit_guard;
mod impossible;
mod incompressible;
mod long;
mod ratios;
mod release;
mod sliver;
mod spin;
mod twist;
mod units;

use super::{Case, CaseResult};
pub(super) use long::ABOUT as ABOUT_LONG;
use pliant::solver::LinearSolver;

/// Adds the cases of all rows.
pub(super) fn add(cases: &mut Vec<Case>) {
    dt_sweep::add(cases);
    explicit_guard::add(cases);
    twist::add(cases);
    ratios::add(cases);
    incompressible::add(cases);
    sliver::add(cases);
    impossible::add(cases);
    units::add(cases);
    release::add(cases);
    spin::add(cases);
    column::add(cases);
    contact::add(cases);
    long::add(cases);
}

/// Subject of a case.
struct CaseDescription<'a> {
    row: &'static str,
    name: &'a str,
    dimension: usize,
    material: &'a str,
    poisson: Option<f64>,
    integrator: &'a str,
    quick: bool,
}

impl CaseDescription<'_> {
    fn case(self, run: impl Fn() -> CaseResult + Send + Sync + 'static) -> Case {
        let CaseDescription { row, name, dimension, material, poisson, integrator, quick } = self;
        Case {
            row,
            name: name.into(),
            dimension,
            material: material.into(),
            poisson,
            integrator: integrator.into(),
            solver: LinearSolver::Auto,
            quick,
            is_long: false,
            run: Box::new(move |_| run()),
        }
    }
}
