use super::array::Array;
use super::*;
use crate::formats::{OpenError, open, scan as scan_file, write as write_file};
use crate::volume::ReadSamples;
use crate::{Keep, KeepError, Raster, Sample, Samples, Unit, Volume, with_samples};
use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A folder of a test's own, removed with what is in it.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let n = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("bregma-zarr-{name}-{}-{n}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Numbers that differ from place to place: bone with noise.
fn noise(n: usize) -> f64 {
    let mut x = n as u64 ^ 0x9e37_79b9;
    x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 40) as f64 / f64::from(1 << 24)
}

fn ball(dims: [usize; 3]) -> impl Fn(usize) -> f64 {
    move |n| {
        let at = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
        let radius: f64 = (0..3).map(|a| (at[a] as f64 / dims[a] as f64 - 0.5).powi(2)).sum::<f64>().sqrt();
        100.0 * (1.5 - 3.0 * radius) + 20.0 * noise(n)
    }
}

fn volume_of(samples: Samples, dims: [usize; 3]) -> Volume {
    let shear = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(0.0, -0.3, 0.95));
    let grid = Grid::new(dims, DVec3::new(0.5, 0.6, 1.25), DVec3::new(-10.0, 20.0, 3.5), shear).unwrap();
    let raster = Raster { grid, samples, slope: 2.0, intercept: -50.0, unit: Unit::Value, warnings: vec![] };
    Volume::new("scan".into(), "test", raster).unwrap().with_metadata([("Operator".to_owned(), "A = B".to_owned())].into())
}

fn of_type(kind: &str, dims: [usize; 3]) -> Volume {
    let value = ball(dims);
    let all = || (0..dims.iter().product()).map(&value);
    let samples = match kind {
        "u8" => Samples::U8(all().map(|v| v.clamp(0.0, 255.0) as u8).collect()),
        "i16" => Samples::I16(all().map(|v| v as i16).collect()),
        "u16" => Samples::U16(all().map(|v| (v + 1000.0) as u16).collect()),
        _ => Samples::F32(all().map(|v| v as f32).collect()),
    };
    volume_of(samples, dims)
}

#[test]
fn what_is_written_is_read_again_in_every_type_and_size() {
    // Fails if an edge's chunks, an axis, the grid's shear, the scale or metadata are lost, or a type is taken for another.
    let folder = Folder::new("again");
    for (kind, dims) in [("u8", [33, 64, 65]), ("i16", [70, 31, 97]), ("u16", [32, 32, 32]), ("f32", [5, 130, 3]), ("i16", [1, 7, 1])] {
        let volume = of_type(kind, dims);
        let path = folder.join(&format!("{kind}.ome.zarr"));
        write_file(&path, &volume, &Progress::default()).unwrap();
        let again = open(&path, &Hints::default(), &Progress::default()).unwrap();
        assert_eq!((again.samples(), again.grid(), again.type_name()), (volume.samples(), volume.grid(), kind), "{dims:?}");
        assert_eq!((again.slope(), again.intercept(), again.unit()), (2.0, -50.0, Unit::Value));
        assert_eq!((again.metadata(), again.format()), (volume.metadata(), "OME-Zarr"));
        assert!(again.spacing_is_stated() && again.warnings() == volume.warnings(), "{:?}", again.warnings());
    }
}

