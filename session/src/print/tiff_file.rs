//! TIFF: 8 or 16 bits, LZW, sRGB or a printer's inks by its profile, with its size on paper; opacity only where the ground is clear.

use super::canvas::Canvas;
use super::encoding::{Encoding, Failure};
use super::inks::{Inks, srgb_profile};
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::encoder::colortype::{CMYK8, CMYK16, ColorType, RGB8, RGB16};
use tiff::encoder::{Compression, Predictor, Rational, TiffEncoder, TiffValue};
use tiff::tags::{ExtraSamples, ResolutionUnit, Tag, Type};

/// A sheet with its marks.
pub fn encode(canvas: &Canvas, encoding: &Encoding, record: Option<&str>) -> Result<Vec<u8>, Failure> {
    let light = canvas.painted();
    if let Some(icc) = &encoding.icc {
        let inks = Inks::read(icc)?;
        return if encoding.is_deep {
            written::<CMYK16>(canvas, &inks.words(&canvas.words(&light))?, &inks.profile, record)
        } else {
            written::<CMYK8>(canvas, &inks.bytes(&canvas.bytes(&light))?, &inks.profile, record)
        };
    }
    let profile = srgb_profile()?;
    if encoding.is_deep {
        written::<RGB16>(canvas, &canvas.words(&light), &profile, record)
    } else {
        written::<RGB8>(canvas, &canvas.bytes(&light), &profile, record)
    }
}

fn written<C: ColorType>(canvas: &Canvas, pixels: &[C::Inner], profile: &[u8], record: Option<&str>) -> Result<Vec<u8>, Failure>
where
    [C::Inner]: TiffValue,
{
    let mut bytes = Cursor::new(vec![]);
    let mut encoder = TiffEncoder::new(&mut bytes)?.with_compression(Compression::Lzw).with_predictor(Predictor::Horizontal);
    let mut image = encoder.new_image::<C>(canvas.size[0], canvas.size[1])?;
    if canvas.is_clear {
        image.extra_samples(&[ExtraSamples::UnassociatedAlpha])?;
    }
    if let Some(dpi) = canvas.dpi {
        // To a thousandth of a dot.
        image.resolution(ResolutionUnit::Inch, Rational { n: (dpi * 1000.0).round() as u32, d: 1000 });
    }
    image.encoder().write_tag(Tag::Software, concat!("bregma ", env!("CARGO_PKG_VERSION")))?;
    if let Some(record) = record {
        image.encoder().write_tag(Tag::ImageDescription, ascii(record).as_str())?;
    }
    image.encoder().write_tag(Tag::IccProfile, Undefined(profile))?;
    image.write_data(pixels)?;
    Ok(bytes.into_inner())
}

/// Bytes that the file says nothing about, as it has to of profiles.
struct Undefined<'a>(&'a [u8]);

impl TiffValue for Undefined<'_> {
    const BYTE_LEN: u8 = 1;
    const FIELD_TYPE: Type = Type::UNDEFINED;

    fn count(&self) -> usize {
        self.0.len()
    }

    fn data(&self) -> std::borrow::Cow<'_, [u8]> {
        self.0.into()
    }
}

/// JSON without a letter beyond ASCII, which TIFF's texts are made of.
fn ascii(json: &str) -> String {
    let mut units = [0; 2];
    let escaped = |c: char| {
        if c.is_ascii() {
            return c.to_string();
        }
        c.encode_utf16(&mut units).iter().map(|unit| format!("\\u{unit:04x}")).collect()
    };
    json.chars().map(escaped).collect()
}

/// The text that says what was drawn.
pub fn record(bytes: &[u8]) -> Option<String> {
    Decoder::new(Cursor::new(bytes)).ok()?.get_tag_ascii_string(Tag::ImageDescription).ok()
}

/// The channels, each from 0 to 1.
pub fn channels(bytes: &[u8]) -> Option<Vec<f32>> {
    match Decoder::new(Cursor::new(bytes)).ok()?.read_image().ok()? {
        DecodingResult::U8(pixels) => Some(pixels.iter().map(|b| f32::from(*b) / 255.0).collect()),
        DecodingResult::U16(pixels) => Some(pixels.iter().map(|b| f32::from(*b) / 65535.0).collect()),
        _ => None,
    }
}
