//! `bregma chart`: speed against accuracy of every solver.

use super::{CommandError, make_folder, open, print, set_each, with_progress};
use crate::args::{Backend, ChartArgs};
use crate::chart::{Chart, Plan, errors, integrals, orbit, plot, table};
use crate::input::{DEMO_SIZE, Opened};
use crate::output::{write_figure, write_whole};
use bregma_renderer::{CpuRenderer, GpuRenderer, RenderError, Renderer};

/// Measures every solver over the orbit and writes chart.csv, chart.svg, chart.png and errors/SOLVER-BACKEND.png; and the integrators of direct
/// volume rendering, with the layers' transfer functions, to integrals.csv, integrals.svg and integrals.png. Both backends take
/// part where both are there, even a software driver, unless `--backend` names one.
pub fn chart(args: &ChartArgs, backend: Backend) -> Result<(), CommandError> {
    let opened = if args.sources.0.is_empty() {
        let mut pair = with_progress("making the demo pair", |progress| Opened::demo(DEMO_SIZE, progress))?;
        set_each(&mut pair.scene.layers, &args.isovalues.iso, "--iso", |layer, iso| layer.iso = *iso)?;
        pair
    } else {
        open(&args.sources.0, &args.isovalues)?
    };
    make_folder(&args.out.join("errors"))?;
    let plan = Plan { cameras: orbit(&opened.bounds(), args.frames), size: [args.size; 2], rounds: args.rounds };
    let mut machines = machines(backend)?;
    let chart = with_progress("measuring", |progress| Chart::measure(&opened.volumes, &opened.scene, &plan, &mut machines, progress))?;
    let unplotted = |e: Box<dyn std::error::Error>| CommandError::File(format!("{}: the chart cannot be drawn ({e})", args.out.display()));
    write_whole(&args.out.join("chart.csv"), table::csv(&chart).as_bytes())?;
    write_whole(&args.out.join("chart.svg"), plot::svg(&chart).map_err(unplotted)?.as_bytes())?;
    write_figure(&args.out.join("chart.png"), plot::pixels(&chart).map_err(unplotted)?)?;
    for point in &chart.points {
        let name = format!("{}-{}", point.solver, point.backend);
        let figure = errors::figure(&point.errors, args.size, &name.replace('-', ", ")).map_err(unplotted)?;
        write_figure(&args.out.join("errors").join(name.replace(':', "-") + ".png"), figure)?;
    }
    let dvr = |progress: &_| integrals::measure(&opened.volumes, &opened.scene, &plan, &mut machines, progress);
    let integrals = with_progress("integrating", dvr)?;
    let csv = integrals::csv(&integrals);
    write_whole(&args.out.join("integrals.csv"), csv.as_bytes())?;
    write_whole(&args.out.join("integrals.svg"), integrals::svg(&integrals).map_err(unplotted)?.as_bytes())?;
    write_figure(&args.out.join("integrals.png"), integrals::pixels(&integrals).map_err(unplotted)?)?;
    let files = "chart.csv, chart.svg, chart.png, errors, integrals.csv, integrals.svg, integrals.png";
    print(&format!("{}\n{csv}\n{}: {files}\n", table::text(&chart), args.out.display()))
}

fn machines(backend: Backend) -> Result<Vec<Box<dyn Renderer>>, CommandError> {
    let cpu = || Box::new(CpuRenderer::default()) as Box<dyn Renderer>;
    let gpu = || GpuRenderer::new(true).map(|gpu| Box::new(gpu) as Box<dyn Renderer>);
    Ok(match backend {
        Backend::Cpu => vec![cpu()],
        Backend::Gpu => vec![gpu().map_err(RenderError::from)?],
        Backend::Auto => std::iter::once(cpu()).chain(gpu().ok()).collect(),
    })
}
