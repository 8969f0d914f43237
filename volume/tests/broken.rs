//! Broken inputs, each with the exact sentence that a person gets: docs/broken-inputs.md is the table, and this test writes the same one.
//! Fails if a fault goes unnoticed, is reported as another, or if a sentence changes unseen. After a wanted change
//! `BREGMA_WRITE_TABLE=1 cargo test --release -p bregma-volume --test broken` writes the table anew: read the difference before committing.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::Progress;
use bregma_volume::formats::{Hints, open};
use small::*;
use std::path::{Path, PathBuf};

/// What is wrong, and the path that has it.
type Case = (&'static str, PathBuf);

fn with(small: &str, change: impl Fn(&mut Vec<(String, Vec<u8>)>)) -> Small {
    let mut found = all().into_iter().chain(others()).find(|s| s.name == small).unwrap();
    change(&mut found.files);
    found
}

/// The bytes of its first file changed.
fn bytes(small: &str, change: impl Fn(&mut Vec<u8>)) -> Small {
    with(small, |files| change(&mut files[0].1))
}

/// A text in its first file replaced.
fn text(small: &str, from: &str, to: &str) -> Small {
    bytes(small, |b| {
        let at = b.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        b.splice(at..at + from.len(), to.bytes());
    })
}

fn put_at(small: &str, at: usize, with: &[u8]) -> Small {
    bytes(small, |b| b[at..at + with.len()].copy_from_slice(with))
}

fn cut(small: &str, keep: usize) -> Small {
    bytes(small, |b| b.truncate(keep))
}

fn dicom(make: impl Fn(usize) -> Dicom) -> Small {
    Small { name: "DICOM", files: dicom_files(make), open: "" }
}

fn cases(folder: &Folder) -> Vec<Case> {
    let mut number = 0;
    let mut cases: Vec<Case> = vec![];
    let mut add = |what: &'static str, small: Small| {
        number += 1;
        let own = folder.0.join(number.to_string());
        for (name, bytes) in &small.files {
            folder.put(&format!("{number}/{name}"), bytes);
        }
        cases.push((what, if small.open.is_empty() { own } else { own.join(small.open) }));
    };
    let one = |open: &'static str, bytes: &[u8]| Small { name: "", files: vec![(open.to_owned(), bytes.to_vec())], open };
    let folder_of =
        |files: &[(&str, &[u8])]| Small { name: "", files: files.iter().map(|(n, b)| ((*n).to_owned(), b.to_vec())).collect(), open: "" };
    add("nothing of that name", Small { name: "", files: vec![("other".into(), vec![1])], open: "nothing.nrrd" });
    add("an empty file", one("empty.nii", b""));
    add("a text", one("notes.txt", b"These are notes, not a scan."));
    add("a folder without images", folder_of(&[("notes.txt", b"notes")]));
    add("a folder of empty files", folder_of(&[("IM1", b""), ("a.png", b"")]));
    add("an unknown form", one("scan.xyz", &[0xa5; 300]));
    add("headerless without a layout", one("scan.raw", &[0; 64]));
    add("headerless, its name says more than it has", one("scan_8x6x4_uint16.raw", &[0; 100]));
    add("headerless, its name says less than it has", one("scan_2x2x2_uint8.raw", &[0; 100]));

    add("NRRD of an unknown version", text("NRRD", "NRRD0004", "NRRD0009"));
    add("NRRD cut in its header", cut("NRRD", 60));
    add("NRRD cut in its samples", bytes("NRRD", |b| b.truncate(b.len() - 1)));
    add("NRRD without sizes", text("NRRD", "sizes: 8 6 4\n", ""));
    add("NRRD of 10 TB in 300 bytes", text("NRRD", "sizes: 8 6 4", "sizes: 20000 20000 25000"));
    add("NRRD of more than any machine has", text("NRRD", "sizes: 8 6 4", "sizes: 9999999999 9999999999 9999999999"));
    add("NRRD with a zero size", text("NRRD", "sizes: 8 6 4", "sizes: 8 0 4"));
    add("NRRD of two axes", text("NRRD", "dimension: 3\nsizes: 8 6 4", "dimension: 2\nsizes: 48 4"));
    add("NRRD with axes in one plane", text("NRRD", "(0,0,2)", "(1,1,0)"));
    add("NRRD in an unknown space", text("NRRD", "left-posterior-superior", "outer-space"));
    add("NRRD of an unknown type", text("NRRD", "ushort", "quaternion"));
    add("NRRD by bzip2", text("NRRD", "encoding: raw", "encoding: bzip2"));
    add("NRRD without a byte order", text("NRRD", "endian: little\n", ""));
    add("NRRD with a field twice", text("NRRD", "endian: little", "endian: little\nendian: big"));
    add(
        "NRRD by gzip, damaged",
        bytes("NRRD by gzip", |b| {
            let at = b.len() - 6;
            b[at] ^= 1;
        }),
    );
    add("NRRD by gzip, cut", bytes("NRRD by gzip", |b| b.truncate(b.len() - 200)));
    add("NRRD whose data file is missing", with("NRRD list", |f| drop(f.pop())));
    add("NRRD with too few data files", text("NRRD list", "a.raw\nb.raw", "a.raw\nb.raw\na.raw"));

    add("NIfTI cut in its header", cut("NIfTI-1", 200));
    add("NIfTI cut in its samples", bytes("NIfTI-1", |b| b.truncate(b.len() - 10)));
    add("NIfTI of colours", put_at("NIfTI-1", 70, &128_i16.to_le_bytes()));
    add("NIfTI with a negative size", put_at("NIfTI-1", 42, &(-8_i16).to_le_bytes()));
    add("NIfTI with time", put_at("NIfTI-1", 40, &[4, 0, 8, 0, 6, 0, 4, 0, 9, 0]));
    add("NIfTI whose samples begin in its header", put_at("NIfTI-1", 108, &100_f32.to_le_bytes()));
    add("NIfTI with a singular form", put_at("NIfTI-1", 280, &[0; 16]));
    add("NIfTI without its pair", with("NIfTI pair", |f| drop(f.pop())));
    add("NIfTI pair in one file", put_at("NIfTI-1", 344, b"ni1\0"));

    add("MetaImage without samples", text("MetaImage", "ElementDataFile = LOCAL", "ElementDataFile = gone.raw"));
    add("MetaImage without an end", cut("MetaImage", 100));
    add("MetaImage without sizes", text("MetaImage", "DimSize = 8 6 4\n", ""));
    add("MetaImage of an unknown type", text("MetaImage", "MET_USHORT", "MET_STRING"));
    add("MetaImage of vectors", text("MetaImage", "NDims = 3\n", "NDims = 3\nElementNumberOfChannels = 3\n"));
    add("MetaImage with zero spacing", text("MetaImage", "ElementSpacing = 0.5", "ElementSpacing = 0"));
    add("MetaImage cut in its samples", bytes("MetaImage", |b| b.truncate(b.len() - 4)));
    add(
        "MetaImage by zlib, damaged",
        bytes("MetaImage by zlib", |b| {
            let at = b.len() - 100;
            b[at..at + 20].fill(0xff);
        }),
    );

    add("TIFF cut in half", bytes("TIFF", |b| b.truncate(b.len() / 2)));
    add("TIFF of colours", put_colour());
    // The next three were found by the fuzzer, or in reading what decoders do with such files.
    add(
        "TIFF with a value longer than the file",
        bytes("TIFF", |b| {
            let at = first_directory(b) + 2 + 4;
            b[at..at + 4].copy_from_slice(&0x0100_0000_u32.to_le_bytes());
        }),
    );
    add(
        "TIFF whose pages lead in a circle",
        bytes("TIFF", |b| {
            let at = first_directory(b);
            let next = at + 2 + 12 * usize::from(u16::from_le_bytes([b[at], b[at + 1]]));
            b[next..next + 4].copy_from_slice(&(at as u32).to_le_bytes());
        }),
    );
    add("DICOM whose items end where none began", one("IM1.dcm", &stray_item()));
    add("a TIFF that is a text", one("scan.tif", b"II*, said the tiger"));
    add("one picture", one("slice.png", &picture(0, image::ImageFormat::Png)));
    add("a folder with a broken picture", folder_of(&[("s1.png", &picture(0, image::ImageFormat::Png)[..60]), ("s2.png", b"\x89PNG")]));
    let s = |k: usize| picture(k, image::ImageFormat::Png);
    add("pictures with a gap in their numbers", folder_of(&[("s1.png", &s(0)), ("s2.png", &s(1)), ("s3.png", &s(2)), ("s5.png", &s(3))]));
    add("two stacks in one folder", folder_of(&[("left1.png", &s(0)), ("left2.png", &s(1)), ("right1.png", &s(2)), ("right2.png", &s(3))]));
    let pages = |from| tiff(from..from + 2, "", tiff::encoder::Compression::Lzw, false);
    add("a folder of TIFFs of many pages", folder_of(&[("a1.tif", &pages(0)), ("a2.tif", &pages(2))]));
    let page = |k| tiff(k..k + 1, "", tiff::encoder::Compression::Lzw, false);
    add("one TIFF of a stack", Small { open: "s2.tif", ..folder_of(&[("s1.tif", &page(0)), ("s2.tif", &page(1))]) });
    add("a zip that is none", one("scan.zip", b"PK\x03\x04 and then nothing"));
    add("a zip of notes", one("scan.zip", &zip(&[("notes.txt".into(), b"notes".to_vec())])));
    add(
        "a zip of a broken volume",
        one("media.zip", &zip(&[("M1/skull.nrrd".into(), nrrd("encoding: raw", &[1])), ("manifest.csv".into(), vec![2])])),
    );
    add(
        "a zip of volumes",
        one("media.zip", &zip(&[("a.nrrd".into(), nrrd("encoding: raw", &[1])), ("b/b.nrrd".into(), nrrd("encoding: raw", &[2]))])),
    );
    add("a zip of zips", one("media.zip", &zip(&[("a.zip".into(), vec![1]), ("b.zip".into(), vec![2]), ("notes.txt".into(), vec![3])])));
    let nested = (0..6).fold(zip(&[("a.txt".into(), vec![1])]), |inner, _| zip(&[("b.zip".into(), inner)]));
    add("zips in each other", one("media.zip", &nested));
    add("a gzip of another form", one("scan.dcm.gz", &gzip(b"anything")));
    add("a gzip that breaks off", one("scan.dcm.gz", &gzip(&Dicom::slice(0).bytes())[..200]));
    let tar = invesalius("", false);
    add("a tar that breaks off", one("scan.tar", &tar[..700]));
    add("a tar of another form", one("scan.tar", &tar));
    add("folders of scans in a folder", folder_of(&[("a/s1.png", &s(0)), ("b/s1.png", &s(1))]));
    add("TIFF by a packing that is not read", put_zstd());
    add("VTK of another data set", text("VTK", "STRUCTURED_POINTS", "UNSTRUCTURED_GRID"));
    add("VTK of cells", text("VTK", "POINT_DATA 192", "CELL_DATA 105"));
    add("VTK of vectors", text("VTK", "short 1", "short 3"));
    add("VTK of vectors alone", text("VTK", "SCALARS v unsigned_short 1", "VECTORS v unsigned_short"));
    add("VTK of an unknown type", text("VTK", "unsigned_short", "quaternion"));
    add("VTK without sizes", text("VTK", "DIMENSIONS 8 6 4\n", ""));
    add("VTK of bad sizes", text("VTK", "DIMENSIONS 8 6 4", "DIMENSIONS 8 -6 4"));
    add("VTK without samples", text("VTK", "SCALARS v unsigned_short 1\n", ""));
    add("VTK whose sizes and points differ", text("VTK", "POINT_DATA 192", "POINT_DATA 191"));
    add("VTK cut in its samples", bytes("VTK", |b| b.truncate(b.len() - 3)));
    add("VTK text cut in its samples", bytes("VTK text", |b| b.truncate(b.len() - 20)));
    add("VTK text of no number", bytes("VTK text", |b| b[260..264].copy_from_slice(b" 1e ")));
    add("Amira of no lattice", text("Amira", "define Lattice", "define Nodes"));
    add("Amira of bad sizes", text("Amira", "define Lattice 8 6 4", "define Lattice 8 6"));
    add("Amira of stacked coordinates", text("Amira", "\"uniform\"", "\"stacked\""));
    add("Amira of vectors", text("Amira", "ushort Data", "float[3] Data"));
    add("Amira by an unknown packing", text("Amira by zip", "HxZip", "HxMagic"));
    add("Amira without samples", text("Amira", "@1\n\n#", "@2\n\n#"));
    add("Amira without a beginning", text("Amira", "follows\n@1", "follows\n@2"));
    add("Amira of a bad box", text("Amira", "BoundingBox -10", "BoundingBox"));
    add("Amira of an empty box", text("Amira", "BoundingBox -10 -6.5", "BoundingBox -10 -10"));
    add("Amira cut in its samples", bytes("Amira", |b| b.truncate(b.len() - 3)));
    add("Amira of more than its bytes can hold", text("Amira by zip", "Lattice 8 6 4", "Lattice 800 600 400"));
    add("Amira by runs, cut", bytes("Amira by runs", |b| b.truncate(b.len() - 30)));
    add("ISQ cut in its header", cut("ISQ", 300));
    add("ISQ cut in its samples", bytes("ISQ", |b| b.truncate(b.len() - 3)));
    add("ISQ of a negative size", put_at("ISQ", 44, &(-8_i32).to_le_bytes()));
    add("MGH cut in its header", cut("MGH", 200));
    add("MGH of another version", put_at("MGH", 0, &2_i32.to_be_bytes()));
    add("MGH of many frames", put_at("MGH", 16, &9_i32.to_be_bytes()));
    add("MGH of an unknown type", put_at("MGH", 20, &7_i32.to_be_bytes()));
    add("MGH without directions", put_at("MGH", 42, &[0; 36]));
    add("MGH cut in its samples", bytes("MGH", |b| b.truncate(b.len() - 3)));
    add("VGI without its samples", with("VOL by VGI", |f| drop(f.pop())));
    add("VGI without a file", text("VOL by VGI", "[file1]", "[filing]"));
    add(
        "VGI without a size",
        with("VOL by VGI", |f| f[0].1 = String::from_utf8_lossy(&f[0].1).to_lowercase().replace("size", "extent").into()),
    );
    add("VGI of a bad size", text("VOL by VGI", "size = 8 6 4", "size = 8 6 x"));
    add("VGI of another packing", text("VOL by VGI", "FileFormat = raw", "FileFormat = jpeg"));
    add("VGI of an unknown type", text("VOL by VGI", "Datatype = unsigned integer", "Datatype = colour"));
    add("VGI whose samples are cut", with("VOL by VGI", |f| f[1].1.truncate(100)));
    let slabs =
        |from: &str, to: &str| with("Drishti", |f| f[0].1 = String::from_utf8(f[0].1.clone()).unwrap().replace(from, to).into_bytes());
    add("Drishti without a slab", with("Drishti", |f| drop(f.pop())));
    add("Drishti without a size", slabs("gridsize", "size"));
    add("Drishti of a bad size", slabs("4 6 8", "4 6"));
    add("Drishti of an unknown type", slabs("unsigned short", "colour"));
    add("Drishti of more slabs than numbers", slabs("4 6 8", "4000000 6 8"));
    add("Drishti whose slab is cut", with("Drishti", |f| f[2].1.truncate(50)));
    add("Drishti that is no XML", slabs("</gridsize>", "</size>"));
    add("PCR without its samples", with("VOL by PCR", |f| drop(f.pop())));
    add("PCR without a size", text("VOL by PCR", "Volume_SizeX", "Volume_X"));
    add("PCR of a bad size", text("VOL by PCR", "Volume_SizeX=8", "Volume_SizeX=0"));
    add("PCR of an unknown type", text("VOL by PCR", "Format=5", "Format=6"));
    add("NumPy of two axes", text("NumPy", "(4, 6, 8)", "(24, 8)"));
    add("NumPy of texts", text("NumPy", "<u2", "<U2"));
    add("NumPy cut in its header", cut("NumPy", 20));
    add("GIPL cut in its header", cut("GIPL", 100));
    add("GIPL of single bits", put_at("GIPL", 8, &1_u16.to_be_bytes()));
    add("VTI of vectors", text("VTI text", "Name=\"v\"", "Name=\"v\" NumberOfComponents=\"3\""));
    add("VTI by LZ4", text("VTI appended by zlib", "vtkZLibDataCompressor", "vtkLZ4DataCompressor"));
    add("VTI with too few numbers", text("VTI text", "WholeExtent=\"0 7 0 5 0 3\"", "WholeExtent=\"0 7 0 5 0 3\" a=\"\"").shorter());
    add("VTI without data", text("VTI text", "DataArray", "NoArray"));
    let cells = |bytes: &[u8]| String::from_utf8_lossy(bytes).replace("PointData", "CellData").into_bytes();
    add("VTI of cells", with("VTI text", |f| f[0].1 = cells(&f[0].1)));
    add("InVesalius without its list", one("scan.inv3", &invesalius_without_list()));
    add("InVesalius without spacing", one("scan.inv3", &invesalius(&PLIST.replace("spacing", "spacings"), true)));
    add("VH without sizes", with("VH", |f| f[0].1 = b"a skull".to_vec()));

    add(
        "DICOM cut in its header",
        with("DICOM", |f| {
            f.truncate(1);
            f[0].1.truncate(200);
        }),
    );
    add("DICOM cut in its pixels", dicom_cut());
    add("DICOM without pixels", dicom(|k| Dicom::slice(k).without((0x7fe0, 0x10))));
    add("DICOM without positions", dicom(|k| Dicom::slice(k).without((0x20, 0x32)).without((0x18, 0x50))));
    add("DICOM without rows", dicom(|k| Dicom::slice(k).without((0x28, 0x10))));
    add("DICOM by HTJ2K", dicom(|k| Dicom::slice(k).packed(HTJ2K, vec![packed("jpeg 2000")])));
    let cut = packed("jpeg-ls")[..100].to_vec();
    add("DICOM by JPEG-LS, damaged", one("IM1.dcm", &Dicom::slice(0).packed(JPEG_LS, vec![cut]).bytes()));
    add(
        "DICOM of colours",
        dicom(|k| {
            let mut d = Dicom::slice(k);
            d.number((0x28, 2), 3);
            d
        }),
    );
    add("DICOM with a missing slice", gap());
    add("DICOM with slanted rows", dicom(|k| Dicom::slice(k).with((0x20, 0x37), "DS", "1\\0\\0\\0.5\\0.9\\0")));
    let beside = |k: usize| format!("{}\\20\\{}", -10 + 50 * (k % 2) as i32, 30 + 2 * (k / 2));
    add("DICOM with slices beside each other", dicom(|k| Dicom::slice(k).with((0x20, 0x32), "DS", &beside(k))));
    add("DICOM of one place only", dicom(|k| Dicom::slice(k).with((0x20, 0x32), "DS", "nowhere").with((0x20, 0x13), "IS", "1")));
    add(
        "DICOM with bits that are not there",
        dicom(|k| {
            let mut d = Dicom::slice(k);
            d.number((0x28, 0x101), 17);
            d
        }),
    );
    add("DICOM of a billion frames", one("IM1.dcm", &Dicom::slice(0).with((0x28, 8), "IS", "1000000000").bytes()));
    add("DICOM of sizes beyond all numbers", one("IM1.dcm", &Dicom::slice(0).with((0x28, 0x10), "DS", "1e300").bytes()));
    add("VTI of more blocks than bytes", put_blocks());
    add("MetaImage of a billion files", text("MetaImage", "DimSize = 8 6 4\n", "DimSize = 8 6 4000000000\n").pattern());
    add(
        "the list of a disc without the disc",
        one("DICOMDIR", &Dicom { syntax: EXPLICIT, elements: Default::default(), fragments: None }.bytes()),
    );
    add("DICOM of an unknown syntax", dicom(|k| Dicom { syntax: "1.2.3.4.5", ..Dicom::slice(k) }));
    add("DICOM by JPEG, damaged", one("IM1.dcm", &Dicom::slice(0).packed(JPEG_LOSSLESS, vec![packed("jpeg")[..50].to_vec()]).bytes()));
    let twelve = [0xff, 0xd8, 0xff, 0xc1, 0, 11, 12, 0, 6, 0, 8, 1, 1, 0x11, 0, 0];
    add("DICOM by JPEG of 12 bits with loss", one("IM1.dcm", &Dicom::slice(0).packed(JPEG_LOSSLESS, vec![twelve.to_vec()]).bytes()));
    add("a series that is not there", Small { open: "../DICOM#99", ..dicom(Dicom::slice) });
    cases
}

