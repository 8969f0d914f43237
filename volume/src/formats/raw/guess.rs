//! How the samples of a headerless file may lie, told from its length, its name, and from how alike neighbours are.
//!
//! A scan is smooth: samples beside each other, in neighbouring rows and in neighbouring slices, are more alike than any two. So the right type,
//! byte order, row and slice are those at whose distances samples differ least, as parts of how much any two differ (Gini's mean difference).

use super::RawLayout;
use crate::Progress;
use crate::formats::ReadError;
use crate::formats::decode::SampleType;
use crate::formats::part::open_file;
use std::collections::HashMap;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// What is looked at of a file: its middle, several slices of any scanner's.
const LOOKED_AT: u64 = 64 << 20;
/// Pairs that are compared at a distance: their mean difference is known to some per cent.
const PAIRS: usize = 2048;
/// Sides that a slice may have.
const SIDES: std::ops::RangeInclusive<usize> = 8..=4096;
const MOST_SLICES: usize = 16_384;
/// Lengths of headers that programs write. All are multiples of four, so that samples stay samples.
const HEADERS: [u64; 8] = [0, 128, 256, 348, 352, 512, 1024, LONGEST_HEADER];
const LONGEST_HEADER: u64 = 4096;
/// Types are followed up that are rougher than the smoothest by no more than this factor.
const NEARLY: f64 = 1.4;
/// Rows that are followed up, and guesses that are given.
const ROWS: usize = 6;
const MOST: usize = 6;
/// What is less usual must be smoother by so much: a header, and slices that are not square.
const HEADER: f64 = 0.05;
const OBLONG: f64 = 0.02;

/// Each type that is read headerless, in the order that decides between equals.
const ENCODINGS: [(SampleType, bool); 7] = [
    (SampleType::U8, false),
    (SampleType::U16, false),
    (SampleType::I16, false),
    (SampleType::U16, true),
    (SampleType::I16, true),
    (SampleType::F32, false),
    (SampleType::F32, true),
];

/// What the layout of a file may be, the likeliest first; none where nothing fits its length.
pub fn guesses(path: &Path, progress: &Progress) -> Result<Vec<RawLayout>, ReadError> {
    let (mut file, there) = open_file(path)?;
    // From a multiple of every sample's size on, and behind any header: its bytes are no samples, and as floats could be of any size.
    let behind = if there > 16 * LONGEST_HEADER { LONGEST_HEADER } else { 0 };
    let from = (there.saturating_sub(LOOKED_AT) / 2 / 16 * 16).max(behind);
    file.seek(SeekFrom::Start(from))?;
    let mut bytes = vec![];
    file.take(LOOKED_AT).read_to_end(&mut bytes)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let words = || name.split(['_', '-', '.', ' ']);
    let said = (words().find_map(super::dims), words().find_map(super::sample_type));
    let mut looks: Vec<Look<'_>> = ENCODINGS.iter().filter_map(|(sample, big_endian)| Look::new(&bytes, *sample, *big_endian)).collect();
    looks.retain(|look| said.1.is_none_or(|said| said == look.layout.sample));
    // First, for values turned over from the lowest to the highest make all others look alike.
    keep_narrow(&mut looks);
    let smoothest = looks.iter().map(|look| look.beside).fold(f64::INFINITY, f64::min);
    looks.retain(|look| look.beside <= NEARLY * smoothest);
    let mut found: Vec<(f64, RawLayout)> = vec![];
    for look in &mut looks {
        for skip in HEADERS.into_iter().filter(|skip| *skip < there) {
            progress.advance(0)?;
            found.extend(look.layouts(there, skip, said.0));
        }
    }
    // A scan has slices, where it can have.
    if found.iter().any(|(_, layout)| layout.dims[2] > 1) {
        found.retain(|(_, layout)| layout.dims[2] > 1);
    }
    found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    Ok(found.into_iter().map(|(_, layout)| layout).take(MOST).collect())
}

/// Of whole numbers that look alike in both orders or with both signs, the narrower range is right: the other has values turned over or apart.
fn keep_narrow(looks: &mut Vec<Look<'_>>) {
    const ALIKE: f64 = 1.1;
    let of_16 = |look: &Look<'_>| look.layout.sample.bytes() == 2;
    let narrowest = looks.iter().filter(|look| of_16(look)).map(|look| look.range).fold(f64::INFINITY, f64::min);
    let smoothest = looks.iter().filter(|look| of_16(look)).map(|look| look.beside).fold(f64::INFINITY, f64::min);
    let orders: Vec<bool> =
        looks.iter().filter(|look| of_16(look) && look.beside <= ALIKE * smoothest).map(|look| look.layout.big_endian).collect();
    if orders.contains(&true) && orders.contains(&false) {
        looks.retain(|look| !of_16(look) || look.range <= narrowest);
    }
    // Of one order, the sign that keeps values together; where both do, none is below zero.
    for order in [false, true] {
        let own = |look: &Look<'_>| of_16(look) && look.layout.big_endian == order;
        let narrow = looks.iter().filter(|look| own(look)).map(|look| look.range).fold(f64::INFINITY, f64::min);
        let mut is_first = true;
        looks.retain(|look| !own(look) || look.range <= narrow && std::mem::take(&mut is_first));
    }
}

