//! The program: the window, or one command of the command line.

fn main() -> std::process::ExitCode {
    bregma::cli::main()
}
