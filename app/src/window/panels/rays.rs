//! The difference rays: their list, and what the selected one found, the number that people come for first.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::measured::Measured;
use super::super::picture::cast::Found;
use super::super::widgets::{color_button, line};
use super::along;
use super::ray_form::RayForm;
use super::stretches;
use bregma_measure::export::{self, Named};
use bregma_session::record::made;
use bregma_session::save;
use egui::{Align, DragValue, Id, Layout, Role, ScrollArea, TextEdit, Ui, WidgetInfo};
use egui_plot::{Line, LineStyle, Plot, VLine};

/// Shows rays, and what the selected one found.
pub fn show(ui: &mut Ui, bench: &mut Bench, form: &mut RayForm) {
    if form.open {
        form.show(ui).into_iter().for_each(|ray| bench.work.measured.add_ray(ray));
        ui.separator();
    }
    if bench.work.measured.rays.is_empty() {
        ui.weak("Click on bone: the difference ray through that point lists every stretch of bone that it meets, in every scan.");
        return;
    }
    let selected_ray = bench.found.get(bench.work.measured.selected);
    if list(ui, &mut bench.work.measured, selected_ray) {
        bench.save(ui.ctx(), SAVE, |bench, file| {
            let names = bench.work.measured.rays.iter().map(|named| named.name.as_str());
            let named: Vec<Named<'_>> = names.zip(&bench.found).map(|(name, found)| Named { name, found: &found.ray }).collect();
            save::rays(file, &named, &made(&bench.work.opened), bench.remembered.preferences.tables, || bench.records())
        });
    }
    ui.separator();
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        let n = bench.work.measured.selected;
        if let Some((found, named)) = bench.found.get_mut(n).zip(bench.work.measured.rays.get_mut(n)) {
            let has_cuts = bench.work.opened.scene.clips.iter().any(|clip| clip.enabled);
            selected(ui, found, &mut bench.hovered_mm);
            if has_cuts || named.as_cut {
                let hint = "Measures only what the cuts leave; otherwise a cut is a way of looking, and the whole bone is measured";
                ui.checkbox(&mut named.as_cut, "As cut").on_hover_text(hint);
            }
        }
    });
}

/// Where rays are saved, and as what.
const SAVE: Ask = Ask {
    title: "Save the rays",
    kind: Kind::Save,
    forms: &[("CSV table", &["csv"]), ("JSON", &["json"]), ("3D Slicer markups", &["mrk.json"])],
    name: "difference-rays.csv",
};

/// As many rays as are listed without scrolling.
const LISTED: f32 = 4.0;

/// All rays. True when they should be saved.
fn list(ui: &mut Ui, measured: &mut Measured, selected: Option<&Found>) -> bool {
    let [save, copy] = line(ui, |ui| {
        let save = ui.button("Save rays…").on_hover_text("As CSV, JSON, or 3D Slicer markups").clicked();
        [save, ui.button("Copy as text").on_hover_text("What the selected ray found, as a table to paste").clicked()]
    });
    if let Some(found) = selected.filter(|_| copy) {
        ui.ctx().copy_text(export::table(&found.ray));
    }
    let mut removed = false;
    let height = LISTED * (ui.spacing().interact_size.y + ui.spacing().item_spacing.y);
    ScrollArea::vertical().id_salt("rays").max_height(height).auto_shrink([false, true]).show(ui, |ui| {
        for n in 0..measured.rays.len() {
            ui.push_id(n, |ui| removed |= listed(ui, measured, n));
        }
    });
    if removed {
        measured.remove_ray();
    }
    save
}

/// One ray; true when it is selected and should be deleted.
fn listed(ui: &mut Ui, measured: &mut Measured, n: usize) -> bool {
    line(ui, |ui| {
        let name = measured.rays[n].name.clone();
        let removed = ui.small_button("×").on_hover_text("Delete").accessible_name(format!("Delete {name}")).clicked();
        if removed {
            measured.selected = n;
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            color_button(ui, &mut measured.rays[n].color, &format!("Colour of {name}"));
            if measured.selected == n {
                let edit = TextEdit::singleline(&mut measured.rays[n].name).desired_width(ui.available_width());
                ui.add(edit).on_hover_text(&name).accessible_name(format!("Name of {name}"));
            } else if ui.add(egui::Button::selectable(false, &name).truncate()).on_hover_text("Show its numbers").clicked() {
                measured.selected = n;
            }
        });
        removed
    })
}

/// What a ray found: the drawing, the tables below each other, and what is seldom asked for.
fn selected(ui: &mut Ui, found: &mut Found, hovered_mm: &mut Option<f64>) {
    stretches::differences(ui, found);
    along::show(ui, found, hovered_mm);
    stretches::show(ui, found, hovered_mm);
    ui.collapsing("Who is inside where", |ui| stretches::ledger(ui, found));
    let hint = "What another isovalue would make of the length, over half the step from air to bone to both sides";
    let curve = ui.collapsing("Length against the isovalue", |ui| curve(ui, found));
    curve.header_response.on_hover_text(hint);
}

/// How the length of a bone depends on the isovalue.
fn curve(ui: &mut Ui, found: &mut Found) {
    let Some(count) = found.volumes().map(|(v, _)| v.segments.len()).max().filter(|count| *count > 0) else { return };
    let id = Id::unique("bone of the curve");
    let mut bone: usize = ui.data(|d| d.get_temp(id)).unwrap_or(1).clamp(1, count);
    ui.add(DragValue::new(&mut bone).range(1..=count).speed(0.05).prefix("bone ")).accessible_name("Bone of the curve");
    ui.data_mut(|d| d.insert_temp(id, bone));
    let curves = found.curves(bone - 1).to_vec();
    let plot = Plot::new("by isovalue").height(150.0).allow_drag(false).allow_zoom(false).allow_scroll(false).allow_boxed_zoom(false);
    let shown = plot.x_axis_label("isovalue").y_axis_label("length, mm").include_y(0.0).show(ui, |plot| {
        for ((volume, color), points) in found.volumes().zip(curves) {
            plot.vline(VLine::new("", volume.iso).color(color.gamma_multiply(0.6)).style(LineStyle::dashed_dense()));
            plot.line(Line::new(volume.name.clone(), points).color(color).width(1.5));
        }
    });
    shown.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Curve of length against isovalue"));
}
