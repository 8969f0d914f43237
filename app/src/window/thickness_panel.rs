//! The map of thickness: what is measured, how it is coloured, and what it says in numbers.

use super::history::Work;
use super::job::Job;
use crate::args::{Colors, ThicknessMethod};
use crate::thickness::{Scale, white};
use bregma_field::{Cancelled, Progress, Volume, WorldPoint, crossings};
use bregma_measure::mesh::Mesh;
use bregma_measure::thickness::{self, Method, Statistics};
use bregma_renderer::{Clip, Mode, Ray, Scene, Surface};
use egui::{Align2, Color32, Context, DragValue, FontId, Grid, Rect, Role, Sense, Ui, WidgetInfo, Window, pos2, vec2};
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// A finished map.
#[derive(Debug)]
pub struct Map {
    /// What was measured.
    pub surface: Surface,
    /// Its points.
    pub mesh: Mesh,
    /// Thickness at each of them, mm; NaN where it is not known or not asked for.
    pub values: Vec<f32>,
    /// They in short.
    pub statistics: Statistics,
    /// Which thickness it is.
    pub title: String,
    iso: f64,
    transform: DAffine3,
}

/// A map with its colours, for the picture.
#[derive(Debug)]
pub struct Coat {
    /// The map.
    pub map: Arc<Map>,
    /// Its colours.
    pub scale: Scale,
}

/// The panel.
pub struct ThicknessPanel {
    /// On the screen.
    pub open: bool,
    method: ThicknessMethod,
    /// Number of the scan.
    index: usize,
    /// How far around the last landmark; everywhere when absent.
    patch_mm: Option<f64>,
    colors: Colors,
    /// Ends of the colours where they are not those of the values.
    ends_mm: Option<[f64; 2]>,
    job: Option<Job<Map>>,
    coat: Option<Arc<Coat>>,
    shown: bool,
}

impl Default for ThicknessPanel {
    fn default() -> Self {
        let (method, colors) = (ThicknessMethod::Normal, Colors::Viridis);
        Self { open: false, method, index: 0, patch_mm: None, colors, ends_mm: None, job: None, coat: None, shown: true }
    }
}

/// What is asked for besides the panel's own work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// Save the map.
    Save,
}

/// Each method, its name, and what it answers.
const METHODS: [(ThicknessMethod, &str, &str); 3] = [
    (ThicknessMethod::Normal, "Along the normal", "Straight through the wall, as a section across it shows"),
    (
        ThicknessMethod::Sphere,
        "Inscribed sphere",
        "The diameter of the largest sphere in the bone that holds the point: the same from both sides",
    ),
    (ThicknessMethod::Ray, "Along the view", "Along the direction of the view when it is measured"),
];

