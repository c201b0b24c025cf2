//! Hash function that stays the same in every version.

/// Computes the 64-bit hash FNV-1a of Fowler, Noll and Vo, which never changes. Fowler, Noll, Vo,
/// Eastlake 2019, *The FNV non-cryptographic hash algorithm*, IETF draft-eastlake-fnv, section 2.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    let (basis, prime) = (0xcbf2_9ce4_8422_2325, 0x0100_0000_01b3);
    bytes.iter().fold(basis, |hash: u64, byte| (hash ^ u64::from(*byte)).wrapping_mul(prime))
}

#[cfg(test)]
mod tests {
    use super::fnv1a;

    /// Test vectors of the draft, appendix C.
    #[test]
    fn hashes_are_those_of_the_draft() {
        let vectors =
            [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)];
        for (text, expected) in vectors {
            assert_eq!(fnv1a(text.as_bytes()), expected, "{text}");
        }
    }
}
