//! The program `myovib`. Its code is in the library crate.
#![forbid(unsafe_code)]

use myovib_cli::exit::Exit;
use myovib_sparse::Allocator;

#[global_allocator]
static ALLOCATOR: Allocator = Allocator { exit_code: Exit::Failed as i32 };

fn main() -> std::process::ExitCode {
    myovib_cli::main()
}
