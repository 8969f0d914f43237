//! Samples of a pyramid, and the chunks that they lie in.

use super::super::decode::SampleType;
use crate::Sample;
use bytemuck::Pod;

/// Samples along each side of a chunk, as R. Greffe's thesis (Liège 2024, section 4.2.4) found best of several for drawing.
pub const CHUNK: usize = 32;

/// A sample of a pyramid.
pub trait Voxel: Sample + Pod {
    /// Its type in the file.
    const KIND: SampleType;
    /// The mean of eight, rounded to a sample.
    fn mean(eight: [Self; 8]) -> Self;
}

macro_rules! whole {
    ($($t:ty: $kind:ident),*) => {$(
        impl Voxel for $t {
            const KIND: SampleType = SampleType::$kind;
            #[inline(always)]
            fn mean(eight: [Self; 8]) -> Self {
                // Halves go up. The mean of numbers of a type is one of it.
                ((eight.iter().map(|v| i32::from(*v)).sum::<i32>() + 4) >> 3) as Self
            }
        }
    )*};
}
whole!(u8: U8, i16: I16, u16: U16);

impl Voxel for f32 {
    const KIND: SampleType = SampleType::F32;
    #[inline(always)]
    fn mean(eight: [Self; 8]) -> Self {
        (eight.iter().map(|v| f64::from(*v)).sum::<f64>() / 8.0) as Self
    }
}
