//! How the scans become a picture: the mode with what it uses, and the light. None of it moves what is measured.

use super::super::bench::Bench;
use super::super::widgets::{self, color_button, percent};
use super::light;
use bregma_field::Volume;
use bregma_renderer::{BACKGROUND, Gather, Integrator, Mode, Named, Normals, Picture, RayValue, Reconstruction, Scene, Setting, Window};
use egui::{CollapsingHeader, DragValue, Grid, Ui};
use std::sync::Arc;

/// Shows the modes, what the chosen one uses, and, folded, the light.
pub fn show(ui: &mut Ui, bench: &mut Bench) {
    let (opened, picture) = (&mut bench.work.opened, bench.view.painted.as_ref().map(|painted| &painted.picture));
    let scene = &mut opened.scene;
    CollapsingHeader::new("Look").default_open(true).show(ui, |ui| {
        Grid::new("modes").spacing([5.0, 2.0]).show(ui, |ui| {
            ui.spacing_mut().icon_spacing = 2.0;
            // Slices have views of their own.
            let modes: Vec<Mode> = Mode::ALL.iter().copied().filter(|mode| !mode.uses(Setting::Slice)).collect();
            for row in modes.chunks(3) {
                for mode in row {
                    let facts = mode.facts();
                    ui.radio_value(&mut scene.mode, *mode, facts.title).on_hover_text(facts.shows);
                }
                ui.end_row();
            }
        });
        switches(ui, scene);
        if scene.mode.uses(Setting::Agreement) {
            agreement(ui, scene, &opened.volumes);
        }
        if scene.mode.uses(Setting::Depths) {
            depth_range(ui, scene, &opened.volumes);
        }
        if scene.mode.uses(Setting::Numbers) {
            value_range(ui, &mut scene.value_range, &opened.volumes);
            window(ui, &mut scene.window, || projected(scene.mode, &opened.volumes, picture));
        }
    });
    CollapsingHeader::new("Light").show(ui, |ui| {
        if !scene.mode.uses(Setting::Numbers) {
            light::show(ui, scene);
            shading(ui, scene);
        }
        ui.horizontal(|ui| {
            let mut background = scene.background.unwrap_or(BACKGROUND);
            if color_button(ui, &mut background, "Background colour") {
                scene.background = Some(background);
            }
            ui.weak("Background");
        });
    });
}

/// What may be drawn instead of the trilinear interpolant, which is measured.
const OTHERS: [(Reconstruction, &str, &str); 2] = [
    (
        Reconstruction::Spline,
        "Spline",
        "Draws the tricubic B-spline through the samples instead of the trilinear interpolant, which is measured: smooth, slow, and another surface, \
         for pictures",
    ),
    (Reconstruction::Nearest, "Samples", "Draws each sample as a box, as it is: what the scan holds, before anything is laid between"),
];

/// What is on or off in the chosen mode.
fn switches(ui: &mut Ui, scene: &mut Scene) {
    ui.horizontal_wrapped(|ui| {
        if scene.mode.uses(Setting::Surfaces) {
            let text = "Surfaces keep the light from each other; transparent ones let through what they do of what lies behind them";
            ui.checkbox(&mut scene.shadows, "Shadows").on_hover_text(text);
        }
        if scene.mode.uses(Setting::Solver) {
            for (other, name, text) in OTHERS {
                let mut is_drawn = scene.reconstruction == other;
                if ui.checkbox(&mut is_drawn, name).on_hover_text(text).changed() {
                    scene.reconstruction = if is_drawn { other } else { Reconstruction::Trilinear };
                }
            }
        }
        if scene.mode.uses(Setting::Transfer) {
            integrator(ui, &mut scene.integrator);
        }
        if scene.mode.uses(Setting::Numbers) {
            let text = "How fast the value changes, per mm, instead of the value: edges, and no flat tissue";
            if ui.checkbox(&mut scene.of_gradient, "Of the gradient").on_hover_text(text).changed() {
                // What was black and white among values says nothing about gradients.
                scene.window = None;
            }
        }
    });
}

/// Within what two surfaces are one.
fn agreement(ui: &mut Ui, scene: &mut Scene, volumes: &[Arc<Volume>]) {
    ui.horizontal(|ui| {
        let mut within_mm = scene.agreement_mm(volumes);
        let hint = "Surfaces that lie no farther from each other are drawn once, in bone's colour; at first half a voxel of the coarser scan, or how \
            sure the registration is";
        ui.weak("Agree within");
        let number = DragValue::new(&mut within_mm).range(0.0..=100.0).speed(0.01).max_decimals(3).suffix(" mm").update_while_editing(false);
        if ui.add(number).on_hover_text(hint).accessible_name("Agree within").changed() {
            scene.agree_within_mm = Some(within_mm);
        }
        if scene.agree_within_mm.is_some() && ui.button("Reset").on_hover_text("What it was at first").clicked() {
            scene.agree_within_mm = None;
        }
    });
}

/// How far apart surfaces lie at the ends of the colours.
fn depth_range(ui: &mut Ui, scene: &mut Scene, volumes: &[Arc<Volume>]) {
    ui.horizontal(|ui| {
        let mut range_mm = scene.depth_range_mm(volumes);
        let hint = "What lies so far apart along the line of sight, or farther, has the strongest colour";
        ui.weak("Depths to");
        let number =
            DragValue::new(&mut range_mm).range(0.001..=1000.0).speed(0.02).max_decimals(3).suffix(" mm").update_while_editing(false);
        if ui.add(number).on_hover_text(hint).accessible_name("Depths to").changed() {
            scene.depths_within_mm = Some(range_mm);
        }
        if scene.depths_within_mm.is_some() && ui.button("Reset").on_hover_text("What it was at first").clicked() {
            scene.depths_within_mm = None;
        }
    });
}

