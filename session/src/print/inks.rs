//! Colours as inks, by the profile of a printer.

use super::encoding::{Failure, FileError};
use moxcms::{CmsError, ColorProfile, DataColorSpace, Layout, RenderingIntent, TransformOptions};
use std::path::Path;

/// What turns sRGB into cyan, magenta, yellow and black.
pub struct Inks {
    parsed: ColorProfile,
    /// The file as it is, which the picture carries.
    pub profile: Vec<u8>,
}

impl Inks {
    /// From a file.
    pub fn read(file: &Path) -> Result<Self, FileError> {
        let fail = |what: String| FileError::Profile { file: file.to_owned(), what };
        let profile = std::fs::read(file).map_err(|e| fail(format!("cannot be read ({e}); check its name and permissions")))?;
        let parsed = ColorProfile::new_from_slice(&profile).map_err(|e| fail(format!("is no ICC profile ({e})")))?;
        if parsed.color_space != DataColorSpace::Cmyk {
            return Err(fail("is no profile of four inks (CMYK); ask the printer or the journal for theirs".into()));
        }
        let inks = Self { parsed, profile };
        inks.bytes(&[255; 3]).map_err(|_| fail("does not say which inks a colour takes; ask for a printer's output profile".into()))?;
        Ok(inks)
    }

    /// The inks of sRGB pixels, four bytes each.
    pub fn bytes(&self, rgb: &[u8]) -> Result<Vec<u8>, Failure> {
        let transform = srgb().create_transform_8bit(Layout::Rgb, &self.parsed, Layout::Rgba, options())?;
        let mut inks = vec![0; rgb.len() / 3 * 4];
        transform.transform(rgb, &mut inks)?;
        Ok(inks)
    }

    /// The same with 16 bits.
    pub fn words(&self, rgb: &[u16]) -> Result<Vec<u16>, Failure> {
        let transform = srgb().create_transform_16bit(Layout::Rgb, &self.parsed, Layout::Rgba, options())?;
        let mut inks = vec![0; rgb.len() / 3 * 4];
        transform.transform(rgb, &mut inks)?;
        Ok(inks)
    }
}

/// Relative to the paper, so that a white ground has no ink.
fn options() -> TransformOptions {
    TransformOptions { rendering_intent: RenderingIntent::RelativeColorimetric, ..TransformOptions::default() }
}

fn srgb() -> ColorProfile {
    ColorProfile::new_srgb()
}

/// Where a profile says when it was made, and how: six numbers of 16 bits.
const DATE: std::ops::Range<usize> = 24..36;

/// The profile of sRGB, as files carry it.
pub fn srgb_profile() -> Result<Vec<u8>, CmsError> {
    let mut profile = srgb().encode()?;
    // The day of the standard (IEC 61966-2-1), not of today, so that a picture is the same file whenever it is written.
    if let Some(date) = profile.get_mut(DATE) {
        date.copy_from_slice(&[1999_u16, 10, 18, 0, 0, 0].map(u16::to_be_bytes).concat());
    }
    Ok(profile)
}
