//! JPEG without loss (ITU-T T.81, process 14): one component of 2 to 16 bits, any predictor, with or without restart intervals.

use super::super::ReadError;

/// What a JPEG's frame header says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The second byte of its marker: 0xc0 baseline, 0xc1 extended, 0xc2 progressive, 0xc3 lossless.
    pub process: u8,
    /// Bits of a sample.
    pub bits: u32,
    /// Samples along i and j.
    pub dims: [usize; 2],
    components: u8,
}

fn damaged(what: &str) -> ReadError {
    ReadError::Damaged(format!("as JPEG, {what}"))
}

/// The marker segments up to the samples: marker and content of each. Ends with `None` and the place of the samples after the start of scan.
struct Segments<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Segments<'a> {
    fn next(&mut self) -> Option<(u8, &'a [u8])> {
        loop {
            // Any number of 0xff may fill the space before a marker.
            let &[0xff, marker] = self.bytes.get(self.at..self.at + 2)? else { return None };
            match marker {
                0xff => self.at += 1,
                // Start of image, and others without content.
                0x01 | 0xd0..=0xd8 => self.at += 2,
                _ => {
                    let &[a, b] = self.bytes.get(self.at + 2..self.at + 4)? else { return None };
                    let begin = self.at + 4;
                    self.at += 2 + usize::from(u16::from_be_bytes([a, b]));
                    return Some((marker, self.bytes.get(begin..self.at)?));
                }
            }
        }
    }
}

/// The frame header of a JPEG, if it has one before its samples.
pub fn frame(bytes: &[u8]) -> Option<Frame> {
    let mut segments = Segments { bytes, at: 0 };
    while let Some((marker, content)) = segments.next() {
        match (marker, content) {
            (0xda, _) => return None,
            (0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf, &[bits, a, b, c, d, components, ..]) => {
                let size = |high, low| usize::from(u16::from_be_bytes([high, low]));
                return Some(Frame { process: marker, bits: bits.into(), dims: [size(c, d), size(a, b)], components });
            }
            _ => {}
        }
    }
    None
}

/// A Huffman table.
struct Table {
    /// Length of the code (0 where there is none) and symbol for each 16 bits that may come.
    codes: Vec<(u8, u8)>,
    /// Difference and all its bits for each [`SHORT`] bits that may come; 0 bits where it has more. Most differences are short, and so is this,
    /// which the nearest cache holds.
    short: Vec<(i16, u8)>,
}

/// Bits that are looked up at once.
const SHORT: u32 = 11;

impl Table {
    /// From the counts of codes of 1 to 16 bits and their symbols (T.81, annex C).
    fn new(counts: &[u8; 16], symbols: &[u8]) -> Option<Self> {
        let mut codes = vec![(0, 0); 1 << 16];
        let (mut next, mut symbols) = (0_usize, symbols.iter());
        for (length, &count) in (1..=16).zip(counts) {
            let run = 1 << (16 - length);
            for _ in 0..count {
                codes.get_mut(next..next + run)?.fill((length as u8, *symbols.next()?));
                next += run;
            }
        }
        let short = (0..1_usize << SHORT).map(|bits| {
            let (length, size) = codes[bits << (16 - SHORT)];
            let used = u32::from(length) + u32::from(size);
            let low = (bits >> (SHORT.saturating_sub(used))) as i32 & ((1 << size.min(15)) - 1);
            if length > 0 && used <= SHORT { (extended(low, size.into()) as i16, used as u8) } else { (0, 0) }
        });
        Some(Self { short: short.collect(), codes })
    }
}

/// The difference of `bits` bits whose bits are `value`: those that begin with 0 are negative.
fn extended(value: i32, bits: u32) -> i32 {
    if bits > 0 && value >> (bits - 1) == 0 { value - (1 << bits) + 1 } else { value }
}

/// The bits of samples, up to the next marker.
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
    held: u64,
    count: u32,
    /// Bits that were made up behind the end.
    missing: u32,
}

