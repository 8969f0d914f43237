//! The bottom panel: the difference ray in numbers.

use super::super::bench::Bench;
use super::super::measured::Measured;
use super::super::picture::cast::Found;
use super::super::widgets::{color_button, line};
use super::bars;
use super::ray_form::RayForm;
use bregma_measure::export::Named;
use bregma_measure::export::{self, suffix};
use bregma_measure::{LedgerEntry, Uncertainty, VolumeRecord};
use bregma_session::record::made;
use bregma_session::save;
use egui::{Align, Color32, DragValue, Frame, Grid, Id, Layout, Margin, Panel, RichText, Role, ScrollArea, TextEdit, Ui, WidgetInfo, vec2};
use egui_plot::{Line, LineStyle, Plot, VLine};
use rfd::FileDialog;
use std::path::PathBuf;

/// Shows the panel, where there is something to list or a ray is being typed: rays and landmarks, and what the selected ray found.
pub fn show(ui: &mut Ui, bench: &mut Bench, form: &mut RayForm) {
    if bench.work.measured.count() == 0 && !form.open {
        return;
    }
    Panel::bottom("ray").resizable(true).default_size(260.0).size_range(110.0..=640.0).show(ui, |ui| {
        ui.add_space(4.0);
        let list = Panel::left("measured").default_size(210.0).size_range(150.0..=400.0);
        list.show(ui, |ui| ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| listed(ui, bench, form)));
        if let Some(found) = bench.found.get_mut(bench.work.measured.selected) {
            let frame = Frame::NONE.inner_margin(Margin { left: 10, ..Margin::ZERO });
            frame.show(ui, |ui| selected(ui, found, &mut bench.hovered_mm));
        }
    });
}

fn listed(ui: &mut Ui, bench: &mut Bench, form: &mut RayForm) {
    if !bench.work.measured.rays.is_empty() && rays(ui, &mut bench.work.measured) {
        bench.save(ui.ctx(), pick_rays, |bench, file| {
            let names = bench.work.measured.rays.iter().map(|named| named.name.as_str());
            let named: Vec<Named<'_>> = names.zip(&bench.found).map(|(name, found)| Named { name, found: &found.ray }).collect();
            save::rays(file, &named, &made(&bench.work.opened), || bench.work.records(&bench.rays()))
        });
    }
    if !bench.work.measured.landmarks.is_empty() {
        ui.add_space(6.0);
        if landmarks(ui, &mut bench.work.measured) {
            bench.save(ui.ctx(), pick_landmarks, |bench, file| {
                let specimen = bench.work.opened.volumes.first().map_or("", |v| v.name());
                save::landmarks(file, &bench.work.measured.landmarks, specimen, &made(&bench.work.opened))
            });
        }
    }
    if form.open {
        ui.add_space(6.0);
        form.show(ui).into_iter().for_each(|ray| bench.work.measured.add_ray(ray));
    }
}

/// The dialog that asks where rays are saved.
fn pick_rays(dialog: FileDialog) -> Option<Vec<PathBuf>> {
    let dialog = dialog.add_filter("CSV table", &["csv"]).add_filter("JSON", &["json"]).add_filter("3D Slicer markups", &["mrk.json"]);
    dialog.set_file_name("difference-rays.csv").save_file().map(|file| vec![file])
}

/// The dialog that asks where landmarks are saved.
fn pick_landmarks(dialog: FileDialog) -> Option<Vec<PathBuf>> {
    let dialog = dialog.add_filter("CSV table", &["csv"]).add_filter("3D Slicer markups", &["mrk.json"]);
    let dialog = dialog.add_filter("3D Slicer fiducials", &["fcsv"]).add_filter("TPS", &["tps"]).add_filter("morphologika", &["txt"]);
    dialog.set_file_name("landmarks.csv").save_file().map(|file| vec![file])
}