impl Small {
    /// Its samples in files of a pattern.
    fn pattern(mut self) -> Self {
        let bytes = &mut self.files[0].1;
        let at = bytes.windows(5).position(|w| w == b"LOCAL").unwrap();
        bytes.splice(at..at + 5, b"s%d.raw 0 3999999999 1".iter().copied());
        self
    }

    /// Its text of numbers cut short.
    fn shorter(mut self) -> Self {
        let bytes = &mut self.files[0].1;
        let end = bytes.windows(11).position(|w| w == b"</DataArray").unwrap();
        bytes.drain(end - 30..end);
        self
    }
}

/// The count of blocks, as it stands in base64, replaced by one of 2³².
fn put_blocks() -> Small {
    bytes("VTI base64 by zlib", |b| {
        let at = b.windows(16).position(|w| w == b"format=\"binary\">").unwrap() + 16;
        b[at..at + 5].copy_from_slice(b"/////");
    })
}

fn first_directory(tiff: &[u8]) -> usize {
    u32::from_le_bytes([tiff[4], tiff[5], tiff[6], tiff[7]]) as usize
}

/// An item delimiter before the first element.
fn stray_item() -> Vec<u8> {
    let mut bytes = Dicom::slice(0).bytes();
    let at = bytes.windows(8).position(|w| w == [8, 0, 8, 0, b'C', b'S', 22, 0]).unwrap();
    bytes.splice(at..at, [0xfe, 0xff, 0x0d, 0xe0, 0, 0, 0, 0, 0xfe, 0xff, 0x00, 0xe0, 0, 0, 0, 0]);
    bytes
}

