//! DICOM as scanners, archives and exporters really write it: what differs from the book, or from slice to slice, changes no value.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::formats::{self, Hints, open};
use bregma_volume::{Progress, ReadSamples, Volume};
use glam::DVec3;
use small::same::*;
use small::*;

#[test]
fn unknown_types_are_known_by_their_tags() {
    // Fails if an attribute of VR UN counts as not there, be it a number, a text or the sequences of an enhanced file.
    let folder = Folder::new("kinds-un");
    let unknown = |k| rewritten(k, EXPLICIT, |tag, vr, value| element(tag, if tag.0 >= 0x7fe0 { vr } else { "UN" }, value, true, false));
    is_the_scan("all of UN", read_all(&folder, "un", files(unknown)));
    // Functional groups of UN: what is within has no types then (CP-246). Of stated length, and of undefined length.
    for undefined in [false, true] {
        let group = |tag: (u16, u16), items: &[Vec<u8>]| -> Vec<u8> {
            let items: Vec<u8> =
                items.iter().flat_map(|i| [&[0xfe, 0xff, 0x00, 0xe0][..], &(i.len() as u32).to_le_bytes(), i].concat()).collect();
            let mut out = element(tag, "UN", &items, false, false);
            if undefined {
                out[4..8].copy_from_slice(&u32::MAX.to_le_bytes());
                out.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
            }
            out
        };
        let text = |tag, text: String| element(tag, "DS", text.as_bytes(), false, false);
        let shared = [
            group((0x20, 0x9116), &[text((0x20, 0x37), "1\\0\\0\\0\\1\\0".into())]),
            group((0x28, 0x9110), &[text((0x28, 0x30), "0.75\\0.5".into())]),
            group((0x28, 0x9145), &[[text((0x28, 0x1052), "-1024".into()), text((0x28, 0x1053), "1".into())].concat()]),
        ];
        let frames: Vec<Vec<u8>> =
            (0..4).map(|k| group((0x20, 0x9113), &[text((0x20, 0x32), format!("-10\\20\\{}", 30 + 2 * k))])).collect();
        let mut dicom = enhanced();
        let of = |items: &[Vec<u8>]| group((0, 0), items)[8..].to_vec();
        dicom.elements.insert((0x5200, 0x9229), ("UN", of(&[shared.concat()])));
        dicom.elements.insert((0x5200, 0x9230), ("UN", of(&frames)));
        let mut bytes = dicom.bytes();
        if undefined {
            for element in [0x29, 0x30] {
                let at = bytes.windows(4).position(|w| w == [0x00, 0x52, element, 0x92]).unwrap();
                bytes[at + 8..at + 12].copy_from_slice(&u32::MAX.to_le_bytes());
            }
        }
        is_the_scan("functional groups of UN", read_all(&folder, "enhanced", vec![("IM".into(), bytes)]));
    }
}

#[test]
fn private_sequences_of_undefined_length_are_passed_over() {
    // Fails if UN of undefined length ends the reading, or if what is within it, nested or not, is taken for the image's own.
    let folder = Folder::new("kinds-private");
    let item = |content: &[u8], ended: bool| match ended {
        true => [&[0xfe, 0xff, 0x00, 0xe0, 0xff, 0xff, 0xff, 0xff][..], content, &[0xfe, 0xff, 0x0d, 0xe0, 0, 0, 0, 0]].concat(),
        false => [&[0xfe, 0xff, 0x00, 0xe0][..], &(content.len() as u32).to_le_bytes(), content].concat(),
    };
    for (ended, typed) in [(false, false), (true, false), (true, true)] {
        let rows = element((0x28, 0x10), "US", &[9, 0], typed, false);
        let nested = [
            if typed { vec![0x11, 0, 2, 0x10, b'U', b'N', 0, 0, 255, 255, 255, 255] } else { vec![0x11, 0, 2, 0x10, 255, 255, 255, 255] },
            item(&rows, ended),
            vec![0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0],
        ]
        .concat();
        let private = [
            vec![0x11, 0, 1, 0x10, b'U', b'N', 0, 0, 255, 255, 255, 255],
            item(&[rows, nested].concat(), ended),
            vec![0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0],
        ]
        .concat();
        let make = |k| {
            rewritten(k, EXPLICIT, |tag, vr, value| {
                let own = element(tag, vr, value, true, false);
                if tag == (0x18, 0x50) { [private.clone(), own].concat() } else { own }
            })
        };
        is_the_scan("a private sequence", read_all(&folder, "private", files(make)));
    }
}