impl Bits<'_> {
    /// Holds 33 bits at least: a code and what follows it.
    fn fill(&mut self) {
        // Four bytes at once where none is 0xff: one of them is where its complement less one borrows from a bit that it has itself.
        if let Some(&four) = self.bytes.get(self.at..).and_then(<[u8]>::first_chunk) {
            let four = u32::from_be_bytes(four);
            if (!four).wrapping_sub(0x0101_0101) & four & 0x8080_8080 == 0 {
                (self.held, self.count, self.at) = (self.held << 32 | u64::from(four), self.count + 32, self.at + 4);
                return;
            }
        }
        while self.count <= 56 {
            let byte = match self.bytes.get(self.at..) {
                // A byte 0xff of samples is followed by 0.
                Some([0xff, 0, ..]) => {
                    self.at += 2;
                    0xff
                }
                None | Some([] | [0xff, ..]) => {
                    self.missing += 8;
                    0
                }
                Some([byte, ..]) => {
                    self.at += 1;
                    *byte
                }
            };
            self.held = self.held << 8 | u64::from(byte);
            self.count += 8;
        }
    }

    fn peek(&self, bits: u32) -> u32 {
        (self.held >> (self.count - bits)) as u32 & ((1 << bits) - 1)
    }

    /// A difference: the number of its bits by `table`, then they.
    fn difference(&mut self, table: &Table) -> Result<i32, ReadError> {
        if self.count < 33 {
            self.fill();
        }
        let (value, used) = table.short[self.peek(SHORT) as usize];
        if used > 0 {
            self.count -= u32::from(used);
            return self.whole(value.into());
        }
        let (length, bits) = table.codes[self.peek(16) as usize];
        if length == 0 || bits > 16 {
            return Err(damaged("it holds a code that there is not"));
        }
        self.count -= u32::from(length);
        let bits = u32::from(bits);
        let value = match bits {
            0 => 0,
            16 => 1 << 15,
            _ => {
                let value = self.peek(bits) as i32;
                self.count -= bits;
                extended(value, bits)
            }
        };
        self.whole(value)
    }

    /// A difference none of whose bits were made up.
    fn whole(&self, difference: i32) -> Result<i32, ReadError> {
        if self.missing > self.count { Err(damaged("it breaks off")) } else { Ok(difference) }
    }

    /// Goes on behind the restart marker that must come now.
    fn restart(&mut self) -> Result<(), ReadError> {
        while self.bytes.get(self.at..self.at + 2) == Some(&[0xff, 0xff]) {
            self.at += 1;
        }
        let Some(&[0xff, 0xd0..=0xd7]) = self.bytes.get(self.at..self.at + 2) else { return Err(damaged("a restart marker is missing")) };
        (self.at, self.held, self.count, self.missing) = (self.at + 2, 0, 0, 0);
        Ok(())
    }
}

/// The samples of a lossless JPEG of `dims` samples, which the caller has compared with its frame.
pub fn decode(bytes: &[u8], frame: &Frame) -> Result<Vec<u16>, ReadError> {
    if frame.components != 1 {
        return Err(ReadError::Unsupported("its pixels are colours; only grey values can be read".into()));
    }
    let mut segments = Segments { bytes, at: 0 };
    let mut tables: [Option<Table>; 4] = [const { None }; 4];
    let mut interval = 0;
    loop {
        match segments.next().ok_or_else(|| damaged("it has no samples"))? {
            (0xc4, mut content) => {
                while let Some((&[place, ref counts @ ..], rest)) = content.split_first_chunk::<17>() {
                    let symbols = rest.get(..counts.iter().map(|&n| usize::from(n)).sum());
                    let symbols = symbols.ok_or_else(|| damaged("a table breaks off"))?;
                    let table = tables.get_mut(usize::from(place)).ok_or_else(|| damaged("it has a table of another process"))?;
                    *table = Some(Table::new(counts, symbols).ok_or_else(|| damaged("a table has more codes than there are"))?);
                    content = &rest[symbols.len()..];
                }
            }
            (0xdd, &[a, b]) => interval = usize::from(u16::from_be_bytes([a, b])),
            (0xda, &[1, _, table, predictor @ 1..=7, _, shift]) => {
                let table = tables.get(usize::from(table >> 4)).and_then(Option::as_ref);
                let table = table.ok_or_else(|| damaged("a table is missing"))?;
                let bits = Bits { bytes, at: segments.at, held: 0, count: 0, missing: 0 };
                return samples(bits, table, frame, interval, predictor, u32::from(shift & 15));
            }
            (0xda, _) => return Err(damaged("its scan header is of another process")),
            _ => {}
        }
    }
}

