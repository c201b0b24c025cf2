//! Every material's stress has the same bits in plain numbers, in a pack and in a pair of packs, on every instruction set.

use crate::algebra::Mat;
use crate::algebra::tests::sample::{Random, bits, categories, load_lanes, not_finite, store_lanes};
use crate::lanes::{InstructionSet, Kernel, Lanes, Pair, WIDTH, dispatch_at};
use crate::material::{Material, MaterialSpec, MaterialVisitor, autodiff_stress};

/// The stress at one matrix per lane: as a pack, as the first and the second half of a pair, and by automatic differentiation.
struct Stress<'a, M, const D: usize>(&'a M, &'a [Mat<f64, D>]);

impl<M: Material<D>, const D: usize> Kernel for Stress<'_, M, D> {
    type Output = [[Mat<f64, D>; WIDTH]; 4];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let f = load_lanes::<L, D>(self.1);
        // Neighbours that need nothing of what the first half needs.
        let pair = self.0.pk1(&Mat(Pair::zip_rows(&f.0, &Mat::<L, D>::identity().0)));
        let swapped = self.0.pk1(&Mat(Pair::zip_rows(&Mat::<L, D>::identity().0, &f.0)));
        let (first, second) = (Pair::unzip_rows(&pair.0).0, Pair::unzip_rows(&swapped.0).1);
        let (alone, derived) = (self.0.pk1(&f), autodiff_stress(self.0, &f));
        [store_lanes(&alone), store_lanes(&Mat(first)), store_lanes(&Mat(second)), store_lanes(&derived)]
    }
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
            let out = dispatch_at(level, Stress(material, pack));
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
