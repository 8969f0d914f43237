//! What a person prefers, in a window of its own.

use super::super::bench::Bench;
use super::super::preferences::{Preferences, ThemeChoice};
use super::super::widgets::{self, color_button};
use bregma_measure::table_style::LengthUnit;
use bregma_renderer::BACKGROUND;
use egui::{Button, Context, DragValue, Grid, Ui, Window};

/// Shows it while it is open. Whether it stays open.
pub fn show(ctx: &Context, bench: &mut Bench) -> bool {
    let mut open = true;
    let before = bench.remembered.preferences.clone();
    Window::new("Preferences").open(&mut open).default_pos([360.0, 90.0]).resizable(false).show(ctx, |ui| {
        Grid::new("preferences").num_columns(2).spacing([16.0, 8.0]).show(ui, |ui| rows(ui, &mut bench.remembered.preferences));
        let usual = ui.add_enabled(bench.remembered.preferences != Preferences::default(), Button::new("As at first"));
        if usual.clicked() {
            bench.remembered.preferences = Preferences::default();
        }
    });
    if bench.remembered.preferences != before {
        bench.remembered.write();
    }
    open
}

fn rows(ui: &mut Ui, preferences: &mut Preferences) {
    ui.label("Theme");
    ui.horizontal(|ui| {
        for (theme, name) in [(ThemeChoice::Dark, "Dark"), (ThemeChoice::Light, "Light"), (ThemeChoice::System, "As the system")] {
            ui.radio_value(&mut preferences.theme, theme, name);
        }
    });
    ui.end_row();

    ui.label("Background of new pictures");
    ui.horizontal(|ui| {
        let mut color = preferences.background.unwrap_or(BACKGROUND);
        if color_button(ui, &mut color, "Background of new pictures") {
            preferences.background = Some(color);
        }
        if preferences.background.is_some() && ui.button("Usual").clicked() {
            preferences.background = None;
        }
    });
    ui.end_row();

    ui.label("Isovalue of new scans").on_hover_text("Of scans in Hounsfield units; others open with what parts their values best");
    ui.horizontal(|ui| {
        let mut is_found = preferences.iso_hu.is_none();
        if ui.checkbox(&mut is_found, "Found in the scan").changed() {
            preferences.iso_hu = if is_found { None } else { Some(USUAL_BONE_HU) };
        }
        if let Some(iso) = &mut preferences.iso_hu {
            let number = DragValue::new(iso).custom_formatter(widgets::number).range(-1000.0..=3000.0).max_decimals(1).suffix(" HU");
            ui.add(number).accessible_name("Isovalue of new scans");
        }
    });
    ui.end_row();
    tables_and_hands(ui, preferences);
}

fn tables_and_hands(ui: &mut Ui, preferences: &mut Preferences) {
    ui.label("Lengths in tables").on_hover_text("Of tables that are saved from here as CSV; other files have mm");
    ui.horizontal(|ui| {
        for unit in LengthUnit::ALL {
            ui.radio_value(&mut preferences.tables.unit, unit, unit.symbol());
        }
    });
    ui.end_row();

    ui.label("Numbers in tables");
    ui.horizontal(|ui| {
        ui.radio_value(&mut preferences.tables.decimal_comma, false, "1.5").on_hover_text("Commas between fields");
        ui.radio_value(&mut preferences.tables.decimal_comma, true, "1,5").on_hover_text("Semicolons between fields");
    });
    ui.end_row();

    ui.label("Pictures at rest");
    let mut is_smooth = preferences.samples_at_rest > 1;
    let hint = "Draws on until each pixel has 16 points, each exact: edges without steps; then it costs nothing more";
    if ui.checkbox(&mut is_smooth, "Smooth edges").on_hover_text(hint).changed() {
        preferences.samples_at_rest = if is_smooth { Preferences::default().samples_at_rest } else { 1 };
    }
    ui.end_row();

    ui.label("A drag turns the view");
    ui.horizontal(|ui| {
        ui.radio_value(&mut preferences.turns_freely, false, "as a turntable");
        ui.radio_value(&mut preferences.turns_freely, true, "as a ball");
    });
    ui.end_row();
}

/// What many studies of dry bone and of living heads take for bone.
const USUAL_BONE_HU: f64 = 300.0;
