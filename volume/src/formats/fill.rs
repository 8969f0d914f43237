//! Samples that lie in their files as they are kept: all threads read them straight to where they stay.

use super::ReadError;
use super::decode::{Encoding, Kept, SampleType};
use super::packing::Packing;
use super::part::{MORE_BYTES, Part, check_length, in_file, open_file, read_all};
use crate::{Progress, Samples};
use bytemuck::cast_slice_mut;
use rayon::prelude::*;
use std::io::{Seek, SeekFrom};

/// Bytes that are read at a time: few enough for each thread to have several, and many enough that opening the file costs nothing.
const CHUNK: usize = 4 << 20;

/// Whether `parts` can be read so.
pub fn can_fill(parts: &[Part], encoding: Encoding, kept: Kept) -> bool {
    let size = encoding.sample.bytes() as u64;
    let same = matches!(
        (encoding.sample, kept),
        (SampleType::U8, Kept::U8) | (SampleType::I16, Kept::I16) | (SampleType::U16, Kept::U16) | (SampleType::F32, Kept::F32)
    );
    same && parts.iter().all(|part| part.packing == Packing::Plain && part.lines == 0 && part.bytes.is_multiple_of(size))
}

/// Reads `count` samples, which `parts` hold; gives warnings.
pub fn fill(
    parts: &[Part],
    encoding: Encoding,
    kept: Kept,
    count: usize,
    progress: &Progress,
) -> Result<(Samples, Vec<String>), ReadError> {
    // Memory that is asked for as zeros is not touched before it is read into, but cannot be refused: so it is asked for once to be.
    Vec::<u8>::new().try_reserve_exact(count.saturating_mul(kept.bytes()))?;
    let mut samples = match kept {
        Kept::U8 => Samples::U8(vec![0; count]),
        Kept::I16 => Samples::I16(vec![0; count]),
        Kept::U16 => Samples::U16(vec![0; count]),
        Kept::F32 => Samples::F32(vec![0.0; count]),
    };
    let mut rest: &mut [u8] = crate::with_samples!(&mut samples, s => cast_slice_mut(s));
    let mut more = false;
    for part in parts {
        let named = |e| if part.beside { in_file(&part.file, e) } else { e };
        let there = open_file(&part.file).map_err(named)?.1.saturating_sub(part.start);
        check_length(part.packing, part.bytes.into(), part.skip, there).map_err(named)?;
        more |= there > part.skip + part.bytes;
        let (own, others) = std::mem::take(&mut rest).split_at_mut(part.bytes as usize);
        rest = others;
        let read = |(n, chunk): (usize, &mut [u8])| read_chunk(part, (n * CHUNK) as u64, chunk, encoding, progress);
        own.par_chunks_mut(CHUNK).enumerate().try_for_each(read).map_err(named)?;
    }
    Ok((samples, more.then(|| MORE_BYTES.to_owned()).into_iter().collect()))
}

/// The bytes of a part from number `from` on, in this machine's order.
fn read_chunk(part: &Part, from: u64, chunk: &mut [u8], encoding: Encoding, progress: &Progress) -> Result<(), ReadError> {
    let mut source = open_file(&part.file)?.0;
    source.seek(SeekFrom::Start(part.start + part.skip + from))?;
    let n = read_all(&mut source, chunk)?;
    if n < chunk.len() {
        return Err(ReadError::Truncated { wanted: part.bytes.into(), there: from + n as u64 });
    }
    if encoding.big_endian != cfg!(target_endian = "big") && encoding.sample.bytes() > 1 {
        chunk.chunks_exact_mut(encoding.sample.bytes()).for_each(<[u8]>::reverse);
    }
    Ok(progress.advance(n as u64)?)
}
