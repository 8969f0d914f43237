//! Every form that a scan comes in, on small files of known samples: what is read, what is written, what DICOM says about geometry.
//! Fails if a reader or writer changes a sample, a place, a unit or a type, or if something unusual passes in silence.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::formats::{self, Hints, Reduce, Uneven, open, scan, write};
use bregma_volume::{Grid, Progress, Raster, ReadSamples, Samples, Unit, Volume};
use glam::{DAffine3, DMat3, DVec3};
use small::*;
use std::path::Path;

fn read(path: &Path, hints: &Hints) -> Volume {
    open(path, hints, &Progress::default()).unwrap()
}

fn error(path: &Path, hints: &Hints) -> String {
    open(path, hints, &Progress::default()).unwrap_err().to_string()
}

fn expected() -> Vec<f64> {
    let [nx, ny, nz] = DIMS;
    (0..nx * ny * nz).map(|n| f64::from(sample(n % nx, n / nx % ny, n / (nx * ny)))).collect()
}

fn samples_of(volume: &Volume) -> Vec<f64> {
    (0..volume.samples().len()).map(|n| volume.samples().get_f64(n)).collect()
}

#[test]
fn every_form_gives_the_same_scan() {
    // Fails if a reader takes a sample from the wrong place, in the wrong type or order, or mistakes the geometry that the form holds.
    let folder = Folder::new("forms");
    let all = all();
    for small in &all {
        let path = small.write(&folder);
        let hints = Hints { spacing_mm: Some(SPACING_MM.into()), ..Hints::default() };
        let volume = read(&path, &hints);
        assert_eq!(volume.grid().dims(), DIMS, "{}", small.name);
        assert_eq!(volume.samples().type_name(), "u16", "{}", small.name);
        assert_eq!(samples_of(&volume), expected(), "{}", small.name);
        assert!((volume.grid().spacing_mm() - DVec3::from(SPACING_MM)).length() < 1e-9, "{}: {:?}", small.name, volume.grid());
        // These forms, or the way they are written here, hold no place in the patient.
        let placeless = ["NumPy", "TIFF", "BigTIFF", "InVesalius", "PNG", "raw", "Analyze", "VH", "VOL", "Drishti"]
            .iter()
            .any(|p| small.name.starts_with(p));
        let origin = if placeless { DVec3::ZERO } else { DVec3::new(-10.0, 20.0, 30.0) };
        assert!((volume.grid().origin_mm() - origin).length() < 1e-9, "{}: {:?}", small.name, volume.grid());
        let to_the_front = ["InVesalius", "Analyze"].iter().any(|p| small.name.starts_with(p));
        let signs = DVec3::new(1.0, if to_the_front { -1.0 } else { 1.0 }, 1.0);
        assert_eq!(volume.grid().direction(), DMat3::from_diagonal(signs), "{}", small.name);
        assert_eq!(
            volume.warnings().is_empty(),
            !placeless && !["VTI", "GIPL", "VTK", "Amira", "Zarr 2"].iter().any(|p| small.name.starts_with(p)),
            "{}: {:?}",
            small.name,
            volume.warnings()
        );
    }
    println!("{} forms give the same {} samples", all.len(), expected().len());
}

#[test]
fn what_streams_by_is_what_is_read() {
    // Fails if `info` and an opened scan disagree, or if a preview takes other samples than every 2nd and 4th.
    let folder = Folder::new("streams");
    for small in all().into_iter().chain(others()) {
        let path = small.write(&folder);
        let hints = Hints::default();
        let volume = read(&path, &hints);
        let survey = scan(&path, &hints, &Progress::default()).unwrap().survey(&Progress::default()).unwrap();
        assert_eq!(survey.type_name, volume.samples().type_name(), "{}", small.name);
        assert_eq!(survey.warnings, volume.warnings(), "{}", small.name);
        assert_eq!(&survey.summary.histogram, volume.histogram(), "{}", small.name);
        assert_eq!((survey.summary.range(), survey.summary.otsu(), survey.summary.unit), (volume.range(), volume.otsu(), volume.unit()));
        assert_eq!(survey.sample_bytes, volume.sample_bytes() as u64);
        for (reduce, step) in [(Reduce::Half, 2), (Reduce::Quarter, 4)] {
            let preview = read(&path, &Hints { reduce: Some(reduce), ..hints.clone() });
            let dims = volume.grid().dims();
            assert_eq!(preview.grid().dims(), dims.map(|n| n.div_ceil(step)), "{}", small.name);
            let at = |n: usize| {
                let [nx, ny, _] = preview.grid().dims();
                let [i, j, k] = [n % nx, n / nx % ny, n / (nx * ny)].map(|c| c * step);
                volume.samples().get_f64((k * dims[1] + j) * dims[0] + i)
            };
            assert!((0..preview.samples().len()).all(|n| preview.samples().get_f64(n) == at(n)), "{} by {step}", small.name);
            assert_eq!(preview.grid().spacing_mm(), volume.grid().spacing_mm() * step as f64);
            assert!(preview.name().contains("every") && preview.warnings().iter().any(|w| w.contains("preview")), "{}", small.name);
        }
    }
}

