//! The commands that belong to no panel.

use super::bench::Bench;
use super::files::Pick;
use super::loading::Loading;
use super::menu::Menu;
use super::panels::{Command, Panels};
use super::picture::navigate::{self, Side};
use bregma_session::save::{self, SaveError};
use bregma_session::{Measurement, Session};
use egui::{Context, Key, Modifiers, ViewportCommand};
use std::path::Path;

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

/// In the order of the menus.
pub const COMMANDS: &[Command] = &[
    Command::new(Menu::File, "Open…", &[(CTRL, Key::O)], |_, b, ctx| {
        open(b, ctx, |d| d.set_title("Open scans or a session").pick_files(), false);
    })
    .when(can_open),
    Command::new(Menu::File, "Add…", &[(CTRL_SHIFT, Key::O)], |_, b, ctx| {
        open(b, ctx, |d| d.set_title("Add scans").pick_files(), true);
    })
    .when(can_open),
    Command::new(Menu::File, "Open folder…", &[], |_, b, ctx| {
        open(b, ctx, |d| d.set_title("Open folders of slices").pick_folders(), false);
    })
    .when(can_open),
    Command::new(Menu::File, "Add folder…", &[], |_, b, ctx| {
        open(b, ctx, |d| d.set_title("Add folders of slices").pick_folders(), true);
    })
    .when(can_open),
    Command::new(Menu::File, "Open the demo pair", &[], |_, b, ctx| open_demo(b, ctx)).when(|_, b| b.loading.is_none()),
    Command::new(Menu::File, "Save session…", &[(CTRL, Key::S)], |_, b, ctx| {
        let pick: Pick = |d| d.add_filter("Bregma session", &["json"]).set_file_name("session.json").save_file().map(|p| vec![p]);
        b.save(ctx, pick, save_session);
    })
    .when(|_, b| {
        // The built-in pair has no files that a session could name.
        !b.is_empty() && b.work.opened.sources.len() == b.work.opened.volumes.len() && b.can_ask()
    }),
    Command::new(Menu::File, "Save picture…", &[(CTRL, Key::P)], save_picture)
        .when(|_, b| !b.is_empty() && b.painter.is_settled() && b.can_ask()),
    Command::new(Menu::File, "Quit", &[(CTRL, Key::Q)], |_, _, ctx| ctx.send_viewport_cmd(ViewportCommand::Close))
        .when(|_, _| true)
        .apart(),
    Command::new(Menu::Edit, "Undo", &[(CTRL, Key::Z)], |_, b, _| b.history.undo(&mut b.work)).when(|_, b| b.history.can_undo()),
    Command::new(Menu::Edit, "Redo", &[(CTRL_SHIFT, Key::Z), (CTRL, Key::Y)], |_, b, _| b.history.redo(&mut b.work))
        .when(|_, b| b.history.can_redo()),
    Command::new(Menu::View, "From anterior", &[(NONE, Key::Num1)], |_, b, _| look_from(b, Side::Anterior)),
    Command::new(Menu::View, "From left", &[(NONE, Key::Num3)], |_, b, _| look_from(b, Side::Left)),
    Command::new(Menu::View, "From superior", &[(NONE, Key::Num7)], |_, b, _| look_from(b, Side::Superior)),
    Command::new(Menu::View, "Perspective or orthographic", &[(NONE, Key::Num5)], |_, b, _| {
        let bounds = b.work.opened.bounds();
        navigate::toggle_projection(&mut b.work.opened.scene.camera, &bounds);
    }),
    Command::new(Menu::View, "Reset the view", &[(NONE, Key::F), (NONE, Key::Home)], |_, b, _| look_from(b, Side::Anterior)),
];

/// Makes and shows the built-in pair.
pub fn open_demo(bench: &mut Bench, ctx: &Context) {
    bench.loading = Some(Loading::demo(ctx));
}

fn can_open(_: &Panels, bench: &Bench) -> bool {
    bench.loading.is_none() && bench.can_ask()
}

fn open(bench: &mut Bench, ctx: &Context, pick: Pick, adds: bool) {
    bench.ask(ctx, pick, move |bench, ctx, paths| bench.load(ctx, paths, adds));
}

fn look_from(bench: &mut Bench, side: Side) {
    let bounds = bench.work.opened.bounds();
    navigate::look_from(&mut bench.work.opened.scene.camera, &bounds, side);
}

/// Writes scans and scene.
fn save_session(bench: &Bench, file: &Path) -> Result<(), SaveError> {
    let (work, folder) = (&bench.work, file.parent().unwrap_or(Path::new("")));
    let session = Session::of(&work.opened, folder);
    let measurements: Vec<Measurement> = work.records(&bench.rays()).into_iter().chain(session.measurements).collect();
    Ok(Session { measurements, landmarks: work.measured.landmarks.clone(), ..session }.write(file)?)
}

/// Saves the picture as it is shown now.
fn save_picture(panels: &mut Panels, bench: &mut Bench, ctx: &Context) {
    let Some(picture) = bench.view.painted.as_ref().map(|painted| painted.picture.clone()) else { return };
    let coat = panels.painting(&bench.work).map(|(_, coat)| coat);
    let pick: Pick = |d| d.add_filter("PNG picture", &["png"]).set_file_name("picture.png").save_file().map(|p| vec![p]);
    bench.save(ctx, pick, move |_, file| save::picture(file, &picture, coat.as_deref()));
}
