//! A label map: for each sample of a grid the number of the part that it belongs to, 0 for none.

use crate::error::PartsError;
use bregma_field::{AnyBlock, Grid, Metadata, Raster, Samples, Store, Unit, Volume};
use rayon::prelude::*;
use serde::Serialize;

/// What is known of a part beside its samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    /// The number of its samples, from 1.
    pub number: u16,
    /// What the person calls it.
    pub name: String,
    /// Red, green and blue as on a screen (sRGB), 0 to 1.
    pub color: [f32; 3],
    /// What else a file says of it, by the names that 3D Slicer gives these fields (`ID`, `Tags`); it is written again.
    #[serde(skip)]
    pub fields: Metadata,
}

impl Part {
    /// A part of a colour of its own.
    pub fn new(number: u16, name: String) -> Self {
        Self { number, name, color: color(number), fields: Metadata::new() }
    }
}

/// Colours that stay apart however many there are: hues a golden section of the circle from each other, the first that of bone.
fn color(number: u16) -> [f32; 3] {
    const GOLDEN: f32 = 0.618_034;
    const BONE_HUE: f32 = 0.12;
    let hue = (BONE_HUE + f32::from(number.wrapping_sub(1)) * GOLDEN).fract();
    // Of hue, saturation and value (Smith 1978), the latter two so that colours are neither pale nor dark.
    [5.0, 3.0, 1.0].map(|n: f32| {
        let k = (n + hue * 6.0) % 6.0;
        let channel = 0.9 - 0.9 * 0.55 * k.min(4.0 - k).clamp(0.0, 1.0);
        (channel * 1000.0).round() / 1000.0
    })
}

/// Numbers of parts at the samples of a grid. They are the samples of a volume (u8 up to number 255, else u16), so that what reads scans reads
/// them: a megasample takes one megabyte, or two.
#[derive(Clone, Debug)]
pub struct Labels {
    volume: Volume,
    parts: Vec<Part>,
}

impl Labels {
    /// Of numbers, u8 or u16, and what is known of the parts, which may be in any order. A number that no part has gets one of its name.
    pub fn new(grid: Grid, numbers: Samples, mut parts: Vec<Part>) -> Result<Self, PartsError> {
        let raster = Raster { grid, samples: numbers, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
        let volume = Volume::new("parts".to_owned(), "label map", raster)?;
        let mut is_unnamed = present(&volume);
        parts.iter().for_each(|part| is_unnamed[usize::from(part.number)] = false);
        let unnamed = (1..=u16::MAX).filter(|&number| is_unnamed[usize::from(number)]);
        parts.extend(unnamed.map(|number| Part::new(number, number.to_string())));
        parts.sort_by_key(|part| part.number);
        Ok(Self { volume, parts })
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &Grid {
        self.volume.grid()
    }

    /// The numbers as a volume.
    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// The parts, by their numbers.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The number of a sample's part, 0 where it has none.
    pub fn number(&self, [i, j, k]: [usize; 3]) -> u16 {
        let [nx, ny, _] = self.grid().dims();
        let n = i + nx * (j + ny * k);
        match self.numbers() {
            Numbers::U8(numbers) => numbers[n].into(),
            Numbers::U16(numbers) => numbers[n],
        }
    }

    /// The numbers, i fastest.
    pub(crate) fn numbers(&self) -> Numbers<'_> {
        numbers(&self.volume)
    }
}

/// The numbers of a label map in the type that they are kept in.
#[derive(Clone, Copy)]
pub(crate) enum Numbers<'a> {
    U8(&'a [u8]),
    U16(&'a [u16]),
}

impl Numbers<'_> {
    /// That of sample number n, i fastest.
    pub fn at(self, n: usize) -> u16 {
        match self {
            Self::U8(numbers) => numbers[n].into(),
            Self::U16(numbers) => numbers[n],
        }
    }
}

fn numbers(volume: &Volume) -> Numbers<'_> {
    match Store::of(volume).whole() {
        AnyBlock::U8(b) => Numbers::U8(b.onward([0; 3])),
        AnyBlock::U16(b) => Numbers::U16(b.onward([0; 3])),
        AnyBlock::I16(_) | AnyBlock::F32(_) => unreachable!("labels are made of u8 or u16"),
    }
}

/// For each number whether some sample has it.
fn present(volume: &Volume) -> Vec<bool> {
    match numbers(volume) {
        Numbers::U8(numbers) => seen(numbers),
        Numbers::U16(numbers) => seen(numbers),
    }
}

/// For each number whether it is among these.
pub(crate) fn seen<N: Copy + Into<usize> + Sync>(numbers: &[N]) -> Vec<bool> {
    let of = |numbers: &[N]| {
        let mut seen = vec![false; 1 << 16];
        numbers.iter().for_each(|&n| seen[n.into()] = true);
        seen
    };
    let either = |a: Vec<bool>, b: Vec<bool>| a.into_iter().zip(b).map(|(a, b)| a || b).collect();
    numbers.par_chunks(1 << 22).map(of).reduce(|| vec![false; 1 << 16], either)
}