/// All rays. True when they should be saved.
fn rays(ui: &mut Ui, measured: &mut Measured) -> bool {
    let mut save = false;
    ui.horizontal(|ui| {
        ui.label(RichText::new("Difference rays").strong());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            save = ui.button("Save rays…").on_hover_text("As CSV, JSON, or 3D Slicer markups").clicked();
        });
    });
    let mut removed = false;
    for n in 0..measured.rays.len() {
        ui.push_id(n, |ui| {
            line(ui, |ui| {
                let name = measured.rays[n].name.clone();
                let is_selected = measured.selected == n;
                if ui.small_button("×").on_hover_text("Delete").accessible_name(format!("Delete {name}")).clicked() {
                    measured.selected = n;
                    removed = true;
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    color_button(ui, &mut measured.rays[n].color, &format!("Colour of {name}"));
                    if is_selected {
                        let edit = TextEdit::singleline(&mut measured.rays[n].name).desired_width(ui.available_width());
                        ui.add(edit).accessible_name(format!("Name of {name}"));
                    } else if ui.selectable_label(false, &name).on_hover_text("Show its numbers").clicked() {
                        measured.selected = n;
                    }
                });
            });
        });
    }
    if removed {
        measured.remove_ray();
    }
    save
}

/// All landmarks. True when they should be saved.
fn landmarks(ui: &mut Ui, measured: &mut Measured) -> bool {
    let mut save = false;
    ui.horizontal(|ui| {
        ui.label(RichText::new("Landmarks").strong());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            save = ui.button("Save landmarks…").on_hover_text("As CSV, 3D Slicer markups or .fcsv, TPS or morphologika").clicked();
        });
    });
    let mut removed = None;
    let before: Vec<_> = measured.landmarks.iter().filter_map(|l| Some((l.name.clone(), l.point_mm?))).collect();
    let mut set = 0_usize..;
    for (n, landmark) in measured.landmarks.iter_mut().enumerate() {
        ui.push_id(("landmark", n), |ui| {
            line(ui, |ui| {
                let name = landmark.name.clone();
                if ui.small_button("×").on_hover_text("Delete").accessible_name(format!("Delete {name}")).clicked() {
                    removed = Some(n);
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    ui.add(TextEdit::singleline(&mut landmark.name).desired_width(60.0)).accessible_name(format!("Name of {name}"));
                    let Some((p, n)) = landmark.point_mm.and_then(|p| Some((p, set.next()?))) else {
                        ui.weak("missing");
                        return;
                    };
                    // Distance to the landmark before, and the angle there between the two before and this one.
                    let text = match n.checked_sub(1).map(|m| &before[m]) {
                        None => String::new(),
                        Some((to, q)) => format!("{:.2} mm to {to}", p.distance(*q)),
                    };
                    let mut hover = format!("{:.4}, {:.4}, {:.4} mm (LPS)", p.x, p.y, p.z);
                    for (to, q) in before.iter().filter(|(to, _)| *to != name) {
                        hover += &format!("\n{:.3} mm to {to}", p.distance(*q));
                    }
                    if n >= 2 {
                        let ((a, p0), (b, p1)) = (&before[n - 2], &before[n - 1]);
                        hover += &format!("\n{:.2}° at {b} between {a} and {name}", (*p0 - *p1).angle_between(p - *p1).to_degrees());
                    }
                    ui.weak(text).on_hover_text(hover);
                });
            });
        });
    }
    if let Some(n) = removed {
        measured.landmarks.remove(n);
    }
    save
}

fn selected(ui: &mut Ui, found: &mut Found, hovered_mm: &mut Option<f64>) {
    let curve_of = ui.horizontal(|ui| {
        ui.heading("Difference ray");
        ui.weak("distances from where the ray begins");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("Copy as text").clicked() {
                ui.ctx().copy_text(export::table(&found.ray));
            }
            curve_switch(ui, found)
        })
        .inner
    });
    ui.add_space(2.0);
    bars::show(ui, found, hovered_mm);
    let width = ui.available_width() - ui.spacing().scroll.allocated_width();
    ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = 26.0;
            for (n, (volume, color)) in found.volumes().enumerate() {
                ui.push_id(n, |ui| ui.vertical(|ui| segments(ui, volume, color, hovered_mm)));
            }
            ui.vertical(|ui| ledger(ui, found));
        });
        // Tables of long names may be wider than what is seen; plots are not.
        ui.allocate_ui(vec2(width, 170.0), |ui| match curve_of.inner {
            Some(bone) => ui.columns(2, |columns| {
                profile(&mut columns[0], found, hovered_mm);
                by_isovalue(&mut columns[1], found, bone);
            }),
            None => profile(ui, found, hovered_mm),
        });
    });
}

