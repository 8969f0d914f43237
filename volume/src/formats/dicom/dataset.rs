//! The data set of a DICOM file, element by element, as files are and not only as they should be (DICOM part 5, chapter 7).
//!
//! Whether types are spelled out is told from the elements, since files that say one and write the other are met; UN of undefined length
//! holds a sequence without types (6.2.2).

use super::super::ReadError;
use super::super::packing::skip;
use dicom_core::{Tag, VR};
use std::io::{ErrorKind, Read};

/// Sequences within sequences that are followed; what nests deeper is no image's header.
const MOST_DEPTH: usize = 32;

const ITEM: Tag = Tag(0xfffe, 0xe000);
const ITEM_END: Tag = Tag(0xfffe, 0xe00d);
const SEQUENCE_END: Tag = Tag(0xfffe, 0xe0dd);
const PIXEL_DATA: Tag = Tag(0x7fe0, 0x0010);
const UNDEFINED: u32 = u32::MAX;

/// Who is told what is in a data set.
pub trait Visit {
    /// Whether the value of `tag`, `length` bytes long, is wanted; `path` are the sequences that it lies in.
    fn wants(&self, path: &[Tag], tag: Tag, length: u32) -> bool;
    /// A value that is wanted; `vr` is `None` where the file does not spell it out, or says UN.
    fn value(&mut self, path: &[Tag], tag: Tag, vr: Option<VR>, bytes: &[u8], big_endian: bool);
    /// Whether `tag` of unknown type is a sequence.
    fn is_sequence(&self, tag: Tag) -> bool;
    /// An item of the sequence that `path` ends in begins.
    fn item(&mut self, path: &[Tag]);
    /// Pixels as they are, from byte `at` on.
    fn native(&mut self, at: u64);
    /// Packed pixels: the bytes of their offset table, then first byte and length of each fragment.
    fn fragments(&mut self, table: Vec<u8>, fragments: Vec<(u64, u32)>);
}

/// Walks `source` up to the pixels of the image. `bytes` is the most that it can hold.
pub fn walk(source: impl Read, spelled: bool, big_endian: bool, bytes: u64, visit: &mut dyn Visit) -> Result<(), ReadError> {
    let mut walk = Walk { source, at: 0, bytes, big_endian };
    match walk.elements(Style::Unknown { said: spelled }, None, &mut vec![], visit) {
        Ok(()) | Err(Stop::Done | Stop::End) => Ok(()),
        Err(Stop::Failed(error)) => Err(error),
    }
}

/// Whether types are spelled out.
#[derive(Clone, Copy)]
enum Style {
    /// The first element tells.
    Unknown {
        said: bool,
    },
    Spelled(bool),
}

/// Why a walk ends before its elements do.
enum Stop {
    /// The pixels have been found.
    Done,
    /// The bytes end.
    End,
    Failed(ReadError),
}

impl From<std::io::Error> for Stop {
    fn from(error: std::io::Error) -> Self {
        if error.kind() == ErrorKind::UnexpectedEof { Self::End } else { Self::Failed(error.into()) }
    }
}

fn damaged(what: &str) -> Stop {
    Stop::Failed(ReadError::Damaged(format!("as DICOM, {what}")))
}

/// The types that are spelled out with a length of 4 bytes, after 2 that are reserved.
fn is_long(vr: VR) -> bool {
    use VR::*;
    matches!(vr, OB | OD | OF | OL | OV | OW | SQ | SV | UC | UN | UR | UT | UV)
}

struct Walk<R> {
    source: R,
    /// Bytes that have been read.
    at: u64,
    bytes: u64,
    big_endian: bool,
}

