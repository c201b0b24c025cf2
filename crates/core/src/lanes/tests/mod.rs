//! Every instruction set gives the bits of plain `f64`, for every operation and for compound kernels.

mod accuracy;
mod memory;
mod pages;

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::*;
use crate::algebra::Mat;
use crate::scalar::Mask;

/// Uniform in `[0, 1)`.
fn uniform(random: &mut Pcg64Mcg) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Numbers at which something may go wrong.
const SPECIAL: [f64; 24] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
    f64::MIN_POSITIVE,
    -f64::MIN_POSITIVE,
    5e-324,
    -5e-324,
    2.5e-310,
    f64::MAX,
    f64::MIN,
    f64::EPSILON,
    0.999_999_999_999_999_9,
    1.000_000_000_000_000_2,
    std::f64::consts::FRAC_1_SQRT_2,
    std::f64::consts::SQRT_2,
    709.782_712_893_384,
    709.782_712_893_384_1,
    -745.133_219_101_941_1,
    -708.5,
    1e300,
];

/// A number of any size, a number near 1, or a special one.
fn any_number(random: &mut Pcg64Mcg) -> f64 {
    match random.next_u64() % 4 {
        0 => SPECIAL[(random.next_u64() % 24) as usize],
        1 => f64::from_bits(random.next_u64()),
        2 => 1.0 + 1e-3 * (uniform(random) - 0.5),
        _ => 3.0 * (uniform(random) - 0.5),
    }
}

const INPUTS: usize = 9;
const OUTPUTS: usize = 74;

/// One text with every operation on scalars and masks, and with products and functions of a matrix.
#[inline(always)]
fn values<R: Real>(x: &[R; INPUTS]) -> [R; OUTPUTS] {
    let mut out = [R::zero(); OUTPUTS];
    let mut n = 0;
    macro_rules! push {
        ($($e:expr),*) => { $( out[n] = $e; n += 1; )* };
    }
    let [a, b, c] = [x[0], x[1], x[2]];
    push!(a + b, a - b, a * b, a / b, -a, a.mul_add(b, c), (-a).mul_add(b, -c));
    push!(a.sqrt(), a.abs(), a.max(b), a.copysign(b), a.ln(), a.exp(), a.powf(b));
    let mut d = a;
    d += b;
    d -= c;
    d *= b;
    push!(d);
    let (p, q) = (a.lt(b), b.lt(c));
    push!(R::select(p, a, b), R::select(p & q, a, b), R::select(p | q, a, b));
    push!(R::splat(if (p & q).any() && !(p & q).any() { 1.0 } else { 0.0 }));
    let (k, m) = a.split();
    push!(k, m, k.power_of_two(), a.inverse_sqrt_seed());

    let mut F = Mat::<R, 3>::zero();
    for i in 0..3 {
        for j in 0..3 {
            F[i][j] = x[3 * i + j];
        }
    }
    let C = F.cofactor();
    let J = F.determinant_with(&C);
    // Stable neo-Hookean and logarithmic stresses.
    let one = R::one();
    let mu = R::splat(3.0);
    let shear = mu - mu / (F.norm_squared() + one);
    let P = F.scale(shear) + C.scale(R::splat(7.0) * (J - R::splat(1.4)));
    let Q = (F + (-C).scale(one / J)).scale(mu) + C.scale(J.ln() / J);
    let mut small = Mat::<R, 2>::zero();
    small.0 = [[a, b], [c, x[3]]];
    for m in [F.mul(&P), F.mul_transpose(&C), F.inverse(), P, Q] {
        for i in 0..3 {
            push!(m[i][0], m[i][1], m[i][2]);
        }
    }
    let small = small.inverse();
    push!(J, F.trace(), small[0][0], small[0][1], small[1][0], small[1][1]);
    assert_eq!(n, OUTPUTS);
    out
}

/// All NaN are one: which of two NaN a sum inherits is not specified.
fn bits(x: f64) -> u64 {
    if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }
}

