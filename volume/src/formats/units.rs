//! Units of length as programs spell them.

/// Millimetres in `unit`; `None` for what is no length, such as `pixel`.
pub fn unit_mm(unit: &str) -> Option<f64> {
    let unit = unit.trim().trim_matches(['"', '(', ')', '[', ']']).trim().to_lowercase();
    // ImageJ writes the letter µ by its number; Unicode has two, and files in Latin-1 or without it have others.
    let unit = unit.replace("\\u00b5", "u").replace(['µ', 'μ', '\u{fffd}'], "u").replace("metre", "meter");
    let one = unit.strip_suffix('s').filter(|u| u.len() > 1).unwrap_or(&unit);
    Some(match one {
        "mm" | "millimeter" | "milimeter" | "millim" => 1.0,
        "um" | "micron" | "micrometer" | "mikron" | "mikrometer" | "micro" => 1e-3,
        "nm" | "nanometer" => 1e-6,
        "pm" | "picometer" => 1e-9,
        "å" | "angstrom" | "ångström" | "ångstrom" => 1e-7,
        "dm" | "decimeter" => 100.0,
        "cm" | "centimeter" => 10.0,
        "m" | "meter" => 1e3,
        "km" | "kilometer" => 1e6,
        "inch" | "inche" | "in" | "\"" => 25.4,
        "mil" | "thou" => 0.0254,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::unit_mm;

    #[test]
    fn units_are_known_however_they_are_spelled() {
        // Fails if a spelling that ImageJ, ITK, teem, OME or a scanner writes is taken for no unit, which makes 1 mm of a micrometre.
        for micrometre in [
            "um",
            "µm",
            "μm",
            "\\u00B5m",
            "micron",
            "microns",
            "Microns",
            "micrometer",
            "micrometers",
            "Micrometre",
            " um ",
            "(um)",
            "\u{fffd}m",
        ] {
            assert_eq!(unit_mm(micrometre), Some(1e-3), "{micrometre}");
        }
        for (unit, mm) in
            [("mm", 1.0), ("MM", 1.0), ("millimeters", 1.0), ("millimetre", 1.0), ("cm", 10.0), ("inches", 25.4), ("m", 1e3), ("nm", 1e-6)]
        {
            assert_eq!(unit_mm(unit), Some(mm), "{unit}");
        }
        for none in ["pixel", "pixels", "", "s", "voxel", "mmm"] {
            assert_eq!(unit_mm(none), None, "{none}");
        }
    }
}
