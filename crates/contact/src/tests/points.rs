//! Distances, barrier, mollifier and friction at points.

use super::{Random, number, numbers, positions};
use crate::barrier::{Barrier, PotentialForm, barrier};
use crate::closest::{ClosestPoints, InnerKind, InnerPair, Primitives};
use crate::eigen::positive_part;
use crate::expected::{ExpectedForces, ExpectedInTurn, ForceForecast, key};
use crate::friction::{PairFriction, f0, f1, f1_over_y, f1_slope};
use crate::hessian::PairBlocks;
use crate::merge::WeightedPair;
use crate::model::ContactLaw;
use crate::mollifier::{mollified_pair, mollifier, parallel_limit, squared_cross};
use crate::pair::{EdgeEdge, PairGeometry, PairKind, PointEdge, PointPoint, PointTriangle};
use crate::vector::{along, cross, dot, scaled};
use crate::visit::visit_pairs_of_law;
use pliant::material::Psd;
use serde_json::Value;

fn reference() -> Value {
    serde_json::from_str(include_str!("data/points.json")).unwrap()
}

/// Energy, gradient and Hessians of a pair, flattened over its vertices.
struct Assembled {
    energy: f64,
    gradient: Vec<f64>,
    exact: Vec<Vec<f64>>,
    projected: Vec<Vec<f64>>,
}

fn dense<const D: usize, const N: usize>(
    blocks: &PairBlocks<f64, D, N>,
    slots: &[usize],
    size: usize,
) -> Vec<Vec<f64>> {
    let mut matrix = vec![vec![0.0; size]; size];
    for i in 0..N {
        for j in 0..N {
            for k in 0..D {
                for l in 0..D {
                    matrix[D * slots[i] + k][D * slots[j] + l] = blocks[i][j][k][l];
                }
            }
        }
    }
    matrix
}

fn of_kind<K: PairKind<N, P>, const D: usize, const N: usize, const P: usize>(
    x: &[[f64; D]],
    slots: &[usize],
    law: &Barrier,
    weight: f64,
) -> Assembled {
    let inner: [[f64; D]; N] = std::array::from_fn(|i| x[slots[i]]);
    let pair = PairGeometry::<f64, D, N, P>::of::<K>(&inner);
    let of_distance = law.at(pair.squared_distance, weight);
    let mut gradient = vec![0.0; D * x.len()];
    for (row, slot) in pair.gradient(of_distance.slope).iter().zip(slots) {
        gradient[D * slot..][..D].copy_from_slice(row);
    }
    let matrix = |psd| dense(&pair.hessian(&of_distance, psd), slots, D * x.len());
    Assembled {
        energy: of_distance.energy,
        gradient,
        exact: matrix(Psd::Exact),
        projected: matrix(Psd::Projected),
    }
}

fn assembled<const D: usize>(x: &[[f64; D]], inner: &InnerPair, law: &Barrier, weight: f64) -> Assembled {
    let slots = &inner.slots[..inner.vertices()];
    match inner.kind {
        InnerKind::PointPoint => of_kind::<PointPoint, D, 2, 0>(x, slots, law, weight),
        InnerKind::PointEdge => of_kind::<PointEdge, D, 3, 1>(x, slots, law, weight),
        InnerKind::PointTriangle => of_kind::<PointTriangle, D, 4, 2>(x, slots, law, weight),
        InnerKind::EdgeEdge => of_kind::<EdgeEdge, D, 4, 2>(x, slots, law, weight),
    }
}

fn assert_near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found:e} for {expected:e}, {tolerance:e} allowed"
    );
}

fn power_sums(matrix: &[Vec<f64>]) -> [f64; 3] {
    let n = matrix.len();
    let mut sums = [0.0; 3];
    for i in 0..n {
        sums[0] += matrix[i][i];
        for j in 0..n {
            sums[1] += matrix[i][j] * matrix[j][i];
            sums[2] += (0..n).map(|k| matrix[i][j] * matrix[j][k] * matrix[k][i]).sum::<f64>();
        }
    }
    sums
}

