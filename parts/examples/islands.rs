//! How long the islands of a scan take, for `benches/islands.py`: seconds of each of so many rounds, and the numbers of the largest of them as bytes.
//!
//!     cargo run --release -p bregma-parts --example islands -- SCAN ISO ROUNDS [NUMBERS.raw]

use bregma_field::formats::{Hints, open};
use bregma_field::{Progress, Surface};
use bregma_parts::Islands;
use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [scan, iso, rounds, rest @ ..] = words.as_slice() else { return Err("name a scan, an isovalue and how many rounds".into()) };
    let progress = Progress::default();
    let volume = Arc::new(open(scan.as_ref(), &Hints::default(), &progress)?);
    let surface = Surface::new(&volume, iso.parse()?, Default::default())?;
    for round in 0..rounds.parse()? {
        let begin = Instant::now();
        let islands = Islands::of_bone(&surface, &progress)?;
        let found = begin.elapsed().as_secs_f64();
        let count = islands.sizes().len().min(usize::from(u16::MAX));
        let chosen: Vec<(usize, String)> = (0..count).map(|n| (n, format!("Island {}", n + 1))).collect();
        let labels = islands.labels(volume.grid(), &chosen)?;
        println!("{found} {} {}", begin.elapsed().as_secs_f64(), islands.sizes().len());
        if let (0, [out]) = (round, rest) {
            bregma_parts::write(out.as_ref(), &labels, &progress)?;
        }
    }
    Ok(())
}
