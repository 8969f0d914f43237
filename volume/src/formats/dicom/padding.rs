//! Samples that mark what was not scanned, and would look dense: they are taken as air.

use super::super::decode::SampleType;
use super::header::Header;
use super::pixels::Storing;
use super::whole;
use crate::Unit;
use dicom_dictionary_std::tags;

/// Samples `from` to `to`, which become `air`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Padding {
    from: i64,
    to: i64,
    air: i64,
}

impl Padding {
    /// The padding of frame `frame`, whose values are slope·sample + intercept. What looks like air or water already stays as it is.
    pub fn of(header: &Header, frame: usize, storing: &Storing, scale: [f64; 2], unit: Unit) -> Option<Self> {
        let value = header.number(tags::PIXEL_PADDING_VALUE, frame)?;
        let limit = header.number(tags::PIXEL_PADDING_RANGE_LIMIT, frame).unwrap_or(value);
        Self::new([value, limit], storing, scale, unit)
    }

    fn new([value, limit]: [f64; 2], storing: &Storing, [slope, intercept]: [f64; 2], unit: Unit) -> Option<Self> {
        let [low, high] = storing.range();
        // The attribute is of 16 bits and may have been read with the other sign.
        let signs = |v: i64| {
            if v > high {
                v - 0x1_0000
            } else if v < low {
                v + 0x1_0000
            } else {
                v
            }
        };
        let ends = [value, limit].map(|v| signs(v as i64));
        // Pixels lose the bits that are no sample's, and so does a value that marks them; a range has no order then.
        let is_within = ends.iter().all(|v| (low..=high).contains(v));
        let [a, b] = if is_within { ends } else { [storing.cut(value as i64); 2] };
        let (from, to) = (a.min(b), a.max(b));
        let densest = if slope < 0.0 { from } else { to } as f64;
        let middle = (low + high) as f64 / 2.0;
        let (is_dense, air) = match unit {
            // Air is −1000 HU, water 0.
            Unit::Hounsfield => (slope * densest + intercept > 0.0, (-1000.0 - intercept) / slope),
            // Unknown values: the upper half looks dense.
            Unit::Value if slope < 0.0 => (densest < middle, high as f64),
            Unit::Value => (densest > middle, low.max(0) as f64),
        };
        let air = (air.round() as i64).clamp(low, high);
        is_dense.then_some(Self { from, to, air })
    }

    /// The sentence about it.
    pub fn warning(&self) -> String {
        let Self { from, to, .. } = self;
        format!("samples from {from} to {to} mark what was not scanned (padding); they are taken as air")
    }

    /// Replaces padding among samples, little-endian.
    pub fn replace(&self, bytes: &mut [u8], sample: SampleType) {
        let n = sample.bytes();
        for chunk in bytes.chunks_exact_mut(n) {
            let value = whole(chunk, sample);
            if (self.from..=self.to).contains(&value) {
                chunk.copy_from_slice(&self.air.to_le_bytes()[..n]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: [f64; 2], bits: u32, signed: bool, scale: [f64; 2], unit: Unit) -> Option<[i64; 3]> {
        Padding::new(values, &Storing::plain(bits, signed), scale, unit).map(|p| [p.from, p.to, p.air])
    }

    #[test]
    fn what_would_look_dense_is_air() {
        // Fails if density is judged by the type instead of the values, or a value's sign or spare bits hide it.
        const HU: [f64; 2] = [1.0, -1024.0];
        let hu = |value: f64, bits, signed, scale| of([value; 2], bits, signed, scale, Unit::Hounsfield);
        // The highest of 12 bits is bone, in whatever type it lies.
        assert_eq!(hu(4095.0, 12, false, HU), Some([4095, 4095, 24]));
        assert_eq!(hu(63_536.0, 16, false, HU), Some([63_536, 63_536, 24]));
        // Air stays, with either sign.
        for value in [0.0, -2000.0, 63_536.0] {
            assert_eq!(hu(value, 16, true, HU), None, "{value}");
        }
        assert_eq!(hu(-2000.0, 12, true, [1.0, 0.0]), None);
        // −2000 as 12 bits without a sign is 2096.
        assert_eq!(hu(-2000.0, 12, false, HU), Some([2096, 2096, 24]));
        // Air that the samples cannot hold is the nearest that they can.
        assert_eq!(hu(4095.0, 12, false, [1.0, 0.0]), Some([4095, 4095, 0]));
        // A range, whichever end comes first; a scale that falls.
        assert_eq!(of([4000.0, 3000.0], 12, false, HU, Unit::Hounsfield), Some([3000, 4000, 24]));
        assert_eq!(hu(0.0, 12, false, [-1.0, 1000.0]), Some([0, 0, 2000]));
        // Values without a unit; where low ones are dense, high ones are air.
        let value = |value: f64, slope| of([value; 2], 12, false, [slope, 0.0], Unit::Value);
        assert_eq!((value(4095.0, 1.0), value(0.0, 1.0)), (Some([4095, 4095, 0]), None));
        assert_eq!((value(4095.0, -1.0), value(0.0, -1.0)), (None, Some([0, 0, 4095])));
    }

    #[test]
    fn only_padding_is_replaced() {
        let mut bytes = [2095_i16, 2096, -1].map(i16::to_le_bytes).concat();
        Padding { from: 2096, to: 2096, air: -1000 }.replace(&mut bytes, SampleType::I16);
        assert_eq!(bytes, [2095_i16, -1000, -1].map(i16::to_le_bytes).concat());
    }
}
