//! The chart in numbers.

use super::{Chart, Point};

const HEADER: &str = "solver,backend,adapter,ns_per_ray,ms_per_frame,walking_ms,fetching_ms,solving_ms,shading_ms,rays,hits,\
                      tangent,missed,missed_percent,false,false_percent,depth_p50_voxel,depth_p99.9_voxel,depth_max_voxel,depth_p50_mm,\
                      depth_p99.9_mm,depth_max_mm,normal_p50_deg,normal_p99.9_deg,normal_max_deg";

/// One row for each solver on each backend; missed in % of the rays that meet a surface, false in % of those that meet none. Errors are
/// empty where nothing was hit.
pub fn csv(chart: &Chart) -> String {
    let rows: String = chart.points.iter().map(row).collect();
    format!("{HEADER}\n{rows}")
}

fn row(p: &Point) -> String {
    let t = &p.counts;
    let mut fields = vec![p.solver.to_string(), p.backend.to_string(), format!("\"{}\"", p.adapter.replace('"', "'"))];
    let s = &p.split;
    let times = [p.ns_per_ray, p.ms_per_frame, s.walking_ms, s.fetching_ms, s.solving_ms, s.shading_ms];
    fields.extend(times.map(|v| format!("{v:.3}")));
    fields.extend([t.rays, t.hits, t.tangent].map(|n| n.to_string()));
    fields.extend([
        t.missed.to_string(),
        format!("{:.6}", p.missed_percent()),
        t.false_hits.to_string(),
        format!("{:.6}", p.false_percent()),
    ]);
    for q in [p.depth_voxel, p.depth_mm, p.normal_deg] {
        fields.extend(q.map_or([const { String::new() }; 3], |q| [q.p50, q.p999, q.max].map(|v| format!("{v:.3e}"))));
    }
    fields.join(",") + "\n"
}

/// The same for reading, in the columns of the chart.
pub fn text(chart: &Chart) -> String {
    let mut out = format!(
        "{:<13}{:<8}{:>9}{:>10}{:>11}{:>10}{:>11}{:>13}{:>12}\n",
        "solver", "backend", "ns/ray", "ms/frame", "missed %", "false %", "p50 voxel", "p99.9 voxel", "max voxel"
    );
    for p in &chart.points {
        let [p50, p999, max] =
            p.depth_voxel.map_or(["–", "–", "–"].map(String::from), |q| [q.p50, q.p999, q.max].map(|v| format!("{v:.1e}")));
        out += &format!(
            "{:<13}{:<8}{:>9.1}{:>10.1}{:>11.4}{:>10.4}{p50:>11}{p999:>13}{max:>12}\n",
            p.solver.to_string(),
            p.backend,
            p.ns_per_ray,
            p.ms_per_frame,
            p.missed_percent(),
            p.false_percent(),
        );
    }
    out
}
