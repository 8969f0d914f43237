//! The scans of a command line, each with the options that stand behind it.

use super::parsers::{number, part_of, positive, raw, reduce, spacing, turn, uneven};
use bregma_field::Turn;
use bregma_field::formats::{Reduce, Uneven};
use bregma_session::{PartOf, Raw, Source};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use glam::DVec3;
use std::path::PathBuf;

/// Scans with what belongs to each: `--transform`, `--turn`, `--spacing`, `--reduce`, `--uneven` and `--raw` apply to the file before
/// them; all but the first, given before the first file, apply to all. At least `MIN` files.
#[derive(Clone, Debug)]
pub struct Sources<const MIN: usize>(pub Vec<Source>);

impl<const MIN: usize> Args for Sources<MIN> {
    fn augment_args(command: Command) -> Command {
        let path = || clap::value_parser!(PathBuf);
        // Options may stand between files, and each stretch of files is counted by itself: how many there are is asked later.
        let files = Arg::new("files").value_name("FILE").value_parser(path()).num_args(MIN.min(1)..).required(MIN > 0);
        let option = |name: &'static str, value: &'static str| Arg::new(name).long(name).value_name(value).action(ArgAction::Append);
        command
            .arg(
                files
                    .help("A scan, the folder or zip of a DICOM series (FOLDER#NUMBER where there are several) or of slices, or a session; \
                         among scans also landmarks (.mrk.json, .fcsv, .tps, .csv) and a registration, of the scan that it names, or of the \
                         second of two"),
            )
            .arg(
                option("transform", "FILE").value_parser(path()).help(
                    "Registration of the scan before it: JSON (4×4 rows; R and t; or pairs, chosen by name or FILE#NAME) or ITK .tfm, .h5",
                ),
            )
            .arg(
                option("spacing", "X,Y,Z")
                    .value_parser(spacing)
                    .help("Sample spacing of the scan before it, mm, where its file states none, or instead of what it states"),
            )
            .arg(option("turn", "RAS").value_parser(turn).help(
                "Turns the scan before it about its middle: what its left, posterior and superior really are, a letter of each of L/R, P/A \
                 and S/I; RAS is one that faces backward, LAI and RPI stand on their heads. A mirror image says so: RPS,mirror",
            ))
            .arg(option("reduce", "2|4").value_parser(reduce).help(
                "Read only every 2nd or 4th sample along each axis of the scan before it: a preview that needs 1/8 or 1/64 of the memory",
            ))
            .arg(
                option("uneven", "even|resample|refuse")
                    .value_parser(uneven)
                    .help("Slices of the scan before it that are not evenly spaced: interpolate them, refuse them, or take those that jitter as even and refuse the others [default: even]"),
            )
            .arg(option("within", "FILE[#NAME]").value_parser(part_of).help(
                "Only a part of the scan before it: a label map (.seg.nrrd, NIfTI) with the names of parts in it, with commas between; all parts \
                 without a name. What is measured is measured of the part",
            ))
            .arg(
                option("without", "FILE[#NAME]").value_parser(part_of).help("All of the scan before it but a part, such as a table: see --within"),
            )
            .arg(option("grow", "MM").value_parser(number).allow_hyphen_values(true).help(
                "Grow the part of the scan before it that --within or --without names by so much, mm; shrink it where negative",
            ))
            .arg(option("rim", "MM").value_parser(positive).help(
                "Shade bone so far behind the face of that part by a blend of the part's normal and the bone's, mm",
            ))
            .arg(option("raw", "LAYOUT").value_parser(raw).help("The scan before it is headerless: WxHxD,u8|u16|i16|f32[,be][,skip=N]"))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<const MIN: usize> FromArgMatches for Sources<MIN> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let placed = |name: &str| matches.indices_of(name).into_iter().flatten().collect::<Vec<_>>();
        let files = matches.get_many::<PathBuf>("files").into_iter().flatten();
        let mut sources: Vec<Source> = files.map(|f| Source { file: f.clone(), ..Source::default() }).collect();
        let at = placed("files");
        // Each option belongs to the last file before it; `None` is before all.
        let owner = |index: usize| at.iter().rposition(|&file| file < index);
        for (index, file) in placed("transform").into_iter().zip(matches.get_many::<PathBuf>("transform").into_iter().flatten()) {
            let n = owner(index).ok_or_else(|| usage("--transform applies to the scan before it: name the scan first"))?;
            sources[n].transform = Some(file.clone());
        }
        // The others, before all files, are for each of them.
        fn each<T: Clone + Send + Sync + 'static>(
            matches: &ArgMatches,
            sources: &mut [Source],
            name: &str,
            owner: impl Fn(usize) -> Option<usize>,
            mut set: impl FnMut(&mut Source, T),
        ) {
            let indices = matches.indices_of(name).into_iter().flatten();
            for (index, value) in indices.zip(matches.get_many::<T>(name).into_iter().flatten()) {
                let first = owner(index);
                let owned = sources.iter_mut().enumerate().filter(|(n, _)| first.is_none_or(|f| f == *n));
                owned.for_each(|(_, source)| set(source, value.clone()));
            }
        }
        each::<DVec3>(matches, &mut sources, "spacing", owner, |s, mm| s.spacing_mm = Some(mm));
        each::<Turn>(matches, &mut sources, "turn", owner, |s, turn| s.turn = turn);
        each::<PartOf>(matches, &mut sources, "within", owner, |s, part| s.within = Some(part));
        each::<PartOf>(matches, &mut sources, "without", owner, |s, part| s.within = Some(PartOf { keeps: false, ..part }));
        let part = |s: &mut Source, set: &dyn Fn(&mut PartOf)| s.within.as_mut().map(set);
        let mut is_part = true;
        each::<f64>(matches, &mut sources, "grow", owner, |s, mm| is_part &= part(s, &|part| part.grow_mm = mm).is_some());
        each::<f64>(matches, &mut sources, "rim", owner, |s, mm| is_part &= part(s, &|part| part.rim_mm = mm).is_some());
        if !is_part {
            return Err(usage("--grow and --rim are of a part: name it by --within or --without behind the same scan"));
        }
        each::<Raw>(matches, &mut sources, "raw", owner, |s, raw| s.raw = Some(raw));
        each::<Reduce>(matches, &mut sources, "reduce", owner, |s, reduce| s.reduce = Some(reduce));
        each::<Uneven>(matches, &mut sources, "uneven", owner, |s, uneven| s.uneven = uneven);
        Ok(Self(sources))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// A usage error with status 2, in clap's form.
fn usage(message: &str) -> clap::Error {
    clap::Error::raw(clap::error::ErrorKind::ValueValidation, format!("{message}\n"))
}
