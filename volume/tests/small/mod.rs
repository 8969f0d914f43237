//! Small scans written byte by byte, each in a form that people bring: the same samples on the same grid as far as the form can hold it.

#![allow(dead_code, reason = "each test uses its part")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

pub mod same;

use bregma_volume::{Progress, formats};
use flate2::Compression;
use flate2::write::{DeflateEncoder, GzEncoder, ZlibEncoder};
use std::collections::BTreeMap;
use std::fs;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Samples along each axis.
pub const DIMS: [usize; 3] = [8, 6, 4];
/// Their distance, mm.
pub const SPACING_MM: [f64; 3] = [0.5, 0.75, 2.0];

/// Sample (i, j, k): 12 bits.
pub fn sample(i: usize, j: usize, k: usize) -> u16 {
    ((i * 7 + j * 13 + k * 29) * 37 % 4096) as u16
}

/// The samples of slice k as bytes.
pub fn slice(k: usize, big: bool) -> Vec<u8> {
    let order = |v: u16| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    (0..DIMS[1]).flat_map(|j| (0..DIMS[0]).flat_map(move |i| order(sample(i, j, k)))).collect()
}

/// All samples as bytes.
pub fn samples(big: bool) -> Vec<u8> {
    (0..DIMS[2]).flat_map(|k| slice(k, big)).collect()
}

/// A folder that is gone with its value.
pub struct Folder(pub PathBuf);