fn assert_pair<const D: usize, const N: usize>(
    name: &str,
    of: &Value,
    law: &Barrier,
    closest: &ClosestPoints<f64, D, N>,
    inner: &InnerPair,
    x: &[[f64; D]],
) {
    let squared = number(&of["squared_distance"]);
    assert_near(closest.squared_distance, squared, 1e-13 * squared, name);
    for (found, expected) in closest.coefficients.iter().zip(numbers(&of["coefficients"])) {
        assert_near(*found, expected, 1e-13, name);
    }
    let pair = assembled(x, inner, law, 0.02);
    let energy = number(&of["energy"]);
    assert_near(pair.energy, energy, 1e-13 * energy, name);
    let gradient = numbers(&of["energy_gradient"]);
    let size = gradient.iter().fold(0.0f64, |size, g| size.max(g.abs()));
    for (found, expected) in pair.gradient.iter().zip(&gradient) {
        assert_near(*found, *expected, 1e-13 * size, name);
    }
    // Equal sums of first, second and third powers: equal eigenvalues.
    let eigenvalues = numbers(&of["hessian_eigenvalues"]);
    let largest = eigenvalues.iter().fold(0.0f64, |size, e| size.max(e.abs()));
    let sums = power_sums(&pair.exact);
    for (power, found) in (1..).zip(sums) {
        let expected: f64 = eigenvalues.iter().map(|e| e.powi(power)).sum();
        assert_near(found, expected, 5e-11 * largest.powi(power), name);
    }
    let trace = power_sums(&pair.projected)[0];
    assert_near(trace, number(&of["projected_trace"]), 1e-12 * largest, name);
    assert_projection(name, &pair);
}

/// The projection equals that of the full matrix.
fn assert_projection(name: &str, pair: &Assembled) {
    let n = pair.exact.len();
    let mut whole = [[0.0; 12]; 12];
    let mut size = 0.0f64;
    for i in 0..n {
        for j in 0..n {
            whole[i][j] = pair.exact[i][j];
            size = size.max(whole[i][j].abs());
        }
    }
    positive_part(&mut whole, n);
    for i in 0..n {
        for j in 0..n {
            assert_near(pair.projected[i][j], whole[i][j], 1e-12 * size, name);
        }
    }
}

#[test]
fn energies_gradients_and_hessians_of_pairs() {
    let reference = &reference()["pairs"];
    let law = Barrier { form: PotentialForm::Barrier, stiffness: 1e5, reach: 0.6, offset: 0.0 };
    let with_radii = Barrier { offset: 0.05, ..law };
    let point_triangle = |name: &str, of: &Value, law: &Barrier| {
        let x = positions::<3, 4>(&of["x"]);
        let closest = PointTriangle::closest(&x);
        let inner = InnerPair::of_point_triangle(&closest.coefficients);
        assert_pair(name, of, law, &closest, &inner, &x);
    };
    let edge_edge = |name: &str, of: &Value, law: &Barrier| {
        let x = positions::<3, 4>(&of["x"]);
        let closest = EdgeEdge::closest(&x);
        let inner = InnerPair::of_edge_edge(&closest.coefficients);
        assert_pair(name, of, law, &closest, &inner, &x);
    };
    for (name, of) in reference["point_triangle"].as_object().unwrap() {
        point_triangle(name, of, &law);
    }
    for (name, of) in reference["edge_edge"].as_object().unwrap() {
        edge_edge(name, of, &law);
    }
    for (name, of) in reference["point_edge_2d"].as_object().unwrap() {
        let x = positions::<2, 3>(&of["x"]);
        let closest = PointEdge::closest(&x);
        let inner = InnerPair::of_point_edge(&closest.coefficients);
        assert_pair(name, of, &law, &closest, &inner, &x);
    }
    point_triangle("P_T", &reference["with_offset_0.05"]["P_T"], &with_radii);
    edge_edge("EA_EB", &reference["with_offset_0.05"]["EA_EB"], &with_radii);
}

