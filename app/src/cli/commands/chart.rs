//! `bregma chart`: speed against accuracy of every solver.

use crate::cli::args::ChartArgs;
use crate::cli::error::CommandError;
use crate::cli::look::set_each;
use crate::cli::opening::open;
use crate::cli::terminal::{print, with_progress};
use bregma_session::chart::{Chart, Plan, errors, integrals, normals, orbit, plot, table};
use bregma_session::output::{make_folder, write_whole};
use bregma_session::print::write_figure;
use bregma_session::{DEMO_SIZE, Machine, Opened};

/// Measures every solver over the orbit and writes chart.csv, chart.svg, chart.png and errors/SOLVER-BACKEND.png; and the integrators of direct
/// volume rendering, with the layers' transfer functions, to integrals.csv, integrals.svg and integrals.png; and the gradients that shade, on
/// the demo's phantom, whose normals are known, to normals.csv, normals.svg and normals.png. Both backends take part where both are there, even a
/// software driver, unless `--backend` names one.
pub fn chart(args: &ChartArgs, machine: Machine) -> Result<(), CommandError> {
    let opened = if args.sources.0.is_empty() {
        let mut pair = with_progress("making the demo pair", |progress| Opened::demo(DEMO_SIZE, progress))?;
        set_each(&mut pair.scene.layers, &args.isovalues.iso, "--iso", |layer, iso| layer.iso = *iso)?;
        pair
    } else {
        open(&args.sources.0, &args.isovalues)?
    };
    make_folder(&args.out.join("errors"))?;
    let plan = Plan { cameras: orbit(&opened.bounds(), args.frames), size: [args.size; 2], rounds: args.rounds };
    let mut machines = machine.renderers(true)?;
    let chart = with_progress("measuring", |progress| Chart::measure(&opened.volumes, &opened.scene, &plan, &mut machines, progress))?;
    let unplotted = |reason| CommandError::Figure { what: format!("{}: the chart", args.out.display()), reason };
    write_whole(&args.out.join("chart.csv"), table::csv(&chart).as_bytes())?;
    write_whole(&args.out.join("chart.svg"), plot::svg(&chart).map_err(unplotted)?.as_bytes())?;
    write_figure(&args.out.join("chart.png"), &plot::pixels(&chart).map_err(unplotted)?)?;
    for point in &chart.points {
        let name = format!("{}-{}", point.solver, point.backend);
        let figure = errors::figure(&point.errors, args.size, &name.replace('-', ", ")).map_err(unplotted)?;
        write_figure(&args.out.join("errors").join(name.replace(':', "-") + ".png"), &figure)?;
    }
    let dvr = |progress: &_| integrals::measure(&opened.volumes, &opened.scene, &plan, &mut machines, progress);
    let integrals = with_progress("integrating", dvr)?;
    let normals = with_progress("shading", |progress| normals::measure(args.frames, args.size, &mut machines, progress))?;
    let tables = [("integrals", integrals::csv(&integrals)), ("normals", normals::csv(&normals))];
    for ((name, csv), figure) in tables.iter().zip([integrals::figure(&integrals), normals::figure(&normals)]) {
        let file = |extension| args.out.join(name).with_extension(extension);
        write_whole(&file("csv"), csv.as_bytes())?;
        write_whole(&file("svg"), figure.svg().map_err(unplotted)?.as_bytes())?;
        write_figure(&file("png"), &figure.pixels().map_err(unplotted)?)?;
    }
    let [integrals, normals] = tables.map(|(_, csv)| csv);
    let files = "errors, and chart, integrals and normals, each .csv, .svg and .png";
    print(&format!("{}\n{integrals}\n{normals}\n{}: {files}\n", table::text(&chart), args.out.display()))
}
