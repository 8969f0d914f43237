//! The samples of one frame, as they are stored: unpacked, and with the bits beside them cleared.

use super::super::ReadError;
use super::super::decode::SampleType;
use super::super::jpeg_2000;
use super::super::packing::{MOST_BLANK, MOST_EXPANSION, check_expansion_to};
use super::super::part::read_all;
use super::header::{BIG_ENDIAN, Header, Pixels};
use super::jpeg_lossless;
use crate::Progress;
use dicom_dictionary_std::tags;
use std::io::Read;

/// How samples are stored; the same for all frames of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Storing {
    /// Samples along i and j.
    pub dims: [usize; 2],
    /// Their type.
    pub sample: SampleType,
    bits: u32,
    /// Bits below the lowest of a sample.
    shift: u32,
    signed: bool,
}

/// How the pixels of a transfer syntax are packed.
#[derive(Clone, Copy, PartialEq)]
enum Codec {
    Native,
    Jpeg,
    Jpeg2000,
    JpegLs,
    Rle,
}

impl Codec {
    /// Bytes that a byte unpacks to, at most. JPEG 2000 leaves what is blank out, and JPEG-LS counts runs. The others stay below deflate's ratio:
    /// JPEG spends at least a bit on a block of 64 samples.
    fn most_expansion(self) -> u64 {
        match self {
            Self::Jpeg2000 | Self::JpegLs => MOST_BLANK,
            Self::Native | Self::Jpeg | Self::Rle => MOST_EXPANSION,
        }
    }
}

fn codec(header: &Header) -> Result<Codec, ReadError> {
    match header.syntax.uid() {
        "1.2.840.10008.1.2" | "1.2.840.10008.1.2.1" | "1.2.840.10008.1.2.1.99" | "1.2.840.10008.1.2.2" => Ok(Codec::Native),
        "1.2.840.10008.1.2.4.50" | "1.2.840.10008.1.2.4.51" | "1.2.840.10008.1.2.4.57" | "1.2.840.10008.1.2.4.70" => Ok(Codec::Jpeg),
        "1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91" => Ok(Codec::Jpeg2000),
        "1.2.840.10008.1.2.4.80" | "1.2.840.10008.1.2.4.81" => Ok(Codec::JpegLs),
        "1.2.840.10008.1.2.5" => Ok(Codec::Rle),
        uid => {
            let name = header.syntax.name();
            let text = format!("its pixels are packed by {name} ({uid}), which is not read here; {UNPACK}");
            Err(ReadError::Unsupported(text))
        }
    }
}

/// What to do with pixels that are not read.
const UNPACK: &str = "unpack it first, as with pydicom's Dataset.decompress()";

impl Storing {
    /// One sample of `bits` bits in 16.
    #[cfg(test)]
    pub fn plain(bits: u32, signed: bool) -> Self {
        Self { dims: [1, 1], sample: if signed { SampleType::I16 } else { SampleType::U16 }, bits, shift: 0, signed }
    }

    /// How `header` says that samples are stored; refused when they are no single numbers, or cannot be unpacked here.
    pub fn of(header: &Header) -> Result<Self, ReadError> {
        let dims = [header.size(tags::COLUMNS, "Columns")?, header.size(tags::ROWS, "Rows")?];
        let allocated = header.size(tags::BITS_ALLOCATED, "BitsAllocated")?;
        let bits = header.small(tags::BITS_STORED).unwrap_or(allocated);
        let high = header.small(tags::HIGH_BIT).unwrap_or(bits.saturating_sub(1));
        let signed = header.number(tags::PIXEL_REPRESENTATION, 0) == Some(1.0);
        let parts = header.number(tags::SAMPLES_PER_PIXEL, 0).unwrap_or(1.0);
        if parts != 1.0 {
            return Err(ReadError::Unsupported(format!("its pixels have {parts} numbers each (colours); only grey values can be read")));
        }
        let sample = match (allocated, signed) {
            (8, false) => SampleType::U8,
            (8, true) => SampleType::I8,
            (16, false) => SampleType::U16,
            (16, true) => SampleType::I16,
            (32, false) => SampleType::U32,
            (32, true) => SampleType::I32,
            (n, _) => return Err(ReadError::Unsupported(format!("its samples have {n} bits; only 8, 16 and 32 can be read"))),
        };
        if !(1..=allocated).contains(&bits) || high + 1 < bits || high >= allocated {
            let text = format!("of {allocated} bits of a sample {bits} are used, up to bit {high}");
            return Err(ReadError::Contradiction(text));
        }
        codec(header)?;
        Ok(Self { dims, sample, bits: bits as u32, shift: (high + 1 - bits) as u32, signed })
    }

