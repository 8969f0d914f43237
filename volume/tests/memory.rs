//! What reading needs: the samples and a tenth of them, and of a survey next to nothing. Fails if a reader holds a second copy of a scan.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::Progress;
use bregma_volume::formats::{Hints, open, scan, write};
use peak_alloc::PeakAlloc;
use small::Folder;
use std::path::{Path, PathBuf};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Buffers that do not grow with the scan: a mebibyte of bytes and what unpacks them, counts of all 16-bit values on each thread.
const FIXED_BYTES: usize = 8 << 20;

fn measure(path: &Path) {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let survey = scan(path, &Hints::default(), &Progress::default()).unwrap().survey(&Progress::default()).unwrap();
    let surveying = MEMORY.peak_usage() - before;
    drop(survey);
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let volume = open(path, &Hints::default(), &Progress::default()).unwrap();
    let (reading, samples) = (MEMORY.peak_usage() - before, volume.sample_bytes());
    let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
    println!(
        "{name}: {:.1} MiB of samples; reading them needs {:.1} MiB ({:.1} %), a survey {:.1} MiB",
        mib(samples),
        mib(reading),
        100.0 * reading as f64 / samples as f64,
        mib(surveying)
    );
    assert!(reading <= samples + samples / 10 + FIXED_BYTES, "{name}: {reading} bytes for {samples}");
    assert!(surveying <= samples / 10 + FIXED_BYTES, "{name}: a survey needs {surveying} bytes for {samples}");
}

#[test]
fn reading_needs_the_samples_and_a_tenth() {
    let folder = Folder::new("memory-of-readers");
    // 64 MiB of u8 and 128 MiB of i32 that fit 16 bits.
    let raw = folder.put("a_512x512x256_uint8.raw", &(0..512 * 512 * 256).map(|n: u32| (n >> 3) as u8).collect::<Vec<u8>>());
    let header = "NRRD0004\ntype: int\ndimension: 3\nsizes: 256 256 512\nspacings: 1 1 1\nendian: little\nencoding: raw\n\n";
    let wide: Vec<u8> = (0..256 * 256 * 512).flat_map(|n: i32| (n % 5000).to_le_bytes()).collect();
    let mut files = vec![folder.put("wide.nrrd", &[header.as_bytes(), &wide].concat())];
    drop(wide);
    let volume = open(&raw, &Hints::default(), &Progress::default()).unwrap();
    for name in ["b.nii.gz", "b.tif", "b.mha"] {
        write(&folder.0.join(name), &volume, &Progress::default()).unwrap();
        files.push(folder.0.join(name));
    }
    drop(volume);
    files.push(raw);
    match std::env::var_os("BREGMA_DATA").map(PathBuf::from) {
        None => println!("skipped: the real scans, as BREGMA_DATA is not set"),
        Some(data) => {
            let real = ["phantom-philips/straight", "cthead-unc/CThead.nhdr", "mouse/35_mic_23strain_mus_template_UCHAR-label.nii.gz"];
            files.extend(real.map(|file| data.join(file)));
        }
    }
    files.iter().for_each(|file| measure(file));
}
