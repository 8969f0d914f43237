//! What paths of light need to know beside volumes, as shaders read it.
//!
//! The twin of `shaders/stage.wgsl`.

use super::layout::{AffinePairs, CATCHER, NO_GROUND, Pair, PixelAffinePairs, SWEEP, TraceParams, padded, padded_matrix};
use super::plan::Extras;
use crate::scene::Normals;
use crate::studio::MOST_LAMPS;
use crate::studio::bone::Piece;
use crate::studio::bsdf::ALBEDOS;
use crate::studio::lamps::Disc;
use crate::studio::path::Stage;
use bytemuck::{Pod, Zeroable};

/// Rays that pass by the bone are farther than its radius by a thousandth, far more than is rounded.
const ROOM: f64 = 1.001;

/// Rays of an invocation in one dispatch: together with the blocks of a batch some hundredths of a second of a software driver on two cores, which
/// moreover ends loops that go round 65,535 times.
const RAYS: u32 = 16;

/// `Disc` of `shaders/stage.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct DiscRecord {
    pub centre: [f32; 3],
    pub radius: f32,
    pub normal: [f32; 4],
    pub u: [f32; 4],
    pub v: [f32; 4],
    pub radiance: [f32; 4],
}

/// `Stage` of `shaders/stage.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct StageRecord {
    pub origin: PixelAffinePairs,
    pub direction: PixelAffinePairs,
    pub middle: Pair,
    pub size: [u32; 2],
    pub seed: u32,
    pub bounces: u32,
    pub up: [f32; 3],
    pub start_mm: f32,
    pub sky_middle: [f32; 3],
    pub gloss: f32,
    pub sky_half: [f32; 3],
    pub coat_mean: f32,
    pub behind: [f32; 3],
    pub height: f32,
    pub ground_color: [f32; 3],
    pub corner: f32,
    pub radius: f32,
    pub reach_mm: f32,
    pub padding: [u32; 2],
}

/// `StageParams` of `shaders/stage.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct StageParams {
    pub stage: StageRecord,
    pub lamps: [DiscRecord; MOST_LAMPS],
    pub albedo: [f32; ALBEDOS],
    pub padding: [f32; PADDING],
}

/// To a multiple of the 16 bytes that a shader aligns such a struct by.
const PADDING: usize = ALBEDOS.next_multiple_of(4) - ALBEDOS;

impl DiscRecord {
    fn new(lamp: &Disc) -> Self {
        let [u, v] = lamp.across.map(padded);
        Self { centre: lamp.centre.to_array(), radius: lamp.radius, normal: padded(lamp.normal), u, v, radiance: padded(lamp.radiance) }
    }
}

impl StageParams {
    pub fn new(stage: &Stage) -> Self {
        let mut lamps = [DiscRecord::zeroed(); MOST_LAMPS];
        lamps.iter_mut().zip(&stage.lamps).for_each(|(record, lamp)| *record = DiscRecord::new(lamp));
        Self { stage: StageRecord::new(stage), lamps, albedo: stage.coat.albedo, padding: [0.0; PADDING] }
    }
}

impl StageRecord {
    fn new(stage: &Stage) -> Self {
        let blank = Self {
            origin: PixelAffinePairs::new(&stage.rays.origin),
            direction: PixelAffinePairs::new(&stage.rays.direction),
            middle: Pair::new(stage.bone.middle_mm),
            size: stage.size,
            seed: stage.seed,
            bounces: stage.bounces,
            up: stage.dome.up.to_array(),
            start_mm: stage.bone.start_mm as f32,
            sky_middle: stage.dome.middle.to_array(),
            gloss: stage.coat.gloss,
            sky_half: stage.dome.half.to_array(),
            coat_mean: stage.coat.mean,
            reach_mm: (stage.bone.radius_mm * ROOM) as f32,
            ..Self::zeroed()
        };
        let Some(floor) = &stage.floor else { return blank };
        Self {
            behind: floor.behind.to_array(),
            height: floor.height,
            ground_color: floor.color.to_array(),
            corner: floor.corner,
            radius: floor.radius,
            ..blank
        }
    }
}

/// The numbers that the pass of a stage is compiled with.
pub(super) fn numbers(stage: &Stage) -> Vec<(&'static str, f64)> {
    let ground = stage.floor.as_ref().map_or(NO_GROUND, |floor| if floor.is_catcher { CATCHER } else { SWEEP });
    let lamps = stage.lamps.len() as u32;
    // Rays of one dispatch are about as many, however many go to lamps.
    let steps = (RAYS / (1 + lamps)).max(1);
    let has_coat = u32::from(stage.coat.gloss > 0.0);
    [("LAMPS", lamps), ("GROUND", ground), ("STEPS", steps), ("HAS_COAT", has_coat)].map(|(name, n)| (name, f64::from(n))).to_vec()
}

/// A layer as paths see it; it is number `number` of the layers that they see.
pub(super) fn of_piece(piece: &Piece, normals: Normals, number: usize, solid: [u32; 3], extras: &mut Extras) -> TraceParams {
    TraceParams {
        number: number as u32,
        analytic_normals: u32::from(normals == Normals::Analytic),
        to_index: AffinePairs::new(&piece.to_index),
        to_world: AffinePairs::new(&piece.to_world),
        dims: piece.surface.grid.dims().map(|n| n as i32),
        level: piece.surface.level as f32,
        normal_to_world: padded_matrix(piece.normal_to_world),
        bricks: piece.map.dims().map(|n| n as i32),
        sign: piece.surface.sign,
        cuts: extras.add_cuts(&piece.surface.region),
        color: piece.color.to_array(),
        solid,
        rim_units: piece.rim_units,
        ..TraceParams::zeroed()
    }
}
