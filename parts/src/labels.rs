//! A label map: for each sample of a grid the number of the part that it belongs to, 0 for none.

use crate::error::PartsError;
use crate::numbers::Numbers;
use bregma_field::{AnyBlock, Grid, Metadata, Raster, Samples, Store, Unit, Volume, VolumeError};
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

/// Numbers of parts at the samples of a grid. A copy shares what is the same, so that copies are steps that can be gone back.
#[derive(Clone, Debug)]
pub struct Labels {
    grid: Grid,
    numbers: Numbers,
    parts: Vec<Part>,
}

impl Labels {
    /// Of numbers, u8 or u16, and what is known of the parts, which may be in any order. A number that no part has gets one of its name.
    pub fn new(grid: Grid, numbers: Samples, parts: Vec<Part>) -> Result<Self, PartsError> {
        if numbers.len() != grid.len() {
            return Err(VolumeError::Count { grid: grid.len(), samples: numbers.len() }.into());
        }
        let numbers = match Store::new(&numbers, grid.dims()).whole() {
            AnyBlock::U8(b) => Numbers::of(grid.dims(), b.onward([0; 3])),
            AnyBlock::U16(b) => Numbers::of(grid.dims(), b.onward([0; 3])),
            AnyBlock::I16(_) | AnyBlock::F32(_) => unreachable!("labels are made of u8 or u16"),
        };
        Ok(Self::of(grid, numbers, parts))
    }

    fn of(grid: Grid, numbers: Numbers, mut parts: Vec<Part>) -> Self {
        let mut is_unnamed = numbers.seen();
        parts.iter().for_each(|part| is_unnamed[usize::from(part.number)] = false);
        let unnamed = (1..=u16::MAX).filter(|&number| is_unnamed[usize::from(number)]);
        parts.extend(unnamed.map(|number| Part::new(number, number.to_string())));
        parts.sort_by_key(|part| part.number);
        Self { grid, numbers, parts }
    }

    /// Nothing has a number yet.
    pub fn none(grid: Grid) -> Self {
        let numbers = Numbers::all(grid.dims(), 0);
        Self { grid, numbers, parts: vec![] }
    }

    /// The same numbers with other things known of their parts, or on a grid that lies elsewhere and has as many samples.
    ///
    /// # Panics
    /// Where the grid has others.
    pub fn with(&self, grid: Grid, parts: Vec<Part>) -> Self {
        assert_eq!(grid.dims(), self.grid.dims(), "labels stay at their samples");
        Self::of(grid, self.numbers.clone(), parts)
    }

    /// With one more part, which has no samples yet; gives its number, the lowest that is free.
    pub fn with_part(mut self, name: &str) -> Result<(Self, u16), PartsError> {
        let is_free = |number: &u16| self.parts.iter().all(|part| part.number != *number);
        let number = (1..=u16::MAX).find(is_free).ok_or(PartsError::TooMany)?;
        self.parts.push(Part::new(number, name.to_owned()));
        self.parts.sort_by_key(|part| part.number);
        Ok((self, number))
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The numbers as a volume of their own: bytes up to number 255, else words.
    pub fn volume(&self) -> Volume {
        let samples = self.numbers.samples();
        let raster = Raster { grid: self.grid.clone(), samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
        Volume::new("parts".to_owned(), "label map", raster).expect("there is a number for each sample of the grid")
    }

    /// The parts, by their numbers.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The number of a sample's part, 0 where it has none.
    #[inline]
    pub fn number(&self, at: [usize; 3]) -> u16 {
        self.numbers.at(at.into())
    }

    /// Memory that it takes beside another one, with which it shares what is the same, bytes.
    pub fn bytes_beside(&self, other: &Self) -> usize {
        self.numbers.bytes_beside(&other.numbers)
    }

    pub(crate) fn numbers(&self) -> &Numbers {
        &self.numbers
    }

    pub(crate) fn numbers_mut(&mut self) -> &mut Numbers {
        &mut self.numbers
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
