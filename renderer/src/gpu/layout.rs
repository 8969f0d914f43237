//! The structs that Rust and WGSL share, byte for byte, and numbers about them; a test compares every offset with the shaders'.

use crate::camera::PixelAffine;
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, Mat3, Vec3};

/// What a ray says that a driver has ended, see `shaders/march.wgsl`.
pub(super) const UNFINISHED: u32 = 2;

/// Masks in a row of their texture, whose width any adapter has: see `shaders/brick.wgsl`.
pub(crate) const MASKS_ACROSS: usize = 512;

/// What stands for the place of a solid's sides where a volume has none.
pub(crate) const NO_SOLID: u32 = u32::MAX;

/// Sides as the shader knows them.
pub(crate) const SOLID_BOTH: u32 = 2;

/// What stands for the kinds of ground that paths have.
pub(crate) const NO_GROUND: u32 = 0;
pub(crate) const SWEEP: u32 = 1;
pub(crate) const CATCHER: u32 = 2;

/// `PixelAffine` of `shaders/line.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct PixelAffinePairs {
    pub base_hi: [f32; 4],
    pub base_lo: [f32; 4],
    pub per_x_hi: [f32; 4],
    pub per_x_lo: [f32; 4],
    pub per_y_hi: [f32; 4],
    pub per_y_lo: [f32; 4],
}

/// `Double` of `shaders/line.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Pair {
    pub hi: [f32; 4],
    pub lo: [f32; 4],
}

impl Pair {
    pub fn new(v: DVec3) -> Self {
        let (hi, lo) = hi_and_lo(v, |v| v as f32);
        Self { hi, lo }
    }
}

/// `Affine` of `shaders/line.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct AffinePairs {
    pub x: Pair,
    pub y: Pair,
    pub z: Pair,
    pub at: Pair,
}

impl AffinePairs {
    pub fn new(map: &DAffine3) -> Self {
        let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(Pair::new);
        Self { x, y, z, at: Pair::new(map.translation) }
    }
}

/// `Part` of `shaders/volume.wgsl`: some of the records that volumes have any number of.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Part {
    pub first: u32,
    pub count: u32,
}

/// `TraceParams` of `shaders/volume.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct TraceParams {
    // The picture and the pass.
    pub world_origin: PixelAffinePairs,
    pub world_direction: PixelAffinePairs,
    pub toward_light: [f32; 3],
    pub shadow_start: f32,
    pub pass_number: u32,
    pub passes: u32,
    pub stride: u32,
    pub only_nearest: u32,
    pub zero: u32,
    pub analytic_normals: u32,
    pub number: u32,
    pub id: u32,
    // Placement.
    pub origin: PixelAffinePairs,
    pub direction: PixelAffinePairs,
    pub to_index: AffinePairs,
    pub to_world: AffinePairs,
    pub dims: [i32; 3],
    pub level: f32,
    pub to_light: Pair,
    pub normal_to_world: [[f32; 4]; 3],
    pub gradient_to_world: [[f32; 4]; 3],
    // Skip.
    pub bricks: [i32; 3],
    pub sign: f32,
    pub to_light_spans: [[f32; 4]; 3],
    pub light_spans_origin: [f32; 4],
    pub light_blocks: [u32; 2],
    pub cuts: Part,
    // Appearance.
    pub levels: Part,
    pub table: Part,
    pub gradients: Part,
    pub face_colors: Part,
    pub brightness: [f32; 2],
    pub table_per_unit: f32,
    pub shows_faces: u32,
    pub inner: [f32; 3],
    pub has_inner: u32,
    pub color: [f32; 3],
    pub contour: f32,
    // The solid.
    pub solid: [u32; 3],
    pub rim_units: f32,
}

/// `Block` of `shaders/blocks.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Block {
    pub pixel: [u32; 2],
    pub span: [f32; 2],
}

/// `ShadeParams` of `shaders/light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct ShadeParams {
    pub view_base: [f32; 3],
    pub shadow: f32,
    pub view_per_x: [f32; 4],
    pub view_per_y: [f32; 4],
    pub toward_light: [f32; 3],
    pub ambient: f32,
    pub diffuse: f32,
    pub specular: f32,
    pub shininess: f32,
    pub stride: u32,
    pub passes: u32,
    pub overlay: u32,
    pub shadows: u32,
    pub cue_per_mm: f32,
    pub background: [f32; 4],
    pub step_mm: f32,
    pub jitter: f32,
    pub cut_face: u32,
    pub skin_mm: f32,
    pub agreed: [f32; 3],
    pub agreement_mm: f32,
    pub depth_range_mm: f32,
    pub padding: [u32; 3],
}

/// `ShadeLayer` of `shaders/shade.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct ShadeLayer {
    pub color: [f32; 4],
    pub id: u32,
    pub padding: [u32; 3],
}

impl PixelAffinePairs {
    pub fn new(a: &PixelAffine) -> Self {
        let (base_hi, base_lo) = hi_and_lo(a.base, |v| v as f32);
        let (per_x_hi, per_x_lo) = hi_and_lo(a.per_x, upper_16);
        let (per_y_hi, per_y_lo) = hi_and_lo(a.per_y, upper_16);
        Self { base_hi, base_lo, per_x_hi, per_x_lo, per_y_hi, per_y_lo }
    }
}

