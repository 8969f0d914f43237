//! `bregma verify`: whether recorded measurements still hold.

use crate::cli::args::VerifyArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{print, warn, with_progress};
use bregma_measure::numbers::fixed;
use bregma_session::print::record::{self as picture, Likeness};
use bregma_session::record::{Judged, Unit, Verdict, Verifier, read};
use bregma_session::register::{SAME_POSE_MM, again};
use bregma_session::{Kind, Machine, Source};
use std::path::{Path, PathBuf};

/// Measures everything that the files record again, and says which lengths, volumes and registrations still hold. Fails if one does not.
pub fn verify(args: &VerifyArgs, machine: Machine) -> Result<(), CommandError> {
    let mut text = String::new();
    let (pictures, files): (Vec<&PathBuf>, Vec<&PathBuf>) = args.files.iter().partition(|file| picture::of(file).is_some());
    let other = verify_pictures(&pictures, args.all, machine, &mut text)?;
    let (registrations, files): (Vec<&PathBuf>, Vec<&PathBuf>) = files.into_iter().partition(|file| is_registration(file));
    let (moved, made) = verify_registrations(&registrations, &mut text)?;
    let mut all = vec![];
    for file in files {
        let mut verifier = Verifier::default();
        for (n, record) in read(file)?.iter().enumerate() {
            let folder = file.parent().unwrap_or(Path::new(""));
            let verified = with_progress("measuring", |_| verifier.verify(n + 1, record, folder));
            let (judged, notes) = verified.map_err(|reason| CommandError::Verify { file: file.clone(), reason: Box::new(reason) })?;
            warn(&notes);
            judged.iter().filter(|one| args.all || one.verdict != Verdict::Holds).for_each(|one| text += &told(one));
            all.extend(judged);
        }
    }
    if made > 0 {
        text += &format!("{} of {made} registrations hold\n", made - moved);
    }
    let [lengths, volumes] = [Unit::Mm, Unit::Mm3].map(|unit| Count::of(&all, unit));
    if volumes.all > 0 {
        text += &format!("{} of {} volumes hold\n", volumes.all - volumes.lost, volumes.all);
    }
    if made + volumes.all + pictures.len() == 0 || lengths.all > 0 {
        text += &format!("{} of {} lengths hold\n", lengths.all - lengths.lost, lengths.all);
    }
    print(&text)?;
    if other > 0 {
        return Err(CommandError::LostPictures { lost: other, all: pictures.len() });
    }
    if moved > 0 {
        return Err(CommandError::Moved { moved, made });
    }
    if volumes.lost > 0 {
        return Err(CommandError::LostVolumes { lost: volumes.lost, all: volumes.all });
    }
    if lengths.lost == 0 { Ok(()) } else { Err(CommandError::Lost { lost: lengths.lost, all: lengths.all }) }
}

/// A judgement in a line.
fn told(one: &Judged) -> String {
    let unit = match one.unit {
        Unit::Mm => "mm",
        Unit::Mm3 => "mm³",
    };
    match one.verdict {
        Verdict::Holds => format!("{}: holds\n", one.what),
        Verdict::Differs { was, is } => format!("{}: was {} {unit} and is {} {unit}\n", one.what, fixed(was, 6), fixed(is, 6)),
        Verdict::Gone(why) => format!("{}: {why}\n", one.what),
    }
}

/// How many numbers of a unit there are, and how many do not hold.
struct Count {
    all: usize,
    lost: usize,
}

impl Count {
    fn of(judged: &[Judged], unit: Unit) -> Self {
        let own = || judged.iter().filter(|one| one.unit == unit);
        Self { all: own().count(), lost: own().filter(|one| one.verdict != Verdict::Holds).count() }
    }
}

fn is_registration(file: &Path) -> bool {
    Kind::of(&Source { file: file.to_owned(), ..Source::default() }) == Kind::Registration
}

/// Draws pictures again: how many are others now.
fn verify_pictures(files: &[&PathBuf], all: bool, machine: Machine, text: &mut String) -> Result<usize, CommandError> {
    let mut lost = 0;
    for file in files {
        let again = with_progress("drawing", |progress| picture::again(file, machine, progress))?;
        if again.then != again.now {
            warn(&[format!("{} was drawn by {}, and is now by {}", file.display(), again.then, again.now)]);
        }
        let what = match again.likeness {
            Likeness::Same => "is drawn again, byte for byte".to_owned(),
            Likeness::SamePixels => "is drawn again, pixel for pixel; the rest of the file was changed".into(),
            Likeness::Differs { count, of, most } => {
                format!("{count} of {of} values of its pixels differ, by up to {} of 255", fixed(255.0 * f64::from(most), 1))
            }
            Likeness::OtherSize => "has other pixels".into(),
        };
        lost += usize::from(!again.holds());
        if all || again.likeness != Likeness::Same {
            *text += &format!("{}: {what}\n", file.display());
        }
    }
    if !files.is_empty() {
        *text += &format!("{} of {} pictures hold\n", files.len() - lost, files.len());
    }
    Ok(lost)
}

/// Makes registrations again: how many are others now, of how many.
fn verify_registrations(files: &[&PathBuf], text: &mut String) -> Result<(usize, usize), CommandError> {
    let (mut moved, mut made) = (0, 0);
    for file in files {
        let (found, unknown) = with_progress("registering", |progress| again(file, progress))?;
        warn(
            &unknown
                .iter()
                .map(|what| format!("{}: {what} does not say how it was made, and cannot be made again", file.display()))
                .collect::<Vec<_>>(),
        );
        for pose in found {
            made += 1;
            if pose.off_mm > SAME_POSE_MM {
                moved += 1;
                *text += &format!("{}: is another pose now, by up to {} mm\n", pose.what, fixed(pose.off_mm, 6));
            }
        }
    }
    Ok((moved, made))
}