/// Distance and its gradient by all coordinates, computed from the interior pair.
fn distance_by_region<const D: usize>(x: &[[f64; D]], inner: &InnerPair) -> (f64, Vec<f64>) {
    fn of<K: PairKind<N, P>, const D: usize, const N: usize, const P: usize>(
        x: &[[f64; D]],
        slots: &[usize],
    ) -> (f64, Vec<f64>) {
        let rows: [[f64; D]; N] = std::array::from_fn(|i| x[slots[i]]);
        let pair = PairGeometry::<f64, D, N, P>::of::<K>(&rows);
        let mut gradient = vec![0.0; D * x.len()];
        for (i, slot) in slots.iter().enumerate() {
            (0..D).for_each(|k| gradient[D * slot + k] = pair.coefficients[i] * pair.normal[k]);
        }
        (pair.distance, gradient)
    }
    let slots = &inner.slots[..inner.vertices()];
    match inner.kind {
        InnerKind::PointPoint => of::<PointPoint, D, 2, 0>(x, slots),
        InnerKind::PointEdge => of::<PointEdge, D, 3, 1>(x, slots),
        InnerKind::PointTriangle => of::<PointTriangle, D, 4, 2>(x, slots),
        InnerKind::EdgeEdge => of::<EdgeEdge, D, 4, 2>(x, slots),
    }
}

/// Asserts that the interior pair changes between these kinds where the first `moved` vertices cross a
/// boundary of regions, while distance and gradient are continuous. Returns the largest jump of the
/// gradient.
fn assert_continuous<const D: usize>(
    kinds: [InnerKind; 2],
    x: &[[f64; D]],
    (moved, across): (usize, [f64; D]),
    inner: impl Fn(&[[f64; D]]) -> InnerPair,
) -> f64 {
    let at = |step: f64| {
        let mut x = x.to_vec();
        x[..moved].iter_mut().for_each(|row| (0..D).for_each(|k| row[k] += step * across[k]));
        let inner = inner(&x);
        (inner.kind, distance_by_region(&x, &inner))
    };
    // Bisects to the last bits of the positions.
    let (mut before, mut after) = (-1e-5, 1e-5);
    assert_eq!([at(before).0, at(after).0], kinds, "{x:?}");
    while after - before > 1e-15 {
        let middle = 0.5 * (before + after);
        *(if at(middle).0 == kinds[0] { &mut before } else { &mut after }) = middle;
    }
    let [(d, gradient), (other, others)] = [at(before).1, at(after).1];
    assert_near(d, other, 1e-12, "distance");
    let jumps = gradient.iter().zip(&others).map(|(one, other)| (one - other).abs());
    jumps.fold(0.0, f64::max)
}