fn hi_and_lo(v: DVec3, upper: impl Fn(f64) -> f32) -> ([f32; 4], [f32; 4]) {
    let hi = v.to_array().map(&upper);
    let lo = std::array::from_fn::<f32, 3, _>(|a| (v[a] - f64::from(hi[a])) as f32);
    (padded(Vec3::from(hi)), padded(Vec3::from(lo)))
}

/// The upper 16 significant bits as float32: times 8 bits of a pixel's number they stay exact.
fn upper_16(v: f64) -> f32 {
    f32::from_bits((v as f32).to_bits() & 0xffff_ff00)
}

pub(super) fn padded(v: Vec3) -> [f32; 4] {
    v.extend(0.0).to_array()
}

pub(super) fn padded_matrix(m: Mat3) -> [[f32; 4]; 3] {
    [padded(m.x_axis), padded(m.y_axis), padded(m.z_axis)]
}

#[cfg(test)]
mod tests {
    use super::super::paths::{PATH_BYTES, SumsRecord};
    use super::super::shader::{Component, Reads, link};
    use super::super::stage::{DiscRecord, StageParams, StageRecord};
    use super::*;
    use std::mem::offset_of;

    fn members(source: &str, name: &str) -> (Vec<(String, usize)>, usize) {
        let module = naga::front::wgsl::parse_str(source).unwrap();
        let (_, ty) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
        (members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize)).collect(), *span as usize)
    }

    macro_rules! same_layout {
        ($source:expr, $wgsl:literal, $rust:ty, [$($field:ident),*]) => {
            let (members, span) = members($source, $wgsl);
            let rust = vec![$((stringify!($field).to_string(), offset_of!($rust, $field))),*];
            assert_eq!(members, rust, "{}", $wgsl);
            assert_eq!(span, size_of::<$rust>(), "size of {}", $wgsl);
        };
    }

    #[test]
    fn rust_and_wgsl_agree_on_every_offset() {
        // Fails when a field is added, moved or retyped on one side only: the GPU would read noise.
        let reads = [Reads { component: Component::F32, in_layers: true, is_cut: false }];
        let (trace, shade) = (link("trace", &[], &reads), link("shade", &[], &[]));
        same_layout!(&trace, "PixelAffine", PixelAffinePairs, [base_hi, base_lo, per_x_hi, per_x_lo, per_y_hi, per_y_lo]);
        same_layout!(
            &trace,
            "TraceParams",
            TraceParams,
            [
                world_origin,
                world_direction,
                toward_light,
                shadow_start,
                pass_number,
                passes,
                stride,
                only_nearest,
                zero,
                analytic_normals,
                number,
                id,
                origin,
                direction,
                to_index,
                to_world,
                dims,
                level,
                to_light,
                normal_to_world,
                gradient_to_world,
                bricks,
                sign,
                to_light_spans,
                light_spans_origin,
                light_blocks,
                cuts,
                levels,
                table,
                gradients,
                face_colors,
                brightness,
                table_per_unit,
                shows_faces,
                inner,
                has_inner,
                color,
                contour,
                solid,
                rim_units
            ]
        );
        same_layout!(&trace, "Double", Pair, [hi, lo]);
        same_layout!(&trace, "Affine", AffinePairs, [x, y, z, at]);
        same_layout!(&trace, "Part", Part, [first, count]);
        same_layout!(&trace, "Block", Block, [pixel, span]);
        same_layout!(
            &shade,
            "ShadeParams",
            ShadeParams,
            [
                view_base,
                shadow,
                view_per_x,
                view_per_y,
                toward_light,
                ambient,
                diffuse,
                specular,
                shininess,
                stride,
                passes,
                overlay,
                shadows,
                cue_per_mm,
                background,
                step_mm,
                jitter,
                cut_face,
                skin_mm,
                agreed,
                agreement_mm,
                depth_range_mm
            ]
        );
        same_layout!(&shade, "ShadeLayer", ShadeLayer, [color, id]);
        let path = link("path", &[], &reads);
        same_layout!(&path, "Disc", DiscRecord, [centre, radius, normal, u, v, radiance]);
        same_layout!(
            &path,
            "Stage",
            StageRecord,
            [
                origin,
                direction,
                middle,
                size,
                seed,
                bounces,
                up,
                start_mm,
                sky_middle,
                gloss,
                sky_half,
                coat_mean,
                behind,
                height,
                ground_color,
                corner,
                radius,
                reach_mm
            ]
        );
        same_layout!(&path, "StageParams", StageParams, [stage, lamps, albedo]);
        same_layout!(&path, "BlockSums", SumsRecord, [sums, pixel, first, count]);
        assert_eq!(members(&path, "Path").1, PATH_BYTES);
    }

    #[test]
    fn pairs_hold_twelve_digits() {
        // Fails if hi and lo do not add up: rays would start in the wrong place.
        let v = DVec3::new(123.456_789_012_345, -0.001_234_567_890_123, 511.999_999_99);
        for upper in [upper_16 as fn(f64) -> f32, |v| v as f32] {
            let (hi, lo) = hi_and_lo(v, upper);
            for a in 0..3 {
                let sum = f64::from(hi[a]) + f64::from(lo[a]);
                assert!((sum - v[a]).abs() <= v[a].abs() * 1e-11, "{sum} {}", v[a]);
            }
        }
    }
}
