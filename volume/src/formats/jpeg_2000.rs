//! Grey pictures packed by JPEG 2000, as codestreams or in the boxes of `.jp2`.

use super::ReadError;

/// What a picture's header says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Head {
    /// Samples along i and j.
    pub dims: [usize; 2],
    /// Bits that are coded.
    pub bits: u32,
    /// Samples have signs.
    pub signed: bool,
}

fn damaged(error: &dyn std::fmt::Display) -> ReadError {
    ReadError::Damaged(format!("as JPEG 2000, {error}"))
}

fn open(packed: &[u8]) -> Result<(hayro_jpeg2000::Image<'_>, Head), ReadError> {
    let image = hayro_jpeg2000::Image::new(packed, &hayro_jpeg2000::DecodeSettings::default()).map_err(|e| damaged(&e))?;
    let dims = [image.width() as usize, image.height() as usize];
    let head = Head { dims, bits: u32::from(image.original_bit_depth()).clamp(1, 32), signed: is_signed(packed) };
    Ok((image, head))
}

/// Looks at a picture.
pub fn look(packed: &[u8]) -> Result<Head, ReadError> {
    Ok(open(packed)?.1)
}

/// Unpacks a picture of samples that `n` bytes hold, little-endian, once `check` has seen its header. With loss, samples come out beyond the ends of
/// their bits: they are held there (ISO 15444-1, G.1), and within `range`.
pub fn decode(
    packed: &[u8],
    n: usize,
    range: impl Fn(&Head) -> Option<[i64; 2]>,
    check: impl Fn(&Head) -> Result<(), ReadError>,
) -> Result<Vec<u8>, ReadError> {
    let (image, head) = open(packed)?;
    check(&head)?;
    let mut context = hayro_jpeg2000::DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(|e| damaged(&e))?;
    let [component] = decoded.components() else {
        return Err(ReadError::Unsupported("it holds colours, packed by JPEG 2000; only grey values can be read".into()));
    };
    // The decoder takes signed samples as unsigned ones around the middle of their range.
    let offset = if head.signed { 1_i64 << (head.bits - 1) } else { 0 };
    let coded = [-offset, (1_i64 << head.bits) - 1 - offset];
    // Both hold 0, so that the ends are in order.
    let [low, high] = range(&head).map_or(coded, |[low, high]| [coded[0].max(low), coded[1].min(high)]);
    let held = |v: f32| (v.round() as i64 - offset).clamp(low, high);
    Ok(component.samples().iter().flat_map(|&v| held(v).to_le_bytes().into_iter().take(n)).collect())
}

/// Whether the first component of a JPEG 2000 codestream is signed: the top bit of Ssiz, the 43rd byte of a codestream.
fn is_signed(bytes: &[u8]) -> bool {
    // A boxed file has its codestream later; SOC and SIZ begin it.
    let begin = bytes.windows(4).position(|w| w == [0xff, 0x4f, 0xff, 0x51]);
    begin.and_then(|b| bytes.get(b + 42)).is_some_and(|ssiz| ssiz & 0x80 != 0)
}