impl Folder {
    /// A folder of its own for `name`; in memory where the system has a place for that.
    pub fn new(name: &str) -> Self {
        let memory = Path::new("/dev/shm");
        let place = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        let path = place.join(format!("bregma-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// Writes a file; its path.
    pub fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A scan as files.
#[derive(Clone)]
pub struct Small {
    /// What it shows.
    pub name: &'static str,
    /// Its files.
    pub files: Vec<(String, Vec<u8>)>,
    /// The one to open; empty for their folder.
    pub open: &'static str,
}

impl Small {
    fn one(name: &'static str, open: &'static str, bytes: Vec<u8>) -> Self {
        Self { name, files: vec![(open.to_owned(), bytes)], open }
    }

    /// Writes it into a folder of its own in `folder`; the path to open.
    pub fn write(&self, folder: &Folder) -> PathBuf {
        self.files.iter().for_each(|(name, bytes)| drop(folder.put(&format!("{}/{name}", self.name), bytes)));
        // Joined with an empty name a folder would end in a slash.
        let own = folder.0.join(self.name);
        if self.open.is_empty() { own } else { own.join(self.open) }
    }
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(vec![], Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

pub fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut out = ZlibEncoder::new(vec![], Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

pub fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut out = DeflateEncoder::new(vec![], Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

pub fn zip(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut out = zip::ZipWriter::new(Cursor::new(vec![]));
    for (n, (name, bytes)) in files.iter().enumerate() {
        let method = if n % 2 == 0 { zip::CompressionMethod::Deflated } else { zip::CompressionMethod::Stored };
        out.start_file(name.as_str(), zip::write::SimpleFileOptions::default().compression_method(method)).unwrap();
        out.write_all(bytes).unwrap();
    }
    out.finish().unwrap().into_inner()
}

pub fn tar(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut tar = tar::Builder::new(vec![]);
    for (name, bytes) in files {
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        header.set_cksum();
        tar.append_data(&mut header, name, bytes.as_slice()).unwrap();
    }
    tar.into_inner().unwrap()
}

pub const EXPLICIT: &str = "1.2.840.10008.1.2.1";
pub const IMPLICIT: &str = "1.2.840.10008.1.2";
pub const BIG: &str = "1.2.840.10008.1.2.2";
pub const DEFLATED: &str = "1.2.840.10008.1.2.1.99";
pub const JPEG_LOSSLESS: &str = "1.2.840.10008.1.2.4.70";
pub const JPEG_LS: &str = "1.2.840.10008.1.2.4.80";
pub const JPEG_2000: &str = "1.2.840.10008.1.2.4.90";
pub const HTJ2K: &str = "1.2.840.10008.1.2.4.201";
pub const RLE: &str = "1.2.840.10008.1.2.5";

/// A DICOM file in the making: value representation and value, little-endian, by tag.
#[derive(Clone)]
pub struct Dicom {
    pub syntax: &'static str,
    pub elements: BTreeMap<(u16, u16), (&'static str, Vec<u8>)>,
    /// Packed pixels, which stand in for native ones.
    pub fragments: Option<Vec<Vec<u8>>>,
}

impl Dicom {
    /// Slice k of a CT: samples 0 to 4095 are −1024 to 3071 HU.
    pub fn slice(k: usize) -> Self {
        let mut dicom = Self { syntax: EXPLICIT, elements: BTreeMap::new(), fragments: None };
        let [_, dj, dk] = SPACING_MM;
        for (tag, vr, text) in [
            ((0x0008, 0x0008), "CS", "ORIGINAL\\PRIMARY\\AXIAL".to_owned()),
            ((0x0008, 0x0060), "CS", "CT".into()),
            ((0x0008, 0x103e), "LO", "a skull".into()),
            ((0x0010, 0x0010), "PN", "SECRET^PERSON".into()),
            ((0x0010, 0x0030), "DA", "19010203".into()),
            ((0x0018, 0x0050), "DS", "1.5".into()),
            ((0x0020, 0x000e), "UI", "1.2.3".into()),
            ((0x0020, 0x0011), "IS", "7".into()),
            ((0x0020, 0x0013), "IS", (k + 1).to_string()),
            ((0x0020, 0x0032), "DS", format!("-10\\20\\{}", 30.0 + dk * k as f64)),
            ((0x0020, 0x0037), "DS", "1\\0\\0\\0\\1\\0".into()),
            ((0x0028, 0x0004), "CS", "MONOCHROME2".into()),
            ((0x0028, 0x0030), "DS", format!("{dj}\\{}", SPACING_MM[0])),
            ((0x0028, 0x1052), "DS", "-1024".into()),
            ((0x0028, 0x1053), "DS", "1".into()),
        ] {
            dicom.text(tag, vr, &text);
        }
        let [nx, ny, _] = DIMS.map(|n| n as u16);
        for (element, value) in [(0x0002, 1), (0x0010, ny), (0x0011, nx), (0x0100, 16), (0x0101, 12), (0x0102, 11), (0x0103, 0)] {
            dicom.number((0x0028, element), value);
        }
        dicom.elements.insert((0x7fe0, 0x0010), ("OW", slice(k, false)));
        dicom
    }

    pub fn text(&mut self, tag: (u16, u16), vr: &'static str, text: &str) {
        self.elements.insert(tag, (vr, text.as_bytes().to_vec()));
    }

    pub fn number(&mut self, tag: (u16, u16), value: u16) {
        self.elements.insert(tag, ("US", value.to_le_bytes().to_vec()));
    }

    /// The same with a text changed.
    pub fn with(mut self, tag: (u16, u16), vr: &'static str, text: &str) -> Self {
        self.text(tag, vr, text);
        self
    }

    /// The same without an element.
    pub fn without(mut self, tag: (u16, u16)) -> Self {
        self.elements.remove(&tag);
        self
    }

    /// The same with its pixels packed.
    pub fn packed(mut self, syntax: &'static str, fragments: Vec<Vec<u8>>) -> Self {
        (self.syntax, self.fragments) = (syntax, Some(fragments));
        self.without((0x7fe0, 0x0010))
    }

    pub fn bytes(&self) -> Vec<u8> {
        let (explicit, big) = (self.syntax != IMPLICIT, self.syntax == BIG);
        let mut set = vec![];
        for (tag, (vr, value)) in &self.elements {
            set.extend(element(*tag, vr, value, explicit, big));
        }
        if let Some(fragments) = &self.fragments {
            set.extend(element((0x7fe0, 0x0010), "OB", &[], true, false));
            let at = set.len() - 4;
            set[at..].copy_from_slice(&u32::MAX.to_le_bytes());
            for fragment in [vec![]].iter().chain(fragments) {
                set.extend([0xfe, 0xff, 0x00, 0xe0]);
                let padded: Vec<u8> = fragment.iter().copied().chain((fragment.len() % 2 == 1).then_some(0)).collect();
                set.extend((padded.len() as u32).to_le_bytes());
                set.extend(padded);
            }
            set.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
        }
        let mut meta = element((2, 0x0010), "UI", self.syntax.as_bytes(), true, false);
        meta.splice(0..0, element((2, 0), "UL", &(meta.len() as u32).to_le_bytes(), true, false));
        let set = if self.syntax == DEFLATED { deflate(&set) } else { set };
        [vec![0; 128], b"DICM".to_vec(), meta, set].concat()
    }
}

/// One data element; values of even length, numbers in the byte order that is asked for.
pub fn element(tag: (u16, u16), vr: &str, value: &[u8], explicit: bool, big: bool) -> Vec<u8> {
    let mut value = value.to_vec();
    if value.len() % 2 == 1 {
        value.push(if vr == "UI" { 0 } else { b' ' });
    }
    if big && ["US", "OW"].contains(&vr) {
        value.chunks_mut(2).for_each(<[u8]>::reverse);
    }
    let short = |n: u16| if big { n.to_be_bytes() } else { n.to_le_bytes() };
    let long = |n: u32| if big { n.to_be_bytes() } else { n.to_le_bytes() };
    let mut out = [short(tag.0), short(tag.1)].concat();
    if !explicit {
        out.extend(long(value.len() as u32));
    } else if ["OB", "OW", "SQ", "UN"].contains(&vr) {
        out.extend(vr.as_bytes());
        out.extend([0, 0]);
        out.extend(long(value.len() as u32));
    } else {
        out.extend(vr.as_bytes());
        out.extend(short(value.len() as u16));
    }
    out.extend(value);
    out
}

/// A sequence of items of explicit, little-endian elements.
pub fn sequence(tag: (u16, u16), items: &[Vec<u8>]) -> Vec<u8> {
    element(tag, "SQ", &item_bytes(items), true, false)
}

fn item_bytes(items: &[Vec<u8>]) -> Vec<u8> {
    items.iter().flat_map(|i| [&[0xfe, 0xff, 0x00, 0xe0][..], &(i.len() as u32).to_le_bytes(), i].concat()).collect()
}

/// All slices of a CT as files.
pub fn dicom_files(make: impl Fn(usize) -> Dicom) -> Vec<(String, Vec<u8>)> {
    // Names in another order than the slices.
    (0..DIMS[2]).map(|k| (format!("IM{}", (k * 3 + 1) % 4), make(k).bytes())).collect()
}

/// A multi-frame CT: all that is per slice in functional groups.
pub fn enhanced() -> Dicom {
    let mut dicom = Dicom::slice(0);
    for tag in [(0x20, 0x32), (0x20, 0x37), (0x28, 0x30), (0x28, 0x1052), (0x28, 0x1053), (0x18, 0x50)] {
        dicom.elements.remove(&tag);
    }
    let text = |tag, text: String| element(tag, "DS", text.as_bytes(), true, false);
    let shared = [
        sequence((0x20, 0x9116), &[text((0x20, 0x37), "1\\0\\0\\0\\1\\0".into())]),
        sequence((0x28, 0x9110), &[text((0x28, 0x30), format!("{}\\{}", SPACING_MM[1], SPACING_MM[0]))]),
        sequence((0x28, 0x9145), &[[text((0x28, 0x1052), "-1024".into()), text((0x28, 0x1053), "1".into())].concat()]),
    ]
    .concat();
    let frames: Vec<Vec<u8>> = (0..DIMS[2])
        .map(|k| sequence((0x20, 0x9113), &[text((0x20, 0x32), format!("-10\\20\\{}", 30.0 + SPACING_MM[2] * k as f64))]))
        .collect();
    dicom.text((0x28, 0x8), "IS", &DIMS[2].to_string());
    dicom.elements.insert((0x5200, 0x9229), ("SQ", item_bytes(&[shared])));
    dicom.elements.insert((0x5200, 0x9230), ("SQ", item_bytes(&frames)));
    dicom.elements.insert((0x7fe0, 0x10), ("OW", samples(false)));
    dicom
}

/// Slice 0 packed by other programs' encoders (imagecodecs 2026): lossless JPEG, JPEG 2000 of samples and of samples − 2048, JPEG-LS.
pub fn packed(codec: &str) -> Vec<u8> {
    let hex = match codec {
        "jpeg" => {
            "ffd8ffc40017000101010100000000000000000000000008090c10ffc3000b100006000801001100ffda0008010000060000ea0740e81d03a0740e81de178bc5e2f178bc5e3785e2f178bc5e2f178de178bc5e2f178bc5e3785e2f178bc5e2f178de178bc5e2f178bc707800ffd9"
        }
        "jpeg 2000" => {
            "ff4fff5100290000000000080000000600000000000000000000000800000006000000000000000000010b0101ff52000c00000001000004040001ff5c00044060ff640025000143726561746564206279204f70656e4a5045472076657273696f6e20322e352e34ff90000a0000000000570001ff93dfe11812275242c972e4a6c1ddc627bd0f4343fa64b6b1ecc3bf59c2946a3c178c8b21185a60a1704668f2c3fa95832d831e038ceeb33fd046ac5bd002568696bfde4ea50d55560887ffd9"
        }
        "signed jpeg 2000" => {
            "ff4fff5100290000000000080000000600000000000000000000000800000006000000000000000000018f0101ff52000c00000001000004040001ff5c00044080ff640025000143726561746564206279204f70656e4a5045472076657273696f6e20322e352e34ff90000a0000000000580001ff93c1fe118012275242c972e4a6c1ddc627bd0f4343fa64b6b1ecc3bf59c2946a3c178c8b21185a60a1704668f2c3fa95832d831e038ceeb33fd046ac5bd002568696bfde4ea50d55560887ffd9"
        }
        _ => {
            "ffd8ffe800205350494646000200000100000006000000080a1006010000012c0000012cffe8000800000001ffd8fff7000b100006000801011100fff8000d01ffff0012004301140040ffda0008010100000000b02e05c0b80f00ff7ff7e1606c09809007fdfe606f85fd7f1fb7e9f97e1813e07ddf67d5f47cdf2602f7df17c1ef7b9ed7b0803de7adea7a5e879de600008040ffd9"
        }
    };
    (0..hex.len()).step_by(2).map(|n| u8::from_str_radix(&hex[n..n + 2], 16).unwrap()).collect()
}

/// A slice packed by runs as DICOM does: high bytes, then low ones; every second run as literals.
pub fn rle(k: usize) -> Vec<u8> {
    let bytes = slice(k, false);
    let segment = |offset: usize| -> Vec<u8> {
        let plane: Vec<u8> = bytes.iter().copied().skip(offset).step_by(2).collect();
        let mut out = vec![];
        for row in plane.chunks(DIMS[0]) {
            if row.iter().all(|b| *b == row[0]) {
                out.extend([(257 - row.len()) as u8, row[0]]);
            } else {
                out.push(row.len() as u8 - 1);
                out.extend(row);
            }
        }
        out
    };
    let (high, low) = (segment(1), segment(0));
    let mut header = [2, 64, 64 + high.len() as u32].map(u32::to_le_bytes).concat();
    header.resize(64, 0);
    [header, high, low].concat()
}

pub fn nrrd(fields: &str, data: &[u8]) -> Vec<u8> {
    let [nx, ny, nz] = DIMS;
    let [dx, dy, dz] = SPACING_MM;
    let header = format!(
        "NRRD0004\ntype: ushort\ndimension: 3\nsizes: {nx} {ny} {nz}\nspace: left-posterior-superior\nspace directions: ({dx},0,0) (0,{dy},0) (0,0,{dz})\nspace origin: (-10,20,30)\nendian: little\n{fields}\n\n"
    );
    [header.as_bytes(), data].concat()
}

/// A NIfTI-1 header of the samples: RAS, so that its x and y have other signs. `magic` tells what it belongs to.
pub fn nifti(magic: &[u8], offset: f32) -> Vec<u8> {
    let mut h = vec![0; 352];
    let mut put = |at: usize, field: &[u8]| h[at..at + field.len()].copy_from_slice(field);
    put(0, &348_i32.to_le_bytes());
    [3, 8, 6, 4, 1, 1, 1, 1].iter().enumerate().for_each(|(n, v)| put(40 + 2 * n, &i16::to_le_bytes(*v)));
    put(70, &512_i16.to_le_bytes());
    [1.0, 0.5, 0.75, 2.0].iter().enumerate().for_each(|(n, v)| put(76 + 4 * n, &f32::to_le_bytes(*v)));
    put(108, &offset.to_le_bytes());
    put(123, &[2]);
    put(254, &1_i16.to_le_bytes());
    let rows = [-0.5, 0.0, 0.0, 10.0, 0.0, -0.75, 0.0, -20.0, 0.0, 0.0, 2.0, 30.0];
    rows.iter().enumerate().for_each(|(n, v)| put(280 + 4 * n, &f32::to_le_bytes(*v)));
    put(344, magic);
    h
}

pub fn metaimage(fields: &str, data_file: &str, data: &[u8]) -> Vec<u8> {
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\n{fields}TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = -10 20 30\nElementSpacing = 0.5 0.75 2\nDimSize = 8 6 4\nElementType = MET_USHORT\nElementDataFile = {data_file}\n"
    );
    [header.as_bytes(), data].concat()
}

pub fn npy(order: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{order}u2', 'fortran_order': {fortran}, 'shape': ({shape}), }}\n");
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), data].concat()
}

pub fn gipl() -> Vec<u8> {
    let mut h = vec![0; 256];
    let mut put = |at: usize, field: &[u8]| h[at..at + field.len()].copy_from_slice(field);
    [8, 6, 4, 1, 16].iter().enumerate().for_each(|(n, v)| put(2 * n, &u16::to_be_bytes(*v)));
    [0.5, 0.75, 2.0, 1.0].iter().enumerate().for_each(|(n, v)| put(10 + 4 * n, &f32::to_be_bytes(*v)));
    [-10.0, 20.0, 30.0].iter().enumerate().for_each(|(n, v)| put(204 + 8 * n, &f64::to_be_bytes(*v)));
    put(252, &0xefff_e9b0_u32.to_be_bytes());
    [h, samples(true)].concat()
}

pub fn vti(file: &str, array: &str, after: &[u8]) -> Vec<u8> {
    let head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" {file}>\n<ImageData WholeExtent=\"0 7 0 5 0 3\" Origin=\"-10 20 30\" Spacing=\"0.5 0.75 2\">\n<Piece Extent=\"0 7 0 5 0 3\">\n<PointData Scalars=\"v\">\n<DataArray type=\"UInt16\" Name=\"v\" {array}"
    );
    [head.as_bytes(), after].concat()
}

const VTI_END: &[u8] = b"</DataArray></PointData></Piece></ImageData></VTKFile>\n";

fn vti_appended(data: &[u8]) -> Vec<u8> {
    [b"</PointData></Piece></ImageData>\n<AppendedData encoding=\"raw\">\n _", data, b"</AppendedData></VTKFile>\n"].concat()
}

/// VTK's packed blocks of 256 bytes: header and data.
fn vti_blocks(word: usize) -> (Vec<u8>, Vec<u8>) {
    let data = samples(false);
    let blocks: Vec<Vec<u8>> = data.chunks(256).map(zlib).collect();
    let numbers = [blocks.len(), 256, data.len() % 256].into_iter().chain(blocks.iter().map(Vec::len));
    (numbers.flat_map(|n| (n as u64).to_le_bytes()[..word].to_vec()).collect(), blocks.concat())
}

/// A project; `matrix` and its list under other names are other programs' business.
pub fn invesalius(plist: &str, packed: bool) -> Vec<u8> {
    let tar = tar(&[("tmp/matrix.dat".into(), samples(false)), ("tmp/main.plist".into(), plist.as_bytes().to_vec())]);
    if packed { gzip(&tar) } else { tar }
}

pub const PLIST: &str = "<?xml version=\"1.0\"?>\n<plist version=\"1.0\"><dict>\n<key>name</key><string>SECRET PERSON</string>\n<key>modality</key><string>CT</string>\n<key>matrix</key><dict><key>dtype</key><string>uint16</string><key>filename</key><string>matrix.dat</string><key>shape</key><array><integer>4</integer><integer>6</integer><integer>8</integer></array></dict>\n<key>spacing</key><array><real>0.5</real><real>0.75</real><real>2</real></array>\n</dict></plist>\n";

/// A TIFF of all slices, or of one.
pub fn tiff(slices: std::ops::Range<usize>, description: &str, compression: tiff::encoder::Compression, big: bool) -> Vec<u8> {
    use tiff::encoder::{Rational, TiffEncoder, TiffKind, colortype::Gray16};
    fn fill<K: TiffKind>(mut tiff: TiffEncoder<&mut Cursor<Vec<u8>>, K>, slices: std::ops::Range<usize>, description: &str) {
        let first = slices.start;
        for k in slices {
            let values: Vec<u16> = slice(k, false).chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
            let mut page = tiff.new_image::<Gray16>(DIMS[0] as u32, DIMS[1] as u32).unwrap();
            page.rows_per_strip(4).unwrap();
            page.x_resolution(Rational { n: 2, d: 1 });
            page.y_resolution(Rational { n: 4, d: 3 });
            if k == first && !description.is_empty() {
                page.encoder().write_tag(tiff::tags::Tag::ImageDescription, description).unwrap();
            }
            page.write_data(&values).unwrap();
        }
    }
    let mut out = Cursor::new(vec![]);
    match big {
        false => fill(TiffEncoder::new(&mut out).unwrap().with_compression(compression), slices, description),
        true => fill(TiffEncoder::new_big(&mut out).unwrap().with_compression(compression), slices, description),
    }
    out.into_inner()
}

pub const IMAGEJ: &str = "ImageJ=1.53t\nimages=4\nslices=4\nunit=mm\nspacing=2\nloop=false\n";

pub fn picture(k: usize, format: image::ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(vec![]);
    let [nx, ny, _] = DIMS.map(|n| n as u32);
    let at = |x: u32, y: u32| sample(x as usize, y as usize, k);
    match format {
        image::ImageFormat::Png => image::ImageBuffer::from_fn(nx, ny, |x, y| image::Luma([at(x, y)])).write_to(&mut out, format),
        _ => image::ImageBuffer::from_fn(nx, ny, |x, y| image::Luma([(at(x, y) >> 4) as u8])).write_to(&mut out, format),
    }
    .unwrap();
    out.into_inner()
}

fn pictures(ext: &str, format: image::ImageFormat) -> Vec<(String, Vec<u8>)> {
    // 8, 9, 10, 11: their order is that of numbers.
    (0..DIMS[2]).map(|k| (format!("slice{}.{ext}", k + 8), picture(k, format))).collect()
}

/// A header of FreeSurfer's of the samples: RAS, its position that of the middle, counted by whole halves of the sizes.
pub fn mgh() -> Vec<u8> {
    let mut h = vec![0; 284];
    let mut put = |at: usize, field: &[u8]| h[at..at + field.len()].copy_from_slice(field);
    [1, 8, 6, 4, 1, 10].iter().enumerate().for_each(|(n, v)| put(4 * n, &i32::to_be_bytes(*v)));
    put(28, &1_i16.to_be_bytes());
    let floats = [0.5, 0.75, 2.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 10.0 - 2.0, -20.0 - 2.25, 30.0 + 4.0];
    floats.iter().enumerate().for_each(|(n, v)| put(30 + 4 * n, &f32::to_be_bytes(*v)));
    [h, samples(true)].concat()
}

pub fn vtk(form: &str, kind: &str, data: &[u8]) -> Vec<u8> {
    let head = format!(
        "# vtk DataFile Version 3.0\na skull\n{form}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 8 6 4\nSPACING 0.5 0.75 2\nORIGIN -10 20 30\nPOINT_DATA 192\nSCALARS v {kind} 1\nLOOKUP_TABLE default\n"
    );
    [head.as_bytes(), data].concat()
}

pub fn amira(form: &str, array: &str, data: &[u8]) -> Vec<u8> {
    let head = format!(
        "# AmiraMesh {form} 2.1\n\n\ndefine Lattice 8 6 4\n\nParameters {{\n    Units {{\n        Coordinates \"mm\"\n    }}\n    BoundingBox -10 -6.5 20 23.75 30 36,\n    CoordType \"uniform\"\n}}\n\nLattice {{ {array}\n\n# Data section follows\n@1\n"
    );
    [head.as_bytes(), data].concat()
}

pub const VGI: &str = "{volume1}\n[representation]\nsize = 8 6 4\ndatatype = unsigned integer\nbitsperelement = 16\n[file1]\nFileFormat = raw\nSize = 8 6 4\nName = C:\\scans\\s.vol\nDatatype = unsigned integer\nBitsPerElement = 16\n{volumeprimitive12}\n[geometry]\nresolution = 0,5 0.75 2\nunit = mm\n";
pub const PCR: &str =
    "[General]\nVersion=2.2\n[VolumeData]\nVolume_SizeX=8\nVolume_SizeY=6\nVolume_SizeZ=4\nFormat=5\nVoxelSizeRec=0.045\n";

pub const PVL: &str = "<!DOCTYPE Drishti_Header>\n<PvlDotNcFileHeader>\n  <rawfile></rawfile>\n  <voxeltype>unsigned short</voxeltype>\n  <pvlvoxeltype>unsigned short</pvlvoxeltype>\n  <gridsize>4 6 8</gridsize>\n  <voxelunit>micron</voxelunit>\n  <voxelsize>500 750 2000</voxelsize>\n  <slabsize>3</slabsize>\n  <rawmap>0 65535 </rawmap>\n</PvlDotNcFileHeader>\n";

/// A slab of Drishti's: slices `from` to `to`.
pub fn slab(from: usize, to: usize) -> Vec<u8> {
    let sizes = [to - from, DIMS[1], DIMS[0]].map(|n| (n as u32).to_le_bytes()).concat();
    [vec![2], sizes, (from..to).flat_map(|k| slice(k, false)).collect()].concat()
}

/// An ISQ of the samples; one block more than it needs lies before them.
pub fn isq() -> Vec<u8> {
    let mut h = vec![0; 1024];
    let mut put = |at: usize, field: &[u8]| h[at..at + field.len()].copy_from_slice(field);
    put(0, b"CTDATA-HEADER_V1");
    [8, 6, 4, 4000, 4500, 8000].iter().enumerate().for_each(|(n, v)| put(44 + 4 * n, &i32::to_le_bytes(*v)));
    put(128, b"SECRET PERSON");
    put(508, &1_i32.to_le_bytes());
    [h, samples(false)].concat()
}

const MULTISCALES: &str = r#"{"multiscales": [{"version": "0.4", "axes": [{"name": "z", "type": "space", "unit": "millimeter"},
    {"name": "y", "type": "space", "unit": "millimeter"}, {"name": "x", "type": "space", "unit": "millimeter"}],
    "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [2, 0.75, 0.5]},
    {"type": "translation", "translation": [30, 20, -10]}]}]}]}"#;

