//! References of problems with known answers, errors that do not cancel, and what is refused.

use std::sync::atomic::AtomicBool;

use super::results::TARGETS;
use super::*;
use crate::quantity::ElementFamily;
use crate::quantity::problems::{COOK, CYLINDER, FALLING_BEAM};
use pliant_scene::Source;

fn refined(
    text: &str,
    change: impl FnOnce(&mut RefinementPlan),
) -> Result<RefinementResults, RefinementError> {
    let source = Source::new("scene", text);
    let mut plan = RefinementPlan::of(&source.scene().map_err(StudiedSceneError::Scene)?)?;
    // Time is no part of what is tested: nothing is left out because the machine is slow.
    (plan.budget, plan.repeats) = (1e4, Some(1));
    change(&mut plan);
    RefinementStudy { source: &source, plan: &plan, interrupt: &AtomicBool::new(false) }.run(&mut |_| {})
}

fn of(names: &[&str]) -> Vec<crate::quantity::QuantityOfInterest> {
    names.iter().map(|name| name.parse().unwrap_or_else(|error| panic!("{error}"))).collect()
}

#[test]
fn the_falling_beam_has_the_limit_of_an_independent_program() {
    let results = refined(FALLING_BEAM, |plan| {
        plan.quantities = of(&["tip.y", "left.force.y mean"]);
        plan.contenders.retain(|contender| contender.name() != "gauss2");
    });
    let results = results.unwrap();
    let tip = &results.quantities[0];
    let reference = tip.reference.as_ref().unwrap();
    // Four meshes and Richardson gave -3.66640 m +- 7e-4.
    let truth = -3.666_402_662_758_9;
    assert!((reference.value - truth).abs() <= reference.uncertainty + 7e-4, "{reference:?}");
    assert!(reference.agrees && reference.uncertainty < 4e-3, "{reference:?}");
    // Floors of the same program: linear triangles on 8x2, 16x4 and 32x8 cells.
    for (level, error) in [(0, 0.229), (1, 0.0689), (2, 0.0188)] {
        // That of the largest error over time; at the end it is less.
        let own = tip.floor(ElementFamily::Linear, level, &results.rows).unwrap();
        assert!(own < error && own > 0.4 * error, "{level}: {own}");
    }
    // Quadratic triangles reach 1 % with 8x2 cells, linear ones do not with 32x8.
    let best = |family| {
        let own = tip.errors.iter().filter(|error| results.rows[error.row].family == family);
        own.map(|error| error.total).fold(f64::INFINITY, f64::min)
    };
    assert!(best(ElementFamily::Linear) > 0.01 && best(ElementFamily::Quadratic) < 0.002);
    for (cheapest, target) in tip.cheapest.iter().zip(TARGETS) {
        match cheapest.row {
            Some(row) => {
                let error = tip.errors[row].total;
                assert!(error <= target && Some(error) == cheapest.reached, "{cheapest:?}");
            }
            None => assert!(target * tip.scale < 3.0 * reference.uncertainty, "{cheapest:?}"),
        }
    }
    // No step leads below the error of its mesh.
    for error in &tip.errors {
        let row = &results.rows[error.row];
        let floor = tip.floor(row.family, row.level, &results.rows).unwrap();
        assert!(error.total >= floor && error.total >= error.net, "{row:?}: {error:?}");
    }
    // Orders in time: 1 of implicit Euler, 2 of TR-BDF2.
    let order = results.order_in_time("implicit-euler", 0).unwrap();
    assert!((order - 1.0).abs() < 0.25, "{order}");
    // What is on the front is beaten by nobody.
    for front in &tip.front {
        let (own, time) = (tip.errors[*front].total, results.rows[*front].seconds);
        let beats =
            |error: &&RowError| error.told && error.total < own && results.rows[error.row].seconds < time;
        assert_eq!(tip.errors.iter().filter(beats).count(), 0);
    }
    let drawn = chart(&results, tip).svg().unwrap();
    assert!(
        drawn.contains("linear triangles") && drawn.contains("  implicit") && drawn.contains("front"),
        "{drawn}"
    );
}

#[test]
fn closed_forms_are_within_the_uncertainty_and_orders_are_those_of_the_elements() {
    let results =
        refined(CYLINDER, |plan| plan.quantities = of(&["inner.x", "outer.x", "energy.elastic"])).unwrap();
    // Lame; twice 1/2 p u(1) 2 pi / 4.
    let truths = [1.906_666_666_666_667e-3, 1.213_333_333_333_333e-3, 1.497_492_498e-3];
    for (quantity, truth) in results.quantities.iter().zip(truths) {
        let reference = quantity.reference.as_ref().unwrap();
        let error = (reference.value - truth).abs();
        assert!(error <= reference.uncertainty, "{}: {reference:?}, error {error}", quantity.quantity);
        assert!(reference.agrees && reference.uncertainty < 1e-4 * truth, "{reference:?}");
    }
    let energy = &results.quantities[2];
    for (ladder, order) in energy.ladders.iter().zip([2.0, 4.0, 2.0, 4.0]) {
        let observed = ladder.estimate.as_ref().unwrap().order;
        assert!((observed - order).abs() < 0.1, "{:?}: {observed}", ladder.family);
    }
    // In statics a mesh is a row, and its error is the mesh's.
    assert_eq!(results.rows.len(), 12);
    assert!(energy.errors.iter().all(|error| error.net == error.total));
}