impl ThicknessPanel {
    /// The finished map with its colours.
    pub fn coat(&self) -> Option<&Arc<Coat>> {
        self.coat.as_ref()
    }

    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        let map = Arc::new(result.map_err(|e| format!("The thickness was not measured: {e}"))?);
        (self.shown, self.ends_mm) = (true, None);
        self.coat = Some(Arc::new(Coat { scale: self.scale(&map), map }));
        Ok(())
    }

    fn scale(&self, map: &Map) -> Scale {
        let [.., p95] = map.statistics.quantiles_mm;
        Scale { colors: self.colors, ends_mm: self.ends_mm.unwrap_or([0.0, p95]) }
    }

    /// The scene to paint on and the coat, while the map is shown and is of what is open.
    pub fn painting(&self, work: &Work) -> Option<(Scene, Arc<Coat>)> {
        let coat = self.coat.as_ref().filter(|_| self.open && self.shown)?;
        let index = of_now(&coat.map, work)?;
        let mut scene = white(work.opened.scene.clone());
        (scene.mode, scene.transparent) = (Mode::Iso, false);
        scene.layers.iter_mut().enumerate().for_each(|(n, layer)| layer.visible = n == index);
        Some((scene, Arc::clone(coat)))
    }

    /// Shows the panel.
    pub fn show(&mut self, ctx: &Context, work: &Work) -> Option<Wish> {
        let (mut open, mut wish) = (self.open, None);
        let window = Window::new("Thickness map").open(&mut open).default_width(300.0).resizable(false).default_pos([960.0, 60.0]);
        window.show(ctx, |ui| wish = self.contents(ui, work));
        self.open = open;
        wish
    }

    fn contents(&mut self, ui: &mut Ui, work: &Work) -> Option<Wish> {
        if let Some(job) = &self.job {
            if job.ui(ui) {
                self.job = None;
            }
            return None;
        }
        self.question(ui, work);
        let coat = self.coat.clone()?;
        ui.separator();
        if of_now(&coat.map, work).is_none() {
            ui.colored_label(ui.visuals().warn_fg_color, "The scan, its isovalue or its place has changed: measure again.");
        }
        ui.strong(&coat.map.title);
        legend(ui, &coat);
        statistics(ui, &coat.map.statistics);
        ui.checkbox(&mut self.shown, "Show on the surface");
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.colors, Colors::Viridis, "Viridis");
            ui.radio_value(&mut self.colors, Colors::Cividis, "Cividis").on_hover_text("The same for people who confuse red and green");
        });
        ui.horizontal(|ui| {
            let mut automatic = self.ends_mm.is_none();
            let hint = "From 0 to what 95 % of the surface is below; fixed ends make maps of several skulls comparable";
            if ui.checkbox(&mut automatic, "Automatic range").on_hover_text(hint).changed() {
                self.ends_mm = if automatic { None } else { Some(coat.scale.ends_mm) };
            }
            if let Some([low, high]) = &mut self.ends_mm {
                let number = |value, range| DragValue::new(value).range(range).speed(0.05).max_decimals(2).suffix(" mm");
                let (least, greatest) = (*high - 0.01, *low + 0.01);
                ui.add(number(low, 0.0..=least)).accessible_name("Least thickness of the colours");
                ui.add(number(high, greatest..=1000.0)).accessible_name("Greatest thickness of the colours");
            }
        });
        let scale = self.scale(&coat.map);
        if scale != coat.scale {
            self.coat = Some(Arc::new(Coat { scale, map: Arc::clone(&coat.map) }));
        }
        let save = ui.button("Save map…").on_hover_text("The points as CSV, or the coloured surface as PLY");
        save.clicked().then_some(Wish::Save)
    }

    /// What is to be measured.
    fn question(&mut self, ui: &mut Ui, work: &Work) {
        let opened = &work.opened;
        self.index = self.index.min(opened.volumes.len().saturating_sub(1));
        if opened.volumes.len() > 1 {
            ui.horizontal_wrapped(|ui| {
                for (n, volume) in opened.volumes.iter().enumerate() {
                    ui.push_id(n, |ui| ui.radio_value(&mut self.index, n, volume.name()));
                }
            });
        }
        for (method, name, what) in METHODS {
            ui.radio_value(&mut self.method, method, name).on_hover_text(what);
        }
        let last = work.measured.landmarks.last();
        ui.horizontal(|ui| {
            let mut everywhere = self.patch_mm.is_none() || last.is_none();
            ui.radio_value(&mut everywhere, true, "Whole surface").on_hover_text("What the cuts leave of it");
            ui.add_enabled_ui(last.is_some(), |ui| {
                let hint = "A landmark says where (Measure › Landmark): the last one counts";
                ui.radio_value(&mut everywhere, false, "Around a landmark").on_hover_text(hint).on_disabled_hover_text(hint);
            });
            self.patch_mm = if everywhere { None } else { Some(self.patch_mm.unwrap_or(20.0)) };
        });
        if let (Some(patch_mm), Some(last)) = (&mut self.patch_mm, last) {
            ui.horizontal(|ui| {
                ui.weak("within");
                ui.add(DragValue::new(patch_mm).range(0.5..=1000.0).speed(0.2).max_decimals(1).suffix(" mm"))
                    .accessible_name("Radius of the patch");
                ui.weak(format!("of {}", last.name));
            });
        }
        let layer = opened.scene.layers.get(self.index);
        let (Some(volume), Some(layer)) = (opened.volumes.get(self.index), layer) else { return };
        if ui.button("Measure the thickness").clicked() {
            let method = match self.method {
                ThicknessMethod::Normal => Method::Normal,
                ThicknessMethod::Sphere => Method::Sphere,
                ThicknessMethod::Ray => Method::Ray(opened.scene.camera.basis().forward),
            };
            let name = METHODS.iter().find(|(m, ..)| *m == self.method).map_or("", |(_, name, _)| name).to_lowercase();
            let patch = self.patch_mm.and_then(|mm| Some((last?.point_mm, mm)));
            let place = patch.and_then(|(_, mm)| Some(format!(", within {mm} mm of {}", last?.name))).unwrap_or_default();
            let order = Order {
                volume: Arc::clone(volume),
                iso: layer.iso,
                transform: layer.transform,
                clips: opened.scene.clips.clone(),
                index: self.index,
                method,
                patch,
                title: format!("{}, thickness {name}{place}", volume.name()),
            };
            self.job = Some(Job::start(ui.ctx(), "Measuring".into(), move |progress| order.measure(progress)));
        }
    }
}

