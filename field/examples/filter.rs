//! How long a filter takes, for `benches/filters.py`: seconds of each of so many rounds; the scan that it makes is written.
//!
//!     cargo run --release -p bregma-field --example filter -- SCAN OUT ROUNDS gaussian MM | median N | diffusion N C T

use bregma_field::Progress;
use bregma_field::filters::{Filter, filtered};
use bregma_field::formats::{Hints, open, write};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let [scan, out, rounds, filter @ ..] = words.as_slice() else {
        return Err("name a scan, a file to write, how many rounds and a filter".into());
    };
    let filter = match filter {
        ["gaussian", mm] => Filter::Gaussian { sigma_mm: mm.parse()? },
        ["median", radius] => Filter::Median { radius: radius.parse()? },
        ["diffusion", n, c, t] => Filter::Diffusion { iterations: n.parse()?, conductance: c.parse()?, time_step: t.parse()? },
        other => return Err(format!("{other:?} is no filter").into()),
    };
    let progress = Progress::default();
    let volume = open(scan.as_ref(), &Hints::default(), &progress)?;
    for round in 0..rounds.parse()? {
        let begin = Instant::now();
        let made = filtered(&volume, filter, &progress)?;
        println!("{}", begin.elapsed().as_secs_f64());
        if round == 0 {
            write(out.as_ref(), &made, &progress)?;
        }
    }
    Ok(())
}
