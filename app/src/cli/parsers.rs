//! Words and numbers of the command line. An error says what was expected; clap puts the option before it.

use bregma_field::formats::{RawLayoutError, Reduce, Uneven};
use bregma_field::{TransformForm, Turn, TurnError};
use bregma_measure::volumes::cavity::Disc;
use bregma_register::Part;
use bregma_renderer::{BodyPlane, Color, Named, Solver};
use bregma_session::{PartOf, Raw};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glam::DVec3;
use std::convert::Infallible;
use std::path::PathBuf;

/// One of some choices by its name.
pub fn one_of<T: Named + Send + Sync>() -> impl TypedValueParser<Value = T> {
    let words = T::ALL.iter().map(|one| PossibleValue::new(one.name()).help(one.what()));
    PossibleValuesParser::new(words).try_map(|word| T::named(&word).ok_or("none of the words"))
}

/// Behind the surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background(pub Option<Color>);

/// A plane of the body, through the middle of what is seen or at a place along its axis, mm; or any plane n·x = D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plane {
    Body(BodyPlane, Option<f64>),
    Free { normal: DVec3, offset_mm: f64 },
}

impl Default for Plane {
    fn default() -> Self {
        Self::Body(BodyPlane::Axial, None)
    }
}

impl Plane {
    /// Into the picture and up in it, and the point of it that lies nearest to `middle_mm`.
    pub fn through(self, middle_mm: DVec3) -> ([DVec3; 2], DVec3) {
        match self {
            Self::Body(plane, place_mm) => {
                let mut through_mm = middle_mm;
                through_mm[plane.axis()] = place_mm.unwrap_or(middle_mm[plane.axis()]);
                (plane.axes(), through_mm)
            }
            Self::Free { normal, offset_mm } => {
                // Superior is above, or anterior where one looks along it.
                let up = if normal.z.abs() < 0.9 { DVec3::Z } else { DVec3::NEG_Y };
                ([normal, up.reject_from_normalized(normal).normalize()], middle_mm + (offset_mm - normal.dot(middle_mm)) * normal)
            }
        }
    }
}

pub fn plane(text: &str) -> Result<Plane, String> {
    let (name, place) = text.split_once('@').map_or((text, None), |(name, place)| (name, Some(place)));
    if let Some(plane) = BodyPlane::named(name) {
        return Ok(Plane::Body(plane, place.map(number).transpose()?));
    }
    let wanted = || "neither axial, coronal or sagittal, as they are or with @ and a place in mm, nor NX,NY,NZ,D".to_owned();
    let [x, y, z, offset_mm] = numbers(text).map_err(|_| wanted())?;
    let normal = DVec3::new(x, y, z);
    let length = normal.length();
    if length > 0.0 { Ok(Plane::Free { normal: normal / length, offset_mm: offset_mm / length }) } else { Err(wanted()) }
}

pub fn number(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| "not a number".into())
}

/// The numbers of two scans, from 1.
pub fn two_scans(text: &str) -> Result<[usize; 2], String> {
    let parse = || {
        let (a, b) = text.split_once(',')?;
        Some([a.trim().parse().ok()?, b.trim().parse().ok()?]).filter(|[a, b]: &[usize; 2]| a != b && *a.min(b) > 0)
    };
    parse().ok_or_else(|| "not the numbers of two scans such as 1,3".into())
}

pub fn positive(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|&v| v > 0.0).ok_or_else(|| "not a positive number".into())
}

/// A length, which may be 0.
pub fn length(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|&v| v >= 0.0).ok_or_else(|| "not a length of 0 or more".into())
}

/// A number from 0 to 1.
pub fn share(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|v| (0.0..=1.0).contains(v)).ok_or_else(|| "not a number from 0 to 1".into())
}

pub fn field_of_view(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|&v| v > 0.0 && v < 180.0).ok_or_else(|| "not an angle between 0 and 180 degrees".into())
}

pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let parts: Result<Vec<f64>, String> = text.split(',').map(|t| number(t.trim())).collect();
    parts.ok().and_then(|p| p.try_into().ok()).ok_or_else(|| format!("not {N} numbers with commas between them"))
}

pub fn point(text: &str) -> Result<DVec3, String> {
    numbers::<3>(text).map(DVec3::from)
}

/// Two numbers, the second above the first.
pub fn range(text: &str) -> Result<[f64; 2], String> {
    let [low, high] = numbers(text)?;
    if low < high { Ok([low, high]) } else { Err("its low end is not below its high end".into()) }
}

/// Two numbers with dots between them, the second not below the first.
pub fn interval(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once("..").and_then(|(low, high)| Some([low.trim().parse().ok()?, high.trim().parse().ok()?]));
    ends.filter(|[low, high]: &[f64; 2]| low.is_finite() && high.is_finite() && low <= high)
        .ok_or_else(|| "it must be two numbers, the lower first, such as 100..400".to_owned())
}

