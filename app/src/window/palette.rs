//! Every command by its name: a list that is searched by typing.

use super::bench::Bench;
use super::menu::Command;
use egui::{Align2, Area, Context, Frame, Id, Key, Modifiers, Order, ScrollArea, TextEdit, Ui, vec2};

/// The list of commands over the window, while it is open.
#[derive(Debug, Default)]
pub struct Palette {
    typed: Option<String>,
    /// Number of the marked one among those that fit.
    marked: usize,
}

const WIDTH: f32 = 420.0;

impl Palette {
    /// Opens it with nothing typed, or closes it.
    pub fn toggle(&mut self) {
        self.typed = if self.typed.is_none() { Some(String::new()) } else { None };
        self.marked = 0;
    }

    /// Shows it where it is open. Gives the command that is chosen, by a click or the Enter key.
    pub fn show<'a, P>(&mut self, ctx: &Context, commands: &[&'a Command<P>], panels: &P, bench: &Bench) -> Option<&'a Command<P>> {
        self.typed.as_ref()?;
        let area = Area::new(Id::unique("commands")).order(Order::Foreground).anchor(Align2::CENTER_TOP, vec2(0.0, 60.0));
        let shown = area.show(ctx, |ui| Frame::popup(ui.style()).show(ui, |ui| self.contents(ui, commands, panels, bench)).inner);
        let left = shown.response.clicked_elsewhere() || ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape));
        if shown.inner.is_some() || left {
            self.typed = None;
        }
        shown.inner
    }

    fn contents<'a, P>(&mut self, ui: &mut Ui, commands: &[&'a Command<P>], panels: &P, bench: &Bench) -> Option<&'a Command<P>> {
        let typed = self.typed.as_mut()?;
        ui.set_width(WIDTH);
        let [down, up, enter] = [Key::ArrowDown, Key::ArrowUp, Key::Enter].map(|key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key)));
        let edit = TextEdit::singleline(typed).hint_text("Search the commands").desired_width(WIDTH);
        let edit = ui.add(edit).accessible_name("Search the commands");
        edit.request_focus();
        if edit.changed() {
            self.marked = 0;
        }
        let found: Vec<&'a Command<P>> = commands.iter().copied().filter(|command| fits(command.name(), typed)).collect();
        let last = found.len().saturating_sub(1);
        self.marked = if down { self.marked + 1 } else { self.marked.saturating_sub(usize::from(up)) }.min(last);
        let mut chosen = found.get(self.marked).copied().filter(|command| enter && command.allowed(panels, bench).is_ok());
        ScrollArea::vertical().min_scrolled_height(320.0).max_height(320.0).show(ui, |ui| {
            for (n, command) in found.iter().enumerate() {
                ui.push_id(n, |ui| {
                    ui.vertical_centered_justified(|ui| {
                        if command.button(ui, panels, bench, n == self.marked) {
                            chosen = Some(command);
                        }
                    });
                });
            }
            if found.is_empty() {
                ui.weak("Nothing is called so");
            }
        });
        chosen
    }
}

/// Whether a name has every word that is typed, in any order and case.
fn fits(name: &str, typed: &str) -> bool {
    let name = name.to_lowercase();
    typed.to_lowercase().split_whitespace().all(|word| name.contains(word))
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn words_are_found_in_any_order_and_case() {
        assert!(fits("Ray along the normal", "NORM ray") && fits("Save picture…", ""));
        assert!(!fits("Ray along the normal", "ray view"));
    }
}