#[test]
fn floats_and_wide_numbers_stream_as_they_are_read() {
    // Fails if mending, rounding or narrowing differs between the two ways through the samples.
    let folder = Folder::new("floats");
    let nrrd = |kind: &str, data: &[u8]| {
        let text = format!("NRRD0004\ntype: {kind}\ndimension: 3\nsizes: 4 3 2\nspacings: 1 1 1\nendian: little\nencoding: raw\n\n");
        folder.put("f.nrrd", &[text.as_bytes(), data].concat())
    };
    let mut floats: Vec<f64> = (0..24).map(|n| f64::from(n) * 0.1 - 1.0).collect();
    (floats[3], floats[5], floats[9]) = (f64::NAN, f64::INFINITY, -3.4e38);
    let wide: Vec<i64> = (0..24).map(|n| n * 3000).collect();
    for (kind, bytes) in [
        ("double", floats.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()),
        ("float", floats.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect()),
        ("int64", wide.iter().flat_map(|v| v.to_le_bytes()).collect()),
        ("int64", wide.iter().flat_map(|v| (v << 30).to_le_bytes()).collect()),
    ] {
        let path = nrrd(kind, &bytes);
        let volume = read(&path, &Hints::default());
        let survey = scan(&path, &Hints::default(), &Progress::default()).unwrap().survey(&Progress::default()).unwrap();
        assert_eq!((survey.type_name, &survey.warnings[..]), (volume.samples().type_name(), volume.warnings()));
        assert_eq!(&survey.summary.histogram, volume.histogram(), "{kind}");
    }
}

/// What 16 bits are as a float (IEEE 754, binary16), finite ones.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let size = if exponent == 0 { fraction * 2_f64.powi(-24) } else { (1.0 + fraction / 1024.0) * 2_f64.powi(exponent - 15) };
    if bits >> 15 == 1 { -size } else { size }
}

#[test]
fn floats_of_16_bits_are_read() {
    // Fails if they are refused, taken as whole numbers, or lose their sign or what is below 2⁻¹⁴.
    let folder = Folder::new("halves");
    // Of every size and both signs, none infinite.
    let bits: Vec<u16> = (0..192_u16).map(|n| n.wrapping_mul(2741) & 0xbbff).collect();
    let want: Vec<f64> = bits.iter().map(|&b| half(b)).collect();
    let bytes = |big: bool| bits.iter().flat_map(|b| if big { b.to_be_bytes() } else { b.to_le_bytes() }).collect::<Vec<u8>>();
    let array = |order, big| {
        let mut file = npy(order, "False", "4, 6, 8", &bytes(big));
        let at = file.windows(2).position(|w| w == b"u2").unwrap();
        file[at] = b'f';
        file
    };
    let pages = |compression| {
        let mut out = std::io::Cursor::new(vec![]);
        let mut tiff = tiff::encoder::TiffEncoder::new(&mut out).unwrap().with_compression(compression);
        bits.chunks(48).for_each(|page| tiff.write_image::<tiff::encoder::colortype::Gray16>(8, 6, page).unwrap());
        let mut file = out.into_inner();
        // The format of a page's samples: tag 339, one number of 16 bits; 1 is whole, 3 a float.
        let format = [0x53, 1, 3, 0, 1, 0, 0, 0, 1, 0];
        while let Some(at) = file.windows(10).position(|w| w == format) {
            file[at + 8] = 3;
        }
        file
    };
    for (name, file) in [
        ("a.npy", array("<", false)),
        ("b.npy", array(">", true)),
        ("c.tif", pages(tiff::encoder::Compression::Uncompressed)),
        ("d.tif", pages(tiff::encoder::Compression::Lzw)),
    ] {
        let path = folder.put(name, &file);
        let volume = read(&path, &Hints::default());
        assert_eq!((volume.type_name(), volume.grid().dims(), samples_of(&volume)), ("f32", DIMS, want.clone()), "{name}");
        let survey = scan(&path, &Hints::default(), &Progress::default()).unwrap().survey(&Progress::default()).unwrap();
        assert_eq!(&survey.summary.histogram, volume.histogram(), "{name}");
    }
}

#[test]
fn what_is_written_is_read_back() {
    // Fails if a form loses or rounds a sample, moves it by more than a nanometre, or forgets its unit, scale or metadata.
    let folder = Folder::new("round-trip");
    let m = DMat3::from_cols(DVec3::new(0.1, 0.2, 1.0 / 3.0), DVec3::new(0.0, -0.7, 0.0), DVec3::new(0.0, 0.3, 2.5));
    let sheared = Grid::from_affine([4, 3, 2], DAffine3::from_mat3_translation(m, DVec3::new(-0.1, 1e-9, 694.21))).unwrap();
    let plain = Grid::new([4, 3, 2], DVec3::new(0.5, 0.5, 2.0), DVec3::new(1.0, -2.0, 3.0), DMat3::IDENTITY).unwrap();
    let all = [
        Samples::U8((0..24).collect()),
        Samples::I16((-12..12).map(|v| v * 1000).collect()),
        Samples::U16((0..24).map(|v| v * 2500).collect()),
        Samples::F32((0..24).map(|v| 1.0 / (v as f32 + 1.0) - 0.1).collect()),
    ];
    let mut worst = 0.0_f64;
    let mut trips = 0;
    for (n, samples) in all.into_iter().enumerate() {
        for grid in [&sheared, &plain] {
            let (slope, intercept) = if n == 0 { (1.0, 0.0) } else { (0.1, -1024.5) };
            let unit = if n % 2 == 0 { Unit::Value } else { Unit::Hounsfield };
            let raster = Raster { grid: grid.clone(), samples: samples.clone(), slope, intercept, unit, warnings: vec![] };
            let volume = Volume::new("v".into(), "test", raster).unwrap();
            for name in ["a.nrrd", "a.nii", "a.nii.gz", "a.mha", "a.tif"] {
                let path = folder.0.join(name);
                write(&path, &volume, &Progress::default()).unwrap();
                let back = read(&path, &Hints::default());
                assert_eq!((back.samples(), back.unit(), back.grid().dims()), (volume.samples(), unit, grid.dims()), "{name}");
                assert_eq!((back.slope(), back.intercept(), back.spacing_is_stated()), (slope, intercept, true), "{name}");
                assert!(back.warnings().is_empty(), "{name}: {:?}", back.warnings());
                for (a, b) in back.grid().corners_mm().iter().zip(grid.corners_mm()) {
                    worst = worst.max(a.distance(b));
                }
                trips += 1;
            }
        }
    }
    println!("{trips} round trips: samples bit-equal, geometry to {worst:.1e} mm");
    assert!(worst < 1e-6, "a corner moved by {worst} mm");

    // Metadata: all of it where there is a place, a sentence where there is none.
    let ct = Small { name: "ct", files: dicom_files(Dicom::slice), open: "" }.write(&folder);
    let volume = read(&ct, &Hints::default());
    assert_eq!(volume.metadata().get("SeriesDescription").map(String::as_str), Some("a skull"));
    for (name, lost) in [("m.nrrd", None), ("m.mha", None), ("m.nii", Some("SeriesDescription")), ("m.tif", Some("origin"))] {
        let said = write(&folder.0.join(name), &volume, &Progress::default()).unwrap();
        assert_eq!(said.len(), usize::from(lost.is_some()), "{name}: {said:?}");
        assert!(lost.is_none_or(|word| said[0].contains(word)), "{name}: {said:?}");
        let back = read(&folder.0.join(name), &Hints::default());
        assert_eq!((back.samples(), back.unit()), (volume.samples(), Unit::Hounsfield), "{name}");
        assert_eq!(back.metadata(), volume.metadata(), "{name}");
        // No form holds what is not read.
        let bytes = std::fs::read(folder.0.join(name)).unwrap();
        assert!(!bytes.windows(6).any(|w| w == b"SECRET") && !bytes.windows(8).any(|w| w == b"19010203"), "{name} names the person");
    }
    let wrong = write(&folder.0.join("m.doc"), &volume, &Progress::default()).unwrap_err().to_string();
    assert!(wrong.contains("m.doc: end the name in one of .nrrd, .nii, .nii.gz"), "{wrong}");
}

