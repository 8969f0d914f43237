//! DICOM series as a person may bring them, with something in them that does not belong there or is not as it should be. What is right is what the
//! standard says (PS3.3 is DICOM's part 3), and is told at each.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::formats::{self, Hints, open};
use bregma_volume::{Progress, ReadSamples, Volume};
use glam::DVec3;
use small::same::*;
use small::*;

const POSITION: (u16, u16) = (0x20, 0x32);
const DIRECTIONS: (u16, u16) = (0x20, 0x37);
const INTERCEPT: (u16, u16) = (0x28, 0x1052);
const SLOPE: (u16, u16) = (0x28, 0x1053);
const PIXELS: (u16, u16) = (0x7fe0, 0x10);

/// A folder of its own for each series.
fn series(folder: &Folder, name: &'static str, files: Vec<(String, Vec<u8>)>) -> Result<Volume, String> {
    let _ = std::fs::remove_dir_all(folder.0.join(name));
    read_all(folder, name, files)
}

fn named(name: &str, dicom: &Dicom) -> (String, Vec<u8>) {
    (name.to_owned(), dicom.bytes())
}

fn is_said(volume: &Volume, text: &str) -> bool {
    volume.warnings().iter().any(|warning| warning.contains(text))
}

/// Every sample of slice k as `change` makes it.
fn stored(mut dicom: Dicom, change: impl Fn(u16) -> u16) -> Dicom {
    let (_, pixels) = dicom.elements.get_mut(&PIXELS).unwrap();
    *pixels = pixels.chunks(2).flat_map(|b| change(u16::from_le_bytes([b[0], b[1]])).to_le_bytes()).collect();
    dicom
}

fn bits(mut dicom: Dicom, stored: u16, high: u16, signed: u16) -> Dicom {
    [(0x101, stored), (0x102, high), (0x103, signed)].into_iter().for_each(|(element, v)| dicom.number((0x28, element), v));
    dicom
}

#[test]
fn storage_that_changes_within_a_series_changes_no_value() {
    // PS3.5 8.1.1: a sample is the BitsStored bits up to HighBit, the others are no part of it; PS3.3 C.7.6.3.1.1: its sign is that of each image.
    // Fails if the first slice decides for all, if bits beside the samples count.
    let folder = Folder::new("series-storage");
    let make = |k: usize| match k {
        0 | 1 => Dicom::slice(k),
        // 13 bits with a sign at the top of 16, below them an overlay's.
        _ => {
            let moved = stored(bits(Dicom::slice(k), 13, 15, 1), |v| v.wrapping_sub(1024) << 3 | 5);
            moved.with(INTERCEPT, "DS", "0")
        }
    };
    is_the_scan("12 bits, then 13 with a sign", series(&folder, "bits", dicom_files(make)));
    // Some slices packed by runs, some implicit, some big-endian: every file has a transfer syntax of its own (PS3.10 7.1).
    let make = |k: usize| match k {
        0 => Dicom::slice(0).packed(RLE, vec![rle(0)]),
        1 => Dicom { syntax: IMPLICIT, ..Dicom::slice(1) },
        2 => Dicom { syntax: BIG, ..Dicom::slice(2) },
        _ => Dicom { syntax: DEFLATED, ..Dicom::slice(3) },
    };
    is_the_scan("four transfer syntaxes", series(&folder, "syntaxes", dicom_files(make)));
}

