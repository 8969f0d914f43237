//! The numbers that both languages know, written for the shaders from Rust's own: each stands, with its reason, where the CPU uses it.

use super::blocks::BLOCK_PIXELS;
use super::layout::{CATCHER, MASKS_ACROSS, NO_GROUND, NO_SOLID, SOLID_BOTH, SWEEP, UNFINISHED};
use crate::appearance::FACE_COLORS;
use crate::color::{self, srgb};
use crate::cpu::{brick, dvr, dvr_exact, dvr_steps, faces, gauss, let_through, project, segments, slice as plane, within};
use crate::roots::{analytic, cubic, spline, voxels};
use crate::scene::CutFace;
use crate::skip::WORDS;
use crate::slice;
use crate::stability::DECIDED_VOXEL;
use crate::studio::{MOST_LAMPS, accumulate, batch, bsdf, lamps, path, sampling};
use bregma_field::{BRICK, solid};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI};

macro_rules! constants {
    ($($name:ident = $value:expr;)*) => {
        /// The numbers as WGSL.
        pub(super) fn constants() -> String {
            [$(declared(stringify!($name), &$value)),*].concat()
        }
    };
}

constants! {
    BLOCK_PIXELS = BLOCK_PIXELS as u32;
    BRICK = BRICK as i32;
    MASKS_ACROSS = MASKS_ACROSS as u32;
    WORDS = WORDS as u32;
    STILL = brick::STILL;
    SMALLEST = f32::MIN_POSITIVE;
    NO_SOLID = NO_SOLID;
    SOLID_BOTH = SOLID_BOTH;
    SOLID_INSIDE = solid::INSIDE;
    SOLID_FIRST = solid::FIRST;
    SOLID_FARTHEST = f32::from(i16::MAX);
    AT_FACE_UNITS = within::AT_FACE_UNITS;
    NO_PART = within::NO_PART;
    FAR = brick::FAR;
    ON_FACE_VOXEL = faces::ON_FACE_VOXEL;
    FACE_COLORS = FACE_COLORS as u32;
    UNFINISHED = UNFINISHED;
    NO_ROOT = analytic::NO_ROOT;
    MAX_STEPS = cubic::MAX_STEPS;
    STEP_TOLERANCE = cubic::STEP_TOLERANCE;
    REST_TOLERANCE = cubic::REST_TOLERANCE;
    SPLINE_DEGREE = spline::DEGREE as i32;
    SPLINE_LEAST = spline::LEAST;
    VOXEL_MIDDLE = voxels::MIDDLE;
    VOXEL_NEVER = voxels::NEVER;
    SPLINE_MAX_STEPS = spline::MAX_STEPS;
    SPLINE_STEP_TOLERANCE = spline::STEP_TOLERANCE;
    SPLINE_WEIGHTS = spline::WEIGHTS;
    OF_3 = spline::OF_3;
    OF_9 = spline::OF_9;
    DECIDED_VOXEL = DECIDED_VOXEL as f32;
    MOST_ROOTS = segments::MOST_ROOTS;
    INTERVALS = project::INTERVALS as u32;
    TWO_POINTS = project::TWO_POINTS;
    NO_CROSSING = slice::NO_CROSSING;
    MOST_SLICE_STEPS = plane::MOST_SLICE_STEPS;
    KNOWN_TO = plane::KNOWN_TO;
    GAUSS_NODES = gauss::NODES;
    GAUSS_WEIGHTS = gauss::WEIGHTS;
    GAUSS_UNTIL = Matrix(gauss::UNTIL);
    SEEN = dvr::SEEN;
    CLEAREST = dvr_steps::CLEAREST;
    LEAST = dvr_exact::LEAST;
    THIN = dvr_exact::THIN;
    DARK = let_through::DARK;
    PCG = dvr_steps::PCG;
    BLEND = CutFace::Blend as u32;
    TRANSFER = CutFace::Transfer as u32;
    DIVERGING_LOW = color::DIVERGING[0];
    DIVERGING_MIDDLE = color::DIVERGING[1];
    DIVERGING_HIGH = color::DIVERGING[2];
    MIX = sampling::MIX;
    OWEN = sampling::OWEN;
    APART = sampling::APART;
    PI = PI;
    FRAC_1_PI = FRAC_1_PI;
    FRAC_PI_4 = FRAC_PI_4;
    GRAZING = lamps::GRAZING;
    MOST_LAMPS = MOST_LAMPS as u32;
    NO_GROUND = NO_GROUND;
    SWEEP = SWEEP;
    CATCHER = CATCHER;
    ETA = bsdf::ETA;
    ALPHA = bsdf::ALPHA;
    COAT_ALBEDOS = bsdf::ALBEDOS as u32;
    LEAST_COSINE = bsdf::LEAST_COSINE;
    LEAST_HALF = bsdf::LEAST_HALF;
    SURE_BOUNCES = path::SURE_BOUNCES;
    CHANNELS = batch::CHANNELS as u32;
    COVERAGE = batch::COVERAGE as u32;
    LIT = batch::LIT as u32;
    UNLIT = batch::UNLIT as u32;
    CAUGHT = batch::CAUGHT as u32;
    HALF_OF_BLOCK = accumulate::HALF_OF_BLOCK as u32;
    GUIDES_OF_BLOCK = accumulate::GUIDES_OF_BLOCK as u32;
    SUMS_OF_BLOCK = accumulate::SUMS_OF_BLOCK as u32;
    SRGB_SLOPE = srgb::SLOPE;
    SRGB_OFFSET = srgb::OFFSET;
    SRGB_SCALE = srgb::SCALE;
    SRGB_ROOT = srgb::ROOT;
    SRGB_POWER = srgb::POWER;
    SRGB_LINEAR = srgb::LINEAR;
    SRGB_LINEAR_LIGHT = srgb::LINEAR_LIGHT;
}

fn declared<T: Wgsl>(name: &str, value: &T) -> String {
    format!("const {name}: {} = {};\n", T::TYPE, value.text())
}

/// What can be written in WGSL.
trait Wgsl {
    const TYPE: &'static str;
    fn text(&self) -> String;
}

macro_rules! numbers {
    ($($rust:ty, $suffix:literal;)*) => {
        $(impl Wgsl for $rust {
            const TYPE: &'static str = stringify!($rust);
            fn text(&self) -> String {
                // The shortest text that is read as the same number.
                format!(concat!("{:?}", $suffix), self)
            }
        })*
    };
}

numbers! {
    f32, "f";
    i32, "i";
    u32, "u";
}

macro_rules! lists {
    ($($rust:ty, $wgsl:literal;)*) => {
        $(impl Wgsl for $rust {
            const TYPE: &'static str = $wgsl;
            fn text(&self) -> String {
                format!("{}({})", $wgsl, self.iter().map(Wgsl::text).collect::<Vec<_>>().join(", "))
            }
        })*
    };
}

lists! {
    [f32; 3], "vec3<f32>";
    [f32; 4], "vec4<f32>";
    [u32; 2], "vec2<u32>";
    [u32; 3], "vec3<u32>";
    [f32; 10], "array<f32, 10>";
    [[f32; 4]; 4], "array<vec4<f32>, 4>";
}

/// A matrix, by rows; WGSL has it by columns.
struct Matrix([[f32; 4]; 4]);

impl Wgsl for Matrix {
    const TYPE: &'static str = "mat4x4<f32>";
    fn text(&self) -> String {
        let column = |c: usize| self.0.map(|row| row[c]).text();
        format!("mat4x4<f32>({}, {}, {}, {})", column(0), column(1), column(2), column(3))
    }
}
