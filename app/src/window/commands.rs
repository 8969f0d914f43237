//! The commands that belong to no panel.

use super::ask::{Ask, Kind};
use super::bench::Bench;
use super::dock;
use super::document::Next;
use super::menu::{Allowed, Menu};
use super::panels::{Command, Panels};
use super::picture::navigate;
use bregma_renderer::{BodyPlane, Named};
use bregma_session::print::{ENDING_LIST, write_picture};
use bregma_session::views::View;
use egui::{Context, Key, Modifiers, ViewportCommand};
use std::path::{Path, PathBuf};

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

/// The standard views.
const LOOK_FROM: &str = "Look from";

/// In the order of the menus.
pub const COMMANDS: &[Command] = &[
    Command::new(Menu::File, "Open…", &[(CTRL, Key::O)], |_, b, ctx| {
        open(b, ctx, Ask::open("Open scans or a session", Kind::Files), false);
    })
    .when(can_open),
    Command::new(Menu::File, "Add…", &[(CTRL_SHIFT, Key::O)], |_, b, ctx| {
        open(b, ctx, Ask::open("Add scans", Kind::Files), true);
    })
    .when(can_open),
    Command::new(Menu::File, "Open folder…", &[], |_, b, ctx| {
        open(b, ctx, Ask::open("Open folders of slices", Kind::Folders), false);
    })
    .when(can_open),
    Command::new(Menu::File, "Add folder…", &[], |_, b, ctx| {
        open(b, ctx, Ask::open("Add folders of slices", Kind::Folders), true);
    })
    .when(can_open),
    Command::new(Menu::File, "Open the demo pair", &[], |_, b, ctx| b.replace(ctx, Next::Demo)).when(can_open),
    Command::new(Menu::File, "Save session", &[(CTRL, Key::S)], |_, b, ctx| b.save_session(ctx, false)).when(can_save).apart(),
    Command::new(Menu::File, "Save session as…", &[(CTRL_SHIFT, Key::S)], |_, b, ctx| b.save_session(ctx, true)).when(can_save),
    Command::new(Menu::File, "Save picture…", &[(CTRL, Key::P)], |p, _, _| p.picture.toggle()).when(|p, b| {
        can_save(p, b)?;
        if b.work.opened.slices.layout.has_picture() { Ok(()) } else { Err("The picture is not among the views") }
    }),
    Command::new(Menu::File, "Film…", &[], |p, _, _| p.film.toggle()).when(can_save),
    Command::new(Menu::File, "Save slices…", &[], |_, b, ctx| save_slices(b, ctx)).when(|p, b| {
        can_save(p, b)?;
        if b.work.opened.slices.layout.planes().is_empty() {
            return Err("No slices are among the views");
        }
        if b.slices.are_settled(&b.work) { Ok(()) } else { Err("The slices are being drawn") }
    }),
    Command::new(Menu::File, "Quit", &[(CTRL, Key::Q)], |_, _, ctx| ctx.send_viewport_cmd(ViewportCommand::Close))
        .when(|_, _| Ok(()))
        .apart(),
    Command::new(Menu::Edit, "Undo", &[(CTRL, Key::Z)], |_, b, _| b.history.undo(&mut b.work))
        .when(|_, b| if b.history.can_undo() { Ok(()) } else { Err("Nothing was done") }),
    Command::new(Menu::Edit, "Redo", &[(CTRL_SHIFT, Key::Z), (CTRL, Key::Y)], |_, b, _| b.history.redo(&mut b.work))
        .when(|_, b| if b.history.can_redo() { Ok(()) } else { Err("Nothing was undone") }),
    Command::new(Menu::View, "From anterior: norma frontalis", &[(NONE, Key::Num1)], |_, b, _| look_from(b, View::Frontalis))
        .within(LOOK_FROM),
    Command::new(Menu::View, "From posterior: norma occipitalis", &[(NONE, Key::Num2)], |_, b, _| look_from(b, View::Occipitalis))
        .within(LOOK_FROM),
    Command::new(Menu::View, "From left: norma lateralis sinistra", &[(NONE, Key::Num3)], |_, b, _| look_from(b, View::LateralisSinistra))
        .within(LOOK_FROM),
    Command::new(Menu::View, "From right: norma lateralis dextra", &[(NONE, Key::Num4)], |_, b, _| look_from(b, View::LateralisDextra))
        .within(LOOK_FROM),
    Command::new(Menu::View, "From superior: norma verticalis", &[(NONE, Key::Num7)], |_, b, _| look_from(b, View::Verticalis))
        .within(LOOK_FROM),
    Command::new(Menu::View, "From inferior: norma basilaris", &[(NONE, Key::Num8)], |_, b, _| look_from(b, View::Basilaris))
        .within(LOOK_FROM),
    Command::new(Menu::View, "Perspective or orthographic", &[(NONE, Key::Num5)], |_, b, _| {
        let bounds = b.work.opened.bounds();
        navigate::toggle_projection(&mut b.work.opened.scene.camera, &bounds);
    }),
    Command::new(Menu::View, "Turntable or free arcball", &[], |_, b, _| {
        b.remembered.preferences.turns_freely = !b.remembered.preferences.turns_freely;
        b.remembered.write();
        b.messages.note(if b.remembered.preferences.turns_freely {
            "A drag turns the view freely, as a ball does"
        } else {
            "A drag turns the view as a turntable does: up stays up"
        });
    }),
    Command::new(Menu::View, "Bounding boxes on or off", &[(NONE, Key::B)], |_, b, _| b.work.opened.boxes = !b.work.opened.boxes),
    Command::new(Menu::View, "Show everything", &[(NONE, Key::F), (NONE, Key::Home)], |_, b, _| look_from(b, View::Oblique)),
    Command::new(Menu::View, "Fold the scans", &[(NONE, Key::OpenBracket)], |p, _, ctx| p.dock.toggle(dock::Side::Left, ctx)).apart(),
    Command::new(Menu::View, "Fold the results", &[(NONE, Key::CloseBracket)], |p, _, ctx| p.dock.toggle(dock::Side::Right, ctx)),
    Command::new(Menu::Help, "Guide", &[(NONE, Key::F1)], |p, _, _| p.help.toggle_guide()).when(|_, _| Ok(())),
    Command::new(Menu::Help, "All keys", &[(NONE, Key::Questionmark)], |p, _, _| p.help.open_keys()).when(|_, _| Ok(())),
    Command::new(Menu::Help, "Search the commands…", &[(CTRL, Key::K)], |p, _, _| p.palette.toggle()).when(|_, _| Ok(())),
    Command::new(Menu::Help, "Messages…", &[], |_, b, _| b.messages.open = true)
        .when(|_, b| if b.messages.is_empty() { Err("There were none") } else { Ok(()) }),
];

