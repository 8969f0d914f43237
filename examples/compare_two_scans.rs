//! Compares two registered scans along a fan of rays: where both have bone, where only one has, and the mean of what each passes.
//!
//!     cargo run --release --example compare_two_scans -- [A B]

use bregma_field::Progress;
use bregma_measure::probe;
use bregma_renderer::Camera;
use bregma_session::{Opened, Source};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let scans: Vec<Source> = std::env::args().skip(1).map(|file| Source { file: file.into(), ..Source::default() }).collect();
    let progress = Progress::default();
    let opened = if scans.is_empty() { Opened::demo(64, &progress)? } else { Opened::read(&scans, &progress)? };

    // The rays of a small picture from anterior; the ledger of each says who is inside where.
    let camera = Camera::orbit(&opened.bounds(), 0.0, 0.0);
    let [mut both_mm, mut only_first_mm, mut only_second_mm] = [0.0; 3];
    for n in 0..32 * 32 {
        let found = probe(&opened.volumes, &opened.scene.layers, &camera.ray(f64::from(n % 32), f64::from(n / 32), 32, 32))?;
        for part in &found.ledger {
            match part.inside.as_slice() {
                [_, _] => both_mm += part.length_mm,
                [one] if *one == found.volumes[0].name => only_first_mm += part.length_mm,
                [_] => only_second_mm += part.length_mm,
                _ => {}
            }
        }
    }
    let all_mm = both_mm + only_first_mm + only_second_mm;
    let percent = |mm: f64| 100.0 * mm / all_mm;
    println!("of {all_mm:.0} mm of bone along 1024 rays both have {:.1} %", percent(both_mm));
    println!("only the first has {:.1} %, only the second {:.1} %", percent(only_first_mm), percent(only_second_mm));
    Ok(())
}