struct Values<'a>(&'a [[f64; WIDTH]; INPUTS], &'a [[f64; WIDTH]; INPUTS]);
impl Kernel for Values<'_> {
    /// Of the first inputs alone, then of both as a pair.
    type Output = [[[f64; WIDTH]; OUTPUTS]; 3];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let (mut a, mut b) = ([L::zero(); INPUTS], [L::zero(); INPUTS]);
        for i in 0..INPUTS {
            (a[i], b[i]) = (L::load(&self.0[i]), L::load(&self.1[i]));
        }
        let single = values(&a);
        let (first, second) = Pair::unzip(&values(&Pair::zip(&a, &b)));
        let mut out = [[[0.0; WIDTH]; OUTPUTS]; 3];
        for i in 0..OUTPUTS {
            single[i].store(&mut out[0][i]);
            first[i].store(&mut out[1][i]);
            second[i].store(&mut out[2][i]);
        }
        out
    }
}

#[test]
fn every_level_gives_the_bits_of_plain_numbers() {
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let rounds = if cfg!(miri) { 4 } else { 3000 };
    for round in 0..rounds {
        let mut input = [[[0.0; WIDTH]; INPUTS]; 2];
        for x in input.as_flattened_mut().as_flattened_mut() {
            *x = if round % 2 == 0 { any_number(&mut random) } else { 2.0 * uniform(&mut random) - 1.0 };
        }
        for level in InstructionSet::ALL {
            let out = dispatch_at(level, Values(&input[0], &input[1]));
            for (which, from) in [(0, 0), (1, 0), (2, 1)] {
                for l in 0..WIDTH {
                    let x: [f64; INPUTS] = std::array::from_fn(|i| input[from][i][l]);
                    let expected = values(&x);
                    for i in 0..OUTPUTS {
                        assert_eq!(
                            bits(out[which][i][l]),
                            bits(expected[i]),
                            "{level:?}, output {i}, lane {l}: {:e} is not {:e}; inputs {x:?}",
                            out[which][i][l],
                            expected[i]
                        );
                    }
                }
            }
        }
    }
}

struct Reductions([f64; WIDTH]);
impl Kernel for Reductions {
    type Output = [f64; 3];
    #[inline(always)]
    fn run<L: Lanes>(self) -> [f64; 3] {
        let x = L::load(&self.0);
        [x.horizontal_sum(), -(-x).horizontal_max(), x.horizontal_max()]
    }
}

#[test]
fn reductions_have_one_order_and_do_not_lose_nan() {
    let a = [1e16, 1.0, -1e16, 3.0, 0.1, 0.2, 0.3, 0.4];
    let mut with_nan = a;
    with_nan[3] = f64::NAN;
    for level in InstructionSet::ALL {
        let [sum, min, max] = dispatch_at(level, Reductions(a));
        let tree = ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]));
        assert_eq!((sum, min, max), (tree, -1e16, 1e16));
        assert!(dispatch_at(level, Reductions(with_nan)).iter().all(|x| x.is_nan()));
    }
}

/// For two bit patterns: what the masks become, as bits again.
struct Masks(u8, u8);
impl Kernel for Masks {
    type Output = ([u8; 5], [bool; 2]);
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let (a, b) = (L::mask_from_bits(self.0), L::mask_from_bits(self.1));
        let (one, two) = (L::one(), L::splat(2.0));
        let selected = L::select(a, one, two);
        let bits = [
            L::mask_to_bits(a),
            L::mask_to_bits(a & b),
            L::mask_to_bits(a | b),
            L::mask_to_bits(selected.lt(two)),
            L::mask_to_bits(two.lt(selected)),
        ];
        (bits, [a.any(), (a & b).any()])
    }
}

#[test]
fn masks_are_sets_of_lanes() {
    for level in InstructionSet::ALL {
        for a in 0..=255u8 {
            let b = a.wrapping_mul(37).wrapping_add(11);
            let expected = ([a, a & b, a | b, a, 0], [a != 0, a & b != 0]);
            assert_eq!(dispatch_at(level, Masks(a, b)), expected, "{level:?} {a:b}");
        }
    }
}
