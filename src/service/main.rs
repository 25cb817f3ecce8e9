//! The `toothwave` binary.

use std::process::ExitCode;

fn main() -> ExitCode {
    toothwave::cli::run()
}
