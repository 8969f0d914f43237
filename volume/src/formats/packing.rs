//! How bytes are packed, what they can unpack to at most, and readers of them.

use super::ReadError;
use super::stretch::Source;
use crate::Progress;
use flate2::bufread::{DeflateDecoder, GzDecoder, ZlibDecoder};
use std::io::{self, BufRead, BufReader, Read};

/// How bytes are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// As they are.
    Plain,
    /// By gzip.
    Gzip,
    /// By zlib.
    Zlib,
    /// By deflate, without a frame.
    Deflate,
    /// By gzip, and that by deflate, as a zip holds files that were packed before.
    GzipInDeflate,
}

/// Deflate's longest match spends 2 bits on 258 bytes, a ratio of 1032; the rest is for headers. What claims more is no such data.
pub const MOST_EXPANSION: u64 = 1100;

/// What a byte of JPEG 2000 or JPEG-LS unpacks to, at most: OpenJPEG packs 4096² blank samples of 16 bits into 280 bytes, CharLS into 636.
pub const MOST_BLANK: u64 = 1 << 17;

/// Refuses `wanted` bytes that `packed` deflated bytes cannot unpack to.
pub fn check_expansion(wanted: u128, packed: u64) -> Result<(), ReadError> {
    check_expansion_to(wanted, packed, MOST_EXPANSION)
}

/// Refuses `wanted` bytes that `packed` bytes, each unpacked to `most` at most, cannot hold.
pub fn check_expansion_to(wanted: u128, packed: u64, most: u64) -> Result<(), ReadError> {
    if wanted > u128::from(packed) * u128::from(most) {
        return Err(ReadError::CannotHold { wanted, compressed: packed });
    }
    Ok(())
}

/// The bytes that are packed in `source`.
pub fn unpacking<'a>(packing: Packing, source: impl BufRead + 'a) -> Box<dyn Read + 'a> {
    match packing {
        Packing::Plain => Box::new(source),
        Packing::Gzip => Box::new(Gzip::new(source)),
        Packing::Zlib => Box::new(ZlibDecoder::new(source)),
        Packing::Deflate => Box::new(DeflateDecoder::new(source)),
        Packing::GzipInDeflate => Box::new(Gzip::new(BufReader::new(DeflateDecoder::new(source)))),
    }
}

/// The members of a gzip, one after the other. What follows them and is none, such as zeros up to the end of a tape's block, is no part of it.
struct Gzip<R>(Option<GzDecoder<R>>);

impl<R: BufRead> Gzip<R> {
    fn new(source: R) -> Self {
        Self(Some(GzDecoder::new(source)))
    }
}

impl<R: BufRead> Read for Gzip<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while let Some(member) = &mut self.0 {
            let n = member.read(buffer)?;
            if n > 0 || buffer.is_empty() {
                return Ok(n);
            }
            let mut rest = self.0.take().map(GzDecoder::into_inner);
            // The first byte of gzip's magic.
            let is_more = rest.as_mut().map_or(Ok(false), |rest| Ok::<_, io::Error>(rest.fill_buf()?.first() == Some(&0x1f)))?;
            self.0 = rest.filter(|_| is_more).map(GzDecoder::new);
        }
        Ok(0)
    }
}

/// A source whose bytes count as progress; reading fails when the work should stop.
pub struct Counted<'a> {
    source: Source,
    progress: &'a Progress,
}

/// A buffered reader that counts the bytes of `source`.
pub fn counted(source: Source, progress: &Progress) -> BufReader<Counted<'_>> {
    BufReader::with_capacity(1 << 16, Counted { source, progress })
}

impl Read for Counted<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.source.read(buffer)?;
        self.progress.advance(n as u64).map_err(io::Error::other)?;
        Ok(n)
    }
}

/// Reads past `count` bytes; a source that ends earlier is found out by whoever reads on.
pub fn skip(source: &mut impl Read, count: u64) -> io::Result<()> {
    io::copy(&mut source.take(count), &mut io::sink()).map(drop)
}