/// Points above a triangle cross its edges and pass its corners, and along an edge its end, in 3D and 2D;
/// edges pass each other's ends, on one side and on both.
#[test]
fn regions_meet_continuously() {
    use InnerKind::{EdgeEdge as EE, PointEdge as PE, PointPoint as PP, PointTriangle as PT};
    let mut random = Random(7);
    let mut most = [0.0; 5];
    let plus = |a: &[f64; 3], s: f64, b: &[f64; 3]| along(a, s, b);
    let unit = |a: &[f64; 3]| scaled(1.0 / dot(a, a).sqrt(), a);
    let of_triangle = |x: &[[f64; 3]]| {
        let x: [[f64; 3]; 4] = x.try_into().unwrap();
        InnerPair::of_point_triangle(&PointTriangle::closest(&x).coefficients)
    };
    let of_edges = |x: &[[f64; 3]]| {
        let x: [[f64; 3]; 4] = x.try_into().unwrap();
        InnerPair::of_edge_edge(&EdgeEdge::closest(&x).coefficients)
    };
    for _ in 0..200 {
        // A randomly rotated equilateral triangle: angles below 90 degrees at all corners.
        let (u, w) = (unit(&random.vector::<3>()), random.vector::<3>());
        let n = unit(&cross(&u, &w));
        let v = cross(&n, &u);
        let a = random.vector::<3>();
        let b = plus(&a, 1.0, &u);
        let c = plus(&plus(&a, 0.5, &u), 0.75f64.sqrt(), &v);
        let (s, height) = (random.between(0.1, 0.9), random.between(0.1, 0.5));
        let over = |foot: &[f64; 3]| plus(foot, height, &n);
        let outward = scaled(-1.0, &v);
        // Across the edge from a to b, out of the triangle.
        let p = over(&plus(&a, s, &u));
        most[0] = f64::max(most[0], assert_continuous([PT, PE], &[p, a, b, c], (1, outward), of_triangle));
        // Beyond that edge, past its end b.
        let p = over(&plus(&b, random.between(0.1, 0.3), &outward));
        most[1] = f64::max(most[1], assert_continuous([PE, PP], &[p, a, b, c], (1, u), of_triangle));
        // An edge above that of a and b, at an angle: its closest point passes its own end.
        let turn = random.between(0.3, 1.2);
        let way = plus(&scaled(turn.cos(), &u), turn.sin(), &v);
        let length = random.between(0.3, 0.8);
        let end = over(&plus(&a, s, &u));
        let other = plus(&end, -length, &way);
        most[2] = f64::max(
            most[2],
            assert_continuous([EE, PE], &[other, end, a, b], (2, scaled(-1.0, &way)), of_edges),
        );
        // From there past the end of the other edge too: nearest to a before, to its interior after.
        let end = over(&plus(&a, -0.1, &v));
        let other = plus(&plus(&end, -0.5, &u), -0.2, &v);
        most[3] = f64::max(most[3], assert_continuous([PP, PE], &[other, end, a, b], (2, u), of_edges));
    }
    let of_plane = |x: &[[f64; 2]]| {
        let x: [[f64; 2]; 3] = x.try_into().unwrap();
        InnerPair::of_point_edge(&PointEdge::closest(&x).coefficients)
    };
    for _ in 0..200 {
        let (a, angle) = (random.vector::<2>(), random.between(0.0, std::f64::consts::TAU));
        let u = [f64::cos(angle), f64::sin(angle)];
        let b = [a[0] + u[0], a[1] + u[1]];
        let height = random.between(-0.5, -0.1);
        let p = [b[0] - height * u[1], b[1] + height * u[0]];
        most[4] = f64::max(most[4], assert_continuous([PE, PP], &[p, a, b], (1, u), of_plane));
    }
    assert!(most.iter().all(|jump| *jump < 1e-12), "{most:?}");
}

#[test]
fn barrier_keeps_its_digits_at_both_ends() {
    let rows = &reference()["functions"];
    for row in rows["barrier"].as_array().unwrap() {
        let s = number(&row["s"]);
        let b = barrier(s * s, (s - 1.0) * (s + 1.0));
        let expected = ["b_over_Dh2", "db_dD_over_Dh", "d2b_dD2"].map(|name| number(&row[name]));
        for (found, expected) in [b.energy, b.slope, b.curvature].into_iter().zip(expected) {
            assert_near(found, expected, 1e-15 * 4.0 * expected.abs(), &format!("s = {s}"));
        }
        let law = Barrier { form: PotentialForm::Barrier, stiffness: 3.0, reach: 1.0, offset: 0.0 };
        let pressure = number(&row["pressure_over_kappa"]);
        // The square of s is rounded: near 1 the error is amplified by 1 / (1 - s).
        let lost = 1e-15 / (1.0 - s).abs().max(1e-3);
        assert_near(law.relative_pressure(s), pressure, 10.0 * lost * pressure.abs(), "pressure");
    }
    // One rounding from 1: -z^2 ln q = -z^3, B' = -3 z^2, B'' = -6 z.
    let z = -f64::EPSILON;
    let b = barrier(1.0 + z, z);
    assert_near(b.energy / (-z * z * z), 1.0, 1e-15, "B");
    assert_near(b.slope / (-3.0 * z * z), 1.0, 1e-15, "B'");
    assert_near(b.curvature / (-6.0 * z), 1.0, 1e-15, "B''");
}

