//! The command line `trainer`.

use std::process::ExitCode;

fn main() -> ExitCode {
    glimpse_program::run()
}
