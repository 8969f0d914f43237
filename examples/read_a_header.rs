//! Says what a scan is by its headers alone: no sample is read.
//!
//!     cargo run --release --example read_a_header -- [SCAN…]

use bregma_field::Progress;
use bregma_field::formats::nrrd::{self, Compression};
use bregma_field::formats::{Hints, scan};
use bregma_session::Opened;
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let progress = Progress::default();
    let mut files: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    if files.is_empty() {
        // Something to read: one of the demo's skulls.
        files.push(std::env::temp_dir().join("bregma-example.nrrd"));
        nrrd::write(&files[0], &Opened::demo(32, &progress)?.volumes[0], Compression::Gzip, &progress)?;
    }
    for file in files {
        let scan = scan(&file, &Hints::default(), &progress)?;
        let grid = scan.grid();
        println!(
            "{}: {}, {:?} samples, {} mm apart, from {} mm (LPS)",
            scan.name(),
            scan.format(),
            grid.dims(),
            grid.spacing_mm(),
            grid.origin_mm()
        );
    }
    Ok(())
}