#[test]
fn a_scan_streams_into_a_store_as_a_volume_does() {
    // Fails if converting without memory gives other samples, loses what the file says, or guesses another unit than opening does.
    let folder = Folder::new("stream");
    for kind in ["u8", "i16", "f32"] {
        let volume = of_type(kind, [37, 41, 70]);
        let (nrrd, store) = (folder.join("a.nrrd"), folder.join("a.ome.zarr"));
        write_file(&nrrd, &volume, &Progress::default()).unwrap();
        let scan = scan_file(&nrrd, &Hints::default(), &Progress::default()).unwrap();
        assert!(convert(&scan, &store, Keep::default(), &Progress::default()).unwrap().is_empty());
        let [a, b] = [&nrrd, &store].map(|file| open(file, &Hints::default(), &Progress::default()).unwrap());
        assert_eq!((a.content(), a.unit(), a.metadata()), (b.content(), b.unit(), b.metadata()));
    }
    // Samples that are no numbers are mended as in memory.
    let mut odd = vec![1.0_f32; 64];
    (odd[3], odd[7], odd[20]) = (f32::NAN, f32::INFINITY, -5.0);
    fs::write(folder.join("odd.raw"), bytemuck::cast_slice(&odd)).unwrap();
    let hints = Hints { raw: Some("4x4x4,f32".parse().unwrap()), ..Hints::default() };
    let warnings = convert(
        &scan_file(&folder.join("odd.raw"), &hints, &Progress::default()).unwrap(),
        &folder.join("odd.zarr"),
        Keep::default(),
        &Progress::default(),
    );
    assert!(warnings.unwrap().iter().any(|w| w.starts_with("2 samples are NaN")));
    let again = open(&folder.join("odd.zarr"), &Hints::default(), &Progress::default()).unwrap();
    let raw = open(&folder.join("odd.raw"), &hints, &Progress::default()).unwrap();
    assert_eq!((again.samples(), again.spacing_is_stated()), (raw.samples(), false));
}

fn array_of<T: bytemuck::Pod>(folder: &Path) -> (Vec<u64>, Vec<T>) {
    let array = Array::open(folder, true).unwrap();
    let shape = array.shape().to_vec();
    let all: Vec<_> = shape.iter().map(|n| 0..*n).collect();
    let bytes = array.slab(&all).unwrap();
    (shape, bytemuck::pod_collect_to_vec(&bytes))
}

#[test]
fn levels_are_means_and_ranges_are_those_of_chunks_with_their_far_faces() {
    // Fails if an odd edge is not repeated, halves are not rounded up, a chunk's far face is left out of its range, or reach misses a child.
    let folder = Folder::new("levels");
    let dims = [70, 131, 67];
    let volume = of_type("i16", dims);
    let path = folder.join("a.zarr");
    write_file(&path, &volume, &Progress::default()).unwrap();
    let Samples::I16(mut finer) = volume.samples().clone() else { panic!("the samples are i16") };
    let (mut size, mut reach) = (dims, None::<([usize; 3], Vec<[i16; 2]>)>);
    for level in 0..3 {
        let (shape, samples) = array_of::<i16>(&path.join(level.to_string()));
        assert_eq!(shape, [size[2], size[1], size[0]].map(|n| n as u64));
        assert_eq!(samples, finer, "level {level}");
        let at = |x: usize, y: usize, z: usize| finer[(z.min(size[2] - 1) * size[1] + y.min(size[1] - 1)) * size[0] + x.min(size[0] - 1)];
        let count = size.map(|n| n.div_ceil(32));
        let (shape, ends) = array_of::<i16>(&path.join(format!("bregma/ranges/{level}")));
        assert_eq!(shape, [2, count[2], count[1], count[0]].map(|n| n as u64));
        let chunks = count.iter().product::<usize>();
        let place = |n: usize, of: [usize; 3]| [n % of[0], n / of[0] % of[1], n / (of[0] * of[1])];
        let mut ranges = vec![];
        for n in 0..chunks {
            let [x, y, z] = place(n, count).map(|c| 32 * c);
            let cube = (0..33).flat_map(|k| (0..33).flat_map(move |j| (0..33).map(move |i| (i, j, k))));
            let values = cube.map(|(i, j, k)| at(x + i, y + j, z + k));
            let range = values.fold([i16::MAX, i16::MIN], |[low, high], v| [low.min(v), high.max(v)]);
            assert_eq!([ends[n], ends[chunks + n]], range, "level {level}, chunk {n}");
            ranges.push(range);
        }
        let of_children = |(fine, of): &([usize; 3], Vec<[i16; 2]>)| -> Vec<[i16; 2]> {
            let mut ends = vec![[i16::MAX, i16::MIN]; chunks];
            for (m, [low, high]) in of.iter().enumerate() {
                let [x, y, z] = place(m, *fine).map(|c| c / 2);
                let of = &mut ends[(z * count[1] + y) * count[0] + x];
                *of = [of[0].min(*low), of[1].max(*high)];
            }
            ends
        };
        let beneath = reach.as_ref().map(of_children);
        if let Some(beneath) = &beneath {
            let (_, ends) = array_of::<i16>(&path.join(format!("bregma/reach/{level}")));
            (0..chunks).for_each(|n| assert_eq!([ends[n], ends[chunks + n]], beneath[n], "level {level}, reach of {n}"));
        }
        reach = Some((count, beneath.unwrap_or(ranges)));
        let next = size.map(|n| n.div_ceil(2));
        let mean = |n: usize| {
            let [x, y, z] = place(n, next).map(|c| 2 * c);
            let sum: i32 = (0..8).map(|c| i32::from(at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)))).sum();
            (f64::from(sum) / 8.0 + 0.5).floor() as i16
        };
        finer = (0..next.iter().product()).map(mean).collect();
        size = next;
    }
    assert!(!path.join("3").exists(), "33 × 17 × 34 is small enough");
}

