//! `bregma verify`: whether recorded measurements still hold.

use crate::cli::args::VerifyArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{print, warn, with_progress};
use bregma_measure::numbers::fixed;
use bregma_session::print::record::{self as picture, Likeness};
use bregma_session::record::{Verdict, Verifier, read};
use bregma_session::register::{SAME_POSE_MM, again};
use bregma_session::volumes::{self, Recorded, recorded};
use bregma_session::{Kind, Machine, Source};
use std::path::{Path, PathBuf};

/// Measures everything that the files record again, and says which lengths, volumes and registrations still hold. Fails if one does not.
pub fn verify(args: &VerifyArgs, machine: Machine) -> Result<(), CommandError> {
    let (mut held, mut all, mut text) = (0, 0, String::new());
    let (pictures, files): (Vec<&PathBuf>, Vec<&PathBuf>) = args.files.iter().partition(|file| picture::of(file).is_some());
    let other = verify_pictures(&pictures, args.all, machine, &mut text)?;
    let (registrations, files): (Vec<&PathBuf>, Vec<&PathBuf>) = files.into_iter().partition(|file| is_registration(file));
    let (moved, made) = verify_registrations(&registrations, &mut text)?;
    let (volumes, files): (Vec<_>, Vec<_>) =
        files.into_iter().map(|file| (file, recorded(file))).partition(|(_, volumes)| volumes.is_some());
    let files: Vec<&PathBuf> = files.into_iter().map(|(file, _)| file).collect();
    let volumes: Vec<(&PathBuf, Recorded)> = volumes.into_iter().filter_map(|(file, volumes)| Some((file, volumes?))).collect();
    let (lost, volumes) = verify_volumes(&volumes, args.all, &mut text)?;
    for file in files {
        let mut verifier = Verifier::default();
        for (n, record) in read(file)?.iter().enumerate() {
            let folder = file.parent().unwrap_or(Path::new(""));
            let verified = verifier.verify(n + 1, record, folder);
            let (judged, notes) = verified.map_err(|reason| CommandError::Verify { file: file.clone(), reason: Box::new(reason) })?;
            warn(&notes);
            for length in judged {
                all += 1;
                let what = match length.verdict {
                    Verdict::Holds => "holds".to_owned(),
                    Verdict::Differs { was_mm, is_mm } => format!("was {} mm and is {} mm", fixed(was_mm, 6), fixed(is_mm, 6)),
                    Verdict::Gone(why) => why.to_owned(),
                };
                held += usize::from(length.verdict == Verdict::Holds);
                if args.all || length.verdict != Verdict::Holds {
                    text += &format!("{}: {what}\n", length.what);
                }
            }
        }
    }
    if made > 0 {
        text += &format!("{} of {made} registrations hold\n", made - moved);
    }
    if made + volumes + pictures.len() == 0 || all > 0 {
        text += &format!("{held} of {all} lengths hold\n");
    }
    print(&text)?;
    if other > 0 {
        return Err(CommandError::LostPictures { lost: other, all: pictures.len() });
    }
    if moved > 0 {
        return Err(CommandError::Moved { moved, made });
    }
    if lost > 0 {
        return Err(CommandError::LostVolumes { lost, all: volumes });
    }
    if held == all { Ok(()) } else { Err(CommandError::Lost { lost: all - held, all }) }
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

/// Measures volumes again: how many are others now, of how many.
fn verify_volumes(files: &[(&PathBuf, Recorded)], all: bool, text: &mut String) -> Result<(usize, usize), CommandError> {
    let (mut lost, mut count) = (0, 0);
    for (file, recorded) in files {
        let folder = file.parent().unwrap_or(Path::new(""));
        for volume in with_progress("measuring", |progress| volumes::again(recorded, folder, progress))? {
            count += 1;
            lost += usize::from(!volume.holds());
            let is = volume.is_mm3.map_or("is not there now".into(), |is| format!("is {} mm³", fixed(is, 6)));
            if !volume.holds() {
                *text += &format!("{}: was {} mm³ and {is}\n", volume.what, fixed(volume.was_mm3, 6));
            } else if all {
                *text += &format!("{}: holds\n", volume.what);
            }
        }
    }
    if count > 0 {
        *text += &format!("{} of {count} volumes hold\n", count - lost);
    }
    Ok((lost, count))
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