pub fn pair(text: &str) -> Result<(f64, f64), String> {
    numbers::<2>(text).map(|[a, b]| (a, b))
}

pub fn ball(text: &str) -> Result<(DVec3, f64), String> {
    let [x, y, z, radius] = numbers::<4>(text)?;
    if radius > 0.0 { Ok((DVec3::new(x, y, z), radius)) } else { Err("its radius is not positive".into()) }
}

/// A ball by its centre and radius, or a box by two opposite corners.
pub fn part(text: &str) -> Result<Part, String> {
    if numbers::<4>(text).is_ok() {
        return ball(text).map(|(centre_mm, radius_mm)| Part::Ball { centre_mm, radius_mm });
    }
    let [x0, y0, z0, x1, y1, z1] =
        numbers(text).map_err(|_| "neither a ball (X,Y,Z,RADIUS) nor a box by two corners (X,Y,Z,X,Y,Z)".to_owned())?;
    let (a, b) = (DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1));
    if a.cmpeq(b).any() {
        Err("its corners leave no room between them".into())
    } else {
        Ok(Part::Box { low_mm: a.min(b), high_mm: a.max(b) })
    }
}

/// Where a cavity is.
#[derive(Clone, Debug, PartialEq)]
pub enum Seed {
    Point(DVec3),
    Landmark(String),
}

pub fn seed(text: &str) -> Result<Seed, String> {
    Ok(point(text).map_or_else(|_| Seed::Landmark(text.to_owned()), Seed::Point))
}

/// A lid by its middle, its normal and its radius.
pub fn disc(text: &str) -> Result<Disc, String> {
    let [x, y, z, nx, ny, nz, radius_mm] = numbers(text)?;
    let normal = DVec3::new(nx, ny, nz).try_normalize().ok_or("its normal 0,0,0 is no direction")?;
    if radius_mm > 0.0 { Ok(Disc { centre_mm: DVec3::new(x, y, z), normal, radius_mm }) } else { Err("its radius is not positive".into()) }
}

/// Two opposite corners of a box: the lowest and the highest.
pub fn corners(text: &str) -> Result<[DVec3; 2], String> {
    match part(text)? {
        Part::Box { low_mm, high_mm } => Ok([low_mm, high_mm]),
        Part::Ball { .. } => Err("not two opposite corners (X,Y,Z,X,Y,Z)".into()),
    }
}

/// What volumes are written to.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeFile {
    pub path: PathBuf,
    pub is_json: bool,
}

pub fn volume_file(text: &str) -> Result<VolumeFile, String> {
    let path = PathBuf::from(text);
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match ending.as_str() {
        "json" | "csv" => Ok(VolumeFile { path, is_json: ending == "json" }),
        _ => Err("volumes are written as .csv or .json".into()),
    }
}

pub fn spacing(text: &str) -> Result<DVec3, String> {
    point(text).ok().filter(|s| s.min_element() > 0.0).ok_or_else(|| "not three positive lengths with commas between them".into())
}

pub fn turn(text: &str) -> Result<Turn, String> {
    text.parse().map_err(|e: TurnError| e.to_string())
}

pub fn reduce(text: &str) -> Result<Reduce, String> {
    text.parse().ok().and_then(Reduce::every).ok_or_else(|| "neither 2 nor 4".into())
}

pub fn uneven(text: &str) -> Result<Uneven, String> {
    match text {
        "even" => Ok(Uneven::Even),
        "refuse" => Ok(Uneven::Refuse),
        "resample" => Ok(Uneven::Resample),
        _ => Err("none of `even`, `resample` and `refuse`".into()),
    }
}

pub fn part_of(text: &str) -> Result<PartOf, String> {
    text.parse().map_err(|never: Infallible| match never {})
}

pub fn raw(text: &str) -> Result<Raw, String> {
    text.parse().map_err(|e: RawLayoutError| e.to_string())
}

pub fn size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    // A picture of 16,384² is 1 GiB of colours and as much of depths.
    parsed.filter(|&(w, h)| (1..=16384).contains(&w) && (1..=16384).contains(&h)).ok_or_else(|| "not a size such as 1920x1080".into())
}

pub fn solver(text: &str) -> Result<Solver, String> {
    text.parse()
}

pub fn color(text: &str) -> Result<Color, String> {
    Color::from_hex(text).ok_or_else(|| "not a colour such as ead7b0".into())
}

pub fn background(text: &str) -> Result<Background, String> {
    match text {
        "transparent" | "clear" => Ok(Background(None)),
        "white" => Ok(Background(Some(Color([1.0; 3])))),
        _ => color(text).map(|c| Background(Some(c))).map_err(|e| format!("neither white nor clear, and {e}")),
    }
}

/// A file that a registration can be written to, by the ending of its name.
pub fn registration_file(text: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(text);
    TransformForm::of(&file).map(|_| file).ok_or_else(|| "no registration has this ending; use .json, .tfm, .txt or .h5".into())
}