/// Packed by Zstandard, as the number of its compression says.
fn put_zstd() -> Small {
    let mut bytes = tiff(0..1, "", tiff::encoder::Compression::Uncompressed, false);
    let at = bytes.windows(8).position(|w| w == [3, 1, 3, 0, 1, 0, 0, 0]).unwrap() + 8;
    bytes[at..at + 2].copy_from_slice(&50_000_u16.to_le_bytes());
    Small { name: "", files: vec![("scan.tif".into(), bytes)], open: "scan.tif" }
}

fn put_colour() -> Small {
    let mut out = std::io::Cursor::new(vec![]);
    image_rgb(&mut out);
    Small { name: "", files: vec![("scan.tif".into(), out.into_inner())], open: "scan.tif" }
}

fn image_rgb(out: &mut std::io::Cursor<Vec<u8>>) {
    let mut encoder = tiff::encoder::TiffEncoder::new(out).unwrap();
    encoder.write_image::<tiff::encoder::colortype::RGB8>(2, 2, &[7, 7, 8, 7, 7, 7, 7, 7, 7, 7, 7, 7]).unwrap();
}

fn invesalius_without_list() -> Vec<u8> {
    let mut tar = tar::Builder::new(vec![]);
    let mut header = tar::Header::new_gnu();
    header.set_size(4);
    header.set_cksum();
    tar.append_data(&mut header, "tmp/matrix.dat", &b"data"[..]).unwrap();
    gzip(&tar.into_inner().unwrap())
}

