//! Run-time choice of the instruction set, made once.

#![allow(unsafe_code)]

use std::sync::OnceLock;

#[cfg(target_arch = "aarch64")]
use super::neon::Neon;
use super::{Lanes, Portable};
#[cfg(target_arch = "x86_64")]
use super::{avx2::Avx2, avx512::Avx512};

/// A computation over packs, with its arguments as fields.
pub trait Kernel {
    /// Result of the computation.
    type Output;
    /// The computation. Mark the implementation `#[inline(always)]`, see the rules in [`crate::lanes`].
    fn run<L: Lanes>(self) -> Self::Output;
}

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InstructionSet {
    /// Plain code.
    Portable,
    /// NEON, of AArch64: four registers of two numbers.
    Neon,
    /// AVX2 and FMA: two registers of four numbers.
    Avx2,
    /// AVX-512 F, DQ and VL: one register of eight numbers.
    Avx512,
}

impl InstructionSet {
    /// All levels, from the slowest to the fastest.
    pub const ALL: [InstructionSet; 4] =
        [InstructionSet::Portable, InstructionSet::Neon, InstructionSet::Avx2, InstructionSet::Avx512];

    /// The name that `PLIANT_SIMD` accepts.
    pub fn name(self) -> &'static str {
        match self {
            InstructionSet::Portable => "portable",
            InstructionSet::Neon => "neon",
            InstructionSet::Avx2 => "avx2",
            InstructionSet::Avx512 => "avx512",
        }
    }

    /// True if this processor has the instructions.
    #[cfg(target_arch = "x86_64")]
    pub fn is_available(self) -> bool {
        let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        match self {
            InstructionSet::Portable => true,
            InstructionSet::Neon => false,
            InstructionSet::Avx2 => avx2,
            InstructionSet::Avx512 => {
                avx2 && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
        }
    }

    /// True if this processor has the instructions.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn is_available(self) -> bool {
        match self {
            InstructionSet::Portable => true,
            InstructionSet::Neon => cfg!(target_arch = "aarch64"),
            InstructionSet::Avx2 | InstructionSet::Avx512 => false,
        }
    }

    /// The best available level.
    pub fn best() -> InstructionSet {
        let mut best = InstructionSet::Portable;
        for level in InstructionSet::ALL {
            if level.is_available() {
                best = level;
            }
        }
        best
    }
}

/// The instruction set that [`dispatch`] uses.
///
/// It is the best that the processor has, unless the environment variable `PLIANT_SIMD` is `portable`,
/// `neon`, `avx2` or `avx512` at the first call. An unknown name, or a level that the processor lacks, is
/// ignored: results do not depend on the level, and this function reports the choice.
pub fn level() -> InstructionSet {
    static LEVEL: OnceLock<InstructionSet> = OnceLock::new();
    *LEVEL.get_or_init(|| choose(std::env::var("PLIANT_SIMD").ok().as_deref()))
}

/// The level for this value of `PLIANT_SIMD`.
fn choose(request: Option<&str>) -> InstructionSet {
    for level in InstructionSet::ALL {
        if request == Some(level.name()) && level.is_available() {
            return level;
        }
    }
    InstructionSet::best()
}

/// Runs a kernel on the best instruction set, see [`level`].
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    dispatch_at(level(), kernel)
}

/// Runs a kernel outside of hot paths: on AVX2 at most, so that it is compiled once less. Results are
/// bit-identical.
#[inline]
pub fn dispatch_compact<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if level() >= InstructionSet::Avx2 && InstructionSet::Avx2.is_available() {
        // SAFETY: the processor has the features that the wrapper enables.
        return unsafe { run_avx2(kernel) };
    }
    #[cfg(target_arch = "aarch64")]
    if level() == InstructionSet::Neon {
        return run_neon(kernel);
    }
    kernel.run::<Portable>()
}

/// Runs a kernel on this instruction set, or in plain code if the processor lacks it.
#[cfg(target_arch = "x86_64")]
#[inline]
pub fn dispatch_at<K: Kernel>(level: InstructionSet, kernel: K) -> K::Output {
    match level {
        // SAFETY: the processor has the features that the wrapper enables.
        InstructionSet::Avx512 if level.is_available() => unsafe { run_avx512(kernel) },
        // SAFETY: as above.
        InstructionSet::Avx2 if level.is_available() => unsafe { run_avx2(kernel) },
        _ => kernel.run::<Portable>(),
    }
}

/// Runs a kernel on this instruction set, or in plain code if the processor lacks it.
#[cfg(not(target_arch = "x86_64"))]
#[inline]
pub fn dispatch_at<K: Kernel>(level: InstructionSet, kernel: K) -> K::Output {
    match level {
        #[cfg(target_arch = "aarch64")]
        InstructionSet::Neon => run_neon(kernel),
        _ => kernel.run::<Portable>(),
    }
}

/// # Safety
/// The processor must have the features enabled here.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
unsafe fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

/// # Safety
/// The processor must have the features enabled here.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

/// Runs a kernel on NEON. Not inlined, as the wrappers of other processors cannot be: one copy of a kernel
/// for all callers.
#[cfg(target_arch = "aarch64")]
#[inline(never)]
fn run_neon<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Neon>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_honoured_where_possible_and_ignored_otherwise() {
        assert_eq!(choose(None), InstructionSet::best());
        assert_eq!(choose(Some("portable")), InstructionSet::Portable);
        assert_eq!(choose(Some("quantum")), InstructionSet::best());
        for level in InstructionSet::ALL {
            let expected = if level.is_available() { level } else { InstructionSet::best() };
            assert_eq!(choose(Some(level.name())), expected);
        }
    }
}