#[test]
fn cooks_membrane_rises_as_an_independent_program_has_it() {
    let results = refined(COOK, |plan| {
        plan.quantities = of(&["middle.y"]);
        plan.levels = 4;
    });
    let results = results.unwrap();
    let reference = results.quantities[0].reference.as_ref().unwrap();
    assert!((reference.value - 23.967_74).abs() <= reference.uncertainty, "{reference:?}");
    assert!(reference.agrees && reference.uncertainty < 0.02, "{reference:?}");
}

/// Runs of two kinds of elements whose values converge to limits of their own.
fn two_kinds(limits: [f64; 2]) -> QuantityRefinement {
    let families = [ElementFamily::Linear, ElementFamily::Quadratic];
    let row = |family, level: usize, value: f64| RefinedRow {
        family,
        level,
        cells: format!("{}", 1 << level),
        unknowns: 1 << level,
        scheme: "quasi-static",
        order: 0,
        explicit: false,
        step: None,
        values: vec![value],
        largest: vec![value.abs()],
        seconds: (1 << level) as f64,
        statistics: Default::default(),
        is_floor: true,
        keys: vec![],
    };
    let rows: Vec<RefinedRow> = families
        .into_iter()
        .zip(limits)
        .flat_map(|(family, limit)| {
            (0..3).map(move |level| row(family, level, limit + 0.008 * 0.25_f64.powi(level as i32)))
        })
        .collect();
    let mut evaluated = QuantityRefinement::new(0, &of(&["tip.x"])[0], &rows, true);
    evaluated.compare(&rows);
    evaluated
}

#[test]
fn references_that_do_not_agree_give_no_advice_below_ten_times_their_difference() {
    let agreed = two_kinds([1.0, 1.0]);
    let reference = agreed.reference.as_ref().unwrap();
    assert!(reference.agrees && (reference.value - 1.0).abs() < 1e-12, "{reference:?}");
    assert!(agreed.cheapest[1].row.is_some(), "{:?}", agreed.cheapest);
    let apart = two_kinds([1.0, 1.1]);
    let reference = apart.reference.as_ref().unwrap();
    assert!(!reference.agrees && (reference.known() - 0.1).abs() < 1e-9, "{reference:?}");
    for cheapest in &apart.cheapest {
        let reason = cheapest.reason.as_ref().unwrap();
        assert!(cheapest.row.is_none() && reason.contains("differ by 10 %"), "{reason}");
    }
}

#[test]
fn what_is_no_continuum_problem_is_refused() {
    let refused = |from: &str, to: &str| {
        assert!(FALLING_BEAM.contains(from), "{from}");
        refined(&FALLING_BEAM.replace(from, to), |_| {}).unwrap_err().to_string()
    };
    let elastic = "elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }";
    let springs = refused(elastic, "springs = { stiffness = 1e5 }");
    assert!(springs.contains("springs, which are no continuum"), "{springs}");
    let contact = refused("[[probe]]", "[contact]\n[[probe]]");
    assert!(contact.contains("what touches differs"), "{contact}");
    let vertices = refused("half_space = { normal = [1.0, 0.0], offset = 0.0 }", "vertices = [0, 1]");
    assert!(vertices.contains("by their numbers"), "{vertices}");
    let text = format!("{FALLING_BEAM}\n[study]\nelements = ['cubic']");
    let elements = refined(&text, |_| {}).unwrap_err().to_string();
    assert!(elements.contains("`cubic`") && elements.contains("quadratic-quadrilateral"), "{elements}");
    let missing = refined(FALLING_BEAM, |plan| plan.quantities = of(&["top.x"])).unwrap_err();
    assert!(matches!(missing, RefinementError::Scene(StudiedSceneError::Missing(_))), "{missing}");
}

