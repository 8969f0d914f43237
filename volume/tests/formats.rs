//! Every form that a scan comes in, on small files of known samples: what is read, what is written, what DICOM says about geometry.
//! Fails if a reader or writer changes a sample, a place, a unit or a type, or if something unusual passes in silence.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::formats::{self, Hints, Reduce, Uneven, open, scan, write};
use bregma_volume::{Grid, Progress, Raster, Samples, Unit, Volume};
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
        let placeless = ["NumPy", "TIFF", "BigTIFF", "InVesalius", "PNG", "raw", "Analyze", "VH"].iter().any(|p| small.name.starts_with(p));
        let origin = if placeless { DVec3::ZERO } else { DVec3::new(-10.0, 20.0, 30.0) };
        assert!((volume.grid().origin_mm() - origin).length() < 1e-9, "{}: {:?}", small.name, volume.grid());
        let to_the_front = ["InVesalius", "Analyze"].iter().any(|p| small.name.starts_with(p));
        let signs = DVec3::new(1.0, if to_the_front { -1.0 } else { 1.0 }, 1.0);
        assert_eq!(volume.grid().direction(), DMat3::from_diagonal(signs), "{}", small.name);
        assert_eq!(
            volume.warnings().is_empty(),
            !placeless && !["VTI", "GIPL"].iter().any(|p| small.name.starts_with(p)),
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
        assert_eq!(survey.sample_bytes, volume.samples().bytes() as u64);
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
    assert!(wrong.contains("m.doc: end the name in .nrrd"), "{wrong}");
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
    // White for low.
    let inverted = |k| Dicom::slice(k).with((0x28, 0x4), "CS", "MONOCHROME1").with((0x8, 0x60), "CS", "DX");
    let inverted = dicom(&folder, "inverted", dicom_files(inverted), &none).unwrap();
    assert!(inverted.slope() < 0.0 && inverted.warnings()[0].contains("MONOCHROME1"));
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
    let error = one("jls", "jpeg-ls", JPEG_LS, false).unwrap_err();
    assert!(error.contains("JPEG-LS") && error.contains("1.2.840.10008.1.2.4.80") && error.contains("gdcmconv"), "{error}");
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
        assert_eq!(given.grid().spacing_mm() == DVec3::new(1.0, 2.0, 3.0), states_none, "{}: a stated spacing was overridden", small.name);
    }
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
}
