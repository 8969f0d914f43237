//! A person's own looks: whole ones, and those of one scan. Each is a small file by its name.

use super::super::bench::Bench;
use bregma_session::ShelfError;
use bregma_session::looks::{self, Look};
use bregma_session::presets::{self, Preset};
use egui::{Button, ComboBox, Context, ScrollArea, TextEdit, Ui, Window};
use std::path::{Path, PathBuf};

/// The window of looks, and what is typed there.
#[derive(Debug, Default)]
pub struct LooksPanel {
    is_open: bool,
    /// What the shelves hold; read when the panel opens, and after each change.
    looks: Vec<(PathBuf, Look)>,
    presets: Vec<(PathBuf, Preset)>,
    /// Names for what is saved next.
    names: [String; 2],
    /// The scan whose look is saved or changed.
    scan: usize,
    /// The file that is being given another name, and that; or that is to be deleted for certain.
    renaming: Option<(PathBuf, String)>,
    deleting: Option<PathBuf>,
}

/// What is done with one of the list.
enum Deed {
    Take,
    Rename(String),
    Delete,
}

const WIDTH: f32 = 340.0;

impl LooksPanel {
    /// Opens it, or closes it.
    pub fn toggle(&mut self, bench: &mut Bench) {
        self.is_open = !self.is_open;
        if self.is_open {
            self.read(bench);
        }
    }

    /// Takes in what is on the shelves.
    fn read(&mut self, bench: &mut Bench) {
        let (looks, errors) = looks::shelf().map(|shelf| looks::all(&shelf)).unwrap_or_default();
        errors.iter().for_each(|error| bench.messages.error(error.to_string()));
        (self.looks, self.presets) = (looks, presets::own());
        (self.renaming, self.deleting) = (None, None);
    }

    /// Shows it where it is open.
    pub fn show(&mut self, ctx: &Context, bench: &mut Bench) {
        let mut open = self.is_open && !bench.is_empty();
        let window = Window::new("Looks").open(&mut open).default_pos([320.0, 60.0]).default_width(WIDTH).resizable(false);
        window.show(ctx, |ui| {
            ui.set_width(WIDTH);
            self.whole(ui, bench);
            ui.separator();
            self.of_scans(ui, bench);
        });
        self.is_open = open;
    }

    /// Looks of whole pictures.
    fn whole(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let hint = "The mode with its light, colours and transfer functions; no isovalue, no cut and no view";
        ui.strong("Whole looks").on_hover_text(hint);
        let rows: Vec<_> = self.looks.iter().map(|(file, look)| (file.clone(), look.name.clone())).collect();
        let deed = self.list(ui, "look", &rows);
        let shelf = looks::shelf();
        if let Some((n, deed)) = deed {
            let (file, look) = &self.looks[n];
            let done = match (deed, &shelf) {
                (Deed::Take, _) => {
                    look.apply(&mut bench.work.opened.scene);
                    return;
                }
                (Deed::Rename(name), Some(shelf)) => look.rename(shelf, file, &name).map(|_| ()),
                (Deed::Delete, Some(shelf)) => shelf.delete(file),
                (_, None) => Err(ShelfError::NoPlace),
            };
            self.tell(bench, done);
        }
        if let Some(name) = self.save_row(ui, 0, "Save this look", "Name of the look") {
            let look = Look::of(&bench.work.opened.scene, &name);
            let done = shelf.ok_or(ShelfError::NoPlace).and_then(|shelf| look.save(&shelf)).map(|_| ());
            self.tell(bench, done);
        }
    }

