//! The `toothwave` binary.

use std::process::ExitCode;

/// A large sweep's columns are fresh memory each time with the system's allocator, and the kernel's clearing of their pages takes longer
/// than filling them. This one keeps pages for the next sweep and gives them back after a while.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    toothwave::cli::run()
}
