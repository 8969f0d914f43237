//! Two scans compared by two pictures of one view, each with one of them.

use bregma_field::Volume;
use bregma_renderer::{Contour, Picture, RenderError, Renderer, Scene, Still};
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use std::sync::Arc;

/// How the pictures of the first two visible scans are put together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compare {
    /// Not at all: one picture of all scans.
    #[default]
    Off,
    /// The first to the left of the second.
    SideBySide,
    /// The first to the left of a line, the second to its right.
    Swipe {
        /// Where the line stands, of the picture's width.
        part: f64,
    },
    /// By turns, as on a chessboard.
    Checkerboard {
        /// Pixels along a square's side.
        size_px: u32,
    },
    /// By turns in time.
    Flicker {
        /// How often the other one is shown.
        per_s: f64,
    },
}

/// The two scans of a scene that are compared: those that are `chosen`, or the first two visible ones.
pub fn compared(scene: &Scene, chosen: Option<[usize; 2]>) -> Option<[usize; 2]> {
    let mut visible = (0..scene.layers.len()).filter(|n| scene.layers[*n].visible);
    chosen.filter(|[a, b]| a != b && a.max(b) < &scene.layers.len()).or_else(|| Some([visible.next()?, visible.next()?]))
}

/// A picture to draw: its scene, and its pixels across and down.
pub type Part = (Scene, [u32; 2]);

impl Compare {
    /// Whether its numbers can be used.
    pub fn is_sound(&self) -> bool {
        match *self {
            Self::Off | Self::SideBySide => true,
            Self::Swipe { part } => (0.0..=1.0).contains(&part),
            Self::Checkerboard { size_px } => size_px > 0,
            Self::Flicker { per_s } => per_s > 0.0 && per_s.is_finite(),
        }
    }

    /// Whether nothing is compared.
    pub fn is_off(&self) -> bool {
        *self == Self::Off
    }

    /// The pixels of the pictures to draw for one of `width`×`height` pixels: one for each scan of the `pair`, or one of all where there is none or
    /// nothing is compared.
    pub fn sizes(self, pair: Option<[usize; 2]>, [width, height]: [u32; 2]) -> Vec<[u32; 2]> {
        match pair.filter(|_| !self.is_off()) {
            None => vec![[width, height]],
            // The same height is the same scale, whatever the width.
            Some(_) if self == Self::SideBySide && width > 1 => vec![[width / 2, height], [width - width / 2, height]],
            Some(_) => vec![[width, height]; 2],
        }
    }

    /// The pictures to draw, of [`Compare::sizes`].
    pub fn parts(self, scene: &Scene, pair: Option<[usize; 2]>, size: [u32; 2]) -> Vec<Part> {
        let Some(two) = pair.filter(|_| !self.is_off()) else { return vec![(scene.clone(), size)] };
        let alone = |n: usize| {
            let mut scene = scene.clone();
            scene.layers.iter_mut().enumerate().for_each(|(other, layer)| layer.visible = other == n);
            scene
        };
        two.map(alone).into_iter().zip(self.sizes(pair, size)).collect()
    }

    /// The pictures of [`Compare::parts`] as one, at the time `at_s`.
    pub fn join(self, pictures: &[Picture], at_s: f64) -> Option<Picture> {
        let [a, b] = pictures else { return pictures.first().cloned() };
        let turn = self.turn(at_s);
        let width = if self == Self::SideBySide { a.width + b.width } else { a.width };
        let line = if let Self::Swipe { part } = self { (part * f64::from(width)).round() as u32 } else { 0 };
        // Which picture a pixel is from, and its column there.
        let source = |x: u32, y: u32| match self {
            Self::SideBySide if x >= a.width => (b, x - a.width),
            Self::Swipe { .. } if x >= line => (b, x),
            Self::Checkerboard { size_px } if (x / size_px.max(1) + y / size_px.max(1)) % 2 == 1 => (b, x),
            Self::Flicker { .. } if turn % 2 == 1 => (b, x),
            _ => (a, x),
        };
        let count = width as usize * a.height as usize;
        let has_values = a.values.len() + b.values.len() > 0;
        let mut joined = Picture {
            width,
            height: a.height,
            rgba: Vec::with_capacity(count),
            depth_mm: Vec::with_capacity(count),
            volume_id: Vec::with_capacity(count),
            values: Vec::with_capacity(if has_values { count } else { 0 }),
            contours: vec![],
        };
        for y in 0..a.height {
            for x in 0..width {
                let (from, x) = source(x, y);
                let n = (y * from.width + x) as usize;
                joined.rgba.push(from.rgba[n]);
                joined.depth_mm.push(from.depth_mm[n]);
                joined.volume_id.push(from.volume_id[n]);
                joined.values.extend(from.values.get(n));
            }
        }
        for from in [a, b] {
            let moved = if self == Self::SideBySide && std::ptr::eq(from, b) { a.width } else { 0 };
            // What is seen of a contour are the segments whose middles lie on pixels of its picture.
            let is_seen = |[x0, y0, x1, y1]: &[f32; 4]| {
                let pixel = |a: &f32, b: &f32| ((a + b) / 2.0).round().max(0.0) as u32;
                std::ptr::eq(source(pixel(x0, x1) + moved, pixel(y0, y1)).0, from)
            };
            joined.contours.extend(from.contours.iter().map(|contour| {
                Contour {
                    volume_id: contour.volume_id,
                    segments: contour
                        .segments
                        .iter()
                        .filter(|segment| is_seen(segment))
                        .map(|[x0, y0, x1, y1]| [x0 + moved as f32, *y0, x1 + moved as f32, *y1])
                        .collect(),
                }
            }));
        }
        Some(joined)
    }

