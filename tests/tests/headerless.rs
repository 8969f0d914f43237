//! Headerless files: how their samples lie is guessed from the samples.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::formats::{RawLayout, raw_guesses};
use bregma_field::{Progress, Volume};
use bregma_session::Opened;
use bregma_synthetic::{Which, skull};
use bregma_tests::{Random, data};
use bregma_volume::ReadSamples;
use std::path::PathBuf;

/// A part of a skull phantom, in HU, and its sides: never the same ones, and not always square.
fn part(volume: &Volume, [w, h, d]: [usize; 3]) -> Vec<f64> {
    let [nx, ny, nz] = volume.grid().dims();
    let first = [(nx - w) / 2, (ny - h) / 2, (nz - d) / 2];
    let at = |n: usize| first[0] + n % w + nx * (first[1] + n / w % h + ny * (first[2] + n / w / h));
    (0..w * h * d).map(|n| volume.value_of(volume.samples().get_f64(at(n)))).collect()
}

/// Values as the samples of a type: bits of 8 as most programs window them, unsigned ones from air on.
fn bytes(values: &[f64], kind: &str, big: bool) -> Vec<u8> {
    let order = |mut bytes: Vec<u8>| {
        if big {
            bytes.reverse();
        }
        bytes
    };
    let one = |v: &f64| match kind {
        "u8" => vec![((v + 1024.0) / 16.0).clamp(0.0, 255.0) as u8],
        "u16" => order(((v + 1024.0).max(0.0) as u16).to_le_bytes().into()),
        "i16" => order((*v as i16).to_le_bytes().into()),
        _ => order((*v as f32 * 1.25).to_le_bytes().into()),
    };
    values.iter().flat_map(one).collect()
}

