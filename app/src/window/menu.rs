//! The menus, and the keys that stand for their entries.

use super::bench::Bench;
use super::document::Next;
use egui::{Button, Context, Grid, Key, KeyboardShortcut, MenuBar, Modifiers, RichText, ScrollArea, Ui};
use std::path::PathBuf;

/// A menu, by its title.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    File,
    Edit,
    View,
    Measure,
    Help,
}

pub const MENUS: [(Menu, &str); 5] =
    [(Menu::File, "File"), (Menu::Edit, "Edit"), (Menu::View, "View"), (Menu::Measure, "Measure"), (Menu::Help, "Help")];

/// Keys that stand for a command.
pub type Keys = &'static [(Modifiers, Key)];

/// Something that a person can ask for by a menu or a key. `P` is what the panels keep.
pub struct Command<P> {
    menu: Menu,
    name: &'static str,
    keys: Keys,
    /// A line stands above it.
    apart: bool,
    /// The menu within the menu that it stands in.
    within: Option<&'static str>,
    allowed: fn(&P, &Bench) -> Allowed,
    run: fn(&mut P, &mut Bench, &Context),
}

/// That something can be done now, or one sentence about why not.
pub type Allowed = Result<(), &'static str>;

impl<P> Command<P> {
    /// An entry of `menu`, which can be chosen while something is open.
    pub const fn new(menu: Menu, name: &'static str, keys: Keys, run: fn(&mut P, &mut Bench, &Context)) -> Self {
        let allowed: fn(&P, &Bench) -> Allowed = |_, bench| if bench.is_empty() { Err("Open a scan first") } else { Ok(()) };
        Self { menu, name, keys, apart: false, within: None, allowed, run }
    }

    /// It can be chosen while `allowed`.
    pub const fn when(mut self, allowed: fn(&P, &Bench) -> Allowed) -> Self {
        self.allowed = allowed;
        self
    }

    /// A line stands above it.
    pub const fn apart(mut self) -> Self {
        self.apart = true;
        self
    }

    /// It stands in a menu of that title within the menu, with those of the same title that follow it.
    pub const fn within(mut self, title: &'static str) -> Self {
        self.within = Some(title);
        self
    }

    /// What it is called, everywhere.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The keys that stand for it, as the person's keyboard names them; empty where there are none.
    pub fn keys_text(&self, ctx: &Context) -> String {
        self.keys.first().map_or(String::new(), |&(m, k)| ctx.format_shortcut(&KeyboardShortcut::new(m, k)))
    }

    /// All of them.
    pub fn all_keys_text(&self, ctx: &Context) -> String {
        let texts = self.keys.iter().map(|&(m, k)| ctx.format_shortcut(&KeyboardShortcut::new(m, k)));
        texts.collect::<Vec<_>>().join(", ")
    }

    /// It is an entry of `menu`.
    pub fn is_in(&self, menu: Menu) -> bool {
        self.menu == menu
    }

    /// Whether it can be done now.
    pub fn allowed(&self, panels: &P, bench: &Bench) -> Allowed {
        (self.allowed)(panels, bench)
    }

    /// A line of a menu or a list; true when it is chosen.
    pub fn button(&self, ui: &mut Ui, panels: &P, bench: &Bench, is_marked: bool) -> bool {
        let button = Button::new(self.name).shortcut_text(self.keys_text(ui.ctx())).selected(is_marked);
        let allowed = self.allowed(panels, bench);
        let response = ui.add_enabled(allowed.is_ok(), button);
        response.on_disabled_hover_text(allowed.err().unwrap_or_default()).clicked()
    }

    /// Does it.
    pub fn run(&self, panels: &mut P, bench: &mut Bench, ctx: &Context) {
        (self.run)(panels, bench, ctx);
    }
}

/// What the mouse does on the picture.
pub const MOUSE: [(&str, &str); 9] = [
    ("Left-drag, arrows", "rotate"),
    ("Middle-drag, Shift + left-drag or arrows", "move"),
    ("Wheel (at the mouse), right-drag, + and −", "zoom"),
    ("Ctrl + left-drag", "roll; where a plane cuts, turn it"),
    ("Ctrl + wheel", "move the plane that cuts"),
    ("Double click beside the bone", "show everything"),
    ("Click on bone", "measure with the chosen tool"),
    ("While a scan is moved by hand", "left-drag moves it, Ctrl turns it, Alt turns the view"),
    ("Drop files or folders", "add scans"),
];

