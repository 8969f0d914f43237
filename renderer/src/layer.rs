//! How one volume of a scene is shown: its surface, its colours, where it is put, and the part of it that is meant.

use crate::color::{BONE, Color};
use crate::transfer::{Control, TransferFunction};
use bregma_field::{Covariance, Measured, Solid, Volume};
use glam::DAffine3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A further isosurface of a volume, where surfaces are transparent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shell {
    /// Its isovalue, in the volume's values.
    pub iso: f64,
    /// Its colour.
    pub color: Color,
    /// Its opacity, 0 to 1.
    pub opacity: f32,
}

/// How one volume is shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// The isovalue, in the volume's values (HU where the file says so).
    pub iso: f64,
    /// Colour of its surface.
    pub color: Color,
    /// Opacity where it is drawn transparent.
    pub opacity: f32,
    /// Colour of its surface seen from within the bone, where surfaces are transparent; the same as outside when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inner_color: Option<Color>,
    /// Further isosurfaces, where surfaces are transparent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shells: Vec<Shell>,
    /// How [`Mode::Dvr`](crate::Mode::Dvr) shows it; as bone, in its own colour, when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<TransferFunction>,
    /// Drawn or not.
    pub visible: bool,
    /// Registration: moves the volume in the world (mm to mm), after its own grid.
    pub transform: DAffine3,
    /// Root mean square distance that the registration leaves between landmarks, mm, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_mm: Option<f64>,
    /// How sure the registration is, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// The part of the scan that is meant; all of it when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<Within>,
}

/// A part of a scan, and what is done with it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Within {
    /// Its name.
    pub part: String,
    /// Only what lies within it is kept; else only what does not.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub keeps: bool,
    /// How far it is grown, mm; shrunk where negative.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub grow_mm: f64,
    /// How far behind its face bone is shaded by a blend of the two normals, mm.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rim_mm: f64,
    /// Whether what is measured is of the part, too, and not only what is seen.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub measures: bool,
    /// The space that is kept, on the scan's samples, once it has been found.
    #[serde(skip)]
    pub solid: Option<Arc<Solid>>,
}

fn yes() -> bool {
    true
}

fn is_yes(yes: &bool) -> bool {
    *yes
}

fn is_zero(n: &f64) -> bool {
    *n == 0.0
}

/// What agrees, where two scans are compared.
pub(crate) const AGREED: Color = Color(BONE);

/// Bone ivory, then cyan and magenta, so that the first two volumes of a comparison are told apart by anyone, and in grey; then amber.
const COLORS: [[f32; 3]; 4] = [BONE, [0.25, 0.75, 0.92], [0.85, 0.25, 0.6], [0.95, 0.75, 0.3]];

impl Layer {
    /// The space that is kept of it; none where all of it is.
    pub fn solid(&self) -> Option<Arc<Solid>> {
        self.within.as_ref().and_then(|within| within.solid.clone())
    }

    /// The space that is measured of it; none where all of it is.
    pub fn measured_solid(&self) -> Option<Arc<Solid>> {
        self.within.as_ref().filter(|within| within.measures).and_then(|within| within.solid.clone())
    }

    /// How far behind the face of its part normals are blended, mm.
    pub(crate) fn rim_mm(&self) -> f64 {
        self.within.as_ref().map_or(0.0, |within| within.rim_mm)
    }

    /// The layer that the volume opens with as number `index` of `count`.
    pub fn new(volume: &Volume, index: usize, count: usize) -> Self {
        // One skull looks best as bone; in company A is cyan and B is magenta.
        let color = if count == 1 { 0 } else { 1 + index % (COLORS.len() - 1) };
        Self {
            iso: volume.default_isovalue().0,
            color: Color(COLORS[color]),
            opacity: 0.45,
            inner_color: None,
            shells: vec![],
            transfer: None,
            visible: true,
            transform: DAffine3::IDENTITY,
            residual_mm: None,
            covariance: None,
            within: None,
        }
    }

    /// How its values are coloured.
    pub fn transfer_function(&self) -> TransferFunction {
        self.transfer.clone().unwrap_or_else(|| TransferFunction::bone_in(self.color))
    }

    /// The control points of its transfer function for its volume.
    pub fn controls(&self, volume: &Volume) -> Vec<Control> {
        self.transfer_function().controls(volume, self.iso)
    }
}

impl From<&Layer> for Measured {
    fn from(layer: &Layer) -> Self {
        Self {
            iso: layer.iso,
            transform: layer.transform,
            residual_mm: layer.residual_mm,
            covariance: layer.covariance.clone(),
            visible: layer.visible,
            solid: layer.measured_solid(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear red, green and blue as people see them who lack the cones for long, middle or short waves: Machado, Oliveira and Fernandes, "A
    /// physiologically-based model for simulation of color vision deficiency", IEEE TVCG 15 (2009), table 1, severity 1.
    const DEFICIENCIES: [[[f32; 3]; 3]; 3] = [
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    ];

    /// CIE 1976 L*a*b* of linear sRGB under D65.
    fn lab([r, g, b]: [f32; 3]) -> [f32; 3] {
        let dot = |row: [f32; 3], white: f32| (row[0] * r + row[1] * g + row[2] * b).max(0.0) / white;
        let [x, y, z] = [dot([0.4124, 0.3576, 0.1805], 0.9505), dot([0.2126, 0.7152, 0.0722], 1.0), dot([0.0193, 0.1192, 0.9505], 1.089)]
            .map(|t| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    #[test]
    fn the_colours_of_a_comparison_are_told_apart_by_anyone_and_in_grey() {
        // Fails if cyan, magenta or bone look alike to people who lack a kind of cones, or A and B come out of a grey printer alike. A
        // difference of 2.3 is just noticed side by side; ten times that is told apart on different bones.
        let linear = |c: [f32; 3]| c.map(|v| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) });
        let seen = |eye: &[[f32; 3]; 3], c: [f32; 3]| {
            lab(eye.map(|row| row.iter().zip(linear(c)).map(|(m, v)| m * v).sum::<f32>().clamp(0.0, 1.0)))
        };
        let healthy = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let pairs = [[0, 1], [0, 2], [1, 2]];
        for eye in [healthy].iter().chain(&DEFICIENCIES) {
            for [a, b] in pairs {
                let away = seen(eye, COLORS[a]).iter().zip(seen(eye, COLORS[b])).map(|(p, q)| (p - q).powi(2)).sum::<f32>().sqrt();
                assert!(away > 23.0, "{a} and {b}: {away}");
            }
        }
        let grey = [0, 1, 2].map(|n| lab(linear(COLORS[n]))[0]);
        println!("lightness of bone, A and B: {grey:?}");
        assert!(pairs.iter().all(|[a, b]| (grey[*a] - grey[*b]).abs() > 10.0), "{grey:?}");
    }
}
