//! Continuous collision detection on its classic failure cases and on random motions.

use super::{Random, number, positions};
use crate::ccd::{GapLimit, MAX_EVALUATIONS, safe_step, safe_step_to_half_space};
use crate::closest::Primitives;
use crate::pair::{EdgeEdge, PointEdge, PointTriangle};
use crate::vector::{are_apart_across, stay_apart_across};
use pliant::lanes::{InstructionSet, Kernel, Lanes, WIDTH, dispatch_at};
use serde_json::Value;

/// Distance at a fraction of a motion.
fn distance<K: Primitives<D, N>, const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    dx: &[[f64; D]; N],
    time: f64,
) -> f64 {
    let there: [[f64; D]; N] =
        std::array::from_fn(|i| std::array::from_fn(|k| (x[i][k] - x[0][k]) + time * (dx[i][k] - dx[0][k])));
    K::closest(&there).squared_distance.sqrt()
}

fn assert_rules<K: Primitives<D, N>, const D: usize, const N: usize>(name: &str, of: &Value) -> usize {
    let (x, end) = (positions::<D, N>(&of["x0"]), positions::<D, N>(&of["x1"]));
    let dx: [[f64; D]; N] = std::array::from_fn(|i| std::array::from_fn(|k| end[i][k] - x[i][k]));
    let gap = GapLimit { reach: if name == "pt-slide-above" { 1e-6 } else { 1.0 }, offset: 0.0 };
    let step = safe_step::<K, f64, D, N>(&x, &dx, &gap, 1.0);
    assert!(step.time > 0.0 && step.evaluations <= MAX_EVALUATIONS, "{name}: {step:?}");
    if !of["time_of_impact"].is_null() {
        let impact = number(&of["time_of_impact"]);
        assert!(step.time < impact, "{name}: {step:?} for {impact}");
    }
    let start = distance::<K, D, N>(&x, &dx, 0.0);
    let left = 0.1 * start.min(gap.reach);
    let least = number(&of["least_distance"]);
    if of["time_of_impact"].is_null() && least > left {
        assert_eq!(step.time, 1.0, "{name}");
    }
    let at_end = distance::<K, D, N>(&x, &dx, step.time);
    assert!(at_end >= 0.5 * left * (1.0 - 1e-6), "{name}: {at_end:e} of {left:e}");
    assert!(step.time == 1.0 || at_end <= left * (1.0 + 1e-6), "{name}: {at_end:e} of {left:e}");
    if name == "pt-slide-above" {
        assert!(step.time == 1.0 && step.evaluations <= 5, "{name}: {step:?}");
    }
    step.evaluations
}

#[test]
fn classic_motions_keep_the_rules() {
    let motions: Value = serde_json::from_str(include_str!("data/motions.json")).unwrap();
    let mut evaluations = 0;
    for (name, of) in motions.as_object().unwrap() {
        evaluations += match of["kind"].as_str().unwrap() {
            "PT" => assert_rules::<PointTriangle, 3, 4>(name, of),
            "EE" => assert_rules::<EdgeEdge, 3, 4>(name, of),
            _ => assert_rules::<PointEdge, 2, 3>(name, of),
        };
    }
    assert!(evaluations <= 172, "{evaluations} evaluations");
}

/// Random motion: half of them parallel or coplanar, gaps and displacements of 1e-9 to 1e3.
fn motion<const D: usize, const N: usize>(
    random: &mut Random,
    first: usize,
) -> ([[f64; D]; N], [[f64; D]; N]) {
    let gap = 10f64.powf(random.between(-9.0, 3.0));
    let way = 10f64.powf(random.between(-9.0, 3.0));
    let mut x: [[f64; D]; N] = std::array::from_fn(|_| random.vector());
    if random.next() < 0.5 {
        // Coplanar, edges parallel to the first axis.
        for i in 0..N {
            x[i][D - 1] = 0.0;
            if D == 3 && i % 2 == 1 {
                x[i][1] = x[i - 1][1];
            }
        }
    }
    // A point of the first primitive above one of the second.
    let (a, b) = (random.next(), random.next());
    let middle = |x: &[[f64; D]], k: usize| {
        let last = x.len() - 1;
        x[0][k] + a * (x[last.min(1)][k] - x[0][k]) + (1.0 - a) * b * (x[last][k] - x[0][k])
    };
    for k in 0..D - 1 {
        let shift = middle(&x[first..], k) - middle(&x[..first], k);
        x[..first].iter_mut().for_each(|row| row[k] += shift);
    }
    // Moves the two sides `gap` apart along the last axis.
    let high = |x: &[[f64; D]]| x.iter().fold(f64::NEG_INFINITY, |m, row| m.max(row[D - 1]));
    let low = |x: &[[f64; D]]| x.iter().fold(f64::INFINITY, |m, row| m.min(row[D - 1]));
    let lift = high(&x[first..]) - low(&x[..first]) + gap;
    for row in &mut x[..first] {
        row[D - 1] += lift;
    }
    let mut dx: [[f64; D]; N] = std::array::from_fn(|_| random.vector().map(|v: f64| v * way));
    if random.next() < 0.5 {
        // Head-on motion.
        for (i, row) in dx.iter_mut().enumerate() {
            *row = [0.0; D];
            row[D - 1] = if i < first { -way } else { 0.0 };
        }
    }
    (x, dx)
}