#[test]
fn chunks_are_read_whole_however_large_their_slices_are() {
    // Fails if a slab ends within a chunk because its slices are a little too large: its checksum would not be compared, and a lost file pass.
    let folder = Folder::new("whole-chunks");
    let path = folder.join("a.zarr");
    write_file(&path, &of_type("i16", [40, 40, 70]), &Progress::default()).unwrap();
    let array = Array::open(&path.join("0"), true).unwrap();
    for (most, depth) in [(32 * 100, 32), (28 * 100, 32), (4 * 100, 32), (3 * 100, 3), (1, 1)] {
        assert_eq!(array.depth(0, 100, most), depth, "{most} bytes");
    }
}

/// The samples of `volume` kept as `keep` says.
fn kept(volume: &Volume, keep: Keep, folder: &Folder) -> Volume {
    let (nrrd, store) = (folder.join("kept.nrrd"), folder.join("kept.zarr"));
    write_file(&nrrd, volume, &Progress::default()).unwrap();
    let scan = scan_file(&nrrd, &Hints::default(), &Progress::default()).unwrap();
    convert(&scan, &store, keep, &Progress::default()).unwrap();
    open(&store, &Hints::default(), &Progress::default()).unwrap()
}

fn values(volume: &Volume) -> Vec<f64> {
    with_samples!(volume.samples(), s => s.iter().map(|s| volume.value_of(s.to_f64())).collect())
}

#[test]
fn surfaces_between_two_isovalues_keep_every_sample_that_they_and_their_normals_need() {
    // Fails if a cell that can hold such a surface loses a sample of its corners or of those beside them, if one that cannot hold any can
    // afterwards, or if nothing is left out.
    let folder = Folder::new("surfaces");
    for (kind, dims, [low, high]) in [
        ("i16", [40, 37, 61], [0.0, 60.0]),
        ("f32", [19, 50, 33], [-20.0, -20.0]),
        ("u8", [35, 20, 41], [-60.0, 30.0]),
        ("u16", [2, 9, 40], [1800.0, 1900.0]),
    ] {
        let volume = of_type(kind, dims);
        let again = kept(&volume, Keep { surfaces: Some([low, high]), error: 0.0 }, &folder);
        let (before, after) = (values(&volume), values(&again));
        let number = |[x, y, z]: [usize; 3]| (z * dims[1] + y) * dims[0] + x;
        let can_hold = |of: &[f64], cell: [usize; 3]| {
            let corners = || (0..8).map(|c| of[number([cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)])]);
            !corners().all(|v| v < low) && !corners().all(|v| v > high)
        };
        let mut cells = 0;
        for n in 0..(dims[0] - 1) * (dims[1] - 1) * (dims[2] - 1) {
            let cell = [n % (dims[0] - 1), n / (dims[0] - 1) % (dims[1] - 1), n / ((dims[0] - 1) * (dims[1] - 1))];
            assert_eq!(can_hold(&before, cell), can_hold(&after, cell), "{kind} {cell:?}");
            if can_hold(&before, cell) {
                cells += 1;
                let near = |a: usize| cell[a].saturating_sub(1)..(cell[a] + 3).min(dims[a]);
                for at in near(2).flat_map(|z| near(1).flat_map(move |y| near(0).map(move |x| [x, y, z]))) {
                    assert_eq!(before[number(at)], after[number(at)], "{kind} {cell:?} {at:?}");
                }
            }
        }
        let same = before.iter().zip(&after).filter(|(a, b)| a == b).count();
        assert!(cells > 100 && (dims[0] == 2 || same < before.len()), "{kind}: {cells} cells, {same} samples of {}", before.len());
        assert!(again.warnings().iter().any(|w| w.contains(&format!("isovalues {low}..{high}"))), "{:?}", again.warnings());
    }
}

