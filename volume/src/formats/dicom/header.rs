//! The header of one DICOM file: the few attributes that make a scan of it. Nothing about the person is among them.

use super::super::ReadError;
use super::super::decode;
use super::super::entry::Entry;
use super::super::packing::{MOST_EXPANSION, skip};
use super::dataset::{self, Visit};
use super::lent::Lent;
use crate::Progress;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;
use dicom_encoding::TransferSyntaxIndex;
use dicom_encoding::text::{SpecificCharacterSet, TextCodec};
use dicom_encoding::transfer_syntax::TransferSyntax;
use dicom_transfer_syntax_registry::TransferSyntaxRegistry;
use flate2::read::DeflateDecoder;
use glam::DVec3;
use std::collections::HashMap;
use std::io::{BufReader, Read};

/// The attributes that are read. All others, the person's name among them, are skipped unread.
const WANTED: [Tag; 48] = [
    tags::SOP_CLASS_UID,
    tags::IMAGE_TYPE,
    tags::MODALITY,
    tags::SERIES_INSTANCE_UID,
    tags::SERIES_NUMBER,
    tags::SERIES_DESCRIPTION,
    tags::MANUFACTURER,
    tags::MANUFACTURER_MODEL_NAME,
    tags::KVP,
    tags::CONVOLUTION_KERNEL,
    tags::GANTRY_DETECTOR_TILT,
    tags::FRAME_OF_REFERENCE_UID,
    tags::ACQUISITION_NUMBER,
    tags::INSTANCE_NUMBER,
    tags::TEMPORAL_POSITION_INDEX,
    tags::SLICE_THICKNESS,
    tags::SLICE_LOCATION,
    tags::SPACING_BETWEEN_SLICES,
    tags::IMAGE_POSITION_PATIENT,
    tags::IMAGE_ORIENTATION_PATIENT,
    tags::PIXEL_SPACING,
    tags::ROWS,
    tags::COLUMNS,
    tags::NUMBER_OF_FRAMES,
    tags::SAMPLES_PER_PIXEL,
    tags::PHOTOMETRIC_INTERPRETATION,
    tags::BITS_ALLOCATED,
    tags::BITS_STORED,
    tags::HIGH_BIT,
    tags::PIXEL_REPRESENTATION,
    tags::PIXEL_PADDING_VALUE,
    tags::PIXEL_PADDING_RANGE_LIMIT,
    tags::RESCALE_SLOPE,
    tags::RESCALE_INTERCEPT,
    tags::RESCALE_TYPE,
    tags::LOSSY_IMAGE_COMPRESSION,
    tags::FRAME_TYPE,
    tags::PRESENTATION_LUT_SHAPE,
    tags::TEMPORAL_POSITION_IDENTIFIER,
    tags::ACQUISITION_TIME,
    tags::ECHO_TIME,
    tags::TRIGGER_TIME,
    tags::DIFFUSION_B_VALUE,
    tags::GRID_FRAME_OFFSET_VECTOR,
    tags::NOMINAL_SCANNED_PIXEL_SPACING,
    tags::FRAME_TIME,
    tags::FRAME_TIME_VECTOR,
    tags::SPECIFIC_CHARACTER_SET,
];

/// Types are not spelled out.
const IMPLICIT: &str = "1.2.840.10008.1.2";
/// Numbers have their most significant byte first.
pub const BIG_ENDIAN: &str = "1.2.840.10008.1.2.2";

/// No attribute that is wanted is longer, but the vector of offsets, which has a number for each frame.
const MOST_VALUE: u32 = 4096;
const MOST_OFFSETS: u32 = 1 << 18;
/// Frames of a file of the old classes that are placed; no scanner writes more into one file.
const MOST_FRAMES: usize = 1 << 14;

/// Values as text by attribute, several of one with `\` between them.
type Values = HashMap<Tag, String>;

/// Where pixels are in the data set.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// As they are, from a byte of the data set on.
    Native(u64),
    /// Packed, in fragments of the file: the offset table, then first byte and length of each.
    Fragments(Vec<u32>, Vec<(u64, u32)>),
}