#[test]
fn the_right_layout_is_guessed_first() {
    // Fails if a type, a byte order, a size or a header that scans come with is not found from the samples, or stands behind wrong ones.
    let folder = std::env::temp_dir().join(format!("bregma-guess-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (mut first, mut among, mut all, mut wrong) = (0, 0, 0, vec![]);
    for which in [Which::A, Which::B] {
        let volume = skull(which, 176, &Progress::default()).unwrap();
        let whole = volume.grid().dims();
        let fits = |dims: &[usize; 3]| (0..3).all(|axis| dims[axis] <= whole[axis]);
        for dims in [[128, 128, 96], [96, 128, 100], [100, 100, 64], [120, 96, 33], whole].into_iter().filter(fits) {
            let values = part(&volume, dims);
            for (kind, big) in [("u8", false), ("u16", false), ("u16", true), ("i16", false), ("i16", true), ("f32", false), ("f32", true)]
            {
                for skip in [0, 352, 512] {
                    let file: PathBuf = folder.join("skull.bin");
                    let header: Vec<u8> = (0..skip).map(|n| b"a header of text, more or less. "[n % 32]).collect();
                    std::fs::write(&file, [header, bytes(&values, kind, big)].concat()).unwrap();
                    let truth = RawLayout::new(dims, kind, big, skip as u64).unwrap();
                    let guesses = raw_guesses(&file, &Progress::default()).unwrap();
                    all += 1;
                    first += usize::from(guesses.first() == Some(&truth));
                    among += usize::from(guesses.contains(&truth));
                    if guesses.first() != Some(&truth) {
                        wrong.push(format!("{truth} is taken for {:?}", guesses.iter().map(RawLayout::to_string).collect::<Vec<_>>()));
                    }
                }
            }
        }
    }
    println!("headerless: of {all} files the right layout is guessed first for {first}, among six for {among}");
    wrong.iter().for_each(|text| println!("  {text}"));
    assert!(first * 100 >= all * 95 && among * 100 >= all * 99, "{first} and {among} of {all}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_guess_opens_as_the_command_line_opens_it() {
    // Fails if what is guessed is not what `--raw` takes, or if a name's numbers are not believed.
    let folder = std::env::temp_dir().join(format!("bregma-guessed-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let volume = skull(Which::A, 96, &Progress::default()).unwrap();
    let dims = volume.grid().dims();
    let values = part(&volume, dims);
    let file = folder.join("skull.bin");
    std::fs::write(&file, bytes(&values, "i16", true)).unwrap();
    let guess = raw_guesses(&file, &Progress::default()).unwrap()[0];
    let source = bregma_session::Source { file, raw: Some(guess.into()), ..Default::default() };
    let words = serde_json::to_value(&source).unwrap()["raw"].as_str().unwrap().to_owned();
    assert_eq!(words.parse::<RawLayout>().unwrap(), guess);
    assert_eq!(guess, RawLayout::new(dims, "i16", true, 0).unwrap());
    let opened = Opened::read(&[source], &Progress::default()).unwrap();
    let read = opened.volumes[0].samples();
    assert!((0..values.len()).all(|n| read.get_f64(n) == values[n]));
    // The name says a size that its samples would not be guessed to have.
    let [w, h, d] = dims;
    let named = folder.join(format!("skull_{}x{h}x{d}.raw", w / 2));
    std::fs::write(&named, &bytes(&values, "u16", false)[..w * h * d]).unwrap();
    assert_eq!(raw_guesses(&named, &Progress::default()).unwrap()[0].dims(), [w / 2, h, d]);
    // What is no scan is guessed without an end, and in no time.
    std::fs::write(folder.join("text.bin"), "no samples, but words. ".repeat(50)).unwrap();
    raw_guesses(&folder.join("text.bin"), &Progress::default()).unwrap();
    let mut random = Random(9);
    let mut bytes = |count: usize| (0..count).map(|_| (random.unit() * 256.0) as u8).collect::<Vec<u8>>();
    let noise = (0..60).map(|n| bytes(n * n * n % 70_001 + 1));
    for odd in noise.chain([vec![7; 1], vec![7; 4096], vec![0; 100_000], b"ab".into()]) {
        std::fs::write(folder.join("odd.bin"), &odd).unwrap();
        for guess in raw_guesses(&folder.join("odd.bin"), &Progress::default()).unwrap() {
            let bytes = guess.dims().iter().product::<usize>()
                * if guess.type_name() == "f32" { 4 } else { 1 + usize::from(guess.type_name() != "u8") };
            assert_eq!(bytes + guess.skip() as usize, odd.len(), "{guess} does not use the file");
            let (size, values) = guess.middle_slice(&folder.join("odd.bin"), 50).unwrap();
            assert!(values.len() == size[0] * size[1] && size.iter().all(|side| *side <= 50), "{guess}: {size:?}");
        }
        let beyond = RawLayout::new([1 << 40, 1 << 40, 3], "f32", false, u64::MAX).unwrap();
        assert!(beyond.middle_slice(&folder.join("odd.bin"), 50).is_err());
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_layouts_of_real_scans_are_guessed() {
    // Fails if real noise, padding, slices far apart, tables or a small range of values lead to another layout.
    let Some(d) = data("the layouts of real scans") else { return };
    let folder = std::env::temp_dir().join(format!("bregma-guess-real-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let names = [
        "classic/bonsai.nii.gz",
        "classic/engine_256x256x110_uint8.raw",
        "cranium-invesalius/Cranium.nhdr",
        "cthead-unc/CThead.nhdr",
        "mouse/C57BL6_J_.nii.gz",
        "mouse/DBA_2J_.nii.gz",
        "mouse/low_res_template_UCHAR.nii.gz",
        "phantom-philips/straight",
        "phantom-philips/tilted",
    ];
    let (mut first, mut all) = (0, 0);
    for name in names {
        let source = bregma_session::Source { file: d.join(name), ..Default::default() };
        let Ok(opened) = Opened::read(&[source], &Progress::default()) else { panic!("{name} does not open") };
        let volume = &opened.volumes[0];
        let (samples, dims) = (volume.samples(), volume.grid().dims());
        for big in [false, true].into_iter().take(if volume.type_name() == "u8" { 1 } else { 2 }) {
            let one = |n: usize| {
                let v = samples.get_f64(n);
                let mut own = match volume.type_name() {
                    "u8" => vec![v as u8],
                    "u16" => (v as u16).to_le_bytes().to_vec(),
                    "i16" => (v as i16).to_le_bytes().to_vec(),
                    _ => (v as f32).to_le_bytes().to_vec(),
                };
                if big {
                    own.reverse();
                }
                own
            };
            let file = folder.join("scan.bin");
            std::fs::write(&file, (0..samples.len()).flat_map(one).collect::<Vec<u8>>()).unwrap();
            let begun = std::time::Instant::now();
            let guesses = raw_guesses(&file, &Progress::default()).unwrap();
            let seconds = begun.elapsed().as_secs_f64();
            let truth = RawLayout::new(dims, volume.type_name(), big, 0).unwrap();
            // A type that reads the same samples is as right: none of them is below zero.
            let same = |guess: &RawLayout| {
                let signs = guess.type_name().trim_start_matches(['u', 'i']) == truth.type_name().trim_start_matches(['u', 'i']);
                let is_above = volume.type_name() != "i16" || (0..samples.len()).all(|n| samples.get_f64(n) >= 0.0);
                *guess == truth || guess.dims() == dims && guess.skip() == 0 && guess.is_big_endian() == big && signs && is_above
            };
            all += 1;
            let rank = guesses.iter().position(same);
            first += usize::from(rank == Some(0));
            println!(
                "{name}: {truth}, rank {rank:?}, {seconds:.2} s, first {}",
                guesses.first().map_or(String::new(), RawLayout::to_string)
            );
        }
    }
    println!("headerless: of {all} real scans the right layout is guessed first for {first}");
    assert!(first * 10 >= all * 9, "{first} of {all}");
    std::fs::remove_dir_all(folder).unwrap();
}