#[test]
fn no_value_is_farther_off_than_the_error_that_is_allowed() {
    // Fails if a sample is rounded too far, in whole numbers, in floats, at the ends of a type, or where surfaces are kept, too.
    let folder = Folder::new("error");
    for (kind, error) in [("i16", 9.0), ("u8", 13.0), ("f32", 0.37), ("u16", 1.9)] {
        let volume = of_type(kind, [33, 30, 35]);
        let again = kept(&volume, Keep { surfaces: None, error }, &folder);
        let farthest = values(&volume).iter().zip(values(&again)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // A slope of 2: an error of 1.9 is less than a step of the samples.
        assert!(farthest <= error && (farthest > 0.4 * error || kind == "u16"), "{kind}: {farthest}");
        assert!(again.warnings().iter().any(|w| w.contains("off by up to")), "{:?}", again.warnings());
        let keep = Keep { surfaces: Some([20.0, 50.0]), error };
        let both = kept(&volume, keep, &folder);
        for (a, b) in values(&volume).into_iter().zip(values(&both)) {
            let is_near = (20.0 - error..=50.0 + error).contains(&a);
            assert!(!is_near || (a - b).abs() <= error, "{kind}: {a} became {b}");
        }
    }
    let nothing = Keep { surfaces: Some([5.0, 1.0]), error: 0.0 };
    assert_eq!(nothing.check(), Err(KeepError::Interval(5.0, 1.0)));
    assert_eq!(Keep { surfaces: None, error: -1.0 }.check(), Err(KeepError::Error(-1.0)));
}

#[test]
fn what_is_rounded_takes_no_more_room_than_what_is_not() {
    // Fails if rounding, of all samples or of those that surfaces need, makes a store larger than it was without.
    let folder = Folder::new("room");
    let volume = of_type("i16", [96, 96, 96]);
    let size = |keep: Keep| -> u64 {
        kept(&volume, keep, &folder);
        let shards = fs::read_dir(folder.join("kept.zarr/0/c")).unwrap().map(|entry| entry.unwrap().path().join("0/0"));
        shards.map(|shard| fs::metadata(shard).unwrap().len()).sum()
    };
    for surfaces in [None, Some([0.0, 60.0])] {
        let sizes = [0.0, 8.0, 32.0].map(|error| size(Keep { surfaces, error }));
        println!("surfaces {surfaces:?}, errors 0, 8 and 32: {sizes:?} bytes");
        assert!(sizes.is_sorted_by(|a, b| a > b), "{sizes:?}");
    }
}

/// A store of version 2, its chunks plain, in an order of axes and bytes of their own.
fn version_2(folder: &Path, attributes: &str) {
    fs::create_dir_all(folder.join("s0")).unwrap();
    fs::write(folder.join(".zgroup"), r#"{"zarr_format": 2}"#).unwrap();
    fs::write(folder.join(".zattrs"), attributes).unwrap();
    let array = r#"{"zarr_format": 2, "shape": [1, 3, 4, 5], "chunks": [1, 2, 2, 5], "dtype": ">i2", "compressor": null, "fill_value": -7,
        "order": "C", "filters": null, "dimension_separator": "/"}"#;
    fs::write(folder.join("s0/.zarray"), array).unwrap();
    // The chunks of y from 2 on are missing.
    for k in 0..2_i16 {
        let chunk: Vec<u8> = (0..20_i16).flat_map(|n| (100 * k + n).to_be_bytes()).collect();
        fs::create_dir_all(folder.join(format!("s0/0/{k}/0"))).unwrap();
        fs::write(folder.join(format!("s0/0/{k}/0/0")), chunk).unwrap();
    }
}

const AXES: &str = r#"[{"name": "c", "type": "channel"}, {"name": "z", "type": "space", "unit": "micrometer"},
    {"name": "y", "type": "space", "unit": "micrometer"}, {"name": "x", "type": "space", "unit": "millimeter"}]"#;

