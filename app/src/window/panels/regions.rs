//! What of the surfaces a registration is made on: balls around landmarks that take part alone, or take none.

use super::super::widgets::elided;
use bregma_measure::landmarks::Landmark;
use bregma_register::{Part, Parts};
use bregma_session::Opened;
use egui::{Button, ComboBox, DragValue, Ui};

/// A ball around a landmark.
#[derive(Clone, Debug, PartialEq)]
struct Region {
    /// It takes no part; else what lies in such balls takes part alone.
    is_out: bool,
    scan: Option<String>,
    name: String,
    radius_mm: f64,
}

/// The balls, in the order that they were added in.
#[derive(Clone, Debug, Default)]
pub struct Regions(Vec<Region>);

/// A ball begins so large: an orbit, or a zygomatic bone.
const RADIUS_MM: f64 = 25.0;
/// Width of a landmark's name, in points.
const NAME: f32 = 84.0;

impl Region {
    fn is_around(&self, l: &Landmark) -> bool {
        (&l.scan, &l.name) == (&self.scan, &self.name)
    }
}

impl Regions {
    /// Shows them; `opened` has the landmarks.
    pub fn show(&mut self, ui: &mut Ui, opened: &Opened) {
        let set: Vec<&Landmark> = opened.landmarks.iter().filter(|l| l.point_mm.is_some()).collect();
        let mut removed = None;
        for (n, region) in self.0.iter_mut().enumerate() {
            ui.push_id(n, |ui| {
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = 4.0;
                    let word = |is_out: bool| if is_out { "without" } else { "only" };
                    let combo = ComboBox::from_id_salt("part").width(62.0).selected_text(word(region.is_out));
                    let combo = combo.show_ui(ui, |ui| [false, true].map(|out| ui.selectable_value(&mut region.is_out, out, word(out))));
                    combo.response.accessible_name(format!("Part {}", n + 1));
                    let radius = DragValue::new(&mut region.radius_mm).range(1.0..=500.0).speed(0.2).max_decimals(1).suffix(" mm");
                    ui.add(radius).on_hover_text("Radius of the ball").accessible_name(format!("Radius of part {}", n + 1));
                    ui.weak("of");
                    around(ui, region, &set, n);
                    if ui.small_button("×").accessible_name(format!("Delete part {}", n + 1)).clicked() {
                        removed = Some(n);
                    }
                });
            });
        }
        if let Some(n) = removed {
            self.0.remove(n);
        }
        let add = ui.add_enabled(!set.is_empty(), Button::new("Only a part…").small());
        let add = add.on_hover_text("Only the surface around a landmark, or without that; several are united");
        if add.on_disabled_hover_text("Set a landmark in the middle of the part first").clicked()
            && let Some(l) = set.last()
        {
            self.0.push(Region { is_out: false, scan: l.scan.clone(), name: l.name.clone(), radius_mm: RADIUS_MM });
        }
    }

    /// In the fixed scan's own world. `Err` is a sentence for the person.
    pub fn parts(&self, opened: &Opened, fixed: usize) -> Result<Parts, String> {
        let back = opened.scene.layers[fixed].transform.inverse();
        let mut parts = Parts::default();
        for region in &self.0 {
            let point_mm = opened.landmarks.iter().find(|l| region.is_around(l)).and_then(|l| l.point_mm);
            let point_mm =
                point_mm.ok_or_else(|| format!("The landmark {} is not set any more: choose another for the part.", region.name))?;
            let list = if region.is_out { &mut parts.but } else { &mut parts.only };
            list.push(Part::Ball { centre_mm: back.transform_point3(point_mm), radius_mm: region.radius_mm });
        }
        Ok(parts)
    }
}

/// Chooses the landmark that a ball lies around.
fn around(ui: &mut Ui, region: &mut Region, set: &[&Landmark], n: usize) {
    let shown = elided(ui, &region.name, NAME - 24.0);
    let combo = ComboBox::from_id_salt("around").width(NAME).selected_text(shown).show_ui(ui, |ui| {
        for l in set {
            let text = l.scan.as_ref().map_or(l.name.clone(), |scan| format!("{} of {scan}", l.name));
            if ui.selectable_label(region.is_around(l), elided(ui, &text, 260.0)).on_hover_text(&text).accessible_name(&text).clicked() {
                (region.scan, region.name) = (l.scan.clone(), l.name.clone());
            }
        }
    });
    combo.response.on_hover_text(&region.name).accessible_name(format!("Middle of part {}", n + 1));
}
