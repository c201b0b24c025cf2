//! Falling bodies: a ball on points, a sheet on knives and at a sheet, interlinked rings.

use super::LongCase;
use super::chain::LinkedRings;
use super::run::LongRun;
use super::setups::{ball_on_needles, holds, needles, sheet_at_sheet, sheet_on_knives};

pub(super) fn cases() -> Vec<LongCase> {
    let sheet = |case: LongCase| LongCase { material: "stable-neo-hookean", poisson: 0.3, ..case };
    vec![
        sheet(LongCase::new("a sheet of 12 x 12 at 100 m/s does not pass another", |run| flies(run, 12, 4))),
        sheet(LongCase::new("a sheet of 20 x 20 at 100 m/s does not pass another", |run| flies(run, 20, 4))),
        LongCase::new("a ball falls on a hundred needles", |run| on_needles(run, 8, 100)),
        sheet(LongCase::new("a sheet falls on nine knives", |run| on_knives(run, 40, 100))),
    ]
}

pub(super) fn chains() -> Vec<LongCase> {
    let chain = LongCase::new("a chain of ten links", |run| {
        hangs(run, &LinkedRings { links: 10, cells: [48, 6] }, 200)
    });
    vec![LongCase { poisson: 0.3, ..chain }]
}

/// Two sheets, a millimetre thick or of almost no thickness: the flying one stays on its side.
pub(super) fn flies(run: &mut LongRun<'_>, cells: usize, steps: u64) -> Option<()> {
    for radius in [5e-4, 1e-6] {
        let name = format!("sheets of {} m", 2.0 * radius);
        let mut scene = run.begin(&name, &sheet_at_sheet(cells, radius), steps);
        run.take(&mut scene, steps)?;
        let above = scene.centre("flies")[2] - scene.centre("still")[2];
        run.demand(above > 0.0, || format!("{name}: one has passed the other, by {:.3e} m", -above));
        run.end(&mut scene);
    }
    Some(())
}

/// No point enters the ball, which lies on some of them at the end.
pub(super) fn on_needles(run: &mut LongRun<'_>, cells: usize, steps: u64) -> Option<()> {
    let points = needles();
    let mut scene = run.begin("ball", &ball_on_needles(cells), steps);
    let mut most = 0;
    for step in 1..=steps {
        run.take(&mut scene, 1)?;
        most = most.max(scene.contact_count());
        let inside = scene.tetrahedra("ball").into_iter().any(|t| points.iter().any(|p| holds(t, *p)));
        let height = scene.centre("ball")[2];
        if inside || height <= 0.03 {
            run.demand(!inside, || format!("after step {step} a needle is inside the ball"));
            run.demand(height > 0.03, || {
                format!("after step {step} its middle is {height:.3e} m above the needles")
            });
            break;
        }
    }
    run.demand(most >= 4, || format!("it lay on {most} needles"));
    run.end(&mut scene);
    Some(())
}

/// The sheet hangs over the tips, which are 0.2 m high, and no tip has come through.
pub(super) fn on_knives(run: &mut LongRun<'_>, cells: usize, steps: u64) -> Option<()> {
    let mut scene = run.begin("sheet", &sheet_on_knives(cells), steps);
    run.take(&mut scene, steps)?;
    let [low, high] = scene.heights("sheet");
    run.demand(high > 0.19 && low < 0.15, || format!("it hangs from {high} m down to {low} m"));
    run.end(&mut scene);
    Some(())
}

/// Links stay linked, and the chain hangs taut below its highest link.
pub(super) fn hangs(run: &mut LongRun<'_>, chain: &LinkedRings, steps: u64) -> Option<()> {
    let mut scene = run.begin("chain", &chain.text("contact = { distance = 1e-3 }"), steps);
    let start = chain.linking(&scene.x());
    run.demand(start.iter().all(|n| (n.abs() - 1.0).abs() < 1e-9), || format!("linking numbers {start:?}"));
    for _ in 0..steps {
        run.take(&mut scene, 1)?;
        let now = chain.linking(&scene.x());
        let off = now.iter().zip(&start).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        run.measure("linking numbers", off, 1e-9);
    }
    run.demand(chain.slack(&scene.x()) < 0.1, || {
        format!("the lowest link is {} of its depth away from that of a taut chain", chain.slack(&scene.x()))
    });
    run.end(&mut scene);
    Some(())
}