/// Opens a folder of DICOM files.
fn dicom(folder: &Folder, name: &'static str, files: Vec<(String, Vec<u8>)>, hints: &Hints) -> Result<Volume, String> {
    let path = Small { name, files, open: "" }.write(folder);
    open(&path, hints, &Progress::default()).map_err(|e| e.to_string())
}

#[test]
fn dicom_values_are_what_the_file_says() {
    // Fails if a scale, sign, padding or inversion is ignored.
    let folder = Folder::new("dicom-values");
    let none = Hints::default();
    let plain = dicom(&folder, "plain", dicom_files(Dicom::slice), &none).unwrap();
    assert_eq!((plain.unit(), plain.intercept(), plain.warnings().len()), (Unit::Hounsfield, -1024.0, 0));
    let us = dicom(&folder, "us", dicom_files(|k| Dicom::slice(k).with((0x28, 0x1054), "LO", "US")), &none).unwrap();
    assert_eq!(us.unit(), Unit::Value);
    let mr = dicom(&folder, "mr", dicom_files(|k| Dicom::slice(k).with((0x8, 0x60), "CS", "MR")), &none).unwrap();
    assert_eq!(mr.unit(), Unit::Value);
    // A scale of its own for each slice.
    let scaled = |k: usize| Dicom::slice(k).with((0x28, 0x1053), "DS", &format!("{}", 1.0 + k as f64));
    let scaled = dicom(&folder, "scaled", dicom_files(scaled), &none).unwrap();
    let values: Vec<f64> = samples_of(&scaled).iter().map(|s| scaled.value_of(*s)).collect();
    let want = |n: usize| expected()[n] * (1.0 + (n / 48) as f64) - 1024.0;
    assert!((0..values.len()).all(|n| values[n] == want(n)));
    assert!(scaled.warnings()[0].contains("scales of their own"), "{:?}", scaled.warnings());
    // Signed samples of 12 bits, the four bits above them full of something else.
    let signed = |k: usize| {
        let mut dicom = Dicom::slice(k);
        dicom.number((0x28, 0x103), 1);
        let (_, pixels) = dicom.elements.get_mut(&(0x7fe0, 0x10)).unwrap();
        pixels.iter_mut().skip(1).step_by(2).for_each(|b| *b |= 0xa0);
        dicom
    };
    let signed = dicom(&folder, "signed", dicom_files(signed), &none).unwrap();
    let want: Vec<f64> = expected().iter().map(|&v| if v >= 2048.0 { v - 4096.0 } else { v }).collect();
    assert_eq!((signed.samples().type_name(), samples_of(&signed)), ("i16", want));
    // Padding above is air, padding below is left.
    let padded = |value: u16| {
        move |k: usize| {
            let mut dicom = Dicom::slice(k);
            (0x101..0x103).zip([16, 15]).for_each(|(e, v)| dicom.number((0x28, e), v));
            dicom.number((0x28, 0x120), value);
            dicom.elements.get_mut(&(0x7fe0, 0x10)).unwrap().1[..2].copy_from_slice(&value.to_le_bytes());
            dicom
        }
    };
    let high = dicom(&folder, "high", dicom_files(padded(63_536)), &none).unwrap();
    assert_eq!((high.samples().get_f64(0), high.warnings().len()), (24.0, 1));
    assert!(high.warnings()[0].contains("63536 to 63536 mark what was not scanned"), "{:?}", high.warnings());
    let low = dicom(&folder, "low", dicom_files(padded(3)), &none).unwrap();
    assert_eq!((low.samples().get_f64(0), low.warnings().len()), (3.0, 0));
    // Bone as the highest of 12 bits is padding, too, whatever type it lies in; each slice has its own scale, and its own air.
    let highest = |k: usize| {
        let mut dicom = Dicom::slice(k).with((0x28, 0x1053), "DS", ["1", "2"][k % 2]);
        dicom.number((0x28, 0x120), 4095);
        dicom.elements.get_mut(&(0x7fe0, 0x10)).unwrap().1[..2].copy_from_slice(&4095_u16.to_le_bytes());
        dicom
    };
    let highest = dicom(&folder, "highest", dicom_files(highest), &none).unwrap();
    let first = |k: usize| highest.value_of(highest.samples().get_f64(48 * k));
    assert_eq!([0, 1, 2, 3].map(first), [-1000.0; 4], "{:?}", highest.warnings());
    // A CT without a scale is HU as it is, but that is said.
    let bare = |k| Dicom::slice(k).without((0x28, 0x1052)).without((0x28, 0x1053));
    let bare = dicom(&folder, "bare", dicom_files(bare), &none).unwrap();
    assert_eq!((bare.unit(), bare.intercept(), bare.warnings().len()), (Unit::Hounsfield, 0.0, 1));
    assert!(bare.warnings()[0].contains("does not state how its numbers become HU"), "{:?}", bare.warnings());
    // White for low.
    let inverted = |k| Dicom::slice(k).with((0x28, 0x4), "CS", "MONOCHROME1").with((0x8, 0x60), "CS", "DX");
    let inverted = dicom(&folder, "inverted", dicom_files(inverted), &none).unwrap();
    assert!(inverted.slope() < 0.0 && inverted.warnings()[0].contains("MONOCHROME1"));
    // Its padding at 0 would be the densest of all; air is the other end.
    let white = |k: usize| {
        let mut dicom = Dicom::slice(k).with((0x28, 0x4), "CS", "MONOCHROME1").with((0x8, 0x60), "CS", "DX");
        dicom.number((0x28, 0x120), 0);
        dicom
    };
    let white = dicom(&folder, "white", dicom_files(white), &none).unwrap();
    assert_eq!((white.samples().get_f64(0), white.range()[0]), (4095.0, 1024.0 - 4095.0));
}