#[test]
fn what_is_written_counts_and_not_what_is_said() {
    // Fails if files that say explicit and write implicit, or the reverse, or that have no preamble, are damaged or no DICOM.
    let folder = Folder::new("kinds-said");
    for (said, written) in [(EXPLICIT, false), (IMPLICIT, true), (EXPLICIT, true), (IMPLICIT, false)] {
        let make = |k| rewritten(k, said, |tag, vr, value| element(tag, vr, value, written, false));
        is_the_scan(&format!("says {said}"), read_all(&folder, "said", files(make)));
    }
    // From the first elements that files begin with: image type, SOP class, modality.
    for first in [(0x8, 0x8), (0x8, 0x16), (0x8, 0x5)] {
        for written in [false, true] {
            let make = |k| -> Vec<u8> {
                let slice = Dicom::slice(k).with(first, "UI", "1.2.840.10008.5.1.4.1.1.2");
                let own = slice.elements.iter().filter(|(tag, _)| **tag >= first);
                own.flat_map(|(tag, (vr, value))| element(*tag, vr, value, written, false)).collect()
            };
            is_the_scan(&format!("without preamble from {first:x?}"), read_all(&folder, "bare", files(make)));
        }
    }
    // An element without a type among others that have one.
    let mixed = |k| rewritten(k, EXPLICIT, |tag, vr, value| element(tag, vr, value, tag != (0x18, 0x50), false));
    is_the_scan("one element without a type", read_all(&folder, "mixed", files(mixed)));
}

#[test]
fn decimal_commas_are_points() {
    // Fails if numbers with commas count as not stated, which makes 1 mm of 0.5 and 1.5 mm of 2.
    let folder = Folder::new("kinds-commas");
    let comma = |k| {
        let fine = Dicom::slice(k).with((0x20, 0x32), "DS", &format!("-10,0\\20,0\\{},00", 30 + 2 * k));
        fine.with((0x28, 0x30), "DS", "0,75\\0,5").with((0x28, 0x1052), "DS", "-1024,0").with((0x28, 0x1053), "DS", "1,0").bytes()
    };
    is_the_scan("commas", read_all(&folder, "commas", files(comma)));
}

#[test]
fn storage_may_differ_from_slice_to_slice() {
    // Fails if slices are left out because they are stored in other bits, with another sign, size or scale, or if their values change.
    let folder = Folder::new("kinds-storage");
    let bits = |dicom: &mut Dicom, stored: u16, signed: u16| {
        [(0x101, stored), (0x102, stored - 1), (0x103, signed)].into_iter().for_each(|(e, v)| dicom.number((0x28, e), v));
    };
    let shifted = |dicom: &mut Dicom, by: i32| {
        let (_, pixels) = dicom.elements.get_mut(&(0x7fe0, 0x10)).unwrap();
        let move_one = |b: &[u8]| ((i32::from(u16::from_le_bytes([b[0], b[1]])) + by) as u16).to_le_bytes();
        *pixels = pixels.chunks(2).flat_map(move_one).collect();
    };
    let make = |k: usize| {
        let mut dicom = Dicom::slice(k);
        bits(&mut dicom, [16, 12, 15, 13][k], 0);
        dicom.bytes()
    };
    let volume = is_the_scan("bits stored", read_all(&folder, "bits", files(make)));
    assert_eq!((volume.samples().type_name(), volume.warnings().len()), ("u16", 0), "{:?}", volume.warnings());
    // The sign alone: the type that holds all.
    let make = |k: usize| {
        let mut dicom = Dicom::slice(k);
        bits(&mut dicom, 16, (k % 2) as u16);
        dicom.bytes()
    };
    let volume = is_the_scan("sign", read_all(&folder, "sign", files(make)));
    assert_eq!((volume.samples().type_name(), volume.warnings().len()), ("i16", 0), "{:?}", volume.warnings());
    // Sign and intercept.
    let make = |k: usize| {
        let mut dicom = Dicom::slice(k);
        bits(&mut dicom, 16, (k % 2) as u16);
        if k % 2 == 1 {
            shifted(&mut dicom, -1024);
            dicom = dicom.with((0x28, 0x1052), "DS", "0");
        }
        dicom.bytes()
    };
    let volume = is_the_scan("sign and intercept", read_all(&folder, "both", files(make)));
    assert!(volume.warnings()[0].contains("scales of their own"), "{:?}", volume.warnings());
    // Bits allocated: every second slice in 32 bits.
    let make = |k: usize| {
        let mut dicom = Dicom::slice(k);
        if k % 2 == 1 {
            [(0x100, 32), (0x101, 32), (0x102, 31)].into_iter().for_each(|(e, v)| dicom.number((0x28, e), v));
            let (_, pixels) = dicom.elements.get_mut(&(0x7fe0, 0x10)).unwrap();
            *pixels = pixels.chunks(2).flat_map(|b| [b[0], b[1], 0, 0]).collect();
        }
        dicom.bytes()
    };
    assert_eq!(is_the_scan("bits allocated", read_all(&folder, "wide", files(make))).samples().type_name(), "i16");
}

