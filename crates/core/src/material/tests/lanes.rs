//! Every material's stress has the same bits in plain numbers, in a pack and in a pair of packs, on every instruction set.

use crate::algebra::Mat;
use crate::algebra::tests::sample::{Random, bits, categories, load_lanes, not_finite, store_lanes};
use crate::lanes::{InstructionSet, Kernel, Lanes, Pair, WIDTH, dispatch_at};
use crate::material::{Material, MaterialSpec, MaterialVisitor, autodiff_stress};

/// Stresses at one matrix per lane. A kernel for each way of computing them, and none in which a way stands
/// twice: the compiler's time grows faster than the size of a function.
struct InPack<'a, M, const D: usize>(&'a M, &'a [Mat<f64, D>]);

impl<M: Material<D>, const D: usize> Kernel for InPack<'_, M, D> {
    type Output = [Mat<f64, D>; WIDTH];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        store_lanes(&self.0.pk1(&load_lanes::<L, D>(self.1)))
    }
}

/// The same by automatic differentiation.
struct Derived<'a, M, const D: usize>(&'a M, &'a [Mat<f64, D>]);

impl<M: Material<D>, const D: usize> Kernel for Derived<'_, M, D> {
    type Output = [Mat<f64, D>; WIDTH];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        store_lanes(&autodiff_stress(self.0, &load_lanes::<L, D>(self.1)))
    }
}

/// The same in a pair of packs.
struct InPair<'a, M, const D: usize>(&'a M, [&'a [Mat<f64, D>]; 2]);

impl<M: Material<D>, const D: usize> Kernel for InPair<'_, M, D> {
    type Output = [[Mat<f64, D>; WIDTH]; 2];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let [first, second] = [load_lanes::<L, D>(self.1[0]), load_lanes::<L, D>(self.1[1])];
        let pair = self.0.pk1(&Mat(Pair::zip_rows(&first.0, &second.0)));
        let (first, second) = Pair::unzip_rows(&pair.0);
        [store_lanes(&Mat(first)), store_lanes(&Mat(second))]
    }
}

/// As a pack, as the first and the second half of a pair, and by automatic differentiation.
fn stresses<M: Material<D>, const D: usize>(
    level: InstructionSet,
    material: &M,
    pack: &[Mat<f64, D>],
) -> [[Mat<f64, D>; WIDTH]; 4] {
    // Neighbours that need nothing of what the half in question needs.
    let rest = [Mat::identity(); WIDTH];
    let [first, _] = dispatch_at(level, InPair(material, [pack, &rest]));
    let [_, second] = dispatch_at(level, InPair(material, [&rest, pack]));
    let alone = dispatch_at(level, InPack(material, pack));
    [alone, first, second, dispatch_at(level, Derived(material, pack))]
}

/// Checks one material, on a large stack: unoptimised, the kernels of all instruction sets need more than a test has.
pub(super) fn same_bits<M: Material<D>, const D: usize>(name: &str, material: &M) {
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
        for level in InstructionSet::ALL {
            let out = stresses(level, material, pack);
            for (l, f) in pack.iter().enumerate() {
                let alone = material.pk1(f);
                for (k, got) in out.iter().take(3).enumerate() {
                    assert_eq!(bits(&got[l]), bits(&alone), "{name} {level:?} {k} {f:?}");
                }
                let derived = autodiff_stress(material, f);
                assert_eq!(bits(&out[3][l]), bits(&derived), "{name} {level:?} autodiff {f:?}");
                if f.norm_squared().is_nan() {
                    assert!(
                        out.iter().all(|p| p[l].norm_squared().is_nan()),
                        "{name} {level:?}: finite stress"
                    );
                }
            }
        }
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