/// A map to be made.
struct Order {
    volume: Arc<Volume>,
    iso: f64,
    transform: DAffine3,
    clips: Vec<Clip>,
    index: usize,
    method: Method,
    patch: Option<(DVec3, f64)>,
    title: String,
}

impl Order {
    fn measure(self, progress: &Progress) -> Result<Map, String> {
        let surface = Surface::new(&self.volume, self.iso, self.transform).map_err(|e| e.to_string())?;
        let stopped = |e: Cancelled| e.to_string();
        let mesh = Mesh::of(&surface, progress).map_err(stopped)?;
        let mut values = thickness::map(&surface, &mesh, self.method, progress).map_err(stopped)?;
        let left = surface.clone().cut(&self.clips, self.index);
        let is_asked = |point: &DVec3| {
            // What is left of a line from there begins there, but for rounding.
            let line = Ray { origin: WorldPoint(*point), direction: DVec3::X };
            let is_left = self.clips.is_empty() || crossings::box_span(&left, &line).is_some_and(|span| span.t_mm[0] < 1e-9);
            is_left && self.patch.is_none_or(|(centre, mm)| point.distance(centre) <= mm)
        };
        mesh.vertices.iter().zip(&mut values).filter(|(point, _)| !is_asked(point)).for_each(|(_, value)| *value = f32::NAN);
        let statistics = Statistics::of(&mesh, &values).ok_or("no thickness is known anywhere there; choose another isovalue or place")?;
        Ok(Map { surface, mesh, values, statistics, title: self.title, iso: self.iso, transform: self.transform })
    }
}

/// Number of the scan that the map is of, if it is as it was.
fn of_now(map: &Map, work: &Work) -> Option<usize> {
    let is = |volume: &Arc<Volume>| Arc::ptr_eq(volume, &map.surface.volume);
    let index = work.opened.volumes.iter().position(is)?;
    let layer = work.opened.scene.layers.get(index)?;
    (layer.iso == map.iso && layer.transform == map.transform).then_some(index)
}