#[test]
fn scans_under_one_series_are_never_mixed() {
    // Fails if slices of two kernels, acquisitions, times or kinds become one stack, or if they cannot be asked for.
    let folder = Folder::new("kinds-apart");
    let second = |k: usize| {
        let mut dicom = Dicom::slice(k);
        let (_, pixels) = dicom.elements.get_mut(&(0x7fe0, 0x10)).unwrap();
        *pixels = pixels.chunks(2).flat_map(|b| (u16::from_le_bytes([b[0], b[1]]) ^ 1).to_le_bytes()).collect();
        dicom
    };
    let other: Vec<f64> = hu().iter().map(|v| f64::from((v + 1024.0) as u16 ^ 1) - 1024.0).collect();
    for (tag, vr, a, b, word) in [
        ((0x18, 0x1210), "SH", "H30s", "H60s", "kernel H60s"),
        ((0x20, 0x12), "IS", "1", "2", "acquisition 2"),
        ((0x20, 0x100), "IS", "1", "2", "temporal position 2"),
        ((0x8, 0x8), "CS", "ORIGINAL\\PRIMARY\\AXIAL", "DERIVED\\SECONDARY\\AXIAL", "image type DERIVED"),
        ((0x8, 0x32), "TM", "101500", "101800.5", "acquisition time 101800.5"),
        ((0x18, 0x60), "DS", "80", "140", "kV 140"),
    ] {
        // Names take turns, numbers begin anew, and the second of them skips the first slice.
        let mut files: Vec<(String, Vec<u8>)> =
            (0..4).map(|k| (format!("IM{}", 2 * k), Dicom::slice(k).with(tag, vr, a).bytes())).collect();
        files.extend((0..4).map(|k| (format!("IM{}", 2 * k + 1), second(k).with(tag, vr, b).bytes())));
        let _ = std::fs::remove_dir_all(folder.0.join("two"));
        let path = Small { name: "two", files, open: "" }.write(&folder);
        let listed = formats::series(&path, &Progress::default()).unwrap();
        assert_eq!(listed.iter().map(|s| (s.key.as_str(), s.images)).collect::<Vec<_>>(), [("7.1", 4), ("7.2", 4)], "{word}");
        let said = listed.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        assert!(said.contains(word), "{said}");
        let mut seen = vec![];
        for series in &listed {
            let one = open(&path.with_file_name(format!("two#{}", series.key)), &Hints::default(), &Progress::default()).unwrap();
            seen.push(values(&one));
        }
        assert!(seen == [hu(), other.clone()] || seen == [other.clone(), hu()], "{word}");
        let own = open(&path.join("IM1"), &Hints::default(), &Progress::default()).unwrap();
        assert_eq!(values(&own), other, "{word}: one of its files names its scan");
        assert!(own.warnings().iter().any(|w| w.contains("2 scans")), "{:?}", own.warnings());
    }
    // Kernels that lie between each other are two scans, though no place is taken twice.
    let between =
        |k: usize| Dicom::slice(k).with((0x20, 0x32), "DS", &format!("-10\\20\\{}", 31 + 2 * k)).with((0x18, 0x1210), "SH", "H60s");
    let mut files: Vec<(String, Vec<u8>)> =
        (0..4).map(|k| (format!("A{k}"), Dicom::slice(k).with((0x18, 0x1210), "SH", "H30s").bytes())).collect();
    files.extend((0..3).map(|k| (format!("B{k}"), between(k).bytes())));
    is_the_scan("kernels between each other", read_all(&folder, "between", files));
    // So are acquisitions.
    let half = |k: usize| Dicom::slice(k).with((0x20, 0x32), "DS", &format!("-10\\20\\{}", 31 + 2 * k)).with((0x20, 0x12), "IS", "2");
    let mut files: Vec<(String, Vec<u8>)> =
        (0..4).map(|k| (format!("A{k}"), Dicom::slice(k).with((0x20, 0x12), "IS", "1").bytes())).collect();
    files.extend((0..3).map(|k| (format!("B{k}"), half(k).bytes())));
    is_the_scan("acquisitions between each other", read_all(&folder, "half", files));
    // A number of its own for each slice tells nothing.
    let each = |k: usize| Dicom::slice(k).with((0x20, 0x12), "IS", &k.to_string()).bytes();
    is_the_scan("acquisitions of one slice", read_all(&folder, "each", (0..4).map(|k| (format!("A{k}"), each(k))).collect()));
    // Two acquisitions that follow each other and share a slice are one scan.
    let mut files: Vec<(String, Vec<u8>)> =
        (0..4).map(|k| (format!("A{k}"), Dicom::slice(k).with((0x20, 0x12), "IS", if k < 2 { "1" } else { "2" }).bytes())).collect();
    files.push(("A9".into(), Dicom::slice(1).with((0x20, 0x12), "IS", "2").bytes()));
    is_the_scan("two ranges", read_all(&folder, "ranges", files));
}

