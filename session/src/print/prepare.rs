//! Cameras for paper: what is seen of the skull, how large, and where on the sheet.

use super::PrintError;
use super::legend::Legend;
use super::marks::following;
use super::sheet::{AUTO, Layout, Print, norma, ratio};
use crate::coat::Coat;
use crate::opened::Opened;
use crate::views::{View, extent_mm, looking_at};
use bregma_field::Unit;
use bregma_measure::numbers::significant;
use bregma_renderer::{CpuRenderer, Projection, Reconstruction, Renderer, Scene};
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// A view that is to be aimed so that it fills its room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// The view.
    pub view: View,
    /// Turns the world so that the skull is in the Frankfurt horizontal.
    pub frankfurt: Option<DAffine3>,
    /// In perspective of so many degrees, instead of along parallel rays.
    pub fov_deg: Option<f64>,
}

/// A picture of a sheet.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What it shows; its scene's camera is where it is seen from.
    pub opened: Opened,
    /// How it is aimed first.
    pub aim: Option<Aim>,
    /// Colours that the surface wears; the scene is drawn for them.
    pub coat: Option<Arc<dyn Coat>>,
}

/// Aims the cameras, sets their scale and writes the caption. Gives what the person should know.
pub fn prepare(panels: &mut [Panel], print: &mut Print) -> Result<Vec<String>, PrintError> {
    let is_perspective = |panel: &Panel| match panel.aim {
        Some(aim) => aim.fov_deg.is_some(),
        None => matches!(panel.opened.scene.viewed_from().projection, Projection::Perspective { .. }),
    };
    if panels.iter().any(is_perspective) && (print.scale.is_some() || panels.len() > 1) {
        return Err(if print.scale.is_some() { PrintError::ScaleInPerspective } else { PrintError::PlateInPerspective });
    }
    let points = |panel: &Panel| if panel.aim.is_some() { panel.opened.bone_points_mm() } else { vec![] };
    let points: Vec<Vec<DVec3>> = panels.iter().map(points).collect();
    if print.caption.as_deref() == Some(AUTO) {
        print.caption = Some(caption(panels, print));
    }
    let layout = Layout::new(print, panels.len(), legend_mm(panels, print)?)?;
    let mut warnings = aim(panels, &points, print, &layout);
    if print.marks && panels.iter().all(|panel| panel.opened.measurements.is_empty() && panel.opened.landmarks.is_empty()) {
        warnings.push("there are no rays and no landmarks to be marked; name the session that has them, or a file of landmarks".into());
    }
    if let Some(panel) = panels.iter().find(|panel| panel.aim.is_some_and(|aim| aim.frankfurt.is_none())) {
        let names = panel.opened.volumes.first().map_or("the scan", |volume| volume.name());
        warnings.push(format!("{names}: the view is along the scan's own axes; --frankfurt holds the skull by its landmarks"));
    }
    Ok(warnings)
}

/// Millimetres of the world on a millimetre of paper, of a picture alone on its sheet; `None` in perspective, or where there is no room for it.
pub fn scale_of(panel: &Panel, print: &Print) -> Option<f64> {
    let Projection::Orthographic { height_mm } = panel.opened.scene.viewed_from().projection else { return None };
    let layout = Layout::new(print, 1, legend_mm(std::slice::from_ref(panel), print).ok()?).ok()?;
    Some(height_mm * print.px_per_mm() / f64::from(layout.cells[0].1[1]))
}

/// What the colours of a picture mean: those of the map that its surface wears, or of its mode.
pub(super) fn legend(panel: &Panel) -> Result<Legend, PrintError> {
    panel.coat.as_ref().map_or_else(|| Legend::of(&panel.opened), |coat| Ok(coat.legend()))
}

/// Height of the strip that tells what colours mean, mm: the first picture's.
pub(super) fn legend_mm(panels: &[Panel], print: &Print) -> Result<f64, PrintError> {
    match panels.first().filter(|_| print.legend) {
        Some(panel) => Ok(legend(panel)?.height_mm(print)),
        None => Ok(0.0),
    }
}

