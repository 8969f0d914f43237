//! The faces of cuts that show values.
//!
//! The twin of `shaders/faces.wgsl`.

use super::cuts::{Kept, kept};
use super::light::{color_of_faces, grey};
use super::line::Line;
use super::nearest::Drawn;
use super::ray::View;
use super::volume::{Field, world_line_of};
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Doubles, Floats, Ints, Mask, axes};
use crate::roots::{Method, spline, trilinear, voxels};
use crate::scene::CutFace;
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{Vec3, Vec4};

/// A cut may lie in the box's own face: so far beside it, which is more than rounding and less than a pixel shows, it is in the volume.
pub(crate) const ON_FACE_VOXEL: f32 = 1e-3;

/// Where cuts show the values of a volume.
pub(super) struct Face<S: Simd> {
    pub is: Mask<S>,
    /// Relative to the level, positive inside.
    pub value: Floats<S>,
}

impl<S: Simd> Face<S> {
    /// What is seen of them, by the window.
    #[inline(always)]
    pub fn brightness(&self, layer: &FrameLayer) -> Floats<S> {
        let [gain, offset] = layer.appearance.brightness;
        self.value * gain + offset
    }
}

/// The faces of a layer where rays begin at a cut within its box.
#[inline(always)]
pub(super) fn face_of<S: Simd>(
    simd: S,
    frame: &Frame,
    layer: &FrameLayer,
    field: &Field<'_>,
    lines: &Line<S>,
    kept: &Kept<S>,
    of: Mask<S>,
) -> Face<S> {
    let none = Face { is: Mask::splat(simd, false), value: Floats::splat(simd, 0.0) };
    if !layer.appearance.shows_faces || layer.placement.surface.grid.is_flat() {
        return none;
    }
    simd.vectorize(
        #[inline(always)]
        || {
            let at = lines.at(kept.begin);
            let p = axes!(a => at[a].to_floats());
            let dims = field.dims;
            let within = axes!(a => p[a].simd_ge(-ON_FACE_VOXEL) & p[a].simd_le((dims[a] - 1) as f32 + ON_FACE_VOXEL));
            let is = of & kept.is_cut & kept.begin.simd_le(kept.end) & within[0] & within[1] & within[2];
            if !is.any_true() {
                return none;
            }
            let cell = axes!(a => p[a].floor().to_int::<Ints<S>>().max(0).min(dims[a] - 2));
            let local = axes!(a => (at[a] - Doubles::of(cell[a].to_float())).to_floats().max(0.0).min(1.0));
            let value = match frame.method {
                Method::Spline => {
                    let (value, _) = spline::value_and_gradient(simd, &field.source.taps(dims, &cell, is), &local);
                    field.sign * (value - field.level)
                }
                Method::Voxels => voxels::value(&field.corners(simd, &cell, is), &local),
                Method::Solver(_) => trilinear(&field.corners(simd, &cell, is), &local),
            };
            Face { is, value }
        },
    )
}

/// The faces of cuts that show values: of all volumes, of which those are found that a transfer function or a surface makes visible there.
#[inline(always)]
pub(super) fn faces<S: Simd>(simd: S, view: &View<'_, S>, lines: &[Line<S>]) -> Vec<Drawn<S>> {
    let View { frame, pixels, .. } = *view;
    let mut faces = vec![];
    for (layer, lines) in frame.layers.iter().zip(lines).filter(|(layer, _)| layer.appearance.shows_faces) {
        let field = Field::of(layer);
        let kept = kept(simd, &layer.placement.surface.region, &world_line_of(simd, frame, pixels));
        let face = face_of(simd, frame, layer, &field, lines, &kept, pixels.inside);
        let zero = Floats::splat(simd, 0.0);
        faces.push(Drawn {
            found: face.is & face.value.simd_ge(zero),
            s: kept.begin,
            normal: [zero; 3],
            color: axes!(a => Floats::splat(simd, layer.appearance.color[a])),
            opacity: zero,
            id: Floats::splat(simd, (layer.placement.index + 1) as f32),
            is_face: face.is,
            brightness: face.brightness(layer),
        });
    }
    faces
}

/// The linear colour of what is cut, of the brightnesses of the volumes there and their colours, where the nearest, which is the first, has a
/// table of colours or none.
pub(crate) fn face_color(how: CutFace, colors: &[Vec4], cut: &[(f32, Vec3)]) -> Vec3 {
    let own = if colors.is_empty() { grey(cut[0].0) } else { face_color_at(colors, cut[0].0) };
    color_of_faces(how, own, cut)
}

/// What lies in a table of colours at a brightness.
pub(super) fn face_color_at(colors: &[Vec4], brightness: f32) -> Vec3 {
    let place = brightness.clamp(0.0, 1.0) * (colors.len() - 1) as f32;
    let first = (place as usize).min(colors.len() - 2);
    colors[first].lerp(colors[first + 1], place - first as f32).truncate()
}
