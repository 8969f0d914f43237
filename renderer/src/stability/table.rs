//! The rows as CSV for statistics, and as a table for people with a line of reason where a method fails.

use super::{Of, Row, families};
use crate::roots::Solver;

const CSV_HEADER: &str = "family,backend,solver,judged,undecidable,missed,false,wrong_root,counted,wrong_count,faces,cracks_per_million,\
                          double_hits_per_million,p50_voxel,p99.9_voxel,worst_voxel";

/// All rows. What does not apply to a family is empty.
pub fn csv(rows: &[Row]) -> String {
    let line = |r: &Row| {
        let answers = match r.judged {
            0 => ",,".to_owned(),
            _ => format!("{},{},{}", r.missed, r.false_hits, r.wrong_root),
        };
        let counts = r.counts.map_or(",".to_owned(), |c| format!("{},{}", c.judged, c.wrong));
        let faces = r.faces.map_or(",,".to_owned(), |f| {
            let [cracks, double_hits] = [f.cracks, f.double_hits].map(|n| per(n, f.passed, 1e6));
            format!("{},{cracks:.1},{double_hits:.1}", f.passed)
        });
        let errors = r.error_voxel.map_or(",,".to_owned(), |e| format!("{:.2e},{:.2e},{:.2e}", e.p50, e.p999, e.max));
        format!("{},{},{},{},{},{answers},{counts},{faces},{errors}\n", r.family, r.backend, r.solver, r.judged, r.undecidable)
    };
    format!("{CSV_HEADER}\n{}", rows.iter().map(line).collect::<String>())
}

/// n of `of`, as a rate in `many`.
fn per(n: u32, of: u32, many: f64) -> f64 {
    f64::from(n) * many / f64::from(of)
}

const HEAD: &str = "# Where solvers fail

Each family is a way to make cells, or volumes and views, that are hard. Every solver answers, on each backend that has it, and is judged
against float64. What float32 cannot decide is not judged: segments of a cell whose answer changes when values are moved by 16 units in
their last place, rays whose answer changes when they are moved sideways by 1e-5 voxel.

- **missed, false, wrong root**: of 10,000 judged; entries not found, found where none is, and nearer to a later crossing.
- **wrong count**: of 10,000 segments with crossings that are well apart, those where going on behind each root gives another number of
  entries.
- **cracks, double hits**: of a million faces between two cells, with the surface within rounding of where the ray passes the face:
  entries found in neither cell, or in both.
- **p99.9, largest**: error of the entries found, in voxels.
- Fixed steps in segments are judged as if sampling began at each cell's entry; `filter` samples a face anew in each cell, as it does
  at the borders of bricks.

`bregma stability --out DIR` makes this table and its CSV.
";

/// A section for each family: what is hard about it, and how each solver does.
pub fn markdown(rows: &[Row]) -> String {
    let mut out = String::from(HEAD);
    for (family, about) in families() {
        let of_family: Vec<&Row> = rows.iter().filter(|r| r.family == family).collect();
        let Some(first) = of_family.first() else { continue };
        let all = first.judged + first.undecidable;
        out += &match first.of {
            Of::Segments => format!("\n## {family}\n{about}; {all} segments, {} beyond float32", first.undecidable),
            // How many are beyond float32 differs from solver to solver, as only answers that are not the reference's are looked into.
            Of::Rays => format!("\n## {family}\n{about}; {all} rays"),
        };
        out += "\n";
        if first.judged == 0 {
            continue;
        }
        out += "\n| solver | backend | missed / false / wrong root | wrong count | cracks / double hits | p99.9 | largest | why |\n";
        out += "|---|---|---|---|---|---|---|---|\n";
        // Backends that do equally share a line.
        let mut lines: Vec<(Solver, String, String)> = Vec::new();
        for r in of_family {
            let results = results(r);
            match lines.last_mut() {
                Some((solver, backends, known)) if *solver == r.solver && *known == results => *backends += &format!(", {}", r.backend),
                _ => lines.push((r.solver, r.backend.to_owned(), results)),
            }
        }
        out += &lines.iter().map(|(solver, backends, results)| format!("| {solver} | {backends} | {results} |\n")).collect::<String>();
    }
    out
}

/// The columns of a row in which something was judged, from the rates on.
fn results(r: &Row) -> String {
    let [missed, false_hits, wrong] = [r.missed, r.false_hits, r.wrong_root].map(|n| per(n, r.judged, 1e4));
    let counts = r.counts.map_or(String::new(), |c| format!("{:.1}", per(c.wrong, c.judged, 1e4)));
    let faces = r.faces.map_or(String::new(), |f| {
        let [cracks, double_hits] = [f.cracks, f.double_hits].map(|n| per(n, f.passed, 1e6));
        format!("{cracks:.0} / {double_hits:.0}")
    });
    // No float32 position in a cell resolves less.
    let error = |voxel: f64| if voxel < 1e-6 { "<1e-6".to_owned() } else { format!("{voxel:.0e}") };
    let errors = r.error_voxel.map_or(" | ".to_owned(), |e| format!("{} | {}", error(e.p999), error(e.max)));
    format!("{missed:.1} / {false_hits:.1} / {wrong:.1} | {counts} | {faces} | {errors} | {}", reasons(r))
}

/// Why a solver fails as it does in this row; empty where it does not.
fn reasons(r: &Row) -> String {
    let answers = match r.solver {
        Solver::Exact => "a defect",
        Solver::Linear if r.loses() => "blind to what enters and leaves within a cell, and off by the cubic's curvature",
        Solver::Linear => "takes the cubic for a line: off by its curvature",
        Solver::Neubauer(_) if r.loses() => "blind to what enters and leaves within a cell; of three roots it may take the last",
        Solver::Marmitt(_) if r.loses() => "powers of the parameter lose digits, vanish or overflow, and with them an extremum",
        Solver::Neubauer(_) | Solver::Marmitt(_) => "repeated linear interpolation has not converged",
        Solver::Analytic => "products of coefficients lose digits",
        Solver::Step(_) if r.loses() => "blind to what enters and leaves between two steps",
        Solver::Step(_) => "linear between two steps: off by the curvature",
        Solver::Filter => "the hardware rounds where it samples, on most cards to 1/256 of a voxel",
    };
    let answers = (r.loses() || r.is_off() || r.miscounts()).then_some(answers);
    let faces = r.tears().then_some("the value at a face is rounded otherwise in each of its two cells");
    answers.into_iter().chain(faces).collect::<Vec<_>>().join("; ")
}