/// The bytes taken as samples of one encoding.
struct Look<'a> {
    bytes: &'a [u8],
    /// The type and the order; its size is not known yet.
    layout: RawLayout,
    /// Mean difference of any two samples.
    any_two: f64,
    range: f64,
    /// How much neighbours in a row differ, as part of that.
    beside: f64,
    /// The same by distance.
    known: HashMap<usize, f64>,
}

impl<'a> Look<'a> {
    /// `None` where they are no samples of that kind, or all the same.
    fn new(bytes: &'a [u8], sample: SampleType, big_endian: bool) -> Option<Self> {
        let layout = RawLayout { dims: [1; 3], sample, big_endian, skip: 0 };
        let mut look = Self { bytes, layout, any_two: 1.0, range: 0.0, beside: 0.0, known: HashMap::new() };
        let count = look.count();
        if count < 64 {
            return None;
        }
        let mut places = Places(1);
        let values: Vec<f64> = (0..2 * PAIRS).map(|_| look.value(places.below(count))).collect();
        // Bytes of something else are floats that no scanner gives.
        let is_odd = |v: &&f64| !v.is_finite() || **v != 0.0 && !(1e-20..1e20).contains(&v.abs());
        if values.iter().filter(is_odd).count() * 1000 > values.len() {
            return None;
        }
        look.any_two = values.chunks(2).map(|pair| (pair[0] - pair[1]).abs()).sum::<f64>() / PAIRS as f64;
        let ends = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)]);
        look.range = ends[1] - ends[0];
        look.beside = look.roughness(1);
        (look.any_two > 0.0 && look.any_two.is_finite()).then_some(look)
    }

    fn count(&self) -> usize {
        self.bytes.len() / self.layout.sample.bytes()
    }

    fn value(&self, n: usize) -> f64 {
        let size = self.layout.sample.bytes();
        self.layout.value(&self.bytes[n * size..][..size]).into()
    }

    /// How much samples so far from each other differ, as part of how much any two do; 1 where no two are so far apart.
    fn roughness(&mut self, distance: usize) -> f64 {
        if let Some(known) = self.known.get(&distance) {
            return *known;
        }
        let Some(room) = self.count().checked_sub(distance).filter(|room| *room > 0) else { return 1.0 };
        let mut places = Places(2);
        let differences = (0..PAIRS).map(|_| {
            let n = places.below(room);
            (self.value(n + distance) - self.value(n)).abs()
        });
        let rough = differences.sum::<f64>() / PAIRS as f64 / self.any_two;
        self.known.insert(distance, rough);
        rough
    }

    /// Layouts of a file of so many bytes, of which the first are skipped, each with how rough it is. What the name `said` comes first.
    fn layouts(&mut self, there: u64, skip: u64, said: Option<[usize; 3]>) -> Vec<(f64, RawLayout)> {
        let RawLayout { sample, .. } = self.layout;
        let size = sample.bytes() as u64;
        let Ok(samples) = usize::try_from((there - skip) / size) else { return vec![] };
        if !(there - skip).is_multiple_of(size) {
            return vec![];
        }
        let divisors = |n: usize| SIDES.filter(move |side| n.is_multiple_of(*side));
        let mut rows: Vec<(f64, usize)> = divisors(samples).map(|width| (self.roughness(width), width)).collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some([width, ..]) = said {
            rows.retain(|row| row.1 == width);
        }
        let mut found = vec![];
        for (row, width) in rows.into_iter().take(ROWS) {
            for height in divisors(samples / width).filter(|height| samples / width / height <= MOST_SLICES) {
                let dims = [width, height, samples / width / height];
                if said.is_some_and(|said| said != dims) {
                    continue;
                }
                let slice = self.roughness(width * height);
                let unusual = if skip > 0 { HEADER } else { 0.0 } + if width == height { 0.0 } else { OBLONG };
                found.push((self.beside + row + slice + unusual, RawLayout { dims, skip, ..self.layout }));
            }
        }
        found
    }
}

/// Places spread over a range, the same every time (Knuth's MMIX generator).
struct Places(u64);

impl Places {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((u128::from(self.0) * count as u128) >> 64) as usize
    }
}
