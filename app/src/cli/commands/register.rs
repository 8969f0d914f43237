//! `bregma register`: one scan moved onto another.

use crate::cli::args::RegisterArgs;
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::terminal::{print, warn, with_progress};
use bregma_measure::numbers::fixed;
use bregma_register::Parts;
use bregma_register::landmarks::Freedom;
use bregma_session::Opened;
use bregma_session::register::{By, Order, Registered, register as bring_together, write};
use std::path::Path;

/// Moves the first scan onto the second, and writes how.
pub fn register(args: &RegisterArgs) -> Result<(), CommandError> {
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    if opened.volumes.len() != 2 {
        return Err(CommandError::Usage(format!("{} scans are named; a registration is of two", opened.volumes.len())));
    }
    require_spacing(&opened)?;
    take_landmarks(&mut opened, args)?;
    let registered = with_progress("registering", |progress| -> Result<_, CommandError> {
        let mut order = order(args);
        if order.by != By::Landmarks && !args.anywhere {
            let own = opened.scene.layers[1].transform.inverse() * opened.scene.layers[0].transform;
            let by_landmarks = Order { by: By::Landmarks, ..order.clone() };
            // Landmarks are a start where they make one.
            let led = if args.landmarks.is_empty() { None } else { Some(bring_together(&opened, NUMBERS, &by_landmarks, progress)?) };
            order.start = Some(led.map_or(own, |led| led.registration.transform));
        }
        let registered = bring_together(&opened, NUMBERS, &order, progress)?;
        write(&args.out, &opened, NUMBERS, &order, &registered)?;
        Ok(registered)
    })?;
    warn(&registered.report.notes);
    print(&told(&opened, &registered, &args.out))
}

/// The first scan is moved onto the second.
const NUMBERS: [usize; 2] = [0, 1];

fn take_landmarks(opened: &mut Opened, args: &RegisterArgs) -> Result<(), CommandError> {
    for (n, file) in args.landmarks.iter().enumerate() {
        let first = opened.landmarks.len();
        opened.take_landmarks(file)?;
        let name = opened.volumes[n].name().to_owned();
        opened.landmarks[first..].iter_mut().for_each(|l| l.scan = Some(name.clone()));
    }
    if args.by == By::Landmarks && opened.landmarks.is_empty() {
        return Err(CommandError::Usage("--by landmarks needs --landmarks MOVED STAYS".into()));
    }
    Ok(())
}

fn order(args: &RegisterArgs) -> Order {
    let freedom = match (args.similarity, args.affine) {
        (true, _) => Freedom::Similarity,
        (_, true) => Freedom::Affine,
        _ => Freedom::Rigid,
    };
    let parts = Parts { only: args.only.clone(), but: args.but.clone() };
    Order { by: args.by, freedom, left_out: args.leave_out.clone(), parts, start: None }
}

/// How well they lie on each other, in short.
fn told(opened: &Opened, registered: &Registered, file: &Path) -> String {
    let mm = |v: f64| fixed(v, 4);
    let mut text = format!("{} onto {}\n", opened.volumes[0].name(), opened.volumes[1].name());
    let mut line = |words: String| text += &format!("  {words}\n");
    let pairs = &registered.report.landmarks;
    if !pairs.is_empty() {
        line("landmark                 residual   left out      shift  mm".into());
        for p in pairs {
            let some = |v: Option<f64>| v.map_or("–".to_owned(), |v| fixed(v, 3));
            let mark = if !p.used {
                "  left out"
            } else if p.is_outlier {
                "  far off"
            } else {
                ""
            };
            line(format!("{:<24} {:>8} {:>10} {:>10}{mark}", p.name, fixed(p.residual_mm, 3), some(p.left_out_mm), some(p.shift_mm)));
        }
    }
    if let Some(rms) = registered.registration.residual_mm {
        line(format!("residual  {} mm, root mean square", mm(rms)));
    }
    if let Some(i) = &registered.report.intensities {
        line(format!(
            "values    correlation {}; {} % of them count; {} mm from where surfaces led",
            fixed(i.correlation, 4),
            fixed(100.0 * i.matched, 0),
            mm(i.moved_mm)
        ));
    }
    if let Some(s) = &registered.report.surfaces {
        line(format!(
            "surfaces  {} mm apart along normals (median), spread {} mm; {} % have partners",
            mm(s.median_mm),
            mm(s.spread_mm),
            fixed(100.0 * s.matched, 0)
        ));
        line(format!("offset    {} mm: the moved surface stands out so far everywhere", mm(s.offset_mm)));
        let what = if s.is_of_two { "spread of the choice" } else { "standard deviation" };
        line(format!("middle    {}, {}, {} mm ({what})", mm(s.middle_mm.x), mm(s.middle_mm.y), mm(s.middle_mm.z)));
    }
    format!("{text}{}\n", file.display())
}