#[test]
fn keys_of_a_row_make_the_scene_that_run() {
    let text = FALLING_BEAM.replace("size = [4.0, 1.0]", "size = [4.0, 1.0], element = 'quadrilateral'");
    let results = refined(&text, |plan| {
        plan.quantities = of(&["tip.y"]);
        (plan.levels, plan.contenders) = (1, vec![]);
    });
    let results = results.unwrap();
    for row in &results.rows {
        let (set, without): (Vec<_>, Vec<_>) = row.keys.iter().partition(|key| key.value.is_some());
        let mut scene = text.clone();
        for key in without {
            assert!(key.path.ends_with("element"), "{key}");
            scene = scene.replace(", element = 'quadrilateral'", "");
        }
        let changes: Vec<(String, String)> =
            set.iter().map(|key| (key.path.clone(), key.value.clone().unwrap())).collect();
        let source = Source::new("scene", scene).varied(&changes).unwrap();
        let assembly =
            source.scene().unwrap().assemble(pliant_scene::assembly::UnstableStep::Refuse).unwrap();
        assert_eq!(assembly.report.free_coordinates, row.unknowns, "{:?}", row.keys);
        assert_eq!(Some(assembly.simulation.step_size()), row.step);
    }
    assert_eq!(results.rows.len(), 4);
}

/// A mesh without numbers of cells is cut: the inline square is the grid of as many cells.
#[test]
fn meshes_without_numbers_of_cells_are_cut() {
    let inline = CYLINDER.replace(
        "elliptic_membrane = { cells = [8, 16], inner = [1.0, 1.0], outer = [2.0, 2.0] }",
        "inline = { points = [[0, 0], [1, 0], [1, 1], [0, 1]], triangles = [[0, 1, 2], [0, 2, 3]] }",
    );
    let inline = inline.replace("group = 'bottom'", "half_space = { normal = [0, 1], offset = 0 }");
    let inline = inline.replace("group = 'left'", "half_space = { normal = [1, 0], offset = 0 }");
    let inline = inline.replace("group = 'inner', traction = ['X', 'Y']", "body_force = ['1 + X*Y', '0']");
    let inline = inline.replace("at = [2.0, 0.0]", "at = [1.0, 1.0]");
    let grid = inline.replace(
        "inline = { points = [[0, 0], [1, 0], [1, 1], [0, 1]], triangles = [[0, 1, 2], [0, 2, 3]] }",
        "grid = { cells = [1, 1], size = [1.0, 1.0] }",
    );
    assert!(inline.contains("inline") && grid.contains("grid"));
    let study = |text: &str| {
        let results = refined(text, |plan| {
            plan.quantities = of(&["outer.x"]);
            plan.families = vec![ElementFamily::Linear, ElementFamily::Quadratic];
            plan.levels = 4;
        });
        results.unwrap()
    };
    let (inline, grid) = (study(&inline), study(&grid));
    assert_eq!(inline.rows.len(), 8);
    let unknowns =
        |results: &RefinementResults| -> Vec<usize> { results.rows.iter().map(|row| row.unknowns).collect() };
    assert_eq!(unknowns(&inline), unknowns(&grid));
    let cells: Vec<&str> = inline.rows.iter().map(|row| row.cells.as_str()).collect();
    assert_eq!(cells, ["2", "2", "8", "8", "32", "32", "128", "128"]);
    let limits = [&inline, &grid].map(|results| results.quantities[0].reference.clone().unwrap());
    let [of_inline, of_grid] = &limits;
    let known = of_inline.uncertainty + of_grid.uncertainty;
    assert!((of_inline.value - of_grid.value).abs() <= known && of_inline.agrees, "{limits:?}");
    assert!(of_inline.uncertainty < 0.01 * of_inline.value, "{limits:?}");
}

/// NAFEMS LE1: the membrane of two ellipses in plane stress under outward tension of 10 MPa.
#[test]
fn stresses_have_the_limits_of_the_continuous_problem() {
    let traction = "traction = ['1e7*X/3.25^2/sqrt((X/3.25^2)^2+(Y/2.75^2)^2)', \
                    '1e7*Y/2.75^2/sqrt((X/3.25^2)^2+(Y/2.75^2)^2)']";
    let ellipses = CYLINDER
        .replace("cells = [8, 16], inner = [1.0, 1.0], outer = [2.0, 2.0]", "cells = [8, 8]")
        .replace("young = 1000.0, poisson = 0.3", "young = 210e9, poisson = 0.3, plane = 'stress'")
        .replace("group = 'inner', traction = ['X', 'Y']", &format!("group = 'outer', {traction}"))
        .replace("at = [1.0, 0.0]", "at = [2.0, 0.0]");
    // The converged value; Lame's hoop stress at the bore, and inside, where the sum of the principal stresses is
    // 2/3 everywhere. Strains are so small that true stresses are those of small strains.
    let bore = CYLINDER.replace("young = 1000.0", "young = 1e9");
    let inside = bore.replace("at = [1.0, 0.0]", "at = [1.060660171779821, 1.060660171779821]");
    let cases = [
        (ellipses.as_str(), "inner.stress.yy", 92.6576e6, 600.0),
        (bore.as_str(), "inner.stress.yy", 5.0 / 3.0, 0.0),
        (inside.as_str(), "inner.stress.yy", 1.0 / 3.0, 0.0),
    ];
    for (text, of_point, truth, known) in cases {
        let results = refined(text, |plan| plan.quantities = of(&[of_point])).unwrap();
        let quantity = &results.quantities[0];
        let reference = quantity.reference.as_ref().unwrap_or_else(|| panic!("{quantity:?}"));
        let error = (reference.value - truth).abs();
        assert!(error <= reference.uncertainty + known, "{reference:?}, error {error}");
        assert!(reference.uncertainty < 0.02 * truth && quantity.unit == "Pa", "{reference:?}");
    }
}

