//! Frames as H.264: sRGB to the colours of video and the encoder.

use super::FilmError;
use rusty_h264::{Encoder, EncoderConfig, YuvFrame};

/// The quantiser: 0 is best and largest, 51 worst; at 18 a turntable of bone is 50 dB off its frames.
pub const QUALITY: u8 = 18;

/// Kr and Kb of BT.709 (Recommendation ITU-R BT.709-6, 3.2).
const RED: f64 = 0.2126;
const BLUE: f64 = 0.0722;

/// sRGB bytes, three a pixel, as luma and the means of chroma of four pixels each, in BT.709's narrow range. Both sides are even.
pub fn frame_yuv(rgb: &[u8], [width, height]: [usize; 2]) -> YuvFrame {
    let of = |x: usize, y: usize| {
        let at = (y * width + x) * 3;
        let [r, g, b] = [0, 1, 2].map(|c| f64::from(rgb[at + c]) / 255.0);
        let luma = RED * r + (1.0 - RED - BLUE) * g + BLUE * b;
        [luma, (b - luma) / (2.0 * (1.0 - BLUE)), (r - luma) / (2.0 * (1.0 - RED))]
    };
    let y = (0..width * height).map(|n| (16.0 + 219.0 * of(n % width, n / width)[0]).round() as u8).collect();
    let chroma = |channel: usize| {
        let half = width / 2;
        let mean = move |n: usize| {
            let (x, y) = (n % half * 2, n / half * 2);
            let sum: f64 = [(0, 0), (1, 0), (0, 1), (1, 1)].iter().map(|(dx, dy)| of(x + dx, y + dy)[channel]).sum();
            (128.0 + 224.0 * sum / 4.0).round() as u8
        };
        (0..half * (height / 2)).map(mean).collect::<Vec<u8>>()
    };
    YuvFrame { width, height, y, u: chroma(1), v: chroma(2) }
}

/// An encoder of one frame after the other: each gives an access unit at once.
pub struct Coder(Encoder);

impl Coder {
    /// Of frames of such a size.
    pub fn new([width, height]: [u32; 2], fps: f64, quantiser: u8) -> Result<Self, FilmError> {
        let mut config = EncoderConfig::new(width as usize, height as usize);
        config.qp = quantiser;
        config.framerate = fps as f32;
        config.level_idc = level(width, height, fps);
        // A key frame a second, so that a film can be wound; frames come out as they go in.
        config.gop_size = fps.round().max(1.0) as u32;
        (config.scenecut, config.mbtree, config.bframes, config.bframes_adaptive) = (0, false, 0, false);
        Encoder::new(config).map(Self).map_err(|e| FilmError::Encode(format!("{e:?}")))
    }

    /// A frame's access unit, in Annex B.
    pub fn encode(&mut self, frame: &YuvFrame) -> Result<Vec<u8>, FilmError> {
        self.0.try_encode(frame).map_err(|e| FilmError::Encode(format!("{e:?}")))
    }
}

/// The least level that admits so many macroblocks (Recommendation ITU-T H.264, table A-1).
fn level(width: u32, height: u32, fps: f64) -> u8 {
    let blocks = f64::from(width.div_ceil(16) * height.div_ceil(16));
    const LEVELS: [(u8, f64, f64); 8] = [
        (30, 1_620.0, 40_500.0),
        (31, 3_600.0, 108_000.0),
        (32, 5_120.0, 216_000.0),
        (40, 8_192.0, 245_760.0),
        (42, 8_704.0, 522_240.0),
        (50, 22_080.0, 589_824.0),
        (51, 36_864.0, 983_040.0),
        (52, 36_864.0, 2_073_600.0),
    ];
    LEVELS.into_iter().find(|(_, most, per_s)| blocks <= *most && blocks * fps <= *per_s).map_or(52, |(level, ..)| level)
}

/// The NAL units of an access unit in Annex B, without their start codes.
pub fn units(annex_b: &[u8]) -> Vec<&[u8]> {
    let mut starts = vec![];
    let mut n = 0;
    while n + 3 <= annex_b.len() {
        if annex_b[n..n + 3] == [0, 0, 1] {
            starts.push(n + 3);
            n += 3;
        } else {
            n += 1;
        }
    }
    let end = |k: usize| starts.get(k + 1).map_or(annex_b.len(), |next| next - 3);
    let trimmed = |k: usize| {
        let unit = &annex_b[starts[k]..end(k)];
        // A start code of four bytes begins with a zero, which is no part of a unit.
        &unit[..unit.len() - unit.iter().rev().take_while(|byte| **byte == 0).count()]
    };
    (0..starts.len()).map(trimmed).collect()
}
