//! What the operators of all packs have in common.

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

pub(super) use assigning_operators;
