//! JPEG: 8 bits of quality 95, sRGB, with its size on paper.

use super::canvas::Canvas;
use super::encoding::Failure;
use super::inks::srgb_profile;
use image::codecs::jpeg::{JpegEncoder, PixelDensity};
use image::{ExtendedColorType, ImageEncoder};

const QUALITY: u8 = 95;
/// A comment, and what those begin with that say what was drawn: their number, and of how many, follow.
const COMMENT: [u8; 2] = [0xff, 0xfe];
const MARK: &[u8] = b"bregma ";
/// A comment holds no more.
const LONGEST: usize = 65_000;

/// A sheet with its marks.
pub fn encode(canvas: &Canvas, record: Option<&str>) -> Result<Vec<u8>, Failure> {
    let pixels = canvas.bytes(&canvas.painted());
    let mut bytes = vec![];
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    if let Some(dpi) = canvas.dpi {
        encoder.set_pixel_density(PixelDensity::dpi(dpi.round() as u16));
    }
    encoder.set_icc_profile(srgb_profile()?)?;
    encoder.write_image(&pixels, canvas.size[0], canvas.size[1], ExtendedColorType::Rgb8)?;
    if let Some(record) = record {
        let comments = record.as_bytes().chunks(LONGEST).flat_map(|part| {
            let length = (2 + MARK.len() + part.len()) as u16;
            [&COMMENT[..], &length.to_be_bytes(), MARK, part].concat()
        });
        // Behind the first segment, which says the size on paper.
        let first = 4 + usize::from(u16::from_be_bytes([bytes[4], bytes[5]]));
        let comments: Vec<u8> = comments.collect();
        bytes.splice(first..first, comments);
    }
    Ok(bytes)
}

/// The text that says what was drawn.
pub fn record(bytes: &[u8]) -> Option<String> {
    let (mut at, mut record) = (2, vec![]);
    // Segments come one behind the other until the pixels begin.
    while let [0xff, kind, high, low] = *bytes.get(at..at + 4)? {
        let end = at + 2 + usize::from(u16::from_be_bytes([high, low]));
        if kind == COMMENT[1]
            && let Some(part) = bytes.get(at + 4..end)?.strip_prefix(MARK)
        {
            record.extend_from_slice(part);
        }
        if kind == 0xda {
            break;
        }
        at = end;
    }
    (!record.is_empty()).then(|| String::from_utf8(record).ok()).flatten()
}

/// The channels, each from 0 to 1.
pub fn channels(bytes: &[u8]) -> Option<Vec<f32>> {
    let image = image::load_from_memory_with_format(bytes, image::ImageFormat::Jpeg).ok()?;
    Some(image.to_rgb8().as_raw().iter().map(|b| f32::from(*b) / 255.0).collect())
}
