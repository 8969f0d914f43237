//! `bregma verify`: whether recorded measurements still hold.

use crate::cli::args::VerifyArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{print, warn};
use bregma_measure::numbers::fixed;
use bregma_session::record::{Verdict, Verifier, read};
use std::path::Path;

/// Measures everything that the files record again, and says which lengths still hold. Fails if one does not.
pub fn verify(args: &VerifyArgs) -> Result<(), CommandError> {
    let (mut held, mut all, mut text) = (0, 0, String::new());
    for file in &args.files {
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
    print(&format!("{text}{held} of {all} lengths hold\n"))?;
    if held == all { Ok(()) } else { Err(CommandError::Lost { lost: all - held, all }) }
}
