//! What the person should know: one line each, until dismissed.

use egui::{Color32, Frame, Label, Margin, RichText, Ui};

struct Notice {
    text: String,
    is_error: bool,
}

/// The lines that are shown now, the oldest first.
#[derive(Default)]
pub struct Notices(Vec<Notice>);

impl Notices {
    /// Something went wrong.
    pub fn error(&mut self, text: impl Into<String>) {
        self.add(text.into(), true);
    }

    /// Something is done or needs a hint.
    pub fn note(&mut self, text: impl Into<String>) {
        self.add(text.into(), false);
    }

    fn add(&mut self, text: String, is_error: bool) {
        self.forget_notes();
        // The same sentence twice helps nobody.
        self.0.retain(|n| n.text != text);
        self.0.push(Notice { text, is_error });
    }

    /// Drops what was no error: it has been overtaken.
    pub fn forget_notes(&mut self) {
        self.0.retain(|n| n.is_error);
    }

    /// Nothing to show.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Shows them.
    pub fn show(&mut self, ui: &mut Ui) {
        let mut dismissed = None;
        for (n, notice) in self.0.iter().enumerate() {
            let visuals = ui.visuals();
            let (color, fill) = if notice.is_error {
                (visuals.error_fg_color, Color32::from_rgb(66, 32, 30))
            } else {
                (visuals.text_color(), visuals.faint_bg_color)
            };
            Frame::new().fill(fill).inner_margin(Margin::symmetric(10, 6)).show(ui, |ui| {
                ui.set_width(ui.available_width());
                ui.horizontal_top(|ui| {
                    let width = ui.available_width() - 80.0;
                    ui.vertical(|ui| {
                        ui.set_width(width);
                        ui.add(Label::new(RichText::new(&notice.text).color(color)).wrap());
                    });
                    if ui.button("Dismiss").clicked() {
                        dismissed = Some(n);
                    }
                });
            });
        }
        if let Some(n) = dismissed {
            self.0.remove(n);
        }
    }
}