    /// Transfer functions with their further isosurfaces.
    fn of_scans(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let opened = &bench.work.opened;
        self.scan = self.scan.min(opened.volumes.len() - 1);
        ui.strong("Transfer functions").on_hover_text("Colours and opacities of one scan's values, with its further isosurfaces");
        if opened.volumes.len() > 1 {
            let combo = ComboBox::from_id_salt("look of").width(WIDTH - 20.0).truncate().selected_text(opened.volumes[self.scan].name());
            let combo = combo.show_ui(ui, |ui| {
                for (n, volume) in opened.volumes.iter().enumerate() {
                    ui.selectable_value(&mut self.scan, n, volume.name());
                }
            });
            combo.response.accessible_name("Scan whose transfer function is taken or saved");
        }
        let rows: Vec<_> = self.presets.iter().map(|(file, preset)| (file.clone(), preset.transfer.name.clone())).collect();
        let deed = self.list(ui, "transfer function", &rows);
        let shelf = presets::shelf();
        let (layer, volume) = (&mut bench.work.opened.scene.layers[self.scan], &bench.work.opened.volumes[self.scan]);
        if let Some((n, deed)) = deed {
            let (file, preset) = &self.presets[n];
            let done = match (deed, &shelf) {
                (Deed::Take, _) => {
                    preset.apply(layer, volume);
                    return;
                }
                (Deed::Rename(name), Some(shelf)) => preset.rename(shelf, file, &name).map(|_| ()),
                (Deed::Delete, Some(shelf)) => shelf.delete(file),
                (_, None) => Err(ShelfError::NoPlace),
            };
            self.tell(bench, done);
            return;
        }
        let preset = Preset::of(layer, volume);
        if let Some(name) = self.save_row(ui, 1, "Save this one", "Name of the transfer function") {
            let done = shelf.ok_or(ShelfError::NoPlace).and_then(|shelf| preset.named(&name).save(&shelf)).map(|_| ());
            self.tell(bench, done);
        }
    }

    /// Reads anew after a change, or says why there was none.
    fn tell(&mut self, bench: &mut Bench, done: Result<(), ShelfError>) {
        match done {
            Ok(()) => self.read(bench),
            Err(error) => bench.messages.error(error.to_string()),
        }
    }

    /// The lines of a list; what is done with one of them.
    fn list(&mut self, ui: &mut Ui, what: &str, rows: &[(PathBuf, String)]) -> Option<(usize, Deed)> {
        if rows.is_empty() {
            ui.weak("None is saved yet.");
        }
        let scroll = ScrollArea::vertical().id_salt(what).max_height(150.0);
        let lines = scroll.show(ui, |ui| {
            let lines = rows.iter().enumerate().map(|(n, (file, name))| self.row(ui, what, file, name).map(|deed| (n, deed)));
            // All are shown, also those behind the one that something is done with.
            lines.collect::<Vec<_>>()
        });
        lines.inner.into_iter().flatten().next()
    }

    fn row(&mut self, ui: &mut Ui, what: &str, file: &Path, name: &str) -> Option<Deed> {
        let is_of = |other: &Path| other == file;
        ui.horizontal(|ui| {
            if let Some((_, typed)) = self.renaming.as_mut().filter(|(other, _)| is_of(other)) {
                let edit = TextEdit::singleline(typed).desired_width(170.0);
                ui.add(edit).accessible_name(format!("New name of {name}"));
                let (renamed, left) = (ui.button("Rename").clicked(), ui.button("Cancel").clicked());
                let name = typed.clone();
                if renamed || left {
                    self.renaming = None;
                }
                return renamed.then_some(Deed::Rename(name));
            }
            if self.deleting.as_deref().is_some_and(is_of) {
                ui.label("Delete for good?");
                let (deleted, left) = (ui.button("Delete").clicked(), ui.button("Keep").clicked());
                if deleted || left {
                    self.deleting = None;
                }
                return deleted.then_some(Deed::Delete);
            }
            let take = ui.add_sized([170.0, ui.spacing().interact_size.y], Button::new(name).truncate());
            let take = take.on_hover_text(format!("Takes this {what}"));
            if ui.button("Rename…").clicked() {
                self.renaming = Some((file.to_owned(), name.to_owned()));
            }
            if ui.button("Delete…").clicked() {
                self.deleting = Some(file.to_owned());
            }
            take.clicked().then_some(Deed::Take)
        })
        .inner
    }

    /// Where a name is typed for what is there now; gives it when it is to be saved.
    fn save_row(&mut self, ui: &mut Ui, n: usize, button: &str, what: &str) -> Option<String> {
        ui.horizontal(|ui| {
            let name = &mut self.names[n];
            ui.add(TextEdit::singleline(name).hint_text(what).desired_width(190.0)).accessible_name(what);
            let save = ui.add_enabled(!name.trim().is_empty(), Button::new(button)).on_disabled_hover_text("Type a name first");
            save.clicked().then(|| std::mem::take(name))
        })
        .inner
    }
}
