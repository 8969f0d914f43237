//! PNG: 8 or 16 bits, sRGB, with its size on paper.

use super::canvas::Canvas;
use super::encoding::Failure;
use png::{BitDepth, ColorType, Encoder, PixelDimensions, SrgbRenderingIntent, Unit};

/// The name of the text that says what was drawn.
const KEYWORD: &str = "bregma";

/// A sheet with its marks.
pub fn encode(canvas: &Canvas, is_deep: bool, record: Option<&str>) -> Result<Vec<u8>, Failure> {
    let light = canvas.painted();
    // 16 bits are written with the higher byte first.
    let bytes = if is_deep { canvas.words(&light).iter().flat_map(|word| word.to_be_bytes()).collect() } else { canvas.bytes(&light) };
    encode_bytes(canvas, if is_deep { BitDepth::Sixteen } else { BitDepth::Eight }, &bytes, record)
}

/// Pixels that are encoded already.
pub fn encode_bytes(canvas: &Canvas, depth: BitDepth, pixels: &[u8], record: Option<&str>) -> Result<Vec<u8>, Failure> {
    let mut bytes = vec![];
    let mut encoder = Encoder::new(&mut bytes, canvas.size[0], canvas.size[1]);
    encoder.set_color(if canvas.is_clear { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(depth);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_pixel_dims(canvas.dpi.map(|dpi| {
        let per_metre = (dpi / 0.0254).round() as u32;
        PixelDimensions { xppu: per_metre, yppu: per_metre, unit: Unit::Meter }
    }));
    if let Some(record) = record {
        encoder.add_itxt_chunk(KEYWORD.into(), record.into())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// The text that says what was drawn.
pub fn record(bytes: &[u8]) -> Option<String> {
    let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
    let text = reader.info().utf8_text.iter().find(|text| text.keyword == KEYWORD)?;
    text.get_text().ok()
}

/// The channels, each from 0 to 1.
pub fn channels(bytes: &[u8]) -> Option<Vec<f32>> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut pixels).ok()?;
    let pixels = &pixels[..info.buffer_size()];
    Some(match info.bit_depth {
        BitDepth::Sixteen => pixels.chunks_exact(2).map(|b| f32::from(u16::from_be_bytes([b[0], b[1]])) / 65535.0).collect(),
        _ => pixels.iter().map(|b| f32::from(*b) / 255.0).collect(),
    })
}
