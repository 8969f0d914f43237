//! `bregma verify`: whether recorded measurements still hold.

use crate::cli::args::VerifyArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{print, warn, with_progress};
use bregma_measure::numbers::fixed;
use bregma_session::record::{Verdict, Verifier, read};
use bregma_session::register::{SAME_POSE_MM, again};
use bregma_session::{Kind, Source};
use std::path::{Path, PathBuf};

/// Measures everything that the files record again, and says which lengths still hold. Fails if one does not.
pub fn verify(args: &VerifyArgs) -> Result<(), CommandError> {
    let (mut held, mut all, mut text) = (0, 0, String::new());
    let (registrations, files): (Vec<&PathBuf>, Vec<&PathBuf>) = args.files.iter().partition(|file| is_registration(file));
    let (moved, made) = verify_registrations(&registrations, &mut text)?;
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
    if made == 0 || all > 0 {
        text += &format!("{held} of {all} lengths hold\n");
    }
    print(&text)?;
    if moved > 0 {
        return Err(CommandError::Moved { moved, made });
    }
    if held == all { Ok(()) } else { Err(CommandError::Lost { lost: all - held, all }) }
}

fn is_registration(file: &Path) -> bool {
    Kind::of(&Source { file: file.to_owned(), ..Source::default() }) == Kind::Registration
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