/// The stress at a corner that points inwards has no limit, and is not given one.
#[test]
fn stresses_at_a_corner_have_no_limit() {
    let corner = "dimension = 2
        time = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }
        [[body]]
        mesh = { inline = { points = [[-1, -1], [0, -1], [-1, 0], [0, 0], [1, 0], [-1, 1], [0, 1], [1, 1]],
            quadrilaterals = [[0, 1, 3, 2], [2, 3, 6, 5], [3, 4, 7, 6]] } }
        refine = 1
        elastic = { linear = { young = 1000.0, poisson = 0.3 } }
        mass = { density = 1.0 }
        pin = [{ half_space = { normal = [0.0, 1.0], offset = -1.0 } }]
        load = [{ half_space = { normal = [-1.0, 0.0], offset = -1.0 }, traction = ['0', '1'] }]
        [[probe]]
        name = 'corner'
        at = [0.0, 0.0]";
    let results = refined(corner, |plan| {
        plan.quantities = of(&["corner.von-mises", "corner.y"]);
        plan.levels = 4;
    });
    let results = results.unwrap();
    let [stress, displacement] = &results.quantities[..] else { panic!("{results:?}") };
    assert!(stress.reference.is_none() && displacement.reference.is_some(), "{stress:?}");
    let reasons: Vec<&str> = stress.ladders.iter().filter_map(|ladder| ladder.reason.as_deref()).collect();
    // Williams' exponent of a corner of 270 degrees is 0.4555, which coarse meshes exceed a little.
    assert!(
        reasons.iter().all(|reason| reason.contains("grows by 1.3") || reason.contains("grows by 1.4")),
        "{reasons:?}"
    );
    assert_eq!(reasons.len(), 2);
}

/// A square whose sides slide (`error.md`, section 4.5): frequencies in plane stress, with consistent masses.
#[test]
fn frequencies_have_the_limits_and_orders_of_the_continuous_problem() {
    let plate = "dimension = 2
        time = { integrator = 'velocity-verlet', step = 1e-4, duration = 0.01 }
        [[body]]
        mesh = { grid = { cells = [8, 8], size = [1.0, 1.0] } }
        elastic = { linear = { young = 1000.0, poisson = 0.3, plane = 'stress' } }
        mass = { density = 1.0 }
        pin = [
            { half_space = { normal = [1.0, 0.0], offset = 0.0 }, axes = ['x'] },
            { half_space = { normal = [-1.0, 0.0], offset = -1.0 }, axes = ['x'] },
            { half_space = { normal = [0.0, 1.0], offset = 0.0 }, axes = ['y'] },
            { half_space = { normal = [0.0, -1.0], offset = -1.0 }, axes = ['y'] },
        ]";
    let results = refined(plate, |plan| {
        plan.quantities = of(&["frequency.1", "frequency.2"]);
        plan.contenders = vec![];
    });
    let results = results.unwrap();
    for (quantity, truth) in results.quantities.iter().zip([13.867_504_905_630_7, 16.574_838_603_294_9]) {
        let reference = quantity.reference.as_ref().unwrap();
        assert!(
            (reference.value - truth).abs() <= reference.uncertainty,
            "{}: {reference:?}",
            quantity.quantity
        );
        assert!(
            reference.agrees && reference.uncertainty < 1e-3 * truth && quantity.unit == "Hz",
            "{reference:?}"
        );
        for (ladder, order) in quantity.ladders.iter().zip([2.0, 4.0, 2.0, 4.0]) {
            let observed = ladder.estimate.as_ref().unwrap().order;
            assert!((observed - order).abs() < 0.2, "{:?}: {observed}", ladder.family);
        }
    }
}

/// A run that takes longer than the budget ends with it, and is named.
#[test]
fn a_budget_ends_the_run_that_exceeds_it() {
    let slow = FALLING_BEAM
        .replace("cells = [8, 2]", "cells = [64, 16]")
        .replace("duration = 1.0", "duration = 1e4");
    let failure = refined(&slow, |plan| plan.budget = 0.2).unwrap_err();
    assert!(matches!(failure, RefinementError::NoRun(crate::quantity::NoValues::Late)), "{failure}");
}
