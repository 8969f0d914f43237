//! How values become colour and opacity.

use bregma_field::Volume;
use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

use crate::color::{BONE, Color};

/// What the values of a transfer function's points are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Values {
    /// The scan's: HU where the file says so.
    #[default]
    Scan,
    /// 0 is the lowest value of the scan, 1 the isovalue of its layer; so it fits scans of any unit, and follows the isovalue.
    Isovalue,
}

/// Colour and opacity at one value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// In the function's [`Values`].
    pub value: f64,
    /// Its colour.
    #[serde(with = "crate::color::hex")]
    pub color: Color,
    /// What of the light a layer keeps that is [`TransferFunction::over_mm`] thick: 0 to 1.
    pub opacity: f64,
}

/// A factor of the opacity where the value changes so fast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GradientPoint {
    /// Magnitude of the gradient, in values per mm.
    pub per_mm: f64,
    /// 0 to 1.
    pub factor: f64,
}

/// Colour and opacity over value, and optionally opacity over the gradient's magnitude. Between points the colour (as light) and the
/// extinction, −ln(1 − opacity) per thickness, are linear; beyond the first and last they stay as there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TransferFunction {
    /// What people call it.
    pub name: String,
    /// What the points' values are.
    #[serde(default)]
    pub values: Values,
    /// Thickness that opacities are for, mm; the geometric mean of the scan's spacings when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_mm: Option<f64>,
    /// What all extinctions are multiplied with: the whole is so much denser.
    #[serde(default = "once", skip_serializing_if = "is_once")]
    pub overall: f64,
    /// In ascending order of value.
    pub points: Vec<Point>,
    /// In ascending order; empty where the opacity does not depend on the gradient.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gradient: Vec<GradientPoint>,
}

fn once() -> f64 {
    1.0
}

// Serde asks with a reference.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde's form")]
fn is_once(overall: &f64) -> bool {
    *overall == 1.0
}

/// What [`TransferFunction::overall`] can be: from hardly anything to opaque at once.
pub const OVERALL: std::ops::RangeInclusive<f64> = 0.001..=1000.0;

/// The extinction of an opacity of 1 would be infinite: this is as opaque as float32 can tell from 1.
const MOST_OPACITY: f64 = 1.0 - 1e-7;

/// A control point for one volume: value in the scan's unit, linear colour, extinction per mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// In the scan's values.
    pub value: f64,
    /// As light.
    pub color: Vec3,
    /// Per mm.
    pub extinction_per_mm: f64,
}

impl TransferFunction {
    /// Bone of any scan: nothing below the isovalue, opaque soon above it.
    pub fn bone() -> Self {
        let point = |value: f64, rgb: [f32; 3], opacity: f64| Point { value, color: Color(rgb), opacity };
        Self {
            name: "bone".into(),
            values: Values::Isovalue,
            over_mm: None,
            overall: 1.0,
            points: vec![point(0.85, [0.75, 0.55, 0.4], 0.0), point(1.0, [0.9, 0.8, 0.65], 0.3), point(1.4, [1.0, 0.97, 0.9], 0.9)],
            gradient: vec![],
        }
    }

    /// The same in the colours of a scan that is told from others by `color`; of bone's own colour it is [`TransferFunction::bone`].
    pub fn bone_in(color: Color) -> Self {
        let mut function = Self::bone();
        if color != Color(BONE) {
            let shades = [SHADE, 1.0 - TINT, 1.0];
            let lights = [0.0, TINT / 2.0, TINT];
            for (point, (shade, light)) in function.points.iter_mut().zip(shades.into_iter().zip(lights)) {
                point.color = Color(color.0.map(|c| (c * shade).max(0.0) * (1.0 - light) + light));
            }
        }
        function
    }

    /// Reads the JSON form, or else a table: lines of value, red, green, blue (0 to 255) and opacity (0 to 1), apart by spaces, commas or
    /// semicolons; `#` begins a remark.
    pub fn read(text: &str, name: &str) -> Result<Self, String> {
        let function = if text.trim_start().starts_with('{') {
            serde_json::from_str(text).map_err(|e| format!("is no transfer function: {e}"))?
        } else {
            Self::read_table(text, name)?
        };
        function.checked()
    }

