//! The landmarks: their names, and the distances and angles between them.

use super::super::bench::Bench;
use super::super::files::{Ask, Kind};
use super::super::measured::Measured;
use super::super::widgets::line;
use super::stretches::mm;
use bregma_session::save;
use egui::{Align, Label, Layout, ScrollArea, TextEdit, Ui};

/// Shows the list and the button that saves it.
pub fn show(ui: &mut Ui, bench: &mut Bench) {
    if bench.work.measured.landmarks.is_empty() {
        ui.weak("Take the tool Landmark and click on bone. A landmark can be dragged in the picture afterwards.");
        return;
    }
    let save =
        line(ui, |ui| ui.button("Save landmarks…").on_hover_text("As CSV, 3D Slicer markups or .fcsv, TPS or morphologika").clicked());
    ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| list(ui, &mut bench.work.measured));
    if save {
        bench.save(ui.ctx(), SAVE, |bench, file| {
            let specimen = bench.work.opened.volumes.first().map_or("", |v| v.name());
            save::landmarks(file, &bench.work.measured.landmarks, specimen)
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
    for (n, landmark) in measured.landmarks.iter_mut().enumerate() {
        ui.push_id(("landmark", n), |ui| {
            line(ui, |ui| {
                let name = landmark.name.clone();
                if ui.small_button("×").on_hover_text("Delete").accessible_name(format!("Delete {name}")).clicked() {
                    removed = Some(n);
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    let edit = TextEdit::singleline(&mut landmark.name).desired_width(130.0);
                    ui.add(edit).on_hover_text(&name).accessible_name(format!("Name of {name}"));
                    let text = n.checked_sub(1).map_or(String::new(), |m| {
                        let (to, q) = &points[m];
                        format!("{} mm to {to}", mm(landmark.point_mm.distance(*q)))
                    });
                    ui.add(Label::new(egui::RichText::new(text).weak()).truncate()).on_hover_text(relations(&points, n));
                });
            });
        });
    }
    if let Some(n) = removed {
        measured.landmarks.remove(n);
    }
}

/// Where landmark `n` lies, its distances to all others, and the angle of the last three.
fn relations(points: &[(String, glam::DVec3)], n: usize) -> String {
    let (name, p) = &points[n];
    let mut text = format!("{:.4}, {:.4}, {:.4} mm (LPS)", p.x, p.y, p.z);
    for (_, (to, q)) in points.iter().enumerate().filter(|(m, _)| *m != n) {
        text += &format!("\n{:.3} mm to {to}", p.distance(*q));
    }
    if let [.., (a, p0), (b, p1), _] = &points[..=n] {
        text += &format!("\n{:.2}° at {b} between {a} and {name}", (*p0 - *p1).angle_between(*p - *p1).to_degrees());
    }
    text
}
