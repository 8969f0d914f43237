//! Samples and settings that are written as text.

use super::decode::SampleType;
use super::{ReadError, Sink, bad};
use crate::Progress;
use half::f16;
use std::io::BufRead;

/// Passes `count` numbers of a text on, little-endian; it ends at its end or at a `<`. `field` is what they belong to.
pub fn numbers(
    mut source: impl BufRead,
    sample: SampleType,
    count: u64,
    field: &str,
    progress: &Progress,
    take: &mut Sink<'_>,
) -> Result<(), ReadError> {
    let (size, mut left) = (sample.bytes() as u64, count);
    let mut numbers = vec![];
    let mut word = vec![];
    while left > 0 {
        let text = source.fill_buf()?;
        let (used, ends) = match text.iter().position(|b| b.is_ascii_whitespace() || *b == b'<') {
            Some(n) => (n + usize::from(text[n] != b'<'), true),
            None => (text.len(), text.is_empty()),
        };
        word.extend(text[..used].iter().filter(|b| !b.is_ascii_whitespace()));
        let is_end = text.is_empty() || text.get(used) == Some(&b'<');
        source.consume(used);
        if word.len() > 64 {
            return Err(bad(field, String::from_utf8_lossy(&word[..64]), "it is no number"));
        }
        if ends && !word.is_empty() {
            push(sample, field, std::str::from_utf8(&word).unwrap_or_default(), &mut numbers)?;
            (left, word) = (left - 1, vec![]);
        } else if is_end {
            return Err(ReadError::Truncated { wanted: (count * size).into(), there: (count - left) * size });
        }
        if numbers.len() >= 1 << 16 || left == 0 {
            take(&numbers)?;
            numbers.clear();
            progress.advance(0)?;
        }
    }
    Ok(())
}

/// Adds a number that is written as text, little-endian.
fn push(sample: SampleType, field: &str, text: &str, out: &mut Vec<u8>) -> Result<(), ReadError> {
    macro_rules! as_type {
        ($($name:ident: $t:ty),*) => { match sample {
            $(SampleType::$name => text.parse::<$t>().map(|v| out.extend(v.to_le_bytes())).is_ok(),)*
        } };
    }
    let fits = as_type!(I8: i8, U8: u8, I16: i16, U16: u16, I32: i32, U32: u32, I64: i64, U64: u64, F16: f16, F32: f32, F64: f64);
    if fits { Ok(()) } else { Err(bad(field, text, "it is no number of its type")) }
}

/// The lines `key=value` of a text in sections, as section, key and value, both names in small letters.
pub fn settings(text: &str) -> impl Iterator<Item = (String, String, &str)> {
    let mut section = String::new();
    text.lines().filter_map(move |line| {
        let line = line.trim();
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section = name.trim().to_lowercase();
            return None;
        }
        let (key, value) = line.split_once('=')?;
        Some((section.clone(), key.trim().to_lowercase(), value.trim()))
    })
}

/// A number, with a decimal point or the comma that programs write in some countries.
pub fn decimal(text: &str) -> Option<f64> {
    text.trim().replace(',', ".").parse().ok().filter(|v: &f64| v.is_finite())
}

/// Numbers between spaces; `None` when there are others than `N`.
pub fn decimals<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(decimal).collect();
    numbers?.try_into().ok()
}

/// Samples along each axis.
pub fn sizes(numbers: [f64; 3]) -> Option<[usize; 3]> {
    numbers.iter().all(|n| n.fract() == 0.0 && (1.0..=1e6).contains(n)).then(|| numbers.map(|n| n as usize))
}
