//! Packs of eight numbers in vector registers, and the choice of the instruction set at run time.
//!
//! A kernel is written once, over [`Lanes`], and handed to [`dispatch`], which runs it on the best
//! instruction set that the processor has: AVX-512, AVX2 with FMA, NEON, or plain code. The pack is eight
//! wide on every path, every operation rounds as IEEE 754 says, and sums have a written order, so all give
//! the same bits and data laid out for one suits the others.
//!
//! # Rules for kernels
//! - Everything between [`Kernel::run`] and the operations of [`Lanes`] is `#[inline(always)]`: only code
//!   that is inlined into the wrapper of [`dispatch`] is compiled for its instruction set.
//! - No closures, `array::from_fn` or `map` around lane operations. A closure that the compiler declines to
//!   inline turns every operation in it into a call: correct, three times slower, and silent
//!   (`tests/tools/check_inlining.sh` finds them).
//! - Threads go outside: dispatch inside the task, not around it, for the same reason.
//!
//! # Safety
//! Only this module contains `unsafe` code. The register types are private: safe code meets them only as the
//! type parameter of [`Kernel::run`], that is, after the processor was found to have the instructions.

use crate::scalar::Real;

mod aligned;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;
mod elementary;
mod fused;
mod half;
#[cfg(target_arch = "aarch64")]
mod neon;
mod operators;
mod pages;
mod pair;
mod portable;
mod prefetch;
mod rows;
mod spread;

pub use aligned::{Aligned, Columns, ColumnsView, Numbers, VertexRows};
pub use dispatch::{InstructionSet, Kernel, dispatch, dispatch_at, dispatch_compact, level};
pub use elementary::{atan2, exp, hypot, ln, powf};
pub use fused::mul_add;
pub use half::{HALF, HalfPack, PortableHalf};
pub use pages::{filled, with_room};
pub use pair::Pair;
pub use portable::{Portable, PortableMask};
pub use prefetch::{prefetch, prefetch_all, prefetch_early};
pub(crate) use rows::copy_points;
pub use rows::{RowSlice, RowSource, Rows};
pub use spread::spread;

/// Lanes in a pack, on every instruction set.
pub const WIDTH: usize = 8;

/// Eight numbers, side by side.
pub trait Lanes: Real {
    /// True if kernels with divisions or roots run faster on a [`Pair`] of packs.
    ///
    /// They do if a pack is one of 32 registers; if it is two of 16, a pair only spills. Results are
    /// bit-identical either way.
    const PAIRS_PAY: bool;
    /// True if a kernel should call a function of `f64` for each lane instead of inlining its mathematics on
    /// packs: if a pack is not a register. Results are bit-identical.
    const BY_LANE: bool = false;
    /// Half of a pack.
    type Half: HalfPack;

    /// The numbers of `a`, which need not be aligned (but loads fastest at multiples of 64 bytes).
    fn load(a: &[f64; WIDTH]) -> Self;
    /// Overwrites `a`.
    fn store(self, a: &mut [f64; WIDTH]);
    /// Component `c` of the result holds in lane `l` component `c` of row `index[l]`.
    fn gather<const D: usize, R: RowSource<D>>(rows: &R, index: &[R::Index; WIDTH]) -> [Self; D];
    /// Adds lane `l` of `v` to row `index[l]`, lane 0 first: if an index occurs twice, both are added.
    fn scatter_add<const D: usize>(rows: &mut RowSlice<D>, index: &[u16; WIDTH], v: [Self; D]);
    /// Component `c` of the result holds in lane `l` component `c` of row `l`.
    #[inline(always)]
    fn load_interleaved<const D: usize>(rows: &[[f64; D]; WIDTH]) -> [Self; D] {
        let mut r = [Self::zero(); D];
        for c in 0..D {
            let mut a = [0.0; WIDTH];
            for l in 0..WIDTH {
                a[l] = rows[l][c];
            }
            r[c] = Self::load(&a);
        }
        r
    }
    /// Overwrites component `c` of row `l` by lane `l` of `v[c]`.
    #[inline(always)]
    fn store_interleaved<const D: usize>(v: [Self; D], rows: &mut [[f64; D]; WIDTH]) {
        for c in 0..D {
            let a = v[c].to_array();
            for l in 0..WIDTH {
                rows[l][c] = a[l];
            }
        }
    }
    /// Transposes: lane `c` of pack `l` of the result is lane `l` of `v[c]`.
    #[inline(always)]
    fn transpose(v: [Self; WIDTH]) -> [Self; WIDTH] {
        let mut rows = [[0.0; WIDTH]; WIDTH];
        for c in 0..WIDTH {
            let a = v[c].to_array();
            for l in 0..WIDTH {
                rows[l][c] = a[l];
            }
        }
        let mut r = v;
        for l in 0..WIDTH {
            r[l] = Self::load(&rows[l]);
        }
        r
    }
    /// Bit `l` of the result is lane `l` of the mask.
    fn mask_to_bits(mask: Self::Mask) -> u8;
    /// Lane `l` of the result is bit `l` of `bits`.
    fn mask_from_bits(bits: u8) -> Self::Mask;

    /// The lanes as an array.
    #[inline(always)]
    fn to_array(self) -> [f64; WIDTH] {
        let mut a = [0.0; WIDTH];
        self.store(&mut a);
        a
    }
    /// The sum of all lanes, `((0+4)+(2+6)) + ((1+5)+(3+7))` on every instruction set.
    #[inline(always)]
    fn horizontal_sum(self) -> f64 {
        let a = self.to_array();
        ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]))
    }
    /// The largest lane; NaN if any lane is NaN.
    #[inline(always)]
    fn horizontal_max(self) -> f64 {
        let a = self.to_array();
        let mut m = a[0];
        for x in a {
            // `x != x`: a NaN enters and then stays, because nothing compares greater than it.
            if x > m || x.is_nan() {
                m = x;
            }
        }
        m
    }
}

#[cfg(test)]
mod tests;
