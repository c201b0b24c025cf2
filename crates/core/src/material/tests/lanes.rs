//! Every material's stress is bit-identical in scalars, in a pack and in a pair of packs, wherever terms
//! compute it so: in packs unless an instruction set goes [lane by lane](Lanes::BY_LANE), in pairs where
//! [they pay](Lanes::PAIRS_PAY).

use crate::algebra::Mat;
use crate::algebra::tests::sample::{Random, bits, categories, load_lanes, not_finite, store_lanes};
use crate::lanes::{InstructionSet, Kernel, Lanes, Pair, WIDTH, dispatch_at};
use crate::material::{Isotropic, Material, MaterialSpec, MaterialVisitor, Model, Stvk, autodiff_stress};

/// Stresses at one matrix per lane; `None` where no term computes them in packs. Each way to compute them
/// has a kernel of its own, because compile time grows faster than the size of a function.
struct InPack<'a, M, const D: usize>(&'a M, &'a [Mat<f64, D>]);

impl<M: Material<D>, const D: usize> Kernel for InPack<'_, M, D> {
    type Output = Option<[Mat<f64, D>; WIDTH]>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        if L::BY_LANE {
            return None;
        }
        Some(store_lanes(&self.0.pk1(&load_lanes::<L, D>(self.1))))
    }
}

/// Stresses at one matrix per lane by automatic differentiation.
struct Derived<'a, M, const D: usize>(&'a M, &'a [Mat<f64, D>]);

impl<M: Material<D>, const D: usize> Kernel for Derived<'_, M, D> {
    type Output = Option<[Mat<f64, D>; WIDTH]>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        if L::BY_LANE {
            return None;
        }
        Some(store_lanes(&autodiff_stress(self.0, &load_lanes::<L, D>(self.1))))
    }
}

/// Stresses at one matrix per lane in a pair of packs; `None` where no term computes them in pairs.
struct InPair<'a, M, const D: usize>(&'a M, [&'a [Mat<f64, D>]; 2]);

impl<M: Material<D>, const D: usize> Kernel for InPair<'_, M, D> {
    type Output = Option<[[Mat<f64, D>; WIDTH]; 2]>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        if !L::PAIRS_PAY {
            return None;
        }
        let [first, second] = [load_lanes::<L, D>(self.1[0]), load_lanes::<L, D>(self.1[1])];
        let pair = self.0.pk1(&Mat(Pair::zip_rows(&first.0, &second.0)));
        let (first, second) = Pair::unzip_rows(&pair.0);
        Some([store_lanes(&Mat(first)), store_lanes(&Mat(second))])
    }
}

/// Returns the stresses in a pack, and in the first and the second half of a pair.
fn stresses<M: Material<D>, const D: usize>(
    level: InstructionSet,
    material: &M,
    pack: &[Mat<f64, D>],
) -> Vec<[Mat<f64, D>; WIDTH]> {
    // The other half of the pair is undeformed.
    let rest = [Mat::identity(); WIDTH];
    let in_pair = |halves| dispatch_at(level, InPair(material, halves));
    let first = in_pair([pack, &rest]).map(|[first, _]| first);
    let second = in_pair([&rest, pack]).map(|[_, second]| second);
    [dispatch_at(level, InPack(material, pack)), first, second].into_iter().flatten().collect()
}

/// Checks one material, on a large stack: unoptimised, the kernels of all instruction sets need more than
/// the stack of a test.
pub(crate) fn same_bits<M: Material<D>, const D: usize>(name: &str, material: &M) {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(1 << 26);
        let check = thread.spawn_scoped(scope, || same_bits_here(name, material)).expect("a thread");
        check.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    });
}

fn same_bits_here<M: Material<D>, const D: usize>(name: &str, material: &M) {
    let mut random = Random(41);
    let mut all = vec![];
    for _ in 0..8 {
        for (_, generate) in categories::<D>() {
            all.push(generate(&mut random));
        }
    }
    all.extend(not_finite::<D>());
    all.resize(all.len().next_multiple_of(WIDTH), Mat::identity());
    for pack in all.chunks_exact(WIDTH) {
        let alone: Vec<_> = pack.iter().map(|f| material.pk1(f)).collect();
        let derived: Vec<_> = pack.iter().map(|f| autodiff_stress(material, f)).collect();
        for level in InstructionSet::ALL {
            for (k, out) in stresses(level, material, pack).iter().enumerate() {
                assert_same(&format!("{name} {level:?} {k}"), out, &alone, pack);
            }
            if let Some(out) = dispatch_at(level, Derived(material, pack)) {
                assert_same(&format!("{name} {level:?} autodiff"), &out, &derived, pack);
            }
        }
    }
}

/// Checks that lanes are bit-identical to single evaluations and that NaN gives no finite stress.
fn assert_same<const D: usize>(what: &str, out: &[Mat<f64, D>], alone: &[Mat<f64, D>], pack: &[Mat<f64, D>]) {
    for ((out, alone), f) in out.iter().zip(alone).zip(pack) {
        assert_eq!(bits(out), bits(alone), "{what} {f:?}");
        if f.norm_squared().is_nan() {
            assert!(out.norm_squared().is_nan(), "{what}: finite stress");
        }
    }
}

/// Instruction sets that compute in packs and in pairs, if the processor has all of them.
#[test]
fn packs_and_pairs_are_computed_where_terms_compute_them() {
    let material = Stvk::new(&Isotropic::new(1e5, 0.3));
    let pack = [Mat::<f64, 3>::identity(); WIDTH];
    for level in InstructionSet::ALL.into_iter().filter(|level| level.is_available()) {
        let ways = match level {
            InstructionSet::Portable => {
                usize::from(cfg!(not(any(target_arch = "x86_64", target_arch = "aarch64"))))
            }
            InstructionSet::Neon | InstructionSet::Avx2 => 1,
            InstructionSet::Avx512 => 3,
        };
        assert_eq!(stresses(level, &material, &pack).len(), ways, "{level:?}");
    }
}

struct Check<'a>(&'a str);

impl<const D: usize> MaterialVisitor<D> for Check<'_> {
    type Output = ();
    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) {
        same_bits::<M, D>(self.0, &material);
    }
}

#[test]
fn stress_in_two_dimensions() {
    for spec in MaterialSpec::examples() {
        MaterialSpec::visit::<2, _>(&spec, Check(spec.name()));
    }
}

#[test]
fn stress_in_three_dimensions() {
    for spec in MaterialSpec::examples() {
        MaterialSpec::visit::<3, _>(&spec, Check(spec.name()));
    }
}
