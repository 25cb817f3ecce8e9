//! The `toothwave` binary.

use std::process::ExitCode;

/// mimalloc reuses pages between sweeps. With the system allocator every large sweep gets new pages, and the kernel
/// clears each: 91 ns a state at 350 000 states, against 39 ns here. `MIMALLOC_PURGE_DELAY=0`, as in the image, returns
/// free pages to the kernel at once.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    toothwave::cli::run()
}