#[test]
fn gaps_of_forces_are_found_at_both_ends_of_the_reach() {
    for (form, offset) in
        [(PotentialForm::Barrier, 0.0), (PotentialForm::Barrier, 0.3), (PotentialForm::Cubic, 0.3)]
    {
        let law = Barrier { form, stiffness: 3.0, reach: 0.2, offset };
        for part in [1e-6, 1e-3, 0.1, 0.5, 0.9, 0.99, 0.9999] {
            let gap = part * law.reach;
            let force = -law.at_signed(gap + offset, 0.7).slope;
            for near in [0.0, 0.5 * gap, 0.15] {
                let found = law.gap_of_force(force, 0.7, near);
                assert_near(found, gap, 1e-8 * law.reach, &format!("{form:?}, {part}"));
            }
        }
        assert_eq!(law.gap_of_force(0.0, 0.7, 0.1), law.reach);
        assert_eq!(law.gap_of_force(-1.0, 0.7, 0.1), law.reach);
    }
}

/// The linear solution predicts the force of a contact. The secant moves the contact to the gap of that
/// force, closer or farther, and to the activation distance for no force.
#[test]
fn a_contact_goes_where_it_has_the_force_that_is_expected() {
    let barrier = Barrier { form: PotentialForm::Barrier, stiffness: 1e5, reach: 1e-3, offset: 2e-3 };
    let law = ContactLaw { barrier, friction: 0.0 };
    let weight = 2e-4;
    let at = |gap: f64| barrier.at_signed(gap + barrier.offset, weight);
    for (gap, end) in [(3e-4, 9e-4), (9e-4, 3e-4), (1e-4, 9.99e-4), (5e-4, 5e-4), (2e-4, 2e-3)] {
        let force = if end < barrier.reach { -at(end).slope } else { -1.0 };
        let change = (-at(gap).slope - force) / at(gap).curvature;
        let step = [0.0, 0.0, 0.75 * change, 0.0, 0.0, -0.25 * change];
        let x = [0.0, 0.0, gap + barrier.offset, 0.0, 0.0, 0.0];
        let nothing = ExpectedForces::default();
        let mut forecast = ForceForecast::new(&nothing, &step);
        let pair = WeightedPair { vertices: [0, 1], weight };
        visit_pairs_of_law::<PointPoint, 3, 2, 0>(&law, &x, &[pair], &mut forecast);
        let expected = forecast.end();
        let mut expected = ExpectedInTurn::new(&expected);
        assert_near(expected.of(&[0, 1]).unwrap(), force.max(0.0), 1e-9 * at(gap).slope.abs(), "force");
        assert_eq!(expected.of(&[0, 2]), None);
        let stiffness = expected.stiffness(&[0, 1], &barrier, gap + barrier.offset, weight);
        let lands = gap + (-at(gap).slope - force.max(0.0)) / stiffness;
        assert_near(lands, end.min(barrier.reach), 1e-9, &format!("from {gap}"));
    }
}

/// Forces are found in any order of queries: each list of contacts ascends by itself, and some contacts
/// have no force.
#[test]
fn expected_forces_are_found_in_any_order() {
    let mut random = Random(41);
    let mut vertex = || (12.0 * random.next()) as u32;
    let mut keys: Vec<_> =
        (0..900).map(|i| key(&[vertex(), vertex(), vertex(), vertex()][..2 + i % 3])).collect();
    keys.sort_unstable();
    keys.dedup();
    let known: Vec<_> =
        (0..).zip(&keys).filter(|(i, _)| i % 4 != 1).map(|(i, key)| (*key, f64::from(i))).collect();
    let forces = ExpectedForces::of_contacts(known.clone());
    let force = |key| known.iter().find(|(known, _)| *known == key).map(|(_, force)| *force);
    let mut in_turn = ExpectedInTurn::new(&forces);
    for stride in [1, 3, 50, keys.len() - 7] {
        for i in 0..2 * keys.len() {
            let key = keys[i * stride % keys.len()];
            assert_eq!(in_turn.of(&key), force(key), "{key:?}");
        }
    }
    assert_eq!(in_turn.of(&[99, 99]), None);
    assert_eq!(ExpectedInTurn::new(&ExpectedForces::default()).of(&[0, 1]), None);
}