#[test]
fn frames_of_old_classes_lie_where_they_say() {
    // Fails if a file of many frames is read as one slice, if frames that follow in time are stacked, or if what is assumed goes unsaid.
    let folder = Folder::new("kinds-frames");
    let many = || {
        let mut dicom = Dicom::slice(0).with((0x28, 0x8), "IS", "4");
        dicom.elements.insert((0x7fe0, 0x10), ("OW", samples(false)));
        dicom
    };
    let one = |dicom: Dicom| read_all(&folder, "frames", vec![("IM".into(), dicom.bytes())]);
    let thick = is_the_scan("thickness", one(many().with((0x18, 0x50), "DS", "2")));
    assert!(thick.warnings()[0].contains("its 4 frames have one position; they are taken to be 2 mm apart, which is its SliceThickness"));
    let apart = is_the_scan("spacing between slices", one(many().with((0x18, 0x88), "DS", "2")));
    assert!(apart.warnings()[0].contains("SpacingBetweenSlices"), "{:?}", apart.warnings());
    let stated = is_the_scan("offsets", one(many().with((0x3004, 0xc), "DS", "0\\2\\4\\6")));
    assert!(stated.warnings().is_empty(), "{:?}", stated.warnings());
    // Frames in the order of their offsets, not of the file.
    let fallen = one(many().with((0x3004, 0xc), "DS", "0\\-2\\-4\\-6")).unwrap();
    assert_eq!((fallen.grid().origin_mm().z, values(&fallen)[..48].to_vec()), (24.0, hu()[144..].to_vec()));
    // Secondary captures without any position.
    let bare = many().without((0x20, 0x32)).without((0x20, 0x37)).without((0x28, 0x30)).with((0x18, 0x2010), "DS", "0.75\\0.5");
    let bare = one(bare.with((0x18, 0x50), "DS", "2")).unwrap();
    assert_eq!((bare.grid().spacing_mm(), values(&bare)), (DVec3::from(SPACING_MM), hu()));
    assert!(bare.warnings()[0].contains("have no position"), "{:?}", bare.warnings());
    // A movie.
    let movie = one(many().with((0x18, 0x1063), "DS", "33")).unwrap();
    assert_eq!(movie.grid().dims(), [8, 6, 1]);
    assert!(movie.warnings()[0].contains("3 of its images do not state where they lie"), "{:?}", movie.warnings());
}

/// Bytes of hexadecimal text.
fn hex(text: &str) -> Vec<u8> {
    (0..text.len()).step_by(2).map(|n| u8::from_str_radix(&text[n..n + 2], 16).unwrap()).collect()
}