/// Whether the curve of length against isovalue is asked for, and of which bone, from 1.
fn curve_switch(ui: &mut Ui, found: &Found) -> Option<usize> {
    let count = found.volumes().map(|(v, _)| v.segments.len()).max().filter(|count| *count > 0)?;
    let id = Id::unique("length against isovalue");
    let (mut open, mut bone): (bool, usize) = ui.data(|d| d.get_temp(id)).unwrap_or((false, 1));
    bone = bone.clamp(1, count);
    if open {
        ui.add(DragValue::new(&mut bone).range(1..=count).speed(0.05).prefix("bone ")).accessible_name("Bone of the curve");
    }
    let hint = "What another isovalue would make of the length, over half the step from air to bone to both sides";
    ui.checkbox(&mut open, "Length against the isovalue").on_hover_text(hint);
    ui.data_mut(|d| d.insert_temp(id, (open, bone)));
    open.then_some(bone)
}

/// How the length of a bone depends on the isovalue.
fn by_isovalue(ui: &mut Ui, found: &mut Found, bone: usize) {
    let curves = found.curves(bone - 1).to_vec();
    let plot = Plot::new("by isovalue").height(150.0).allow_drag(false).allow_zoom(false).allow_scroll(false).allow_boxed_zoom(false);
    let label = format!("length of bone {bone}, mm");
    let shown = plot.x_axis_label("isovalue").y_axis_label(label).include_y(0.0).show(ui, |plot| {
        for ((volume, color), points) in found.volumes().zip(curves) {
            plot.vline(VLine::new("", volume.iso).color(color.gamma_multiply(0.6)).style(LineStyle::dashed_dense()));
            plot.line(Line::new(volume.name.clone(), points).color(color).width(1.5));
        }
    });
    shown.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Curve of length against isovalue"));
}

/// The density along the ray in each volume, with its isovalue.
fn profile(ui: &mut Ui, found: &Found, hovered_mm: &mut Option<f64>) {
    let Some([from, to]) = found.shown_mm() else { return };
    let line_at = |value: f64, color: Color32| {
        Line::new("", vec![[from, value], [to, value]]).color(color.gamma_multiply(0.6)).style(LineStyle::dashed_dense())
    };
    let plot = Plot::new("profile")
        .height(150.0)
        .show_grid([true, true])
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false);
    let plot =
        plot.include_x(from).include_x(to).x_axis_label("mm along the ray").y_axis_label("density").set_margin_fraction(vec2(0.0, 0.05));
    let shown = plot.show(ui, |plot| {
        for ((volume, color), points) in found.volumes().zip(&found.profiles) {
            plot.line(line_at(volume.iso, color));
            plot.line(Line::new(volume.name.clone(), points.clone()).color(color).width(1.5));
        }
        if let Some(t) = *hovered_mm {
            plot.vline(VLine::new("", t).color(Color32::GRAY));
        }
        plot.pointer_coordinate().map(|p| p.x)
    });
    shown.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Density along the ray"));
    if shown.response.hovered() {
        *hovered_mm = shown.inner.filter(|t| (from..=to).contains(t));
    }
}

