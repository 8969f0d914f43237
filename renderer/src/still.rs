//! Still pictures: the mean of pictures through several points of each pixel.

use crate::cpu::encode;
use crate::picture::Picture;
use fast_srgb8::srgb8_to_f32;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// Points of a pixel that can be asked for: beyond these no byte of a picture changes but by chance.
pub const MOST_SAMPLES: u32 = 4096;

/// A picture whose colours are the mean of the light that comes through several points of each pixel. Depths, volumes and values are those of the
/// first one, the pixels' middles: a mean of two surfaces lies on neither.
#[derive(Clone, Debug)]
pub struct Still {
    first: Picture,
    /// What the others' light is more than the first's, premultiplied, summed up: nothing where they are the same, as in the background, which so costs
    /// no memory and hardly any time.
    more: Vec<Vec4>,
    samples: u32,
}

/// The light of a pixel, premultiplied.
fn light_of([r, g, b, a]: [u8; 4]) -> Vec4 {
    let light = Vec3::new(srgb8_to_f32(r), srgb8_to_f32(g), srgb8_to_f32(b));
    if a == u8::MAX {
        return light.extend(1.0);
    }
    let alpha = f32::from(a) / 255.0;
    (light * alpha).extend(alpha)
}

impl Still {
    /// Of one point of each pixel, its middle.
    pub fn of(first: Picture) -> Self {
        Self { first, more: vec![], samples: 1 }
    }

    /// Points of each pixel so far: the number of the next one.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Adds a picture of the same scene and size, through another point.
    pub fn add(&mut self, sample: &Picture) {
        if self.samples == 1 {
            self.more = vec![Vec4::ZERO; self.first.rgba.len()];
        }
        let rows = self.more.par_chunks_mut(CHUNK).zip(self.first.rgba.par_chunks(CHUNK)).zip(sample.rgba.par_chunks(CHUNK));
        rows.for_each(|((more, first), sample)| {
            for ((more, first), sample) in more.iter_mut().zip(first).zip(sample) {
                if sample != first {
                    *more += light_of(*sample) - light_of(*first);
                }
            }
        });
        self.samples += 1;
    }

    /// The pixels' middles: depths, volumes and values, and the colours that are seen through them.
    pub fn middles(&self) -> &Picture {
        &self.first
    }

    /// The mean as light that is not rounded to bytes: linear, premultiplied with the opacity, which is last.
    pub fn light(&self) -> Vec<Vec4> {
        let part = 1.0 / self.samples as f32;
        let more = |n: usize| self.more.get(n).map_or(Vec4::ZERO, |more| *more * part);
        self.first.rgba.par_iter().enumerate().map(|(n, pixel)| light_of(*pixel) + more(n)).collect()
    }

    /// The mean.
    pub fn picture(&self) -> Picture {
        let mut picture = self.first.clone();
        let part = 1.0 / self.samples as f32;
        picture.rgba.par_chunks_mut(CHUNK).zip(self.more.par_chunks(CHUNK)).for_each(|(pixels, more)| {
            for (pixel, more) in pixels.iter_mut().zip(more).filter(|(_, more)| **more != Vec4::ZERO) {
                *pixel = encode(light_of(*pixel) + *more * part, Vec4::ZERO);
            }
        });
        picture
    }
}

/// Pixels that a thread takes at once: some microseconds' work.
const CHUNK: usize = 4096;
