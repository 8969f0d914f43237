//! The command line.

mod args;
mod camera_args;
mod commands;
mod error;
mod look;
mod opening;
mod parsers;
mod print_args;
mod sources;
mod studio_args;
mod terminal;

use crate::window::{self, Start};
use args::{Cli, Command, Common};
use bregma_session::{DEMO_SIZE, Source};
use clap::Parser;
use error::CommandError;
use std::path::Path;
use std::process::ExitCode;
use terminal::tell;

/// Does what the command line says. Fails with status 2 if it says what cannot be, else with 1.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(threads) = cli.common.threads {
        // Fails only if the pool already runs, and nothing has used it yet.
        drop(rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global());
    }
    if cli.command.is_some() && !cli.sources.0.is_empty() {
        return status(Err(CommandError::Usage("scans are named before the command; name them after it".into())));
    }
    if cli.command.is_some() && cli.kiosk.is_some() {
        return status(Err(CommandError::Usage("--kiosk is of the window, not of a command; leave it out".into())));
    }
    match &cli.command {
        Some(command) => status(run(command, &cli.common)),
        None => workstation(cli.sources.0, cli.kiosk, &cli.common),
    }
}

fn run(command: &Command, Common { backend, .. }: &Common) -> Result<(), CommandError> {
    let machine = *backend;
    match command {
        Command::Demo(args) => commands::demo(args, machine),
        Command::Info(args) => commands::info(args),
        Command::Convert(args) => commands::convert(args),
        Command::Render(args) => commands::render(args, machine),
        Command::Film(args) => commands::film(args, machine),
        Command::Probe(args) => commands::probe(args),
        Command::Verify(args) => commands::verify(args, machine),
        Command::Thickness(args) => commands::thickness(args, machine),
        Command::Difference(args) if args.each || args.all_pairs => commands::differences(args, machine),
        Command::Difference(args) => commands::difference(args, machine),
        Command::Section(args) => commands::section(args),
        Command::Volume(args) => commands::volume(args),
        Command::Parts(args) => commands::parts(args),
        Command::Filter(args) => commands::filter(args),
        Command::Orient(args) => commands::orient(args),
        Command::Register(args) => commands::register(args),
        Command::Stability(args) => commands::stability(args, machine),
        Command::Chart(args) => commands::chart(args, machine),
        Command::Bench(args) => commands::bench(args, machine),
    }
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
fn workstation(sources: Vec<Source>, kiosk: Option<window::Kiosk>, common: &Common) -> ExitCode {
    let is_demo = sources.is_empty();
    let opened = if has_display() {
        window::run(if is_demo { Start::Demo } else { Start::Files(sources) }, kiosk)
            .map_err(|e| format!("the window cannot be opened ({e})"))
    } else {
        Err("there is no display".into())
    };
    match opened {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) if is_demo => write_demo_instead(&reason, common),
        Err(reason) => {
            tell("error", &format!("{reason}; use `bregma render` for pictures and `bregma probe` for lengths"));
            ExitCode::FAILURE
        }
    }
}

fn write_demo_instead(reason: &str, common: &Common) -> ExitCode {
    let folder = Path::new("bregma-demo");
    tell("warning", &format!("{reason}, so the demo pair is written to {} instead", folder.display()));
    status(commands::write_demo(folder, DEMO_SIZE, common.backend))
}

fn has_display() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    !cfg!(all(unix, not(target_os = "macos"))) || set("DISPLAY") || set("WAYLAND_DISPLAY")
}
