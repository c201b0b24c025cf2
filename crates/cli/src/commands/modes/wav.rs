//! WAV files of one channel, in whole numbers of 16 or 24 bits.
//!
//! The format is `WAVE_FORMAT_PCM` for both: the extensible one, which Microsoft asks for above 16 bits, says
//! nothing more of a single channel, and programs that know only the plain one, Python's `wave` before 3.12
//! among them, refuse it.

use std::io;

/// Integer samples, the format that every player reads.
const PCM: u16 = 1;
/// Bytes of the header after the size that it states first.
const HEADER: usize = 36;

/// The file: `samples` from -1 to 1 at `rate` [Hz].
///
/// # Errors
/// [`io::ErrorKind::FileTooLarge`] where there are more bytes than the format can count, 4 GiB.
pub(super) fn encode(samples: &[f64], rate: u32, bits: u16) -> io::Result<Vec<u8>> {
    let width = usize::from(bits / 8);
    let length = samples.len().saturating_mul(width);
    // Chunks have an even length; the byte that makes it so is not counted in theirs.
    let padding = length % 2;
    let size = u32::try_from(length.saturating_add(HEADER + padding));
    let size = size.map_err(|_| io::Error::new(io::ErrorKind::FileTooLarge, "more than 4 GiB of samples"))?;
    let align = bits / 8;
    let mut file = Vec::with_capacity(HEADER + 8 + length + padding);
    file.extend_from_slice(b"RIFF");
    file.extend_from_slice(&size.to_le_bytes());
    file.extend_from_slice(b"WAVEfmt ");
    file.extend_from_slice(&16_u32.to_le_bytes());
    file.extend_from_slice(&PCM.to_le_bytes());
    file.extend_from_slice(&1_u16.to_le_bytes());
    file.extend_from_slice(&rate.to_le_bytes());
    file.extend_from_slice(&(rate * u32::from(align)).to_le_bytes());
    file.extend_from_slice(&align.to_le_bytes());
    file.extend_from_slice(&bits.to_le_bytes());
    file.extend_from_slice(b"data");
    file.extend_from_slice(&(size - (HEADER + padding) as u32).to_le_bytes());
    let largest = f64::from((1_i32 << (bits - 1)) - 1);
    for sample in samples {
        let bytes = ((sample * largest).round() as i32).to_le_bytes();
        file.extend_from_slice(&bytes[..width]);
    }
    file.resize(file.len() + padding, 0);
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Byte for byte: what a reader that knows only `WAVE_FORMAT_PCM` asks for.
    #[test]
    fn the_header_is_that_of_plain_pcm() {
        for (bits, samples, data) in [
            (16, [0.0, 1.0, -1.0], &[0, 0, 0xFF, 0x7F, 0x01, 0x80][..]),
            (24, [0.0, 1.0, -1.0], &[0, 0, 0, 0xFF, 0xFF, 0x7F, 0x01, 0x00, 0x80, 0]),
        ] {
            let file = encode(&samples, 48_000, bits).unwrap();
            let width = u32::from(bits / 8);
            let header = [
                &b"RIFF"[..],
                &(file.len() as u32 - 8).to_le_bytes(),
                b"WAVEfmt \x10\0\0\0\x01\0\x01\0\x80\xBB\0\0",
                &(48_000 * width).to_le_bytes(),
                &[width as u8, 0, bits as u8, 0],
                b"data",
                &(3 * width).to_le_bytes(),
            ];
            assert_eq!(file, [&header.concat(), data].concat(), "{bits} bits");
        }
    }
}