#[test]
fn what_is_nested_is_not_the_images_own() {
    // PS3.3 F.3: items of sequences have attributes of their own. Fails if the rows, the position or the pixels of an icon are the image's.
    let folder = Folder::new("series-nested");
    let icon = |typed: bool| {
        [
            element((0x20, 0x32), "DS", b"1\\2\\3", typed, false),
            element((0x28, 0x10), "US", &[2, 0], typed, false),
            element((0x28, 0x11), "US", &[2, 0], typed, false),
            element((0x28, 0x1052), "DS", b"77", typed, false),
            element(PIXELS, "OW", &[9; 8], typed, false),
        ]
        .concat()
    };
    // Of undefined length: the icon's item, in a sequence, in an item of another; the outer ones are of type UN (PS3.5 6.2.2, note 2).
    let open_item =
        |content: Vec<u8>| [vec![0xfe, 0xff, 0, 0xe0, 255, 255, 255, 255], content, vec![0xfe, 0xff, 0x0d, 0xe0, 0, 0, 0, 0]].concat();
    let open_sequence = |tag: [u8; 4], vr: &[u8], items: Vec<u8>| {
        let head = [&tag[..], vr, if vr.is_empty() { &[] } else { &[0, 0] }, &[255; 4]].concat();
        [head, items, vec![0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]].concat()
    };
    let inner = open_sequence([0x88, 0, 0, 2], b"", open_item(icon(false)));
    let nested = open_sequence([0x08, 0, 0x40, 0x11], b"UN", open_item([icon(false), inner].concat()));
    for (what, before) in [("an icon", sequence((0x08, 0x1140), &[icon(true)])), ("an icon in UN of undefined length", nested)] {
        let make = |k| {
            rewritten(k, EXPLICIT, |tag, vr, value| {
                let own = element(tag, vr, value, true, false);
                if tag == (0x10, 0x10) { [before.clone(), own].concat() } else { own }
            })
        };
        is_the_scan(what, series(&folder, "nested", files(make)));
    }
}

#[test]
fn bytes_that_should_not_be_there_change_nothing() {
    let folder = Folder::new("series-bytes");
    // PS3.5 8.1.1: an image is rows × columns samples. Fails if pixels that are longer, or trailing padding (FFFC,FFFC), are refused.
    let longer = |k: usize| {
        let mut dicom = Dicom::slice(k);
        dicom.elements.get_mut(&PIXELS).unwrap().1.extend([0; 32]);
        [dicom.bytes(), element((0xfffc, 0xfffc), "OB", &[0; 300], true, false), vec![0; 512]].concat()
    };
    is_the_scan("padded pixels", series(&folder, "padded", files(longer)));
    // PS3.5 6.4 asks for even lengths; what is odd is read by its length all the same.
    let odd = |k: usize| {
        rewritten(k, EXPLICIT, |tag, vr, value| {
            let mut own = element(tag, vr, value, true, false);
            if value.len() % 2 == 1 && vr != "OW" {
                own.pop();
                own[6..8].copy_from_slice(&(value.len() as u16).to_le_bytes());
            }
            own
        })
    };
    is_the_scan("odd lengths", series(&folder, "odd", files(odd)));
    // PS3.5 A.5: a byte follows what is deflated to odd length.
    let deflated = |k: usize| [Dicom { syntax: DEFLATED, ..Dicom::slice(k) }.bytes(), vec![0]].concat();
    is_the_scan("a byte after what is deflated", series(&folder, "deflated", files(deflated)));
    // PS3.5 7.8: private elements are of those who wrote them; 7.1.3: of no type in an implicit file. One holds what looks like a header.
    let private = |k: usize| {
        let other = [element((0x28, 0x10), "US", &[1, 0], false, false), element(PIXELS, "OW", &[1; 8], false, false)].concat();
        let block = [element((0x9, 0x10), "LO", b"SOMEBODY", false, false), element((0x9, 0x1010), "OB", &other, false, false)].concat();
        rewritten(k, IMPLICIT, |tag, vr, value| {
            let own = element(tag, vr, value, false, false);
            if tag == (0x10, 0x10) { [block.clone(), own].concat() } else { own }
        })
    };
    is_the_scan("private elements in an implicit file", series(&folder, "private", files(private)));
    // PS3.5 6.2: numbers of VR DS may have a sign, an exponent, and spaces around them.
    let spelled = |k: usize| {
        let position = format!("-1.0E+01\\ +2e1 \\{}e-1", 300 + 20 * k);
        Dicom::slice(k).with(POSITION, "DS", &position).with(SLOPE, "DS", " +1.0E0 ").with((0x28, 0x30), "DS", "7.5E-01\\ .5")
    };
    is_the_scan("exponents", series(&folder, "exponents", dicom_files(spelled)));
    // PS3.3 C.7.6.6.1.1: there is one frame at least.
    let none = |k: usize| Dicom::slice(k).with((0x28, 0x8), "IS", "0");
    is_the_scan("no frames", series(&folder, "frames", dicom_files(none)));
}

