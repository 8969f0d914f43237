//! Marks as pixels over a picture.

use super::shapes::{Mark, Step, Stroke};
use fast_srgb8::srgb8_to_f32;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use tiny_skia::{FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, StrokeDash, Transform};

/// Draws marks over light (linear, premultiplied, rows of `width` from the top), edges by how much of a pixel they cover.
pub fn paint(marks: &[Mark], px_per_mm: f64, [width, height]: [u32; 2], light: &mut [Vec4]) {
    // There is no such picture.
    let Some(mut pixmap) = Pixmap::new(width, height) else { return };
    for shape in marks.iter().flat_map(|mark| &mark.shapes) {
        let Some(path) = path(&shape.steps, px_per_mm) else { continue };
        if let Some(color) = shape.fill {
            pixmap.fill_path(&path, &inked(color), FillRule::Winding, Transform::identity(), None);
        }
        if let Some(stroke) = shape.stroke {
            pixmap.stroke_path(&path, &inked(stroke.color), &pen(stroke, px_per_mm), Transform::identity(), None);
        }
    }
    light.par_iter_mut().zip(pixmap.pixels()).filter(|(_, ink)| ink.alpha() > 0).for_each(|(pixel, ink)| {
        let straight = ink.demultiply();
        let color = Vec3::new(srgb8_to_f32(straight.red()), srgb8_to_f32(straight.green()), srgb8_to_f32(straight.blue()));
        let alpha = f32::from(ink.alpha()) / 255.0;
        *pixel = (color * alpha).extend(alpha) + *pixel * (1.0 - alpha);
    });
}

fn inked(color: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(color[0], color[1], color[2], 255);
    paint
}

fn pen(stroke: Stroke, px_per_mm: f64) -> tiny_skia::Stroke {
    let px = |mm: f64| (mm * px_per_mm) as f32;
    tiny_skia::Stroke {
        width: px(stroke.width_mm),
        line_cap: if stroke.dash_mm.is_some() { LineCap::Butt } else { LineCap::Round },
        line_join: LineJoin::Round,
        dash: stroke.dash_mm.and_then(|mm| StrokeDash::new(vec![px(mm), px(mm)], 0.0)),
        ..tiny_skia::Stroke::default()
    }
}

fn path(steps: &[Step], px_per_mm: f64) -> Option<Path> {
    let px = |p: [f64; 2]| p.map(|mm| (mm * px_per_mm) as f32);
    let mut path = PathBuilder::new();
    for step in steps {
        match *step {
            Step::Move(p) => {
                let [x, y] = px(p);
                path.move_to(x, y);
            }
            Step::Line(p) => {
                let [x, y] = px(p);
                path.line_to(x, y);
            }
            Step::Quad(a, p) => {
                let ([ax, ay], [x, y]) = (px(a), px(p));
                path.quad_to(ax, ay, x, y);
            }
            Step::Cubic(a, b, p) => {
                let ([ax, ay], [bx, by], [x, y]) = (px(a), px(b), px(p));
                path.cubic_to(ax, ay, bx, by, x, y);
            }
            Step::Close => path.close(),
        }
    }
    path.finish()
}