/// The header of one file.
pub struct Header {
    /// Where it was read from.
    pub entry: Entry,
    /// How the file is written.
    pub syntax: &'static TransferSyntax,
    /// The data set begins at this byte.
    pub start: u64,
    /// `None` where the file has no image.
    pub pixels: Option<Pixels>,
    values: Values,
    shared: Values,
    frames: Vec<Values>,
    charset: Option<SpecificCharacterSet>,
    /// Where the frames of a file that describes none lie.
    offsets: Option<Offsets>,
    /// The place of a file that states none.
    pub lent: Option<Lent>,
}

/// Where the frames of a file of the old multi-frame classes lie, which state one position for all: mm along their normal.
#[derive(Clone, Debug, PartialEq)]
enum Offsets {
    /// For each frame, as the file states them.
    Stated(Vec<f64>),
    /// Evenly apart, by the attribute of that name.
    Even(f64, &'static str),
}

impl Header {
    /// Reads up to the pixels, if the file begins as DICOM does.
    pub fn read_if_dicom(entry: &Entry, progress: &Progress) -> Result<Option<Self>, ReadError> {
        let head = entry.head(MOST_META, progress)?;
        if is_dicom(&head) { Self::after(&head, entry, progress).map(Some) } else { Ok(None) }
    }

    /// Reads up to the pixels.
    pub fn read(entry: &Entry, progress: &Progress) -> Result<Self, ReadError> {
        Self::after(&entry.head(MOST_META, progress)?, entry, progress)
    }

    fn after(head: &[u8], entry: &Entry, progress: &Progress) -> Result<Self, ReadError> {
        let (uid, start) = meta(head)?;
        let syntax = TransferSyntaxRegistry.get(&uid);
        let syntax = syntax.ok_or_else(|| ReadError::Unsupported(format!("its transfer syntax {uid:?} is not known")))?;
        let (values, shared) = (Values::new(), Values::new());
        let mut header = Self {
            entry: entry.clone(),
            syntax,
            start,
            pixels: None,
            values,
            shared,
            frames: vec![],
            charset: None,
            offsets: None,
            lent: None,
        };
        let rest = entry.bytes.saturating_sub(start);
        if header.is_deflated() {
            let inflated = DeflateDecoder::new(entry.open(start, progress)?);
            header.take(inflated, rest.saturating_mul(MOST_EXPANSION))?;
        } else {
            header.take(entry.open(start, progress)?, rest)?;
        }
        header.offsets = header.find_offsets();
        Ok(header)
    }

    /// The whole data set is deflated.
    pub fn is_deflated(&self) -> bool {
        self.syntax.uid() == "1.2.840.10008.1.2.1.99"
    }

