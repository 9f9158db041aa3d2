//! The program `myovib`; all of it is in the library beside.
#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    myovib_cli::main()
}