/// OME-Zarr 0.4 in Zarr 2, in two chunks.
fn zarr_2() -> Vec<(String, Vec<u8>)> {
    let array = r#"{"zarr_format": 2, "shape": [4, 6, 8], "chunks": [2, 6, 8], "dtype": "<u2", "compressor": {"id": "zlib", "level": 1},
        "fill_value": 0, "order": "C", "filters": null, "dimension_separator": "/"}"#;
    let chunk = |k: usize| (format!("0/{k}/0/0"), zlib(&[slice(2 * k, false), slice(2 * k + 1, false)].concat()));
    let head = [(".zgroup", r#"{"zarr_format": 2}"#), (".zattrs", MULTISCALES), ("0/.zarray", array)];
    head.into_iter().map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec())).chain((0..2).map(chunk)).collect()
}

/// OME-Zarr 0.5 as it is written here.
fn zarr_3() -> Vec<(String, Vec<u8>)> {
    fn files(folder: &Path, below: &Path, found: &mut Vec<(String, Vec<u8>)>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => files(&path, below, found),
                false => found.push((path.strip_prefix(below).unwrap().to_str().unwrap().to_owned(), fs::read(&path).unwrap())),
            }
        }
    }
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let folder = Folder::new(&format!("own-store-{}", COUNT.fetch_add(1, Ordering::Relaxed)));
    let nrrd = folder.put("a.nrrd", &nrrd("encoding: raw", &samples(false)));
    let volume = formats::open(&nrrd, &formats::Hints::default(), &Progress::default()).unwrap();
    let store = folder.0.join("a.ome.zarr");
    formats::write(&store, &volume, &Progress::default()).unwrap();
    let mut found = vec![];
    files(&store, &store, &mut found);
    found.sort();
    found
}

