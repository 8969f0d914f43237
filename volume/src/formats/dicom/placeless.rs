//! Files of one slice each that do not state where they lie, as secondary captures and exports do: their places follow from what they do state.

use super::header::Header;
use super::lent::{By, Lent};
use dicom_dictionary_std::tags;

/// Lends places to the files of a series if none of them states one.
pub fn lend(headers: &mut [Header]) {
    let is_slice = |header: &Header| header.pixels.is_some() && header.frames() == 1;
    if headers.iter().any(|header| header.pixels.is_some() && header.place(0).is_some()) {
        return;
    }
    // A number that each of them has, and that is not the same for all; a single picture is no stack.
    let each = |tag| -> Option<Vec<f64>> {
        let numbers: Vec<f64> = headers.iter().filter(|h| is_slice(h)).map(|header| header.number(tag, 0)).collect::<Option<_>>()?;
        numbers.iter().any(|n| *n != numbers[0]).then_some(numbers)
    };
    let stated = |tag, name| headers.iter().find(|h| is_slice(h))?.number(tag, 0).filter(|mm| *mm > 0.0).map(|mm| (mm, name));
    let apart = || stated(tags::SPACING_BETWEEN_SLICES, "SpacingBetweenSlices").or_else(|| stated(tags::SLICE_THICKNESS, "SliceThickness"));
    let numbered = || {
        let numbers = each(tags::INSTANCE_NUMBER)?;
        let (mm, name) = apart()?;
        let mut sorted = numbers.clone();
        sorted.sort_by(f64::total_cmp);
        // Some count every second number.
        let step = sorted.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
        Some((numbers.iter().map(|n| (n - sorted[0]) / step * mm).collect(), By::Number { mm, name }))
    };
    let positions = || {
        let all = headers.iter().filter(|h| is_slice(h)).map(|h| h.numbers::<3>(tags::IMAGE_POSITION_PATIENT, 0));
        all.map(|position| position.map(|_| 0.0)).collect::<Option<Vec<f64>>>().filter(|all| all.len() > 1)
    };
    let positioned = positions().map(|mm| (mm, By::Position));
    let located = || each(tags::SLICE_LOCATION).map(|mm| (mm, By::Location));
    let Some((offsets, by)): Option<(Vec<f64>, By)> = positioned.or_else(located).or_else(numbered) else { return };
    headers.iter_mut().filter(|h| is_slice(h)).zip(offsets).for_each(|(header, offset_mm)| header.lent = Some(Lent { offset_mm, by }));
}
