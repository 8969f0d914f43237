//! The solvers over the hard families, on both backends, held to the record of their known failures.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::stability::{self, FAMILIES, Row};
use bregma_renderer::{GpuRenderer, Solver};
use bregma_volume::Progress;

/// The rows of failing solvers on the CPU, as `bregma stability --backend cpu` writes them. To change the record, say why in the commit:
/// `bregma stability --backend cpu --out DIR`, then keep the header and the lines with failures, or with a p99.9 above 1e-3.
const RECORD: &str = include_str!("../known_failures.csv");

/// The numbers of a line of the record.
fn recorded(row: &Row) -> Option<[f64; 5]> {
    let line = RECORD.lines().skip(1).find(|l| l.starts_with(&format!("{},cpu,{},", row.family, row.solver)))?;
    let fields: Vec<f64> = line.split(',').skip(5).map(|f| f.parse().unwrap()).collect();
    Some([fields[0], fields[1], fields[2], fields[4], fields[5]])
}

#[test]
fn exact_never_fails_and_the_others_fail_as_recorded() {
    // Fails if `exact` misses, invents or confuses a root that float32 can decide, or is off by more than 5e-5 voxel, on either
    // backend; or if another solver gets better or worse than its record.
    let mut gpu = GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run");
    let rows = stability::run(Some(&mut gpu), &Progress::default()).unwrap();
    print!("{}", stability::csv(&rows));
    assert_eq!(rows.len(), FAMILIES.len() * 9 * 2);
    let mut off_record = Vec::new();
    for row in &rows {
        let found = [f64::from(row.missed), f64::from(row.false_hits), f64::from(row.wrong_root)];
        if row.solver == Solver::Exact {
            assert_eq!(found, [0.0; 3], "{row:?}");
            assert!(row.worst <= 5e-5, "{row:?}");
            continue;
        }
        match recorded(row) {
            Some(known) => {
                // Another driver's or processor's rounding moves a few segments across; a tenth is a change of the method.
                let count_differs = (0..3).any(|n| (found[n] - known[n]).abs() > 5.0 + 0.1 * known[n]);
                let error_differs = row.p999 > 1e-3 && !(0.5..2.0).contains(&(row.p999 / known[3]));
                if count_differs || error_differs {
                    off_record.push(format!("{row:?} is recorded as {known:?}"));
                }
            }
            None => {
                if found.iter().any(|&n| n > 5.0) || row.p999 > 2e-3 {
                    off_record.push(format!("{row:?} is not on record"));
                }
            }
        }
    }
    assert!(off_record.is_empty(), "{off_record:#?}");
}