    /// Bytes from byte `from` of the data set on.
    pub fn open<'a>(&self, from: u64, progress: &'a Progress) -> Result<Box<dyn Read + 'a>, ReadError> {
        if !self.is_deflated() {
            return self.entry.open(self.start + from, progress);
        }
        let mut inflated = DeflateDecoder::new(self.entry.open(self.start, progress)?);
        skip(&mut inflated, from)?;
        Ok(Box::new(inflated))
    }

    /// Number of frames that it says it has; some say 0 of one.
    pub fn frames(&self) -> usize {
        self.number(tags::NUMBER_OF_FRAMES, 0).map_or(1, |n: f64| (n as usize).max(1))
    }

    /// Those of its frames that can be placed: the ones that it describes, or all of an old class that says how far they are apart. Otherwise
    /// only one of them can lie where the file says.
    pub fn images(&self) -> usize {
        match self.offsets {
            Some(_) => self.frames(),
            None => self.frames().min(self.frames.len().max(1)),
        }
    }

    /// Offsets, spacing or thickness of the frames of a file that describes none, unless they follow each other in time.
    fn find_offsets(&self) -> Option<Offsets> {
        let is_movie = [tags::FRAME_TIME, tags::FRAME_TIME_VECTOR].iter().any(|&tag| self.text(tag, 0).is_some());
        let count = self.frames();
        if !self.frames.is_empty() || !(2..=MOST_FRAMES).contains(&count) || is_movie {
            return None;
        }
        if let Some(text) = self.text(tags::GRID_FRAME_OFFSET_VECTOR, 0) {
            let stated: Option<Vec<f64>> = text.split('\\').map(decimal).collect();
            let stated = stated.filter(|s| s.len() == count);
            return stated.map(|s| Offsets::Stated(s.iter().map(|mm| mm - s[0]).collect()));
        }
        let even = |tag, name| self.number(tag, 0).filter(|mm| *mm > 0.0).map(|mm| Offsets::Even(mm, name));
        even(tags::SPACING_BETWEEN_SLICES, "SpacingBetweenSlices").or_else(|| even(tags::SLICE_THICKNESS, "SliceThickness"))
    }

    /// How far its frames are taken to be apart, and by which attribute, where it states no place for each.
    pub fn assumed(&self) -> Option<(f64, &'static str)> {
        match self.offsets {
            Some(Offsets::Even(mm, name)) => Some((mm, name)),
            _ => None,
        }
    }

    /// Whether it states a position and directions, for all of its frames or for each.
    pub fn is_placed(&self, frame: usize) -> bool {
        self.numbers::<3>(tags::IMAGE_POSITION_PATIENT, frame).is_some()
            && self.numbers::<6>(tags::IMAGE_ORIENTATION_PATIENT, frame).is_some()
    }

    /// Position and directions of frame `frame`. Frames that are only known to be so far apart begin at the origin.
    pub fn place(&self, frame: usize) -> Option<([f64; 3], [f64; 6])> {
        let stated = self.is_placed(frame).then(|| {
            let position = self.numbers::<3>(tags::IMAGE_POSITION_PATIENT, frame);
            position.zip(self.numbers::<6>(tags::IMAGE_ORIENTATION_PATIENT, frame))
        });
        if let Some(lent) = self.lent {
            let position = self.numbers::<3>(tags::IMAGE_POSITION_PATIENT, frame);
            return Some(lent.place(position, self.numbers::<6>(tags::IMAGE_ORIENTATION_PATIENT, frame)));
        }
        let Some(offsets) = &self.offsets else { return stated? };
        let (position, along) = stated.flatten().unwrap_or(([0.0; 3], [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]));
        let offset_mm = match offsets {
            Offsets::Stated(stated) => *stated.get(frame)?,
            Offsets::Even(mm, _) => mm * frame as f64,
        };
        let [a, b, c, d, e, f] = along;
        let normal = DVec3::new(a, b, c).cross(DVec3::new(d, e, f)).normalize_or_zero();
        Some(((DVec3::from(position) + normal * offset_mm).to_array(), along))
    }

    /// The identifier of its series.
    pub fn series(&self) -> &str {
        self.text(tags::SERIES_INSTANCE_UID, 0).unwrap_or_default()
    }

    /// A value of frame `frame`.
    pub fn text(&self, tag: Tag, frame: usize) -> Option<&str> {
        let of_frame = self.frames.get(frame).and_then(|values| values.get(&tag));
        let text = of_frame.or_else(|| self.shared.get(&tag)).or_else(|| self.values.get(&tag))?.trim();
        (!text.is_empty()).then_some(text)
    }

    /// Numbers of frame `frame`; `None` when there are fewer.
    pub fn numbers<const N: usize>(&self, tag: Tag, frame: usize) -> Option<[f64; N]> {
        let numbers: Vec<f64> = self.text(tag, frame)?.split('\\').map(|n| decimal(n).unwrap_or(f64::NAN)).collect();
        numbers.get(..N)?.try_into().ok().filter(|n: &[f64; N]| n.iter().all(|v| v.is_finite()))
    }

    /// A number of frame `frame`.
    pub fn number(&self, tag: Tag, frame: usize) -> Option<f64> {
        self.numbers::<1>(tag, frame).map(|[n]| n)
    }

    /// A whole number of 16 bits.
    pub fn small(&self, tag: Tag) -> Option<usize> {
        self.number(tag, 0).filter(|n| (0.0..=65535.0).contains(n) && n.fract() == 0.0).map(|n| n as usize)
    }

    /// A whole number of 16 bits that has to be there.
    pub fn size(&self, tag: Tag, name: &'static str) -> Result<usize, ReadError> {
        self.small(tag).ok_or(ReadError::MissingField(name))
    }

    /// Takes what is wanted from a data set of at most `bytes` bytes.
    fn take(&mut self, source: impl Read, bytes: u64) -> Result<(), ReadError> {
        let (spelled, big_endian) = (self.syntax.uid() != IMPLICIT, self.syntax.uid() == BIG_ENDIAN);
        dataset::walk(BufReader::with_capacity(1 << 14, source), spelled, big_endian, bytes, self)
    }

    /// Where a value within the sequences `path` belongs; `None` when it is not wanted.
    fn values_of(&mut self, path: &[Tag]) -> Option<&mut Values> {
        match path {
            [] => Some(&mut self.values),
            // The functional groups: their sequences each hold one item with the values.
            [tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE, group] if GROUPS.contains(group) => Some(&mut self.shared),
            [tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE, group] if GROUPS.contains(group) => self.frames.last_mut(),
            _ => None,
        }
    }
}