fn dicom_cut() -> Small {
    let mut small = dicom(Dicom::slice);
    small.files.iter_mut().for_each(|(_, bytes)| bytes.truncate(bytes.len() - 7));
    small
}

fn gap() -> Small {
    let files = (0..6).filter(|k| *k != 2).map(|k| (format!("IM{k}"), Dicom::slice(k).bytes())).collect();
    Small { name: "", files, open: "" }
}

/// What only some systems have: sockets, pipes, names that are no text, files without rights.
#[cfg(unix)]
fn unix_cases(folder: &Folder) -> Vec<Case> {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let socket = folder.0.join("socket.nrrd");
    drop(std::os::unix::net::UnixListener::bind(&socket).unwrap());
    let pipe = folder.0.join("pipe.nii");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let odd = folder.0.join(OsStr::from_bytes(b"sk\xfcll.nrrd"));
    std::fs::write(&odd, b"NRRD0004\n").unwrap();
    vec![
        ("a socket", socket),
        ("a pipe", pipe),
        ("a device", PathBuf::from("/dev/null")),
        ("a name that is no UTF-8, and a header that ends", odd),
        ("a file under a file", PathBuf::from("/dev/null/scan.nrrd")),
    ]
}

#[cfg(not(unix))]
fn unix_cases(_: &Folder) -> Vec<Case> {
    vec![]
}