/// Scans whose samples are all those of `sample`.
pub fn all() -> Vec<Small> {
    use tiff::encoder::{Compression as Pack, DeflateLevel};
    let one = Small::one;
    let folder = |name, files| Small { name, files, open: "" };
    let data = samples(false);
    let text: String = data.chunks(2).map(|b| format!("{} ", u16::from_le_bytes([b[0], b[1]]))).collect();
    let base64 = |bytes: &[u8]| base64::Engine::encode(&base64::engine::general_purpose::STANDARD, bytes).into_bytes();
    let length = |word: usize| (data.len() as u64).to_le_bytes()[..word].to_vec();
    let (head32, blocks) = vti_blocks(4);
    let (head64, _) = vti_blocks(8);
    let halves = [("a.raw".to_owned(), data[..192].to_vec()), ("b.raw".to_owned(), data[192..].to_vec())];
    let mut all = vec![
        one("NRRD", "a.nrrd", nrrd("encoding: raw", &data)),
        one("NRRD by gzip", "b.nrrd", nrrd("encoding: gzip", &gzip(&data))),
        one("NIfTI-1", "a.nii", [nifti(b"n+1\0", 352.0), data.clone()].concat()),
        one("NIfTI-1 by gzip", "a.nii.gz", gzip(&[nifti(b"n+1\0", 352.0), data.clone()].concat())),
        one("MetaImage", "a.mha", metaimage("", "LOCAL", &data)),
        one("MetaImage by zlib", "b.mha", metaimage("CompressedData = True\n", "LOCAL", &zlib(&data))),
        one("MetaImage big-endian", "c.mha", metaimage("BinaryDataByteOrderMSB = True\n", "LOCAL", &samples(true))),
        one("GIPL", "a.gipl", gipl()),
        one("MGH", "a.mgh", mgh()),
        one("MGH by gzip", "a.mgz", gzip(&mgh())),
        one("VTK", "a.vtk", vtk("BINARY", "unsigned_short", &samples(true))),
        one("VTK text", "b.vtk", vtk("ASCII", "unsigned_short", text.as_bytes())),
        one("Amira", "a.am", amira("BINARY-LITTLE-ENDIAN", "ushort Data } @1", &data)),
        one("Amira big-endian", "b.am", amira("BINARY", "ushort Data } @1", &samples(true))),
        one("Amira text", "c.am", amira("ASCII", "ushort Data } @1", text.as_bytes())),
        one(
            "Amira by zip",
            "d.am",
            amira("BINARY-LITTLE-ENDIAN", &format!("ushort Data }} @1(HxZip,{})", zlib(&data).len()), &zlib(&data)),
        ),
        one("NumPy", "a.npy", npy("<", "False", "4, 6, 8", &data)),
        one("NumPy Fortran big-endian", "b.npy", npy(">", "True", "8, 6, 4", &samples(true))),
        one("VTI text", "a.vti", vti("", "format=\"ascii\">\n", &[text.as_bytes(), VTI_END].concat())),
        one(
            "VTI base64",
            "b.vti",
            vti("", "format=\"binary\">\n  ", &[base64(&[length(4), data.clone()].concat()), VTI_END.to_vec()].concat()),
        ),
        one(
            "VTI appended",
            "c.vti",
            vti("header_type=\"UInt64\"", "format=\"appended\" offset=\"0\"/>", &vti_appended(&[length(8), data.clone()].concat())),
        ),
        one(
            "VTI appended by zlib",
            "d.vti",
            vti(
                "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"",
                "format=\"appended\" offset=\"0\"/>",
                &vti_appended(&[head64, blocks.clone()].concat()),
            ),
        ),
        one(
            "VTI base64 by zlib",
            "e.vti",
            vti(
                "compressor=\"vtkZLibDataCompressor\"",
                "format=\"binary\">",
                &[base64(&head32), base64(&blocks), VTI_END.to_vec()].concat(),
            ),
        ),
        one("InVesalius", "a.inv3", invesalius(PLIST, true)),
        one("InVesalius unpacked", "b.inv3", invesalius(PLIST, false)),
        one("TIFF", "a.tif", tiff(0..4, IMAGEJ, Pack::Uncompressed, false)),
        one("BigTIFF by LZW", "b.tif", tiff(0..4, IMAGEJ, Pack::Lzw, true)),
        one("TIFF by deflate", "c.tif", tiff(0..4, IMAGEJ, Pack::Deflate(DeflateLevel::Balanced), false)),
        one("TIFF by PackBits", "d.tif", tiff(0..4, IMAGEJ, Pack::Packbits, false)),
        one("raw by its name", "a_8x6x4_uint16.raw", data.clone()),
        folder("DICOM", dicom_files(Dicom::slice)),
        folder("DICOM implicit", dicom_files(|k| Dicom { syntax: IMPLICIT, ..Dicom::slice(k) })),
        folder("DICOM big-endian", dicom_files(|k| Dicom { syntax: BIG, ..Dicom::slice(k) })),
        folder("DICOM deflated", dicom_files(|k| Dicom { syntax: DEFLATED, ..Dicom::slice(k) })),
        folder("DICOM by RLE", dicom_files(|k| Dicom::slice(k).packed(RLE, vec![rle(k)]))),
        one("DICOM multi-frame", "m.dcm", enhanced().bytes()),
        one("DICOM multi-frame by RLE", "n.dcm", enhanced().packed(RLE, (0..4).map(rle).collect()).bytes()),
        one("DICOM in a zip", "z.zip", zip(&dicom_files(Dicom::slice))),
        folder("PNG", pictures("png", image::ImageFormat::Png)),
        folder("TIFF slices", (0..4).map(|k| (format!("s{k}.tiff"), tiff(k..k + 1, "", Pack::Lzw, false))).collect()),
        folder("Zarr 2", zarr_2()),
        folder("OME-Zarr", zarr_3()),
        one("PNG in a zip", "p.zip", zip(&pictures("png", image::ImageFormat::Png))),
    ];
    // One page, and the samples of the others behind it, as ImageJ writes beyond 4 GiB. The page's own are those of all.
    let mut behind = tiff(0..1, IMAGEJ, Pack::Uncompressed, false);
    let strips = behind.windows(96).position(|w| w == &slice(0, false)[..96]).unwrap();
    let at = behind.len() as u32;
    behind.extend(&data);
    for n in 0..behind.len() - 4 {
        if behind[n..n + 4] == (strips as u32).to_le_bytes() && n > 8 {
            behind[n..n + 4].copy_from_slice(&at.to_le_bytes());
        }
    }
    all.push(one("TIFF with slices behind one page", "i.tif", behind));
    for (name, open, magic) in [("NIfTI pair", "p.hdr", b"ni1\0"), ("Analyze", "q.img", b"\0\0\0\0")] {
        let files = vec![(format!("{}.hdr", &open[..1]), nifti(magic, 0.0)[..348].to_vec()), (format!("{}.img", &open[..1]), data.clone())];
        all.push(Small { name, files, open });
    }
    let beside = |name, open: &'static str, header: Vec<u8>, files: &[(String, Vec<u8>)]| {
        let files = [vec![(open.to_owned(), header)], files.to_vec()].concat();
        Small { name, files, open }
    };
    all.push(beside("MetaImage list", "l.mhd", metaimage("", "LIST", b"a.raw\nb.raw\n"), &halves));
    all.push(beside("NRRD list", "l.nhdr", nrrd("encoding: raw\ndata file: LIST 3\na.raw\nb.raw", &[]), &halves));
    all.push(beside("VOL by VGI", "s.vgi", VGI.into(), &[("s.vol".to_owned(), data.clone())]));
    let slabs = [("d.pvl.nc.001".to_owned(), slab(0, 3)), ("d.pvl.nc.002".to_owned(), slab(3, 4))];
    all.push(beside("Drishti", "d.pvl.nc", PVL.into(), &slabs));
    all.push(beside("VH", "v.vh", b"size 8 6 4\nextent 0.5 0.75 2\nbits 16\n".to_vec(), &[("v.raw".to_owned(), data.clone())]));
    all
}

