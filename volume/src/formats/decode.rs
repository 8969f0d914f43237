//! Bytes of a file into samples of the type that is kept.

use super::ReadError;
use crate::{Sample, Samples};
use half::f16;

/// The type of a sample as the file stores it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SampleType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

impl SampleType {
    /// Bytes of one sample.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Numbers that need not be whole.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    /// Whole numbers of more than 16 bits, which are kept in fewer where all of them fit.
    pub fn is_wide(self) -> bool {
        matches!(self, Self::I32 | Self::U32 | Self::I64 | Self::U64)
    }
}

/// How a sample lies in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoding {
    /// Type of a sample.
    pub sample: SampleType,
    /// Most significant byte first.
    pub big_endian: bool,
}

/// The type that samples are kept in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Kept {
    U8,
    I16,
    U16,
    F32,
}

impl Kept {
    /// u8, i16, u16 and f32 are kept and i8 becomes i16. Wider integers become i16 or u16 when all of them, from `ends[0]` to
    /// `ends[1]`, fit; otherwise they, and f64, become f32.
    pub fn of(sample: SampleType, ends: [i128; 2]) -> Self {
        let fits = |low: i128, high: i128| low <= ends[0] && ends[1] <= high;
        match sample {
            SampleType::U8 => Self::U8,
            SampleType::I8 | SampleType::I16 => Self::I16,
            SampleType::U16 => Self::U16,
            SampleType::F16 | SampleType::F32 | SampleType::F64 => Self::F32,
            _ if fits(i16::MIN.into(), i16::MAX.into()) => Self::I16,
            _ if fits(0, u16::MAX.into()) => Self::U16,
            _ => Self::F32,
        }
    }

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => u8::NAME,
            Self::I16 => i16::NAME,
            Self::U16 => u16::NAME,
            Self::F32 => f32::NAME,
        }
    }

    /// Bytes of one sample.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::F32 => 4,
        }
    }
}

/// Widens `ends` by the whole numbers in `bytes`.
pub fn widen(encoding: Encoding, bytes: &[u8], ends: &mut [i128; 2]) {
    each_wide(encoding, bytes, |v| *ends = [ends[0].min(v), ends[1].max(v)]);
}

/// Collects samples. What has to be rounded to fit float32 is counted.
pub struct Collector {
    encoding: Encoding,
    /// What has been collected.
    pub samples: Samples,
    rounded: usize,
    worst: f64,
}

impl Collector {
    /// Will keep samples as `kept`, with room for `count` of them.
    pub fn new(encoding: Encoding, kept: Kept, count: usize) -> Result<Self, ReadError> {
        let mut samples = match kept {
            Kept::U8 => Samples::U8(vec![]),
            Kept::I16 => Samples::I16(vec![]),
            Kept::U16 => Samples::U16(vec![]),
            Kept::F32 => Samples::F32(vec![]),
        };
        crate::with_samples!(&mut samples, s => s.try_reserve_exact(count)?);
        Ok(Self { encoding, samples, rounded: 0, worst: 0.0 })
    }

    /// Adds the samples in `bytes`.
    pub fn push(&mut self, bytes: &[u8]) {
        let (encoding, big) = (self.encoding, self.encoding.big_endian);
        match (encoding.sample, &mut self.samples) {
            (SampleType::U8, Samples::U8(s)) => s.extend_from_slice(bytes),
            (SampleType::I8, Samples::I16(s)) => s.extend(bytes.iter().map(|&b| i16::from(b as i8))),
            (SampleType::I16, Samples::I16(s)) => s.extend(i16s(bytes, big)),
            (SampleType::U16, Samples::U16(s)) => s.extend(u16s(bytes, big)),
            (SampleType::F16, Samples::F32(s)) => s.extend(f16s(bytes, big).map(f16::to_f32)),
            (SampleType::F32, Samples::F32(s)) => s.extend(f32s(bytes, big)),
            (SampleType::F64, _) => f64s(bytes, big).for_each(|v| self.push_float(v as f32, f64::from(v as f32) - v)),
            (_, Samples::I16(s)) => each_wide(encoding, bytes, |v| s.push(v as i16)),
            (_, Samples::U16(s)) => each_wide(encoding, bytes, |v| s.push(v as u16)),
            _ => each_wide(encoding, bytes, |v| self.push_float(v as f32, ((v as f32) as i128 - v) as f64)),
        }
    }

    /// Adds `kept`, which is `error` away from the number in the file (NaN for what is no number anyway).
    fn push_float(&mut self, kept: f32, error: f64) {
        if let Samples::F32(s) = &mut self.samples {
            s.push(kept);
        }
        if error.abs() > 0.0 {
            self.rounded += 1;
            self.worst = self.worst.max(error.abs());
        }
    }

    /// A sentence about what had to be rounded.
    pub fn warning(&self) -> Option<String> {
        let (n, worst) = (self.rounded, self.worst);
        (n > 0).then(|| format!("{n} samples do not fit float32 exactly and are rounded, by at most {worst:.1e}"))
    }
}

/// Calls `take` with every whole number of more than 16 bits.
fn each_wide(encoding: Encoding, bytes: &[u8], mut take: impl FnMut(i128)) {
    let big = encoding.big_endian;
    match encoding.sample {
        SampleType::I32 => i32s(bytes, big).for_each(|v| take(v.into())),
        SampleType::U32 => u32s(bytes, big).for_each(|v| take(v.into())),
        SampleType::I64 => i64s(bytes, big).for_each(|v| take(v.into())),
        SampleType::U64 => u64s(bytes, big).for_each(|v| take(v.into())),
        _ => unreachable!("`Kept::of` keeps other types as they are"),
    }
}

macro_rules! numbers {
    ($($name:ident: $t:ty),*) => {$(
        /// The numbers in `bytes`.
        pub fn $name(bytes: &[u8], big_endian: bool) -> impl Iterator<Item = $t> + '_ {
            bytes.as_chunks().0.iter().map(move |&b| if big_endian { <$t>::from_be_bytes(b) } else { <$t>::from_le_bytes(b) })
        }
    )*};
}
numbers!(i16s: i16, u16s: u16, i32s: i32, u32s: u32, i64s: i64, u64s: u64, f16s: f16, f32s: f32, f64s: f64);
