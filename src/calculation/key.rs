//! What tells answers apart: a hash of everything that they depend on, in an encoding of its own.
//!
//! Every field is written always, in the order of the document and without its name, so that no two designs share their bytes. A structure
//! is encoded by `encoded!`, which names all its fields: one that was forgotten does not compile.

use crate::BUILD;
use crate::arithmetic::arithmetic;
use crate::forms::Format;

/// Bytes to be hashed.
#[derive(Debug, Default)]
pub struct Encoder(Vec<u8>);

/// A part of what an answer depends on.
pub trait Encode {
    /// Writes it, so that unequal values of a type are unequal bytes, and none is the beginning of another.
    fn encode(&self, encoder: &mut Encoder);
}

impl Encoder {
    /// Writes a small number, such as which variant of an enum stands here.
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

/// Zeros of one sign: -0.0 means nothing else than 0.0.
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

/// Its length before it.
impl Encode for str {
    fn encode(&self, encoder: &mut Encoder) {
        encoder.length(self.len());
        encoder.0.extend_from_slice(self.as_bytes());
    }
}

/// Its length before it.
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
                #[allow(non_snake_case, reason = "the types' names stand for their values")]
                let ($($name,)+) = self;
                $($name.encode(encoder);)+
            }
        }
    )+};
}

encode_tuples!((A B)(A B C)(A B C D)(A B C D E)(A B C D E F));

/// Encodes structures field by field, and enums of words by their order.
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

/// A hash of everything that an answer's bytes depend on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Key([u8; 32]);

impl Key {
    /// The key of what is asked for, read from a normalised document, in a form: from this build, on a processor like this one.
    pub fn new(asked: &str, read: &impl Encode, form: &impl Encode) -> Self {
        let mut encoder = Encoder::default();
        encoder.0.extend_from_slice(&arithmetic());
        (BUILD, asked, read, form).encode(&mut encoder);
        Self(blake3::hash(&encoder.0).into())
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Half of the hash is enough to tell every design ever asked for apart.
        let mut half = [0; 16];
        half.copy_from_slice(&self.0[..16]);
        write!(f, "{:032x}", u128::from_be_bytes(half))
    }
}
