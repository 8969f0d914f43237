//! NIfTI-1 and NIfTI-2 in one file, `.nii` or `.nii.gz`, or in two, `.hdr` with `.img`, and their ancestor Analyze 7.5; either byte order.
//!
//! Fields and orientation follow nifti1.h and nifti2.h of <https://nifti.nimh.nih.gov>; its world is RAS, ours LPS.

pub mod write;

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, head_of, in_file};
use super::{Format, Hints, NO_DIRECTIONS, ReadError, Scan, Storage, Writer, archive, bad};
use crate::{Grid, GridError, Metadata, Progress, Unit};
use flate2::bufread::GzDecoder;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The row of the formats.
pub const FORMAT: Format =
    Format { name: "NIfTI", sniff, scan, write: Some(Writer { endings: &[".nii", ".nii.gz"], write: write::write }) };

const GZIP_MAGIC: &[u8] = &[0x1f, 0x8b];
/// Length of a NIfTI-1 header, which is also its first number.
const SIZE_1: usize = 348;
/// Length of a NIfTI-2 header, which is also its first number.
const SIZE_2: usize = 540;

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    // The names cover files that are damaged too, so that what is wrong with them can be said.
    let name = path.to_string_lossy().to_lowercase();
    let named = [".nii", ".nii.gz", ".img", ".img.gz"].iter().any(|end| name.ends_with(end));
    !head.is_empty() && (named || Header::parse(&header_bytes(head, SIZE_2)).is_some())
}

/// The first bytes of the header, decompressed if need be; fewer where the file ends.
fn header_bytes(head: &[u8], most: usize) -> Vec<u8> {
    let mut bytes = vec![];
    if head.starts_with(GZIP_MAGIC) {
        // A head that breaks off is no error: what came before it counts.
        let _ = GzDecoder::new(head).take(most as u64).read_to_end(&mut bytes);
    } else {
        bytes.extend_from_slice(&head[..head.len().min(most)]);
    }
    bytes
}

/// The first line of the comment in which this program keeps what float32 rounds and what has no field, and the names of its first lines.
const COMMENT: &str = "bregma";
const TO_WORLD: &str = "index_to_lps_mm";
const SLOPE: &str = "slope";
const INTERCEPT: &str = "intercept";
/// Room for the comment and for the extensions of others before it.
const MOST_HEAD: u64 = 1 << 16;

/// What a header belongs to.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Samples follow in the same file.
    Single,
    /// Samples are in the `.img` beside it.
    Pair,
    /// As a pair, and it says nothing about the patient.
    Analyze,
}

/// A header of either version, each field by its place in both.
struct Header<'a> {
    bytes: &'a [u8],
    big_endian: bool,
    /// NIfTI-2.
    wide: bool,
}

