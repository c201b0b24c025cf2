//! Operators of all packs.

/// `+=`, `-=` and `*=` by way of `+`, `-` and `*`.
macro_rules! assigning_operators {
    ($pack:ty $(, $scalar:ident: $bound:path)?) => {
        impl $(<$scalar: $bound>)? std::ops::AddAssign for $pack {
            #[inline(always)]
            fn add_assign(&mut self, o: Self) {
                *self = *self + o;
            }
        }
        impl $(<$scalar: $bound>)? std::ops::SubAssign for $pack {
            #[inline(always)]
            fn sub_assign(&mut self, o: Self) {
                *self = *self - o;
            }
        }
        impl $(<$scalar: $bound>)? std::ops::MulAssign for $pack {
            #[inline(always)]
            fn mul_assign(&mut self, o: Self) {
                *self = *self * o;
            }
        }
    };
}

/// An operator of packs of several registers: `$each` applies an intrinsic to all of them.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! binary_operator {
    ($each:ident, $pack:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $pack {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                $each!($pack, $intrinsic, self, o)
            }
        }
    };
}

/// Evaluates intrinsics that neither read nor write memory.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! register {
    ($e:expr) => {
        // SAFETY: intrinsics on registers need nothing but the instructions. The register types are private
        // to `lanes`, and their methods are reached only through the wrappers of `dispatch`, which are
        // entered only after the processor was found to have the instructions; NEON every AArch64 target of
        // `std` has.
        unsafe { $e }
    };
}

pub(super) use assigning_operators;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
pub(super) use {binary_operator, register};
