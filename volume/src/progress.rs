//! How far long work has come, and the wish to stop it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Shared between the thread that works and whoever watches it. Units are the work's own (bytes of a file, slabs of a phantom).
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicU64,
    total: AtomicU64,
    slices: AtomicU64,
    of_slices: AtomicU64,
    cancelled: AtomicBool,
}

/// The work was stopped by request.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

impl Progress {
    /// States how much there is to do and starts from nothing done.
    pub fn begin(&self, total: u64) {
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
        self.of_slices.store(0, Ordering::Relaxed);
    }

    /// Says that the work is the reading of a scan, of which `slices` of `of` are there.
    pub fn reached(&self, slices: u64, of: u64) {
        self.slices.store(slices, Ordering::Relaxed);
        self.of_slices.store(of, Ordering::Relaxed);
    }

    /// How far it is in words: bytes and slices while a scan is read, else a percentage.
    pub fn text(&self) -> String {
        let [done, total, slices, of] = [&self.done, &self.total, &self.slices, &self.of_slices].map(|n| n.load(Ordering::Relaxed));
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        match of {
            0 => format!("{:.0} %", 100.0 * self.fraction()),
            _ => format!("{:.1} of {:.1} MiB, slice {slices} of {of}", mib(done.min(total)), mib(total)),
        }
    }

    /// Counts `amount` more as done; fails when the work should stop.
    pub fn advance(&self, amount: u64) -> Result<(), Cancelled> {
        self.done.fetch_add(amount, Ordering::Relaxed);
        if self.cancelled.load(Ordering::Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    /// Asks the work to stop at its next step.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// The part that is done, 0 to 1; 0 while the total is unknown.
    pub fn fraction(&self) -> f32 {
        let total = self.total.load(Ordering::Relaxed);
        if total == 0 { 0.0 } else { (self.done.load(Ordering::Relaxed) as f32 / total as f32).min(1.0) }
    }
}
