//! MP4 of one track of H.264 (ISO/IEC 14496-12 and -15): all that players need and no more. The tables stand before the frames, so that a film
//! plays while it loads.

use super::coded::units;

/// What a film's frames are.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Frames in a second.
    pub fps: f64,
}

/// Ticks in a second: thousandths of each common rate are whole numbers of them.
const TICKS: u32 = 90_000;

/// A box of such a type.
fn boxed(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut bytes = (content.len() as u32 + 8).to_be_bytes().to_vec();
    bytes.extend(kind);
    bytes.extend(content);
    bytes
}

/// A box with a version and flags.
fn full(kind: &[u8; 4], version_flags: u32, content: &[u8]) -> Vec<u8> {
    boxed(kind, &[&version_flags.to_be_bytes(), content].concat())
}

fn words(all: &[u32]) -> Vec<u8> {
    all.iter().flat_map(|word| word.to_be_bytes()).collect()
}

/// The kinds of NAL units that are told apart (Recommendation ITU-T H.264, table 7-1).
const IDR: u8 = 5;
const SPS: u8 = 7;
const PPS: u8 = 8;

fn kind(unit: &[u8]) -> u8 {
    unit.first().map_or(0, |byte| byte & 31)
}

/// A film of access units in Annex B, one a frame.
pub fn written(shape: Shape, frames: &[Vec<u8>]) -> Vec<u8> {
    let (mut samples, mut keys, mut sets) = (vec![], vec![], [vec![], vec![]]);
    for (n, frame) in frames.iter().enumerate() {
        let mut sample = vec![];
        for unit in units(frame) {
            match kind(unit) {
                // Parameter sets stand in the tables; all frames have the same.
                SPS => sets[0] = unit.to_vec(),
                PPS => sets[1] = unit.to_vec(),
                what => {
                    if what == IDR && keys.last() != Some(&(n as u32 + 1)) {
                        keys.push(n as u32 + 1);
                    }
                    sample.extend((unit.len() as u32).to_be_bytes());
                    sample.extend(unit);
                }
            }
        }
        samples.push(sample);
    }
    let brand = boxed(b"ftyp", &[b"isom".as_slice(), &[0, 0, 2, 0], b"isomiso2avc1mp41"].concat());
    // The tables are as long wherever the frames begin.
    let length = movie(shape, &samples, &keys, &sets, 0).len();
    let data_at = brand.len() + length + 8;
    let tables = movie(shape, &samples, &keys, &sets, data_at as u32);
    [brand, tables, boxed(b"mdat", &samples.concat())].concat()
}

fn movie(shape: Shape, samples: &[Vec<u8>], keys: &[u32], sets: &[Vec<u8>; 2], data_at: u32) -> Vec<u8> {
    let per_frame = (f64::from(TICKS) / shape.fps).round() as u32;
    let duration = per_frame * samples.len() as u32;
    const UNITY: [u32; 9] = [1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30];
    let [width, height] = shape.size;
    let header =
        full(b"mvhd", 0, &[words(&[0, 0, TICKS, duration, 1 << 16, 1 << 24, 0, 0]), words(&UNITY), words(&[0; 6]), words(&[2])].concat());
    let track =
        full(b"tkhd", 3, &[words(&[0, 0, 1, 0, duration, 0, 0, 0, 0]), words(&UNITY), words(&[width << 16, height << 16])].concat());
    // "und": of no language.
    let media_header = full(b"mdhd", 0, &words(&[0, 0, TICKS, duration, 0x55c4_0000]));
    let handler = full(b"hdlr", 0, &[words(&[0]), b"vide".to_vec(), words(&[0; 3]), b"video\0".to_vec()].concat());
    let here = boxed(b"dinf", &full(b"dref", 0, &[words(&[1]), full(b"url ", 1, &[])].concat()));
    let sizes: Vec<u32> = samples.iter().map(|sample| sample.len() as u32).collect();
    let table = [
        full(b"stsd", 0, &[words(&[1]), sample_entry(shape, sets)].concat()),
        full(b"stts", 0, &words(&[1, samples.len() as u32, per_frame])),
        full(b"stss", 0, &[words(&[keys.len() as u32]), words(keys)].concat()),
        full(b"stsc", 0, &words(&[1, 1, samples.len() as u32, 1])),
        full(b"stsz", 0, &[words(&[0, samples.len() as u32]), words(&sizes)].concat()),
        full(b"stco", 0, &words(&[1, data_at])),
    ]
    .concat();
    let information = [full(b"vmhd", 1, &[0; 8]), here, boxed(b"stbl", &table)].concat();
    let media = [media_header, handler, boxed(b"minf", &information)].concat();
    boxed(b"moov", &[header, boxed(b"trak", &[track, boxed(b"mdia", &media)].concat())].concat())
}

/// What the frames are: their size, their parameter sets, and which colours they mean.
fn sample_entry(shape: Shape, [sps, pps]: &[Vec<u8>; 2]) -> Vec<u8> {
    let [width, height] = shape.size.map(|n| (n as u16).to_be_bytes());
    let profile = sps.get(1..4).unwrap_or(&[66, 0, 30]);
    let set = |set: &[u8]| [&(set.len() as u16).to_be_bytes(), set].concat();
    // Lengths of four bytes, one set of each kind.
    let avc = [&[1], profile, &[0xff, 0xe1], &set(sps), &[1], &set(pps)].concat();
    // BT.709 primaries, transfer and matrix, narrow range: sRGB's primaries, and players show its transfer as it is.
    let colors = [b"nclx".as_slice(), &[0, 1, 0, 1, 0, 1, 0]].concat();
    let mut name = [0; 32];
    name[..7].copy_from_slice(b"\x06bregma");
    let fixed = [
        &[0, 0, 0, 0, 0, 0, 0, 1][..],
        &[0; 16],
        &width,
        &height,
        &[0, 0x48, 0, 0, 0, 0x48, 0, 0],
        &[0; 4],
        &[0, 1],
        &name,
        &[0, 0x18, 0xff, 0xff],
    ]
    .concat();
    boxed(b"avc1", &[fixed, boxed(b"avcC", &avc), boxed(b"colr", &colors)].concat())
}