    fn read_table(text: &str, name: &str) -> Result<Self, String> {
        let mut points = vec![];
        for (line, number) in text.lines().zip(1..) {
            let line = line.split('#').next().unwrap_or_default();
            let fields: Vec<&str> = line.split([' ', '\t', ',', ';']).filter(|f| !f.is_empty()).collect();
            if fields.is_empty() {
                continue;
            }
            let numbers: Vec<f64> = fields.iter().filter_map(|f| f.parse().ok()).filter(|n: &f64| n.is_finite()).collect();
            let (&[value, red, green, blue, opacity], 5) = (numbers.as_slice(), fields.len()) else {
                return Err(format!("line {number} is not value, red, green, blue and opacity: {}", line.trim()));
            };
            let color = Color([red, green, blue].map(|c| (c / 255.0).clamp(0.0, 1.0) as f32));
            points.push(Point { value, color, opacity });
        }
        Ok(Self { name: name.into(), values: Values::Scan, over_mm: None, overall: 1.0, points, gradient: vec![] })
    }

    /// The same, or the reason why it cannot be used.
    pub fn checked(self) -> Result<Self, String> {
        let ascending = |v: &[f64]| v.windows(2).all(|pair| pair[0] < pair[1]) && v.iter().all(|v| v.is_finite());
        let share = |v: f64| (0.0..=1.0).contains(&v);
        if self.points.is_empty() {
            return Err("has no points; give it at least one".into());
        }
        if !ascending(&self.points.iter().map(|p| p.value).collect::<Vec<_>>()) {
            return Err("has points whose values do not ascend; sort them and leave out those that stand twice".into());
        }
        if !ascending(&self.gradient.iter().map(|p| p.per_mm).collect::<Vec<_>>()) {
            return Err("has gradients that do not ascend; sort them and leave out those that stand twice".into());
        }
        if !self.points.iter().all(|p| share(p.opacity)) || !self.gradient.iter().all(|p| share(p.factor)) {
            return Err("has an opacity or factor that is not between 0 and 1".into());
        }
        if !OVERALL.contains(&self.overall) {
            return Err("has an overall factor of its opacities that is not between 0.001 and 1000".into());
        }
        if self.over_mm.is_some_and(|mm| !(mm > 0.0 && mm.is_finite())) {
            return Err("has opacities for a thickness (over_mm) that is not above 0".into());
        }
        Ok(self)
    }

    /// The thickness that its opacities are for in a volume, mm.
    pub fn thickness_mm(&self, volume: &Volume) -> f64 {
        self.over_mm.filter(|mm| *mm > 0.0).unwrap_or_else(|| volume.grid().spacing_mm().to_array().iter().product::<f64>().cbrt())
    }

    /// Its control points for a volume whose layer has the isovalue `iso`, in ascending order of value.
    pub fn controls(&self, volume: &Volume, iso: f64) -> Vec<Control> {
        let over_mm = self.thickness_mm(volume);
        let low = volume.range()[0];
        let value = |v: f64| match self.values {
            Values::Scan => v,
            Values::Isovalue => low + v * (iso - low),
        };
        let control = |p: &Point| Control {
            value: value(p.value),
            color: p.color.linear(),
            extinction_per_mm: -(-p.opacity.min(MOST_OPACITY)).ln_1p() * self.overall / over_mm,
        };
        let mut controls: Vec<Control> = self.points.iter().map(control).collect();
        // An isovalue below the lowest value would turn them round.
        controls.sort_by(|a, b| a.value.total_cmp(&b.value));
        controls
    }
}

/// How dark the first points of a tinted function are, and how far its last ones are on their way to white: its shape is seen by that.
const SHADE: f32 = 0.6;
const TINT: f32 = 0.3;

/// The lowest value from which on something may be seen; none where nothing is.
pub(crate) fn lowest_visible(controls: &[Control]) -> Option<f64> {
    let first = controls.iter().position(|c| c.extinction_per_mm > 0.0)?;
    Some(if first == 0 { f64::NEG_INFINITY } else { controls[first - 1].value })
}