/// Smallest distance on `[0, time]` by conservative advancement, mean motion subtracted: shares only the
/// closest points with the code under test. May end early with the value reached.
fn least_distance<K: Primitives<D, N>, const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    dx: &[[f64; D]; N],
    time: f64,
) -> f64 {
    let length = |v: &[f64; D]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mean: [f64; D] = std::array::from_fn(|k| dx.iter().map(|row| row[k]).sum::<f64>() / N as f64);
    let speeds: [f64; N] = std::array::from_fn(|i| length(&std::array::from_fn(|k| dx[i][k] - mean[k])));
    let largest = |speeds: &[f64]| speeds.iter().fold(0.0f64, |m, s| m.max(*s));
    let speed = largest(&speeds[..K::FIRST]) + largest(&speeds[K::FIRST..]);
    let (mut t, mut least) = (0.0, f64::INFINITY);
    for _ in 0..400 {
        let d = distance::<K, D, N>(x, dx, t);
        least = least.min(d);
        t += 0.5 * d / speed.max(f64::MIN_POSITIVE);
        if t >= time {
            break;
        }
    }
    least.min(distance::<K, D, N>(x, dx, time))
}

fn assert_random<K: Primitives<D, N>, const D: usize, const N: usize>(count: usize, seed: u64) {
    let mut random = Random(seed);
    let gap = GapLimit { reach: 1e-3, offset: 0.0 };
    let mut stopped = 0;
    for _ in 0..count {
        let (x, dx) = motion::<D, N>(&mut random, K::FIRST);
        let start = distance::<K, D, N>(&x, &dx, 0.0);
        let step = safe_step::<K, f64, D, N>(&x, &dx, &gap, 1.0);
        let left = 0.1 * start.min(gap.reach);
        let size: f64 = 2.0 + dx.as_flattened().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let rounding = 1e-14 * size;
        if step.time == 0.0 {
            assert!(start < 4.0 * rounding, "{x:?} {dx:?}");
            continue;
        }
        assert!(step.evaluations <= MAX_EVALUATIONS);
        let least = least_distance::<K, D, N>(&x, &dx, step.time);
        assert!(least >= 0.5 * left - rounding, "{least:e} of {left:e}: {x:?} {dx:?} {step:?}");
        // Below 1e-8 of the size, directions between closest points lose digits: the step may end early
        // and is safe.
        if step.time < 1.0 && step.evaluations < MAX_EVALUATIONS && left > 1e-8 * size {
            stopped += 1;
            let at_end = distance::<K, D, N>(&x, &dx, step.time);
            assert!(at_end <= left + rounding, "{at_end:e} of {left:e}: {x:?} {dx:?} {step:?}");
        }
    }
    assert!(stopped > count / 20, "only {stopped} motions were stopped");
}

#[test]
fn random_motions_never_pass_through() {
    assert_random::<PointTriangle, 3, 4>(4000, 1);
    assert_random::<EdgeEdge, 3, 4>(4000, 2);
    assert_random::<PointEdge, 2, 3>(4000, 3);
    assert_random::<PointEdge, 3, 3>(2000, 4);
}

#[test]
#[ignore = "a hundred thousand of each kind: for hands, and once before a release"]
fn many_random_motions_never_pass_through() {
    assert_random::<PointTriangle, 3, 4>(100_000, 11);
    assert_random::<EdgeEdge, 3, 4>(100_000, 12);
    assert_random::<PointEdge, 2, 3>(100_000, 13);
}

