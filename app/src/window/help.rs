//! The guide inside the program, and all keys on one page.

use super::menu::{Command, MENUS, MOUSE};
use egui::{Context, Grid, RichText, ScrollArea, Ui, Window};
use egui_commonmark::{CommonMarkCache, CommonMarkViewer};
use std::fmt;

/// A page of the program's own documents.
struct Page {
    title: &'static str,
    /// Its file's name, as other pages link to it.
    file: &'static str,
    text: &'static str,
}

const PAGES: [Page; 6] = [
    Page { title: "Guide", file: "guide.md", text: include_str!("../../../docs/guide.md") },
    Page { title: "Measuring", file: "measuring.md", text: include_str!("../../../docs/measuring.md") },
    Page { title: "Pictures", file: "modes.md", text: include_str!("../../../docs/modes.md") },
    Page { title: "On paper", file: "print.md", text: include_str!("../../../docs/print.md") },
    Page { title: "Registration", file: "registration.md", text: include_str!("../../../docs/registration.md") },
    Page { title: "Scans", file: "formats.md", text: include_str!("../../../docs/formats.md") },
];

/// What is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    Keys,
    Page(usize),
}

/// The window of help.
#[derive(Default)]
pub struct Help {
    seen: Option<Seen>,
    /// The page that is laid out, ready for its window, with what the layout keeps.
    laid_out: Option<(usize, String, CommonMarkCache)>,
}

impl fmt::Debug for Help {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Help").field("seen", &self.seen).finish_non_exhaustive()
    }
}

impl Help {
    /// Opens the guide, or closes the window.
    pub fn toggle_guide(&mut self) {
        self.seen = if self.seen.is_none() { Some(Seen::Page(0)) } else { None };
    }

    /// Opens the page of all keys.
    pub fn open_keys(&mut self) {
        self.seen = Some(Seen::Keys);
    }

    /// Shows it where it is open, with the keys of `commands`.
    pub fn show<P>(&mut self, ctx: &Context, commands: &[&Command<P>]) {
        let Some(mut seen) = self.seen else { return };
        let (mut open, room) = (true, ctx.content_rect().size());
        let size = egui::vec2(720.0, 620.0).min(room - egui::vec2(40.0, 90.0));
        let window = Window::new("Help").open(&mut open).default_pos([room.x / 2.0 - size.x / 2.0, 40.0]).default_size(size);
        window.show(ctx, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.selectable_value(&mut seen, Seen::Keys, "Keys");
                for (n, page) in PAGES.iter().enumerate() {
                    ui.selectable_value(&mut seen, Seen::Page(n), page.title);
                }
            });
            ui.separator();
            let scroll = ScrollArea::vertical().id_salt(format!("{seen:?}")).auto_shrink([false, false]);
            scroll.show(ui, |ui| match seen {
                Seen::Keys => keys(ui, commands),
                Seen::Page(n) => seen = self.page(ui, n),
            });
        });
        self.seen = Some(seen).filter(|_| open);
    }

    /// Shows a page. Gives what is seen next: another page where a link to it was chosen.
    fn page(&mut self, ui: &mut Ui, n: usize) -> Seen {
        let kept = self.laid_out.take().filter(|(of, ..)| *of == n);
        let (_, text, cache) = self.laid_out.insert(kept.unwrap_or_else(|| {
            let mut cache = CommonMarkCache::default();
            PAGES.iter().for_each(|page| cache.add_link_hook(page.file));
            (n, for_the_window(PAGES[n].text), cache)
        }));
        CommonMarkViewer::new().show(ui, cache, text);
        let chosen = PAGES.iter().position(|page| cache.get_link_hook(page.file) == Some(true));
        chosen.map_or(Seen::Page(n), Seen::Page)
    }
}

/// A document without what has no place in the window: pictures of it, and parts of links within pages.
fn for_the_window(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut in_pictures = false;
    for line in text.lines() {
        let has_picture = line.contains("![");
        // A table of pictures goes with the line below its head.
        if has_picture || in_pictures && line.starts_with("|-") {
            in_pictures = true;
            continue;
        }
        in_pictures = false;
        out += line;
        out.push('\n');
    }
    let mut rest = out.as_str();
    let mut linked = String::with_capacity(out.len());
    while let Some(at) = rest.find(".md#") {
        let (before, behind) = rest.split_at(at + ".md".len());
        linked += before;
        rest = behind.find(')').map_or(behind, |end| &behind[end..]);
    }
    linked + rest
}

/// All commands that have keys, and what the mouse does.
fn keys<P>(ui: &mut Ui, commands: &[&Command<P>]) {
    let row = |ui: &mut Ui, keys: &str, what: &str| {
        ui.label(RichText::new(keys).strong());
        ui.label(what);
        ui.end_row();
    };
    ui.heading("Mouse");
    Grid::new("mouse on one page")
        .striped(true)
        .spacing([24.0, 4.0])
        .show(ui, |ui| MOUSE.iter().for_each(|(keys, what)| row(ui, keys, what)));
    for (menu, title) in MENUS {
        let with_keys = || commands.iter().filter(|command| command.is_in(menu) && !command.keys_text(ui.ctx()).is_empty());
        let rows: Vec<(String, &str)> = with_keys().map(|command| (command.all_keys_text(ui.ctx()), command.name())).collect();
        if rows.is_empty() {
            continue;
        }
        ui.add_space(8.0);
        ui.heading(title);
        let grid = Grid::new(title).striped(true).spacing([24.0, 4.0]);
        grid.show(ui, |ui| rows.iter().for_each(|(keys, what)| row(ui, keys, what)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_have_no_pictures_and_their_links_lead_to_pages() {
        // Fails if a picture that the window cannot show stands in a page, or a link to a part of another page is none of its pages' names.
        for page in &PAGES {
            let text = for_the_window(page.text);
            assert!(!text.contains("![") && !text.contains(".md#"), "{}", page.title);
            assert!(text.len() > page.text.len() / 2, "{}: too much is gone", page.title);
        }
        assert_eq!(for_the_window("a [b](modes.md#c) d\n| ![x](x.png) |\n|---|\n| ![y](y.png) |\ne\n"), "a [b](modes.md) d\ne\n");
    }
}
