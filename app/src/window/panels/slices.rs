//! The slices: which views are seen, where the planes lie, and how they are drawn.

use super::super::bench::Bench;
use super::super::menu::Menu;
use super::super::picture::slice_views::name;
use super::super::widgets;
use super::Command;
use super::cuts::FACES;
use bregma_renderer::{BodyPlane, CutFace, Named, Slab, WIDEST_CONTOUR_PX, Window};
use bregma_session::{Layout, Slices};
use egui::{CollapsingHeader, ComboBox, DragValue, Key, Modifiers, Ui};
use glam::DQuat;

const NONE: Modifiers = Modifiers::NONE;

/// The menu of the slices that stand alone.
const ALONE: &str = "One slice";

/// The layouts, by their entries of the menu.
pub const COMMANDS: &[Command] = &[
    Command::new(Menu::View, "Picture alone", &[(NONE, Key::C)], |_, b, _| b.work.opened.slices.layout = Layout::Picture).apart(),
    Command::new(Menu::View, "Picture and slices", &[(NONE, Key::S)], |_, b, _| b.work.opened.slices.layout = Layout::All),
    Command::new(Menu::View, "Three slices", &[], |_, b, _| b.work.opened.slices.layout = Layout::Slices),
    Command::new(Menu::View, "Axial slice alone", &[], |_, b, _| b.work.opened.slices.layout = Layout::Axial).within(ALONE),
    Command::new(Menu::View, "Coronal slice alone", &[], |_, b, _| b.work.opened.slices.layout = Layout::Coronal).within(ALONE),
    Command::new(Menu::View, "Sagittal slice alone", &[], |_, b, _| b.work.opened.slices.layout = Layout::Sagittal).within(ALONE),
];

/// What a layout is called.
fn title(layout: Layout) -> &'static str {
    match layout {
        Layout::Picture => "Picture",
        Layout::All => "Picture and slices",
        Layout::Slices => "Three slices",
        Layout::Axial => "Axial",
        Layout::Coronal => "Coronal",
        Layout::Sagittal => "Sagittal",
    }
}

/// Shows what is seen and, where slices are, how.
pub fn show(ui: &mut Ui, bench: &mut Bench) {
    CollapsingHeader::new("Slices").show(ui, |ui| {
        let first = bench.work.opened.scene.layers.iter().zip(&bench.work.opened.volumes).find(|(layer, _)| layer.visible);
        let window = first.map_or(Window::between([0.0, 1.0]), |(_, volume)| Window::of(volume));
        let slices = &mut bench.work.opened.slices;
        let combo = ComboBox::from_id_salt("layout").selected_text(title(slices.layout)).width(150.0).show_ui(ui, |ui| {
            for &layout in Layout::ALL {
                ui.selectable_value(&mut slices.layout, layout, title(layout));
            }
        });
        combo.response.accessible_name("Views");
        if slices.layout.planes().is_empty() {
            return;
        }
        place(ui, slices);
        thickness(ui, slices);
        ui.horizontal_wrapped(|ui| {
            for (face, name, what) in FACES {
                ui.radio_value(&mut slices.look.face, face, name).on_hover_text(what);
            }
        });
        if slices.look.face != CutFace::Bone {
            grey(ui, slices, window);
        }
        ui.horizontal(|ui| {
            ui.weak("Contours");
            let width =
                DragValue::new(&mut slices.look.contour_px).range(0.0..=WIDEST_CONTOUR_PX).speed(0.02).max_decimals(1).suffix(" px");
            ui.add(width).on_hover_text("How wide the outlines of the isosurfaces are; 0 for none").accessible_name("Width of contours");
        });
        if slices.turn != DQuat::IDENTITY || slices.frames.iter().any(Option::is_some) {
            let button = ui.button("Upright and whole").on_hover_text("The planes of the body again, with all of the scans");
            if button.clicked() {
                (slices.turn, slices.frames) = (DQuat::IDENTITY, [None; 3]);
            }
        }
    });
}

/// Where the planes lie.
fn place(ui: &mut Ui, slices: &mut Slices) {
    for &plane in BodyPlane::ALL {
        ui.horizontal(|ui| {
            let number = DragValue::new(&mut slices.at_mm[plane.axis()])
                .speed(0.2)
                .range(-1e5..=1e5)
                .max_decimals(2)
                .custom_formatter(widgets::number)
                .update_while_editing(false)
                .suffix(" mm");
            ui.add(number).accessible_name(format!("Place of the {} plane", plane.name()));
            ui.weak(format!("{}, {}", name(plane), ["left", "posterior", "superior"][plane.axis()]));
        });
    }
}

fn thickness(ui: &mut Ui, slices: &mut Slices) {
    ui.horizontal(|ui| {
        let number = DragValue::new(&mut slices.look.thickness_mm).range(0.0..=500.0).speed(0.1).max_decimals(2).suffix(" mm thick");
        ui.add(number).on_hover_text("0 is the plane itself").accessible_name("Thickness of slices");
        if slices.look.thickness_mm > 0.0 {
            for &slab in Slab::ALL {
                ui.radio_value(&mut slices.look.slab, slab, slab.name()).on_hover_text(slab.what());
            }
        }
    });
}

/// Which values are black and which white.
fn grey(ui: &mut Ui, slices: &mut Slices, first: Window) {
    ui.horizontal(|ui| {
        let mut window = slices.look.window.unwrap_or(first);
        let speed = (window.width.abs() / 200.0).max(1e-6);
        let number =
            |value| DragValue::new(value).custom_formatter(widgets::number).speed(speed).max_decimals(2).update_while_editing(false);
        let width =
            ui.add(number(&mut window.width).range(0.0..=f64::INFINITY).prefix("W ")).on_hover_text("From black to white, in values");
        let width = width.accessible_name("Width of the slices' window");
        let level = ui.add(number(&mut window.level).prefix("L ")).on_hover_text("The value that is middle grey");
        let level = level.accessible_name("Level of the slices' window");
        if width.changed() || level.changed() {
            slices.look.window = Some(window);
        }
        if slices.look.window.is_some() && ui.button("Reset").on_hover_text("The window that the first scan opens with").clicked() {
            slices.look.window = None;
        }
    });
}