/// Aims all cameras at one scale: what is asked for, or the largest that holds all that is aimed.
fn aim(panels: &mut [Panel], points: &[Vec<DVec3>], print: &Print, layout: &Layout) -> Vec<String> {
    let mm = 1.0 / print.px_per_mm();
    let [left, top, right, bottom] = print.insets_mm();
    let cell = layout.cells[0].1.map(|px| f64::from(px) * mm);
    let inner = [cell[0] - left - right, cell[1] - top - bottom];
    for (panel, points) in panels.iter_mut().zip(points) {
        if let Some(Aim { view, frankfurt, fov_deg }) = panel.aim {
            let (bounds, held) = (panel.opened.bounds(), frankfurt.unwrap_or(DAffine3::IDENTITY));
            panel.opened.scene.camera = view.camera(points, &bounds, fov_deg, cell[0] / cell[1], &held);
        }
    }
    let extents: Vec<_> = panels.iter().zip(points).map(|(panel, points)| seen_mm(panel, points)).collect();
    let needs = |n: usize| -> Option<f64> {
        let panel: &Panel = &panels[n];
        let Projection::Orthographic { height_mm } = panel.opened.scene.viewed_from().projection else { return None };
        match extents[n] {
            Some(reach) => Some((0..2).map(|a| (reach[a][1] - reach[a][0]) / inner[a]).fold(0.0, f64::max)),
            // One that is aimed already keeps its height, unless another of the plate needs more.
            None => Some(height_mm / cell[1]),
        }
    };
    let Some(scale) = print.scale.or_else(|| (0..panels.len()).filter_map(needs).reduce(f64::max)) else { return vec![] };
    let mut warnings = vec![];
    for (panel, reach) in panels.iter_mut().zip(&extents) {
        let camera = panel.opened.scene.viewed_from();
        if matches!(camera.projection, Projection::Perspective { .. }) {
            continue;
        }
        let mut to = [0.0; 2];
        if let Some(reach) = reach {
            // The skull lies in the middle of the room that marks leave.
            let off = [0.5 * (left - right), 0.5 * (top - bottom)];
            to = [0.5 * (reach[0][0] + reach[0][1]) - off[0] * scale, 0.5 * (reach[1][0] + reach[1][1]) + off[1] * scale];
            let needed = [0, 1].map(|a| (reach[a][1] - reach[a][0]) / scale);
            if (0..2).any(|a| needed[a] > cell[a] + 0.05) {
                warnings.push(format!(
                    "at {} the skull takes {:.0} × {:.0} mm of paper, and {:.0} × {:.0} mm are there: its rim is cut off",
                    ratio(scale),
                    needed[0],
                    needed[1],
                    cell[0],
                    cell[1]
                ));
            }
        }
        panel.opened.scene.camera = looking_at(&camera, to, scale * cell[1]);
    }
    warnings
}

/// How far what is seen reaches to the right and up from the target of a camera that is aimed along parallel rays, mm: as a small picture shows it
/// within what `points` say, which lie around the surface by up to a block of samples.
fn seen_mm(panel: &Panel, points: &[DVec3]) -> Option<[[f64; 2]; 2]> {
    let Panel { opened, aim: Some(Aim { fov_deg: None, .. }), .. } = panel else { return None };
    let camera = opened.scene.viewed_from();
    let [across, upward] = extent_mm(&camera, points)?;
    let middle = [across, upward].map(|[low, high]| 0.5 * (low + high));
    let side_mm = (across[1] - across[0]).max(upward[1] - upward[0]);
    let scene = Scene { camera: looking_at(&camera, middle, side_mm), background: None, ..opened.scene.clone() };
    let small = CpuRenderer::default().render(&opened.volumes, &scene, SMALL, SMALL).ok()?;
    let pixel_mm = side_mm / f64::from(SMALL);
    let mut seen = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for n in (0..small.volume_id.len()).filter(|n| small.volume_id[*n] > 0) {
        let [x, y] = [n as u32 % SMALL, n as u32 / SMALL].map(f64::from);
        // The edges of the pixel, from the middle of the picture.
        let half = f64::from(SMALL) / 2.0;
        let edges = [[x - half, x + 1.0 - half], [half - y - 1.0, half - y]];
        for axis in 0..2 {
            seen[axis][0] = seen[axis][0].min(middle[axis] + pixel_mm * edges[axis][0]);
            seen[axis][1] = seen[axis][1].max(middle[axis] + pixel_mm * edges[axis][1]);
        }
    }
    // Modes that draw no surface number nothing.
    Some(if seen[0][0] < seen[0][1] { seen } else { [across, upward] })
}

