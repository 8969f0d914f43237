//! What the command line does, a file for each command.

mod bench;
mod chart;
mod convert;
mod demo;
mod info;
mod probe;
mod render;
mod stability;
mod thickness;
mod verify;

pub use bench::bench;
pub use chart::chart;
pub use convert::convert;
pub use demo::{demo, write_demo};
pub use info::info;
pub use probe::probe;
pub use render::render;
pub use stability::stability;
pub use thickness::thickness;
pub use verify::verify;

use crate::cli::args::Isovalues;
use crate::cli::error::CommandError;
use crate::cli::look::set_each;
use bregma_session::{Opened, Source};
use bregma_volume::Progress;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::time::Duration;

/// Prints to standard output. A reader that has seen enough (a closed pipe) is no error.
fn print(text: &str) -> Result<(), CommandError> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(CommandError::Stdout(e)),
        _ => Ok(()),
    }
}

/// Tells the person something on standard error, in one line whatever it names. Where that cannot be written, nobody listens.
pub fn tell(what: &str, message: &dyn std::fmt::Display) {
    let text = message.to_string();
    let line: String = text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect();
    drop(writeln!(io::stderr(), "{what}: {line}"));
}

fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| tell("warning", warning));
}

/// Runs long work with a progress bar, if a person is watching.
fn with_progress<T>(label: &'static str, work: impl FnOnce(&Progress) -> T) -> T {
    let progress = Progress::default();
    if !io::stderr().is_terminal() {
        return work(&progress);
    }
    let done = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let style = indicatif::ProgressStyle::with_template("{prefix} {bar:40} {msg}");
            let bar = indicatif::ProgressBar::new(1000).with_prefix(label);
            let bar = style.map(|s| bar.clone().with_style(s)).unwrap_or(bar);
            while !done.load(std::sync::atomic::Ordering::Relaxed) {
                bar.set_position((progress.fraction() * 1000.0) as u64);
                bar.set_message(progress.text());
                std::thread::sleep(Duration::from_millis(50));
            }
            bar.finish_and_clear();
        });
        let result = work(&progress);
        done.store(true, std::sync::atomic::Ordering::Relaxed);
        result
    })
}

/// Opens what a command names, with the isovalues it gives, and says what is unusual.
fn open(sources: &[Source], isovalues: &Isovalues) -> Result<Opened, CommandError> {
    let mut opened = with_progress("reading", |progress| Opened::read(sources, progress))?;
    set_isovalues(&mut opened, isovalues)?;
    warn(&opened.warnings());
    Ok(opened)
}

/// Sets the isovalues that are given, whatever a preset says.
fn set_isovalues(opened: &mut Opened, isovalues: &Isovalues) -> Result<(), CommandError> {
    set_each(&mut opened.scene.layers, &isovalues.iso, "--iso", |layer, iso| layer.iso = *iso)
}

/// Refuses to state lengths on a scan that nobody says the spacing of.
fn require_spacing(opened: &Opened) -> Result<(), CommandError> {
    match opened.volumes.iter().find(|v| !v.spacing_is_stated()) {
        None => Ok(()),
        Some(v) => Err(CommandError::NoSpacing(v.name().to_owned())),
    }
}

/// Makes a folder for outputs, if it is not there.
fn make_folder(folder: &Path) -> Result<(), CommandError> {
    std::fs::create_dir_all(folder).map_err(|reason| CommandError::Folder { folder: folder.to_owned(), reason })
}
