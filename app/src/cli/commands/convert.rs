//! `bregma convert`: a scan in another form.

use crate::cli::args::ConvertArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{warn, with_progress};
use bregma_field::Keep;
use bregma_field::formats;
use bregma_field::formats::zarr;
use bregma_session::{InputError, Source};

/// Reads a scan and writes it in the form that the name of the output asks for; into a store of chunks as it streams, so that it need not fit
/// into memory.
pub fn convert(args: &ConvertArgs) -> Result<(), CommandError> {
    let [from, to] = args.files.0.as_slice() else {
        return Err(CommandError::Usage("name one scan and one file to write".into()));
    };
    if from.transform.is_some() || to.transform.is_some() {
        return Err(CommandError::Usage("--transform is for looking and measuring; a scan is converted as it lies".into()));
    }
    let same = |a: &Source, b: &Source| std::fs::canonicalize(&a.file).is_ok_and(|a| std::fs::canonicalize(&b.file).is_ok_and(|b| a == b));
    if same(from, to) {
        return Err(CommandError::Usage("the scan and the file to write are the same; name another file".into()));
    }
    // Options may stand behind the output; they are still about the scan.
    let source = Source {
        file: from.file.clone(),
        spacing_mm: to.spacing_mm.or(from.spacing_mm),
        turn: if to.turn.is_none() { from.turn } else { to.turn },
        raw: to.raw.clone().or(from.raw.clone()),
        reduce: to.reduce.or(from.reduce),
        uneven: if to.uneven.is_default() { from.uneven } else { to.uneven },
        ..Source::default()
    };
    let keep = Keep { surfaces: args.surfaces, error: args.error };
    if to.file.extension().is_some_and(|end| end.eq_ignore_ascii_case("zarr")) {
        let scan = with_progress("reading", |progress| source.scan(progress)).map_err(InputError::from)?;
        let warnings = with_progress("converting", |progress| zarr::convert(&scan, &to.file, keep, progress))?;
        warn(&warnings.iter().map(|w| format!("{}: {w}", scan.name())).collect::<Vec<_>>());
        return Ok(());
    }
    if keep != Keep::default() {
        return Err(CommandError::Usage("--surfaces and --error are for stores: end the name of the output in .ome.zarr".into()));
    }
    let load = |progress: &_| source.scan(progress)?.load(progress);
    let volume = with_progress("reading", load).map_err(InputError::from)?;
    warn(&volume.warnings().iter().map(|w| format!("{}: {w}", volume.name())).collect::<Vec<_>>());
    let lost = with_progress("writing", |progress| formats::write(&to.file, &volume, progress))?;
    warn(&lost.iter().map(|w| format!("{}: {w}", to.file.display())).collect::<Vec<_>>());
    Ok(())
}
