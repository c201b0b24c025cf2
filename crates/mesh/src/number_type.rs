//! Number types of binary mesh files.

/// Storage type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Byte order of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Endian {
    Little,
    Big,
}

impl NumberType {
    /// Size of a number [bytes].
    pub(super) fn size(self) -> usize {
        match self {
            NumberType::I8 | NumberType::U8 => 1,
            NumberType::I16 | NumberType::U16 => 2,
            NumberType::I32 | NumberType::U32 | NumberType::F32 => 4,
            NumberType::I64 | NumberType::U64 | NumberType::F64 => 8,
        }
    }

    /// True for floating point types.
    pub(super) fn is_real(self) -> bool {
        matches!(self, NumberType::F32 | NumberType::F64)
    }

    /// Decodes the number in the first [`size`](Self::size) bytes; missing bytes count as zero. Integers
    /// above 2^53 are rounded: no index is that large.
    pub(super) fn decode(self, bytes: &[u8], endian: Endian) -> f64 {
        let mut word = [0_u8; 8];
        for (to, from) in word.iter_mut().zip(&bytes[..self.size().min(bytes.len())]) {
            *to = *from;
        }
        if endian == Endian::Big {
            word[..self.size()].reverse();
        }
        let raw = u64::from_le_bytes(word);
        match self {
            NumberType::I8 => f64::from(raw as i8),
            NumberType::U8 => f64::from(raw as u8),
            NumberType::I16 => f64::from(raw as i16),
            NumberType::U16 => f64::from(raw as u16),
            NumberType::I32 => f64::from(raw as i32),
            NumberType::U32 => f64::from(raw as u32),
            NumberType::I64 => raw as i64 as f64,
            NumberType::U64 => raw as f64,
            NumberType::F32 => f64::from(f32::from_bits(raw as u32)),
            NumberType::F64 => f64::from_bits(raw),
        }
    }
}

/// Converts a number to the index of one of `count` vertices; `None` if it is not one.
pub(super) fn index(number: f64, count: usize) -> Option<u32> {
    (number >= 0.0 && number < count as f64 && number.fract() == 0.0).then_some(number as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_decoded_in_both_orders() {
        use Endian::{Big, Little};
        assert_eq!(NumberType::I16.decode(&[0xfe, 0xff], Little), -2.0);
        assert_eq!(NumberType::I16.decode(&[0xff, 0xfe], Big), -2.0);
        assert_eq!(NumberType::U32.decode(&4_000_000_000_u32.to_be_bytes(), Big), 4e9);
        assert_eq!(NumberType::F32.decode(&0.1_f32.to_be_bytes(), Big), f64::from(0.1_f32));
        assert_eq!(NumberType::F64.decode(&0.1_f64.to_le_bytes(), Little), 0.1);
        assert_eq!(NumberType::I64.decode(&(-3_i64).to_be_bytes(), Big), -3.0);
        assert_eq!(
            (index(3.0, 4), index(4.0, 4), index(-1.0, 4), index(0.5, 4)),
            (Some(3), None, None, None)
        );
        assert_eq!(index(f64::NAN, 4), None);
    }
}
