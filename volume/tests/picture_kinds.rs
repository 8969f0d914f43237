//! Pictures and TIFF as cameras, discs and programs really leave them: what is no slice, what is missing, and where the spacing stands.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::formats::{Hints, Uneven, open};
use bregma_volume::{Progress, ReadSamples, Volume};
use glam::DVec3;
use small::*;
use std::path::Path;
use tiff::encoder::{Compression, Rational, TiffEncoder, colortype};
use tiff::tags::Tag;

fn try_open(path: &Path) -> Result<Volume, String> {
    open(path, &Hints::default(), &Progress::default()).map_err(|e| e.to_string())
}

fn put(folder: &Folder, name: &'static str, files: &[(&str, Vec<u8>)]) -> std::path::PathBuf {
    let files = files.iter().map(|(n, b)| ((*n).to_owned(), b.clone())).collect();
    Small { name, files, open: "" }.write(folder)
}

/// Slice k as a TIFF.
fn tif(k: usize) -> Vec<u8> {
    tiff(k..k + 1, "", Compression::Lzw, false)
}

fn first_of(volume: &Volume) -> Vec<f64> {
    let [nx, ny, nz] = volume.grid().dims();
    (0..nz).map(|k| volume.samples().get_f64(k * nx * ny + 1)).collect()
}

fn firsts(slices: &[usize]) -> Vec<f64> {
    slices.iter().map(|&k| f64::from(sample(1, 0, k))).collect()
}

