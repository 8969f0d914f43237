//! A sheet as light, with the marks that belong over it: what every form of file is written from.

use super::raster;
use super::shapes::Mark;
use bregma_renderer::{Color, Picture};
use fast_srgb8::{f32_to_srgb8, srgb8_to_f32};
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// A sheet.
#[derive(Clone, Debug, Default)]
pub struct Canvas {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Pixels in an inch, where its size on paper is known.
    pub dpi: Option<f64>,
    /// Linear, premultiplied with the opacity, rows from the top; without the marks.
    pub light: Vec<Vec4>,
    /// What is known of the pixels' middles beside their colours; nothing of figures.
    pub middles: Option<Picture>,
    /// What is drawn over it, mm.
    pub marks: Vec<Mark>,
    /// Nothing is behind the bone: files keep the opacity.
    pub is_clear: bool,
}

impl Canvas {
    /// Of one light.
    pub fn filled(size: [u32; 2], dpi: Option<f64>, ground: Option<Color>) -> Self {
        let count = size[0] as usize * size[1] as usize;
        let light = vec![ground.map_or(Vec4::ZERO, |color| color.linear().extend(1.0)); count];
        let [width, height] = size;
        let (depth_mm, volume_id, values) = (vec![f32::NAN; count], vec![0; count], vec![f32::NAN; count]);
        let middles = Picture { width, height, rgba: vec![], depth_mm, volume_id, values, contours: vec![] };
        Self { size, dpi, light, middles: Some(middles), marks: vec![], is_clear: ground.is_none() }
    }

    /// Of a picture as it is, sized by nothing.
    pub fn of(picture: &Picture) -> Self {
        let light = |[r, g, b, a]: &[u8; 4]| {
            let alpha = f32::from(*a) / 255.0;
            (Vec3::new(srgb8_to_f32(*r), srgb8_to_f32(*g), srgb8_to_f32(*b)) * alpha).extend(alpha)
        };
        Self {
            size: [picture.width, picture.height],
            light: picture.rgba.iter().map(light).collect(),
            middles: Some(picture.clone()),
            is_clear: picture.rgba.iter().any(|pixel| pixel[3] < u8::MAX),
            ..Self::default()
        }
    }

    /// Of RGB pixels.
    pub fn of_figure((rgb, width, height): &(Vec<u8>, u32, u32)) -> Self {
        let light = |pixel: &[u8]| Vec4::new(srgb8_to_f32(pixel[0]), srgb8_to_f32(pixel[1]), srgb8_to_f32(pixel[2]), 1.0);
        Self { size: [*width, *height], light: rgb.chunks_exact(3).map(light).collect(), ..Self::default() }
    }

    /// Lays a part of the sheet in its place, its upper left pixel at `at`.
    pub fn lay(&mut self, [left, top]: [u32; 2], light: &[Vec4], part: &Picture) {
        let count = part.width as usize;
        for row in 0..part.height as usize {
            let from = row * count..(row + 1) * count;
            let start = (top as usize + row) * self.size[0] as usize + left as usize;
            let to = start..start + count;
            self.light[to.clone()].copy_from_slice(&light[from.clone()]);
            let Some(middles) = &mut self.middles else { continue };
            middles.depth_mm[to.clone()].copy_from_slice(&part.depth_mm[from.clone()]);
            middles.volume_id[to.clone()].copy_from_slice(&part.volume_id[from.clone()]);
            if let Some(values) = part.values.get(from) {
                middles.values[to].copy_from_slice(values);
            }
        }
    }

    /// Pixels in a millimetre.
    pub fn px_per_mm(&self) -> f64 {
        self.dpi.unwrap_or(SCREEN_DPI) / 25.4
    }

    /// Its size on paper, mm.
    pub fn size_mm(&self) -> [f64; 2] {
        self.size.map(|px| f64::from(px) / self.px_per_mm())
    }

    /// The light with the marks over it.
    pub fn painted(&self) -> Vec<Vec4> {
        let mut light = self.light.clone();
        if !self.marks.is_empty() {
            raster::paint(&self.marks, self.px_per_mm(), self.size, &mut light);
        }
        light
    }

    /// Light as sRGB bytes: of a clear sheet with straight opacity, else three a pixel.
    pub fn bytes(&self, light: &[Vec4]) -> Vec<u8> {
        let encoded = |pixel: &Vec4| {
            let [r, g, b] = straight(pixel).to_array().map(f32_to_srgb8);
            [r, g, b, (pixel.w.clamp(0.0, 1.0) * 255.0).round() as u8]
        };
        self.channels(light, encoded)
    }

    /// The same with 16 bits a channel.
    pub fn words(&self, light: &[Vec4]) -> Vec<u16> {
        let word = |share: f32| (share.clamp(0.0, 1.0) * 65535.0).round() as u16;
        let encoded = |pixel: &Vec4| {
            let [r, g, b] = Color::of_light(straight(pixel)).0.map(word);
            [r, g, b, word(pixel.w)]
        };
        self.channels(light, encoded)
    }

    /// How many channels its files have.
    pub fn channel_count(&self) -> usize {
        if self.is_clear { 4 } else { 3 }
    }

    fn channels<T: Copy + Default + Send>(&self, light: &[Vec4], encoded: impl Fn(&Vec4) -> [T; 4] + Sync) -> Vec<T> {
        let count = self.channel_count();
        let mut channels = vec![T::default(); count * light.len()];
        channels.par_chunks_mut(count).zip(light).for_each(|(to, pixel)| to.copy_from_slice(&encoded(pixel)[..count]));
        channels
    }
}

/// What a sheet of pixels alone is taken for where marks have a size on it.
pub const SCREEN_DPI: f64 = 300.0;

fn straight(pixel: &Vec4) -> Vec3 {
    if pixel.w > 0.0 { pixel.truncate() / pixel.w } else { Vec3::ZERO }
}
