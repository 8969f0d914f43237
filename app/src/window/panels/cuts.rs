//! The cuts: which there are, what they cut, and where they lie by numbers.

use super::super::measured::Work;
use super::super::picture::solid_handles::LEAST_MM;
use super::super::widgets::{self, elided, line, vector};
use super::look;
use bregma_field::{Unit, Volume};
use bregma_renderer::{Bounds, Camera, Clip, CutFace, Mode, Scene, Shape, Window};
use bregma_session::views::anatomical;
use egui::{Align, CollapsingHeader, DragValue, Frame, Grid, Layout, RichText, Slider, Ui};
use glam::DVec3;
use std::sync::Arc;

/// What a cut or a slice shows of values, its name, and what that is.
pub const FACES: [(CutFace, &str, &str); 5] = [
    (CutFace::Bone, "Bone", "The bone's section in its colour; nothing of what is not bone"),
    (CutFace::Density, "Density", "All values as grey, as on a CT slice"),
    (CutFace::Blend, "Blend", "All scans' values, each in its colour, added: where they agree it is white"),
    (
        CutFace::Difference,
        "Difference",
        "The first scan's values less the second's: red where the first is denser, blue where the second is",
    ),
    (CutFace::Transfer, "Volume's", "Values in the colours that Volume gives them, on black as far as they are clear"),
];

/// The planes through the middle, with what they cut away: what lies to the left, before, and above.
const PLANES: [(&str, DVec3); 3] = [("Sagittal", DVec3::X), ("Coronal", DVec3::NEG_Y), ("Axial", DVec3::Z)];

/// Shows the cuts and applies what the person changes.
pub fn show(ui: &mut Ui, work: &mut Work) {
    let count = work.opened.scene.clips.len();
    let title = if count == 0 { "Cuts".to_owned() } else { format!("Cuts ({count})") };
    CollapsingHeader::new(title).id_salt("cuts").show(ui, |ui| {
        let bounds = work.opened.bounds();
        add(ui, work, &bounds);
        let scene = &mut work.opened.scene;
        let mut removed = None;
        for (n, clip) in scene.clips.iter_mut().enumerate() {
            ui.push_id(n, |ui| {
                Frame::group(ui.style()).fill(ui.visuals().faint_bg_color).show(ui, |ui| {
                    ui.set_width(ui.available_width());
                    if cut(ui, n + 1, clip, &work.opened.volumes, &bounds) {
                        removed = Some(n);
                    }
                });
            });
        }
        if let Some(n) = removed {
            scene.clips.remove(n);
        }
        if scene.has_cut_faces() {
            face(ui, scene, &work.opened.volumes);
        }
    });
}

fn plane(normal: DVec3, at: DVec3) -> Clip {
    Clip::all(Shape::Plane { normal, offset_mm: normal.dot(at) })
}

fn add(ui: &mut Ui, work: &mut Work, bounds: &Bounds) {
    let scene = &mut work.opened.scene;
    ui.horizontal_wrapped(|ui| {
        for (name, normal) in PLANES {
            let hint = format!("Cuts away what lies {} of the middle", anatomical(normal));
            if ui.button(name).on_hover_text(hint).clicked() {
                scene.clips.push(plane(normal, bounds.centre_mm));
            }
        }
        if ui.button("Box").on_hover_text("Keeps a box along the axes of the patient, such as without the table").clicked() {
            let (low_mm, high_mm) = inner_box(scene, &work.opened.volumes, bounds);
            scene.clips.push(Clip::all(Shape::Box { low_mm, high_mm }));
        }
        if ui.button("Cylinder").on_hover_text("Keeps a cylinder along the body's axis, such as without the tube of the scanner").clicked()
        {
            let (low, high) = inner_box(scene, &work.opened.volumes, bounds);
            let radius_mm = (high - low).truncate().max_element() / 2.0;
            scene.clips.push(Clip::all(Shape::Cylinder { centre_mm: bounds.centre_mm, axis: DVec3::Z, radius_mm }));
        }
        if ui.button("Sphere").on_hover_text("Keeps a ball, such as what lies around a joint").clicked() {
            let (low, high) = inner_box(scene, &work.opened.volumes, bounds);
            let radius_mm = (high - low).min_element() / 2.0;
            scene.clips.push(Clip::all(Shape::Sphere { centre_mm: bounds.centre_mm, radius_mm }));
        }
        let last: Vec<DVec3> =
            work.measured.landmarks.iter().rev().filter_map(|l| l.point_mm).take(3).collect::<Vec<_>>().into_iter().rev().collect();
        let through = <[DVec3; 3]>::try_from(last).ok().and_then(Clip::through);
        let hint = "The plane through the last three landmarks, such as nasion, bregma and inion for the mid-sagittal one";
        let button = ui.add_enabled(through.is_some(), egui::Button::new("Through three landmarks"));
        let button = button.on_hover_text(hint).on_disabled_hover_text(format!("{hint}; set three that do not lie on a line first"));
        if let (true, Some(clip)) = (button.clicked(), through) {
            scene.clips.push(clip);
        }
        let hint = "The density on an axial cut, and the volume behind it";
        if ui.button("Slice view").on_hover_text(hint).clicked() {
            slice_view(scene, bounds);
        }
    });
}

