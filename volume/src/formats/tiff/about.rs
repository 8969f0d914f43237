//! What a TIFF's description says beside its pages: by ImageJ, OME or this program.

use super::super::units::unit_mm;
use super::super::{Hints, NO_DIRECTIONS, NO_SPACING, ReadError};
use crate::{Grid, Metadata, Unit};
use glam::{DAffine3, DMat3, DVec3};
use std::collections::HashMap;
use std::io::{Read, Seek};
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// What a description says beside the page.
#[derive(Default)]
pub struct About {
    /// Sample spacing, where it is stated.
    pub spacing_mm: Option<DVec3>,
    /// Index to LPS mm, where this program wrote it.
    to_world: Option<DAffine3>,
    /// Slices that ImageJ says there are.
    pub images: Option<usize>,
    /// Slope and intercept.
    pub scale: (f64, f64),
    /// What a value is.
    pub unit: Option<Unit>,
    /// What else it says.
    pub rest: Metadata,
}

/// The line by which a file of this program keeps its whole geometry: 12 numbers, columns of index to LPS mm.
pub const TO_WORLD: &str = "index_to_lps_mm";
/// The lines of ImageJ that are about the page itself.
pub const IMAGEJ: [&str; 19] = [
    "ImageJ",
    "images",
    "slices",
    "channels",
    "frames",
    "hyperstack",
    "mode",
    "unit",
    "yunit",
    "zunit",
    "spacing",
    "loop",
    "min",
    "max",
    "c0",
    "c1",
    "cf",
    "vunit",
    "finterval",
];

impl About {
    /// What `description` says of the page that the decoder is at.
    pub fn of<R: Read + Seek>(description: &str, decoder: &mut Decoder<R>) -> Result<Self, ReadError> {
        let mut about = Self { scale: (1.0, 0.0), ..Self::default() };
        if description.contains("<OME") {
            for many in ["SizeC", "SizeT"] {
                let stated = description.split_once(&format!("{many}=\"")).and_then(|(_, rest)| rest.split('"').next());
                one_scan(many, stated.and_then(|n| n.trim().parse().ok()))?;
            }
            about.spacing_mm = ome_spacing_mm(description);
            return Ok(about);
        }
        if !description.starts_with("ImageJ=") {
            return Ok(about);
        }
        let fields: HashMap<&str, &str> = description.lines().filter_map(|l| l.split_once('=')).collect();
        let number = |name: &str| fields.get(name).and_then(|v| v.trim().parse::<f64>().ok()).filter(|v| v.is_finite());
        for many in ["channels", "frames"] {
            one_scan(many, number(many))?;
        }
        let mut per_unit = |tag| {
            let value = decoder.find_tag(tag).ok().flatten()?;
            let value = match value {
                tiff::decoder::ifd::Value::Rational(n, d) => f64::from(n) / f64::from(d),
                value => value.into_f64().ok()?,
            };
            (value.is_finite() && value > 0.0).then_some(value)
        };
        // y and z have units of their own where they differ from that of x.
        let mm = |name: &str| unit_mm(fields.get(name).or(fields.get("unit"))?);
        let units = mm("unit").zip(mm("yunit")).zip(mm("zunit"));
        if let (Some(((mm_x, mm_y), mm_z)), Some(x), Some(y)) = (units, per_unit(Tag::XResolution), per_unit(Tag::YResolution)) {
            // ImageJ leaves a spacing of 1 out (FileSaver's getDescriptionString).
            let z = number("spacing").map_or(1.0, f64::abs);
            about.spacing_mm = Some(DVec3::new(mm_x / x, mm_y / y, mm_z * z));
        }
        // A straight line of calibration: value = c0 + c1·sample.
        if let (Some(c0), Some(c1), None | Some(0.0)) = (number("c0"), number("c1"), number("cf")) {
            about.scale = (c1, c0);
        }
        about.unit = match fields.get("vunit").map(|u| u.trim()) {
            Some("HU") => Some(Unit::Hounsfield),
            Some("value") => Some(Unit::Value),
            _ => None,
        };
        about.images = number("images").filter(|n| *n >= 1.0 && *n < 1e9).map(|n| n as usize);
        let numbers = fields.get(TO_WORLD).map(|t| t.split_whitespace().filter_map(|n| n.parse().ok()).collect::<Vec<f64>>());
        about.to_world = numbers.and_then(|n| n.try_into().ok()).map(|n: [f64; 12]| DAffine3::from_cols_array(&n));
        let own = |key: &str| IMAGEJ.contains(&key) || key == TO_WORLD;
        about.rest = fields.iter().filter(|(k, _)| !own(k)).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        Ok(about)
    }

    /// The grid, and whether its spacing is known.
    pub fn grid(&self, dims: [usize; 3], hints: &Hints, warnings: &mut Vec<String>) -> Result<(Grid, bool), ReadError> {
        if let Some(map) = self.to_world {
            return Ok((Grid::from_affine(dims, map)?, true));
        }
        let spacing_mm = self.spacing_mm.or(hints.spacing_mm);
        if spacing_mm.is_none() {
            warnings.push(NO_SPACING.into());
        }
        warnings.push(NO_DIRECTIONS.into());
        let grid = Grid::new(dims, spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
        Ok((grid, spacing_mm.is_some()))
    }
}

/// Refuses what interleaves several scans in one stack of pages.
fn one_scan(what: &str, count: Option<f64>) -> Result<(), ReadError> {
    match count {
        Some(n) if n > 1.0 => {
            Err(ReadError::Unsupported(format!("it holds several scans in one stack ({what} {n}); split it, and open one")))
        }
        _ => Ok(()),
    }
}

/// `PhysicalSizeX` and its like in the first `Pixels` of OME's XML; micrometres unless they say otherwise.
fn ome_spacing_mm(xml: &str) -> Option<DVec3> {
    let mut reader = quick_xml::Reader::from_str(xml);
    loop {
        let element = match reader.read_event().ok()? {
            quick_xml::events::Event::Eof => return None,
            quick_xml::events::Event::Start(e) | quick_xml::events::Event::Empty(e) => e,
            _ => continue,
        };
        if element.local_name().as_ref() != b"Pixels" {
            continue;
        }
        let text = |name: &str| Some(String::from_utf8_lossy(&element.try_get_attribute(name).ok()??.value).into_owned());
        let mm = |axis: &str| {
            let size: f64 = text(&format!("PhysicalSize{axis}"))?.parse().ok()?;
            let unit = text(&format!("PhysicalSize{axis}Unit")).map_or(Some(1e-3), |u| unit_mm(&u))?;
            (size.is_finite() && size > 0.0).then_some(size * unit)
        };
        return Some(DVec3::new(mm("X")?, mm("Y")?, mm("Z")?));
    }
}
