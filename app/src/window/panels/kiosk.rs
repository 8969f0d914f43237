//! The kiosk: the picture alone on the whole screen, that turns by itself while nobody touches it.

use super::super::bench::Bench;
use egui::{Context, DragValue, Window};

/// What a kiosk waits, seconds: less would take the view out of a hand that thinks.
const WAITS_S: std::ops::RangeInclusive<f64> = 2.0..=3600.0;

/// Shows how it is begun, while that is open. Whether it stays open.
pub fn show(ctx: &Context, bench: &mut Bench) -> bool {
    let (mut open, mut begins) = (true, false);
    Window::new("Kiosk").open(&mut open).default_pos([400.0, 120.0]).resizable(false).show(ctx, |ui| {
        ui.label("The picture on the whole screen, for those who pass by. Left alone, it turns by itself; Escape ends.");
        ui.horizontal(|ui| {
            ui.label("Turns after");
            let seconds = DragValue::new(&mut bench.remembered.preferences.kiosk_after_s).range(WAITS_S).max_decimals(0).suffix(" s");
            if ui.add(seconds).accessible_name("Seconds until it turns").changed() {
                bench.remembered.write();
            }
            begins = ui.button("Begin").clicked();
        });
    });
    if begins {
        bench.stage.fill(ctx, Some(bench.remembered.preferences.kiosk_after_s));
    }
    open && !begins
}