#[test]
fn barrier_is_infinite_behind_the_radii_and_zero_beyond_the_reach() {
    let law = Barrier { form: PotentialForm::Barrier, stiffness: 1.0, reach: 0.2, offset: 0.1 };
    for distance in [0.1, 0.05, 0.0] {
        let at = law.at(distance * distance, 1.0);
        assert!(at.energy == f64::INFINITY && at.slope == 0.0 && at.curvature == 0.0, "{at:?}");
    }
    let beyond = law.at(law.squared_reach(), 1.0);
    assert!(beyond.energy == 0.0 && beyond.slope == 0.0 && beyond.curvature == 0.0, "{beyond:?}");
    assert!(law.at(law.squared_reach() * (1.0 - 1e-15), 1.0).energy > 0.0);
}

#[test]
fn mollifier_and_friction_functions() {
    let rows = &reference()["functions"];
    for row in rows["mollifier"].as_array().unwrap() {
        let [m, slope, _] = mollifier(number(&row["c_over_eps"]), 1.0);
        assert_near(m, number(&row["m"]), 1e-15, "m");
        assert_near(slope, number(&row["dm"]), 1e-15, "m'");
    }
    for row in rows["friction"].as_array().unwrap() {
        let (e, y) = (1e-3, 1e-3 * number(&row["y_over_eps"]));
        let found = [f0(y, e), f1(y, e), f1_over_y(y, e), f1_slope(y, e)];
        for (found, name) in found.into_iter().zip(["f0", "f1", "f1_over_y", "df1"]) {
            let expected = number(&row[name]);
            let size = if name == "df1" { 2e3 } else { expected.abs() };
            assert_near(found, expected, 4e-16 * size, name);
        }
    }
}

#[test]
fn nearly_parallel_edges_fade_out() {
    let reference = &reference()["pairs"]["nearly_parallel"];
    let law = Barrier { form: PotentialForm::Barrier, stiffness: 1e5, reach: 0.2, offset: 0.0 };
    for of in reference.as_array().unwrap() {
        let theta: f64 = number(&of["theta"]);
        let (c, s) = (0.5 * theta.cos(), 0.5 * theta.sin());
        let x = [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.1 - c, -s, 0.1], [0.1 + c, s, 0.1]];
        let limit = parallel_limit(1.0, 1.0);
        let m = number(&of["mollifier"]);
        assert_near(mollifier(squared_cross(&x), limit)[0], m, 1e-9 * m, "m");
        let pair = mollified_pair(&x, &law, 0.02, limit, Psd::Exact);
        let energy = number(&of["mollified_energy_dhat_0.2"]);
        assert_near(pair.value, energy, 1e-9 * energy, "m E");
        let gradient = pair.gradient.as_flattened();
        assert!(gradient.iter().all(|g| g.is_finite()), "{gradient:?}");
        if theta == 0.0 {
            assert!(gradient.iter().all(|g| *g == 0.0), "{gradient:?}");
            continue;
        }
        let expected = numbers(&of["gradient"]);
        let size = expected.iter().fold(0.0f64, |size, g| size.max(g.abs()));
        for (found, expected) in gradient.iter().zip(expected) {
            assert_near(*found, expected, 1e-9 * size, &format!("gradient at {theta}"));
        }
    }
}

