//! Studio light: which one, from where its key light comes, and what the bone stands on.

use super::super::widgets::{color_button, percent};
use super::ball;
use bregma_renderer::Color;
use bregma_renderer::studio::{Ground, MOST_SMOOTH_VOXEL, Preset, Studio};
use bregma_session::studio::ready_made;
use bregma_session::{Compare, Opened};
use egui::{Align2, DragValue, FontId, Rect, Role, Sense, Ui, WidgetInfo, vec2};
use glam::Vec3;

/// Across and down a tile, and across its ball, in points.
const TILE: [f32; 2] = [68.0, 58.0];
const BALL: f32 = 32.0;

/// A light to choose: its preset, its name, what it shows, and where on the tile's ball it lies over how dark a rim.
type Choice = (Option<Preset>, &'static str, &'static str, [f32; 3], u8);

const TILES: [Choice; 5] = [
    (None, "No studio", "The light of the panel Light, at once", [-0.4, 0.5, 0.77], 40),
    (Some(Preset::Journal), "Journal", "One lamp from the upper left and a sky that fills, no ground: for figures", [-0.5, 0.6, 0.62], 110),
    (
        Some(Preset::Museum),
        "Museum",
        "A warm key light on a dark sweep, a cool rim from behind; samples smoothed by 0.6 voxel",
        [-0.6, 0.55, 0.58],
        30,
    ),
    (
        Some(Preset::Relief),
        "Relief",
        "A small lamp low over the surface: the most of relief; samples smoothed by 0.6 voxel",
        [-0.95, 0.25, 0.18],
        20,
    ),
    (Some(Preset::Sky), "Sky", "The sky alone: dark is what lies deep", [0.0, 0.0, 1.0], 150),
];

/// Shows the lights as tiles, and what can be changed of the one that is chosen.
pub fn show(ui: &mut Ui, opened: &mut Opened) {
    ui.horizontal(|ui| {
        for (preset, name, what, toward, shade) in TILES {
            let studio = preset.map(ready_made);
            let tile = Tile { name, what, toward: Vec3::from(toward), shade, is_chosen: opened.scene.studio == studio };
            if tile.is_clicked(ui) {
                opened.scene.studio = studio;
            }
        }
    });
    if opened.scene.studio.is_some() && opened.compare != Compare::Off && opened.compared().is_some() {
        ui.weak("The view shows it while scans are together: Compare, Together");
    }
    let camera = opened.scene.camera;
    let Some(studio) = &mut opened.scene.studio else { return };
    ui.horizontal(|ui| {
        if let Some(key) = studio.lamps.first_mut() {
            let seen = key.seen_from(&camera).as_vec3();
            if let Some(toward) = ball::turned(ui, seen, "Direction of the key light") {
                key.put(toward.as_dvec3(), &camera);
            }
        }
        ui.vertical(|ui| parts(ui, studio));
    });
}

/// What of a studio is changed by numbers and choices.
fn parts(ui: &mut Ui, studio: &mut Studio) {
    ui.horizontal(|ui| {
        ui.weak("Stands on");
        let sweep = if let Ground::Sweep { color } = studio.ground { color } else { SWEEP };
        for (ground, name, what) in [
            (Ground::None, "Nothing", "The bone alone, on the picture's ground"),
            (Ground::Sweep { color: sweep }, "Sweep", "A plane that curves up behind into a wall"),
            (Ground::Catcher, "Shadow", "A plane that is seen only as the shadow on it, on any ground"),
        ] {
            ui.radio_value(&mut studio.ground, ground, name).on_hover_text(what);
        }
        if let Ground::Sweep { color } = &mut studio.ground {
            color_button(ui, color, "Colour of the sweep");
        }
    });
    ui.horizontal(|ui| {
        ui.weak("Gloss").on_hover_text("A coat of varnish: 0 is dry bone");
        let size = vec2(SLIDER, ui.spacing().interact_size.y);
        ui.allocate_ui(size, |ui| percent(ui, &mut studio.gloss, "Gloss"));
    });
    ui.horizontal(|ui| {
        ui.weak("Smoothed by");
        let number = DragValue::new(&mut studio.smooth_voxel).range(0.0..=MOST_SMOOTH_VOXEL).speed(0.01).max_decimals(2).suffix(" voxel");
        let hint = "Takes the steps of the sampling away, in this light alone: above 0 the picture is not of the measured surface";
        ui.add(number.update_while_editing(false)).on_hover_text(hint).accessible_name("Smoothing of the samples");
        if studio.smooth_voxel > 0.0 {
            ui.weak("not the measured surface");
        }
    });
}

/// Across a slider with its number, in points.
const SLIDER: f32 = 190.0;
/// A sweep begins in the museum's grey.
const SWEEP: Color = Color([0.265, 0.255, 0.245]);

/// A light to choose.
struct Tile {
    name: &'static str,
    what: &'static str,
    /// Where the light lies over the ball, and how dark the ball is elsewhere.
    toward: Vec3,
    shade: u8,
    is_chosen: bool,
}

impl Tile {
    fn is_clicked(&self, ui: &mut Ui) -> bool {
        let (rect, response) = ui.allocate_exact_size(TILE.into(), Sense::click());
        response.widget_info(|| WidgetInfo::selected(Role::RadioButton, true, self.is_chosen, self.name));
        let visuals = ui.style().interact_selectable(&response, self.is_chosen);
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4.0, if self.is_chosen { visuals.bg_fill } else { visuals.weak_bg_fill });
        let ball = Rect::from_center_size(rect.center_top() + vec2(0.0, 6.0 + BALL / 2.0), vec2(BALL, BALL));
        ball::draw(&painter, ball, self.toward, self.shade);
        let at = rect.center_bottom() - vec2(0.0, 4.0);
        painter.text(at, Align2::CENTER_BOTTOM, self.name, FontId::proportional(12.0), visuals.text_color());
        response.on_hover_text(self.what).clicked()
    }
}
