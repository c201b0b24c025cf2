//! Ladders with known limits, and where the rule has to refuse.

use super::*;
use serde_json::Value;

/// The finest four values of 84 ladders of plane problems with known limits (cylinder under pressure, plate
/// with a hole, L-shape, beam, NAFEMS LE1; first and second order), by a program that shares nothing with
/// this one, with what its rule said.
fn ladders() -> Vec<Value> {
    serde_json::from_str(include_str!("ladders.json")).unwrap()
}

fn estimated(ladder: &Value) -> Result<LadderEstimate, NoEstimate> {
    let values: Vec<f64> =
        ladder["values"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    let is_singular = ladder["singular"].as_bool().unwrap();
    let kind = if is_singular { LadderKind::SingularMesh } else { LadderKind::Mesh };
    estimate(&values, ladder["formal_order"].as_f64().unwrap(), kind)
}

#[test]
fn ladders_have_the_intervals_of_an_independent_program() {
    for ladder in ladders() {
        let name = ladder["name"].as_str().unwrap();
        let found = estimated(&ladder);
        let Some(interval) = ladder["interval"].as_f64() else {
            assert!(found.is_err(), "{name}: {found:?}");
            continue;
        };
        let found = found.unwrap_or_else(|error| panic!("{name}: {error}"));
        let tier = ["A", "B", "C"][found.tier as usize];
        assert_eq!(tier, ladder["tier"].as_str().unwrap(), "{name}");
        assert!((found.interval - interval).abs() < 1e-6 * interval, "{name}: {found:?}");
        let estimate = ladder["estimate"].as_f64().unwrap();
        assert!((found.estimate.unwrap_or(0.0) - estimate).abs() <= 1e-6 * interval, "{name}: {found:?}");
    }
}

/// One of 81 misses: a peak stress just before its error changes sign.
#[test]
fn intervals_hold_the_truth_but_for_one() {
    let (mut holds, mut misses, mut refused) = (0, vec![], 0);
    for ladder in ladders() {
        match estimated(&ladder) {
            Err(_) => refused += 1,
            Ok(found) if ladder["true_error"].as_f64().unwrap().abs() <= found.interval => holds += 1,
            Ok(_) => misses.push(ladder["name"].as_str().unwrap().to_owned()),
        }
    }
    assert_eq!((holds, refused), (80, 3));
    assert_eq!(misses, ["kirsch_plate T6 s_xx at (0,1)"]);
}

#[test]
fn what_says_nothing_of_a_limit_is_refused() {
    let by = |values: &[f64], kind| estimate(values, 2.0, kind);
    assert_eq!(by(&[1.0, 2.0], LadderKind::Mesh), Err(NoEstimate::TooFew(2)));
    assert_eq!(by(&[1.0, f64::NAN, 2.0], LadderKind::Mesh), Err(NoEstimate::NotFinite));
    // Differences that grow, and alternating ones that do.
    assert!(matches!(by(&[1.0, 2.0, 4.0], LadderKind::Mesh), Err(NoEstimate::NotConverging { .. })));
    assert!(matches!(by(&[1.0, 2.0, 0.0], LadderKind::Mesh), Err(NoEstimate::NotConverging { .. })));
    // Steps that alternate; meshes may.
    assert_eq!(by(&[1.0, 2.0, 1.5], LadderKind::Step), Err(NoEstimate::Alternating));
    assert_eq!(by(&[1.0, 2.0, 1.5], LadderKind::Mesh).map(|found| found.interval), Ok(1.0));
    // What does not depend on the mesh has no error.
    assert_eq!(by(&[3.0; 3], LadderKind::Step).map(|found| found.interval), Ok(0.0));
}

/// `1 + c 4^-i` has the limit 1 by the formula itself.
#[test]
fn a_pure_power_is_extrapolated_exactly() {
    for levels in [3, 4] {
        let values: Vec<f64> = (0..levels).map(|i| 1.0 + 0.3 * 0.25_f64.powi(i)).collect();
        let found = estimate(&values, 2.0, LadderKind::Step).unwrap();
        assert_eq!(found.tier, LadderTier::Asymptotic);
        assert!((found.order - 2.0).abs() < 1e-12);
        let limit = values[values.len() - 1] + found.estimate.unwrap();
        assert!((limit - 1.0).abs() < 1e-15, "{limit}");
    }
}
