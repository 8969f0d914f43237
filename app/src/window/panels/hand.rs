//! A scan moved by hand: the switch that gives it to the mouse, and the numbers of how far it lies from where the hand took it.

use super::super::bench::Bench;
use super::super::picture::by_hand::{ByHand, Moved};
use super::super::widgets;
use egui::{Button, DragValue, Grid, Ui};
use glam::DQuat;

/// How far a click on − or + goes.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    mm: f64,
    deg: f64,
}

impl Default for Steps {
    fn default() -> Self {
        // About half a voxel of a head's CT, and what that is at the rim of a head.
        Self { mm: 0.2, deg: 0.2 }
    }
}

const SIDES: [&str; 3] = ["left", "posterior", "superior"];

/// Gives scan number `n` to the mouse, or takes it from it.
pub fn toggle(bench: &mut Bench, n: usize) {
    let has_it = bench.view.hand.as_ref().is_some_and(|hand| hand.number(&bench.work.opened) == Some(n));
    bench.view.hand = (!has_it).then(|| ByHand::take(&bench.work.opened, n));
}

/// Shows the switch for scan number `n`.
pub fn switch(ui: &mut Ui, bench: &mut Bench, n: usize) {
    // Another scan is to be moved, or the one that the hand had was closed.
    if bench.view.hand.as_ref().is_some_and(|hand| hand.number(&bench.work.opened) != Some(n)) {
        bench.view.hand = None;
    }
    let hint = "In the picture and in slices: drag moves it, Ctrl + drag turns it, Alt + drag turns the view; Escape ends it";
    if ui.add(Button::new("Move by hand").selected(bench.view.hand.is_some())).on_hover_text(hint).clicked() {
        toggle(bench, n);
    }
}

/// Shows the numbers, while the hand has the scan.
pub fn numbers(ui: &mut Ui, bench: &mut Bench, steps: &mut Steps) {
    let Some(hand) = bench.view.hand.clone() else { return };
    let Some(was) = hand.moved(&bench.work.opened) else { return };
    let turned_deg = was.turn.to_scaled_axis() * 180.0 / std::f64::consts::PI;
    let (mut shift_mm, mut deg) = (was.shift_mm, turned_deg);
    ui.weak("Since it was taken: shift and turn of its middle").on_hover_text(
        "The turn is one about one axis, as its parts about the axes to the left, posterior and superior, by the right hand",
    );
    Grid::new("by hand").num_columns(3).spacing([8.0, 2.0]).show(ui, |ui| {
        for (axis, side) in SIDES.into_iter().enumerate() {
            ui.weak(side);
            number(ui, &mut shift_mm[axis], (steps.mm, " mm", WIDTHS[0]), &format!("Shift to {side}"));
            number(ui, &mut deg[axis], (steps.deg, "°", WIDTHS[1]), &format!("Turn about {side}"));
            ui.end_row();
        }
        ui.weak("step").on_hover_text("How far a click on − or + goes");
        let step = |value| DragValue::new(value).range(0.01..=50.0).speed(0.01).max_decimals(2);
        ui.add(step(&mut steps.mm).suffix(" mm")).accessible_name("Step of shifts");
        ui.add(step(&mut steps.deg).suffix("°")).accessible_name("Step of turns");
        ui.end_row();
    });
    if shift_mm != was.shift_mm || deg != turned_deg {
        // A number that was not changed keeps all of its digits.
        let turn = if deg == turned_deg { was.turn } else { DQuat::from_scaled_axis(deg * std::f64::consts::PI / 180.0) };
        hand.place(&mut bench.work, Moved { shift_mm, turn });
    }
}

/// Width of a number and its height, in points: they stand under each other.
const WIDTHS: [f32; 2] = [72.0, 58.0];
const HEIGHT: f32 = 18.0;

/// A number with a step down and one up.
fn number(ui: &mut Ui, value: &mut f64, (step, unit, width): (f64, &str, f32), name: &str) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        if ui.small_button("−").accessible_name(format!("{name}, a step less")).clicked() {
            *value -= step;
        }
        let drag = DragValue::new(value).speed(0.1 * step).range(-1e4..=1e4).max_decimals(2).custom_formatter(widgets::number);
        ui.add_sized([width, HEIGHT], drag.suffix(unit).update_while_editing(false)).accessible_name(name);
        if ui.small_button("+").accessible_name(format!("{name}, a step more")).clicked() {
            *value += step;
        }
    });
}
