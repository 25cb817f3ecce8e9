//! Which last bits the machine gives.

use std::hint::black_box;
use std::sync::LazyLock;

use crate::BUILD;

/// Origin of an answer's bits besides the question: the build, a hyphen, and the arithmetic of the processor.
pub fn origin() -> &'static str {
    static ORIGIN: LazyLock<String> = LazyLock::new(|| format!("{BUILD}-{:016x}", u64::from_be_bytes(arithmetic())));
    &ORIGIN
}

/// Which code the mathematical library chose for this processor, told by what it makes of some thousand arguments: the same binary can give other last bits
/// on another one. So does the solver, which uses wider instructions where there are any.
pub(crate) fn arithmetic() -> [u8; 8] {
    static ARITHMETIC: LazyLock<[u8; 8]> = LazyLock::new(|| {
        let mut hasher = blake3::Hasher::new();
        #[cfg(target_arch = "x86_64")]
        hasher.update(&[u8::from(is_x86_feature_detected!("avx2")), u8::from(is_x86_feature_detected!("fma"))]);
        let functions: [fn(f64) -> f64; 10] = [
            |x| x.powf(10.0 / 9.0),
            |x| x.powf(0.9),
            |x| x.powf(-0.37),
            f64::exp,
            f64::ln,
            f64::sin,
            f64::cos,
            f64::tan,
            f64::atan,
            f64::cbrt,
        ];
        for step in 1..1024 {
            let x = black_box(f64::from(step)) / 97.0;
            for function in functions {
                hasher.update(&function(x).to_bits().to_le_bytes());
            }
        }
        let mut hash = [0; 8];
        hasher.finalize_xof().fill(&mut hash);
        hash
    });
    *ARITHMETIC
}
