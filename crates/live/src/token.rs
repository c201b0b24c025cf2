//! Random part of the address.

use crate::LiveError;

/// 128 random bits, in hexadecimal.
#[derive(Clone)]
pub(crate) struct Token(String);

impl Token {
    /// Creates a random token.
    ///
    /// # Errors
    /// The system has no random numbers.
    pub(crate) fn random() -> Result<Token, LiveError> {
        let mut bits = [0u8; 16];
        getrandom::fill(&mut bits).map_err(LiveError::Token)?;
        Ok(Token(bits.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Token as text.
    pub(crate) fn text(&self) -> &str {
        &self.0
    }

    /// True if `text` is the token; compared in constant time.
    pub(crate) fn is(&self, text: &str) -> bool {
        let differences = self.0.bytes().zip(text.bytes()).fold(0, |found, (a, b)| found | (a ^ b));
        self.0.len() == text.len() && std::hint::black_box(differences) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_of_128_bits_differ_and_match_themselves_alone() {
        let (a, b) = (Token::random().unwrap(), Token::random().unwrap());
        assert_eq!(a.text().len(), 32);
        assert!(a.is(a.text()) && !a.is(b.text()) && !a.is("") && !a.is(&a.text()[..31]));
        assert!(!a.is(&format!("{}0", a.text())));
    }
}
