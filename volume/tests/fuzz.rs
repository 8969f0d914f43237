//! Every reader on damaged files: no panic, nothing that takes 5 seconds, no memory beyond what a file of its length can hold.
//!
//! The damage is deterministic. A short run is part of the tests; `BREGMA_FUZZ_SECONDS=3600 cargo test --release -p bregma-volume --test fuzz
//! -- --nocapture` runs as long for each reader. `BREGMA_FUZZ_STATE=FOLDER` keeps there how far each form came, and a further run goes on from
//! it; without it, `BREGMA_FUZZ_SEED` begins elsewhere. A failure prints the case's number and leaves its files in the temporary folder.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::Progress;
use bregma_volume::formats::{Hints, Uneven, scan};
use peak_alloc::PeakAlloc;
use small::{Folder, Small};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Buffers, tables and histograms that do not depend on the file, with room for several threads.
const FIXED_BYTES: usize = 48 << 20;
/// What a form can unpack a byte to, twice over: packed and unpacked copies live side by side for a while.
fn bytes_per_byte(name: &str) -> usize {
    // The rest is deflate's, which is the most of all others.
    2 * if name.contains("Zarr") {
        // Chunks that are missing are the fill value.
        100_000
    } else if name.contains("JPEG 2000") || name.contains("JPEG-LS") {
        1 << 17
    } else if name.contains("LZW") {
        2600
    } else {
        1100
    }
}

const SLOW: Duration = Duration::from_secs(5);

/// PCG (O'Neill 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((((self.0 >> 18) ^ self.0) >> 27) as u32).rotate_right((self.0 >> 59) as u32) as usize
    }

    fn below(&mut self, n: usize) -> usize {
        self.next() % n.max(1)
    }
}

/// Texts that a header's numbers are replaced with.
const NUMBERS: [&str; 12] =
    ["0", "-1", "1", "65536", "4294967295", "99999999999999999999", "1e308", "nan", "inf", "-0", "9223372036854775807", "3"];

fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    // Headers are where the numbers are: half of all damage is done to the first bytes.
    let place = |bytes: &[u8], random: &mut Random| {
        let reach = if random.below(2) == 0 { bytes.len().min(400) } else { bytes.len() };
        random.below(reach)
    };
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = place(bytes, random);
        match random.below(9) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => bytes[at] = [0, 0xff, 0x7f, 0x80, 1][random.below(5)],
            3 => bytes.truncate(at),
            4 => {
                let value = [0, u64::MAX, 1 << 31, 1 << 62, 0x7fff_ffff_ffff_ffff, 0xffff_ffff][random.below(6)].to_le_bytes();
                let n = [2, 4, 8][random.below(3)].min(bytes.len() - at);
                bytes[at..at + n].copy_from_slice(&value[..n]);
            }
            5 => {
                let n = random.below(32).min(bytes.len() - at);
                let copy = bytes[at..at + n].to_vec();
                let to = place(bytes, random);
                bytes.splice(to..to, copy);
            }
            6 => drop(bytes.drain(at..(at + 1 + random.below(16)).min(bytes.len()))),
            7 => {
                let n = 1 + random.below(8);
                bytes.splice(at..at, (0..n).map(|_| random.next() as u8));
            }
            _ => {
                // A number in text is replaced by another.
                let Some(begin) = (at..bytes.len()).find(|&n| bytes[n].is_ascii_digit()) else { continue };
                let end = (begin..bytes.len()).find(|&n| !bytes[n].is_ascii_digit()).unwrap_or(bytes.len());
                bytes.splice(begin..end, NUMBERS[random.below(NUMBERS.len())].bytes());
            }
        }
    }
}

struct Fault {
    what: String,
    case: u64,
}

/// How far the damage of one form came in earlier runs: cases and seconds.
struct Kept {
    file: Option<PathBuf>,
    cases: u64,
    seconds: f64,
}

impl Kept {
    fn of(name: &str) -> Self {
        let file = std::env::var_os("BREGMA_FUZZ_STATE").map(|folder| Path::new(&folder).join(format!("{name}.txt")));
        let text = file.as_ref().and_then(|file| std::fs::read_to_string(file).ok()).unwrap_or_default();
        let mut words = text.split_whitespace();
        let cases = words.next().and_then(|n| n.parse().ok()).unwrap_or(0);
        Self { file, cases, seconds: words.next().and_then(|n| n.parse().ok()).unwrap_or(0.0) }
    }

    fn keep(&self) {
        let Some(file) = &self.file else { return };
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, format!("{} {:.1}\n", self.cases, self.seconds)).unwrap();
    }
}