#[test]
fn dicom_pixels_are_unpacked_exactly() {
    // Fails if a codec loses a bit, or a syntax that is not read is not named.
    let folder = Folder::new("dicom-codecs");
    let one = |name, codec: &str, syntax, signed: bool| {
        let mut slice = Dicom::slice(0).packed(syntax, vec![packed(codec)]);
        if signed {
            (0x101..0x104).zip([16, 15, 1]).for_each(|(e, v)| slice.number((0x28, e), v));
        }
        dicom(&folder, name, vec![("IM1".into(), slice.bytes())], &Hints::default())
    };
    let want = &expected()[..48];
    assert_eq!(samples_of(&one("jpeg", "jpeg", JPEG_LOSSLESS, false).unwrap()), want);
    assert_eq!(samples_of(&one("j2k", "jpeg 2000", JPEG_2000, false).unwrap()), want);
    let signed: Vec<f64> = want.iter().map(|v| v - 2048.0).collect();
    assert_eq!(samples_of(&one("signed", "signed jpeg 2000", JPEG_2000, true).unwrap()), signed);
    assert_eq!(samples_of(&one("jls", "jpeg-ls", JPEG_LS, false).unwrap()), want);
    let error = one("ht", "jpeg 2000", HTJ2K, false).unwrap_err();
    assert!(error.contains("High-Throughput") && error.contains("1.2.840.10008.1.2.4.201") && error.contains("pydicom"), "{error}");
}

#[test]
fn a_series_is_chosen_and_strays_are_left_out_aloud() {
    // Fails if another series, a localizer, a report or a doubled slice gets into the scan, or is dropped without a word.
    let folder = Folder::new("dicom-series");
    let mut files = dicom_files(Dicom::slice);
    let other = |k| Dicom::slice(k).with((0x20, 0xe), "UI", "1.2.4").with((0x20, 0x11), "IS", "9").with((0x8, 0x103e), "LO", "the jaw");
    files.extend((0..2).map(|k| (format!("OTHER/JAW{k}"), other(k).bytes())));
    let mut report = Dicom::slice(9).without((0x7fe0, 0x10)).with((0x8, 0x60), "CS", "SR");
    files.push(("REPORT".into(), report.bytes()));
    report = Dicom::slice(8).with((0x8, 0x8), "CS", "ORIGINAL\\PRIMARY\\LOCALIZER");
    files.push(("SCOUT".into(), report.bytes()));
    files.push(("AGAIN".into(), Dicom::slice(1).with((0x20, 0x13), "IS", "77").bytes()));
    files.push(("SIDE".into(), Dicom::slice(2).with((0x20, 0x37), "DS", "0\\1\\0\\0\\0\\-1").bytes()));
    files.push(("readme.txt".into(), b"not a scan".to_vec()));
    let path = Small { name: "study", files, open: "" }.write(&folder);
    let volume = read(&path, &Hints::default());
    assert_eq!(samples_of(&volume), expected());
    let said = volume.warnings().join("\n");
    for part in [
        "it holds 2 series; the largest, 7, is read; name another as FOLDER#NUMBER: 9 (the jaw, 2 images)",
        "1 of its images are localizers",
        "1 of its files hold no image",
        "1 of 5 slices lie where another one does",
        "1 of 6 slices differ in size, direction or spacing",
    ] {
        assert!(said.contains(part), "{part} is missing: {said}");
    }
    let jaw = read(&path.with_file_name("study#9"), &Hints::default());
    assert_eq!((jaw.grid().dims(), jaw.name(), jaw.warnings().len()), ([8, 6, 2], "study#9", 0));
    assert_eq!(read(&path.join("OTHER/JAW1"), &Hints::default()).grid().dims(), [8, 6, 2]);
    let unknown = error(&path.with_file_name("study#5"), &Hints::default());
    assert!(unknown.contains("study#5: it has no series 5; it has 7 (a skull, 7 images), 9 (the jaw, 2 images)"), "{unknown}");
}

