//! The registrations of a pair that are kept: one takes another's place by a click.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::widgets::line;
use super::registered::{FORMS, mm3};
use bregma_measure::numbers::significant;
use bregma_session::{KeptPose, Made};
use egui::{Align, Button, Label, Layout, RichText, TextEdit, Ui};
use glam::DVec3;

/// Shows them, and keeps the one that stands, which was `made` so.
pub fn show(ui: &mut Ui, bench: &mut Bench, numbers: [usize; 2], made: impl FnOnce(&Bench) -> Made) {
    let kept = bench.work.opened.poses_of(numbers);
    let standing = kept.iter().copied().find(|k| bench.work.opened.stands(&bench.work.opened.poses[*k], numbers));
    ui.horizontal(|ui| {
        ui.strong("Registrations that are kept");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let keep = ui.add_enabled(standing.is_none(), Button::new("Keep this one"));
            let keep = keep.on_hover_text("How the scan lies now stays in the list, to come back to and to compare with");
            if keep.on_disabled_hover_text("It is kept").clicked() {
                let made = made(bench);
                let k = bench.work.opened.keep(numbers, &made);
                take(bench, numbers, k);
            }
        });
    });
    if kept.is_empty() {
        ui.add(Label::new(RichText::new("None: keep one before you try another").weak()).wrap());
    }
    let (mut removed, mut taken) = (None, None);
    for k in kept {
        ui.push_id(("kept", k), |ui| {
            line(ui, |ui| {
                let pose = &mut bench.work.opened.poses[k];
                let name = pose.name.clone();
                if ui.small_button("×").on_hover_text("Delete").accessible_name(format!("Delete {name}")).clicked() {
                    removed = Some(k);
                }
                if standing == Some(k) && ui.small_button("Save…").on_hover_text("As JSON or an ITK transform").clicked() {
                    let (pose, ctx) = (bench.work.opened.poses[k].clone(), ui.ctx().clone());
                    bench.save(&ctx, SAVE, move |_, file| pose.write(file));
                }
                let pose = &mut bench.work.opened.poses[k];
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    if standing == Some(k) {
                        let edit = TextEdit::singleline(&mut pose.name).desired_width(ui.available_width());
                        ui.add(edit).on_hover_text(sureness(pose)).accessible_name(format!("Name of {name}"));
                    } else {
                        let button = ui.add(Button::selectable(false, &name).truncate());
                        let hint = format!("Put the scan there: {}", sureness(pose));
                        taken = button.on_hover_text(hint).clicked().then_some(k).or(taken);
                    }
                });
            });
        });
    }
    if let Some(k) = taken {
        take(bench, numbers, k);
    }
    if let Some(k) = removed {
        bench.work.opened.poses.remove(k);
    }
}

/// Puts the moving scan where number `k` of those that are kept has it.
fn take(bench: &mut Bench, numbers: [usize; 2], k: usize) {
    let opened = &bench.work.opened;
    let registration = opened.posed(&opened.poses[k], numbers[1]);
    bench.work.place(numbers[0], registration);
}

/// Where one that is kept is saved, and as what.
const SAVE: Ask = Ask { title: "Save the registration", kind: Kind::Save, forms: FORMS, name: "registration.json" };

/// What is known of how sure one is.
fn sureness(pose: &KeptPose) -> String {
    let residual = pose.residual_mm.map(|mm| format!("residual {} mm", significant(mm, 3)));
    let middle = pose.covariance.as_ref().map(|c| {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|along| mm3(c.variance_at(c.centre_mm, along).sqrt()));
        format!("middle ± {x}, {y}, {z} mm")
    });
    let known: Vec<String> = residual.into_iter().chain(middle).collect();
    if known.is_empty() { "how sure it is is not known".into() } else { known.join("; ") }
}
