//! Compact encoding of values over time: 16 bits each, differences of frames, deflate.
//!
//! A chunk of frames becomes the differences of order 1 or 2 in time, whichever is smaller; zigzag (`0,
//! -1, 1, -2, ..` as `0, 1, 2, 3, ..`); all low bytes, then all high bytes; deflate (RFC 1951). The first
//! frame of a chunk is stored without differences.

use miniz_oxide::deflate::compress_to_vec;

/// Deflate level: 9 saves 2 % more and takes three times as long.
const LEVEL: u8 = 6;
/// Largest code of a value; the next one marks values that are not finite.
pub(super) const LARGEST: u16 = u16::MAX - 1;

/// Quantiser of values in a range: `low + step * code`, error at most half a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quantiser {
    pub(super) low: f64,
    pub(super) step: f64,
}

/// Frames encoded together.
pub(super) struct Chunk {
    /// Order of the differences in time.
    pub(super) order: u8,
    pub(super) bytes: Vec<u8>,
}

/// Range of the values seen so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Extent {
    pub(super) const EMPTY: Extent = Extent { low: f64::INFINITY, high: f64::NEG_INFINITY };

    pub(super) fn add(&mut self, value: f64) {
        if value.is_finite() {
            self.low = self.low.min(value);
            self.high = self.high.max(value);
        }
    }

    /// Length of the range; 0 if it is empty.
    pub(super) fn length(&self) -> f64 {
        (self.high - self.low).max(0.0)
    }
}

impl Quantiser {
    pub(super) fn of(extent: Extent) -> Quantiser {
        let low = if extent.low.is_finite() { extent.low } else { 0.0 };
        Quantiser { low, step: extent.length() / f64::from(LARGEST) }
    }

    pub(super) fn code(&self, value: f64) -> u16 {
        if !value.is_finite() {
            return LARGEST + 1;
        }
        if self.step > 0.0 {
            ((value - self.low) / self.step).round().min(f64::from(LARGEST)) as u16
        } else {
            0
        }
    }
}

/// Encodes frames of equal lengths.
pub(super) fn encode(frames: &[Vec<u16>]) -> Chunk {
    let one = deflate(&planes(&differences(frames, 1)));
    let two = deflate(&planes(&differences(frames, 2)));
    if two.len() < one.len() { Chunk { order: 2, bytes: two } } else { Chunk { order: 1, bytes: one } }
}

/// Compresses to raw deflate.
pub(super) fn deflate(bytes: &[u8]) -> Vec<u8> {
    compress_to_vec(bytes, LEVEL)
}

fn differences(frames: &[Vec<u16>], order: u8) -> Vec<u16> {
    let mut codes = Vec::with_capacity(frames.iter().map(Vec::len).sum());
    for (f, frame) in frames.iter().enumerate() {
        codes.extend((0..frame.len()).map(|k| {
            let expected = match (f, order) {
                (0, _) => 0,
                (1, _) | (_, 1) => frames[f - 1][k],
                _ => frames[f - 1][k].wrapping_mul(2).wrapping_sub(frames[f - 2][k]),
            };
            zigzag(frame[k].wrapping_sub(expected) as i16)
        }));
    }
    codes
}

fn zigzag(difference: i16) -> u16 {
    ((difference << 1) ^ (difference >> 15)) as u16
}

fn planes(codes: &[u16]) -> Vec<u8> {
    let low = codes.iter().map(|code| (code & 255) as u8);
    low.chain(codes.iter().map(|code| (code >> 8) as u8)).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Decodes the frames of a chunk, each of `length` codes, as `data.js` does.
    pub(in crate::page) fn decode(bytes: &[u8], order: u8, length: usize) -> Vec<Vec<u16>> {
        let planes = miniz_oxide::inflate::decompress_to_vec(bytes).unwrap();
        let (low, high) = planes.split_at(planes.len() / 2);
        let codes: Vec<u16> =
            low.iter().zip(high).map(|(low, high)| u16::from(*low) | u16::from(*high) << 8).collect();
        let mut frames: Vec<Vec<u16>> = vec![];
        for row in codes.chunks(length) {
            let f = frames.len();
            let frame = row.iter().enumerate().map(|(k, code)| {
                let difference = (code >> 1) ^ 0u16.wrapping_sub(code & 1);
                let expected = match (f, order) {
                    (0, _) => 0,
                    (1, _) | (_, 1) => frames[f - 1][k],
                    _ => frames[f - 1][k].wrapping_mul(2).wrapping_sub(frames[f - 2][k]),
                };
                difference.wrapping_add(expected)
            });
            let frame = frame.collect();
            frames.push(frame);
        }
        frames
    }

    #[test]
    fn frames_come_back_within_half_a_step() {
        let value = |f: usize, k: usize| (0.3 * f as f64 + 1.7 * k as f64).sin() * 3.0 + 40.0 * k as f64;
        let values: Vec<Vec<f64>> = (0..7).map(|f| (0..50).map(|k| value(f, k)).collect()).collect();
        let mut extent = Extent::EMPTY;
        values.iter().flatten().for_each(|value| extent.add(*value));
        let quantiser = Quantiser::of(extent);
        let codes: Vec<Vec<u16>> =
            values.iter().map(|row| row.iter().map(|value| quantiser.code(*value)).collect()).collect();
        let chunk = encode(&codes);
        let back = decode(&chunk.bytes, chunk.order, 50);
        assert_eq!(back, codes);
        for (row, codes) in values.iter().zip(&back) {
            for (value, code) in row.iter().zip(codes) {
                let shown = quantiser.low + quantiser.step * f64::from(*code);
                assert!((shown - value).abs() <= 0.5 * quantiser.step * (1.0 + 1e-9), "{shown} {value}");
            }
        }
    }

    #[test]
    fn differences_of_the_whole_range_wrap() {
        let frames = vec![vec![0, 65_535, 1], vec![65_535, 0, 2], vec![0, 65_535, 3]];
        for order in [1, 2] {
            let bytes = deflate(&planes(&differences(&frames, order)));
            assert_eq!(decode(&bytes, order, 3), frames, "order {order}");
        }
    }

    #[test]
    fn equal_and_missing_numbers_have_codes() {
        let mut extent = Extent::EMPTY;
        extent.add(2.0);
        extent.add(f64::NAN);
        let quantiser = Quantiser::of(extent);
        assert_eq!((quantiser.code(2.0), quantiser.code(f64::NAN)), (0, LARGEST + 1));
        assert_eq!(Quantiser::of(Extent::EMPTY), Quantiser { low: 0.0, step: 0.0 });
    }
}
