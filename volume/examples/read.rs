//! Opens a scan as the program does and prints the seconds that it took, for `benches/reading.py`.

use bregma_volume::Progress;
use bregma_volume::formats::{Hints, open};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args_os().nth(1).ok_or("name a scan")?;
    let begin = Instant::now();
    let volume = open(path.as_ref(), &Hints::default(), &Progress::default())?;
    println!("{} {}", begin.elapsed().as_secs_f64(), volume.sample_bytes());
    Ok(())
}
