//! Encoding of parts with a hash, because SQLite does not notice damaged content.

use toothwave_calculation::origin;
use toothwave_study::Part;

/// Returns the bytes of a chunk's part, followed by their hash.
pub(super) fn encode(study: &str, chunk: u64, part: &Part) -> postcard::Result<Vec<u8>> {
    let mut bytes = postcard::to_extend(part, Vec::with_capacity(part.bytes() + blake3::OUT_LEN))?;
    let hash = hash(study, chunk, &bytes);
    bytes.extend_from_slice(hash.as_bytes());
    Ok(bytes)
}

/// Returns the part of these bytes, or none if they are damaged or belong to another chunk, study, build or arithmetic.
pub(super) fn decode(study: &str, chunk: u64, bytes: &[u8]) -> Option<Part> {
    let (bytes, stored_hash) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
    if hash(study, chunk, bytes) == *stored_hash { postcard::from_bytes(bytes).ok() } else { None }
}

fn hash(study: &str, chunk: u64, bytes: &[u8]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(origin().as_bytes()).update(study.as_bytes()).update(&chunk.to_le_bytes());
    hasher.update(bytes).finalize()
}
