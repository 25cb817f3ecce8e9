//! Keys of answers: a hash of everything that an answer depends on.

use serde::Serialize;

use crate::BUILD;
use crate::arithmetic::arithmetic;

/// Hash of everything that the bytes of an answer depend on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Key([u8; 32]);

impl Key {
    /// Makes the key of a question and the parts of a normalised document that it reads, by their JSON. It includes the
    /// build and the kind of processor.
    pub fn new(asked: &str, read: &impl Serialize, form: &impl Serialize) -> Self {
        // Only maps whose keys are not texts have no JSON.
        let text = serde_json::to_vec(&(arithmetic(), BUILD, asked, read, form)).expect("documents have JSON");
        Self(blake3::hash(&text).into())
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Half of the hash is sufficient to distinguish all designs.
        let mut half = [0; 16];
        half.copy_from_slice(&self.0[..16]);
        write!(f, "{:032x}", u128::from_be_bytes(half))
    }
}
