//! Whether scans are measured at like thresholds.

use crate::numbers::{significant, suffix};
use bregma_field::Unit;

/// In one sentence, what is unlike about the isovalues or the units of scans that are measured together, each by its name, isovalue and unit;
/// `None` where they are all alike. Isovalues are alike where they are the same number: whoever wants one surface of two scans sets one isovalue.
pub fn unlike_thresholds(scans: &[(&str, f64, Unit)]) -> Option<String> {
    let (_, first_iso, first_unit) = *scans.first()?;
    if scans.iter().all(|(_, iso, unit)| *iso == first_iso && *unit == first_unit) {
        return None;
    }
    let at = |(name, iso, unit): &(&str, f64, Unit), verb: &str| format!("{name} {verb}at {}{}", significant(*iso, 6), suffix(*unit));
    let mut parts: Vec<String> = scans.iter().enumerate().map(|(n, scan)| at(scan, if n == 0 { "is measured " } else { "" })).collect();
    let last = parts.pop()?;
    let all_hu = scans.iter().all(|(.., unit)| *unit == Unit::Hounsfield);
    let what = if all_hu {
        "their lengths are of different surfaces"
    } else if scans.iter().any(|(.., unit)| *unit == Unit::Hounsfield) {
        "HU and values without a unit cannot be compared, so whether their lengths are of the same surface is not known"
    } else {
        "their values have no unit, so whether their lengths are of the same surface is not known"
    };
    Some(format!("{} and {last}: {what}", parts.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use Unit::{Hounsfield, Value};

    #[test]
    fn unlike_thresholds_are_told_and_like_ones_are_not() {
        // Fails if lengths of two surfaces stand beside each other without a word, or a pair that is alike is warned of.
        assert_eq!(unlike_thresholds(&[("a", 226.0, Hounsfield), ("b", 226.0, Hounsfield)]), None);
        assert_eq!(unlike_thresholds(&[("a", 226.0, Hounsfield)]), None);
        assert_eq!(unlike_thresholds(&[]), None);
        let said = |scans: &[(&str, f64, Unit)]| unlike_thresholds(scans).unwrap();
        let hu = said(&[("skull A", 226.0, Hounsfield), ("skull B", 300.0, Hounsfield)]);
        assert_eq!(hu, "skull A is measured at 226 HU and skull B at 300 HU: their lengths are of different surfaces");
        // The same number in another unit is another threshold.
        assert!(said(&[("a", 226.0, Hounsfield), ("b", 226.0, Value)]).contains("a is measured at 226 HU and b at 226: HU and values"));
        let three = said(&[("a", 87.25, Value), ("b", 87.25, Value), ("c", 91.0, Value)]);
        assert!(three.starts_with("a is measured at 87.25, b at 87.25 and c at 91: their values have no unit"), "{three}");
    }
}