#[test]
fn a_store_of_version_0_4_opens_with_its_places_and_gaps() {
    // Fails if big-endian numbers, missing chunks, units, the order of transformations or an axis that is none of space are misread.
    let folder = Folder::new("v2");
    let transforms = r#"[{"type": "scale", "scale": [1, 500, 250, 0.25]}, {"type": "translation", "translation": [0, 1000, 0, 2]}]"#;
    let all = r#"[{"type": "scale", "scale": [1, 2, 1, 1]}]"#;
    let attributes = format!(
        r#"{{"multiscales": [{{"version": "0.4", "axes": {AXES}, "datasets": [{{"path": "s0", "coordinateTransformations": {transforms}}}],
        "coordinateTransformations": {all}}}]}}"#
    );
    version_2(&folder.0, &attributes);
    let volume = open(&folder.0, &Hints::default(), &Progress::default()).unwrap();
    assert_eq!(volume.grid().dims(), [5, 4, 3]);
    assert!((volume.grid().spacing_mm() - DVec3::new(0.25, 0.25, 1.0)).length() < 1e-12, "{}", volume.grid().spacing_mm());
    assert!((volume.grid().origin_mm() - DVec3::new(2.0, 0.0, 2.0)).length() < 1e-12, "{}", volume.grid().origin_mm());
    let Samples::I16(samples) = volume.samples() else { panic!("the samples are i16") };
    // Chunk 0 has slices 0 and 1, each two rows of five.
    assert_eq!([samples[0], samples[9], samples[20], samples[40]], [0, 9, 10, 100]);
    assert_eq!([samples[10], samples[59]], [-7, -7]);
    // Naming the file that says it, or the array alone, opens the same samples.
    let by_file = open(&folder.join(".zattrs"), &Hints::default(), &Progress::default()).unwrap();
    let alone = open(&folder.join("s0"), &Hints::default(), &Progress::default()).unwrap();
    assert_eq!((by_file.samples(), alone.samples()), (volume.samples(), volume.samples()));
    assert!(!alone.spacing_is_stated() && volume.spacing_is_stated());
}

#[test]
fn what_is_broken_is_one_sentence() {
    // Fails if a damaged store panics, opens as if it were whole, or says nothing that helps.
    let folder = Folder::new("broken");
    let path = folder.join("a.zarr");
    let volume = of_type("i16", [70, 70, 70]);
    let fresh = || write_file(&path, &volume, &Progress::default()).unwrap();
    let refused = |what: &str| {
        let opened = open(&path, &Hints::default(), &Progress::default());
        let error = opened.err().unwrap_or_else(|| panic!("{what}: it opened")).to_string();
        assert!(error.contains(what) && !error.contains('\n'), "{error}");
    };
    let shard = path.join("0/c/1/0/0");
    fresh();
    let whole = fs::read(&shard).unwrap();
    fs::write(&shard, &whole[..whole.len() / 2]).unwrap();
    refused("damaged");
    let mut flipped = whole.clone();
    flipped[whole.len() / 3] ^= 0x10;
    fs::write(&shard, &flipped).unwrap();
    refused("checksum");
    // An index that points outside of its shard, with a checksum that is right.
    let mut outside = whole.clone();
    let index = whole.len() - 4 - 16 * 9;
    outside[index..index + 8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    let sum = crc32c(&outside[index..whole.len() - 4]);
    let end = whole.len() - 4;
    outside[end..].copy_from_slice(&sum.to_le_bytes());
    fs::write(&shard, &outside).unwrap();
    refused("damaged");
    for (file, text, what) in [
        ("zarr.json", "{", "no JSON"),
        ("zarr.json", r#"{"zarr_format": 3, "node_type": "group", "attributes": {}}"#, "holds no image"),
        ("0/zarr.json", r#"{"zarr_format": 3, "node_type": "array"}"#, "cannot be opened"),
    ] {
        fresh();
        fs::write(path.join(file), text).unwrap();
        refused(what);
    }
    fresh();
    fs::remove_file(&shard).unwrap();
    refused("c/1/0/0 is missing");
    fresh();
    let uneven = fs::read_to_string(path.join("0/zarr.json")).unwrap().replace("\"regular\"", "\"rectangular\"");
    fs::write(path.join("0/zarr.json"), uneven).unwrap();
    refused("cannot be opened");
    fresh();
    let text = fs::read_to_string(path.join("zarr.json")).unwrap();
    fs::write(path.join("zarr.json"), text.replace("\"path\": \"0\"", "\"path\": \"nowhere\"")).unwrap();
    refused("cannot be opened");
}

/// Castagnoli's, bit by bit.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes
        .iter()
        .fold(!0_u32, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0x82f6_3b78 } else { 0 }))
}

