//! From what a command names to scans that are open.

use super::args::Isovalues;
use super::error::CommandError;
use super::look::set_each;
use super::terminal::{warn, with_progress};
use bregma_session::{Opened, Source};

/// Opens what a command names, with the isovalues it gives, and says what is unusual.
pub fn open(sources: &[Source], isovalues: &Isovalues) -> Result<Opened, CommandError> {
    let mut opened = with_progress("reading", |progress| Opened::read_whole(sources, progress))?;
    set_each(&mut opened.scene.layers, &isovalues.iso, "--iso", |layer, iso| layer.iso = *iso)?;
    if opened.sources.iter().any(|source| source.within.is_some()) {
        with_progress("finding parts", |progress| opened.find_parts(progress))?;
    }
    warn(&opened.warnings());
    Ok(opened)
}

/// Refuses to state lengths on a scan that nobody says the spacing of.
pub fn require_spacing(opened: &Opened) -> Result<(), CommandError> {
    match opened.volumes.iter().find(|v| !v.spacing_is_stated()) {
        None => Ok(()),
        Some(v) => Err(CommandError::NoSpacing(v.name().to_owned())),
    }
}
