//! Maps of the difference between two surfaces against answers that are known: partners by trying everything around, offsets that were made,
//! one object scanned twice.
//!
//! `BREGMA_POINTS=10000` tries as many points a scan as docs/differences.md states; few are tried where it is not set.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod brute;
mod displacement;
mod known;
mod partners;
mod pictures;

use bregma_field::{Grid, Samples, Surface, Volume};
use bregma_tests::Random;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::sync::Arc;

/// How many points to try: as the environment says, else a few.
fn points(few: usize) -> usize {
    std::env::var("BREGMA_POINTS").ok().and_then(|n| n.parse().ok()).unwrap_or(few)
}

fn unit(random: &mut Random) -> DVec3 {
    DVec3::new(random.unit(), random.unit(), random.unit())
}

fn direction(random: &mut Random) -> DVec3 {
    loop {
        let v = unit(random) * 2.0 - 1.0;
        if (0.01..=1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

fn surface(volume: &Arc<Volume>, iso: f64) -> Surface {
    Surface::new(volume, iso, DAffine3::IDENTITY).unwrap()
}

/// A turn by `deg` about `middle` and a shift by `mm`, each in a random direction.
fn motion(random: &mut Random, middle: DVec3, deg: f64, mm: f64) -> DAffine3 {
    let turn = DQuat::from_axis_angle(direction(random), deg.to_radians());
    DAffine3::from_rotation_translation(turn, middle + mm * direction(random) - turn * middle)
}