#[test]
fn hessian_of_a_mollified_pair_is_the_slope_of_its_gradient() {
    let law = Barrier { form: PotentialForm::Barrier, stiffness: 1e5, reach: 0.6, offset: 0.0 };
    let mut random = Random(7);
    for _ in 0..40 {
        // Directions that differ by up to 0.02: the mollifier is active below 0.0316.
        let (start, turn): ([f64; 3], [f64; 3]) = (random.vector(), random.vector());
        let end = [1.0 + 0.02 * turn[0], 0.02 * turn[1], 0.02 * turn[2]];
        let b = [0.5 * start[0], 0.1, 0.3 + 0.05 * start[2]];
        let x = [[0.0; 3], [1.0, 0.0, 0.0], b, [b[0] + end[0], b[1] + end[1], b[2] + end[2]]];
        let at = |x: &[[f64; 3]; 4], psd| mollified_pair(x, &law, 0.02, parallel_limit(1.0, 1.0), psd);
        let exact = at(&x, Psd::Exact);
        let size = exact.hessian.as_flattened().iter().fold(0.0f64, |size, h| size.max(h.abs()));
        let step = 1e-6;
        for j in 0..12 {
            let mut ends = [x; 2];
            ends[0].as_flattened_mut()[j] += step;
            ends[1].as_flattened_mut()[j] -= step;
            let [up, down] = ends.map(|x| at(&x, Psd::Exact).gradient);
            for i in 0..12 {
                let slope = (up.as_flattened()[i] - down.as_flattened()[i]) / (2.0 * step);
                assert_near(exact.hessian[i][j], slope, 1e-5 * size, "second derivative");
            }
        }
        let mut whole = exact.hessian;
        positive_part(&mut whole, 12);
        let projected = at(&x, Psd::Projected).hessian;
        for (found, expected) in projected.as_flattened().iter().zip(whole.as_flattened()) {
            assert_near(*found, *expected, 1e-12 * size, "projection");
        }
    }
}

fn assert_friction<K: PairKind<N, P> + Primitives<D, N>, const D: usize, const N: usize, const P: usize>(
    name: &str,
) {
    for motion in ["stick", "slip"] {
        let of = &reference()["friction_pairs"][format!("{name}_{motion}")];
        let (x, u) = (positions::<D, N>(&of["x"]), positions::<D, N>(&of["u"]));
        let pair = PairGeometry::<f64, D, N, P>::of::<K>(&x);
        let law = Barrier { form: PotentialForm::Barrier, stiffness: 1e5, reach: 0.6, offset: 0.0 };
        let lambda = -2.0 * pair.distance * law.at(pair.squared_distance, 0.02).slope;
        let expected = number(&of["lambda"]);
        assert_near(lambda, expected, 1e-13 * expected, "lambda");
        let friction = PairFriction {
            coefficients: pair.coefficients,
            normal: pair.normal,
            limit: 0.4 * lambda,
            threshold: 1e-3,
        };
        let slip = friction.slip(&u).iter().map(|s| s * s).sum::<f64>().sqrt();
        for (found, name) in [(slip, "slip"), (friction.value(&u), "potential"), (friction.power(&u), "work")]
        {
            let expected = number(&of[name]);
            assert_near(found, expected, 1e-13 * expected, name);
        }
        let gradient = numbers(&of["gradient"]);
        for (found, expected) in friction.gradient(&u).as_flattened().iter().zip(&gradient) {
            assert_near(*found, *expected, 1e-13 * 0.4 * lambda, "gradient");
        }
        let squares: f64 = pair.coefficients.iter().map(|c| c * c).sum();
        let m = friction.hessian(&u);
        let trace = number(&of["hessian_trace"]);
        assert_near(squares * m.trace(), trace, 1e-12 * 0.4 * lambda / 1e-3 * squares, "trace");
        // Positive semidefinite along any direction.
        let mut random = Random(3);
        for _ in 0..20 {
            let direction: [f64; D] = random.vector();
            let along = m.mul_vec(&direction);
            let square: f64 = (0..D).map(|k| along[k] * direction[k]).sum();
            let size = friction.limit * f1_over_y(slip, friction.threshold);
            assert!(square >= -1e-12 * size, "{square:e}");
        }
        let moved = u.map(|row| row.map(|u| u + 0.25));
        assert_near(friction.value(&moved), friction.value(&u), 1e-12 * 0.4 * lambda, "translation");
    }
}