/// Sums of predictions and differences (T.81, annex H), shifted left by what was shifted out.
fn samples(mut bits: Bits<'_>, table: &Table, frame: &Frame, interval: usize, predictor: u8, shift: u32) -> Result<Vec<u16>, ReadError> {
    let [nx, ny] = frame.dims;
    if !(2..=16).contains(&frame.bits) || shift >= frame.bits {
        return Err(damaged("it has samples of bits that there are not"));
    }
    if !interval.is_multiple_of(nx.max(1)) {
        return Err(damaged("its restart intervals are no whole lines"));
    }
    let lines = interval / nx.max(1);
    let first: i32 = 1 << (frame.bits - shift - 1);
    let mut out = vec![0_u16; nx * ny];
    let nothing = vec![0_u16; nx];
    for j in 0..ny {
        let (above, row) = out.split_at_mut(j * nx);
        let (above, row) = (&above[above.len().saturating_sub(nx)..], &mut row[..nx]);
        let is_first = j == 0 || lines > 0 && j.is_multiple_of(lines);
        if j > 0 && is_first {
            bits.restart()?;
        }
        let before = if is_first { first } else { above.first().map_or(0, |&v| v.into()) };
        let Some(begin) = row.first_mut() else { continue };
        *begin = (before + bits.difference(table)?) as u16;
        match predictor {
            // The first line has none above it.
            _ if is_first => line(&mut bits, table, row, &nothing, |a, _, _| a),
            1 => line(&mut bits, table, row, above, |a, _, _| a),
            2 => line(&mut bits, table, row, above, |_, b, _| b),
            3 => line(&mut bits, table, row, above, |_, _, c| c),
            4 => line(&mut bits, table, row, above, |a, b, c| a + b - c),
            5 => line(&mut bits, table, row, above, |a, b, c| a + ((b - c) >> 1)),
            6 => line(&mut bits, table, row, above, |a, b, c| b + ((a - c) >> 1)),
            _ => line(&mut bits, table, row, above, |a, b, _| (a + b) >> 1),
        }?;
    }
    out.iter_mut().for_each(|sample| *sample <<= shift);
    Ok(out)
}

