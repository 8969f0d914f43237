//! Writing: a page for each slice, not packed, with ImageJ's description and, in a line of its own, the whole geometry.

use super::super::write::{WriteError, lines, whole};
use super::about::{IMAGEJ, TO_WORLD};
use crate::{Progress, ReadSamples, Samples, Unit, Volume};
use std::io::{self, Seek, Write};
use std::path::Path;
use tiff::encoder::colortype::{ColorType, Gray8, Gray16, Gray32Float, GrayI16};
use tiff::encoder::{Rational, TiffEncoder, TiffKind, TiffValue};
use tiff::tags::{ResolutionUnit, Tag};

/// Beyond this a file is written as BigTIFF: offsets of 32 bits end at 4 GiB, and pages have some bytes of their own.
const BIG: usize = 3 << 30;

/// Writes `volume` to `path`. Gives sentences about what TIFF has no place for.
pub fn write(path: &Path, volume: &Volume, progress: &Progress) -> Result<Vec<String>, WriteError> {
    whole(path, volume, progress, |out| match volume.sample_bytes() > BIG {
        true => all_pages(TiffEncoder::new_big(out).map_err(io::Error::other)?, volume, progress),
        false => all_pages(TiffEncoder::new(out).map_err(io::Error::other)?, volume, progress),
    })?;
    let text = "TIFF has no place for origin and directions; they are in a line of its description that only this program reads";
    Ok(vec![text.into()])
}

fn all_pages<W: Write + Seek, K: TiffKind>(tiff: TiffEncoder<W, K>, volume: &Volume, progress: &Progress) -> io::Result<()> {
    match volume.samples() {
        Samples::U8(s) => pages::<Gray8, W, K>(tiff, volume, s, progress),
        Samples::I16(s) => pages::<GrayI16, W, K>(tiff, volume, s, progress),
        Samples::U16(s) => pages::<Gray16, W, K>(tiff, volume, s, progress),
        Samples::F32(s) => pages::<Gray32Float, W, K>(tiff, volume, s, progress),
    }
}

fn pages<C: ColorType, W: Write + Seek, K: TiffKind>(
    mut tiff: TiffEncoder<W, K>,
    volume: &Volume,
    samples: &[C::Inner],
    progress: &Progress,
) -> io::Result<()>
where
    [C::Inner]: TiffValue,
{
    let [nx, ny, _] = volume.grid().dims();
    let size = |n: usize| u32::try_from(n).map_err(|_| io::Error::other("a slice is too large for TIFF"));
    let spacing = volume.grid().spacing_mm();
    for (k, slice) in samples.chunks(nx * ny).enumerate() {
        let mut page = tiff.new_image::<C>(size(nx)?, size(ny)?).map_err(io::Error::other)?;
        page.resolution_unit(ResolutionUnit::None);
        page.x_resolution(per_mm(spacing.x));
        page.y_resolution(per_mm(spacing.y));
        if k == 0 {
            page.encoder().write_tag(Tag::ImageDescription, description(volume).as_str()).map_err(io::Error::other)?;
        }
        page.write_data(slice).map_err(io::Error::other)?;
        progress.advance(size_of_val(slice) as u64).map_err(io::Error::other)?;
    }
    Ok(())
}

/// Samples in a millimetre, to nine digits where 32 bits allow it.
fn per_mm(spacing_mm: f64) -> Rational {
    let d = (f64::from(u32::MAX) * spacing_mm).clamp(1.0, 1e9).floor();
    Rational { n: (d / spacing_mm).round().clamp(1.0, f64::from(u32::MAX)) as u32, d: d as u32 }
}

fn description(volume: &Volume) -> String {
    let (grid, nz) = (volume.grid(), volume.grid().dims()[2]);
    let unit = if volume.unit() == Unit::Hounsfield { "HU" } else { "value" };
    let scale = match (volume.slope(), volume.intercept()) {
        (1.0, 0.0) => String::new(),
        (slope, intercept) => format!("cf=0\nc0={intercept}\nc1={slope}\n"),
    };
    let map = grid.index_to_world().to_cols_array().map(|v| v.to_string()).join(" ");
    let metadata = lines(volume, "=", |key| IMAGEJ.contains(&key) || key == TO_WORLD);
    // TIFF's text is ASCII; what else there is in a line becomes a question mark.
    let ascii = |text: String| text.chars().map(|c| if c.is_ascii() && c != '\0' { c } else { '?' }).collect::<String>();
    ascii(format!(
        "ImageJ=1.11a\nimages={nz}\nslices={nz}\nunit=mm\nspacing={}\n{scale}vunit={unit}\n{TO_WORLD}={map}\n{metadata}",
        grid.spacing_mm().z
    ))
}
