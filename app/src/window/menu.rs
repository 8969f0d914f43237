//! Everything that a menu or a key can ask for.

use super::measured::Tool;
use super::navigate::Side;
use egui::{Button, Context, Grid, Key, KeyboardShortcut, MenuBar, Modifiers, RichText, Ui};

/// A wish of the person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Open files instead of what is open.
    Open,
    /// Open files beside what is open.
    Add,
    /// Open folders instead of what is open.
    OpenFolder,
    /// Open folders beside what is open.
    AddFolder,
    /// Open the built-in pair.
    Demo,
    /// Save scans and scene.
    SaveSession,
    /// Save the picture.
    SavePicture,
    /// Close the window.
    Quit,
    /// Take back a step.
    Undo,
    /// Take it again.
    Redo,
    /// Remove the selected difference ray.
    ClearRay,
    /// A ray by numbers.
    Numbers,
    /// The map of thickness.
    Thickness,
    /// What a click does.
    Take(Tool),
    /// The whole of the scans from a side.
    Look(Side),
    /// Between perspective and orthographic.
    Projection,
    /// The view that scans open with.
    Fit,
    /// Speed and accuracy of every solver.
    Chart,
    /// Draw by the exact solver again.
    Exact,
}

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

/// An entry of a menu: what it does, its name, its keys.
type Entry = (Command, &'static str, &'static [(Modifiers, Key)]);

const MENUS: [(&str, &[Entry]); 4] = [
    (
        "File",
        &[
            (Command::Open, "Open…", &[(CTRL, Key::O)]),
            (Command::Add, "Add…", &[(CTRL_SHIFT, Key::O)]),
            (Command::OpenFolder, "Open folder…", &[]),
            (Command::AddFolder, "Add folder…", &[]),
            (Command::Demo, "Open the demo pair", &[]),
            (Command::SaveSession, "Save session…", &[(CTRL, Key::S)]),
            (Command::SavePicture, "Save picture…", &[(CTRL, Key::P)]),
            (Command::Quit, "Quit", &[(CTRL, Key::Q)]),
        ],
    ),
    (
        "Edit",
        &[
            (Command::Undo, "Undo", &[(CTRL, Key::Z)]),
            (Command::Redo, "Redo", &[(CTRL_SHIFT, Key::Z), (CTRL, Key::Y)]),
            (Command::ClearRay, "Delete the difference ray", &[(NONE, Key::Delete)]),
        ],
    ),
    (
        "Measure",
        &[
            (Command::Take(Tool::View), "Ray along the view", &[(NONE, Key::R)]),
            (Command::Take(Tool::Normal), "Ray along the normal", &[(NONE, Key::N)]),
            (Command::Take(Tool::Points), "Ray through two points", &[(NONE, Key::T)]),
            (Command::Numbers, "Ray by numbers…", &[]),
            (Command::Take(Tool::Landmark), "Landmark", &[(NONE, Key::L)]),
            (Command::Thickness, "Thickness map…", &[]),
        ],
    ),
    (
        "View",
        &[
            (Command::Look(Side::Anterior), "From anterior", &[(NONE, Key::Num1)]),
            (Command::Look(Side::Left), "From left", &[(NONE, Key::Num3)]),
            (Command::Look(Side::Superior), "From superior", &[(NONE, Key::Num7)]),
            (Command::Projection, "Perspective or orthographic", &[(NONE, Key::Num5)]),
            (Command::Fit, "Reset the view", &[(NONE, Key::F), (NONE, Key::Home)]),
            (Command::Chart, "Speed and accuracy…", &[]),
            (Command::Exact, "Draw by the exact solver", &[]),
        ],
    ),
];

const MOUSE: [(&str, &str); 6] = [
    ("Left-drag", "rotate"),
    ("Middle-drag or Shift + left-drag", "move"),
    ("Right-drag or wheel", "zoom"),
    ("Ctrl + left-drag", "roll"),
    ("Click on bone", "measure with the chosen tool"),
    ("Drop files or folders", "add scans"),
];

/// Shows the menus.
pub fn show(ui: &mut Ui, allowed: impl Fn(Command) -> bool) -> Option<Command> {
    let mut chosen = None;
    MenuBar::new().ui(ui, |ui| {
        for (title, entries) in MENUS {
            ui.menu_button(title, |ui| {
                for &(command, name, keys) in entries {
                    if command == Command::Quit {
                        ui.separator();
                    }
                    let text = keys.first().map_or(String::new(), |&(m, k)| ui.ctx().format_shortcut(&KeyboardShortcut::new(m, k)));
                    if ui.add_enabled(allowed(command), Button::new(name).shortcut_text(text)).clicked() {
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
pub fn pressed(ctx: &Context, allowed: impl Fn(Command) -> bool) -> Option<Command> {
    if ctx.text_edit_focused() {
        return None;
    }
    let keys = |entry: &Entry| entry.2.iter().map(move |&(m, k)| (entry.0, KeyboardShortcut::new(m, k))).collect::<Vec<_>>();
    let mut keys: Vec<_> = MENUS.iter().flat_map(|(_, entries)| entries.iter()).flat_map(keys).collect();
    // A shortcut also matches while Shift is held: those that ask for Shift go first.
    keys.sort_by_key(|(_, shortcut)| !shortcut.modifiers.shift);
    let (command, _) = keys.into_iter().find(|(_, shortcut)| ctx.input_mut(|i| i.consume_shortcut(shortcut)))?;
    allowed(command).then_some(command)
}
