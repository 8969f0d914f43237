//! Rays with their stretches of bone, and landmarks, where they lie in a picture. What lies behind bone is thin and dashed, or an empty circle.

use super::beside::{Label, beside};
use super::marks::{Place, Tint};
use super::shapes::{At, Mark, Shape, Stroke};
use super::sheet::Print;
use crate::measurement::{Measurement, RecordedRay};
use crate::opened::Opened;
use crate::record::measure;
use bregma_field::WorldPoint;
use bregma_measure::numbers::fixed;
use bregma_measure::{DifferenceRay, VolumeRecord};
use bregma_renderer::{Camera, Picture, Ray};
use glam::DVec3;

/// Widths of lines, mm.
const RAY_MM: f64 = 0.2;
const BONE_MM: f64 = 0.55;
const HIDDEN_MM: f64 = 0.12;
/// Of dashes and gaps, mm.
const DASH_MM: f64 = 0.6;
/// Radius of a landmark, mm.
const DOT_MM: f64 = 0.55;
/// From point to point where a line is asked whether it is hidden, mm of paper.
const STEP_MM: f64 = 0.2;
/// A stretch shorter than this on paper has no number beside it, mm.
const TOLD_MM: f64 = 5.0;

/// A picture and where it lies.
struct Seen<'a> {
    camera: &'a Camera,
    picture: &'a Picture,
    place: Place,
    /// What lies no farther behind a surface than this is on it, mm.
    near_mm: f64,
    tint: Tint,
}

/// All that was measured.
pub fn marks(opened: &Opened, picture: &Picture, place: Place, print: &Print, tint: Tint) -> Vec<Mark> {
    let spacing = opened.grids().iter().map(|grid| grid.spacing_mm().max_element()).fold(f64::INFINITY, f64::min);
    let camera = &opened.scene.viewed_from();
    let seen = Seen { camera, picture, place, near_mm: 1.5 * spacing, tint };
    let (mut marks, mut labels) = (vec![], vec![]);
    let rays = opened.measurements.iter().filter_map(|measurement| match measurement {
        Measurement::Ray(ray) => Some(&**ray),
        _ => None,
    });
    for (n, recorded) in rays.enumerate() {
        if let Some(ray) = recorded.ray()
            && let Ok(found) = measure(opened, &ray, recorded.is_as_cut())
        {
            seen.ray(&name(recorded, n), &ray, &found, opened, (&mut marks, &mut labels));
        }
    }
    for landmark in &opened.landmarks {
        if let Some(point) = landmark.point_mm {
            seen.landmark(&landmark.name, point, (&mut marks, &mut labels));
        }
    }
    // Words last: they keep clear of all points.
    marks.extend(beside(&labels, place, print.type_mm(), tint));
    marks
}

/// Marks, and the words that are to stand beside points.
type Out<'a> = (&'a mut Vec<Mark>, &'a mut Vec<Label>);

fn name(ray: &RecordedRay, n: usize) -> String {
    ray.name.clone().unwrap_or_else(|| format!("Ray {}", n + 1))
}