#[test]
fn places_decide_and_not_numbers() {
    // PS3.3 C.7.6.2.1.1: ImagePositionPatient is where the first sample of an image lies; C.7.6.1: InstanceNumber is a number that identifies it.
    let folder = Folder::new("series-order");
    let reversed =
        |k: usize| Dicom::slice(k).with((0x20, 0x13), "IS", &(4 - k).to_string()).with((0x20, 0x1041), "DS", &format!("{}", -2 * k as i64));
    is_the_scan("numbers from the top", series(&folder, "reversed", dicom_files(reversed)));
    let same = |k: usize| Dicom::slice(k).with((0x20, 0x13), "IS", "1");
    is_the_scan("one number for all", series(&folder, "same", dicom_files(same)));
    // The table moves down along z while the normal of the slices, tilted by 18.5°, looks up: each sample lies where its own file says.
    let (sin, cos) = (0.317_304_656_405_092_13, 0.948_323_655_206_199_3);
    let at = |k: usize| DVec3::new(-10.0, 20.0 + 0.4 * k as f64, 30.0 - 2.0 * k as f64);
    let tilted = |k: usize| {
        let p = at(k);
        Dicom::slice(k).with(POSITION, "DS", &format!("{}\\{}\\{}", p.x, p.y, p.z)).with(
            DIRECTIONS,
            "DS",
            &format!("1\\0\\0\\0\\{cos}\\{sin}"),
        )
    };
    let volume = series(&folder, "tilted", dicom_files(tilted)).unwrap();
    for k in 0..4 {
        let world = at(k) + DVec3::X * 0.5 * 3.0 + DVec3::new(0.0, cos, sin) * 0.75 * 2.0;
        let index = volume.grid().world_to_index().transform_point3(world);
        assert!((index - index.round()).length() < 1e-6, "slice {k}: {index}");
        let [nx, ny, _] = DIMS;
        let n = (index.round().z as usize * ny + index.round().y as usize) * nx + index.round().x as usize;
        assert_eq!(volume.samples().get_f64(n), f64::from(sample(3, 2, k)), "slice {k}");
    }
}

#[test]
fn rounded_directions_are_directions() {
    // PS3.3 C.7.6.2.1.1: direction cosines are unit vectors at right angles, so what rounding makes of them scales and shears no sample. Fails if
    // three digits are refused, or make the distance of samples another than PixelSpacing.
    let folder = Folder::new("series-rounded");
    for (what, written) in [
        ("a diagonal", "0.577\\0.577\\0.577\\0.707\\-0.707\\0"),
        // Of 400,000 turns the one whose rounded directions are least at right angles: their product is 0.0015.
        ("the least perpendicular", "0.445\\0.695\\-0.565\\0.582\\-0.703\\-0.409"),
    ] {
        let [i, j] = [0, 3].map(|n| {
            let v: Vec<f64> = written.split('\\').map(|t| t.parse().unwrap()).collect();
            DVec3::new(v[n], v[n + 1], v[n + 2])
        });
        let normal = i.cross(j).normalize();
        let at = |k: usize| normal * 2.0 * k as f64;
        let make = |k: usize| {
            Dicom::slice(k).with(DIRECTIONS, "DS", written).with(POSITION, "DS", &format!("{}\\{}\\{}", at(k).x, at(k).y, at(k).z))
        };
        let volume = series(&folder, "rounded", dicom_files(make)).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(values(&volume), hu(), "{what}");
        assert!((volume.grid().spacing_mm() - DVec3::from(SPACING_MM)).length() < 1e-6, "{what}: {}", volume.grid().spacing_mm());
        let axes = volume.grid().direction();
        assert!(axes.x_axis.dot(axes.y_axis).abs() < 1e-6, "{what}: {axes}");
    }
}

