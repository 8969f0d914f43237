//! Casts a difference ray through scans and prints every stretch of bone, and how much more of it a second scan has, with 95 % intervals.
//!
//!     cargo run --release --example measure_a_ray -- [SCAN…]

use bregma_field::{Progress, Ray, WorldPoint};
use bregma_measure::export::{difference, of_their_errors};
use bregma_measure::probe;
use bregma_session::{Opened, Source};
use glam::DVec3;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let scans: Vec<Source> = std::env::args().skip(1).map(|file| Source { file: file.into(), ..Source::default() }).collect();
    let progress = Progress::default();
    let opened = if scans.is_empty() { Opened::demo(64, &progress)? } else { Opened::read(&scans, &progress)? };

    // From anterior to posterior, through the middle of what is open; the demo's is cast through the frontal bone.
    let through = if scans.is_empty() { DVec3::new(0.0, 0.0, 40.0) } else { opened.bounds().centre_mm };
    let ray = Ray::new(WorldPoint(through - 1000.0 * DVec3::Y), DVec3::Y).ok_or("a ray without a direction")?;
    let found = probe(&opened.volumes, &opened.scene.layers, &ray)?;
    for pair in &found.pairs {
        println!("difference of {} and {}: {}", pair.b, pair.a, of_their_errors(pair));
        pair.differences.iter().for_each(|d| println!("  {}", difference(d)));
    }
    for scan in found.volumes {
        for bone in scan.segments {
            println!("{}: {:.2} ± {:.2} mm of bone, from {:.2} mm on", scan.name, bone.length_mm, bone.uncertainty.error_mm, bone.from_mm);
        }
    }
    Ok(())
}