#[test]
fn series_of_one_number_are_told_apart() {
    // Fails if one of several series with the same number, or without any, cannot be named, or if a name means another one than is listed.
    let folder = Folder::new("dicom-numbers");
    let mut files = vec![];
    for (uid, number, slices) in [("1.2.1", "3", 4), ("1.2.2", "3", 3), ("1.2.3", "", 2), ("1.2.4", "8", 1)] {
        let slice = |k| Dicom::slice(k).with((0x20, 0xe), "UI", uid).with((0x20, 0x11), "IS", number);
        files.extend((0..slices).map(|k| (format!("{uid}/IM{k}"), slice(k).bytes())));
    }
    let path = Small { name: "twins", files, open: "" }.write(&folder);
    let listed = formats::series(&path, &Progress::default()).unwrap();
    assert_eq!(listed.iter().map(|s| (s.key.as_str(), s.images)).collect::<Vec<_>>(), [("3.1", 4), ("3.2", 3), ("0", 2), ("8", 1)]);
    assert_eq!(listed[1].to_string(), "3.2 (a skull, 3 images)");
    for series in &listed {
        let named = read(&path.with_file_name(format!("twins#{}", series.key)), &Hints::default());
        assert_eq!(named.grid().dims()[2] as u64, series.images, "{series}");
    }
    let both = error(&path.with_file_name("twins#3"), &Hints::default());
    assert!(both.contains("it has no series 3; it has 3.1 (a skull, 4 images), 3.2"), "{both}");
    // Nothing to choose in one file, or in what is no DICOM.
    assert_eq!(formats::series(&path.join("1.2.1/IM0"), &Progress::default()).unwrap(), []);
    let nrrd = all().iter().find(|s| s.name == "NRRD").unwrap().write(&folder);
    assert_eq!(formats::series(&nrrd, &Progress::default()).unwrap(), []);
}

#[test]
fn claimed_frames_cost_nothing() {
    // Fails if a file of many bytes has as many images as it claims: only those that it describes can lie where it says.
    let folder = Folder::new("dicom-frames");
    let mut one = Dicom::slice(0).with((0x28, 0x8), "IS", "20000000");
    [(0x10, 1), (0x11, 1), (0x100, 8), (0x101, 8), (0x102, 7)].into_iter().for_each(|(e, v)| one.number((0x28, e), v));
    one.elements.insert((0x7fe0, 0x10), ("OW", vec![7; 20_000_000]));
    let begun = std::time::Instant::now();
    let volume = dicom(&folder, "frames", vec![("IM1".into(), one.bytes())], &Hints::default()).unwrap();
    assert_eq!(volume.grid().dims(), [1, 1, 1]);
    assert!(volume.warnings()[0].starts_with("19999999 of its images do not state where they lie"), "{:?}", volume.warnings());
    // As many images as frames would take seconds and gigabytes; one takes milliseconds.
    assert!(begun.elapsed().as_secs_f64() < 1.0, "{:?}", begun.elapsed());
    // More than can be counted, twice.
    let endless = |k| Dicom::slice(k).with((0x28, 0x8), "IS", "99999999999999999999");
    let error = dicom(&folder, "endless", dicom_files(endless), &Hints::default()).unwrap_err();
    assert!(error.contains("it ends too early"), "{error}");
}

#[test]
fn blank_slices_are_no_fraud() {
    // Fails if packed data is refused because deflate could not have packed it so well.
    let folder = Folder::new("blank");
    let blank = "ff4fff5100290000000002000000020000000000000000000000020000000200000000000000000000010f0101ff52000c00000001000504040001ff5c00134080888890888890888890888890888890ff640025000143726561746564206279204f70656e4a5045472076657273696f6e20322e352e34ff90000a00000000001e0001ff93dff89038115054aff4c88f8080808080ffd9";
    let blank: Vec<u8> = (0..blank.len()).step_by(2).map(|n| u8::from_str_radix(&blank[n..n + 2], 16).unwrap()).collect();
    let mut slice = Dicom::slice(0).packed(JPEG_2000, vec![blank]);
    [(0x10, 512), (0x11, 512), (0x101, 16), (0x102, 15)].into_iter().for_each(|(e, v)| slice.number((0x28, e), v));
    let volume = dicom(&folder, "j2k", vec![("IM1".into(), slice.bytes())], &Hints::default()).unwrap();
    assert_eq!((volume.grid().dims(), volume.range()), ([512, 512, 1], [-1024.0; 2]));
    // LZW's strings grow longer than deflate's matches.
    let mut out = std::io::Cursor::new(vec![]);
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut out).unwrap().with_compression(tiff::encoder::Compression::Lzw);
    let mut page = encoder.new_image::<tiff::encoder::colortype::Gray16>(4096, 4096).unwrap();
    page.rows_per_strip(4096).unwrap();
    page.write_data(&vec![0; 4096 * 4096]).unwrap();
    let bytes = out.into_inner();
    assert!(4096 * 4096 * 2 / bytes.len() > 1100, "{} bytes", bytes.len());
    assert_eq!(read(&folder.put("blank.tif", &bytes), &Hints::default()).grid().dims(), [4096, 4096, 1]);
    assert_eq!(read(folder.put("blank/s1.tif", &bytes).parent().unwrap(), &Hints::default()).grid().dims(), [4096, 4096, 1]);
}