    /// The same for pictures with 1/`reduction` of the pixels across.
    pub fn reduced(self, reduction: u32) -> Self {
        match self {
            Self::Checkerboard { size_px } => Self::Checkerboard { size_px: (size_px / reduction).max(1) },
            other => other,
        }
    }

    /// How often the other picture was shown by the time `at_s`.
    pub fn turn(self, at_s: f64) -> u64 {
        if let Self::Flicker { per_s } = self { (at_s * per_s) as u64 } else { 0 }
    }

    /// The picture of `width`×`height` pixels, through so many points of each.
    pub fn draw(
        self,
        renderer: &mut dyn Renderer,
        volumes: &[Arc<Volume>],
        scene: &Scene,
        pair: Option<[usize; 2]>,
        size: [u32; 2],
        samples: u32,
    ) -> Result<Picture, RenderError> {
        let mut still = Still::of(self.sample(renderer, volumes, scene, pair, size, 0)?);
        while still.samples() < samples && !scene.is_slice() {
            still.add(&self.sample(renderer, volumes, scene, pair, size, still.samples())?);
        }
        Ok(still.picture())
    }

    /// The same through point number `sample` of each pixel.
    pub fn sample(
        self,
        renderer: &mut dyn Renderer,
        volumes: &[Arc<Volume>],
        scene: &Scene,
        pair: Option<[usize; 2]>,
        [width, height]: [u32; 2],
        sample: u32,
    ) -> Result<Picture, RenderError> {
        let parts = self.parts(scene, pair, [width, height]);
        let mut drawn = parts.iter().map(|(scene, size)| renderer.sample(volumes, scene, *size, sample)).collect::<Result<Vec<_>, _>>()?;
        // There always is a part.
        if drawn.len() == 1 { Ok(drawn.remove(0)) } else { self.join(&drawn, 0.0).ok_or(RenderError::NoPixels { width, height }) }
    }
}

impl FromStr for Compare {
    type Err = String;

    /// `off`, `side`, `swipe:PART` or `checker:PIXELS`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, number) = text.split_once(':').unwrap_or((text, ""));
        match name {
            "off" if number.is_empty() => Some(Self::Off),
            "side" if number.is_empty() => Some(Self::SideBySide),
            "swipe" => number.parse().ok().filter(|part| (0.0..=1.0).contains(part)).map(|part| Self::Swipe { part }),
            "checker" => number.parse().ok().filter(|n| *n > 0).map(|size_px| Self::Checkerboard { size_px }),
            _ => None,
        }
        .ok_or_else(|| "neither `off` nor `side` nor `swipe:PART` with a part from 0 to 1, nor `checker:N` with N pixels".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture whose pixels say where they are and of which volume.
    fn picture(id: u8, width: u32, height: u32) -> Picture {
        let places: Vec<(u32, u32)> = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).collect();
        Picture {
            width,
            height,
            rgba: places.iter().map(|(x, y)| [*x as u8, *y as u8, id, 255]).collect(),
            depth_mm: vec![f32::from(id); places.len()],
            volume_id: vec![id; places.len()],
            values: vec![],
            contours: vec![],
        }
    }

    #[test]
    fn every_pixel_comes_from_its_place_in_the_right_picture() {
        // Fails if a comparison shows a scan where the other belongs, or shifts one against the other.
        let pair = [picture(1, 6, 4), picture(2, 6, 4)];
        let ids = |compare: Compare, at_s: f64| {
            let joined = compare.join(&pair, at_s).unwrap();
            for (n, [x, y, id, _]) in joined.rgba.iter().enumerate() {
                let column = n as u32 % joined.width;
                let own = if compare == Compare::SideBySide { column % 6 } else { column };
                assert_eq!([u32::from(*x), u32::from(*y)], [own, n as u32 / joined.width]);
                assert!(joined.volume_id[n] == *id && joined.depth_mm[n] == f32::from(*id));
            }
            joined.volume_id.chunks(joined.width as usize).map(<[u8]>::to_vec).collect::<Vec<_>>()
        };
        assert_eq!(ids(Compare::SideBySide, 0.0)[3], [1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2]);
        assert_eq!(ids(Compare::Swipe { part: 1.0 / 3.0 }, 0.0)[1], [1, 1, 2, 2, 2, 2]);
        let checker = ids(Compare::Checkerboard { size_px: 2 }, 0.0);
        assert_eq!([&checker[1], &checker[2]], [&[1, 1, 2, 2, 1, 1], &[2, 2, 1, 1, 2, 2]]);
        let flicker = Compare::Flicker { per_s: 2.0 };
        assert_eq!([0.4, 0.6, 1.1].map(|at_s| ids(flicker, at_s)[0][0]), [1, 2, 1]);
    }

    #[test]
    fn comparisons_are_read_and_their_mistakes_named() {
        assert_eq!("side".parse(), Ok(Compare::SideBySide));
        assert_eq!("swipe:0.25".parse(), Ok(Compare::Swipe { part: 0.25 }));
        assert_eq!("checker:32".parse(), Ok(Compare::Checkerboard { size_px: 32 }));
        for wrong in ["swipe", "swipe:2", "checker:0", "side:1", "both"] {
            assert!(wrong.parse::<Compare>().unwrap_err().contains("checker:N"), "{wrong}");
        }
    }
}