impl Visit for Header {
    fn wants(&self, path: &[Tag], tag: Tag, length: u32) -> bool {
        let is_place = path.is_empty() || path.len() == 2 && is_functional(path[0]) && GROUPS.contains(&path[1]);
        let most = if tag == tags::GRID_FRAME_OFFSET_VECTOR { MOST_OFFSETS } else { MOST_VALUE };
        is_place && length <= most && WANTED.contains(&tag)
    }

    fn value(&mut self, path: &[Tag], tag: Tag, vr: Option<VR>, bytes: &[u8], big_endian: bool) {
        let text = text(vr.unwrap_or_else(|| known_type(tag)), bytes, big_endian, self.charset.as_ref());
        if tag == tags::SPECIFIC_CHARACTER_SET {
            // The first of several is that of text without escapes.
            self.charset = text.split('\\').next().and_then(|code| SpecificCharacterSet::from_code(code.trim()));
        } else if let Some(values) = self.values_of(path) {
            // The first of doubles counts.
            values.entry(tag).or_insert(text);
        }
    }

    fn is_sequence(&self, tag: Tag) -> bool {
        is_functional(tag) || GROUPS.contains(&tag)
    }

    fn item(&mut self, path: &[Tag]) {
        if path == [tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE] {
            self.frames.push(Values::new());
        }
    }

    fn native(&mut self, at: u64) {
        self.pixels = Some(Pixels::Native(at));
    }

    fn fragments(&mut self, table: Vec<u8>, fragments: Vec<(u64, u32)>) {
        let offsets = table.as_chunks().0.iter().map(|&b| u32::from_le_bytes(b)).collect();
        self.pixels = Some(Pixels::Fragments(offsets, fragments));
    }
}

/// A number. Some programs write the decimal comma of their country, which no number of DICOM has.
fn decimal(text: &str) -> Option<f64> {
    text.trim().replace(',', ".").parse().ok()
}

/// The type of a wanted attribute whose type the file does not say (DICOM part 6): all that are no text are whole numbers.
fn known_type(tag: Tag) -> VR {
    match tag {
        tags::ROWS
        | tags::COLUMNS
        | tags::SAMPLES_PER_PIXEL
        | tags::BITS_ALLOCATED
        | tags::BITS_STORED
        | tags::HIGH_BIT
        | tags::PIXEL_REPRESENTATION
        | tags::PIXEL_PADDING_VALUE
        | tags::PIXEL_PADDING_RANGE_LIMIT => VR::US,
        tags::TEMPORAL_POSITION_INDEX => VR::UL,
        _ => VR::LO,
    }
}

