//! The solvers over the hard families, on both backends, held to the record of their known failures.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::stability::{self, Of, Row, families};
use bregma_renderer::{CpuRenderer, GpuRenderer, Renderer, Solver};
use bregma_volume::Progress;
use std::collections::HashMap;

/// The rows of failing solvers, on the CPU where they exist there; `filter` is a software driver's, as each card rounds its own way. To
/// change the record, say why in the commit: the test writes what it found to `tests/out/known_failures.csv`.
const RECORD: &str = include_str!("../known_failures.csv");

/// Columns of a line after family, backend and solver; `None` where it is empty.
type Numbers = Vec<Option<f64>>;

/// The lines of a table by family and solver.
fn numbers(csv: &str) -> HashMap<(String, String), Numbers> {
    let line = |l: &str| {
        let fields: Vec<&str> = l.split(',').collect();
        let numbers = fields[3..].iter().map(|f| (!f.is_empty()).then(|| f.parse().unwrap())).collect();
        ((fields[0].to_owned(), fields[2].to_owned()), numbers)
    };
    csv.lines().skip(1).map(line).collect()
}

/// Whether a column has become another: another driver's or processor's rounding moves a few segments across, a tenth is a change of the
/// method.
fn differs(column: &str, found: f64, known: f64) -> bool {
    match column {
        // Errors, of the order of what is not noise.
        _ if column.ends_with("_voxel") => found.max(known) > 2e-3 && !(0.5..2.0).contains(&(found / known)),
        // Five of 20,000.
        _ if column.ends_with("_per_million") => (found - known).abs() > 250.0 + 0.1 * known,
        _ => (found - known).abs() > 5.0 + 0.1 * known,
    }
}

/// Families of which more than 2 in 100 are beyond float32, and how many at most: what is not judged proves nothing.
const BEYOND_FLOAT32: [(&str, u32); 6] = [
    ("plateau", 15),
    ("double root 1e-6", 100),
    ("double root 1e-12", 100),
    ("near miss 1e-6", 99),
    ("leading 1e7", 50),
    ("clipped corner", 27),
];

#[test]
fn exact_never_fails_and_the_others_fail_as_recorded() {
    // Fails if `exact` misses, invents, confuses, miscounts, loses at a face or doubles a root that float32 can decide, or is off by more
    // than 5e-5 voxel in a segment or 1e-3 in a picture, on either backend; or if another solver gets better or worse than its record.
    let mut gpu = GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run");
    let mut cpu = CpuRenderer::default();
    let rows = stability::run(&mut [&mut cpu, &mut gpu], &Progress::default()).unwrap();
    print!("{}", stability::csv(&rows));
    assert_eq!(rows.len(), families().count() * (Solver::ALL.len() * 2 - 1));

    for row in rows.iter().filter(|r| r.solver == Solver::Exact) {
        assert!(!row.fails(), "{row:?}");
        let most = if row.of == Of::Rays { 1e-3 } else { 5e-5 };
        assert!(row.error_voxel.is_none_or(|e| e.max <= most), "{row:?}");
        let beyond = BEYOND_FLOAT32.iter().find(|(family, _)| *family == row.family).map_or(2, |b| b.1);
        assert!(row.undecidable * 100 <= (row.judged + row.undecidable) * beyond, "{row:?} proves little");
    }

    let on_cpu = |r: &&Row| r.backend == "cpu" || !r.solver.on_cpu();
    let failing: Vec<Row> = rows.iter().filter(on_cpu).filter(|r| r.fails()).cloned().collect();
    let out = concat!(env!("CARGO_MANIFEST_DIR"), "/out");
    std::fs::create_dir_all(out).unwrap();
    std::fs::write(format!("{out}/known_failures.csv"), stability::csv(&failing)).unwrap();

    let header = stability::csv(&[]);
    let columns: Vec<&str> = header.trim_end().split(',').skip(3).collect();
    assert_eq!(RECORD.lines().next(), Some(header.trim_end()), "the record has other columns");
    let record = numbers(RECORD);
    let mut off_record = Vec::new();
    let on_record = |r: &&Row| r.solver != Solver::Exact && (r.solver.on_cpu() || gpu.name().ends_with("a software driver"));
    for row in rows.iter().filter(on_record) {
        let key = (row.family.to_owned(), row.solver.to_string());
        let found = numbers(&stability::csv(std::slice::from_ref(row))).remove(&key).unwrap();
        let known = record.get(&key);
        for (n, (column, found)) in columns.iter().zip(found).enumerate() {
            // Without a record only failures count: how many were judged is the family's affair.
            let known = match known {
                Some(known) => known[n],
                None if n < 2 || *column == "counted" || *column == "faces" => continue,
                None => found.map(|_| 0.0),
            };
            match (found, known) {
                (Some(found), Some(known)) if !differs(column, found, known) => {}
                (None, None) => {}
                _ => off_record.push(format!("{} {} {}: {column} is {found:?}, on record {known:?}", row.family, row.backend, row.solver)),
            }
        }
    }
    assert!(off_record.is_empty(), "{off_record:#?}");
}
