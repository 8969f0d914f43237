//! Files built byte by byte, right and wrong.

use super::*;
use crate::{Grid, Raster, ReadSamples, Samples, Unit};
use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{DAffine3, DMat3};
use std::fs;
use std::io::Write;
use std::path::PathBuf;

/// A folder that is gone with its value.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("bregma-formats-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    fn open(&self, name: &str, bytes: &[u8]) -> Result<Volume, OpenError> {
        open(&self.file(name, bytes), &Hints::default(), &Progress::default())
    }

    fn error(&self, name: &str, bytes: &[u8]) -> String {
        self.open(name, bytes).unwrap_err().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(vec![], Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

/// An attached NRRD of 2×3×2 samples; `fields` are lines.
fn nrrd_file(kind: &str, fields: &str, data: &[u8]) -> Vec<u8> {
    [format!("NRRD0004\n# comment\nkey:=a: b\ntype: {kind}\ndimension: 3\nsizes: 2 3 2\n{fields}\n\n").as_bytes(), data].concat()
}

const LPS: &str = "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,2)";

/// A NIfTI-1 file of 2×3×2 samples with both forms unset.
fn nifti_1(datatype: i16, big: bool, data: &[u8]) -> Vec<u8> {
    let mut h = vec![0_u8; 352];
    let order = |mut b: Vec<u8>| {
        if big {
            b.reverse();
        }
        b
    };
    let mut put = |at: usize, b: Vec<u8>| h[at..at + b.len()].copy_from_slice(&b);
    put(0, order(348_i32.to_le_bytes().to_vec()));
    for (n, d) in [3_i16, 2, 3, 2, 1, 1, 1, 1].into_iter().enumerate() {
        put(40 + 2 * n, order(d.to_le_bytes().to_vec()));
    }
    put(70, order(datatype.to_le_bytes().to_vec()));
    for (n, d) in [1.0_f32, 0.5, 0.75, 2.0].into_iter().enumerate() {
        put(76 + 4 * n, order(d.to_le_bytes().to_vec()));
    }
    put(108, order(352_f32.to_le_bytes().to_vec()));
    put(123, vec![2]);
    put(344, b"n+1\0".to_vec());
    h.extend_from_slice(data);
    h
}

fn set_f32(file: &mut [u8], at: usize, values: &[f32]) {
    for (n, v) in values.iter().enumerate() {
        file[at + 4 * n..at + 4 * n + 4].copy_from_slice(&v.to_le_bytes());
    }
}

#[test]
fn every_type_and_order_gives_its_samples() {
    // Fails if a type is misread, a byte order ignored, or a wider integer kept too narrow or too wide.
    let folder = Folder::new("types");
    let values: [i64; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 100, 127];
    macro_rules! check {
        ($($t:ty, $name:literal, $nifti:literal, $want:literal;)*) => {$(
            for (big, endian) in [(false, "little"), (true, "big")] {
                let bytes = |v: &i64| if big { (*v as $t).to_be_bytes().to_vec() } else { (*v as $t).to_le_bytes().to_vec() };
                let data: Vec<u8> = values.iter().flat_map(bytes).collect();
                let header = format!("endian: {endian}\nencoding: raw\n{LPS}");
                let zipped = format!("endian: {endian}\nencoding: gzip\n{LPS}");
                for file in [
                    ("a.nrrd", nrrd_file($name, &header, &data)),
                    ("b.nrrd", nrrd_file($name, &zipped, &gzip(&data))),
                    ("c.nii", nifti_1($nifti, big, &data)),
                    ("d.nii.gz", gzip(&nifti_1($nifti, big, &data))),
                ] {
                    let v = folder.open(file.0, &file.1).unwrap();
                    assert_eq!(v.samples().type_name(), $want, "{} {}", $name, file.0);
                    assert!((0..12).all(|n| v.samples().get_f64(n) == values[n] as f64), "{} {}", $name, file.0);
                    assert_eq!(v.name(), file.0);
                }
            }
        )*};
    }
    check! {
        i8, "signed char", 256, "i16"; u8, "unsigned char", 2, "u8"; i16, "short int", 4, "i16"; u16, "uint16_t", 512, "u16";
        i32, "int", 8, "i16"; u32, "unsigned int", 768, "i16"; i64, "longlong", 1024, "i16"; u64, "uint64", 1280, "i16";
        f32, "float", 16, "f32"; f64, "double", 64, "f32";
    }
}

#[test]
fn wide_integers_take_the_narrowest_type_that_holds_them() {
    // Fails if widening loses samples read before it, or if rounding goes unsaid.
    let folder = Folder::new("wide");
    let read = |values: [i64; 12]| {
        let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let v = folder.open("w.nrrd", &nrrd_file("int64", &format!("endian: little\nencoding: raw\n{LPS}"), &data)).unwrap();
        let kept: Vec<f64> = (0..12).map(|n| v.samples().get_f64(n)).collect();
        (v.samples().type_name(), kept == values.map(|v| v as f64), v.warnings().to_vec())
    };
    assert_eq!(read([0, 5, 40_000, 65_535, 1, 2, 3, 4, 5, 6, 7, 8]), ("u16", true, vec![]));
    assert_eq!(read([-1, 5, 40_000, 65_535, 1, 2, 3, 4, 5, 6, 7, 8]), ("f32", true, vec![]));
    assert_eq!(read([0, 5, 40_000, -1, 1, 2, 3, 4, 5, 6, 7, 8]), ("f32", true, vec![]));
    let (kind, exact, warnings) = read([0, (1 << 60) + 1, (1 << 24) + 1, -1, 1, 2, 3, 4, 5, 6, 7, 8]);
    assert_eq!((kind, exact), ("f32", false));
    assert_eq!(warnings, ["2 samples do not fit float32 exactly and are rounded, by at most 1.0e0"]);
}

#[test]
fn spaces_become_lps_millimetres() {
    // Fails if a flip, a unit, a squeezed axis, an axis minimum or the override of an unknown spacing goes wrong.
    let folder = Folder::new("spaces");
    let hints = Hints { spacing_mm: Some(DVec3::new(3.0, 4.0, 5.0)), ..Hints::default() };
    let read = |fields: &str, hints: &Hints| {
        let text = if fields.contains("sizes") { fields.to_owned() } else { format!("dimension: 3\nsizes: 2 3 2\n{fields}") };
        let file = folder
            .file("s.nrrd", &[format!("NRRD0005\ntype: uint8\nencoding: raw\n{}\n\n", text.trim_end()).as_bytes(), &[7; 12]].concat());
        let v = open(&file, hints, &Progress::default()).unwrap();
        let m = v.grid().index_to_world();
        (m.matrix3 * DVec3::new(1.0, 10.0, 100.0), m.translation, v.warnings().len())
    };
    let none = Hints::default();
    let v = |x, y, z| DVec3::new(x, y, z);
    let directions = "space directions: (1,0,0) (0,2,0.5) (0,0,3)\nspace origin: (5,6,7)";
    let cases = [
        ("lps", v(1.0, 20.0, 305.0), v(5.0, 6.0, 7.0)),
        ("right-anterior-superior", v(-1.0, -20.0, 305.0), v(-5.0, -6.0, 7.0)),
        ("LAS", v(1.0, -20.0, 305.0), v(5.0, -6.0, 7.0)),
    ];
    for (space, want, origin) in cases {
        assert_eq!(read(&format!("space: {space}\n{directions}"), &none), (want, origin, 0), "{space}");
    }
    let cm = format!("space: RAS\nspace units: \"cm\" \"cm\" \"cm\"\n{directions}");
    assert_eq!(read(&cm, &none), (v(-10.0, -200.0, 3050.0), v(-50.0, -60.0, 70.0), 0));
    let four = "dimension: 4\nsizes: 1 2 3 2\nspace: lps\nspace directions: none (1,0,0) (0,2,0) (0,0,3)";
    assert_eq!(read(four, &none).0, v(1.0, 20.0, 300.0));
    // Spacings: without a unit (two warnings: that, and no orientation), with one, unknown along one axis, and none at all. One that is given
    // takes the place of one that is stated, aloud.
    assert_eq!(read("spacings: 1 1 2", &none), (v(1.0, 10.0, 200.0), DVec3::ZERO, 2));
    assert_eq!(read("spacings: 1 1 2", &hints), (v(3.0, 40.0, 500.0), DVec3::ZERO, 2));
    assert_eq!(read("spacings: 1 1 2\nunits: \"um\" \"mm\" \"mm\"\naxis mins: 4 0 1", &hints), (v(3.0, 40.0, 500.0), v(4.0, 0.0, 1.0), 2));
    assert_eq!(read("space: LPS\nspacings: 1 nan 2", &hints), (v(3.0, 40.0, 500.0), DVec3::ZERO, 0));
    assert_eq!(read("space: LPS\nspacings: 1 nan 2", &none), (v(1.0, 10.0, 200.0), DVec3::ZERO, 1));
    assert_eq!(read("", &none), (v(1.0, 10.0, 100.0), DVec3::ZERO, 2));
    assert_eq!(read("space: 3D-left-handed\nspacings: 1 1 2\nspace units: mm mm mm", &none).2, 1);
}

#[test]
fn data_may_lie_in_other_files() {
    // Fails if numbering, padding, lists, sub-dimensions or skips pick the wrong bytes.
    let folder = Folder::new("parts");
    for n in 0..2_u8 {
        let data: Vec<u8> = [b"line\n##".as_slice(), &[6 * n, 6 * n + 1, 6 * n + 2, 6 * n + 3, 6 * n + 4, 6 * n + 5]].concat();
        folder.file(&format!("s{:02}.raw", 5 - 2 * n), &data);
    }
    folder.file("all.raw", &[b"tail".as_slice(), &(0..12).collect::<Vec<u8>>()].concat());
    folder.file("all.gz", &[b"line\n".as_slice(), &gzip(&[b"xy".as_slice(), &(0..12).collect::<Vec<u8>>()].concat())].concat());
    let read = |fields: &str| {
        let text = format!("NRRD0004\r\ntype: uchar\r\ndimension: 3\r\nsizes: 2 3 2\r\n{fields}");
        folder.open("h.nhdr", text.as_bytes()).map(|v| (0..12).all(|n| v.samples().get_f64(n) == n as f64)).map_err(|e| e.to_string())
    };
    let skips = "encoding: raw\nline skip: 1\nbyte skip: 2\n";
    for files in ["s%02d.raw 5 3 -2", "s%02d.raw 5 3 -2 2", "s%02d.raw 5 3 -2 3", "LIST\ns05.raw\ns03.raw", "LIST 2\ns05.raw\ns03.raw\n\n"]
    {
        assert_eq!(read(&format!("{skips}data file: {files}")), Ok(true), "{files}");
    }
    assert_eq!(read("encoding: raw\nbyte skip: -1\ndatafile: all.raw"), Ok(true));
    assert_eq!(read("encoding: gz\nbyte skip: 2\nline skip: 1\ndata file: all.gz\n\n"), Ok(true));
    let error = |fields: &str| read(fields).unwrap_err();
    assert!(error(&format!("{skips}data file: s%02d.raw 5 1 -2")).contains("3 data files"));
    assert!(error(&format!("{skips}data file: s%02d.raw 5 6 1")).contains("s06.raw: there is no such file"));
    assert!(error(&format!("{skips}data file: s%02d.raw 5 6 0")).contains("name no file"));
    assert!(error(&format!("{skips}data file: s%s.raw 5 6 1")).contains("%03d"));
    assert!(error("encoding: raw\ndata file: s%02d.raw 5 6 1 1").contains("2 data files"));
    assert!(error("encoding: raw\ndata file: LIST").contains("0 data files"));
    assert!(error("encoding: raw\nbyte skip: 9\ndata file: all.raw").contains("12 bytes of samples are needed, 7 are there"));
}

#[test]
fn nifti_orientation_follows_sform_then_qform_then_spacing() {
    // Fails if a form is preferred wrongly, RAS is not turned to LPS, qfac is dropped or a unit or scale is ignored.
    let folder = Folder::new("forms");
    let data: Vec<u8> = (0..12_i16).flat_map(|v| (v * 100 - 1000).to_le_bytes()).collect();
    let mut file = nifti_1(4, false, &data);
    let plain = folder.open("f.nii", &file).unwrap();
    assert_eq!((plain.grid().spacing_mm(), plain.warnings().len()), (DVec3::new(0.5, 0.75, 2.0), 1));
    assert_eq!((plain.slope(), plain.unit()), (1.0, Unit::Value), "the highest value is 100: no bone");

    // A quarter turn about z, mirrored along k: i to +y, j to −x, k to −z of RAS.
    file[252] = 1;
    set_f32(&mut file, 76, &[-1.0]);
    set_f32(&mut file, 256, &[0.0, 0.0, 0.5_f32.sqrt(), 10.0, 20.0, 30.0]);
    let q = folder.open("f.nii", &file).unwrap();
    assert_eq!(q.grid().origin_mm(), DVec3::new(-10.0, -20.0, 30.0));
    let want = DMat3::from_cols(DVec3::new(0.0, -0.5, 0.0), DVec3::new(0.75, 0.0, 0.0), DVec3::new(0.0, 0.0, -2.0));
    // float32 √½ is off by 1.2e-8, which the turn doubles.
    assert!(q.grid().index_to_world().matrix3.abs_diff_eq(want, 1e-7), "{:?}", q.grid());

    file[254] = 2;
    file[123] = 3; // µm
    set_f32(&mut file, 280, &[1.0, 0.0, 0.0, 4.0, 0.0, 2.0, 1.0, 5.0, 0.0, 0.0, 3.0, 6.0]);
    set_f32(&mut file, 112, &[2.0, 24.0]);
    let s = folder.open("f.nii", &file).unwrap();
    let want = DAffine3::from_cols_array(&[-1e-3, 0.0, 0.0, 0.0, -2e-3, 0.0, 0.0, -1e-3, 3e-3, -4e-3, -5e-3, 6e-3]);
    assert!(s.grid().index_to_world().abs_diff_eq(want, 1e-15), "{:?}", s.grid());
    assert_eq!((s.slope(), s.intercept(), s.range()), (2.0, 24.0, [-1976.0, 224.0]));
    set_f32(&mut file, 112, &[f32::NAN, f32::NAN]);
    assert_eq!(folder.open("f.nii", &file).unwrap().slope(), 1.0);
    set_f32(&mut file, 280, &[1.0, 0.0, 0.0, 4.0, 1.0, 0.0, 0.0, 5.0, 0.0, 0.0, 3.0, 6.0]);
    assert!(folder.error("f.nii", &file).contains("three independent directions"));
    // Zeros are no form: the other one is taken, aloud.
    set_f32(&mut file, 280, &[0.0; 12]);
    let zero = folder.open("f.nii", &file).unwrap();
    assert!(zero.warnings()[0].contains("sform is all zeros") && zero.grid().origin_mm() == q.grid().origin_mm() * 1e-3, "{zero:?}");
    file[254] = 0;
    set_f32(&mut file, 84, &[0.0]);
    assert!(folder.error("f.nii", &file).contains("spacing along axis 1 is 0 mm"));
    file[252] = 0;
    assert!(folder.error("f.nii", &file).contains("pass --spacing"));
    let hints = Hints { spacing_mm: Some(DVec3::splat(9.0)), ..Hints::default() };
    let hinted = open(&folder.0.join("f.nii"), &hints, &Progress::default()).unwrap();
    assert!((hinted.grid().spacing_mm() - DVec3::splat(9.0)).length() < 1e-12, "{:?}", hinted.grid());
}

#[test]
fn nifti_2_is_read_too() {
    // Fails if a field of the long header is taken from the wrong place.
    let folder = Folder::new("nifti2");
    for big in [false, true] {
        let mut h = vec![0_u8; 544];
        let mut put = |at: usize, mut b: Vec<u8>| {
            if big {
                b.reverse();
            }
            h[at..at + b.len()].copy_from_slice(&b);
        };
        put(0, 540_i32.to_le_bytes().to_vec());
        put(12, 2_i16.to_le_bytes().to_vec());
        (0..5).for_each(|n| put(16 + 8 * n, [4_i64, 2, 3, 2, 1][n].to_le_bytes().to_vec()));
        put(168, 544_i64.to_le_bytes().to_vec());
        put(176, 0.5_f64.to_le_bytes().to_vec());
        put(348, 1_i32.to_le_bytes().to_vec());
        for (n, v) in [1.0_f64, 0.0, 0.0, 4.0, 0.0, 2.0, 0.0, 5.0, 0.0, 0.0, 3.0, 6.0].into_iter().enumerate() {
            put(400 + 8 * n, v.to_le_bytes().to_vec());
        }
        h[4..8].copy_from_slice(b"n+2\0");
        h.extend(0..12);
        let v = folder.open("two.nii", &h).unwrap();
        assert_eq!((v.grid().origin_mm(), v.grid().spacing_mm()), (DVec3::new(-4.0, -5.0, 6.0), DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!((v.slope(), v.range(), v.warnings().len()), (0.5, [0.0, 5.5], 0));
    }
}

#[test]
fn headerless_files_need_a_layout() {
    // Fails if a layout is misparsed, a name not understood, or a wrong size accepted.
    let folder = Folder::new("raw");
    let layout: RawLayout = "2x3x2,i16,be,skip=3".parse().unwrap();
    let data: Vec<u8> = [vec![9; 3], (0..12_i16).flat_map(|v| (v - 5).to_be_bytes()).collect()].concat();
    let hints = Hints { spacing_mm: Some(DVec3::new(1.0, 2.0, 3.0)), raw: Some(layout), ..Hints::default() };
    let v = open(&folder.file("any.bin", &data), &hints, &Progress::default()).unwrap();
    assert_eq!((v.range(), v.grid().spacing_mm(), v.warnings().len()), ([-5.0, 6.0], DVec3::new(1.0, 2.0, 3.0), 0));
    let longer = open(&folder.file("any.bin", &[data, vec![0]].concat()), &hints, &Progress::default());
    assert!(longer.unwrap_err().to_string().contains("1 bytes more"));

    let named = folder.open("engine_2x3x2_uint8.RAW", &[1; 12]).unwrap();
    assert_eq!((named.grid().dims(), named.warnings().len()), ([2, 3, 2], 2));
    assert!(folder.error("engine_2x3x2_uint16.raw", &[1; 12]).contains("24 bytes of samples are needed, 12 are there"));
    assert!(folder.error("engine.raw", &[1; 12]).contains("pass --raw"));
    for wrong in ["", "2x3", "2x3x0,u8", "2x3x2", "2x3x2,i8", "2x3x2,u8,le", "2x3x2,u8,skip=-1", "99999999999999999999x1x1,u8"] {
        assert!(wrong.parse::<RawLayout>().unwrap_err().to_string().contains("write it like"), "{wrong}");
    }
    let huge = Hints { raw: Some("4000000000x4000000000x1,u8".parse().unwrap()), ..Hints::default() };
    assert!(open(&folder.0.join("engine.raw"), &huge, &Progress::default()).unwrap_err().to_string().contains("larger than this machine"));
}

#[test]
fn what_is_written_is_read_back() {
    // Fails if a number is not written exactly, the scale or unit is lost, or something is left beside the file.
    let folder = Folder::new("write");
    let m = DMat3::from_cols(DVec3::new(0.1, 0.2, 1.0 / 3.0), DVec3::new(0.0, -0.7, 0.0), DVec3::new(0.0, 0.3, 2.5));
    let grid = Grid::from_affine([2, 3, 2], DAffine3::from_mat3_translation(m, DVec3::new(-0.1, 1e-9, 123.456))).unwrap();
    let all = [
        Samples::U8((0..12).collect()),
        Samples::I16((-6..6).map(|v| v * 1000).collect()),
        Samples::U16((0..12).map(|v| v * 5000).collect()),
        Samples::F32((0..12).map(|v| 1.0 / v as f32 - 0.1).collect()),
    ];
    for (n, samples) in all.into_iter().enumerate() {
        let (slope, intercept) = if n == 0 { (1.0, 0.0) } else { (0.1, -1024.5) };
        let unit = if n % 2 == 0 { Unit::Value } else { Unit::Hounsfield };
        let v = Volume::new("v".into(), "test", Raster { grid: grid.clone(), samples, slope, intercept, unit, warnings: vec![] });
        let (v, path) = (v.unwrap(), folder.0.join("out.nrrd"));
        for compression in [nrrd::Compression::Raw, nrrd::Compression::Gzip] {
            nrrd::write(&path, &v, compression, &Progress::default()).unwrap();
            let back = open(&path, &Hints::default(), &Progress::default()).unwrap();
            assert_eq!((back.grid(), back.samples(), back.unit()), (v.grid(), v.samples(), v.unit()));
            assert_eq!((back.slope(), back.intercept(), back.warnings().len()), (slope, intercept, 0));
        }
        let stopped = Progress::default();
        stopped.cancel();
        let before = fs::read(&path).unwrap();
        assert!(matches!(nrrd::write(&path, &v, nrrd::Compression::Raw, &stopped), Err(WriteError::Cancelled(_))));
        assert_eq!(fs::read(&path).unwrap(), before);
        assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 1);
        let nowhere = nrrd::write(&folder.0.join("no/out.nrrd"), &v, nrrd::Compression::Raw, &Progress::default());
        assert!(nowhere.unwrap_err().to_string().contains("out.nrrd: it cannot be written"));
    }
}

mod wrong;
