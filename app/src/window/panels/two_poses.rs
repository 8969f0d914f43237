//! What the selected ray measures under two registrations of a scan, side by side.

use super::super::bench::Bench;
use super::super::widgets::elided;
use super::stretches::{mm, which};
use bregma_field::{Registration, Volume};
use bregma_measure::numbers::signed;
use bregma_renderer::{Ray, Scene};
use bregma_session::{Opened, record, same_scans};
use egui::{ComboBox, Grid, Label, RichText, Ui};
use std::sync::Arc;

/// The two, by their numbers in the list of the pair, and what was measured last.
#[derive(Debug, Default)]
pub struct TwoPoses {
    chosen: [usize; 2],
    known: [Option<Known>; 2],
}

/// What a ray measures under a registration.
#[derive(Debug)]
struct Known {
    scene: Scene,
    ray: (Ray, bool),
    volumes: Vec<Arc<Volume>>,
    found: Result<Lengths, String>,
}

/// Of each bone, what it is called, its length or difference, and the ±, mm.
#[derive(Debug)]
struct Lengths {
    /// Differences between both scans; else lengths of the one that moves.
    are_differences: bool,
    bones: Vec<(String, f64, f64)>,
}

/// Width of a column, and of a bone's name, in points.
const COLUMN: f32 = 112.0;
const BONE: f32 = 72.0;

impl TwoPoses {
    /// Shows both, where there are two to choose and a ray.
    pub fn show(&mut self, ui: &mut Ui, bench: &Bench, [moving, fixed]: [usize; 2]) {
        let opened = &bench.work.opened;
        let kept = opened.poses_of([moving, fixed]);
        if kept.len() < 2 {
            return;
        }
        let Some(named) = bench.work.measured.rays.get(bench.work.measured.selected) else {
            ui.weak("A ray shows its lengths under two of them here");
            return;
        };
        self.chosen = self.chosen.map(|n| n.min(kept.len() - 1));
        if self.chosen[0] == self.chosen[1] {
            self.chosen = [0, 1];
        }
        let before = self.chosen;
        ui.separator();
        ui.add(Label::new(RichText::new(format!("{} under two registrations", named.name)).strong()).truncate());
        for n in 0..2 {
            let pose = &opened.poses[kept[self.chosen[n]]];
            self.measured(n, opened, moving, opened.posed(pose, fixed), (named.ray, named.as_cut));
        }
        Grid::new("two registrations").num_columns(3).spacing([8.0, 3.0]).striped(true).show(ui, |ui| {
            let differ = self.known.iter().flatten().any(|known| known.found.as_ref().is_ok_and(|found| found.are_differences));
            ui.weak(if differ { "B − A, mm" } else { "mm" });
            for (n, name) in ["First registration", "Second registration"].into_iter().enumerate() {
                let text = |ui: &Ui, k: usize| elided(ui, &opened.poses[kept[k]].name, COLUMN - 30.0);
                let combo = ComboBox::from_id_salt(name).width(COLUMN - 8.0).selected_text(text(ui, self.chosen[n]));
                let combo = combo.show_ui(ui, |ui| {
                    for (k, number) in kept.iter().enumerate() {
                        let name = &opened.poses[*number].name;
                        let shown = text(ui, k);
                        ui.selectable_value(&mut self.chosen[n], k, shown).on_hover_text(name).accessible_name(name);
                    }
                });
                combo.response.on_hover_text(&opened.poses[kept[self.chosen[n]]].name).accessible_name(name);
            }
            ui.end_row();
            self.rows(ui);
        });
        if self.chosen[0] == self.chosen[1] {
            // The other takes the place that this one left.
            self.chosen = [before[1], before[0]];
        }
        for error in self.known.iter().flatten().filter_map(|known| known.found.as_ref().err()) {
            ui.colored_label(ui.visuals().warn_fg_color, error);
        }
    }

    fn rows(&self, ui: &mut Ui) {
        let bones: Vec<&Lengths> = self.known.iter().flatten().filter_map(|known| known.found.as_ref().ok()).collect();
        let count = bones.iter().map(|lengths| lengths.bones.len()).max().unwrap_or(0);
        for row in 0..count {
            let name = bones.iter().find_map(|lengths| lengths.bones.get(row)).map_or("", |(name, ..)| name);
            // What must be known about a bone is there to be pointed at.
            let bone = name.split(',').next().unwrap_or(name);
            ui.add(Label::new(elided(ui, bone, BONE))).on_hover_text(name);
            for lengths in &bones {
                let text = lengths.bones.get(row).map_or("–".to_owned(), |(_, length, error)| {
                    let length = if lengths.are_differences { signed(*length, 2) } else { mm(*length) };
                    format!("{length} ± {}", mm(*error))
                });
                ui.strong(text);
            }
            ui.end_row();
        }
        if count == 0 {
            ui.weak("no bone");
            ui.end_row();
        }
    }

    /// Measures column `n`, unless that is known.
    fn measured(&mut self, n: usize, opened: &Opened, moving: usize, registration: Registration, ray: (Ray, bool)) {
        let mut layers = opened.scene.layers.clone();
        let layer = &mut layers[moving];
        (layer.transform, layer.residual_mm, layer.covariance) =
            (registration.transform, registration.residual_mm, registration.covariance);
        // What a ray does not depend on is left out: every turn of the view would measure anew.
        let blank = Scene::of(&[]);
        let scene = Scene { layers, clips: if ray.1 { opened.scene.clips.clone() } else { vec![] }, ..blank };
        let is_known = |known: &Known| known.scene == scene && known.ray == ray && same_scans(&known.volumes, &opened.volumes);
        if !self.known[n].as_ref().is_some_and(is_known) {
            let there = Opened { scene: scene.clone(), ..opened.clone() };
            let found = lengths(&there, moving, ray);
            self.known[n] = Some(Known { scene, ray, volumes: opened.volumes.clone(), found });
        }
    }
}

/// What a ray measures of the scan that moves: against the other where both are seen, else alone.
fn lengths(opened: &Opened, moving: usize, (ray, as_cut): (Ray, bool)) -> Result<Lengths, String> {
    let found = record::measure(opened, &ray, as_cut).map_err(|e| format!("The ray cannot be cast: {e}"))?;
    let is_it = |n: &usize| found.volumes[*n].index == moving;
    if let Some(pair) = found.pairs.iter().find(|pair| pair.volumes.iter().any(is_it)) {
        let bones = pair.differences.iter().map(|d| (which(d), d.difference_mm, d.uncertainty.error_mm)).collect();
        return Ok(Lengths { are_differences: true, bones });
    }
    let segments = found.volumes.iter().find(|v| v.index == moving).map_or(&[][..], |v| &v.segments);
    let bones = segments.iter().enumerate().map(|(n, s)| (format!("bone {}", n + 1), s.length_mm, s.uncertainty.error_mm)).collect();
    Ok(Lengths { are_differences: false, bones })
}