impl<R: Read> Walk<R> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Stop> {
        let mut bytes = [0; N];
        self.source.read_exact(&mut bytes)?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn short(&self, bytes: [u8; 2]) -> u16 {
        if self.big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) }
    }

    fn long(&self, bytes: [u8; 4]) -> u32 {
        if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    }

    fn skip(&mut self, count: u64) -> Result<(), Stop> {
        self.at += count;
        if self.at > self.bytes {
            return Err(Stop::End);
        }
        Ok(skip(&mut self.source, count)?)
    }

    /// Tag, type where it is spelled out, and length of the next element.
    fn head(&mut self, style: &mut Style) -> Result<(Tag, Option<VR>, u32), Stop> {
        let [g, h, e, f] = self.take::<4>()?;
        let tag = Tag(self.short([g, h]), self.short([e, f]));
        let rest = self.take::<4>()?;
        if tag.0 == ITEM.0 {
            return Ok((tag, None, self.long(rest)));
        }
        let vr = VR::from_binary([rest[0], rest[1]]);
        let spelled = match *style {
            // An implicit length whose low bytes are the letters of a type is 16,705 at least, and no data set begins with such a value.
            Style::Unknown { said } => vr.is_some() || said && rest[..2].iter().all(u8::is_ascii_uppercase),
            Style::Spelled(spelled) => spelled,
        };
        *style = Style::Spelled(spelled);
        match vr {
            _ if !spelled => Ok((tag, None, self.long(rest))),
            Some(vr) if is_long(vr) => {
                let length = self.take::<4>()?;
                Ok((tag, Some(vr), self.long(length)))
            }
            Some(vr) => Ok((tag, Some(vr), self.short([rest[2], rest[3]]).into())),
            // One element without a type among others, as some writers leave in what they copy.
            None if !rest[..2].iter().all(u8::is_ascii_uppercase) => Ok((tag, None, self.long(rest))),
            None => Err(damaged("an element has a type that there is not")),
        }
    }

    /// The elements up to byte `end`, or up to the end of an item of undefined length.
    fn elements(&mut self, mut style: Style, end: Option<u64>, path: &mut Vec<Tag>, visit: &mut dyn Visit) -> Result<(), Stop> {
        while end.is_none_or(|end| self.at < end) {
            let (tag, vr, length) = self.head(&mut style)?;
            match tag {
                ITEM_END if path.is_empty() => return Err(damaged("an item ends where none began")),
                ITEM_END => return Ok(()),
                SEQUENCE_END => {}
                ITEM if path.is_empty() => return Err(damaged("an item begins where no sequence did")),
                PIXEL_DATA if path.is_empty() => {
                    if length == UNDEFINED {
                        self.fragments(visit)?;
                    } else {
                        visit.native(self.at);
                    }
                    return Err(Stop::Done);
                }
                _ if vr == Some(VR::SQ) || length == UNDEFINED || vr.is_none_or(|vr| vr == VR::UN) && visit.is_sequence(tag) => {
                    // What is of unknown type has no types within, but who wrote it may not know.
                    let inner = match (vr, style) {
                        (None | Some(VR::UN), _) => Style::Unknown { said: false },
                        (_, Style::Spelled(said) | Style::Unknown { said }) => Style::Unknown { said },
                    };
                    self.sequence(inner, tag, length, path, visit)?;
                }
                _ if visit.wants(path, tag, length) && self.at + u64::from(length) <= self.bytes => {
                    let mut value = vec![0; length as usize];
                    self.source.read_exact(&mut value)?;
                    self.at += u64::from(length);
                    visit.value(path, tag, vr.filter(|vr| *vr != VR::UN), &value, self.big_endian);
                }
                _ => self.skip(length.into())?,
            }
        }
        Ok(())
    }

    fn sequence(&mut self, style: Style, tag: Tag, length: u32, path: &mut Vec<Tag>, visit: &mut dyn Visit) -> Result<(), Stop> {
        if path.len() == MOST_DEPTH {
            return Err(damaged("its sequences nest without end"));
        }
        let end = (length != UNDEFINED).then_some(self.at + u64::from(length));
        path.push(tag);
        while end.is_none_or(|end| self.at < end) {
            let (tag, _, length) = self.head(&mut style.clone())?;
            match tag {
                ITEM => {
                    visit.item(path);
                    let end = (length != UNDEFINED).then_some(self.at + u64::from(length));
                    self.elements(style, end, path, visit)?;
                }
                SEQUENCE_END => break,
                // An item of stated length that is ended all the same.
                ITEM_END => {}
                _ => return Err(damaged("a sequence holds what is no item")),
            }
        }
        path.pop();
        Ok(())
    }

    /// The items of packed pixels; the first is the table, which may be empty.
    fn fragments(&mut self, visit: &mut dyn Visit) -> Result<(), Stop> {
        let (mut table, mut fragments) = (None, vec![]);
        let ended = loop {
            let (tag, _, length) = match self.head(&mut Style::Spelled(false)) {
                Ok(head) => head,
                Err(stop) => break Err(stop),
            };
            if tag != ITEM {
                break Ok(());
            }
            if self.at + u64::from(length) > self.bytes {
                let there = self.bytes.saturating_sub(self.at);
                return Err(Stop::Failed(ReadError::Truncated { wanted: length.into(), there }));
            }
            match &table {
                Some(_) => {
                    fragments.push((self.at, length));
                    self.skip(length.into())?;
                }
                None => {
                    let mut bytes = vec![];
                    (&mut self.source).take(length.into()).read_to_end(&mut bytes)?;
                    self.at += bytes.len() as u64;
                    table = Some(bytes);
                }
            }
        };
        visit.fragments(table.unwrap_or_default(), fragments);
        ended
    }
}
