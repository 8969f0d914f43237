//! The header of one DICOM file: the few attributes that make a scan of it. Nothing about the person is among them.

use super::super::ReadError;
use super::super::entries::{Entry, skip};
use super::super::part::MOST_EXPANSION;
use crate::Progress;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;
use dicom_encoding::TransferSyntaxIndex;
use dicom_encoding::transfer_syntax::TransferSyntax;
use dicom_parser::dataset::LazyDataToken;
use dicom_parser::dataset::lazy_read::LazyDataSetReader;
use dicom_parser::{DynStatefulDecoder, StatefulDecode};
use dicom_transfer_syntax_registry::TransferSyntaxRegistry;
use flate2::read::DeflateDecoder;
use std::collections::HashMap;
use std::io::{BufReader, Read};

/// The attributes that are read. All others, the person's name among them, are skipped unread.
const WANTED: [Tag; 37] = [
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
];

/// No attribute that is wanted is longer.
const MOST_VALUE: u32 = 4096;

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
}

impl Header {
    /// Reads up to the pixels, if the file begins as DICOM does.
    pub fn read_if_dicom(entry: &Entry, progress: &Progress) -> Result<Option<Self>, ReadError> {
        let head = head(entry, progress)?;
        if is_dicom(&head) { Self::after(&head, entry, progress).map(Some) } else { Ok(None) }
    }

    /// Reads up to the pixels.
    pub fn read(entry: &Entry, progress: &Progress) -> Result<Self, ReadError> {
        Self::after(&head(entry, progress)?, entry, progress)
    }

