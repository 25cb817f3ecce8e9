//! A part as bytes, with a hash that shows whether they are still the same: SQLite does not notice damaged content.

use toothwave_calculation::origin;
use toothwave_study::Part;

/// The bytes of a chunk's part, and behind them their hash.
///
/// # Errors
/// If the part cannot be encoded.
pub(super) fn sealed(study: &str, chunk: u64, part: &Part) -> postcard::Result<Vec<u8>> {
    let expected_bytes = part.bytes() + blake3::OUT_LEN;
    let mut bytes = postcard::to_extend(part, Vec::with_capacity(expected_bytes))?;
    let hash = hash(study, chunk, &bytes);
    bytes.extend_from_slice(hash.as_bytes());
    Ok(bytes)
}

/// The part of these bytes; none if they are damaged, or belong to another chunk, study, build or arithmetic.
pub(super) fn unsealed(study: &str, chunk: u64, bytes: &[u8]) -> Option<Part> {
    let (bytes, kept) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
    if hash(study, chunk, bytes) == *kept { postcard::from_bytes(bytes).ok() } else { None }
}

fn hash(study: &str, chunk: u64, bytes: &[u8]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(origin().as_bytes()).update(study.as_bytes()).update(&chunk.to_le_bytes());
    hasher.update(bytes).finalize()
}
