//! What there is: a card for each scan.

use super::super::bench::Bench;
use super::super::measured::{Measured, Work};
use super::super::widgets::{self, color, color_button, line, percent};
use super::super::words::in_the_window;
use super::{histogram, shells, transfer_editor};
use bregma_field::Volume;
use bregma_measure::export::suffix;
use bregma_renderer::{Gather, Layer, Scene};
use egui::{Align, DragValue, Frame, Label, Layout, Response, RichText, Sense, Slider, SliderClamping, Ui};

/// Shows the cards and applies what the person changes. Gives the number of the scan of which more is asked for.
pub fn show(ui: &mut Ui, bench: &mut Bench) -> Option<usize> {
    let work = &mut bench.work;
    let scene = &mut work.opened.scene;
    let shown = Shown::of(scene);
    let (mut closed, mut asked, mut carried) = (None, None, None);
    for (n, (volume, layer)) in work.opened.volumes.iter().zip(&mut scene.layers).enumerate() {
        // Scans may share a name: their number tells their widgets apart.
        ui.push_id(n, |ui| {
            let framed = Frame::group(ui.style()).fill(ui.visuals().faint_bg_color).show(ui, |ui| card(ui, n, volume, layer, shown));
            match framed.inner {
                Some(More::Close) => closed = Some(n),
                Some(More::Panel) => asked = Some(n),
                None => {}
            }
            carried = carried.or(dropped(ui, n, &framed.response));
        });
    }
    if let Some([from, to]) = carried {
        work.opened.carry(from, to);
    }
    if let Some(n) = closed {
        close(work, n);
    }
    asked
}

/// The number of the scan that is dragged by its name.
struct Dragged(usize);

/// Shows where a scan that is dragged over card `n` would go; where it is dropped, its number and the one that it gets.
fn dropped(ui: &Ui, n: usize, card: &Response) -> Option<[usize; 2]> {
    let from = card.dnd_hover_payload::<Dragged>()?.0;
    let is_below = ui.input(|i| i.pointer.interact_pos())?.y > card.rect.center().y;
    // Those behind it move up once it is taken out.
    let to = n + usize::from(is_below) - usize::from(n + usize::from(is_below) > from);
    if to == from {
        return None;
    }
    let y = if is_below { card.rect.bottom() } else { card.rect.top() };
    ui.painter().hline(card.rect.x_range(), y, ui.visuals().selection.stroke);
    card.dnd_release_payload::<Dragged>().map(|_| [from, to])
}

/// What is chosen behind a card's three dots.
#[derive(Clone, Copy)]
enum More {
    Panel,
    Close,
}

/// What of a layer its card has controls for.
#[derive(Clone, Copy, PartialEq)]
enum Shown {
    /// The isosurface.
    Surface,
    /// The isosurface and its opacity.
    Overlay,
    /// Several isosurfaces with their opacities.
    Shells,
    /// The transfer function.
    Transfer,
    /// Nothing of its own.
    Nothing,
}

impl Shown {
    fn of(scene: &Scene) -> Self {
        match scene.mode.gather() {
            Gather::FirstOfEach => Self::Overlay,
            Gather::Crossings => Self::Shells,
            Gather::Nearest => Self::Surface,
            Gather::Density => Self::Transfer,
            Gather::Number(_) => Self::Nothing,
            Gather::Plane => Self::Surface,
        }
    }
}

fn close(work: &mut Work, n: usize) {
    work.opened.close(n);
    if work.opened.volumes.is_empty() {
        work.measured = Measured::default();
        work.opened.measurements.clear();
    }
}