/// The samples of a line behind its first, each from the one before it, the one above, and the one before that.
fn line(bits: &mut Bits<'_>, table: &Table, row: &mut [u16], above: &[u16], guess: impl Fn(i32, i32, i32) -> i32) -> Result<(), ReadError> {
    let (mut a, mut c) = (i32::from(row[0]), i32::from(above[0]));
    for (sample, &b) in row[1..].iter_mut().zip(&above[1..]) {
        let b = i32::from(b);
        // Modulo 2¹⁶, as the standard has it.
        *sample = (guess(a, b, c) + bits.difference(table)?) as u16;
        (a, c) = (i32::from(*sample), b);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Codes of 5 bits, in order of their symbols: how many bits a difference has.
    const CODE_BITS: u32 = 5;

    #[derive(Default)]
    struct Writer {
        bytes: Vec<u8>,
        held: u32,
        count: u32,
    }

    impl Writer {
        fn put(&mut self, value: u32, bits: u32) {
            for n in (0..bits).rev() {
                (self.held, self.count) = (self.held << 1 | (value >> n & 1), self.count + 1);
                if self.count == 8 {
                    self.bytes.push(self.held as u8);
                    if self.held == 0xff {
                        self.bytes.push(0);
                    }
                    (self.held, self.count) = (0, 0);
                }
            }
        }

        fn align(&mut self) {
            while self.count > 0 {
                self.put(1, 1);
            }
        }
    }

    /// An encoder by the letter of annex H.
    fn encode(samples: &[u16], [nx, ny]: [usize; 2], bits: u32, predictor: u8, lines: usize, shift: u32) -> Vec<u8> {
        let size = |n: usize| (n as u16).to_be_bytes();
        let mut out = vec![0xff, 0xd8, 0xff, 0xc3, 0, 11, bits as u8];
        out.extend([size(ny), size(nx)].concat());
        out.extend([1, 1, 0x11, 0, 0xff, 0xc4, 0, 19 + 17, 0, 0, 0, 0, 0, 17, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        out.extend(0..17_u8);
        if lines > 0 {
            out.extend([&[0xff, 0xdd, 0, 4][..], &size(lines * nx)].concat());
        }
        out.extend([0xff, 0xda, 0, 8, 1, 1, 0, predictor, 0, shift as u8]);
        let mut writer = Writer::default();
        let value = |i: usize, j: usize| i32::from(samples[j * nx + i] >> shift);
        for j in 0..ny {
            let is_first = j == 0 || lines > 0 && j % lines == 0;
            if is_first && j > 0 {
                writer.align();
                writer.bytes.extend([0xff, 0xd0 + ((j / lines - 1) % 8) as u8]);
            }
            for i in 0..nx {
                let guess = match (is_first, i, predictor) {
                    (true, 0, _) => 1 << (bits - shift - 1),
                    (true, ..) | (false, 1.., 1) => value(i - 1, j),
                    (false, 0, _) | (_, _, 2) => value(i, j - 1),
                    (_, _, 3) => value(i - 1, j - 1),
                    (_, _, 4) => value(i - 1, j) + value(i, j - 1) - value(i - 1, j - 1),
                    (_, _, 5) => value(i - 1, j) + ((value(i, j - 1) - value(i - 1, j - 1)) >> 1),
                    (_, _, 6) => value(i, j - 1) + ((value(i - 1, j) - value(i - 1, j - 1)) >> 1),
                    _ => (value(i - 1, j) + value(i, j - 1)) >> 1,
                };
                let difference = (value(i, j) - guess) as i16;
                let size = 32 - i32::from(difference).unsigned_abs().leading_zeros();
                writer.put(size, CODE_BITS);
                let low = i32::from(difference) - i32::from(difference < 0);
                writer.put(low as u32 & ((1 << size.min(15)) - 1), if size == 16 { 0 } else { size });
            }
        }
        writer.align();
        [out, writer.bytes, vec![0xff, 0xd9]].concat()
    }

    fn picture([nx, ny]: [usize; 2], bits: u32) -> Vec<u16> {
        (0..nx * ny).map(|n| ((n as u32).wrapping_mul(2_654_435_761) >> (32 - bits)) as u16).collect()
    }

    #[test]
    fn every_predictor_precision_and_interval_gives_its_samples() {
        // Fails if a prediction is wrong, is carried over a restart, or wraps at another width than 16 bits.
        let dims = [7, 9];
        for bits in [2, 8, 12, 16] {
            let samples = picture(dims, bits);
            for predictor in 1..=7 {
                for (lines, shift) in [(0, 0), (1, 0), (2, 0), (4, 1), (9, 0)] {
                    let packed = encode(&samples, dims, bits, predictor, lines, shift);
                    let want: Vec<u16> = samples.iter().map(|v| v >> shift << shift).collect();
                    let read = decode(&packed, &frame(&packed).unwrap()).unwrap();
                    assert_eq!(read, want, "{bits} bits, predictor {predictor}, {lines} lines, shifted by {shift}");
                }
            }
        }
    }

    #[test]
    fn the_crate_reads_the_same_where_there_is_no_restart() {
        // Fails if encoder and decoder here share a mistake.
        let dims = [8, 6];
        let samples = picture(dims, 12);
        for predictor in 1..=7 {
            let packed = encode(&samples, dims, 12, predictor, 0, 0);
            let bytes = jpeg_decoder::Decoder::new(packed.as_slice()).decode().unwrap();
            let theirs: Vec<u16> = bytes.as_chunks().0.iter().map(|&b| u16::from_ne_bytes(b)).collect();
            assert_eq!(theirs, decode(&packed, &frame(&packed).unwrap()).unwrap(), "predictor {predictor}");
        }
    }

    #[test]
    fn what_breaks_off_is_damaged() {
        // Fails if zeros are made up for samples that are not there, or a missing restart marker shifts all that follow.
        let dims = [7, 9];
        let packed = encode(&picture(dims, 12), dims, 12, 1, 2, 0);
        for end in 0..packed.len() - 2 {
            let cut = &packed[..end];
            assert!(frame(cut).is_none_or(|frame| decode(cut, &frame).is_err()), "{end} of {}", packed.len());
        }
        let at = packed.windows(2).position(|w| w == [0xff, 0xd1]).unwrap();
        let mut lost = packed.clone();
        lost.drain(at..at + 2);
        let error = decode(&lost, &frame(&lost).unwrap()).unwrap_err().to_string();
        assert!(error.contains("as JPEG"), "{error}");
    }
}