#[test]
fn loss_does_not_wrap() {
    // Fails if a sample that loss pushes beyond the end of its bits comes out at their other end, which makes bone of air. The picture is of the
    // lowest and highest samples alone (a bit of CHECKER each), so that anything wrapped is wrong by the whole range. Packed by OpenJPEG 2.5.4.
    const CHECKER: &str = "7324cf908a41d6945738767f37b07cad63f86e5d4ecc26aa99cd4ec0b6065e20";
    const UNSIGNED: &str = "ff4fff5100290000000000100000001000000000000000000000001000000010000000000000000000010b0101ff52000e010200010001040400008888ff5c000b42682477d377d37762ff640025000143726561746564206279204f70656e4a5045472076657273696f6e20322e352e34ff90000a0000000000950001ff93df121015f740fdfb99d2a58599ca1111fe02c289eacc4a45ec7b8863fc1e48bf3a19da5ccf890cf85a9f1200195a923b761b200cfc8a5de21745aea9d6bfc020db31a8ae4712d6e482d8344bfa1eedb10d2db32d6ce87ee453a7f14ce8f5de1e1342d3e47c52f028b32c71356eb6f2f562a2555390692fbf580a8f1b538a28586bdf4d29f91cbdffd9";
    const WIDE: &str = "ff4fff5100290000000000100000001000000000000000000000001000000010000000000000000000010f0101ff52000e010200010001040400008888ff5c000b42882497d397d39762ff640025000143726561746564206279204f70656e4a5045472076657273696f6e20322e352e34ff90000a0000000000ae0001ff93cfb0b4115054af4640ba141b392f1201a9aec1f1143bf0bd2afd150d6365222d865c59bc98fa3127260ca252c784df88c0f890c0f88f40f95380195a923b761b200cfc8a5de21745aea9d6bfc020db31a8ae4712d6e482d8344bfa1eedb10d2db32d6ce87ee453a7f14ce8f5de1e1342d3e47c52f022c0331028b32c71356eb6f2f562a2555390692fbf580a8f1b538a28586bdf4d29f91cbd75ef2d30f1abbdffd9";
    let folder = Folder::new("kinds-loss");
    let high: Vec<bool> = hex(CHECKER).iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1 == 1)).collect();
    // The same codestream with signed samples differs in the top bit of Ssiz alone.
    let signed = UNSIGNED.replacen("010b0101ff52", "018b0101ff52", 1);
    for (what, packed, sign, slope) in [
        ("unsigned", UNSIGNED, 0, "1"),
        ("of another slope", UNSIGNED, 0, "-2.5"),
        ("signed", signed.as_str(), 1, "1"),
        ("of 12 bits in 16", WIDE, 0, "1"),
    ] {
        let mut slice = Dicom::slice(0).packed("1.2.840.10008.1.2.4.91", vec![hex(packed)]).with((0x28, 0x1053), "DS", slope);
        [(0x10, 16), (0x11, 16), (0x103, sign)].into_iter().for_each(|(e, v)| slice.number((0x28, e), v));
        let volume = read_all(&folder, "loss", vec![("IM".into(), slice.bytes())]).unwrap();
        let [low, top] = if sign == 1 { [-2048.0, 2047.0] } else { [0.0, 4095.0] };
        for (n, high) in high.iter().enumerate() {
            let (sample, want) = (volume.samples().get_f64(n), if *high { top } else { low });
            assert!((sample - want).abs() < 900.0 && (low..=top).contains(&sample), "{what}: sample {n} is {sample}, not {want}");
        }
        assert_eq!(volume.slope().to_string(), slope, "{what}");
    }
}

#[test]
fn a_jpeg_that_is_not_read_is_named_and_not_damaged() {
    // Fails if JPEG of 12 bits with loss, which is sound, is called damaged.
    let folder = Folder::new("kinds-jpeg-12");
    let frame = hex("ffd8ffc1000b0c000600080101 1100".replace(' ', "").as_str());
    let slice = Dicom::slice(0).packed("1.2.840.10008.1.2.4.51", vec![frame]);
    let error = read_all(&folder, "twelve", vec![("IM".into(), slice.bytes())]).unwrap_err();
    assert!(error.contains("JPEG with loss of 12 bits, which is not read here") && !error.contains("damaged"), "{error}");
}