    /// Lowest and highest number that its bits can hold.
    pub fn range(&self) -> [i64; 2] {
        if self.signed { [-(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1] } else { [0, (1 << self.bits) - 1] }
    }

    /// What `value` becomes when only the bits of a sample are left of it.
    pub fn cut(&self, value: i64) -> i64 {
        let spare = 64 - self.bits;
        let high = value << spare;
        if self.signed { high >> spare } else { (high as u64 >> spare) as i64 }
    }

    fn bytes(&self) -> u64 {
        self.dims[0] as u64 * self.dims[1] as u64 * self.sample.bytes() as u64
    }

    /// Refuses a file whose pixels, by its own length, cannot be there.
    pub fn check(&self, header: &Header) -> Result<(), ReadError> {
        let (frames, wanted) = (header.frames() as u128, u128::from(self.bytes()));
        match &header.pixels {
            None => Err(ReadError::NoImages),
            // Of a deflated file only reading it tells.
            Some(Pixels::Native(_)) if header.is_deflated() => check_expansion_to(wanted * frames, header.entry.bytes, MOST_EXPANSION),
            Some(Pixels::Native(at)) => {
                let there = header.entry.bytes.saturating_sub(header.start + at);
                if wanted * frames > u128::from(there) { Err(ReadError::Truncated { wanted: wanted * frames, there }) } else { Ok(()) }
            }
            Some(Pixels::Fragments(_, fragments)) => {
                let packed = fragments.iter().map(|(_, bytes)| u64::from(*bytes)).sum();
                check_expansion_to(wanted * frames, packed, codec(header)?.most_expansion())
            }
        }
    }

    /// The samples of frame `frame`, little-endian, in `buffer` where they are not packed.
    pub fn read(&self, header: &Header, frame: usize, buffer: Vec<u8>, progress: &Progress) -> Result<Vec<u8>, ReadError> {
        let wanted = self.bytes() as usize;
        let mut bytes = match (codec(header)?, &header.pixels) {
            (Codec::Native, Some(Pixels::Native(at))) => {
                let mut bytes = buffer;
                bytes.resize(wanted, 0);
                let mut source = header.open(at + frame as u64 * wanted as u64, progress)?;
                let there = read_all(&mut source, &mut bytes)?;
                if there < wanted {
                    return Err(ReadError::Truncated { wanted: wanted as u128, there: there as u64 });
                }
                if header.syntax.uid() == BIG_ENDIAN {
                    bytes.chunks_exact_mut(self.sample.bytes()).for_each(<[u8]>::reverse);
                }
                bytes
            }
            (codec, Some(Pixels::Fragments(offsets, fragments))) => {
                let packed = packed(header, offsets, fragments, frame, progress)?;
                match codec {
                    Codec::Native => {
                        return Err(ReadError::Contradiction("its pixels are in fragments, its transfer syntax in none".into()));
                    }
                    Codec::Jpeg => self.jpeg(&packed)?,
                    Codec::Jpeg2000 => self.jpeg_2000(&packed)?,
                    Codec::JpegLs => self.jpeg_ls(&packed)?,
                    Codec::Rle => self.rle(&packed)?,
                }
            }
            _ => return Err(ReadError::NoImages),
        };
        if bytes.len() != wanted {
            return Err(ReadError::Truncated { wanted: wanted as u128, there: bytes.len() as u64 });
        }
        match self.sample.bytes() {
            1 => self.clear::<1>(&mut bytes),
            2 => self.clear::<2>(&mut bytes),
            _ => self.clear::<4>(&mut bytes),
        }
        Ok(bytes)
    }

    /// Leaves the bits that are a sample's, its sign carried to the top.
    fn clear<const N: usize>(&self, bytes: &mut [u8]) {
        let unused = 8 * N as u32 - self.bits;
        if unused == 0 {
            return;
        }
        let spare = 32 - self.bits;
        for sample in bytes.as_chunks_mut::<N>().0 {
            let mut wide = [0; 4];
            wide[..N].copy_from_slice(sample);
            let high = u32::from_le_bytes(wide) >> self.shift << spare;
            let value = if self.signed { (high as i32 >> spare) as u32 } else { high >> spare };
            sample.copy_from_slice(&value.to_le_bytes()[..N]);
        }
    }

    fn jpeg(&self, packed: &[u8]) -> Result<Vec<u8>, ReadError> {
        let damaged = |e: &dyn std::fmt::Display| ReadError::Damaged(format!("as JPEG, {e}"));
        match jpeg_lossless::frame(packed) {
            Some(frame) if frame.process == 0xc3 => {
                self.same_size(frame.dims)?;
                let n = self.sample.bytes();
                if frame.bits > 8 * n as u32 {
                    return Err(damaged(&format!("its samples of {} bits do not fit {n} bytes", frame.bits)));
                }
                let samples = jpeg_lossless::decode(packed, &frame)?;
                return Ok(stored(&samples, n));
            }
            Some(frame) if frame.bits > 8 => {
                let text = format!("its pixels are JPEG with loss of {} bits, which is not read here; {UNPACK}", frame.bits);
                return Err(ReadError::Unsupported(text));
            }
            _ => {}
        }
        let mut decoder = jpeg_decoder::Decoder::new(packed);
        decoder.read_info().map_err(|e| damaged(&e))?;
        let info = decoder.info().ok_or_else(|| damaged(&"it has no header"))?;
        self.same_size([info.width.into(), info.height.into()])?;
        let bytes = decoder.decode().map_err(|e| damaged(&e))?;
        Ok(match (info.pixel_format, self.sample.bytes()) {
            (jpeg_decoder::PixelFormat::L8, 1) => bytes,
            (jpeg_decoder::PixelFormat::L8, n) => bytes.iter().flat_map(|&b| (0..n).map(move |at| if at == 0 { b } else { 0 })).collect(),
            (jpeg_decoder::PixelFormat::L16, 2) => bytes.as_chunks().0.iter().flat_map(|&b| u16::from_ne_bytes(b).to_le_bytes()).collect(),
            (format, n) => return Err(damaged(&format!("it holds {format:?}, which are no samples of {n} bytes"))),
        })
    }

    fn jpeg_2000(&self, packed: &[u8]) -> Result<Vec<u8>, ReadError> {
        // Where the file uses fewer bits than are coded, samples are held at the ends of those, or the highest would become the lowest.
        let range = |head: &jpeg_2000::Head| (head.signed == self.signed).then(|| self.range());
        jpeg_2000::decode(packed, self.sample.bytes(), range, |head| self.same_size(head.dims))
    }

    fn jpeg_ls(&self, packed: &[u8]) -> Result<Vec<u8>, ReadError> {
        // Sizes of DICOM have 16 bits. The decoder compares them with its own before it reserves anything.
        let [width, height] = self.dims.map(|n| n as u32);
        let (samples, ..) = jpegls::decode(packed, width, height).map_err(|e| ReadError::Damaged(format!("as JPEG-LS, {e}")))?;
        Ok(stored(&samples, self.sample.bytes()))
    }

    /// Packed by runs, a segment for each byte of the samples, the highest first (DICOM part 5, annex G).
    fn rle(&self, packed: &[u8]) -> Result<Vec<u8>, ReadError> {
        let damaged = || ReadError::Damaged("as RLE, its segments break off".into());
        let header = packed.get(..64).ok_or_else(damaged)?.as_chunks().0;
        let [count, offsets @ ..]: [usize; 16] = std::array::from_fn(|n| u32::from_le_bytes(header[n]) as usize);
        let (n, samples) = (self.sample.bytes(), self.dims[0] * self.dims[1]);
        if count != n {
            return Err(ReadError::Damaged(format!("as RLE, it has {count} segments for samples of {n} bytes")));
        }
        let mut bytes = vec![0; samples * n];
        for segment in 0..n {
            let end = if segment + 1 < n { offsets[segment + 1] } else { packed.len() };
            let mut rest = packed.get(offsets[segment]..end).ok_or_else(damaged)?;
            let mut at = 0;
            while at < samples {
                let (&control, after) = rest.split_first().ok_or_else(damaged)?;
                // 0 to 127: so many bytes and one follow; 129 to 255: the next byte 257 less that many times; 128: nothing.
                let (run, literal) = match control {
                    0..=127 => (usize::from(control) + 1, true),
                    128 => (0, true),
                    _ => (257 - usize::from(control), false),
                };
                let used = if literal { run } else { 1 };
                let source = after.get(..used).ok_or_else(damaged)?;
                for m in 0..run.min(samples - at) {
                    bytes[(at + m) * n + n - 1 - segment] = source[if literal { m } else { 0 }];
                }
                at += run;
                rest = &after[used..];
            }
        }
        Ok(bytes)
    }

    fn same_size(&self, dims: [usize; 2]) -> Result<(), ReadError> {
        if dims == self.dims {
            return Ok(());
        }
        let ([a, b], [c, d]) = (self.dims, dims);
        Err(ReadError::Contradiction(format!("it has {a}×{b} samples, but {c}×{d} are packed in it")))
    }
}

/// Samples in `n` bytes each, little-endian.
fn stored(samples: &[u16], n: usize) -> Vec<u8> {
    match n {
        1 => samples.iter().map(|&v| v as u8).collect(),
        2 => samples.iter().flat_map(|v| v.to_le_bytes()).collect(),
        _ => samples.iter().flat_map(|&v| u32::from(v).to_le_bytes()).collect(),
    }
}

/// The packed bytes of a frame: its own fragment, or those that the offset table gives it.
fn packed(header: &Header, offsets: &[u32], fragments: &[(u64, u32)], frame: usize, progress: &Progress) -> Result<Vec<u8>, ReadError> {
    let frames = header.frames();
    let of_frame: Vec<(u64, u32)> = if frames == 1 {
        fragments.to_vec()
    } else if fragments.len() == frames {
        fragments.get(frame).copied().into_iter().collect()
    } else if offsets.len() == frames {
        // Offsets count from the first fragment's own tag and length, 8 bytes before it.
        let first = fragments.first().map_or(0, |(at, _)| *at);
        let begin = u64::from(offsets[frame]);
        let end = offsets.get(frame + 1).map_or(u64::MAX, |&o| u64::from(o));
        fragments.iter().copied().filter(|(at, _)| (begin..end).contains(&(at - first))).collect()
    } else {
        let (n, m) = (fragments.len(), frames);
        return Err(ReadError::Contradiction(format!("it has {n} fragments for {m} frames, and no table that tells which is whose")));
    };
    let mut bytes = vec![];
    for (at, length) in of_frame {
        header.open(at, progress)?.take(length.into()).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}