/// A value as text, several of one with `\` between them.
fn text(vr: VR, bytes: &[u8], big: bool, charset: Option<&SpecificCharacterSet>) -> String {
    fn join<T: ToString>(numbers: impl Iterator<Item = T>) -> String {
        numbers.map(|n| n.to_string()).collect::<Vec<_>>().join("\\")
    }
    match vr {
        VR::US => join(decode::u16s(bytes, big)),
        VR::SS => join(decode::i16s(bytes, big)),
        VR::UL => join(decode::u32s(bytes, big)),
        VR::SL => join(decode::i32s(bytes, big)),
        VR::FL => join(decode::f32s(bytes, big)),
        VR::FD => join(decode::f64s(bytes, big)),
        _ => {
            let coded = charset.and_then(|set| set.decode(bytes).ok());
            // Latin-1 has a letter for each byte, as good a guess as any where nothing is said.
            let text = coded.unwrap_or_else(|| bytes.iter().map(|&b| char::from(b)).collect());
            text.trim_end_matches(['\0', ' ']).to_owned()
        }
    }
}

fn is_functional(tag: Tag) -> bool {
    [tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE, tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE].contains(&tag)
}

/// The functional groups that are read.
const GROUPS: [Tag; 7] = [
    tags::PLANE_POSITION_SEQUENCE,
    tags::PLANE_ORIENTATION_SEQUENCE,
    tags::PIXEL_MEASURES_SEQUENCE,
    tags::PIXEL_VALUE_TRANSFORMATION_SEQUENCE,
    tags::FRAME_CONTENT_SEQUENCE,
    tags::CT_IMAGE_FRAME_TYPE_SEQUENCE,
    tags::MR_IMAGE_FRAME_TYPE_SEQUENCE,
];

/// Preamble, magic and file meta information fit into this.
const MOST_META: u64 = 1 << 14;

/// The transfer syntax, and where the data set begins: after the preamble, its `DICM` and the file meta information.
fn meta(head: &[u8]) -> Result<(String, u64), ReadError> {
    let mut at = if head.get(128..132) == Some(b"DICM") { 132 } else { 0 };
    let mut uid = None;
    let number = |bytes: Option<&[u8]>| bytes.map(|b| b.iter().rev().fold(0, |n, &b| n << 8 | usize::from(b)));
    while head.get(at..at + 2) == Some(&[2, 0]) {
        // Elements of explicit VR: most have 2 bytes of length, those that can be long have 4 after 2 that are reserved.
        let vr = head.get(at + 4..at + 6);
        let long = vr.is_some_and(|vr| [&b"OB"[..], b"OW", b"UN", b"UT", b"SQ", b"OF"].contains(&vr));
        let (begin, length) = if long { (at + 12, number(head.get(at + 8..at + 12))) } else { (at + 8, number(head.get(at + 6..at + 8))) };
        let value = length.and_then(|length| head.get(begin..begin + length));
        let value = value.ok_or(ReadError::NoHeader("its file meta information breaks off"))?;
        if head[at + 2..at + 4] == [0x10, 0] {
            uid = Some(String::from_utf8_lossy(value).trim_matches(['\0', ' ']).to_owned());
        }
        at = begin + value.len();
    }
    // Files from before DICOM had a preamble say nothing: what follows the first tag tells whether types are spelled out.
    let spelled = head.get(at + 4..at + 6).is_some_and(|vr| vr.iter().all(u8::is_ascii_uppercase));
    let unsaid = if spelled { "1.2.840.10008.1.2.1" } else { IMPLICIT };
    Ok((uid.unwrap_or_else(|| unsaid.to_owned()), at as u64))
}

/// Whether a file begins as DICOM does, with a preamble or, in old files, without: by an element of the meta information, or of the first that a
/// data set has (up to the SOP Instance UID), whose type or length is plausible.
pub fn is_dicom(head: &[u8]) -> bool {
    let Some(&[g, h, e, f, a, b, c, d]) = head.first_chunk() else { return false };
    let is_first = h == 0 && f == 0 && (g == 2 && e <= 2 || g == 8 && e <= 0x18);
    let is_short = u32::from_le_bytes([a, b, c, d]) <= 256 && a % 2 == 0;
    head.get(128..132) == Some(b"DICM") || is_first && (is_short || VR::from_binary([a, b]).is_some())
}