fn segments(ui: &mut Ui, volume: &VolumeRecord, color: Color32, hovered_mm: &mut Option<f64>) {
    ui.spacing_mut().item_spacing.x = 6.0;
    let unit = suffix(volume.unit);
    ui.horizontal(|ui| {
        ui.label(RichText::new(&volume.name).color(color).strong());
        ui.weak(format!("isovalue {:.4}{unit}", volume.iso).replace(".0000", ""));
    });
    if volume.segments.is_empty() {
        ui.label(volume.meets.absence().unwrap_or_default());
        return;
    }
    Grid::new("segments").striped(true).spacing([14.0, 3.0]).min_col_width(0.0).show(ui, |ui| {
        for head in ["bone", "from mm", "to mm", "length mm"] {
            right(ui, RichText::new(head).weak());
        }
        ui.weak("± mm").on_hover_text("95 of 100 true lengths lie within this of the length, where the wall is not below the resolution; point at a number to see its parts");
        ui.weak("half-max").on_hover_text("Length between the places where the value is halfway between bone and what lies beside it, mm");
        ui.weak("oblique").on_hover_text("Angle between the ray and the bone's normal, the larger of both ends");
        ui.end_row();
        for (n, s) in volume.segments.iter().enumerate() {
            let is_pointed_at = hovered_mm.is_some_and(|t| (s.from_mm..=s.to_mm).contains(&t));
            let number = RichText::new(format!("{}", n + 1));
            right(ui, if is_pointed_at { number.strong().background_color(ui.visuals().selection.bg_fill) } else { number });
            right(ui, RichText::new(format!("{:.2}", s.from_mm)));
            right(ui, RichText::new(format!("{:.2}", s.to_mm)));
            let length =
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.label(RichText::new(format!("{:.2}", s.length_mm)).strong()));
            if length.inner.hovered() {
                *hovered_mm = Some(0.5 * (s.from_mm + s.to_mm));
            }
            let parts = parts(&s.uncertainty, volume.iso_tolerance, unit);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.label(format!("{:.2}", s.uncertainty.error_mm)).on_hover_text(parts);
            });
            right(ui, RichText::new(s.half_maximum_mm.map_or("–".to_owned(), |mm| format!("{mm:.2}"))));
            right(ui, RichText::new(format!("{:.0}°", s.obliquity_deg[0].max(s.obliquity_deg[1]))));
            let flags = [
                (s.from_origin, "begins inside", "The ray begins in this bone: it is longer than this"),
                (s.cut, "cut", "It begins or ends at a cut: the bone goes on"),
                (s.clipped && !s.cut, "cut by edge", "It begins or ends at a face of the scan: the bone may go on"),
                (s.below_resolution, "below resolution", "Thinner than the scan resolves: a threshold cannot measure it"),
            ];
            for (_, flag, why) in flags.iter().filter(|(set, ..)| *set) {
                ui.colored_label(ui.visuals().warn_fg_color, *flag).on_hover_text(*why);
            }
            ui.end_row();
        }
    });
}

/// What a length's uncertainty consists of.
fn parts(u: &Uncertainty, tolerance: f64, unit: &str) -> String {
    format!(
        "isovalue ± {tolerance:.1}{unit}: {:.3} mm\nnoise: {:.3} mm\nbetween samples: {:.3} mm\nregistration: {}\nroots: {:.1e} mm\n(as squares) and blur: {:.3} mm\ntogether: {:.3} mm",
        u.threshold_error_mm,
        u.noise_error_mm,
        u.sampling_error_mm,
        u.registration_error_mm.map_or("not known".to_owned(), |mm| format!("{mm:.3} mm")),
        u.root_error_mm,
        u.blur_error_mm,
        u.error_mm
    )
}

fn ledger(ui: &mut Ui, found: &Found) {
    ui.spacing_mut().item_spacing.x = 6.0;
    ui.label(RichText::new("Who is inside where").strong());
    Grid::new("ledger").striped(true).spacing([14.0, 3.0]).min_col_width(0.0).show(ui, |ui| {
        for head in ["from mm", "to mm", "length mm"] {
            right(ui, RichText::new(head).weak());
        }
        ui.weak("inside");
        ui.end_row();
        for LedgerEntry { from_mm, to_mm, length_mm, inside } in &found.ray.ledger {
            for mm in [from_mm, to_mm, length_mm] {
                right(ui, RichText::new(format!("{mm:.2}")));
            }
            if inside.is_empty() {
                ui.weak("gap")
            } else {
                ui.label(inside.join(" + "))
            };
            ui.end_row();
        }
    });
}

/// Numbers stand under each other, units under units.
fn right(ui: &mut Ui, text: RichText) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.label(text));
}
