//! Numbers as people and tables read them.
//!
//! * [`fixed`] for people: as many decimals as the column has.
//! * [`at_most`] for CSV: six decimals of a millimetre are a nanometre, far below the uncertainty of any length that a scan shows, and short
//!   enough to read. JSON has every digit, and `bregma verify` reads JSON.
//! * [`significant`] for values of scans, whose size can be anything.
//!
//! None of them writes a negative zero.

use bregma_field::Unit;

/// What stands behind a number of this unit.
pub fn suffix(unit: Unit) -> &'static str {
    match unit {
        Unit::Hounsfield => " HU",
        Unit::Value => "",
    }
}

/// `value` rounded to `decimals`; `∞` where it is infinite, and `–` where it is no number.
pub fn fixed(value: f64, decimals: usize) -> String {
    if value.is_nan() {
        return "–".into();
    }
    if value.is_infinite() {
        return if value < 0.0 { "−∞" } else { "∞" }.into();
    }
    positive_zero(format!("{value:.decimals$}"))
}

/// The same with its sign, whatever it is: for what is a change.
pub fn signed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if value.is_nan() || text.starts_with(['-', '−']) { text } else { format!("+{text}") }
}

/// `value` with at most `decimals`, without zeros at the end; `Inf` and `NaN` as R and pandas read them.
pub fn at_most(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return word(value).into();
    }
    let text = positive_zero(format!("{value:.decimals$}"));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// `value` with at most so many significant `digits`, without zeros at the end; with a power of ten where it would be long without.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { word(value).into() };
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    // Rust writes an exponent always.
    let (mantissa, power) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    if (-5..digits as i32).contains(&power) {
        return at_most(value, (digits as i32 - 1 - power).max(0) as usize);
    }
    let mantissa = if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
    format!("{mantissa}e{power}")
}

fn word(value: f64) -> &'static str {
    if value.is_nan() {
        "NaN"
    } else if value < 0.0 {
        "-Inf"
    } else {
        "Inf"
    }
}

/// The text of a number without a minus before nothing but zeros.
fn positive_zero(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_no_negative_zero_and_no_endless_fraction() {
        // Fails if "-0.00", or sixteen digits of a number whose third is uncertain, come back.
        assert_eq!([fixed(-0.0004, 2), fixed(-0.0, 0), fixed(-0.4, 0), fixed(-0.006, 2)], ["0.00", "0", "0", "-0.01"]);
        assert_eq!([fixed(f64::INFINITY, 2), fixed(f64::NAN, 2)], ["∞", "–"]);
        assert_eq!([signed(1.0, 1), signed(-1.0, 1), signed(-0.01, 1), signed(0.0, 1)], ["+1.0", "-1.0", "+0.0", "+0.0"]);
        assert_eq!(
            [at_most(3.275_681_783_914_796e-12, 6), at_most(-1e-9, 6), at_most(5.25, 6), at_most(-120.0, 6)],
            ["0", "0", "5.25", "-120"]
        );
        assert_eq!([at_most(1_234.123_456_789, 6), at_most(100.0, 0), at_most(f64::INFINITY, 6)], ["1234.123457", "100", "Inf"]);
        assert_eq!(
            [significant(226.0, 6), significant(87.343_75, 6), significant(-0.0, 6), significant(1e-8, 9)],
            ["226", "87.3438", "0", "1e-8"]
        );
        assert_eq!(
            [significant(0.000_123_45, 6), significant(-1_234_567.0, 6), significant(999_999.9, 6)],
            ["0.00012345", "-1.23457e6", "1e6"]
        );
    }

    #[test]
    fn what_is_written_reads_back_to_its_precision() {
        // Fails if rounding is wrong at any size.
        let mut value = 1.234_567_890_123e-7;
        for _ in 0..60 {
            value *= -1.7;
            let read = |text: String| text.parse::<f64>().unwrap();
            assert!((read(at_most(value, 6)) - value).abs() <= 0.5001e-6 + value.abs() * 1e-15);
            assert!((read(significant(value, 9)) / value - 1.0).abs() <= 0.5001e-8, "{value}");
        }
    }
}