impl<'a> Header<'a> {
    fn parse(bytes: &'a [u8]) -> Option<Self> {
        let first: [u8; 4] = bytes.get(..4)?.try_into().ok()?;
        let size = |n: usize| [(n as u32).to_le_bytes(), (n as u32).to_be_bytes()];
        let (wide, order) = if size(SIZE_1).contains(&first) { (false, size(SIZE_1)) } else { (true, size(SIZE_2)) };
        let big_endian = order.iter().position(|o| *o == first)? == 1;
        (bytes.len() >= if wide { SIZE_2 } else { SIZE_1 }).then_some(Self { bytes, big_endian, wide })
    }

    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut field: [u8; N] = self.bytes[at..at + N].try_into().expect("a slice of N bytes is an array of N");
        if self.big_endian {
            field.reverse();
        }
        field
    }

    /// The integer of 2 bytes at `at` in NIfTI-1, or of `bytes` at `at_2` in NIfTI-2.
    fn int(&self, at: usize, at_2: usize, bytes: usize) -> i64 {
        match (self.wide, bytes) {
            (true, 8) => i64::from_le_bytes(self.array(at_2)),
            (true, 4) => i32::from_le_bytes(self.array(at_2)).into(),
            _ => i16::from_le_bytes(self.array(if self.wide { at_2 } else { at })).into(),
        }
    }

    /// The float32 at `at` in NIfTI-1, or the float64 at `at_2` in NIfTI-2.
    fn float(&self, at: usize, at_2: usize) -> f64 {
        if self.wide { f64::from_le_bytes(self.array(at_2)) } else { f32::from_le_bytes(self.array(at)).into() }
    }

    fn floats<const N: usize>(&self, at: usize, at_2: usize) -> [f64; N] {
        std::array::from_fn(|n| self.float(at + 4 * n, at_2 + 8 * n))
    }

    /// The lines of this program's comment among the extensions, by name.
    fn comment(&self) -> Metadata {
        let size = if self.wide { SIZE_2 } else { SIZE_1 };
        let Some(mut rest) = self.bytes.get(size + 4..).filter(|_| self.bytes[size] != 0) else { return Metadata::new() };
        let number = |b: [u8; 4]| if self.big_endian { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) };
        while let Some((&[size, code], _)) = rest.as_chunks::<4>().0.split_first_chunk::<2>() {
            let Some(text) = rest.get(8..number(size) as usize) else { break };
            let text = String::from_utf8_lossy(text);
            if let (6, Some(lines)) = (number(code), text.trim_end_matches('\0').strip_prefix(COMMENT)) {
                let pairs = lines.lines().filter_map(|line| line.split_once('='));
                return pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
            }
            rest = &rest[number(size) as usize..];
        }
        Metadata::new()
    }

    fn kind(&self) -> Kind {
        match if self.wide { &self.bytes[4..8] } else { &self.bytes[344..348] } {
            b"n+1\0" | b"n+2\0" => Kind::Single,
            b"ni1\0" | b"ni2\0" => Kind::Pair,
            _ => Kind::Analyze,
        }
    }

    fn dims(&self) -> Result<[usize; 3], ReadError> {
        let dim: [i64; 8] = std::array::from_fn(|n| self.int(40 + 2 * n, 16 + 8 * n, 8));
        let count = usize::try_from(dim[0]).unwrap_or(0);
        let bad = |problem: &str| bad("dim", format!("{dim:?}"), problem);
        if !(1..=7).contains(&count) {
            return Err(bad("the first number must be from 1 to 7"));
        }
        if count < 3 || dim[4..].iter().take(count - 3).any(|&n| n > 1) {
            let text = format!("its dimensions are {:?}; only images of three axes can be read; split off one of them", &dim[1..=count]);
            return Err(ReadError::Unsupported(text));
        }
        let size = |n: i64| usize::try_from(n).map_err(|_| bad("a size is negative"));
        Ok([size(dim[1])?, size(dim[2])?, size(dim[3])?])
    }

    fn sample(&self) -> Result<SampleType, ReadError> {
        let other = match self.int(70, 12, 2) {
            2 => return Ok(SampleType::U8),
            4 => return Ok(SampleType::I16),
            8 => return Ok(SampleType::I32),
            16 => return Ok(SampleType::F32),
            64 => return Ok(SampleType::F64),
            256 => return Ok(SampleType::I8),
            512 => return Ok(SampleType::U16),
            768 => return Ok(SampleType::U32),
            1024 => return Ok(SampleType::I64),
            1280 => return Ok(SampleType::U64),
            1 => "single bits",
            32 | 1792 | 2048 => "complex numbers",
            128 => "colours (RGB24)",
            2304 => "colours (RGBA32)",
            1536 => "float128",
            code => return Err(bad("datatype", code.to_string(), "it is none of NIfTI's")),
        };
        Err(ReadError::Unsupported(format!("its samples are {other}; only whole numbers and floats of up to 64 bits can be read")))
    }

    /// Where the samples begin, in decompressed bytes.
    fn offset(&self) -> Result<u64, ReadError> {
        let size = match (self.kind(), self.wide) {
            (Kind::Single, false) => SIZE_1 as f64,
            (Kind::Single, true) => SIZE_2 as f64,
            (Kind::Pair | Kind::Analyze, _) => 0.0,
        };
        let offset = if self.wide { self.int(0, 168, 8) as f64 } else { self.float(108, 0) };
        match offset {
            // Unset. Four bytes that announce extensions follow the header.
            0.0 if size > 0.0 => Ok(size as u64 + 4),
            // 2⁵³: above it a float64 cannot count bytes.
            _ if offset >= size && offset < 9e15 && offset.fract() == 0.0 => Ok(offset as u64),
            _ => Err(bad("vox_offset", offset.to_string(), "it must be a whole number of bytes, after the header")),
        }
    }

    fn scale(&self) -> (f64, f64) {
        let [slope, intercept] = self.floats(112, 176);
        // Analyze has other things there.
        if self.kind() == Kind::Analyze || slope == 0.0 || !slope.is_finite() {
            (1.0, 0.0)
        } else {
            (slope, if intercept.is_finite() { intercept } else { 0.0 })
        }
    }

    /// Index to world: the sform, else the qform, else spacings alone, as nifti1.h's methods 3, 2 and 1.
    fn grid(&self, hints: &Hints, warnings: &mut Vec<String>) -> Result<Grid, ReadError> {
        let dims = self.dims()?;
        let units = if self.wide { self.int(0, 500, 4) } else { self.bytes[123].into() };
        let unit_mm = match units & 7 {
            1 => 1e3,
            3 => 1e-3,
            _ => 1.0,
        };
        let lps = DVec3::new(-1.0, -1.0, 1.0);
        let [handed, pixdim @ ..]: [f64; 4] = self.floats(76, 104);
        if self.kind() == Kind::Analyze {
            // Its axes grow to the left, the front and the top, unless a program thought otherwise.
            warnings.push("Analyze files do not state how they lie in the patient; the axes are taken as left, anterior, superior".into());
            return self.unplaced(dims, DVec3::from(pixdim).abs(), DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)), hints);
        }
        if self.int(254, 348, 4) > 0 {
            let [x, y, z]: [[f64; 4]; 3] = std::array::from_fn(|n| self.floats(280 + 16 * n, 400 + 32 * n));
            let column = |n: usize| lps * DVec3::new(x[n], y[n], z[n]) * unit_mm;
            let matrix = DMat3::from_cols(column(0), column(1), column(2));
            // A form of zeros is what some programs leave when they drop it.
            if matrix == DMat3::ZERO {
                let instead = if self.int(252, 344, 4) > 0 { "qform" } else { "spacings alone, as it has no qform" };
                warnings.push(format!("its sform is all zeros; where it lies is taken from its {instead}"));
            } else {
                return Ok(Grid::from_affine(dims, DAffine3::from_mat3_translation(matrix, column(3)))?);
            }
        }
        // A size has no sign; that of the axes is in the forms.
        let spacing_mm = DVec3::from(pixdim).abs() * unit_mm;
        if self.int(252, 344, 4) > 0 {
            let [b, c, d, ox, oy, oz] = self.floats(256, 352);
            let square = b * b + c * c + d * d;
            // b, c and d are float32 in NIfTI-1: a half turn can come out a rounding above 1 (1e-7, as in nifti1_io.c).
            let turn = if 1.0 - square < 1e-7 {
                let n = square.sqrt();
                DQuat::from_xyzw(b / n, c / n, d / n, 0.0)
            } else {
                DQuat::from_xyzw(b, c, d, (1.0 - square).sqrt())
            };
            let mirror = DVec3::new(1.0, 1.0, if handed < 0.0 { -1.0 } else { 1.0 });
            let direction = DMat3::from_diagonal(lps) * DMat3::from_quat(turn) * DMat3::from_diagonal(mirror);
            return Ok(Grid::new(dims, spacing_mm, lps * DVec3::new(ox, oy, oz) * unit_mm, direction)?);
        }
        // Method 1 names no axes of the patient; ITK takes them as LPS, and so do we.
        warnings.push(NO_DIRECTIONS.into());
        self.unplaced(dims, spacing_mm, DMat3::IDENTITY, hints)
    }

    /// A grid of spacings alone.
    fn unplaced(&self, dims: [usize; 3], spacing_mm: DVec3, direction: DMat3, hints: &Hints) -> Result<Grid, ReadError> {
        let stated = |axis: usize| spacing_mm[axis].is_finite() && spacing_mm[axis] != 0.0;
        let pixdim = spacing_mm;
        let spacing_mm = DVec3::from_array(std::array::from_fn(|axis| match hints.spacing_mm {
            Some(mm) if !stated(axis) => mm[axis],
            _ => spacing_mm[axis],
        }));
        Grid::new(dims, spacing_mm, DVec3::ZERO, direction).map_err(|e| match e {
            GridError::Spacing { .. } => bad("pixdim", format!("{pixdim:?}"), &format!("{e}; pass --spacing X,Y,Z where it is 0")),
            e => e.into(),
        })
    }
}

