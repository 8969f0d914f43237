//! The landmarks: their names, and the distances and angles between them.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::measured::Measured;
use super::super::widgets::line;
use super::stretches::mm;
use bregma_measure::landmarks::Template;
use bregma_measure::numbers::fixed;
use bregma_session::record::made;
use bregma_session::save;
use egui::{Align, Button, Label, Layout, RichText, ScrollArea, Sense, TextEdit, Ui};
use glam::DVec3;

/// Shows the list, what it can be begun with, and the button that saves it.
pub fn show(ui: &mut Ui, bench: &mut Bench) {
    let save = ui.horizontal(|ui| {
        ui.menu_button("Use a list", |ui| lists(ui, bench)).response.on_hover_text("Points to be set one after the other, by their names");
        let can = !bench.work.measured.landmarks.is_empty();
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let save = ui.add_enabled(can, Button::new("Save landmarks…")).on_disabled_hover_text("There are none");
            save.on_hover_text("As CSV, 3D Slicer markups or .fcsv, TPS or morphologika").clicked()
        })
        .inner
    });
    if bench.work.measured.landmarks.is_empty() {
        ui.weak("Take the tool Landmark and click on bone. A landmark can be dragged in the picture afterwards.");
        return;
    }
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| list(ui, &mut bench.work.measured));
    if save.inner {
        bench.save(ui.ctx(), SAVE, |bench, file| {
            let specimen = bench.work.opened.volumes.first().map_or("", |v| v.name());
            save::landmarks(file, &bench.work.measured.landmarks, specimen, &made(&bench.work.opened))
        });
    }
}

/// The lists that there are: the usual points of each scan, or one's own.
fn lists(ui: &mut Ui, bench: &mut Bench) {
    let names: Vec<String> = bench.work.opened.volumes.iter().map(|v| v.name().to_owned()).collect();
    for name in names {
        if ui.button(format!("Craniometric points of {name}")).clicked() {
            bench.work.measured.landmarks.extend(Template::craniometric().landmarks(Some(&name)));
        }
    }
    let own = ui.button("A list of one's own…").on_hover_text("A text file with a name on each line");
    if own.clicked() {
        bench.ask(ui.ctx(), Ask::open("Open a list of landmarks", Kind::Files), |bench, _, files| match Template::read(&files[0]) {
            Ok(template) => bench.work.measured.landmarks.extend(template.landmarks(None)),
            Err(error) => bench.messages.error(error.to_string()),
        });
    }
}

/// Where landmarks are saved, and as what.
const SAVE: Ask = Ask {
    title: "Save the landmarks",
    kind: Kind::Save,
    forms: &[
        ("CSV table", &["csv"]),
        ("3D Slicer markups", &["mrk.json"]),
        ("3D Slicer fiducials", &["fcsv"]),
        ("TPS", &["tps"]),
        ("morphologika", &["txt"]),
    ],
    name: "landmarks.csv",
};

fn list(ui: &mut Ui, measured: &mut Measured) {
    let mut removed = None;
    let points: Vec<_> = measured.landmarks.iter().map(|l| (l.name.clone(), l.point_mm)).collect();
    for n in 0..points.len() {
        ui.push_id(("landmark", n), |ui| {
            line(ui, |ui| {
                let name = &points[n].0;
                if ui.small_button("×").on_hover_text("Delete").accessible_name(format!("Delete {name}")).clicked() {
                    removed = Some(n);
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    let edit = TextEdit::singleline(&mut measured.landmarks[n].name).desired_width(150.0);
                    ui.add(edit).on_hover_text(name).accessible_name(format!("Name of {name}"));
                    match points[n].1 {
                        Some(point) => set(ui, measured, &points, n, point),
                        None => missing(ui, measured, n),
                    }
                });
            });
        });
    }
    if let Some(n) = removed {
        measured.landmarks.remove(n);
    }
}

/// The rest of a landmark's line: how far it is from the one before.
fn set(ui: &mut Ui, measured: &mut Measured, points: &[(String, Option<DVec3>)], n: usize, point: DVec3) {
    let before = points[..n].iter().rev().find_map(|(name, point)| Some((name, (*point)?)));
    let text = before.map_or(String::new(), |(name, p)| format!("{} mm to {name}", mm(point.distance(p))));
    let label = Label::new(RichText::new(text).weak()).truncate().sense(Sense::click());
    let label = ui.add(label).on_hover_text(relations(points, n, point));
    label.context_menu(|ui| {
        if ui.button("It is missing").on_hover_text("It keeps its place in the list and is exported as missing").clicked() {
            measured.landmarks[n].point_mm = None;
        }
    });
}

/// The rest of the line of one that is missing.
fn missing(ui: &mut Ui, measured: &mut Measured, n: usize) {
    let hint = "A click on bone with the tool Landmark sets the marked one; what stays missing is exported as missing";
    if ui.selectable_label(measured.wanted == Some(n), "missing").on_hover_text(hint).clicked() {
        measured.wanted = Some(n);
    }
}

/// Where landmark `n` lies, its distances to all others, and the angle of it and the two set before it.
fn relations(points: &[(String, Option<DVec3>)], n: usize, p: DVec3) -> String {
    let name = &points[n].0;
    let mut text = format!("{}, {}, {} mm (LPS)", fixed(p.x, 4), fixed(p.y, 4), fixed(p.z, 4));
    for (_, (to, q)) in points.iter().enumerate().filter(|(m, _)| *m != n) {
        if let Some(q) = q {
            text += &format!("\n{} mm to {to}", fixed(p.distance(*q), 3));
        }
    }
    let before: Vec<(&String, DVec3)> = points[..n].iter().filter_map(|(name, point)| Some((name, (*point)?))).collect();
    if let [.., (a, p0), (b, p1)] = before[..] {
        text += &format!("\n{}° at {b} between {a} and {name}", fixed((p0 - p1).angle_between(p - p1).to_degrees(), 2));
    }
    text
}