/// Volume number `n`. Gives what is to be done with it.
fn card(ui: &mut Ui, n: usize, volume: &Volume, layer: &mut Layer, shown: Shown) -> Option<More> {
    ui.set_width(ui.available_width());
    let name = volume.name();
    let chosen = line(ui, |ui| {
        let more = ui.menu_button("…", |ui| {
            ui.set_max_width(300.0);
            information(ui, volume);
            ui.separator();
            let panel = ui.button("Name, spacing, turn…").on_hover_text("All that is known of the scan, to be corrected where it is wrong");
            let close = ui.button("Close the scan").on_hover_text("Undo brings it back");
            if panel.clicked() { Some(More::Panel) } else { close.clicked().then_some(More::Close) }
        });
        more.response.on_hover_text("Information, name, spacing, turn, close").accessible_name(format!("More of {name}"));
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            ui.checkbox(&mut layer.visible, "").on_hover_text("Show").accessible_name(format!("Show {name}"));
            color_button(ui, &mut layer.color, &format!("Colour of {name}"));
            let title = Label::new(RichText::new(name).strong().size(15.0)).truncate();
            // It takes no focus: who uses keys finds Earlier and Later in the scan's own panel.
            ui.add(title.selectable(false).sense(Sense::DRAG)).dnd_set_drag_payload(Dragged(n));
        });
        more.inner.flatten()
    });
    let text_color = if layer.visible { color(layer.color) } else { ui.visuals().weak_text_color() };
    match shown {
        Shown::Transfer => {
            let name = layer.transfer.as_ref().map_or("bone", |t| t.name.as_str());
            transfer_editor::presets_menu(ui, &format!("Look: {name}"), volume, layer);
            transfer_editor::show(ui, volume, layer);
        }
        Shown::Shells => transfer_editor::presets_menu(ui, "Ready-made looks", volume, layer),
        _ => {}
    }
    if matches!(shown, Shown::Transfer | Shown::Nothing) {
        ui.weak("Bone, where a click measures:");
    } else {
        histogram::show(ui, volume, &mut layer.iso, text_color);
        iso_slider(ui, volume, layer);
    }
    iso_number(ui, volume, layer);
    if matches!(shown, Shown::Overlay | Shown::Shells) {
        ui.horizontal(|ui| {
            ui.weak("Opacity");
            percent(ui, &mut layer.opacity, &format!("Opacity of {name}"));
        });
    }
    if shown == Shown::Shells {
        shells::show(ui, volume, layer);
    }
    if !volume.warnings().is_empty() {
        let count = volume.warnings().len();
        let title = if count == 1 { "1 warning".to_owned() } else { format!("{count} warnings") };
        ui.collapsing(RichText::new(title).color(ui.visuals().warn_fg_color), |ui| {
            for warning in volume.warnings() {
                ui.label(in_the_window(warning));
            }
        });
    }
    chosen
}

/// What is known of the scan, which is seldom asked for.
fn information(ui: &mut Ui, volume: &Volume) {
    let [nx, ny, nz] = volume.grid().dims();
    let [sx, sy, sz] =
        volume.grid().spacing_mm().to_array().map(|s| format!("{s:.3}").trim_end_matches('0').trim_end_matches('.').to_owned());
    let spacing = if sx == sy && sy == sz { sx } else { format!("{sx} × {sy} × {sz}") };
    ui.strong(volume.name());
    ui.label(format!("{nx} × {ny} × {nz} samples, {spacing} mm apart"));
    let [low, high] = volume.range();
    ui.label(format!("values from {} to {}{}", round(low), round(high), suffix(volume.unit())));
    ui.label(volume.format());
}

fn iso_slider(ui: &mut Ui, volume: &Volume, layer: &mut Layer) {
    let [low, high] = volume.range();
    ui.spacing_mut().slider_width = ui.available_width();
    // A value from a session may lie outside the range: it stays until the person changes it.
    let slider = Slider::new(&mut layer.iso, low..=high).clamping(SliderClamping::Edits).max_decimals(3).show_value(false);
    ui.add(slider).accessible_name(format!("Isovalue of {}", volume.name()));
}

fn iso_number(ui: &mut Ui, volume: &Volume, layer: &mut Layer) {
    let [low, high] = volume.range();
    let (default, why) = volume.default_isovalue();
    ui.horizontal_wrapped(|ui| {
        let number = DragValue::new(&mut layer.iso)
            .custom_formatter(widgets::number)
            .range(low..=high)
            .clamp_existing_to_range(false)
            .max_decimals(3);
        // The first digits of a number are no isovalue yet.
        let number = number.update_while_editing(false);
        let number = number.speed((high - low) / 1000.0).suffix(suffix(volume.unit()));
        ui.add(number).on_hover_text("Click to type the isovalue").accessible_name(format!("Isovalue of {} as a number", volume.name()));
        if layer.iso == default {
            ui.weak(format!("default: {why}")).on_hover_text("The isovalue that the scan opened with");
        } else if ui.small_button(format!("Reset to {}{}", round(default), suffix(volume.unit()))).on_hover_text(why).clicked() {
            layer.iso = default;
        }
        if !(low..=high).contains(&layer.iso) {
            ui.colored_label(ui.visuals().warn_fg_color, "outside the scan's range");
        }
    });
}

/// Three decimals at most.
fn round(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