#[test]
fn white_for_low_is_turned_everywhere() {
    // Fails if a picture's meaning depends on where its samples lie: in a page, in a folder of pages or behind one page.
    let folder = Folder::new("white");
    let all = all();
    let turned: Vec<f64> = expected().iter().map(|v| 65535.0 - v).collect();
    for name in ["TIFF", "TIFF slices", "TIFF with slices behind one page"] {
        let mut small = all.iter().find(|s| s.name == name).unwrap().clone();
        for (_, bytes) in &mut small.files {
            // PhotometricInterpretation, of one short number: 1 becomes 0.
            let big = bytes[0] == b'M';
            let entry: &[u8] = if big { &[1, 6, 0, 3, 0, 0, 0, 1, 0, 1] } else { &[6, 1, 3, 0, 1, 0, 0, 0, 1, 0] };
            let places: Vec<usize> = (0..bytes.len() - 10).filter(|&n| bytes[n..].starts_with(entry)).collect();
            assert!(!places.is_empty());
            places.iter().for_each(|&n| bytes[n + 8..n + 10].fill(0));
        }
        let volume = read(&small.write(&folder), &Hints::default());
        assert_eq!(samples_of(&volume).iter().map(|&s| volume.value_of(s)).collect::<Vec<_>>(), turned, "{name}");
        assert!(volume.warnings().iter().any(|w| w.contains("shown white")), "{name}: {:?}", volume.warnings());
    }
}

#[test]
fn gaps_are_refused_or_filled_aloud() {
    // Fails if a missing slice squeezes the scan, or interpolation is not what it says.
    let folder = Folder::new("dicom-gaps");
    let files = || (0..6).filter(|k| *k != 3).map(|k| (format!("IM{k}"), Dicom::slice(k).bytes())).collect::<Vec<_>>();
    let refused = dicom(&folder, "gap", files(), &Hints::default()).unwrap_err();
    assert!(refused.contains("most are 2 mm apart, but 4 mm between slices 3 and 4"), "{refused}");
    let hints = Hints { uneven: Uneven::Resample, ..Hints::default() };
    let filled = dicom(&folder, "gap", files(), &hints).unwrap();
    assert_eq!(filled.grid().dims(), [8, 6, 6]);
    let at = |k: usize| f64::from(sample(3, 2, k));
    assert_eq!(filled.samples().get_f64(3 * 48 + 2 * 8 + 3), ((at(2) + at(4)) / 2.0).round());
    assert_eq!(filled.samples().get_f64(4 * 48 + 2 * 8 + 3), at(4));
    assert!(filled.warnings()[0].contains("interpolated linearly to 6 slices 2 mm apart"), "{:?}", filled.warnings());
}

#[test]
fn a_tilted_gantry_stays_sheared() {
    // Fails if slices that are shifted along themselves are squared.
    let folder = Folder::new("dicom-tilt");
    let tilted = |k| Dicom::slice(k).with((0x20, 0x37), "DS", "1\\0\\0\\0\\0.9483237\\-0.3173047");
    let volume = dicom(&folder, "tilted", dicom_files(tilted), &Hints::default()).unwrap();
    assert!((volume.grid().index_to_world().matrix3.z_axis - DVec3::new(0.0, 0.0, 2.0)).length() < 1e-12);
    let j = volume.grid().direction().y_axis;
    assert!((j - DVec3::new(0.0, 0.9483237, -0.3173047)).length() < 1e-7 && volume.warnings().is_empty());
}

