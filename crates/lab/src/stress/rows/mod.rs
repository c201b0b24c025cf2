//! Rows of the suite: one file each.
//!
//! # How to add a case
//! 1. Write a file here with `add`, and call it in `add` below, or add the case to a file that exists. Its
//!    criterion is a closed form or comes from another program, never from this one.
//! 2. Run it in `crates/lab/src/stress/tests.rs`.
//! 3. A case that takes more than seconds goes into `long`: `is_long`, its scenes in any size, and a small
//!    one in the tests beside it.
//! 4. Write `docs/stress.md` and its pictures anew with a release build, in many hours that may be
//!    interrupted: `pliant stress --long -o out --resume --markdown docs/stress.md`.

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
