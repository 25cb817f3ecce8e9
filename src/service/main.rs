//! The `toothwave` binary.

use std::process::ExitCode;

/// A large sweep's columns are fresh memory each time with the system's allocator, and the kernel's clearing of their pages takes longer
/// than filling them: at 350 000 states 91 ns a state, where this one takes 39. It keeps pages for the next sweep, and gives
/// few of them back, unless `MIMALLOC_PURGE_DELAY` is 0, as in the image.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    toothwave::cli::run()
}