/// Shows the menus with `commands`, each menu's in their order, and then what `beside` adds. Gives what is chosen.
pub fn show<'a, P>(
    ui: &mut Ui,
    commands: &[&'a Command<P>],
    panels: &P,
    bench: &mut Bench,
    beside: impl FnOnce(&mut Ui, &mut Bench),
) -> Option<&'a Command<P>> {
    let (mut chosen, mut again) = (None, None);
    MenuBar::new().ui(ui, |ui| {
        for (menu, title) in MENUS {
            ui.menu_button(title, |ui| {
                let own: Vec<_> = commands.iter().copied().filter(|command| command.menu == menu).collect();
                let most = ui.ctx().content_rect().height() - MARGIN;
                let list =
                    ScrollArea::vertical().min_scrolled_height(most).max_height(most).show(ui, |ui| entries(ui, &own, panels, bench));
                chosen = list.inner.or(chosen);
                match menu {
                    Menu::File => again = recent(ui, bench),
                    Menu::Help => help(ui),
                    _ => {}
                }
            });
        }
        beside(ui, bench);
    });
    if let Some(paths) = again {
        bench.replace(ui.ctx(), Next::Files(paths));
    }
    chosen
}

/// What a menu leaves of the window's height, in points: it scrolls where there is too little.
const MARGIN: f32 = 30.0;

/// The entries of a menu. Gives what is chosen.
fn entries<'a, P>(ui: &mut Ui, commands: &[&'a Command<P>], panels: &P, bench: &Bench) -> Option<&'a Command<P>> {
    let mut chosen = None;
    for run in commands.chunk_by(|a, b| a.within.is_some() && a.within == b.within) {
        if run[0].apart {
            ui.separator();
        }
        let mut show = |ui: &mut Ui| {
            chosen = run.iter().copied().filter(|command| command.button(ui, panels, bench, false)).last().or(chosen);
        };
        match run[0].within {
            Some(title) => _ = ui.menu_button(title, show),
            None => show(ui),
        }
    }
    chosen
}

/// What was opened before; gives what is chosen to be opened again.
fn recent(ui: &mut Ui, bench: &Bench) -> Option<Vec<PathBuf>> {
    ui.separator();
    let recent = bench.remembered.recent();
    let menu = ui.add_enabled_ui(!recent.is_empty() && !bench.is_busy(), |ui| {
        ui.menu_button("Open recent", |ui| {
            ui.set_max_width(340.0);
            let name = |path: &PathBuf| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
            let choose = |ui: &mut Ui, paths: &Vec<PathBuf>| {
                let names = paths.iter().map(name).collect::<Vec<_>>().join(", ");
                let whole = paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join("\n");
                ui.add(Button::new(names).truncate()).on_hover_text(whole).clicked()
            };
            recent.iter().enumerate().find_map(|(n, paths)| ui.push_id(n, |ui| choose(ui, paths)).inner.then(|| paths.clone()))
        })
    });
    menu.inner.inner.flatten()
}

/// What the mouse does on the picture.
fn help(ui: &mut Ui) {
    ui.separator();
    Grid::new("mouse").spacing([16.0, 4.0]).show(ui, |ui| {
        for (gesture, effect) in MOUSE {
            ui.label(RichText::new(gesture).strong());
            ui.label(effect);
            ui.end_row();
        }
    });
    ui.separator();
    ui.weak(concat!("Bregma ", env!("CARGO_PKG_VERSION")));
}

/// The command whose keys were pressed, unless the person is typing.
pub fn pressed<'a, P>(ctx: &Context, commands: &[&'a Command<P>], panels: &P, bench: &Bench) -> Option<&'a Command<P>> {
    // While a file is asked for all keys are of its path, also those that come in the frame in which it is taken.
    if ctx.text_edit_focused() || !bench.can_ask() {
        return None;
    }
    let keys = |command: &&'a Command<P>| {
        let command: &'a Command<P> = command;
        command.keys.iter().map(move |&(m, k)| (command, KeyboardShortcut::new(m, k)))
    };
    // A tool that the mouse has may need some for itself.
    let is_free = |key| !bench.view.part_hand.as_ref().is_some_and(|hand| hand.takes(key));
    let mut keys: Vec<_> = commands.iter().flat_map(keys).filter(|(_, shortcut)| is_free(shortcut.logical_key)).collect();
    // A shortcut also matches while Shift is held: those that ask for Shift go first.
    keys.sort_by_key(|(_, shortcut)| !shortcut.modifiers.shift);
    let (command, _) = keys.into_iter().find(|(_, shortcut)| ctx.input_mut(|i| i.consume_shortcut(shortcut)))?;
    command.allowed(panels, bench).is_ok().then_some(command)
}
