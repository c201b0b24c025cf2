//! Base 64 (RFC 4648) as in VTK's XML files: several encodings, each with its own padding, may follow
//! each other, which the common crates refuse.

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Encodes bytes as padded text.
pub fn encode(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let digit = (word >> (18 - 6 * i)) & 63;
            text.push(if i <= chunk.len() { ALPHABET[digit as usize] as char } else { '=' });
        }
    }
    text
}

/// Decodes one encoding or several in sequence, ignoring white space. Ends at the first invalid character
/// and returns its position, if there is one.
pub fn decode(text: &[u8]) -> (Vec<u8>, Option<usize>) {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut word, mut digits, mut padding) = (0_u32, 0, 0);
    for (i, &character) in text.iter().enumerate() {
        let digit = match character {
            b'A'..=b'Z' => character - b'A',
            b'a'..=b'z' => character - b'a' + 26,
            b'0'..=b'9' => character - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' if digits >= 2 => {
                padding += 1;
                0
            }
            _ if character.is_ascii_whitespace() => continue,
            _ => return (bytes, Some(i)),
        };
        if padding > 0 && character != b'=' {
            return (bytes, Some(i));
        }
        word = word << 6 | u32::from(digit);
        digits += 1;
        if digits == 4 {
            bytes.extend_from_slice(&word.to_be_bytes()[1..4 - padding]);
            (word, digits, padding) = (0, 0, 0);
        }
    }
    let end = (digits != 0).then_some(text.len());
    (bytes, end)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 4648, section 10.
    const VECTORS: [(&str, &str); 7] = [
        ("", ""),
        ("f", "Zg=="),
        ("fo", "Zm8="),
        ("foo", "Zm9v"),
        ("foob", "Zm9vYg=="),
        ("fooba", "Zm9vYmE="),
        ("foobar", "Zm9vYmFy"),
    ];

    #[test]
    fn the_vectors_of_the_standard() {
        for (plain, text) in VECTORS {
            assert_eq!(encode(plain.as_bytes()), text);
            assert_eq!(decode(text.as_bytes()), (plain.as_bytes().to_vec(), None));
        }
        let all: Vec<u8> = (0..=255).collect();
        assert_eq!(decode(encode(&all).as_bytes()), (all, None));
    }

    #[test]
    fn encodings_that_follow_each_other_are_one() {
        assert_eq!(decode(b" Zg==\nZm8=Zm9v "), (b"ffofoo".to_vec(), None));
    }

    #[test]
    fn what_is_not_base_64_ends_it() {
        assert_eq!(decode(b"Zm9v*Zm9v"), (b"foo".to_vec(), Some(4)));
        assert_eq!(decode(b"Zm9vZ"), (b"foo".to_vec(), Some(5)));
        assert_eq!(decode(b"Z==="), (vec![], Some(1)));
        assert_eq!(decode(b"Zg=v"), (vec![], Some(3)));
    }
}
