//! What the command line says, and how far it is.

use super::error::CommandError;
use bregma_field::Progress;
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

/// Prints to standard output. A reader that has seen enough (a closed pipe) is no error.
pub fn print(text: &str) -> Result<(), CommandError> {
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

/// Warns of what a command goes on in spite of.
pub fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| tell("warning", warning));
}

/// Runs long work with a progress bar, if a person is watching.
pub fn with_progress<T>(label: &'static str, work: impl FnOnce(&Progress) -> T) -> T {
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
