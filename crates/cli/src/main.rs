//! The program `myovib`. Its code is in the library crate.
#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    myovib_cli::main()
}