/// The colours with their millimetres, and above them how much of the surface has each.
fn legend(ui: &mut Ui, coat: &Coat) {
    let (rect, response) = ui.allocate_exact_size(vec2(280.0, 78.0), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Legend of the thickness"));
    let [low, high] = coat.scale.ends_mm;
    let (statistics, painter) = (&coat.map.statistics, ui.painter_at(rect));
    let bar = Rect::from_min_max(rect.min + vec2(12.0, 44.0), rect.max - vec2(24.0, 20.0));
    let [first, last] = statistics.bin_ends_mm;
    let largest = statistics.bins_mm2.iter().fold(f64::MIN_POSITIVE, |m, b| m.max(*b));
    for n in 0..bar.width() as usize {
        let mm = low + (high - low) * (n as f64 + 0.5) / f64::from(bar.width());
        let [r, g, b] = coat.scale.color(mm as f32);
        let x = bar.left() + n as f32;
        let column = |top: f32, bottom: f32| Rect::from_min_max(pos2(x, top), pos2(x + 1.0, bottom));
        painter.rect_filled(column(bar.top(), bar.bottom()), 0.0, Color32::from_rgb(r, g, b));
        let bin = (mm - first) / (last - first).max(f64::MIN_POSITIVE) * statistics.bins_mm2.len() as f64;
        if let Some(area) = statistics.bins_mm2.get(bin as usize).filter(|_| bin >= 0.0) {
            let height = (area / largest) as f32 * 40.0;
            painter.rect_filled(column(bar.top() - 2.0 - height, bar.top() - 2.0), 0.0, Color32::from_gray(150));
        }
    }
    for n in 0..=4 {
        let part = n as f32 / 4.0;
        let text = format!("{:.1}", low + (high - low) * f64::from(part));
        let at = pos2(bar.left() + part * bar.width(), bar.bottom() + 3.0);
        painter.text(
            at,
            Align2::CENTER_TOP,
            if n == 4 { text + " mm" } else { text },
            FontId::proportional(12.0),
            ui.visuals().text_color(),
        );
    }
    response.on_hover_text("Above the colours: how much of the surface is that thick. Grey on the surface: not known, or not asked for.");
}

fn statistics(ui: &mut Ui, statistics: &Statistics) {
    let [least, greatest, p5, p25, median, p75, p95] = statistics.quantiles_mm;
    Grid::new("statistics").spacing([14.0, 2.0]).show(ui, |ui| {
        for (name, text) in [
            ("mean ± deviation", format!("{:.2} ± {:.2} mm", statistics.mean_mm, statistics.deviation_mm)),
            ("median", format!("{median:.2} mm")),
            ("half of the surface", format!("{p25:.2} to {p75:.2} mm")),
            ("90 % of it", format!("{p5:.2} to {p95:.2} mm")),
            ("all", format!("{least:.2} to {greatest:.2} mm")),
            ("area", format!("{:.0} mm²", statistics.area_mm2)),
        ] {
            ui.weak(name);
            ui.label(text);
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::super::files::save_map;
    use super::*;
    use bregma_field::{Grid, Raster, Samples, Unit};
    use bregma_renderer::Shape;
    use glam::DMat3;

    /// A ball of radius 8 mm about (10, 10, 10).
    fn ball() -> Arc<Volume> {
        let grid = Grid::new([21, 21, 21], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        let away = |n: usize| DVec3::new((n % 21) as f64, (n / 21 % 21) as f64, (n / 441) as f64).distance(DVec3::splat(10.0));
        let samples = Samples::F32((0..9261).map(|n| 8.0 - away(n) as f32).collect());
        let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
        Arc::new(Volume::new("ball".into(), "test", raster).unwrap())
    }

    #[test]
    fn a_map_is_of_what_is_asked_and_saved_by_its_name() {
        // Fails if the patch or the cut is ignored or turned round, or a saved map lacks points.
        let order = |clips: Vec<Clip>, patch: Option<(DVec3, f64)>| {
            let (volume, transform, title) = (ball(), DAffine3::IDENTITY, String::new());
            let order = Order { volume, iso: 0.0, transform, clips, index: 0, method: Method::Normal, patch, title };
            order.measure(&Progress::default())
        };
        let whole = order(vec![], None).unwrap();
        let statistics = &whole.statistics;
        assert!((statistics.mean_mm - 16.0).abs() < 0.1 && (statistics.area_mm2 / 804.0 - 1.0).abs() < 0.03, "{statistics:?}");
        // A cap of a sphere: 2πrh, where h = d²/(2r).
        let patch = order(vec![], Some((DVec3::new(10.0, 10.0, 18.0), 5.0))).unwrap().statistics.area_mm2;
        assert!((patch / 78.5 - 1.0).abs() < 0.1, "{patch}");
        let above = Shape::Plane { normal: DVec3::Z, offset_mm: 14.0 };
        let kept = order(vec![Clip::all(above)], None).unwrap().statistics.area_mm2;
        assert!((kept / 603.0 - 1.0).abs() < 0.05, "{kept}");
        assert!(order(vec![], Some((DVec3::ZERO, 1.0))).unwrap_err().contains("no thickness"));

        let folder = std::env::temp_dir().join(format!("bregma-map-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (points, scale) = (whole.mesh.vertices.len(), Scale { colors: Colors::Viridis, ends_mm: [0.0, 16.0] });
        let coat = Coat { map: Arc::new(whole), scale };
        save_map(&folder.join("a.csv"), &coat).unwrap();
        assert_eq!(std::fs::read_to_string(folder.join("a.csv")).unwrap().lines().count(), points + 1);
        save_map(&folder.join("a.PLY"), &coat).unwrap();
        assert!(std::fs::read(folder.join("a.PLY")).unwrap().starts_with(b"ply\n"));
        assert!(save_map(&folder.join("a.stl"), &coat).unwrap_err().contains(".csv or .ply"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