#[test]
fn what_is_no_slice_is_left_out() {
    // Fails if files that macOS leaves behind, an overview of the same size or another picture gets among the slices, or is left out in silence.
    let folder = Folder::new("kinds-strays");
    let slices = [("r_0001.tif", tif(0)), ("r_0002.tif", tif(1)), ("r_0003.tif", tif(2))];
    let apple = |name| (name, b"\0\x05\x16\x07\0\x02\0\0Mac OS X".to_vec());
    let with = |more: &[(&'static str, Vec<u8>)]| [slices.to_vec(), more.to_vec()].concat();
    let names: Vec<(String, Vec<u8>)> =
        with(&[apple("__MACOSX/._r_0001.tif"), apple("a/._r_0002.tif")]).into_iter().map(|(n, b)| (n.to_owned(), b)).collect();
    let zipped = folder.put("z.zip", &zip(&names));
    for (what, path, warnings) in [
        ("apple", put(&folder, "apple", &with(&[apple("._r_0001.tif"), apple("._r_0004.tif"), apple(".DS_Store")])), 2),
        ("apple in a zip", zipped, 2),
        ("overview", put(&folder, "spr", &with(&[("r__spr.tif", tif(3))])), 3),
        ("overview with a number", put(&folder, "over", &with(&[("overview_0000.tif", tif(3))])), 3),
    ] {
        let volume = try_open(&path).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(first_of(&volume), firsts(&[0, 1, 2]), "{what}");
        assert_eq!(volume.warnings().len(), warnings, "{what}: {:?}", volume.warnings());
    }
}

#[test]
fn two_stacks_are_asked_about() {
    // Fails if two stacks become one, in whichever way their names differ.
    let folder = Folder::new("kinds-stacks");
    for (name, files) in [
        ("sides", ["left_1.tif", "left_2.tif", "right_1.tif", "right_2.tif"]),
        ("numbers", ["m1_1.tif", "m1_2.tif", "m2_1.tif", "m2_2.tif"]),
    ] {
        let files: Vec<(&str, Vec<u8>)> = files.into_iter().enumerate().map(|(k, n)| (n, tif(k))).collect();
        let error = try_open(&put(&folder, name, &files)).unwrap_err();
        assert!(error.contains("it holds 2 stacks of pictures") && error.contains(files[3].0), "{error}");
    }
    let in_folders: Vec<(String, Vec<u8>)> =
        ["a/s1.tif", "a/s2.tif", "b/s1.tif", "b/s2.tif"].iter().map(|n| ((*n).to_owned(), tif(0))).collect();
    let error = try_open(&folder.put("two.zip", &zip(&in_folders))).unwrap_err();
    assert!(error.contains("2 stacks"), "{error}");
}

#[test]
fn missing_pictures_are_said() {
    // Fails if pictures whose numbers have a gap are set close, or if the gap is filled with other than what lies between.
    let folder = Folder::new("kinds-gaps");
    let path = put(&folder, "gap", &[("s_10.tif", tif(0)), ("s_20.tif", tif(1)), ("s_30.tif", tif(2)), ("s_50.tif", tif(3))]);
    let error = try_open(&path).unwrap_err();
    assert!(error.contains("in their numbers, 30 is followed by 50") && error.contains("--uneven resample"), "{error}");
    let hints = Hints { uneven: Uneven::Resample, ..Hints::default() };
    let filled = open(&path, &hints, &Progress::default()).unwrap();
    let want = firsts(&[0, 1, 2, 3]);
    assert_eq!(first_of(&filled), [want[0], want[1], want[2], ((want[2] + want[3]) / 2.0).round(), want[3]]);
    assert!(filled.warnings()[0].contains("interpolated linearly to 5 slices"), "{:?}", filled.warnings());
    // Every tenth picture, and numbers that count nothing, lack none.
    for names in [["s_10.tif", "s_20.tif", "s_30.tif", "s_40.tif"], ["s_101502.tif", "s_101533.tif", "s_101609.tif", "s_101640.tif"]] {
        let files: Vec<(&str, Vec<u8>)> = names.into_iter().enumerate().map(|(k, n)| (n, tif(k))).collect();
        let path = put(&folder, names[1], &files);
        assert_eq!(first_of(&try_open(&path).unwrap()), want, "{names:?}");
    }
}

#[test]
fn floats_are_interpolated_as_numbers() {
    // Fails if what lies between two pictures of floats is made of their bits, which gives no number between them.
    let folder = Folder::new("kinds-float-gaps");
    let picture = |value: f64| {
        let mut out = std::io::Cursor::new(vec![]);
        TiffEncoder::new(&mut out).unwrap().write_image::<colortype::Gray64Float>(8, 6, &[value; 48]).unwrap();
        out.into_inner()
    };
    let path =
        put(&folder, "gap", &[("s1.tif", picture(-0.75)), ("s2.tif", picture(1.0)), ("s3.tif", picture(2.5)), ("s5.tif", picture(1.25))]);
    let hints = Hints { uneven: Uneven::Resample, ..Hints::default() };
    assert_eq!(first_of(&open(&path, &hints, &Progress::default()).unwrap()), [-0.75, 1.0, 2.5, 1.875, 1.25]);
}

#[test]
fn spacing_stands_beside_pictures_or_in_them() {
    // Fails if a scanner's log, or what ImageJ writes into a slice, is not looked at, or if the person is not told where a length comes from.
    let folder = Folder::new("kinds-beside");
    let slices = || vec![("r_rec01.tif", tif(0)), ("r_rec02.tif", tif(1))];
    let log = b"[Acquisition]\nCamera Pixel Size (um)=11.6\n[Reconstruction]\nPixel Size (um)=17,44\n".to_vec();
    let other = b"[Reconstruction]\nPixel Size (um)=99\n".to_vec();
    let nikon = b"[XTekCT]\nVoxelSizeX=0.045\nVoxelSizeY=0.045\nVoxelSizeZ=0.05\n".to_vec();
    for (name, more, mm) in [
        ("bruker", vec![("r_rec.log", log), ("another.log", other)], DVec3::splat(17.44 * 1e-3)),
        ("nikon", vec![("r.xtekct", nikon)], DVec3::new(0.045, 0.045, 0.05)),
    ] {
        let volume = try_open(&put(&folder, name, &[slices(), more.clone()].concat())).unwrap();
        assert!(volume.spacing_is_stated() && volume.grid().spacing_mm() == mm, "{name}: {:?}", volume.grid());
        assert!(volume.warnings()[0].ends_with(more[0].0), "{:?}", volume.warnings());
    }
    let own = |k: usize| tiff(k..k + 1, "ImageJ=1.54f\nunit=micron\nspacing=20\n", Compression::Uncompressed, false);
    let volume = try_open(&put(&folder, "imagej", &[("s1.tif", own(0)), ("s2.tif", own(1))])).unwrap();
    assert!(
        volume.spacing_is_stated() && (volume.grid().spacing_mm() - DVec3::new(5e-4, 7.5e-4, 0.02)).length() < 1e-12,
        "{:?}",
        volume.grid()
    );
}

#[test]
fn imagej_says_its_units() {
    // Fails if a depth of 1 that ImageJ leaves out, or a unit of its own for z, is not what ImageJ means.
    let folder = Folder::new("kinds-imagej");
    for (text, mm) in [
        ("unit=mm\n", DVec3::new(0.5, 0.75, 1.0)),
        ("unit=\\u00B5m\nspacing=2\n", DVec3::new(5e-4, 7.5e-4, 2e-3)),
        ("unit=micrometers\nzunit=mm\nspacing=2\n", DVec3::new(5e-4, 7.5e-4, 2.0)),
        ("unit=mm\nyunit=cm\nzunit=um\nspacing=-500\n", DVec3::new(0.5, 7.5, 0.5)),
    ] {
        let description = format!("ImageJ=1.53t\nimages=4\nslices=4\n{text}");
        let volume = try_open(&folder.put("a.tif", &tiff(0..4, &description, Compression::Uncompressed, false))).unwrap();
        assert!(volume.spacing_is_stated(), "{text}");
        assert!((volume.grid().spacing_mm() - mm).length() < 1e-12, "{text}: {:?}", volume.grid().spacing_mm());
    }
    for text in ["unit=pixel\n", "spacing=2\n", "unit=mm\nzunit=pixel\nspacing=2\n"] {
        let description = format!("ImageJ=1.53t\nimages=4\nslices=4\n{text}");
        let volume = try_open(&folder.put("a.tif", &tiff(0..4, &description, Compression::Uncompressed, false))).unwrap();
        assert!(!volume.spacing_is_stated(), "{text}");
    }
}

#[test]
fn a_description_is_no_fault_of_the_pixels() {
    // Fails if a text that is no UTF-8 makes a sound file damaged, or hides the spacing in it.
    let folder = Folder::new("kinds-latin");
    let mut bytes = tiff(0..4, &format!("{IMAGEJ}who=Sch?del\n"), Compression::Uncompressed, false);
    let at = bytes.windows(7).position(|w| w == b"Sch?del").unwrap();
    bytes[at + 3] = 0xe4;
    let volume = try_open(&folder.put("a.tif", &bytes)).unwrap();
    assert_eq!((volume.grid().spacing_mm(), volume.metadata().get("who").map(String::as_str)), (DVec3::from(SPACING_MM), Some("Schädel")));
}

/// Slice k in `colours` channels of 8 bits, the last `tint` brighter.
fn coloured(k: usize, tint: u8) -> Vec<u8> {
    let mut out = std::io::Cursor::new(vec![]);
    let pixels: Vec<u8> = slice(k, false).chunks(2).flat_map(|b| [b[0], b[0], b[0].wrapping_add(tint)]).collect();
    let mut encoder = TiffEncoder::new(&mut out).unwrap();
    encoder.write_image::<colortype::RGB8>(DIMS[0] as u32, DIMS[1] as u32, &pixels).unwrap();
    out.into_inner()
}

/// Slice k as places in a palette whose place n is grey value 255 − n, or with `tint` a colour.
fn paletted(k: usize, tint: u16) -> Vec<u8> {
    let mut out = std::io::Cursor::new(vec![]);
    let mut encoder = TiffEncoder::new(&mut out).unwrap();
    let mut page = encoder.new_image::<colortype::Gray8>(DIMS[0] as u32, DIMS[1] as u32).unwrap();
    let palette: Vec<u16> = (0..3 * 256).map(|n| (255 - n % 256) * 257 + if n == 700 { tint } else { 0 }).collect();
    page.encoder().write_tag(Tag::ColorMap, &palette[..]).unwrap();
    page.encoder().write_tag(Tag::PhotometricInterpretation, 3_u16).unwrap();
    page.write_data(&slice(k, false).chunks(2).map(|b| 255 - b[0]).collect::<Vec<_>>()).unwrap();
    out.into_inner()
}

#[test]
fn grey_may_be_saved_as_colour() {
    // Fails if grey in RGB, or by a palette of greys, is refused, or if colours pass for grey.
    let folder = Folder::new("kinds-grey");
    let want: Vec<f64> = (0..2).flat_map(|k| slice(k, false)).step_by(2).map(f64::from).collect();
    let all = |volume: Volume| (0..volume.samples().len()).map(|n| volume.samples().get_f64(n)).collect::<Vec<_>>();
    for (name, make) in [("rgb", &(|k| coloured(k, 0)) as &dyn Fn(usize) -> Vec<u8>), ("palette", &|k| paletted(k, 0))] {
        let path = put(&folder, name, &[("s1.tif", make(0)), ("s2.tif", make(1))]);
        assert_eq!(all(try_open(&path).unwrap()), want, "{name}");
        let alone = folder.put(&format!("{name}.tif"), &make(0));
        assert_eq!(all(try_open(&alone).unwrap()), want[..48], "{name}");
    }
    for (name, bytes) in [("c.tif", coloured(0, 1)), ("p.tif", paletted(0, 300))] {
        let error = try_open(&folder.put(name, &bytes)).unwrap_err();
        assert!(error.contains("colours; only grey values"), "{error}");
    }
}

#[test]
fn pages_and_slices_are_not_mistaken_for_each_other() {
    // Fails if a file of many pages counts as one slice, one slice of many as a scan, or a preview on the first page as the scan.
    let folder = Folder::new("kinds-pages");
    let path = put(&folder, "many", &[("skull.tif", tiff(0..4, IMAGEJ, Compression::Lzw, false))]);
    let volume = try_open(&path).unwrap();
    assert_eq!((first_of(&volume), volume.grid().spacing_mm()), (firsts(&[0, 1, 2, 3]), DVec3::from(SPACING_MM)));
    let path =
        put(&folder, "both", &[("a1.tif", tiff(0..2, "", Compression::Lzw, false)), ("a2.tif", tiff(2..4, "", Compression::Lzw, false))]);
    let error = try_open(&path).unwrap_err();
    assert!(error.contains("its file a1.tif has 2 pages") && error.contains("name that file"), "{error}");
    let path = put(&folder, "slices", &[("s_1.tif", tif(0)), ("s_2.tif", tif(1)), ("other.tif", tif(2))]);
    let error = try_open(&path.join("s_2.tif")).unwrap_err();
    assert!(error.contains("one picture of a stack; name its folder"), "{error}");
    assert_eq!(try_open(&path.join("other.tif")).unwrap().grid().dims(), [8, 6, 1]);
    // A preview first.
    let mut out = std::io::Cursor::new(vec![]);
    let mut encoder = TiffEncoder::new(&mut out).unwrap();
    encoder.write_image::<colortype::Gray8>(2, 2, &[9; 4]).unwrap();
    for k in 0..3 {
        let mut page = encoder.new_image::<colortype::Gray16>(DIMS[0] as u32, DIMS[1] as u32).unwrap();
        page.x_resolution(Rational { n: 2, d: 1 });
        page.write_data(&slice(k, false).chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect::<Vec<_>>()).unwrap();
    }
    let volume = try_open(&folder.put("preview.tif", &out.into_inner())).unwrap();
    assert_eq!(first_of(&volume), firsts(&[0, 1, 2]));
    assert!(volume.warnings()[0].contains("1 of 4 pages are not like the others"), "{:?}", volume.warnings());
}

#[test]
fn pictures_may_be_packed_by_jpeg_2000() {
    // Fails if a folder of JPEG 2000 pictures is not read, or loses a bit or a sign.
    let folder = Folder::new("kinds-jpeg-2000");
    for (name, codec, offset) in [("unsigned", "jpeg 2000", 0.0), ("signed", "signed jpeg 2000", 2048.0)] {
        let volume = try_open(&put(&folder, name, &[("s1.j2k", packed(codec)), ("s2.j2k", packed(codec))])).unwrap();
        let want: Vec<f64> = (0..96).map(|n| f64::from(sample(n % 8, n / 8 % 6, 0)) - offset).collect();
        assert_eq!((0..volume.samples().len()).map(|n| volume.samples().get_f64(n)).collect::<Vec<_>>(), want, "{name}");
    }
}