fn integrator(ui: &mut Ui, integrator: &mut Integrator) {
    let mut steps = if let Integrator::Steps { per_voxel, jitter } = *integrator { (per_voxel, jitter) } else { (2.0, true) };
    let is_exact = *integrator == Integrator::Exact;
    let exact =
        ui.radio(is_exact, "Exact").on_hover_text("Every cell in the pieces that the colours divide it into; slower, and without noise");
    let stepwise = ui.radio(!is_exact, "Steps").on_hover_text("The value at points that lie evenly apart along each line of sight");
    if exact.clicked() {
        *integrator = Integrator::Exact;
    } else if stepwise.clicked() || !is_exact {
        if !is_exact {
            let number = DragValue::new(&mut steps.0)
                .custom_formatter(widgets::number)
                .range(0.25..=32.0)
                .speed(0.02)
                .max_decimals(2)
                .suffix(" per voxel");
            ui.add(number).on_hover_text("Points in a voxel's length, of the finest scan").accessible_name("Steps per voxel");
            ui.checkbox(&mut steps.1, "Jitter").on_hover_text("Begins each pixel's steps elsewhere: fine noise instead of rings");
        }
        *integrator = Integrator::Steps { per_voxel: steps.0, jitter: steps.1 };
    }
}

fn shading(ui: &mut Ui, scene: &mut Scene) {
    ui.horizontal(|ui| {
        ui.weak("Shading");
        ui.radio_value(&mut scene.normals, Normals::Smooth, "smooth")
            .on_hover_text("By central differences, interpolated: no edges between cells");
        ui.radio_value(&mut scene.normals, Normals::Analytic, "by cell")
            .on_hover_text("By the interpolant's own gradient: what the surface truly has, with an edge at each cell's face");
    });
    ui.horizontal(|ui| {
        ui.weak("Depth cue").on_hover_text("How much of the background's colour the farthest takes on");
        percent(ui, &mut scene.depth_cue, "Depth cue");
    });
}

/// Which of the scan's values count.
fn value_range(ui: &mut Ui, range: &mut Option<[f64; 2]>, volumes: &[Arc<Volume>]) {
    ui.horizontal(|ui| {
        let mut is_part = range.is_some();
        let hint = "Looks only where the scan has values between two: bone without the air around it, or air without the bone";
        if ui.checkbox(&mut is_part, "Only values").on_hover_text(hint).changed() {
            // From what opens as the surface on: bone, without air.
            let first = volumes.first().map(|v| [v.default_isovalue().0, v.range()[1]]).filter(|[low, high]| low < high);
            *range = if is_part { first } else { None };
        }
        if let Some([low, high]) = range {
            let speed = ((*high - *low) / 200.0).max(1e-6);
            let number =
                |value| DragValue::new(value).custom_formatter(widgets::number).speed(speed).max_decimals(2).update_while_editing(false);
            // Each stays on its side of the other.
            let (least, most) = (low.next_up(), high.next_down());
            ui.add(number(low).range(f64::MIN..=most).prefix("from ")).accessible_name("Lowest value that counts");
            ui.add(number(high).range(least..=f64::MAX).prefix("to ")).accessible_name("Highest value that counts");
        }
    });
}

/// Which values are black and which white; `first` is what an own choice begins with.
pub fn window(ui: &mut Ui, window: &mut Option<Window>, first: impl FnOnce() -> Window) {
    ui.horizontal(|ui| {
        let mut automatic = window.is_none();
        let hint = "Black and white by what the picture holds, or else by the width and the middle of the grey values";
        if ui.checkbox(&mut automatic, "Automatic contrast").on_hover_text(hint).changed() {
            *window = if automatic { None } else { Some(first()) };
        }
        if let Some(window) = window {
            let speed = (window.width.abs() / 200.0).max(1e-6);
            let number =
                |value| DragValue::new(value).custom_formatter(widgets::number).speed(speed).max_decimals(2).update_while_editing(false);
            ui.add(number(&mut window.width).range(0.0..=f64::INFINITY).prefix("W "))
                .on_hover_text("Width: from black to white, in values")
                .accessible_name("Window width");
            ui.add(number(&mut window.level).prefix("L "))
                .on_hover_text("Level: the value that is middle grey")
                .accessible_name("Window level");
        }
    });
}

/// About what a projection is shown by when nothing is said.
fn projected(mode: Mode, volumes: &[Arc<Volume>], picture: Option<&Picture>) -> Window {
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        values.filter(|v| v.is_finite()).map(|v| [v; 2]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    };
    let held = picture.and_then(|p| ends(&mut p.values.iter().map(|v| f64::from(*v))));
    match held {
        // The picture shows what is more than air's.
        Some([low, high]) if mode.gather() == Gather::Number(RayValue::Integral) => Window::between([0.0, high - low.min(0.0)]),
        Some(held) => Window::between(held),
        None => Window::between(ends(&mut volumes.iter().flat_map(|v| v.range())).unwrap_or([0.0, 1.0])),
    }
}
