//! Whether a scan fits into memory, asked before it is read.

use super::ReadError;
use sysinfo::System;

/// What reading needs for each byte of samples that is kept: the samples themselves, their range bricks (1.6 % of u8) and the pieces
/// that are being unpacked (1/16 of the slices).
const OVERHEAD: f64 = 1.1;

/// Memory that opening `count` samples of `bytes` bytes each takes.
pub fn needed(count: u128, bytes: usize) -> u64 {
    (count as f64 * bytes as f64 * OVERHEAD) as u64
}

/// Refuses what does not fit into the memory that is free; `bytes_by` says what every n-th sample would take.
pub fn check(step: usize, bytes_by: impl Fn(usize) -> u64) -> Result<(), ReadError> {
    // A platform that does not tell is not asked again: running out is then an error of its own.
    let Ok(mut system) = System::new() else { return Ok(()) };
    system.refresh_memory();
    let free = system.cgroup_limits().map_or(u64::MAX, |c| c.free_memory).min(system.available_memory());
    if free == 0 || bytes_by(step) <= free {
        return Ok(());
    }
    let smaller: Vec<usize> = [2, 4].into_iter().filter(|&s| s > step && bytes_by(s) <= free).collect();
    Err(ReadError::TooLarge { needed: bytes_by(step), free, smaller })
}