fn run(small: &Small, seconds: f64, seed: u64, slowest: &Mutex<(Duration, String)>) -> (u64, u64, usize, Vec<Fault>) {
    let folder = Folder::new(&format!("fuzz-{}", small.name.replace(' ', "-")));
    let begin = Instant::now();
    let (mut cases, mut read, mut most, mut faults) = (0, 0, 0, vec![]);
    // What is being read, and since when, for whoever watches.
    let since = AtomicU64::new(u64::MAX);
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(100));
                let started = since.load(Ordering::Relaxed);
                if started != u64::MAX && begin.elapsed().as_millis() as u64 > started + 60_000 {
                    eprintln!("{}: a case does not end; its files are in {}", small.name, folder.0.display());
                    std::process::abort();
                }
            }
        });
        while begin.elapsed().as_secs_f64() < seconds {
            let case = seed + cases;
            let mut random = Random(case.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ small.name.len() as u64);
            let mut damaged = small.clone();
            let n = random.below(damaged.files.len());
            damage(&mut damaged.files[n].1, &mut random);
            let _ = std::fs::remove_dir_all(folder.0.join(small.name));
            let path = damaged.write(&folder);
            let length: usize = damaged.files.iter().map(|(_, bytes)| bytes.len()).sum();
            let uneven = if random.below(2) == 0 { Uneven::Even } else { Uneven::Resample };
            let hints = Hints { uneven, ..Hints::default() };
            MEMORY.reset_peak_usage();
            let before = MEMORY.current_usage();
            let started = Instant::now();
            since.store(begin.elapsed().as_millis() as u64, Ordering::Relaxed);
            let outcome = catch_unwind(AssertUnwindSafe(|| {
                let scanned = scan(&path, &hints, &Progress::default());
                let survey = scanned.and_then(|s| s.survey(&Progress::default()).map(drop));
                let loaded = scan(&path, &hints, &Progress::default()).and_then(|s| s.load(&Progress::default()).map(drop));
                assert_eq!(survey.is_ok(), loaded.is_ok(), "a survey and a reading disagree: {survey:?}, {loaded:?}");
                if let Err(e) = &loaded {
                    assert!(e.to_string().contains(": "), "a message without a reason");
                }
                loaded.is_ok()
            }));
            since.store(u64::MAX, Ordering::Relaxed);
            let took = started.elapsed();
            let used = MEMORY.peak_usage().saturating_sub(before);
            most = most.max(used);
            let mut fault = |what: String| faults.push(Fault { what, case });
            match outcome {
                Ok(ok) => read += u64::from(ok),
                Err(panic) => {
                    let text = panic.downcast_ref::<String>().cloned().or(panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
                    fault(format!("panic: {}", text.unwrap_or_default()));
                }
            }
            if took > SLOW {
                fault(format!("took {took:?}"));
            }
            if used > FIXED_BYTES + bytes_per_byte(small.name) * length {
                fault(format!("used {used} bytes for files of {length}"));
            }
            let mut slowest = slowest.lock().unwrap();
            if took > slowest.0 {
                *slowest = (took, small.name.to_owned());
            }
            cases += 1;
        }
        done.store(true, Ordering::Relaxed);
    });
    (cases, read, most, faults)
}

/// The smallest of the real scans.
fn real() -> Vec<Small> {
    let Some(data) = std::env::var_os("BREGMA_DATA").map(PathBuf::from) else {
        println!("skipped: the real scans, as BREGMA_DATA is not set");
        return vec![];
    };
    let one = |name, open: &'static str, file: &str| {
        let bytes = std::fs::read(data.join(file)).unwrap();
        Small { name, files: vec![(open.to_owned(), bytes)], open }
    };
    vec![
        one("a real NIfTI", "label.nii.gz", "mouse/low_res_template_UCHAR-label.nii.gz"),
        one("a real DICOM slice", "I10", "phantom-philips/tilted/I10"),
    ]
}

#[test]
fn no_damage_is_too_much_for_a_reader() {
    // Fails if a reader trusts a number, a length or an offset of a file.
    let number = |name: &str| std::env::var(name).ok().and_then(|s| s.parse::<f64>().ok());
    let (seconds, seed) = (number("BREGMA_FUZZ_SECONDS"), number("BREGMA_FUZZ_SEED").unwrap_or(0.0) as u64);
    let only = std::env::var("BREGMA_FUZZ_ONLY").ok();
    let scans: Vec<Small> = small::all().into_iter().chain(small::others()).chain(real()).collect();
    let scans: Vec<&Small> = scans.iter().filter(|s| only.as_ref().is_none_or(|o| s.name.contains(o.as_str()))).collect();
    let slowest = Mutex::new((Duration::ZERO, String::new()));
    // Faults are collected; their stack traces would bury the table.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let (mut all_cases, mut all_faults) = (0, vec![]);
    for small in scans {
        let seconds = seconds.unwrap_or(0.5);
        let before = Kept::of(small.name);
        let (cases, read, most, faults) = run(small, seconds, seed + before.cases, &slowest);
        let after = Kept { cases: before.cases + cases, seconds: before.seconds + seconds, ..before };
        after.keep();
        println!(
            "{}: {cases} cases, {read} of them still read, at most {:.1} MiB, {} faults; in all {} in {:.1} minutes",
            small.name,
            most as f64 / f64::from(1 << 20),
            faults.len(),
            after.cases,
            after.seconds / 60.0
        );
        all_cases += cases;
        for fault in faults.into_iter().take(20) {
            println!("  case {}: {}", fault.case, fault.what);
            all_faults.push(format!("{}, case {}: {}", small.name, fault.case, fault.what));
        }
    }
    std::panic::set_hook(hook);
    let (took, of) = slowest.into_inner().unwrap();
    println!("{all_cases} cases in all, {} faults; the slowest took {took:?} ({of})", all_faults.len());
    assert!(all_faults.is_empty(), "{all_faults:#?}");
}