#[test]
fn friction_of_pairs() {
    assert_friction::<PointTriangle, 3, 4, 2>("PT");
    assert_friction::<EdgeEdge, 3, 4, 2>("EE");
    assert_friction::<PointEdge, 2, 3, 1>("PE2");
}

#[test]
fn friction_of_a_pair_at_rest_has_the_slope_of_two_over_the_threshold() {
    let friction =
        PairFriction { coefficients: [1.0, -1.0], normal: [0.0, 1.0], limit: 3.0, threshold: 1e-2 };
    let rest = [[0.0; 2]; 2];
    let m = friction.hessian(&rest);
    assert_eq!(m.0, [[600.0, 0.0], [0.0, 0.0]]);
    assert!(friction.gradient(&rest).as_flattened().iter().all(|g| *g == 0.0));
}

/// Given the force of the velocities, the matrix is the Hessian; with any other within the limit it
/// is positive semidefinite; and the force follows a short step as the law does.
#[test]
fn matrices_of_friction_with_a_force_of_its_own() {
    let mut random = Random(5);
    for speed in [2e-4, 9e-4, 5e-3, 1.0] {
        let normal = [0.6, 0.0, 0.8];
        let friction = PairFriction { coefficients: [1.0, -1.0], normal, limit: 3.0, threshold: 1e-3 };
        let v: [[f64; 3]; 2] = [random.vector().map(|v: f64| speed * v), [0.0; 3]];
        let slip = friction.slip(&v);
        let size = friction.limit * f1_over_y(slip.iter().map(|s| s * s).sum::<f64>().sqrt(), 1e-3);
        let own = friction.part_of_limit(&v);
        let (exact, with) = (friction.hessian(&v), friction.hessian_with(&own, &v));
        for (exact, with) in exact.0.as_flattened().iter().zip(with.0.as_flattened()) {
            assert_near(*with, *exact, 1e-12 * size, "Hessian");
        }
        for _ in 0..20 {
            let w = friction.in_plane(&random.vector());
            let length = w.iter().map(|w| w * w).sum::<f64>().sqrt().max(1.0);
            let m = friction.hessian_with(&w.map(|w| w / length), &v);
            let direction: [f64; 3] = random.vector();
            let along = m.mul_vec(&direction);
            let square: f64 = (0..3).map(|k| along[k] * direction[k]).sum();
            assert!(square >= -1e-12 * size, "{square:e}");
        }
        // The change of the force is the Hessian times the step, to first order in the step.
        let h = 1e-6 * speed;
        let dv = [random.vector().map(|v: f64| h * v), [0.0; 3]];
        let (after, change) = (friction.part_after(&own, &v, &dv), exact.mul_vec(&dv[0]));
        for k in 0..3 {
            let expected = own[k] + change[k] / friction.limit;
            assert_near(after[k], expected, 1e-11, "force after a step");
        }
    }
}

/// A force that follows long steps stays tangential: rounding along the normal does not accumulate.
#[test]
fn forces_of_friction_that_follow_long_steps_stay_in_the_plane() {
    let (sin, cos) = 0.54_f64.sin_cos();
    let friction =
        PairFriction { coefficients: [1.0, -1.0], normal: [sin, cos], limit: 3.0, threshold: 1e-4 };
    let along = |speed: f64| [[speed * cos, -speed * sin], [0.0; 2]];
    let mut part = friction.part_of_limit(&along(2e-4));
    for step in 0..40 {
        // Slides at twice the regularisation velocity; each step is a hundred times that.
        part = friction.part_after(&part, &along(2e-4), &along(2e-2));
        let out = part[0] * sin + part[1] * cos;
        assert!(out.abs() < 1e-15, "step {step}: {out:e} along the normal");
        assert_near(part[0] * cos - part[1] * sin, 1.0, 1e-13, "part of the limit");
    }
}
