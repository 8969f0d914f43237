//! The program: the window, or one command of the command line.

use bregma::args::{Cli, Command, Common};
use bregma::commands::{self, CommandError, tell};
use bregma::window::{self, Start};
use clap::Parser;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(threads) = cli.common.threads {
        // Fails only if the pool already runs, and nothing has used it yet.
        drop(rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global());
    }
    if cli.command.is_some() && !cli.sources.0.is_empty() {
        return status(Err(CommandError::Usage("scans are named before the command; name them after it".into())));
    }
    let done = match &cli.command {
        Some(Command::Demo(args)) => commands::demo(args, cli.common.backend),
        Some(Command::Info(args)) => commands::info(args),
        Some(Command::Convert(args)) => commands::convert(args),
        Some(Command::Render(args)) => commands::render(args, cli.common.backend),
        Some(Command::Probe(args)) => commands::probe(args),
        Some(Command::Verify(args)) => commands::verify(args),
        Some(Command::Thickness(args)) => commands::thickness(args, cli.common.backend),
        Some(Command::Stability(args)) => commands::stability(args, cli.common.backend),
        Some(Command::Chart(args)) => commands::chart(args, cli.common.backend),
        Some(Command::Bench(args)) => commands::bench(args, cli.common.backend),
        None => return workstation(cli),
    };
    status(done)
}

fn status(done: Result<(), CommandError>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tell("error", &error);
            if matches!(error, CommandError::Usage(_)) { ExitCode::from(2) } else { ExitCode::FAILURE }
        }
    }
}

/// Opens the window; where there is none to open, the demo pair is written as files instead.
fn workstation(cli: Cli) -> ExitCode {
    let sources = cli.sources.0;
    let is_demo = sources.is_empty();
    let opened = if has_display() {
        window::run(if is_demo { Start::Demo } else { Start::Files(sources) }).map_err(|e| format!("the window cannot be opened ({e})"))
    } else {
        Err("there is no display".into())
    };
    match opened {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) if is_demo => write_demo_instead(&reason, &cli.common),
        Err(reason) => {
            tell("error", &format!("{reason}; use `bregma render` for pictures and `bregma probe` for lengths"));
            ExitCode::FAILURE
        }
    }
}

fn write_demo_instead(reason: &str, common: &Common) -> ExitCode {
    let folder = Path::new("bregma-demo");
    tell("warning", &format!("{reason}, so the demo pair is written to {} instead", folder.display()));
    status(commands::write_demo(folder, bregma::input::DEMO_SIZE, common.backend))
}

fn has_display() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    !cfg!(all(unix, not(target_os = "macos"))) || set("DISPLAY") || set("WAYLAND_DISPLAY")
}
