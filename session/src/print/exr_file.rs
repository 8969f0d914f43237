//! OpenEXR: linear light in 32-bit floats, with opacity, depth in mm and the number of the scan as channels of their own.

use super::canvas::Canvas;
use super::encoding::Failure;
use exr::image::Blocks;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, LineOrder, ReadChannels, ReadLayers, SmallVec, Text, WritableImage, read,
};
use std::io::Cursor;

/// The name of the attribute that says what was drawn.
const ATTRIBUTE: &str = "bregma";
/// Depth and numbers are layers: what stands before the dot.
const DEPTH: &str = "depth.Z";
const VOLUME: &str = "volume.id";

/// A sheet with its marks; depth and numbers are those of the scans, whatever marks lie over them.
pub fn encode(canvas: &Canvas, record: Option<&str>) -> Result<Vec<u8>, Failure> {
    let light = canvas.painted();
    let of = |channel: usize| FlatSamples::F32(light.iter().map(|pixel| pixel[channel]).collect());
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (n, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        channels.push(AnyChannel::new(name, of(n)));
    }
    if let Some(middles) = &canvas.middles {
        channels.push(AnyChannel::new(DEPTH, FlatSamples::F32(middles.depth_mm.clone())));
        channels.push(AnyChannel::new(VOLUME, FlatSamples::U32(middles.volume_id.iter().map(|id| u32::from(*id)).collect())));
    }
    let size = (canvas.size[0] as usize, canvas.size[1] as usize);
    let mut about = LayerAttributes {
        software_name: Some(Text::from(concat!("bregma ", env!("CARGO_PKG_VERSION")))),
        horizontal_density: canvas.dpi.map(|dpi| dpi as f32),
        ..LayerAttributes::default()
    };
    if let Some(record) = record {
        about.other.insert(Text::from(ATTRIBUTE), AttributeValue::Text(Text::from(record)));
    }
    let encoding = Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = Layer::new(size, about, encoding, AnyChannels::sort(channels));
    let whole = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let mut bytes = Cursor::new(vec![]);
    Image::new(whole, layer).write().non_parallel().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// The text that says what was drawn.
pub fn record(bytes: &[u8]) -> Option<String> {
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).ok()?;
    match meta.headers.first()?.own_attributes.other.get(&Text::from(ATTRIBUTE))? {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}

/// The channels of light.
pub fn channels(bytes: &[u8]) -> Option<Vec<f32>> {
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.non_parallel().from_buffered(Cursor::new(bytes)).ok()?;
    let light = image.layer_data.channel_data.list.iter().filter(|channel| !channel.name.to_string().contains('.'));
    Some(light.flat_map(|channel| channel.sample_data.values_as_f32().collect::<Vec<_>>()).collect())
}