/// Eight motions of point and triangle as one pack.
struct Pack<'a>(&'a [[[[f64; 3]; 4]; 2]; WIDTH]);

impl Kernel for Pack<'_> {
    type Output = [f64; WIDTH];
    #[inline(always)]
    fn run<L: Lanes>(self) -> [f64; WIDTH] {
        let mut rows = [[[L::zero(); 3]; 4]; 2];
        for which in 0..2 {
            for i in 0..4 {
                for k in 0..3 {
                    let mut lanes = [0.0; WIDTH];
                    for l in 0..WIDTH {
                        lanes[l] = self.0[l][which][i][k];
                    }
                    rows[which][i][k] = L::load(&lanes);
                }
            }
        }
        let gap = GapLimit { reach: 1e-3, offset: 0.0 };
        safe_step::<PointTriangle, L, 3, 4>(&rows[0], &rows[1], &gap, L::one()).time.to_array()
    }
}

#[test]
fn packs_of_every_instruction_set_have_the_bits_of_single_pairs() {
    let mut random = Random(5);
    for _ in 0..40 {
        let motions: [[[[f64; 3]; 4]; 2]; WIDTH] = std::array::from_fn(|_| {
            let (x, dx) = motion::<3, 4>(&mut random, 1);
            [x, dx]
        });
        let gap = GapLimit { reach: 1e-3, offset: 0.0 };
        let single =
            motions.map(|[x, dx]| safe_step::<PointTriangle, f64, 3, 4>(&x, &dx, &gap, 1.0).time.to_bits());
        for level in InstructionSet::ALL {
            assert_eq!(dispatch_at(level, Pack(&motions)).map(f64::to_bits), single, "{level:?}");
        }
    }
}

#[test]
fn steps_to_a_half_space_end_a_tenth_of_the_gap_before_it() {
    let gap = GapLimit { reach: 1.0, offset: 0.25 };
    // 1 m beyond the radius, moving 2 m a step: 0.9 of the distance to the radius.
    let time = safe_step_to_half_space(1.25, -2.0, &gap, 1.0);
    assert!((time - 0.45).abs() < 1e-15, "{time}");
    assert_eq!(safe_step_to_half_space(1.25, -0.5, &gap, 1.0), 1.0);
    assert_eq!(safe_step_to_half_space(1.25, 3.0, &gap, 0.5), 0.5);
    assert_eq!(safe_step_to_half_space(0.25, 3.0, &gap, 1.0), 0.0);
}

/// Primitives reported as apart, or as staying apart on their paths, are so for any position of the
/// scene; and some are reported. Returns their number.
fn assert_apart<K: Primitives<D, N>, const D: usize, const N: usize>(random: &mut Random) -> usize {
    let mut told = 0;
    for round in 0..2000 {
        let far = 10f64.powi(round % 7);
        let (origin, dx): ([f64; D], [[f64; D]; N]) =
            (random.vector().map(|c| far * c), std::array::from_fn(|_| random.vector()));
        let own: [[f64; D]; N] = std::array::from_fn(|_| random.vector());
        let x = own.map(|row| std::array::from_fn(|k| row[k] + origin[k]));
        let reach = random.between(0.0, 1.0);
        let least = |parts: u32, dx: &[[f64; D]; N]| {
            let at = |i| distance::<K, D, N>(&x, dx, f64::from(i) / f64::from(parts));
            (0..=parts).map(at).fold(f64::INFINITY, f64::min)
        };
        if are_apart_across(&x, K::FIRST, reach) {
            assert!(least(1, &[[0.0; D]; N]) > reach, "{x:?}, {reach}");
            told += 1;
        }
        if stay_apart_across(&x, &dx, K::FIRST, reach) {
            assert!(least(50, &dx) > reach, "{x:?}, {dx:?}, {reach}");
            told += 1;
        }
    }
    told
}

#[test]
fn primitives_apart_across_the_direction_between_their_means_are() {
    let mut random = Random(31);
    let told = [
        assert_apart::<PointTriangle, 3, 4>(&mut random),
        assert_apart::<EdgeEdge, 3, 4>(&mut random),
        assert_apart::<PointEdge, 2, 3>(&mut random),
    ];
    assert!(told.iter().all(|told| *told > 300), "{told:?} of 4,000");
}