/// Scans of other samples, so that every reader and codec has one.
pub fn others() -> Vec<Small> {
    let folder = |name, files| Small { name, files, open: "" };
    let one_slice = |codec: &str, syntax| vec![("IM1".to_owned(), Dicom::slice(0).packed(syntax, vec![packed(codec)]).bytes())];
    let pages = tiff(0..4, IMAGEJ, tiff::encoder::Compression::Lzw, false);
    let runs: Vec<u8> = [127, 3, 5, 9, 128 + 60].into_iter().chain(0..60).collect();
    vec![
        Small::one("Amira by runs", "e.am", amira("BINARY-LITTLE-ENDIAN", &format!("byte Labels }} @1(HxByteRLE,{})", runs.len()), &runs)),
        Small::one("ISQ", "a.isq", isq()),
        Small { name: "VOL by PCR", files: vec![("s.pcr".into(), PCR.into()), ("s.vol".into(), samples(false))], open: "s.pcr" },
        folder("BMP", pictures("bmp", image::ImageFormat::Bmp)),
        folder("JPEG", pictures("jpg", image::ImageFormat::Jpeg)),
        folder("JPEG 2000 pictures", (0..2).map(|k| (format!("s{k}.j2k"), packed("jpeg 2000"))).collect()),
        Small::one("NRRD in a zip", "n.zip", zip(&[("a/b.nrrd".into(), nrrd("encoding: raw", &samples(false))), ("c".into(), vec![1; 9])])),
        Small::one("DICOM in a packed tar", "t.tgz", gzip(&tar(&dicom_files(Dicom::slice)))),
        Small::one("MetaImage in a tar", "t.tar", tar(&[("l.mhd".into(), metaimage("", "a.raw", b"")), ("a.raw".into(), samples(false))])),
        Small::one("TIFF in a zip in a zip", "z.zip", zip(&[("b.zip".into(), zip(&[("c.tif".into(), pages)]))])),
        Small::one("DICOM multi-frame by gzip", "m.dcm.gz", gzip(&enhanced().bytes())),
        folder("DICOM files by gzip", dicom_files(Dicom::slice).into_iter().map(|(n, b)| (format!("{n}.dcm.gz"), gzip(&b))).collect()),
        folder("DICOM by lossless JPEG", one_slice("jpeg", JPEG_LOSSLESS)),
        folder("DICOM by JPEG 2000", one_slice("jpeg 2000", JPEG_2000)),
        folder("DICOM by JPEG-LS", one_slice("jpeg-ls", JPEG_LS)),
    ]
}