#[test]
fn how_far_slices_are_off_is_kept_with_the_scan() {
    // Fails if the ± of lengths across slices does not learn of slices that jitter, or forgets it when the scan is converted.
    let folder = Folder::new("kinds-jitter");
    let at = |k: usize| ["30", "32.1", "33.8", "36"][k];
    let moved = |k: usize| Dicom::slice(k).with((0x20, 0x32), "DS", &format!("-10\\20\\{}", at(k))).bytes();
    let volume = read_all(&folder, "jitter", files(moved)).unwrap();
    assert!(volume.warnings().iter().any(|w| w.contains("not quite even")), "{:?}", volume.warnings());
    assert!((volume.slice_position_mm() - 0.2).abs() < 1e-6, "{}", volume.slice_position_mm());
    for form in ["a.nrrd", "a.nii.gz", "a.mha", "a.tif"] {
        let path = folder.0.join(form);
        formats::write(&path, &volume, &Progress::default()).unwrap();
        let back = open(&path, &Hints::default(), &Progress::default()).unwrap();
        assert_eq!(back.slice_position_mm(), volume.slice_position_mm(), "{form}");
    }
    let even = is_the_scan("even", read_all(&folder, "even", files(|k| Dicom::slice(k).bytes())));
    assert_eq!(even.slice_position_mm(), 0.0);
}

#[test]
fn slices_without_places_are_put_in_order_by_what_they_state() {
    // Fails if a stack whose files do not say where they lie is refused, shuffled, or given a distance that nothing states; or if pictures that
    // are no stack become one.
    let folder = Folder::new("kinds-placeless");
    let order = |volume: &Volume| {
        let [nx, ny, nz] = volume.grid().dims();
        (0..nz)
            .map(|k| (0..DIMS[2]).find(|&s| f64::from(sample(1, 0, s)) == volume.samples().get_f64(k * nx * ny + 1)).unwrap())
            .collect::<Vec<_>>()
    };
    let bare = |k: usize| Dicom::slice(k).without((0x20, 0x32)).without((0x20, 0x37));
    let location = |k: usize, mm: f64| bare(k).with((0x20, 0x1041), "DS", &mm.to_string());
    let back = |k: usize| (DIMS[2] - k) as f64;
    for (what, files, want, mm) in [
        ("by location", dicom_files(|k| location(k, 7.0 + 0.8 * k as f64)), [0, 1, 2, 3], 0.8),
        // Numbers restart or run the other way: the location knows.
        ("by location, numbered back", dicom_files(|k| location(k, 0.8 * back(k))), [3, 2, 1, 0], 0.8),
        ("by number, thick", dicom_files(bare), [0, 1, 2, 3], 1.5),
        ("by number, apart", dicom_files(|k| bare(k).with((0x18, 0x88), "DS", "0.7")), [0, 1, 2, 3], 0.7),
        ("by number, location 0", dicom_files(|k| location(k, 0.0)), [0, 1, 2, 3], 1.5),
        ("by every second number", dicom_files(|k| bare(k).with((0x20, 0x13), "IS", &(2 * k + 1).to_string())), [0, 1, 2, 3], 1.5),
        ("by number, back", dicom_files(|k| bare(k).with((0x20, 0x13), "IS", &back(k).to_string())), [3, 2, 1, 0], 1.5),
        ("without directions", dicom_files(|k| Dicom::slice(k).without((0x20, 0x37))), [0, 1, 2, 3], 2.0),
    ] {
        let volume = read_all(&folder, "placeless", files).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(order(&volume), want, "{what}");
        assert!((volume.grid().spacing_mm().z - mm).abs() < 1e-9, "{what}: {:?}", volume.grid().spacing_mm());
        assert!(volume.warnings().iter().any(|w| w.contains("its images do not state")), "{what}: {:?}", volume.warnings());
    }
    // The third of four is missing; two views of a chest; two kernels.
    let gone = [0, 1, 3].map(|k| (format!("IM{k}"), bare(k).bytes())).to_vec();
    assert!(read_all(&folder, "placeless", gone).unwrap_err().contains("not even"));
    let views: Vec<_> = (0..2).map(|k| (format!("IM{k}"), bare(k).without((0x18, 0x50)).bytes())).collect();
    assert!(read_all(&folder, "placeless", views).unwrap_err().contains("do not state where they lie"));
    let two = |k: usize, kernel: &str| location(k, k as f64).with((0x18, 0x1210), "SH", kernel);
    let files = (0..8).map(|n| (format!("IM{n}"), two(n / 2, if n % 2 == 0 { "H30s" } else { "H60s" }).bytes())).collect();
    let volume = read_all(&folder, "placeless", files).unwrap();
    assert_eq!((volume.grid().dims()[2], volume.metadata()["ConvolutionKernel"].as_str()), (4, "H30s"));
}