/// Linear colour, and extinction per mm, at a value.
pub fn classify(controls: &[Control], value: f64) -> Vec4 {
    let of = |c: &Control| c.color.extend(c.extinction_per_mm as f32);
    let above = controls.partition_point(|c| c.value <= value);
    match (above.checked_sub(1).map(|n| &controls[n]), controls.get(above)) {
        (Some(a), Some(b)) => of(a).lerp(of(b), ((value - a.value) / (b.value - a.value)) as f32),
        (Some(c), None) | (None, Some(c)) => of(c),
        (None, None) => Vec4::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::Progress;
    use bregma_synthetic::{Random, Which, skull};

    /// Up to six points and three gradients, in the order that they have to be in.
    fn function(r: &mut Random) -> TransferFunction {
        let ascending = |r: &mut Random, most: f64, from: f64| {
            let mut at = from;
            let count = (most * r.unit()) as usize;
            let step = |r: &mut Random| 0.01 + r.unit();
            (0..=count)
                .map(|_| {
                    at += step(r);
                    at
                })
                .collect::<Vec<f64>>()
        };
        let point = |value: f64, r: &mut Random| {
            let opacity = if r.unit() < 0.3 { 0.0 } else { r.unit() };
            Point { value, color: Color(std::array::from_fn(|_| (255.0 * r.unit()).round() as f32 / 255.0)), opacity }
        };
        TransferFunction {
            name: "any".into(),
            values: if r.unit() < 0.5 { Values::Scan } else { Values::Isovalue },
            over_mm: (r.unit() < 0.5).then(|| 0.1 + r.unit()),
            overall: if r.unit() < 0.5 { 1.0 } else { 0.5 + r.unit() },
            points: ascending(r, 6.0, -1.0).into_iter().map(|value| point(value, r)).collect(),
            gradient: ascending(r, 3.0, 0.0).into_iter().map(|per_mm| GradientPoint { per_mm, factor: r.unit() }).collect(),
        }
    }

    #[test]
    fn controls_ascend_and_give_the_opacity_that_their_points_have() {
        // Fails if an isovalue below all values turns controls round, or an extinction is not that of its opacity over its thickness.
        let volume = skull(Which::A, 12, &Progress::default()).unwrap();
        let mut r = Random(1);
        for _ in 0..500 {
            let function = function(&mut r);
            let controls = function.controls(&volume, 4000.0 * r.unit() - 2000.0);
            assert!(controls.windows(2).all(|pair| pair[0].value <= pair[1].value), "{controls:?}");
            let over_mm = function.thickness_mm(&volume);
            let mut opacities: Vec<f64> = controls.iter().map(|c| -(-c.extinction_per_mm * over_mm / function.overall).exp_m1()).collect();
            let mut expected: Vec<f64> = function.points.iter().map(|p| p.opacity).collect();
            [&mut opacities, &mut expected].into_iter().for_each(|v| v.sort_by(f64::total_cmp));
            assert!(opacities.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-6), "{opacities:?} are not {expected:?}");
        }
    }

    #[test]
    fn what_is_classified_lies_between_the_controls_beside_it() {
        // Fails if a value is classified by other controls than those beside it, or something is seen below what is said to be the lowest.
        let volume = skull(Which::A, 12, &Progress::default()).unwrap();
        let mut r = Random(2);
        for _ in 0..500 {
            let controls = function(&mut r).controls(&volume, 300.0);
            let [first, last] = [controls[0], controls[controls.len() - 1]];
            let reach = last.value - first.value + 1.0;
            for _ in 0..20 {
                let value = first.value + (1.4 * r.unit() - 0.2) * reach;
                let below = controls.iter().rev().find(|c| c.value <= value).unwrap_or(&first);
                let above = controls.iter().find(|c| c.value > value).unwrap_or(&last);
                let of = |c: &Control| c.color.extend(c.extinction_per_mm as f32);
                let (low, high) = (of(below).min(of(above)), of(below).max(of(above)));
                let found = classify(&controls, value);
                assert!(found.cmpge(low - 1e-6 * high).all() && found.cmple(high * (1.0 + 1e-6)).all(), "{value} in {controls:?}: {found}");
                if lowest_visible(&controls).is_none_or(|lowest| value < lowest) {
                    assert!(found.w == 0.0, "{value} in {controls:?} is seen");
                }
            }
        }
    }

    #[test]
    fn functions_are_read_as_they_are_written_and_refused_where_they_do_not_ascend() {
        // Fails if the JSON form or the table loses a number, or points that stand twice or in another order are let through.
        let mut r = Random(3);
        for _ in 0..200 {
            let function = function(&mut r);
            let json = serde_json::to_string(&function).unwrap();
            assert_eq!(TransferFunction::read(&json, "another").unwrap(), function);
            let line = |p: &Point| {
                let [red, green, blue] = p.color.bytes();
                format!("{}; {red}, {green}\t{blue} {} # remark\n", p.value, p.opacity)
            };
            let table: String = function.points.iter().map(line).collect();
            assert_eq!(TransferFunction::read(&table, "table").unwrap().points, function.points, "{table}");
            let mut turned = function.clone();
            turned.points.push(turned.points[(r.unit() * turned.points.len() as f64) as usize]);
            assert!(turned.checked().unwrap_err().contains("ascend"));
            let mut opaque = function;
            opaque.points[0].opacity = 1.0 + r.unit();
            assert!(opaque.checked().is_err());
        }
    }
}
