//! Letters that the program's own fonts lack, such as those of a scan's name: they are drawn with the system's fonts, or where it has none for
//! them, as boxes, which is said once.

use egui::Context;
use egui::epaint::text::{FallbackRequest, FontInsert, FontProvider};
use egui_system_font_provider::SystemFontProvider;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

const SENTENCE: &str =
    "No font on this machine has some of the letters here, which are drawn as boxes. Install one for their script, such as Noto Sans CJK.";

/// The system's fonts.
struct SystemFonts(SystemFontProvider);

impl FontProvider for SystemFonts {
    fn font_for(&self, request: &FallbackRequest<'_>) -> Option<FontInsert> {
        // Listing a system's fonts panics where it has not a single one. Nothing of it is looked at afterwards but the same panic.
        catch_unwind(AssertUnwindSafe(|| self.0.font_for(request))).ok().flatten()
    }
}

/// Has letters drawn with the system's fonts.
pub fn draw_with_system_fonts(ctx: &Context) {
    ctx.add_font_provider(Arc::new(SystemFonts(SystemFontProvider::new())));
}

/// Watches for letters that are drawn as boxes until the first one.
#[derive(Debug)]
pub struct Letters {
    missing: Option<Receiver<char>>,
}

impl Letters {
    /// Begins to watch, after those who find fonts.
    pub fn watch(ctx: &Context) -> Self {
        let (send, missing) = channel();
        // Asked last, and only for what all others do not have. Who listened may have heard enough.
        ctx.add_font_provider(Arc::new(move |request: &FallbackRequest<'_>| {
            request.cluster.chars().next().and_then(|letter| send.send(letter).ok());
            None
        }));
        Self { missing: Some(missing) }
    }

    /// A sentence for the person, the first time that a letter is missing.
    pub fn notice(&mut self) -> Option<&'static str> {
        self.missing.take_if(|missing| missing.try_iter().any(char::is_alphanumeric)).map(|_| SENTENCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_letter_is_said_once() {
        // Fails if boxes come without a word, letters that are there are said to be missing, or it is said again and again.
        let ctx = Context::default();
        let mut letters = Letters::watch(&ctx);
        let mut shown = |text: &str| {
            let _ = ctx.run_ui(Default::default(), |ui| _ = ui.label(text));
            letters.notice().is_some()
        };
        assert!(!shown("Höcker ± 3 µm ·"));
        assert!(shown("头骨.nrrd"));
        assert!(!shown("頭蓋骨.nrrd"));
    }
}
