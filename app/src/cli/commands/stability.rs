//! `bregma stability`: where solvers fail.

use crate::cli::args::StabilityArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{print, with_progress};
use bregma_renderer::CpuRenderer;
use bregma_renderer::stability::{self, SolveSegments};
use bregma_session::Machine;
use bregma_session::output::{make_folder, write_whole};

/// Judges every solver over the hard families and writes the tables. The GPU is judged too where there is one, even a software driver,
/// unless `--backend cpu` leaves it out.
pub fn stability(args: &StabilityArgs, machine: Machine) -> Result<(), CommandError> {
    make_folder(&args.out)?;
    let mut gpu = machine.gpu(true)?;
    let mut cpu = CpuRenderer::default();
    let mut machines: Vec<&mut dyn SolveSegments> = vec![&mut cpu];
    machines.extend(gpu.as_mut().map(|gpu| gpu as &mut dyn SolveSegments));
    let rows = with_progress("judging", |progress| stability::run(&mut machines, progress))?;
    write_whole(&args.out.join("stability.csv"), stability::csv(&rows).as_bytes())?;
    write_whole(&args.out.join("stability.md"), stability::markdown(&rows).as_bytes())?;
    print(&format!("{}: stability.csv, stability.md\n", args.out.display()))
}
