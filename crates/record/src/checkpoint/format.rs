//! Byte layout of checkpoint files.

use std::io;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::CheckpointError;
use pliant_files::fnv::fnv1a;

pub(super) const MAGIC: [u8; 8] = *b"\x89PLIANT\n";
/// Version of the layout; the content is versioned by the program's version.
pub(super) const FORMAT: u32 = 1;
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Encodes a file with this content.
pub(super) fn encode(content: &impl Serialize) -> io::Result<Vec<u8>> {
    encode_as(FORMAT, VERSION, content)
}

/// Encodes a file with this format and program version.
pub(super) fn encode_as(format: u32, version: &str, content: &impl Serialize) -> io::Result<Vec<u8>> {
    let mut body = (version.len() as u16).to_le_bytes().to_vec();
    body.extend_from_slice(version.as_bytes());
    ciborium::into_writer(content, &mut body).map_err(io::Error::other)?;
    let (length, hash) = (body.len() as u64, fnv1a(&body));
    let head = [&MAGIC[..], &format.to_le_bytes(), &length.to_le_bytes(), &hash.to_le_bytes()].concat();
    Ok([head, body].concat())
}

/// Decodes the content of a file; `path` is its name in errors.
pub(super) fn decode<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T, CheckpointError> {
    let path = || path.to_owned();
    let damaged = || CheckpointError::Damaged { path: path() };
    let Some(rest) = bytes.strip_prefix(&MAGIC) else {
        let is_cut = MAGIC.starts_with(bytes) && !bytes.is_empty();
        return Err(if is_cut { damaged() } else { CheckpointError::NotACheckpoint { path: path() } });
    };
    let (format, rest) = rest.split_first_chunk().ok_or_else(damaged)?;
    let found = u32::from_le_bytes(*format);
    if found != FORMAT {
        return Err(CheckpointError::Format { path: path(), found, expected: FORMAT });
    }
    let (length, rest) = rest.split_first_chunk().ok_or_else(damaged)?;
    let (hash, body) = rest.split_first_chunk().ok_or_else(damaged)?;
    let is_whole =
        u64::from_le_bytes(*length) == body.len() as u64 && u64::from_le_bytes(*hash) == fnv1a(body);
    let (length, body) = body.split_first_chunk().filter(|_| is_whole).ok_or_else(damaged)?;
    let (version, content) = body.split_at_checked(u16::from_le_bytes(*length).into()).ok_or_else(damaged)?;
    if version != VERSION.as_bytes() {
        let found = String::from_utf8_lossy(version).into_owned();
        return Err(CheckpointError::Version { path: path(), found, expected: VERSION });
    }
    ciborium::from_reader(content).map_err(|_| damaged())
}
