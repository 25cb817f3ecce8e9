//! Keys of answers: a hash of everything that an answer depends on.
//!
//! Every field is encoded, in the order of the document and without its name, so that different designs have different
//! bytes. `encoded!` encodes a structure and names all its fields; a missing one does not compile.

use crate::BUILD;
use crate::arithmetic::arithmetic;
use crate::forms::Format;

/// Bytes for the hash.
#[derive(Debug, Default)]
pub struct Encoder(Vec<u8>);

/// A value that an answer depends on.
pub trait Encode {
    /// Writes the value. Different values of a type give different bytes, and none is the beginning of another.
    fn encode(&self, encoder: &mut Encoder);
}

impl Encoder {
    /// Writes a small number, for example the index of an enum variant.
    pub fn byte(&mut self, byte: u8) {
        self.0.push(byte);
    }

    /// Writes a length in groups of seven bits, the lowest first.
    fn length(&mut self, mut length: usize) {
        while length >= 0x80 {
            self.byte(low_bits(length) | 0x80);
            length >>= 7;
        }
        self.byte(low_bits(length));
    }
}

/// -0.0 is encoded as 0.0.
impl Encode for f64 {
    fn encode(&self, encoder: &mut Encoder) {
        encoder.0.extend_from_slice(&(self + 0.0).to_le_bytes());
    }
}

impl Encode for u64 {
    fn encode(&self, encoder: &mut Encoder) {
        encoder.0.extend_from_slice(&self.to_le_bytes());
    }
}

impl Encode for bool {
    fn encode(&self, encoder: &mut Encoder) {
        encoder.byte(u8::from(*self));
    }
}

/// The length comes first.
impl Encode for str {
    fn encode(&self, encoder: &mut Encoder) {
        encoder.length(self.len());
        encoder.0.extend_from_slice(self.as_bytes());
    }
}

/// The length comes first.
impl<T: Encode> Encode for Vec<T> {
    fn encode(&self, encoder: &mut Encoder) {
        encoder.length(self.len());
        self.iter().for_each(|item| item.encode(encoder));
    }
}

#[expect(clippy::cast_possible_truncation, reason = "seven bits are in a byte")]
const fn low_bits(length: usize) -> u8 {
    (length & 0x7f) as u8
}

impl<T: Encode> Encode for Option<T> {
    fn encode(&self, encoder: &mut Encoder) {
        self.is_some().encode(encoder);
        if let Some(value) = self {
            value.encode(encoder);
        }
    }
}

impl<T: Encode + ?Sized> Encode for &T {
    fn encode(&self, encoder: &mut Encoder) {
        (**self).encode(encoder);
    }
}

macro_rules! encode_tuples {
    ($(($($name:ident)+))+) => {$(
        impl<$($name: Encode),+> Encode for ($($name,)+) {
            fn encode(&self, encoder: &mut Encoder) {
                #[allow(non_snake_case, reason = "the values have the names of their types")]
                let ($($name,)+) = self;
                $($name.encode(encoder);)+
            }
        }
    )+};
}

encode_tuples!((A B)(A B C)(A B C D)(A B C D E)(A B C D E F));

/// Encodes structures field by field, and enums of words by their index.
macro_rules! encoded {
    ($(struct $type:ident { $($field:ident),* $(,)? })+) => {$(
        impl $crate::key::Encode for $type {
            #[allow(unused_variables, reason = "an object may have no fields")]
            fn encode(&self, encoder: &mut $crate::key::Encoder) {
                let Self { $($field),* } = self;
                $($crate::key::Encode::encode($field, encoder);)*
            }
        }
    )+};
    ($(enum $type:ident)+) => {$(
        impl $crate::key::Encode for $type {
            fn encode(&self, encoder: &mut $crate::key::Encoder) {
                encoder.byte(*self as u8);
            }
        }
    )+};
}
pub(crate) use encoded;

encoded!(enum Format);

/// Hash of everything that the bytes of an answer depend on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Key([u8; 32]);

impl Key {
    /// Makes the key of a question and the parts of a normalised document that it reads. It includes the build and the
    /// kind of processor.
    pub fn new(asked: &str, read: &impl Encode, form: &impl Encode) -> Self {
        let mut encoder = Encoder::default();
        encoder.0.extend_from_slice(&arithmetic());
        (BUILD, asked, read, form).encode(&mut encoder);
        Self(blake3::hash(&encoder.0).into())
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
