//! K18-long: contact over hundreds and thousands of steps, in scenes that take from seconds to many hours
//! each. [`ABOUT`] has their criteria. `setups` and `chain` are shared with `tests/contact`, which has
//! small versions of these scenes; they depend on no sibling module.

mod chain;
mod falling;
mod pressed;
mod run;
mod setups;
mod standing;
#[cfg(test)]
mod tests;
mod wrung;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::CaseDescription;
use crate::stress::Case;
use crate::stress::limits::Limits;
use pliant::deadline::until;
use run::LongRun;

/// Criteria of the row.
pub(in crate::stress) const ABOUT: &str = "\
    Scenes that take from seconds to many hours on one thread: they run with `--long`, or where `--only` \
    names the row or a case. Every step must be solved, all stay finite, gaps positive, and after \
    each step no primitives may cross, in exact arithmetic, independent of the contact code; energy \
    without a source may be 1 % of the work of prescribed motion and 1e-7 of the energy scale. In \
    addition:\n\n\
    - a sheet that flies a metre in a step stays on its side of the other, with a thickness of 1 mm \
    and of 2 um;\n\
    - no needle gets into the ball, and the sheet hangs over the tips of the knives;\n\
    - the house of cards sags by less than 2 cm and then creeps at 0.1 mm/s at most with mu = 0.9, \
    and lies on the floor after 3 s with 0.1;\n\
    - the keystone of the arch sinks in 20 s by less than what faces creep with mu = 0.5, and falls \
    with 0.2;\n\
    - stiff cubes (1 GPa) stay on each other for 10 s, within what their faces creep; soft ones (0.1 \
    MPa) fall below the height that their column can support;\n\
    - the large cube, 1 m and 10 t, stays above the small one, 0.1 m and 1 kg;\n\
    - the ball, pressed to a tenth of its height and released, keeps at most a millionth of the energy \
    that it stored;\n\
    - rods and mats are twisted by ends that turn against each other, each a turn in 5 s, for 10 s; \
    twisted by half a turn of each end, rods change their energy by 5 % at most with half the step;\n\
    - neighbours in the chain keep Gauss's linking number to 1e-9, and it hangs taut after 2 s.\n\n\
    \"iterations\" counts the Newton iterations of all solved steps, \"worst step\" those of the worst \
    one; \"least gap\" is the smallest gap of all steps, as a fraction of the activation distance; \
    \"error\" is the value of the criterion that came nearest to its tolerance. A case of several \
    scenes counts all of them. Cases are flagged if less than 0.05 of the activation distance was \
    left, if a solve did not settle friction, and if the time budget cut them short: how far they \
    came depends on the machine.";

/// Runs the scenes of a case in turn; `None` if one ended before its criterion could be checked.
type Scenes = Box<dyn Fn(&mut LongRun<'_>) -> Option<()> + Send + Sync>;

/// One long case.
struct LongCase {
    name: String,
    dimension: usize,
    material: &'static str,
    poisson: f64,
    scenes: Scenes,
}

impl LongCase {
    fn new(
        name: impl Into<String>,
        scenes: impl Fn(&mut LongRun<'_>) -> Option<()> + Send + Sync + 'static,
    ) -> LongCase {
        let scenes = Box::new(scenes);
        LongCase { name: name.into(), dimension: 3, material: "neo-hookean", poisson: 0.4, scenes }
    }

    fn case(self) -> Case {
        let LongCase { name, dimension, material, poisson, scenes } = self;
        let description = CaseDescription {
            row: "K18-long",
            name: &name,
            dimension,
            material,
            poisson: Some(poisson),
            integrator: "implicit-euler",
            quick: false,
        };
        let run = move |limits: &Limits<'_>| {
            let all = |stop: &Arc<AtomicBool>| {
                let mut run = LongRun::new(stop);
                // A case that ended early has a note about it.
                let _ = scenes(&mut run);
                run.finish()
            };
            until(|| limits.are_over(), all)
        };
        Case { is_long: true, run: Box::new(run), ..description.case(Default::default) }
    }
}

pub(super) fn add(cases: &mut Vec<Case>) {
    let all = [falling::cases(), standing::cases(), pressed::cases(), wrung::cases(), falling::chains()];
    cases.extend(all.into_iter().flatten().map(LongCase::case));
}