#[test]
fn an_unknown_spacing_is_said() {
    // Fails if a length could be shown in millimetres that nobody stated.
    let folder = Folder::new("spacing");
    for small in all() {
        let path = small.write(&folder);
        let stated = read(&path, &Hints::default()).spacing_is_stated();
        let states_none = ["NumPy", "PNG", "raw", "TIFF slices"].iter().any(|p| small.name.starts_with(p));
        assert_eq!(stated, !states_none, "{}", small.name);
        let hints = Hints { spacing_mm: Some(DVec3::new(1.0, 2.0, 3.0)), ..Hints::default() };
        let given = read(&path, &hints);
        assert!(given.spacing_is_stated(), "{}", small.name);
        assert!((given.grid().spacing_mm() - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12, "{}", small.name);
        let is_told =
            given.warnings().iter().any(|w| w.contains("its file states that samples are") && w.contains("1 × 2 × 3 mm is taken instead"));
        assert_eq!(is_told, !states_none, "{}: a stated spacing was overridden in silence: {:?}", small.name, given.warnings());
        assert_eq!(given.placing().overridden_mm().is_some(), !states_none);
    }
}

#[test]
fn a_spacing_that_a_header_leaves_out_is_unknown() {
    // Fails if VTI without Spacing, or GIPL of zeros, counts as a millimetre, or if the person's word is not taken.
    let folder = Folder::new("no-spacing");
    let vti = String::from_utf8(all().iter().find(|s| s.name == "VTI text").unwrap().files[0].1.clone()).unwrap();
    let mut zeros = gipl();
    zeros[10..22].fill(0);
    let files = [("a.vti", vti.replace(" Spacing=\"0.5 0.75 2\"", "").into_bytes()), ("a.gipl", zeros)];
    for (name, bytes) in files {
        let path = folder.put(name, &bytes);
        let unsaid = read(&path, &Hints::default());
        assert!(!unsaid.spacing_is_stated() && unsaid.warnings()[0].contains("states no spacing"), "{name}: {:?}", unsaid.warnings());
        let mm = DVec3::new(1.0, 2.0, 3.0);
        let said = read(&path, &Hints { spacing_mm: Some(mm), ..Hints::default() });
        assert!(said.spacing_is_stated() && said.grid().spacing_mm() == mm && said.warnings().len() == 1, "{name}");
    }
}

#[test]
fn forms_of_scanners_keep_their_own_samples() {
    // Fails if the types, units or runs that only these forms have are misread. Labels: 127 times 3, 5 times 9, then 0 to 59 as they are.
    let folder = Folder::new("scanners");
    let other = |name: &str| read(&others().iter().find(|s| s.name == name).unwrap().write(&folder), &Hints::default());
    let isq = other("ISQ");
    assert_eq!((isq.samples().type_name(), samples_of(&isq)), ("i16", expected()));
    assert!((isq.grid().spacing_mm() - DVec3::new(0.5, 0.75, 2.0)).length() < 1e-12 && isq.spacing_is_stated(), "{:?}", isq.grid());
    assert!(isq.metadata().is_empty(), "the person's name stays in the file: {:?}", isq.metadata());
    let mut scaled = small::isq();
    scaled[88..92].copy_from_slice(&4096_i32.to_le_bytes());
    let scaled = read(&folder.put("mu.isq", &scaled), &Hints::default());
    assert!(scaled.metadata()["MuScaling"].starts_with("4096 (sample / 4096 is"), "{:?}", scaled.metadata());
    // Drishti without the headers of slabs, with names of its own, and mapped.
    let bare = |k: usize| slab(k, k + 1)[13..].to_vec();
    let pvl = PVL
        .replace("<slabsize>3", "<pvlnames>x.raw y.raw z.raw w.raw</pvlnames><slabsize>1")
        .replace("<voxeltype>unsigned short", "<voxeltype>float");
    ["x.raw", "y.raw", "z.raw", "w.raw"].iter().enumerate().for_each(|(k, name)| drop(folder.put(name, &bare(k))));
    let drishti = read(&folder.put("m.pvl.nc", pvl.as_bytes()), &Hints::default());
    assert_eq!((samples_of(&drishti), drishti.metadata()["rawmap"].as_str()), (expected(), "0 65535"));
    assert!(drishti.warnings().iter().any(|w| w.contains("those that Drishti draws")), "{:?}", drishti.warnings());
    let pcr = other("VOL by PCR");
    assert_eq!((pcr.samples().type_name(), samples_of(&pcr), pcr.grid().spacing_mm()), ("u16", expected(), DVec3::splat(0.045)));
    let runs: Vec<f64> = [vec![3.0; 127], vec![9.0; 5], (0..60).map(f64::from).collect()].concat();
    assert_eq!(samples_of(&other("Amira by runs")), runs);
    // A letter that is no ASCII before the samples moves none of them.
    let mut latin = all().iter().find(|s| s.name == "Amira").unwrap().files[0].1.clone();
    let at = latin.windows(5).position(|w| w == b"Units").unwrap();
    latin.splice(at..at, b"Sch\xe4del \xb5\n    ".iter().copied());
    assert_eq!(samples_of(&read(&folder.put("latin.am", &latin), &Hints::default())), expected());
    // Floats, as PCR and VTK have them, and units as VGI states them.
    let floats: Vec<u8> = expected().iter().flat_map(|v| ((*v as f32) / 8.0).to_be_bytes()).collect();
    let vtk = read(&folder.put("f.vtk", &vtk("BINARY", "float", &floats)), &Hints::default());
    assert_eq!((vtk.samples().type_name(), vtk.samples().get_f64(1) * 8.0), ("f32", expected()[1]));
    let little: Vec<u8> = floats.as_chunks::<4>().0.iter().flat_map(|b| [b[3], b[2], b[1], b[0]]).collect();
    folder.put("f.vol", &little);
    let pcr = read(&folder.put("f.pcr", PCR.replace("Format=5", "Format=10").as_bytes()), &Hints::default());
    assert_eq!((pcr.samples().type_name(), pcr.samples().get_f64(1) * 8.0), ("f32", expected()[1]));
    folder.put("s.vol", &samples(false));
    let vgi = read(&folder.put("s.vgi", VGI.replace("unit = mm", "unit = microns").as_bytes()), &Hints::default());
    assert!((vgi.grid().spacing_mm() - DVec3::from(SPACING_MM) * 1e-3).length() < 1e-12, "{:?}", vgi.grid());
}

#[test]
fn files_come_in_folders_lists_and_with_more_behind() {
    // Fails if a disc's list, a folder above the folder, zeros behind a gzip, a sign of a size or a form of zeros keeps a sound scan from opening.
    let folder = Folder::new("wrapped");
    let files = dicom_files(Dicom::slice);
    let mut list = Dicom::slice(0).with((0x4, 0x1130), "CS", "DISC").without((0x7fe0, 0x10));
    list.elements.retain(|tag, _| tag.0 < 8);
    folder.put("disc/DICOMDIR", &list.bytes());
    files.iter().for_each(|(name, bytes)| drop(folder.put(&format!("disc/A/{name}"), bytes)));
    assert_eq!(samples_of(&read(&folder.0.join("disc/DICOMDIR"), &Hints::default())), expected());
    let png = all().iter().find(|s| s.name == "PNG").unwrap().clone();
    png.files.iter().for_each(|(name, bytes)| drop(folder.put(&format!("above/one/{name}"), bytes)));
    folder.put("above/readme.txt", b"text");
    assert_eq!(samples_of(&read(&folder.0.join("above"), &Hints::default())), expected());
    folder.put("above/two/s1.png", &png.files[0].1);
    let both = error(&folder.0.join("above"), &Hints::default());
    assert!(both.contains("2 of its folders hold scans, from one to two"), "{both}");
    // A gzip in two members, zeros behind it; one that is damaged still is.
    let plain = [nifti(b"n+1\0", 352.0), samples(false)].concat();
    let members = [gzip(&plain[..500]), gzip(&plain[500..]), vec![0; 700]].concat();
    assert_eq!(samples_of(&read(&folder.put("z.nii.gz", &members), &Hints::default())), expected());
    let mut wrong = members.clone();
    let at = wrong.len() - 706;
    wrong[at] ^= 1;
    assert!(error(&folder.put("w.nii.gz", &wrong), &Hints::default()).contains("checksum"));
    // Signs and zeros in NIfTI: the qform is that of spacings alone, mirrored by its sign.
    let mut signs = plain.clone();
    signs[280..328].fill(0);
    signs[252..254].copy_from_slice(&1_i16.to_le_bytes());
    signs[80..84].copy_from_slice(&(-0.5_f32).to_le_bytes());
    for (sform, warnings) in [(1_i16, 1), (0, 0)] {
        signs[254..256].copy_from_slice(&sform.to_le_bytes());
        let volume = read(&folder.put("s.nii", &signs), &Hints::default());
        assert_eq!((volume.grid().spacing_mm(), samples_of(&volume), volume.warnings().len()), (SPACING_MM.into(), expected(), warnings));
    }
    // Neither form is stated, or only one of zeros: the spacings are left, aloud.
    signs[252..254].fill(0);
    for (sform, warnings) in [(1_i16, 2), (0, 1)] {
        signs[254..256].copy_from_slice(&sform.to_le_bytes());
        let volume = read(&folder.put("n.nii", &signs), &Hints::default());
        assert_eq!((volume.grid().spacing_mm(), samples_of(&volume), volume.warnings().len()), (SPACING_MM.into(), expected(), warnings));
    }
    let analyze = all().iter().find(|s| s.name == "Analyze").unwrap().clone();
    let mut files = analyze.files.clone();
    files[0].1[84..88].copy_from_slice(&(-0.75_f32).to_le_bytes());
    assert_eq!(read(&Small { files, ..analyze }.write(&folder), &Hints::default()).grid().spacing_mm(), DVec3::from(SPACING_MM));
    // A NRRD in microns, as ITK and ANTs write it.
    let microns = nrrd("encoding: raw\nspace units: \"microns\" \"microns\" \"microns\"", &samples(false));
    let volume = read(&folder.put("m.nrrd", &microns), &Hints::default());
    assert!((volume.grid().spacing_mm() - DVec3::from(SPACING_MM) * 1e-3).length() < 1e-12 && volume.warnings().is_empty());
}

#[test]
fn what_is_read_side_by_side_is_where_it_belongs() {
    // Fails if a piece of a file, or a file of several, is read to another's place, or in another byte order. Each sample is its own number, and
    // the pieces that are read at a time have 4 MiB.
    let folder = Folder::new("side-by-side");
    let dims = [256, 256, 96];
    let count: usize = dims.iter().product();
    let value = |n: usize| (n % 65521) as u16;
    let bytes: Vec<u8> = (0..count).flat_map(|n| value(n).to_be_bytes()).collect();
    folder.put("a.raw", &[vec![7; 11], bytes[..bytes.len() / 2].to_vec()].concat());
    folder.put("b.raw", &[vec![7; 11], bytes[bytes.len() / 2..].to_vec(), vec![9]].concat());
    let header = "NRRD0004\ntype: ushort\ndimension: 3\nsizes: 256 256 96\nspacings: 1 1 1\nendian: big\nencoding: raw\nbyte skip: 11\ndata file: LIST 3\na.raw\nb.raw";
    let volume = read(&folder.put("l.nhdr", header.as_bytes()), &Hints::default());
    assert!((0..count).all(|n| volume.samples().get_f64(n) == f64::from(value(n))));
    assert!(volume.warnings().iter().any(|w| w.contains("goes on after the samples")), "{:?}", volume.warnings());
    folder.put("b.raw", &bytes[bytes.len() / 2..]);
    assert!(error(&folder.0.join("l.nhdr"), &Hints::default()).contains("b.raw: it ends too early"));
}

#[cfg(unix)]
#[test]
fn what_cannot_fit_is_refused_before_it_is_read() {
    // Fails if a scan larger than memory is begun, or if no smaller preview is offered where one fits.
    let folder = Folder::new("memory");
    let disk = std::env::temp_dir().join(format!("bregma-huge-{}.raw", std::process::id()));
    // A file of 16 TiB less a little that takes no room on the disk.
    let file = std::fs::File::create(&disk).unwrap();
    let edge = 20_000_u64;
    if file.set_len(edge * edge * edge).is_err() {
        println!("skipped: the disk of the temporary folder holds no file of 8 TB");
        return;
    }
    let hints = Hints { raw: Some("20000x20000x20000,u8".parse().unwrap()), ..Hints::default() };
    let started = std::time::Instant::now();
    let refused = error(&disk, &hints);
    let seconds = started.elapsed().as_secs_f64();
    std::fs::remove_file(&disk).unwrap();
    drop(folder);
    println!("{refused}\n  after {seconds:.3} s");
    assert!(refused.contains("opening it needs 8195.6 GiB of memory") && seconds < 1.0, "{refused}");
}

#[test]
fn reading_stops_when_asked() {
    // Fails if a cancelled reading goes on, or is reported as a fault of the file.
    let folder = Folder::new("cancel");
    let stopped = Progress::default();
    stopped.cancel();
    for small in all() {
        let path = small.write(&folder);
        let error = open(&path, &Hints::default(), &stopped).unwrap_err();
        assert!(matches!(error.reason, formats::ReadError::Cancelled(_)), "{}: {error}", small.name);
    }
    // What is only looked for stops, too: a form for a folder of texts, a project's list.
    let mut tar = tar::Builder::new(vec![]);
    tar.append_data(&mut tar::Header::new_gnu(), "tmp/other", &b""[..]).unwrap();
    folder.put("texts/a.txt", b"text");
    for path in [folder.0.join("texts"), folder.put("p.inv3", &tar.into_inner().unwrap())] {
        let error = scan(&path, &Hints::default(), &stopped).map(drop).unwrap_err();
        assert!(matches!(error.reason, formats::ReadError::Cancelled(_)), "{error}");
        assert!(!matches!(
            scan(&path, &Hints::default(), &Progress::default()).map(drop).unwrap_err().reason,
            formats::ReadError::Cancelled(_)
        ));
    }
}
