//! Films as animated pictures: APNG, which loses nothing, and GIF, of 256 colours.

use super::FilmError;
use gif::{Encoder, Frame, Repeat};
use png::{BitDepth, ColorType, SrgbRenderingIntent};

fn failed(reason: impl std::fmt::Display) -> FilmError {
    FilmError::Encode(reason.to_string())
}

/// Frames of RGB pixels, one after the other, as APNG that begins anew for ever.
pub fn apng(size: [u32; 2], fps: f64, count: u32, mut frame: impl FnMut(u32) -> Result<Vec<u8>, FilmError>) -> Result<Vec<u8>, FilmError> {
    let mut bytes = vec![];
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_animated(count, 0).map_err(failed)?;
    // A frame stands for thousandths of a second.
    encoder.set_frame_delay((1000.0 / fps).round() as u16, 1000).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    for n in 0..count {
        writer.write_image_data(&frame(n)?).map_err(failed)?;
    }
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// How much of the pixels the choice of colours looks at: 1 all of them, 30 the least.
const COLOR_SPEED: i32 = 10;

/// The same as GIF, each frame with colours of its own.
pub fn gif(size: [u32; 2], fps: f64, count: u32, mut frame: impl FnMut(u32) -> Result<Vec<u8>, FilmError>) -> Result<Vec<u8>, FilmError> {
    let side = |n: u32| u16::try_from(n).map_err(failed);
    let (width, height) = (side(size[0])?, side(size[1])?);
    let mut bytes = vec![];
    let mut encoder = Encoder::new(&mut bytes, width, height, &[]).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    for n in 0..count {
        let mut picture = Frame::from_rgb_speed(width, height, &frame(n)?, COLOR_SPEED);
        // Frames stand for hundredths: what rounding takes from one the next gives back.
        let at = |n: u32| (f64::from(n) * 100.0 / fps).round() as u16;
        picture.delay = at(n + 1).wrapping_sub(at(n));
        encoder.write_frame(&picture).map_err(failed)?;
    }
    drop(encoder);
    Ok(bytes)
}
