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

use crate::args::{Backend, Isovalues};
use crate::input::{InputError, Opened, Source};
use crate::output::OutputError;
use bregma_field::Progress;
use bregma_field::formats::WriteError;
use bregma_renderer::{CpuRenderer, GpuRenderer, RenderError, Renderer};
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::time::Duration;
use thiserror::Error;

/// Why a command did not do its work: one sentence for the person.
#[derive(Debug, Error)]
pub enum CommandError {
    /// Something could not be opened.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Something could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Something could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A scan could not be written.
    #[error(transparent)]
    Scan(#[from] WriteError),
    /// The stability table.
    #[error(transparent)]
    Stability(#[from] bregma_renderer::stability::StabilityError),
    /// The chart of speed and accuracy.
    #[error(transparent)]
    Chart(#[from] crate::chart::ChartError),
    /// A registration flattens a volume.
    #[error("the transform of a volume cannot be used: {0}")]
    Grid(#[from] bregma_field::GridError),
    /// A look that is not there.
    #[error(transparent)]
    Preset(#[from] crate::presets::PresetError),
    /// Standard output broke.
    #[error("standard output cannot be written ({0})")]
    Stdout(std::io::Error),
    /// A list of rays that cannot be used, a folder that cannot be made, or a scan without spacing.
    #[error("{0}")]
    File(String),
    /// Wrong usage that only shows once the scans are known; status 2.
    #[error("{0}")]
    Usage(String),
}

/// Prints to standard output. A reader that has seen enough (a closed pipe) is no error.
fn print(text: &str) -> Result<(), CommandError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(CommandError::Stdout(e)),
        _ => Ok(()),
    }
}

/// Tells the person something on standard error, in one line whatever it names. Where that cannot be written, nobody listens.
pub fn tell(what: &str, message: &dyn std::fmt::Display) {
    let text = message.to_string();
    let line: String = text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect();
    drop(writeln!(std::io::stderr(), "{what}: {line}"));
}

fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| tell("warning", warning));
}

/// Runs long work with a progress bar, if a person is watching.
fn with_progress<T>(label: &'static str, work: impl FnOnce(&Progress) -> T) -> T {
    let progress = Progress::default();
    if !std::io::stderr().is_terminal() {
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
        Some(v) => {
            let text = format!("{}: it states no spacing, so no length on it is known in mm; pass --spacing X,Y,Z", v.name());
            Err(CommandError::File(text))
        }
    }
}

/// Makes a folder for outputs, if it is not there.
fn make_folder(folder: &Path) -> Result<(), CommandError> {
    let fail = |e| CommandError::File(format!("{}: cannot be made ({e}); choose another folder", folder.display()));
    std::fs::create_dir_all(folder).map_err(fail)
}

/// Applies values that are given once for all, or once for each.
pub(crate) fn set_each<L, V>(layers: &mut [L], values: &[V], option: &str, set: impl Fn(&mut L, &V)) -> Result<(), CommandError> {
    let count = layers.len();
    match values {
        [] => {}
        [one] => layers.iter_mut().for_each(|layer| set(layer, one)),
        many if many.len() == count => layers.iter_mut().zip(many).for_each(|(layer, value)| set(layer, value)),
        many => {
            let text = format!("{option} is given {} times for {count} volumes; give it once for all, or once for each", many.len());
            return Err(CommandError::Usage(text));
        }
    }
    Ok(())
}

/// The renderer that `--backend` asks for.
fn renderer(backend: Backend) -> Result<Box<dyn Renderer>, CommandError> {
    match backend {
        Backend::Cpu => Ok(Box::new(CpuRenderer::default())),
        Backend::Gpu => Ok(Box::new(GpuRenderer::new(true).map_err(RenderError::from)?)),
        Backend::Auto => Ok(match GpuRenderer::new(false) {
            Ok(gpu) => Box::new(gpu),
            Err(_) => Box::new(CpuRenderer::default()),
        }),
    }
}