/// Direct volume rendering behind a plane whose face is the slice, seen obliquely from above.
fn slice_view(scene: &mut Scene, bounds: &Bounds) {
    (scene.mode, scene.cut_face) = (Mode::Dvr, CutFace::Density);
    if !scene.clips.iter().any(|clip| clip.enabled && matches!(clip.shape, Shape::Plane { .. })) {
        scene.clips.push(plane(DVec3::Z, bounds.centre_mm));
    }
    scene.camera = Camera::orbit(bounds, 0.0, 60.0);
}

/// The box of the visible volumes, a tenth smaller, so that it is seen to cut.
fn inner_box(scene: &Scene, volumes: &[Arc<Volume>], bounds: &Bounds) -> (DVec3, DVec3) {
    let surfaces = scene.surfaces(volumes).unwrap_or_default();
    let half = surfaces
        .iter()
        .flat_map(|(_, s)| s.grid.corners_mm())
        .fold(DVec3::splat(1e-3), |half, corner| half.max((corner - bounds.centre_mm).abs()));
    ((bounds.centre_mm - 0.9 * half).floor(), (bounds.centre_mm + 0.9 * half).ceil())
}

fn title(shape: &Shape) -> String {
    match shape {
        Shape::Plane { normal, .. } => {
            let along = PLANES.iter().find(|(_, axis)| axis.dot(*normal).abs() > 1.0 - 1e-9);
            format!("{}, {} cut away", along.map_or("Plane", |(name, _)| name), anatomical(*normal))
        }
        Shape::Box { .. } => "Box".into(),
        Shape::Cylinder { .. } => "Cylinder".into(),
        Shape::Sphere { .. } => "Sphere".into(),
    }
}

