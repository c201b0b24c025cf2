//! Chunks: bounded decompression, and the records in them.

use std::io::{ErrorKind, Read};

use mcap::records::ChunkHeader;
use mcap::{McapError, McapResult};

/// Opcode and length of a record.
pub(super) const RECORD_HEADER: usize = 9;

/// Decompressed size allowed for any chunk [bytes]. A recorder closes a chunk after
/// [`CHUNK_BYTES`](crate::container::CHUNK_BYTES), so that only longer frames make larger ones.
const ANY_CHUNK: u64 = 64 << 20;

/// Compression ratio allowed for larger chunks. Frames that long hold a position and a velocity for each
/// vertex, which zstd compresses to a tenth at best.
const MOST_COMPRESSED: u64 = 1 << 8;

/// Decompresses a chunk, after checking its size against these bounds, and verifies its checksum: lengths
/// in a damaged chunk may ask for more memory than there is.
pub(super) fn unpacked(header: &ChunkHeader, data: &[u8]) -> McapResult<Vec<u8>> {
    let stated = header.uncompressed_size;
    let limit = ANY_CHUNK.max(MOST_COMPRESSED.saturating_mul(data.len() as u64));
    let size = usize::try_from(stated).ok().filter(|_| stated <= limit).ok_or_else(|| {
        let packed = data.len();
        let what = format!("a chunk of {packed} bytes states {stated} unpacked bytes; the limit is {limit}");
        McapError::DecompressionError(what)
    })?;
    let content = match header.compression.as_str() {
        "" => data.to_vec(),
        #[cfg(not(target_family = "wasm"))]
        "zstd" => zstd::bulk::decompress(data, size)
            .map_err(|error| McapError::DecompressionError(error.to_string()))?,
        other => return Err(McapError::UnsupportedCompression(other.to_owned())),
    };
    if content.len() != size {
        return Err(McapError::BadChunkLength { header: stated, available: content.len() as u64 });
    }
    let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&content));
    // Writers without checksums store 0.
    if saved != 0 && saved != calculated {
        return Err(McapError::BadChunkCrc { saved, calculated });
    }
    Ok(content)
}

/// Opcode and body of the first record in `bytes`, and the bytes after it.
pub(super) fn first_record(bytes: &[u8]) -> McapResult<(u8, &[u8], &[u8])> {
    let cut = || McapError::UnexpectedEof;
    let (header, rest) = bytes.split_first_chunk::<RECORD_HEADER>().ok_or_else(cut)?;
    let (opcode, length) = opcode_and_length(header);
    let length = usize::try_from(length).map_err(|_| cut())?;
    let (body, rest) = rest.split_at_checked(length).ok_or_else(cut)?;
    Ok((opcode, body, rest))
}

/// Reads opcode and body of the next record from `source`, which has `size` bytes left; `None` at its
/// end. A length beyond the end allocates nothing.
pub(super) fn read_record(source: &mut dyn Read, size: u64) -> McapResult<Option<(u8, Vec<u8>)>> {
    if size == 0 {
        return Ok(None);
    }
    let mut header = [0; RECORD_HEADER];
    read_exactly(source, &mut header)?;
    let (opcode, length) = opcode_and_length(&header);
    let room = size.saturating_sub(RECORD_HEADER as u64);
    let length = usize::try_from(length).ok().filter(|_| length <= room).ok_or(McapError::UnexpectedEof)?;
    let mut body = vec![0; length];
    read_exactly(source, &mut body)?;
    Ok(Some((opcode, body)))
}

fn opcode_and_length(header: &[u8; RECORD_HEADER]) -> (u8, u64) {
    let [opcode, length @ ..] = *header;
    (opcode, u64::from_le_bytes(length))
}

fn read_exactly(source: &mut dyn Read, bytes: &mut [u8]) -> McapResult<()> {
    source.read_exact(bytes).map_err(|error| match error.kind() {
        ErrorKind::UnexpectedEof => McapError::UnexpectedEof,
        _ => McapError::Io(error),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(compression: &str, size: usize, checksum: u32, packed: &[u8]) -> ChunkHeader {
        ChunkHeader {
            message_start_time: 0,
            message_end_time: 0,
            uncompressed_size: size as u64,
            uncompressed_crc: checksum,
            compression: compression.to_owned(),
            compressed_size: packed.len() as u64,
        }
    }

    #[test]
    fn chunks_have_the_size_and_the_checksum_that_they_state() {
        let content: Vec<u8> = (0..1 << 18).map(|i: u32| (i % 251) as u8).collect();
        let packed = zstd::bulk::compress(&content, 1).unwrap();
        let (size, checksum) = (content.len(), crc32fast::hash(&content));
        for (compression, packed) in [("zstd", &packed), ("", &content)] {
            let of = |size, checksum| unpacked(&header(compression, size, checksum, packed), packed);
            assert_eq!(of(size, checksum).unwrap(), content);
            assert_eq!(of(size, 0).unwrap(), content);
            assert!(matches!(of(size, checksum ^ 1), Err(McapError::BadChunkCrc { .. })));
            for wrong in [0, size - 1, size + 1, 2 * size, ANY_CHUNK as usize + 1, usize::MAX] {
                assert!(of(wrong, 0).is_err(), "{wrong} bytes of {compression}");
            }
        }
        assert!(unpacked(&header("lz4", size, 0, &packed), &packed).is_err());
    }
}
