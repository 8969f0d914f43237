//! The first hits of one layer in a packet, with their normals.
//!
//! The twin of `shaders/trace.wgsl`.

use super::brick::Hit;
use super::cuts::{Kept, kept};
use super::faces::face_of;
use super::gradient::{Around, gradient};
use super::line::{Line, Part};
use super::nearest::Drawn;
use super::packets::Pixels;
use super::rim::rim;
use super::volume::{Field, line_of, toward_viewer, world_line_of};
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Floats, Vecs, axes};
use crate::roots::{Method, spline, voxels};
use crate::scene::{Normals, Scene};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// The hits of one layer in a packet, of those that are nearer than `hits` where only the nearest is drawn.
#[inline(always)]
pub(super) fn trace<S: Simd>(
    simd: S,
    frame: &Frame,
    scene: &Scene,
    layer: &FrameLayer,
    [s_min, s_max]: [f32; 2],
    pixels: &Pixels<S>,
    hits: &[Drawn<S>],
) -> Option<Drawn<S>> {
    if s_min > s_max {
        return None;
    }
    let field = Field::of(layer);
    let lines = line_of(simd, layer, pixels);
    let kept = kept(simd, &layer.placement.surface.region, &world_line_of(simd, frame, pixels));
    let splat = |v| Floats::splat(simd, v);
    let id = splat((layer.placement.index + 1) as f32);
    let face = face_of(simd, frame, layer, &field, &lines, &kept, pixels.inside);
    let mut s_far = splat(s_max).min(kept.end);
    if frame.only_nearest {
        // What lies behind an opaque hit is not asked for.
        for hit in hits {
            s_far = hit.found.select(s_far.min(hit.s), s_far);
        }
    }
    let part = Part { begin: kept.begin, s_min: Floats::splat(simd, s_min), s_max: s_far };
    let found = field.first_hits(simd, Some(frame.method), &lines, &part, pixels.inside & !face.is);
    if !(found.found | face.is).any_true() {
        return None;
    }
    let normal = world_normal(simd, (frame.method, scene.normals), &field, layer, &lines, &found, &kept);
    Some(Drawn {
        found: found.found | face.is,
        s: face.is.select(kept.begin, found.s),
        normal,
        color: axes!(a => splat(layer.appearance.color[a])),
        opacity: splat(layer.appearance.opacity),
        id,
        is_face: face.is,
        brightness: face.brightness(layer),
    })
}

/// Normals in the world that face the viewer, unit; zero where the viewer stands inside bone, or there is no gradient.
#[inline(always)]
fn world_normal<S: Simd>(
    simd: S,
    (method, normals): (Method, Normals),
    field: &Field<'_>,
    layer: &FrameLayer,
    lines: &Line<S>,
    hits: &Hit<S>,
    kept: &Kept<S>,
) -> Vecs<S> {
    let surface = match normals {
        _ if method == Method::Spline => {
            spline::value_and_gradient(simd, &field.source.taps(field.dims, &hits.cell, hits.found), &hits.local).1
        }
        _ if method == Method::Voxels => voxels::normal(simd, &hits.local),
        Normals::Smooth => field.source.smooth_gradient(simd, field.dims, &hits.cell, &hits.local, hits.found, &mut Around::unknown(simd)),
        Normals::Analytic => gradient(&field.corners(simd, &hits.cell, hits.found), &hits.local),
    };
    let direction = axes!(a => lines.direction[a].to_floats());
    let surface = match field.solid {
        Some(solid) => {
            let rim_units = layer.placement.rim_units;
            rim(simd, (solid, rim_units), (&hits.cell, &hits.local), &surface, (&direction, hits.met.solid), hits.found)
        }
        None => surface,
    };
    // Of the box's face: against the ray.
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let is_surface = hits.met.is_isosurface() | hits.met.solid;
    let index = axes!(a => {
        let face = hits.met.face[a].select(one.copysign(-direction[a]), zero);
        is_surface.select(surface[a], face)
    });
    let world = toward_viewer(simd, layer, &index, &direction);
    let cut = hits.met.start & kept.is_cut;
    axes!(a => cut.select(kept.normal[a], hits.met.start.select(zero, world[a])))
}