impl Seen<'_> {
    fn pixels_per_mm(&self) -> f64 {
        f64::from(self.picture.width) / self.place.size[0]
    }

    /// Where a point is on the paper, and whether bone hides it; nowhere behind the eye or beside the picture.
    fn at(&self, point: DVec3) -> Option<(At, bool)> {
        let (width, height) = (self.picture.width, self.picture.height);
        let (x, y) = self.camera.project(WorldPoint(point), width, height)?;
        let inside = (-0.5..f64::from(width) - 0.5).contains(&x) && (-0.5..f64::from(height) - 0.5).contains(&y);
        if !inside {
            return None;
        }
        let ray = self.camera.ray(x, y, width, height);
        let depth_mm = (point - ray.origin.0).dot(ray.direction);
        let pixel = (y.round() as usize).min(height as usize - 1) * width as usize + (x.round() as usize).min(width as usize - 1);
        let surface_mm = f64::from(self.picture.depth_mm[pixel]);
        let on = [x, y].map(|px| (px + 0.5) / self.pixels_per_mm());
        // Where nothing is hit the surface is at NaN, which hides nothing.
        Some(([self.place.at[0] + on[0], self.place.at[1] + on[1]], surface_mm + self.near_mm < depth_mm))
    }

    /// A stretch in pieces that are seen or hidden throughout.
    fn pieces(&self, ends: [DVec3; 2]) -> Vec<(Vec<At>, bool)> {
        let paper = |p: DVec3| self.camera.project(WorldPoint(p), self.picture.width, self.picture.height);
        let length_px = match ends.map(paper) {
            [Some((ax, ay)), Some((bx, by))] => (bx - ax).hypot(by - ay),
            _ => 0.0,
        };
        // One that leaves the picture far is looked at in so many points.
        let steps = (length_px / self.pixels_per_mm() / STEP_MM).ceil().clamp(1.0, 4000.0) as usize;
        let mut pieces: Vec<(Vec<At>, bool)> = vec![];
        let mut is_broken = true;
        for n in 0..=steps {
            match self.at(ends[0].lerp(ends[1], n as f64 / steps as f64)) {
                None => is_broken = true,
                Some((p, hidden)) => {
                    match pieces.last_mut() {
                        Some((points, is_hidden)) if !is_broken => {
                            points.push(p);
                            if *is_hidden != hidden {
                                pieces.push((vec![p], hidden));
                            }
                        }
                        _ => pieces.push((vec![p], hidden)),
                    }
                    is_broken = false;
                }
            }
        }
        pieces.retain(|(points, _)| points.len() > 1);
        pieces
    }

    /// A stretch, with a halo where it is seen.
    fn line(&self, ends: [DVec3; 2], color: [u8; 3], width_mm: f64) -> Vec<Shape> {
        let of = |(points, hidden): (Vec<At>, bool)| {
            if hidden {
                let dashed = Stroke { dash_mm: Some(DASH_MM), ..Stroke::new(self.tint.ink, HIDDEN_MM) };
                return vec![Shape::line(&points, Stroke::new(self.tint.halo, 3.0 * HIDDEN_MM)), Shape::line(&points, dashed)];
            }
            let ends = [points[0], points[points.len() - 1]];
            [(self.tint.halo, width_mm + 0.3), (color, width_mm)].map(|(color, width)| Shape::line(&ends, Stroke::new(color, width))).into()
        };
        self.pieces(ends).into_iter().flat_map(of).collect()
    }

    fn ray(&self, name: &str, ray: &Ray, found: &DifferenceRay, opened: &Opened, (marks, labels): Out<'_>) {
        let (Some(first), Some(last)) = (found.ledger.first(), found.ledger.last()) else { return };
        let at = |t: f64| ray.at(t).0;
        let paper_mm = |a: f64, b: f64| match [a, b].map(|t| self.camera.project(ray.at(t), self.picture.width, self.picture.height)) {
            [Some((ax, ay)), Some((bx, by))] => (bx - ax).hypot(by - ay) / self.pixels_per_mm(),
            _ => 0.0,
        };
        let is_end_on = paper_mm(first.from_mm, last.to_mm) < TOLD_MM;
        let segments: Vec<_> = found.volumes.iter().flat_map(|volume| volume.segments.iter().map(move |s| (volume, s))).collect();
        let enter = segments.iter().map(|(_, s)| s.from_mm).fold(f64::INFINITY, f64::min);
        let mut shapes = if is_end_on { vec![] } else { self.line([at(first.from_mm), at(last.to_mm)], self.tint.ink, RAY_MM) };
        let mut told = vec![];
        let many = found.volumes.len() > 1;
        for (volume, segment) in &segments {
            let color = opened.scene.layers.get(volume.index).map_or(self.tint.ink, |layer| layer.color.bytes());
            let length = format!("{} mm", fixed(segment.length_mm, 2));
            if paper_mm(segment.from_mm, segment.to_mm) > TOLD_MM {
                shapes.extend(self.line([at(segment.from_mm), at(segment.to_mm)], color, BONE_MM));
                let words = if many { format!("{} {length}", volume.name) } else { length };
                told.push((at(0.5 * (segment.from_mm + segment.to_mm)), vec![words]));
            } else if !is_end_on {
                shapes.extend(self.line([at(segment.from_mm), at(segment.to_mm)], color, BONE_MM));
            }
        }
        if told.is_empty() && enter.is_finite() {
            told.push((at(enter), short(name, found)));
        }
        if let Some((p, hidden)) = self.at(at(if enter.is_finite() { enter } else { first.from_mm })) {
            shapes.extend(self.dot(p, hidden));
        }
        marks.push(Mark { words: name.to_owned(), shapes });
        labels.extend(told.into_iter().filter_map(|(point, lines)| Some(Label { at: self.at(point)?.0, lines })));
    }

    fn landmark(&self, name: &str, point: DVec3, (marks, labels): Out<'_>) {
        let Some((p, hidden)) = self.at(point) else { return };
        marks.push(Mark { words: format!("landmark {name}"), shapes: self.dot(p, hidden) });
        labels.push(Label { at: p, lines: vec![name.to_owned()] });
    }

    /// A point: filled where it is seen, an empty circle behind bone.
    fn dot(&self, p: At, hidden: bool) -> Vec<Shape> {
        let edge = Some(Stroke::new(self.tint.halo, 0.3));
        let ring = Some(Stroke::new(self.tint.ink, HIDDEN_MM));
        if hidden {
            vec![Shape::circle(p, DOT_MM, None, edge), Shape::circle(p, DOT_MM, None, ring)]
        } else {
            vec![Shape::circle(p, DOT_MM, Some(self.tint.ink), edge), Shape::circle(p, DOT_MM, Some(self.tint.ink), None)]
        }
    }
}

/// A ray whose stretches are too short to be told beside them: what it measured of each scan, in lines.
fn short(name: &str, found: &DifferenceRay) -> Vec<String> {
    let lengths = |volume: &VolumeRecord| volume.segments.iter().map(|s| fixed(s.length_mm, 2)).collect::<Vec<_>>().join(" + ");
    let with_bone = found.volumes.iter().filter(|volume| !volume.segments.is_empty());
    let many = found.volumes.len() > 1;
    let of =
        |volume: &VolumeRecord| if many { format!("{} {} mm", volume.name, lengths(volume)) } else { format!("{} mm", lengths(volume)) };
    std::iter::once(name.to_owned()).chain(with_bone.map(of)).collect()
}
