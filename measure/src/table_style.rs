//! Tables as the program that a person opens them with wants them: lengths in another unit, commas in numbers.
//!
//! [`crate::csv`] says what is written otherwise, and what is read again: mm and points.

use serde::{Deserialize, Serialize};

/// The unit of lengths in a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Millimetres.
    #[default]
    Mm,
    /// Centimetres.
    Cm,
    /// Micrometres.
    Um,
}

impl LengthUnit {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Mm, Self::Cm, Self::Um];

    /// As people write it.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Mm => "mm",
            Self::Cm => "cm",
            Self::Um => "µm",
        }
    }

    /// What columns end in.
    fn column(self) -> &'static str {
        match self {
            Self::Mm => "_mm",
            Self::Cm => "_cm",
            Self::Um => "_um",
        }
    }

    /// The power of ten of a millimetre in it.
    fn power(self) -> i32 {
        match self {
            Self::Mm => 0,
            Self::Cm => -1,
            Self::Um => 3,
        }
    }
}

/// How tables are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TableStyle {
    /// Of lengths: columns that end in it.
    pub unit: LengthUnit,
    /// A comma in numbers, and semicolons between fields, as spreadsheets of many countries want it.
    pub decimal_comma: bool,
}

/// A table of this program (RFC 4180, lengths in columns that end in `_mm`) in another style. Digits are moved, not rounded again.
pub fn styled(csv: &str, style: TableStyle) -> String {
    if style == TableStyle::default() {
        return csv.to_owned();
    }
    let mut is_length: Vec<bool> = vec![];
    let mut out = String::with_capacity(csv.len() + csv.len() / 8);
    for (n, line) in csv.lines().enumerate() {
        let mut fields = fields(line);
        if n == 0 {
            is_length = fields.iter().map(|field| field.ends_with("_mm")).collect();
        }
        for (field, is_length) in fields.iter_mut().zip(&is_length) {
            *field = match field.strip_suffix("_mm") {
                Some(name) if n == 0 => format!("{name}{}", style.unit.column()),
                _ if *is_length && is_number(field) => moved(field, style.unit.power()),
                _ => std::mem::take(field),
            };
            if style.decimal_comma && is_number(field) {
                *field = field.replace('.', ",");
            }
        }
        let separator = if style.decimal_comma { ';' } else { ',' };
        let quoted = |field: &String| {
            let breaks = field.contains([separator, '"']);
            if breaks { format!("\"{}\"", field.replace('"', "\"\"")) } else { field.clone() }
        };
        out += &fields.iter().map(quoted).collect::<Vec<_>>().join(&separator.to_string());
        out.push('\n');
    }
    out
}

/// The fields of a line of RFC 4180 without line breaks in them.
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut is_quoted, mut chars) = (vec![String::new()], false, line.chars().peekable());
    while let Some(c) = chars.next() {
        match c {
            '"' if is_quoted && chars.peek() == Some(&'"') => {
                chars.next();
                fields.last_mut().into_iter().for_each(|field| field.push('"'));
            }
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(String::new()),
            other => fields.last_mut().into_iter().for_each(|field| field.push(other)),
        }
    }
    fields
}

/// Digits with a sign and a point, as [`crate::numbers::at_most`] writes them; powers of ten, infinities and dates are none.
fn is_number(field: &str) -> bool {
    let digits = field.strip_prefix('-').unwrap_or(field);
    !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit() || c == '.') && digits.chars().filter(|c| *c == '.').count() <= 1
}

/// A number times a power of ten, its digits as they are.
fn moved(number: &str, power: i32) -> String {
    let (sign, digits) = number.strip_prefix('-').map_or(("", number), |digits| ("-", digits));
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let all = format!("{whole}{part}");
    let point = whole.len() as i32 + power;
    let (all, point) = if point < 1 { (format!("{}{all}", "0".repeat((1 - point) as usize)), 1) } else { (all, point as usize) };
    let all = format!("{all:0<point$}");
    let (whole, part) = all.split_at(point);
    let whole = whole.trim_start_matches('0');
    let (whole, part) = (if whole.is_empty() { "0" } else { whole }, part.trim_end_matches('0'));
    if part.is_empty() { format!("{sign}{whole}") } else { format!("{sign}{whole}.{part}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_change_their_unit_and_nothing_else_does() {
        // Fails if a digit is lost or rounded, a column that is no length is scaled, a text is split at its comma, or a date becomes a number.
        let table = "name,length_mm,isovalue,date,note\n\"a, b\",12.345678,226.5,2026-11-28,\"says \"\"1.5\"\"; so\"\nc,-0.05,-1000,,1.5\nd,Inf,1e-7,,\n";
        let style = |unit, decimal_comma| styled(table, TableStyle { unit, decimal_comma });
        assert_eq!(style(LengthUnit::Mm, false), table);
        assert_eq!(
            style(LengthUnit::Um, false),
            "name,length_um,isovalue,date,note\n\"a, b\",12345.678,226.5,2026-11-28,\"says \"\"1.5\"\"; so\"\nc,-50,-1000,,1.5\nd,Inf,1e-7,,\n"
        );
        assert_eq!(
            style(LengthUnit::Cm, true),
            "name;length_cm;isovalue;date;note\na, b;1,2345678;226,5;2026-11-28;\"says \"\"1.5\"\"; so\"\nc;-0,005;-1000;;1,5\nd;Inf;1e-7;;\n"
        );
        for (number, power, expected) in
            [("0", 3, "0"), ("0.000001", 3, "0.001"), ("1", -1, "0.1"), ("100", -1, "10"), ("0.5", -1, "0.05"), ("7", 3, "7000")]
        {
            assert_eq!(moved(number, power), expected, "{number} · 10^{power}");
        }
    }
}