fn can_open(_: &Panels, bench: &Bench) -> Allowed {
    if bench.is_busy() {
        return Err("Other scans are still loading");
    }
    if bench.can_ask() { Ok(()) } else { Err("A file is being asked for already") }
}

fn can_save(_: &Panels, bench: &Bench) -> Allowed {
    if bench.is_empty() {
        return Err("Open a scan first");
    }
    if bench.can_ask() { Ok(()) } else { Err("A file is being asked for already") }
}

fn open(bench: &mut Bench, ctx: &Context, ask: Ask, adds: bool) {
    bench.ask(ctx, ask, move |bench, ctx, paths| if adds { bench.add(ctx, paths) } else { bench.replace(ctx, Next::Files(paths)) });
}

fn look_from(bench: &mut Bench, view: View) {
    navigate::look_at(&mut bench.work.opened, view, bench.view.aspect());
}

/// Saves the slices as they are shown now: one under the name that is chosen, of several each with its plane behind it.
fn save_slices(bench: &mut Bench, ctx: &Context) {
    let planes = bench.work.opened.slices.layout.planes();
    let pictures: Vec<_> = planes.iter().filter_map(|plane| Some((*plane, bench.slices.seen(*plane)?.0.clone()))).collect();
    let ask = Ask { title: "Save the slices", kind: Kind::Save, forms: &[("Picture", ENDING_LIST)], name: "slice.png" };
    bench.save(ctx, ask, move |_, file| {
        let is_one = pictures.len() == 1;
        pictures.iter().try_for_each(|(plane, picture)| write_picture(&file_of_slice(file, *plane, is_one), picture))
    });
}

/// The file of one of the slices that are saved under a name.
fn file_of_slice(file: &Path, plane: BodyPlane, is_one: bool) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let ending = file.extension().unwrap_or_default().to_string_lossy();
    if is_one { file.to_owned() } else { file.with_file_name(format!("{stem}-{}.{ending}", plane.name())) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_of_one_name_have_files_of_their_own() {
        // Fails if a slice is written over another one, or leaves its folder.
        let file = |plane, is_one| file_of_slice(Path::new("/a/b.png"), plane, is_one);
        assert_eq!(file(BodyPlane::Axial, true), Path::new("/a/b.png"));
        assert_eq!(file(BodyPlane::Axial, false), Path::new("/a/b-axial.png"));
        assert_eq!(file(BodyPlane::Sagittal, false), Path::new("/a/b-sagittal.png"));
    }
}
