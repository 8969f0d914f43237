//! `bregma filter`: a scan of filtered samples.

use crate::cli::args::FilterArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{warn, with_progress};
use bregma_field::filters::{Filter, filtered};
use bregma_field::{Volume, formats};
use bregma_session::InputError;

/// Reads a scan, filters it, and writes it in the form that the name of the output asks for.
pub fn filter(args: &FilterArgs) -> Result<(), CommandError> {
    let [source] = args.sources.0.as_slice() else {
        return Err(CommandError::Usage(format!("{} scans are named; one is filtered", args.sources.0.len())));
    };
    if source.transform.is_some() {
        return Err(CommandError::Usage("--transform is for looking and measuring; a scan is filtered as it lies".into()));
    }
    let volume = with_progress("reading", |progress| source.scan(progress)?.load(progress)).map_err(InputError::from)?;
    warn(&volume.warnings().iter().map(|w| format!("{}: {w}", volume.name())).collect::<Vec<_>>());
    if args.median.is_none() && !volume.spacing_is_stated() {
        return Err(CommandError::NoSpacing(volume.name().to_owned()));
    }
    let filter = asked(args, &volume)?;
    let made = with_progress("filtering", |progress| filtered(&volume, filter, progress)).map_err(InputError::from)?;
    let lost = with_progress("writing", |progress| formats::write(&args.out, &made, progress))?;
    warn(&lost.iter().map(|w| format!("{}: {w}", args.out.display())).collect::<Vec<_>>());
    Ok(())
}

fn asked(args: &FilterArgs, volume: &Volume) -> Result<Filter, CommandError> {
    if let Some(sigma_mm) = args.gaussian {
        return Ok(Filter::Gaussian { sigma_mm });
    }
    if let Some(radius) = args.median {
        return Ok(Filter::Median { radius: radius.into() });
    }
    let stable = volume.grid().spacing_mm().min_element() / 16.0;
    let of = |n: usize, default: f64| args.diffuse.get(n).copied().unwrap_or(default);
    let (iterations, conductance, time_step) = (of(0, 1.0), of(1, 1.0), of(2, stable));
    if args.diffuse.len() > 3 {
        return Err(CommandError::Usage("--diffuse takes three numbers at most: iterations, conductance and time step".into()));
    }
    if iterations.fract() != 0.0 || iterations > 1e6 {
        return Err(CommandError::Usage(format!("--diffuse {iterations}: iterations are a whole number, a million at most")));
    }
    // Written with few digits it may be a last place above.
    if time_step > stable * 1.000_001 {
        return Err(CommandError::Usage(format!(
            "--diffuse: a time step of {time_step} is not stable on this scan; take {stable} or less, and more iterations"
        )));
    }
    Ok(Filter::Diffusion { iterations: iterations as usize, conductance, time_step })
}