/// The grid of a comment, if it is the one that the header holds rounded: otherwise another program has moved the scan.
fn exact(map: &str, rounded: &Grid) -> Option<Grid> {
    let numbers: Option<Vec<f64>> = map.split_whitespace().map(|n| n.parse().ok()).collect();
    let numbers: [f64; 12] = numbers?.try_into().ok()?;
    let same = numbers.iter().zip(rounded.index_to_world().to_cols_array()).all(|(a, b)| f64::from(*a as f32) == f64::from(b as f32));
    same.then(|| Grid::from_affine(rounded.dims(), DAffine3::from_cols_array(&numbers)).ok())?
}

/// The header and the samples of the scan that `path` is the whole or half of.
fn files(path: &Path) -> (PathBuf, PathBuf) {
    let text = path.to_string_lossy().to_lowercase();
    let bare = if text.ends_with(".gz") { path.with_extension("") } else { path.to_owned() };
    let is = |ext: &str| bare.extension().is_some_and(|e| e.eq_ignore_ascii_case(ext));
    let beside = |ext: &str| {
        let capitals = bare.extension().is_some_and(|e| e.to_string_lossy().chars().all(char::is_uppercase));
        let plain = bare.with_extension(if capitals { ext.to_uppercase() } else { ext.to_owned() });
        let packed = PathBuf::from(format!("{}.gz", plain.display()));
        if !archive::is_file(&plain) && archive::is_file(&packed) { packed } else { plain }
    };
    if is("img") {
        (beside("hdr"), path.to_owned())
    } else if is("hdr") {
        (path.to_owned(), beside("img"))
    } else {
        (path.to_owned(), path.to_owned())
    }
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let (header_file, data_file) = files(path);
    let head = head_of(&header_file, MOST_HEAD);
    let head = if header_file == path { head?.0 } else { head.map_err(|e| in_file(&header_file, e))?.0 };
    let bytes = header_bytes(&head, MOST_HEAD as usize);
    let header = Header::parse(&bytes);
    let header = header.ok_or(ReadError::NoHeader("a NIfTI header begins with its length, 348 or 540, and is that long"))?;
    let is_single = header.kind() == Kind::Single;
    if !is_single && header_file == data_file {
        let text = "its header says that its samples are in another file; name it .hdr and put the .img beside it";
        return Err(ReadError::Contradiction(text.into()));
    }
    let data_file = if is_single { &header_file } else { &data_file };
    let beside = data_file != path;
    let named = |e| if beside { in_file(data_file, e) } else { e };
    let (start, there) = head_of(data_file, 2).map_err(named)?;
    let mut warnings = vec![];
    let grid = header.grid(hints, &mut warnings)?;
    let encoding = Encoding { sample: header.sample()?, big_endian: header.big_endian };
    let packing = if start.starts_with(GZIP_MAGIC) { Packing::Gzip } else { Packing::Plain };
    let wanted = grid.len() as u128 * encoding.sample.bytes() as u128;
    let part = Part::checked(data_file, packing, 0, header.offset()?, wanted, there).map_err(named)?;
    let (slope, intercept) = header.scale();
    let description = String::from_utf8_lossy(&header.bytes[if header.wide { 240..320 } else { 148..228 }]).into_owned();
    let description = description.trim_matches(['\0', ' ']).split('\0').next().unwrap_or_default().to_owned();
    let mut metadata = header.comment();
    let grid = match metadata.remove(TO_WORLD).and_then(|map| exact(&map, &grid)) {
        Some(exact) => exact,
        None => grid,
    };
    let mut number = |name: &str, rounded: f64| {
        let whole = metadata.remove(name).and_then(|n| n.parse().ok());
        whole.filter(|v: &f64| f64::from(*v as f32) == rounded).unwrap_or(rounded)
    };
    let (slope, intercept) = (number(SLOPE, slope), number(INTERCEPT, intercept));
    if !description.is_empty() {
        metadata.insert("description".to_owned(), description);
    }
    let scan = Scan::new(grid, encoding, there, Storage::Parts(vec![Part { beside, ..part }]));
    // Where this program writes the unit of values.
    let unit = match header.bytes[if header.wide { 508..524 } else { 328..344 }].split(|b| *b == 0).next() {
        Some(b"HU") if is_single => Some(Unit::Hounsfield),
        Some(b"value") if is_single => Some(Unit::Value),
        _ => None,
    };
    Ok(Scan { slope, intercept, unit, warnings, metadata, ..scan })
}