#[test]
fn every_broken_input_has_its_sentence() {
    let folder = Folder::new("broken");
    small_dicom_beside(&folder);
    let mut table = String::from(
        "# Broken inputs\nWhat a person is told when a scan cannot be read. `volume/tests/broken.rs` makes each of these files and holds the sentences\nto this table.\n\n| what is wrong | what is said |\n|---|---|\n",
    );
    let cases: Vec<Case> = cases(&folder).into_iter().chain(unix_cases(&folder)).collect();
    for (what, path) in &cases {
        let error = match open(path, &Hints::default(), &Progress::default()) {
            Ok(_) => panic!("{what} was read"),
            Err(e) => e.to_string(),
        };
        let shown = error.replace(&format!("{}/", folder.0.display()), "").replace(&format!("{}", folder.0.display()), "");
        // The numbered folder that each case has to itself.
        let shown = match shown.split_once('/') {
            Some((number, rest)) if number.chars().all(|c| c.is_ascii_digit()) && !number.is_empty() => rest.to_owned(),
            _ => shown,
        };
        let shown = shown.strip_prefix("../").unwrap_or(&shown).replace('|', "\\|");
        let named = path.file_name().is_some_and(|n| error.contains(&*n.to_string_lossy()));
        assert!(named && error.contains(": ") && !error.contains('\n'), "{what}: {error}");
        table += &format!("| {what} | {shown} |\n");
    }
    println!("{} broken inputs", cases.len());
    assert!(cases.len() >= 140);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/broken-inputs.md");
    if std::env::var_os("BREGMA_WRITE_TABLE").is_some() {
        std::fs::write(&file, &table).unwrap();
    }
    let agreed = std::fs::read_to_string(&file).unwrap_or_default();
    if cfg!(unix) {
        for (made, agreed) in table.lines().zip(agreed.lines()) {
            assert_eq!(made, agreed);
        }
        assert_eq!(table.lines().count(), agreed.lines().count());
    }
}

/// A series that a number behind `#` can be asked of.
fn small_dicom_beside(folder: &Folder) {
    for (name, bytes) in dicom_files(Dicom::slice) {
        folder.put(&format!("DICOM/{name}"), &bytes);
    }
}