#[test]
fn times_and_echoes_are_scans_of_their_own() {
    // PS3.3 C.8.3.1: images of several echoes differ in EchoTime; C.7.6.17: frames of several times in TemporalPositionIndex. Fails if one place
    // has a slice of the one and the next a slice of the other.
    let folder = Folder::new("series-times");
    let second = |k: usize| stored(Dicom::slice(k), |v| v ^ 1);
    let other: Vec<f64> = hu().iter().map(|v| f64::from((v + 1024.0) as u16 ^ 1) - 1024.0).collect();
    for (tag, vr, a, b, word) in [
        ((0x18, 0x81), "DS", "4.6", "9.2", "echo time 9.2"),
        ((0x18, 0x1060), "DS", "0", "400", "trigger time 400"),
        ((0x18, 0x9087), "FD", "\0\0\0\0\0\0\0\0", "\0\0\0\0\0\0\u{59}\u{40}", "b-value 100"),
    ] {
        // Numbers and names take turns from place to place.
        let one = |k: usize| Dicom::slice(k).with(tag, vr, a).with((0x20, 0x13), "IS", &(2 * k + k % 2).to_string());
        let two = |k: usize| second(k).with(tag, vr, b).with((0x20, 0x13), "IS", &(2 * k + 1 - k % 2).to_string());
        let files = (0..4).flat_map(|k| [named(&format!("IM{}", 2 * k), &one(k)), named(&format!("IM{}", 2 * k + 1), &two(k))]).collect();
        let _ = std::fs::remove_dir_all(folder.0.join("two"));
        let path = Small { name: "two", files, open: "" }.write(&folder);
        let listed = formats::series(&path, &Progress::default()).unwrap();
        assert!(listed.len() == 2 && listed.iter().any(|s| s.to_string().contains(word)), "{word}: {listed:?}");
        let read =
            |n: usize| open(&path.with_file_name(format!("two#{}", listed[n].key)), &Hints::default(), &Progress::default()).unwrap();
        let seen = [values(&read(0)), values(&read(1))];
        assert!(seen == [hu(), other.clone()] || seen == [other.clone(), hu()], "{word}");
    }
    // Nothing tells two images of a place apart but their numbers: the lower is read, aloud. So are doubles that are equal to the byte.
    for (what, double) in [("second of a place", second as fn(usize) -> Dicom), ("equal to the byte", Dicom::slice)] {
        let mut files = dicom_files(Dicom::slice);
        let numbered = |k: usize| double(k).with((0x20, 0x13), "IS", &(k + if what.starts_with("equal") { 1 } else { 10 }).to_string());
        files.extend((0..4).map(|k| named(&format!("A{k}"), &numbered(k))));
        let volume = is_the_scan(what, series(&folder, "doubles", files));
        assert!(is_said(&volume, "4 of 8 slices lie where another one does"), "{what}: {:?}", volume.warnings());
    }
}