#[test]
fn a_store_is_whole_or_not_there_and_nothing_else_is_lost() {
    // Fails if stopping leaves half a store, if an older one is lost by that, if what a killed one left stays, or a folder of something else is
    // written over.
    let folder = Folder::new("whole");
    let path = folder.join("a.ome.zarr");
    let (first, second) = (of_type("i16", [40, 40, 40]), of_type("u8", [66, 40, 40]));
    write_file(&path, &first, &Progress::default()).unwrap();
    let nrrd = folder.join("b.nrrd");
    write_file(&nrrd, &second, &Progress::default()).unwrap();
    let scan = scan_file(&nrrd, &Hints::default(), &Progress::default()).unwrap();
    let stopped = Progress::default();
    stopped.cancel();
    let error = convert(&scan, &path, Keep::default(), &stopped).unwrap_err();
    assert!(matches!(&error, ConvertError::Open(OpenError { reason: ReadError::Cancelled(_), .. })), "{error}");
    let names = || -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(&folder.0).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    assert_eq!(names(), ["a.ome.zarr", "b.nrrd"]);
    assert_eq!(open(&path, &Hints::default(), &Progress::default()).unwrap().content(), first.content());
    // As a kill between two renames leaves it, and the next one is stopped, too.
    let [part, old] = ["part", "old"].map(|end| folder.join(&format!(".bregma-a.ome.zarr.{end}")));
    fs::rename(&path, &old).unwrap();
    write_file(&folder.join("left.zarr"), &second, &Progress::default()).unwrap();
    fs::rename(folder.join("left.zarr"), &part).unwrap();
    convert(&scan, &path, Keep::default(), &stopped).unwrap_err();
    assert_eq!(names(), ["a.ome.zarr", "b.nrrd"]);
    assert_eq!(open(&path, &Hints::default(), &Progress::default()).unwrap().content(), first.content());
    // As a kill before them does: arrays, and nothing yet that says what they are.
    write_file(&folder.join("left.zarr"), &first, &Progress::default()).unwrap();
    fs::rename(folder.join("left.zarr"), &part).unwrap();
    fs::remove_file(part.join("zarr.json")).unwrap();
    convert(&scan, &path, Keep::default(), &Progress::default()).unwrap();
    assert_eq!(names(), ["a.ome.zarr", "b.nrrd"]);
    assert_eq!(open(&path, &Hints::default(), &Progress::default()).unwrap().samples(), second.samples());
    // Stores of a person's own, whatever they are called.
    let [kept, other] = ["a.ome.zarr.old", "a.ome.zarr.part"].map(|name| folder.join(name));
    for own in [&kept, &other] {
        write_file(&folder.join("own.zarr"), &first, &Progress::default()).unwrap();
        fs::rename(folder.join("own.zarr"), own).unwrap();
    }
    let old_scan = scan_file(&kept, &Hints::default(), &Progress::default()).unwrap();
    convert(&old_scan, &path, Keep::default(), &Progress::default()).unwrap();
    for store in [&kept, &other, &path] {
        assert_eq!(open(store, &Hints::default(), &Progress::default()).unwrap().content(), first.content());
    }
    // A folder of a person's own.
    let own = folder.join("photos.zarr");
    fs::create_dir(&own).unwrap();
    fs::write(own.join("face.jpg"), "x").unwrap();
    let error = convert(&scan, &own, Keep::default(), &Progress::default()).unwrap_err().to_string();
    assert!(error.contains("would be lost") && own.join("face.jpg").is_file(), "{error}");
}