/// One cut. True when it should be removed.
fn cut(ui: &mut Ui, number: usize, clip: &mut Clip, volumes: &[Arc<Volume>], bounds: &Bounds) -> bool {
    let removed = line(ui, |ui| {
        let remove = ui.small_button("×").on_hover_text("Remove").accessible_name(format!("Remove cut {number}")).clicked();
        if let Shape::Plane { normal, offset_mm } = &mut clip.shape
            && ui.small_button("Flip").on_hover_text("Cut away the other side").accessible_name(format!("Flip cut {number}")).clicked()
        {
            (*normal, *offset_mm) = (-*normal, -*offset_mm);
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            ui.checkbox(&mut clip.enabled, "").on_hover_text("Cut").accessible_name(format!("Cut {number} cuts"));
            ui.label(RichText::new(format!("{number}  {}", title(&clip.shape))).strong());
        });
        remove
    });
    if volumes.len() > 1 {
        which(ui, number, clip, volumes);
    }
    match &mut clip.shape {
        Shape::Plane { normal, offset_mm } => {
            let middle = normal.dot(bounds.centre_mm);
            let range = middle - bounds.radius_mm..=middle + bounds.radius_mm;
            ui.spacing_mut().slider_width = ui.available_width() - 110.0;
            let slider = Slider::new(offset_mm, range).clamping(egui::SliderClamping::Edits).max_decimals(2).suffix(" mm");
            let slider = slider.custom_formatter(widgets::number);
            ui.add(slider.update_while_editing(false))
                .on_hover_text("How far the plane lies along its normal from the origin of the scan's coordinates")
                .accessible_name(format!("Offset of cut {number}"));
            let mut turned = *normal;
            vector(ui, "Normal", &format!("normal of cut {number}"), &mut turned, 0.01);
            if let (true, Some(unit)) = (turned != *normal, turned.try_normalize()) {
                // It turns about the point of it that is nearest to the middle.
                let pivot = bounds.centre_mm + (*offset_mm - middle) * *normal;
                (*normal, *offset_mm) = (unit, unit.dot(pivot));
            }
        }
        Shape::Box { low_mm, high_mm } => {
            let (mut low, mut high) = (*low_mm, *high_mm);
            vector(ui, "From, mm", &format!("low corner of cut {number}"), &mut low, 0.5);
            vector(ui, "To, mm", &format!("high corner of cut {number}"), &mut high, 0.5);
            if low.cmplt(high).all() {
                (*low_mm, *high_mm) = (low, high);
            }
        }
        Shape::Cylinder { centre_mm, axis, radius_mm } => {
            vector(ui, "Centre, mm", &format!("centre of cut {number}"), centre_mm, 0.5);
            let mut turned = *axis;
            vector(ui, "Axis", &format!("axis of cut {number}"), &mut turned, 0.01);
            *axis = if turned == *axis { *axis } else { turned.try_normalize().unwrap_or(*axis) };
            radius(ui, number, radius_mm);
        }
        Shape::Sphere { centre_mm, radius_mm } => {
            vector(ui, "Centre, mm", &format!("centre of cut {number}"), centre_mm, 0.5);
            radius(ui, number, radius_mm);
        }
    }
    removed
}

fn radius(ui: &mut Ui, number: usize, radius_mm: &mut f64) {
    ui.horizontal(|ui| {
        ui.weak("Radius");
        let radius = DragValue::new(radius_mm).range(LEAST_MM..=1e5).speed(0.5).max_decimals(2).suffix(" mm");
        ui.add(radius.update_while_editing(false)).accessible_name(format!("Radius of cut {number}"));
    });
}

/// Which volumes it cuts.
fn which(ui: &mut Ui, number: usize, clip: &mut Clip, volumes: &[Arc<Volume>]) {
    ui.vertical(|ui| {
        for (n, volume) in volumes.iter().enumerate() {
            let mut cuts = clip.layers.as_ref().is_none_or(|layers| layers.contains(&n));
            let name = format!("Cut {number} cuts {}", volume.name());
            let text = elided(ui, volume.name(), ui.available_width() - 30.0);
            if ui.checkbox(&mut cuts, text).on_hover_text(format!("Whether {} is cut", volume.name())).accessible_name(name).changed() {
                let mut layers: Vec<usize> = clip.layers.take().unwrap_or_else(|| (0..volumes.len()).collect());
                layers.retain(|layer| *layer != n);
                layers.extend(cuts.then_some(n));
                layers.sort_unstable();
                clip.layers = (layers.len() < volumes.len()).then_some(layers);
            }
        }
    });
}

fn face(ui: &mut Ui, scene: &mut Scene, volumes: &[Arc<Volume>]) {
    ui.weak("The cut shows");
    Grid::new("faces").spacing([6.0, 2.0]).show(ui, |ui| {
        ui.spacing_mut().icon_spacing = 2.0;
        for row in FACES.chunks(3) {
            for &(face, name, what) in row {
                ui.radio_value(&mut scene.cut_face, face, name).on_hover_text(what);
            }
            ui.end_row();
        }
    });
    if !matches!(scene.cut_face, CutFace::Bone | CutFace::Transfer) {
        look::window(ui, &mut scene.window, || match volumes.first() {
            Some(volume) if volume.unit() != Unit::Hounsfield => Window::between(volume.range()),
            // Bone and what lies around it.
            _ => Window { width: 1000.0, level: 400.0 },
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_named_as_anatomists_do() {
        let named = |normal: DVec3| title(&plane(normal, DVec3::ZERO).shape);
        assert_eq!(named(DVec3::X), "Sagittal, L cut away");
        assert_eq!(named(DVec3::Y), "Coronal, P cut away");
        assert_eq!(named(DVec3::new(1.0, 0.0, 1.0).normalize()), "Plane, LS cut away");
    }
}