#[test]
fn what_is_no_slice_of_the_scan_is_left_out_aloud() {
    let folder = Folder::new("series-strays");
    // PS3.3 C.7.6.2: a survey image of the same series has other directions, whatever its ImageType says.
    let survey = Dicom::slice(0).with(DIRECTIONS, "DS", "0\\1\\0\\0\\0\\-1").with(POSITION, "DS", "0\\-100\\200");
    let files = [dicom_files(Dicom::slice), vec![named("A0", &survey)]].concat();
    let volume = is_the_scan("a survey", series(&folder, "survey", files));
    assert!(is_said(&volume, "1 of 5 slices differ in size, direction or spacing"), "{:?}", volume.warnings());
    // C.7.6.3: a slice of twice the rows and columns is no slice of a stack of others. At the end the scan is one shorter; within it there is a gap.
    let double = |k: usize| {
        let mut dicom = Dicom::slice(k);
        dicom.number((0x28, 0x10), 12);
        dicom.number((0x28, 0x11), 16);
        dicom.elements.insert(PIXELS, ("OW", vec![1; 16 * 12 * 2]));
        dicom
    };
    let with = |stray: usize| dicom_files(|k| if k == stray { double(k) } else { Dicom::slice(k) });
    let volume = series(&folder, "double", with(3)).unwrap();
    assert_eq!((volume.grid().dims(), values(&volume)), ([8, 6, 3], hu()[..144].to_vec()));
    assert!(is_said(&volume, "1 of 4 slices differ in size"), "{:?}", volume.warnings());
    let error = series(&folder, "double", with(1)).unwrap_err();
    assert!(error.contains("not even") && error.contains("4 mm between slices 1 and 2"), "{error}");
    // Nothing in a file says how many slices there should be: without its last one a scan is a scan.
    let mut short = dicom_files(Dicom::slice);
    short.retain(|(name, _)| name != "IM2");
    let volume = series(&folder, "short", short).unwrap();
    assert_eq!((volume.grid().dims(), values(&volume)), ([8, 6, 3], hu()[..144].to_vec()));
}

#[test]
fn a_scale_or_spacing_that_one_slice_leaves_out_is_that_of_the_others() {
    // PS3.3 C.8.2.1: each CT image has RescaleIntercept and RescaleSlope; C.7.6.2: and PixelSpacing. A slice that lost them in some export is 1024 HU
    // too dense by itself, or of 1 mm, which no slice between others is. Fails if it is, if the scan is refused, or if nothing is said.
    let folder = Folder::new("series-scale");
    for k in [0, 2] {
        let bare = |n: usize| if n == k { Dicom::slice(n).without(INTERCEPT).without(SLOPE) } else { Dicom::slice(n) };
        let volume = is_the_scan("without a scale", series(&folder, "scale", dicom_files(bare)));
        assert!(is_said(&volume, "1 of its slices does not state how its numbers become values"), "{:?}", volume.warnings());
        let bare = |n: usize| if n == k { Dicom::slice(n).without((0x28, 0x30)) } else { Dicom::slice(n) };
        let volume = is_the_scan("without a spacing", series(&folder, "spacing", dicom_files(bare)));
        assert!(is_said(&volume, "1 of its slices does not state its spacing") && volume.spacing_is_stated(), "{:?}", volume.warnings());
    }
    // C.7.6.3.1.2: MONOCHROME1 says how samples are shown; those of a CT are HU all the same.
    let white = |k: usize| Dicom::slice(k).with((0x28, 0x4), "CS", if k == 1 { "MONOCHROME1" } else { "MONOCHROME2" });
    is_the_scan("one of MONOCHROME1", series(&folder, "white", dicom_files(white)));
}

#[test]
fn the_list_of_a_disc_is_not_the_disc() {
    // PS3.10 8.6: DICOMDIR names files, and has none of their samples. Fails if files that it names and that are missing are an error where others
    // are there, or if it is called a broken image where none are.
    let folder = Folder::new("series-disc");
    let list = Dicom { syntax: EXPLICIT, elements: Default::default(), fragments: None }.with((0x4, 0x1130), "CS", "DISC");
    let files: Vec<(String, Vec<u8>)> =
        [vec![named("DICOMDIR", &list)], files(|k| Dicom::slice(k).bytes()).into_iter().map(|(n, b)| (format!("IMAGES/{n}"), b)).collect()]
            .concat();
    let path = Small { name: "disc", files: files.clone(), open: "DICOMDIR" }.write(&folder);
    let read = |path: &std::path::Path| open(path, &Hints::default(), &Progress::default()).map_err(|e| e.to_string());
    is_the_scan("by its list", read(&path));
    is_the_scan("by its folder", read(path.parent().unwrap()));
    let path = Small { name: "alone", files: files[..1].to_vec(), open: "DICOMDIR" }.write(&folder);
    let error = read(&path).unwrap_err();
    assert!(error.contains("it lists the files of a disc, and no image lies beside it; copy the whole disc"), "{error}");
}