/// Pixels along a side of the picture that tells where the bone is: a 500th of it is less than the margin beside it.
const SMALL: u32 = 512;

/// What is shown, in a sentence.
fn caption(panels: &[Panel], print: &Print) -> String {
    let Some(first) = panels.first() else { return String::new() };
    let (opened, scene) = (&first.opened, &first.opened.scene);
    let seen = opened.volumes.iter().zip(&scene.layers).filter(|(_, layer)| layer.visible);
    let names: Vec<String> = seen
        .map(|(volume, layer)| {
            let unit = if volume.unit() == Unit::Hounsfield { " HU" } else { "" };
            format!("{} ({}{unit})", volume.name(), significant(layer.iso, 6))
        })
        .collect();
    let names = match names.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        Some((last, _)) => last.clone(),
        None => "nothing".into(),
    };
    let view = |(n, panel): (usize, &Panel)| {
        let view = norma(panel.aim?.view);
        let label = print.label.as_ref().filter(|_| panels.len() > 1);
        Some(label.map_or(view.to_owned(), |label| format!("({}) {view}", following(label, n))))
    };
    let views: Vec<String> = panels.iter().enumerate().filter_map(view).collect();
    let mut parts = vec![format!("{} of {names}", scene.mode.facts().title)];
    if !views.is_empty() {
        let held =
            if first.aim.is_some_and(|aim| aim.frankfurt.is_some()) { " in the Frankfurt horizontal" } else { " along the scan's axes" };
        parts.push(views.join(", ") + held);
    }
    // What is aimed is seen along parallel rays, whatever the scene's camera was.
    let projection = match first.aim {
        Some(Aim { fov_deg: Some(fov_deg), .. }) => Projection::Perspective { fov_deg },
        Some(_) => Projection::Orthographic { height_mm: 1.0 },
        None => scene.viewed_from().projection,
    };
    parts.push(seen_along(projection, print));
    match scene.reconstruction {
        Reconstruction::Trilinear => {}
        Reconstruction::Spline => parts.push("smoothed by a tricubic B-spline through the samples".into()),
        Reconstruction::Nearest => parts.push("samples as boxes".into()),
    }
    match &scene.studio {
        Some(studio) if studio.smooth_voxel > 0.0 => {
            parts.push(format!("studio light on samples smoothed by {} voxel, not the measured surface", studio.smooth_voxel));
        }
        Some(_) => parts.push("studio light".into()),
        None => {}
    }
    if scene.clips.iter().any(|clip| clip.enabled) {
        parts.push("partly cut away".into());
    }
    parts.join(", ") + "."
}

/// A scale in words only where it was asked for: a fitted one depends on the room that these words leave, and the bar tells it.
fn seen_along(projection: Projection, print: &Print) -> String {
    match (projection, print.scale) {
        (Projection::Perspective { fov_deg }, _) => format!("in perspective of {fov_deg}°"),
        (Projection::Orthographic { .. }, Some(scale)) => format!("parallel projection at {}", ratio(scale)),
        (Projection::Orthographic { .. }, None) => "parallel projection".into(),
    }
}