    fn after(head: &[u8], entry: &Entry, progress: &Progress) -> Result<Self, ReadError> {
        let (uid, start) = meta(head)?;
        let syntax = TransferSyntaxRegistry.get(&uid);
        let syntax = syntax.ok_or_else(|| ReadError::Unsupported(format!("its transfer syntax {uid:?} is not known")))?;
        let mut header =
            Self { entry: entry.clone(), syntax, start, pixels: None, values: Values::new(), shared: Values::new(), frames: vec![] };
        let rest = entry.bytes.saturating_sub(start);
        if header.is_deflated() {
            let inflated = DeflateDecoder::new(entry.open(start, progress)?);
            header.take(inflated, rest.saturating_mul(MOST_EXPANSION))?;
        } else {
            header.take(entry.open(start, progress)?, rest)?;
        }
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

    /// Number of frames that it says it has.
    pub fn frames(&self) -> usize {
        self.number(tags::NUMBER_OF_FRAMES, 0).map_or(1, |n: f64| n as usize)
    }

    /// Those of its frames that it describes: without a description of its own only one of them can lie where the file says.
    pub fn images(&self) -> usize {
        self.frames().min(self.frames.len().max(1))
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
        let numbers: Vec<f64> = self.text(tag, frame)?.split('\\').map(|n| n.trim().parse().unwrap_or(f64::NAN)).collect();
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

    /// Takes what is wanted from a data set of at most `bytes` bytes. In one piece, though long: an arm for each kind of token, over the sequences
    /// that are open.
    fn take(&mut self, source: impl Read, bytes: u64) -> Result<(), ReadError> {
        let damaged = |e: &dyn std::fmt::Display| ReadError::Damaged(format!("as DICOM, {e}"));
        let decoder = DynStatefulDecoder::new_with_ts(BufReader::with_capacity(1 << 14, source), self.syntax, 0);
        let mut reader = LazyDataSetReader::new(decoder.map_err(|e| damaged(&e))?);
        // The sequences that are open; `None` stands for an item.
        let mut open: Vec<Option<Tag>> = vec![];
        let mut in_pixels = false;
        let mut offsets = vec![];
        let mut fragments = vec![];
        let mut items = 0;
        while let Some(token) = reader.advance() {
            match token.map_err(|e| damaged(&e))? {
                LazyDataToken::SequenceStart { tag, .. } => open.push(Some(tag)),
                LazyDataToken::PixelSequenceStart => {
                    in_pixels = open.is_empty();
                    open.push(Some(tags::PIXEL_DATA));
                }
                LazyDataToken::ItemStart { .. } => {
                    if open.len() == 1 && open[0] == Some(tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE) {
                        self.frames.push(Values::new());
                    }
                    items += usize::from(in_pixels && open.len() == 1);
                    open.push(None);
                }
                token @ (LazyDataToken::ItemEnd | LazyDataToken::SequenceEnd) => {
                    open.pop();
                    if in_pixels && open.is_empty() {
                        break;
                    }
                    // An item that ends where none began.
                    if open.is_empty() && matches!(token, LazyDataToken::ItemEnd) {
                        return Err(damaged(&"an item ends where none began"));
                    }
                }
                LazyDataToken::LazyItemValue { len, decoder } => {
                    let at = decoder.position();
                    if at + u64::from(len) > bytes {
                        return Err(ReadError::Truncated { wanted: len.into(), there: bytes.saturating_sub(at) });
                    }
                    let value = LazyDataToken::LazyItemValue { len, decoder };
                    // The first item is the table, which may be empty.
                    if in_pixels && items == 1 {
                        let mut table = vec![];
                        value.read_value_into(&mut table).map_err(|e| damaged(&e))?;
                        offsets = table.as_chunks().0.iter().map(|&b| u32::from_le_bytes(b)).collect();
                    } else {
                        value.skip().map_err(|e| damaged(&e))?;
                        if in_pixels {
                            fragments.push((at, len));
                        }
                    }
                }
                LazyDataToken::LazyValue { header, decoder } => {
                    let (tag, len, at) = (header.tag, header.len, decoder.position());
                    if tag == tags::PIXEL_DATA && open.is_empty() {
                        self.pixels = Some(Pixels::Native(at));
                        return Ok(());
                    }
                    let value = LazyDataToken::LazyValue { header, decoder };
                    let is_short = len.get().is_some_and(|len| len <= MOST_VALUE && at + u64::from(len) <= bytes);
                    match self.place(tag, &open).filter(|_| is_short && header.vr != VR::SQ) {
                        Some(values) => {
                            let text = value.into_value().map_err(|e| damaged(&e))?.to_str().into_owned();
                            // The first of doubles counts.
                            values.entry(tag).or_insert(text);
                        }
                        None => value.skip().map_err(|e| damaged(&e))?,
                    }
                }
                _ => {}
            }
        }
        if in_pixels {
            self.pixels = Some(Pixels::Fragments(offsets, fragments));
        }
        Ok(())
    }

    /// Where a value within the sequences `open` belongs; `None` when it is not wanted.
    fn place(&mut self, tag: Tag, open: &[Option<Tag>]) -> Option<&mut Values> {
        if !WANTED.contains(&tag) {
            return None;
        }
        match open {
            [] => Some(&mut self.values),
            // The functional groups: their sequences each hold one item with the values.
            [Some(tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE), None, Some(group), None] if GROUPS.contains(group) => Some(&mut self.shared),
            [Some(tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE), None, Some(group), None] if GROUPS.contains(group) => self.frames.last_mut(),
            _ => None,
        }
    }
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
    let unsaid = if spelled { "1.2.840.10008.1.2.1" } else { "1.2.840.10008.1.2" };
    Ok((uid.unwrap_or_else(|| unsaid.to_owned()), at as u64))
}

fn head(entry: &Entry, progress: &Progress) -> Result<Vec<u8>, ReadError> {
    let mut head = vec![];
    entry.open(0, progress)?.take(MOST_META).read_to_end(&mut head)?;
    Ok(head)
}

/// Whether a file begins as DICOM does, with a preamble or, in old files, without.
pub fn is_dicom(head: &[u8]) -> bool {
    const FIRST: [[u8; 4]; 6] = [[2, 0, 0, 0], [2, 0, 2, 0], [8, 0, 0, 0], [8, 0, 1, 0], [8, 0, 5, 0], [8, 0, 8, 0]];
    head.get(128..132) == Some(b"DICM") || head.get(..4).is_some_and(|first| FIRST.iter().any(|f| f == first))
}
