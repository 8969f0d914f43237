//! The menus, and the keys that stand for their entries.

use super::bench::Bench;
use egui::{Button, Context, Grid, Key, KeyboardShortcut, MenuBar, Modifiers, RichText, Ui};

/// A menu, by its title.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    File,
    Edit,
    Measure,
    View,
}

const MENUS: [(Menu, &str); 4] = [(Menu::File, "File"), (Menu::Edit, "Edit"), (Menu::Measure, "Measure"), (Menu::View, "View")];

/// Keys that stand for a command.
pub type Keys = &'static [(Modifiers, Key)];

/// Something that a person can ask for by a menu or a key. `P` is what the panels keep.
pub struct Command<P> {
    menu: Menu,
    name: &'static str,
    keys: Keys,
    /// A line stands above it.
    apart: bool,
    allowed: fn(&P, &Bench) -> bool,
    run: fn(&mut P, &mut Bench, &Context),
}

impl<P> Command<P> {
    /// An entry of `menu`, which can be chosen while something is open.
    pub const fn new(menu: Menu, name: &'static str, keys: Keys, run: fn(&mut P, &mut Bench, &Context)) -> Self {
        Self { menu, name, keys, apart: false, allowed: |_, bench| !bench.is_empty(), run }
    }

    /// It can be chosen while `allowed`.
    pub const fn when(mut self, allowed: fn(&P, &Bench) -> bool) -> Self {
        self.allowed = allowed;
        self
    }

    /// A line stands above it.
    pub const fn apart(mut self) -> Self {
        self.apart = true;
        self
    }

    /// Does it.
    pub fn run(&self, panels: &mut P, bench: &mut Bench, ctx: &Context) {
        (self.run)(panels, bench, ctx);
    }
}

const MOUSE: [(&str, &str); 6] = [
    ("Left-drag", "rotate"),
    ("Middle-drag or Shift + left-drag", "move"),
    ("Right-drag or wheel", "zoom"),
    ("Ctrl + left-drag", "roll"),
    ("Click on bone", "measure with the chosen tool"),
    ("Drop files or folders", "add scans"),
];

/// Shows the menus with `commands`, each menu's in their order. Gives what is chosen.
pub fn show<'a, P>(ui: &mut Ui, commands: &[&'a Command<P>], panels: &P, bench: &Bench) -> Option<&'a Command<P>> {
    let mut chosen = None;
    MenuBar::new().ui(ui, |ui| {
        for (menu, title) in MENUS {
            ui.menu_button(title, |ui| {
                for command in commands.iter().copied().filter(|command| command.menu == menu) {
                    if command.apart {
                        ui.separator();
                    }
                    let keys = command.keys.first();
                    let text = keys.map_or(String::new(), |&(m, k)| ui.ctx().format_shortcut(&KeyboardShortcut::new(m, k)));
                    let allowed = (command.allowed)(panels, bench);
                    if ui.add_enabled(allowed, Button::new(command.name).shortcut_text(text)).clicked() {
                        chosen = Some(command);
                    }
                }
            });
        }
        ui.menu_button("Help", |ui| {
            Grid::new("mouse").spacing([16.0, 4.0]).show(ui, |ui| {
                for (gesture, effect) in MOUSE {
                    ui.label(RichText::new(gesture).strong());
                    ui.label(effect);
                    ui.end_row();
                }
            });
            ui.separator();
            ui.weak(concat!("Bregma ", env!("CARGO_PKG_VERSION")));
        });
    });
    chosen
}

/// The command whose keys were pressed, unless the person is typing.
pub fn pressed<'a, P>(ctx: &Context, commands: &[&'a Command<P>], panels: &P, bench: &Bench) -> Option<&'a Command<P>> {
    if ctx.text_edit_focused() {
        return None;
    }
    let keys = |command: &&'a Command<P>| {
        let command: &'a Command<P> = command;
        command.keys.iter().map(move |&(m, k)| (command, KeyboardShortcut::new(m, k)))
    };
    let mut keys: Vec<_> = commands.iter().flat_map(keys).collect();
    // A shortcut also matches while Shift is held: those that ask for Shift go first.
    keys.sort_by_key(|(_, shortcut)| !shortcut.modifiers.shift);
    let (command, _) = keys.into_iter().find(|(_, shortcut)| ctx.input_mut(|i| i.consume_shortcut(shortcut)))?;
    (command.allowed)(panels, bench).then_some(command)
}
