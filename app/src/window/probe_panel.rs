//! The bottom panel: the difference ray in numbers.

use super::bars;
use super::cast::Found;
use bregma_measure::{LedgerEntry, Uncertainty, VolumeRecord, export};
use bregma_volume::Unit;
use egui::{Align, Color32, Grid, Layout, RichText, ScrollArea, Ui};

/// What the person wants done with the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// To a file.
    Save,
    /// Away with it.
    Clear,
}

/// Shows what the ray found.
pub fn show(ui: &mut Ui, found: &Found) -> Option<Wish> {
    let mut wish = None;
    ui.horizontal(|ui| {
        ui.heading("Difference ray");
        ui.weak("distances from where the ray enters the first scan");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("Clear").on_hover_text("Remove the ray").clicked() {
                wish = Some(Wish::Clear);
            }
            if ui.button("Save…").on_hover_text("As CSV, JSON, or 3D Slicer markups").clicked() {
                wish = Some(Wish::Save);
            }
            if ui.button("Copy as text").clicked() {
                ui.ctx().copy_text(export::table(&found.ray));
            }
        });
    });
    ui.add_space(2.0);
    bars::show(ui, found);
    ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = 26.0;
            for (n, (volume, color)) in found.volumes().enumerate() {
                ui.push_id(n, |ui| ui.vertical(|ui| segments(ui, volume, color)));
            }
            ui.vertical(|ui| ledger(ui, found));
        });
    });
    wish
}

fn segments(ui: &mut Ui, volume: &VolumeRecord, color: Color32) {
    ui.spacing_mut().item_spacing.x = 6.0;
    let unit = match volume.unit {
        Unit::Hounsfield => " HU",
        Unit::Value => "",
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new(&volume.name).color(color).strong());
        ui.weak(format!("isovalue {:.4}{unit}", volume.iso).replace(".0000", ""));
    });
    if volume.segments.is_empty() {
        ui.label(if volume.box_mm.is_some() { "no bone" } else { "the ray misses this scan" });
        return;
    }
    Grid::new("segments").striped(true).spacing([14.0, 3.0]).min_col_width(0.0).show(ui, |ui| {
        for head in ["bone", "from mm", "to mm", "length mm"] {
            right(ui, RichText::new(head).weak());
        }
        ui.weak("± mm").on_hover_text("95 of 100 true lengths lie within this of the length; point at a number to see its parts");
        ui.weak("half-max").on_hover_text("Length between the places where the value is halfway between bone and what lies beside it, mm");
        ui.weak("oblique").on_hover_text("Angle between the ray and the bone's normal, the larger of both ends");
        ui.end_row();
        for (n, s) in volume.segments.iter().enumerate() {
            right(ui, RichText::new(format!("{}", n + 1)));
            right(ui, RichText::new(format!("{:.2}", s.from_mm)));
            right(ui, RichText::new(format!("{:.2}", s.to_mm)));
            right(ui, RichText::new(format!("{:.2}", s.length_mm)).strong());
            let parts = parts(&s.uncertainty, volume.iso_tolerance, unit);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.label(format!("{:.2}", s.uncertainty.error_mm)).on_hover_text(parts);
            });
            right(ui, RichText::new(s.half_maximum_mm.map_or("–".to_owned(), |mm| format!("{mm:.2}"))));
            right(ui, RichText::new(format!("{:.0}°", s.obliquity_deg[0].max(s.obliquity_deg[1]))));
            let flags = [
                (s.clipped, "cut by edge", "It begins or ends at a face of the scan: the bone may go on"),
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
        "isovalue ± {tolerance:.1}{unit}: {:.3} mm\nnoise: {:.3} mm\nbetween samples: {:.3} mm\nregistration: {:.3} mm\nroots: {:.1e} mm\n(as squares) and blur: {:.3} mm\ntogether: {:.3} mm",
        u.threshold_error_mm, u.noise_error_mm, u.sampling_error_mm, u.registration_error_mm, u.root_error_mm, u.blur_error_mm, u.error_mm
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
