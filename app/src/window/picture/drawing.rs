//! Drawing on a thread of its own: quickly what moves, exactly what rests, and then through ever more points of each pixel.

use super::desk::{Open, Painted, Shared, Wish, image};
use super::exposer::is_lit;
use bregma_renderer::{Backend, CpuRenderer, Picture, RenderError, Renderer, Scene, Solver, Still, point_in_pixel};
use bregma_session::coat::on_slice;
use egui::Context;
use std::sync::PoisonError;
use std::time::{Duration, Instant};

/// A moving picture is meant to take no longer than this.
const FLUENT_MS: f64 = 40.0;
/// Fewer pixels than an eighth across show no skull.
const COARSEST: u32 = 8;

/// A card that was lost is looked for again after so long.
const AWAY: Duration = Duration::from_secs(5);

/// A picture at rest, on its way to more points of each pixel.
struct Resting {
    number: u64,
    wish: Box<Wish>,
    stills: Vec<Still>,
    first_ms: f64,
}

impl Resting {
    fn samples(&self) -> u32 {
        self.stills.first().map_or(self.wish.samples, Still::samples)
    }
}

/// What is to be done next.
enum Job {
    /// A wish with its number, and whether all pixels are wanted.
    Wish(u64, Box<Wish>, bool),
    /// One more point of each pixel of what rests.
    Refine,
}

/// Waits for a wish, unless something rests that can be drawn more smoothly; `None` when the window's side is gone.
fn next_job(shared: &Shared, rests: bool) -> Option<Job> {
    let mut desk = shared.desk();
    loop {
        if desk.closed {
            return None;
        }
        if let Some((number, wish, exact)) = desk.wish.take() {
            return Some(Job::Wish(number, Box::new(wish), exact));
        }
        if rests {
            return Some(Job::Refine);
        }
        desk = shared.news.wait(desk).unwrap_or_else(PoisonError::into_inner);
    }
}

/// Why there is no picture.
fn sentence(error: &RenderError, solver: Solver) -> String {
    if error.is_solver() {
        format!("Nothing here draws by the solver {solver}; View › Draw by the exact solver does.")
    } else {
        error.to_string()
    }
}

/// What draws, on a thread of its own.
pub(super) struct Worker {
    renderer: Box<dyn Renderer>,
    open: Open,
    /// When the graphics card was lost, or last looked for, while the processor stands in for it.
    lost: Option<Instant>,
    reduction: u32,
}

impl Worker {
    /// With what `open` opens; what moves is drawn at first with a pixel for `reduction` across.
    pub fn new(shared: &Shared, open: Open, reduction: u32) -> Self {
        let (renderer, unused) = open();
        if let Some(e) = unused {
            shared.desk().notice = Some(format!("The graphics card is not used: {e}. The processor draws instead."));
        }
        Self { renderer, open, lost: None, reduction }
    }

    /// Draws what is wished for, and what rests ever more smoothly, until the window's side is gone.
    pub fn run(&mut self, shared: &Shared, ctx: &Context) {
        let (mut resting, mut solver) = (None, Solver::Exact);
        while let Some(job) = next_job(shared, resting.is_some()) {
            let (number, result) = match (job, resting.take()) {
                (Job::Wish(number, wish, exact), _) => {
                    solver = wish.scene.solver;
                    let painted = self.paint(shared, &wish, exact).map(|(painted, stills)| {
                        resting = (!stills.is_empty()).then_some(Resting { number, wish, stills, first_ms: painted.millis });
                        painted
                    });
                    (number, painted)
                }
                (Job::Refine, Some(mut still)) => {
                    let number = still.number;
                    let refined = self.refine(shared, &mut still);
                    resting = refined.is_ok().then_some(still).filter(|still| still.samples() < still.wish.samples);
                    match refined.transpose() {
                        Some(refined) => (number, refined),
                        None => continue,
                    }
                }
                (Job::Refine, None) => continue,
            };
            shared.desk().done = Some((number, result.map_err(|e| sentence(&e, solver))));
            ctx.request_repaint();
        }
    }

    /// The picture, and what goes on from it; nothing where it is done.
    fn paint(&mut self, shared: &Shared, wish: &Wish, exact: bool) -> Result<(Painted, Vec<Still>), RenderError> {
        let reduction = if exact { 1 } else { self.reduction };
        let begun = Instant::now();
        let parts = self.parts(shared, wish, reduction, 0)?;
        // What comes into studio light grows smooth there.
        let goes_on = exact && wish.samples > 1 && !wish.scene.is_slice() && !is_lit(wish);
        let stills = if goes_on { parts.iter().cloned().map(Still::of).collect() } else { vec![] };
        let mut painted = self.painted(wish, parts, reduction, 1)?;
        painted.millis = begun.elapsed().as_secs_f64() * 1e3;
        self.adapt(reduction, painted.millis);
        Ok((painted, stills))
    }

    /// Adds a point of each pixel; gives the picture when twice as many points are in it as in the last one, and with the last.
    fn refine(&mut self, shared: &Shared, resting: &mut Resting) -> Result<Option<Painted>, RenderError> {
        let parts = self.parts(shared, &resting.wish, 1, resting.samples())?;
        resting.stills.iter_mut().zip(&parts).for_each(|(still, part)| still.add(part));
        if !resting.samples().is_power_of_two() && resting.samples() < resting.wish.samples {
            return Ok(None);
        }
        let pictures = resting.stills.iter().map(Still::picture).collect();
        let painted = self.painted(&resting.wish, pictures, 1, resting.samples())?;
        Ok(Some(Painted { millis: resting.first_ms, ..painted }))
    }

    /// The pictures that are put together, through one point of each pixel.
    fn parts(&mut self, shared: &Shared, wish: &Wish, reduction: u32, sample: u32) -> Result<Vec<Picture>, RenderError> {
        let parts = wish.compare.parts(&wish.scene, wish.pair, wish.size);
        let parts = parts.iter().map(|(scene, size)| self.draw(shared, wish, scene, size.map(|n| n.div_ceil(reduction)), sample));
        let mut parts = parts.collect::<Result<Vec<_>, _>>()?;
        if let Some((layer, coat)) = &wish.coat {
            for picture in &mut parts {
                if wish.scene.is_slice() {
                    on_slice(&**coat, *layer, picture, &wish.scene);
                } else {
                    coat.paint(picture, &wish.scene, point_in_pixel(sample));
                }
            }
        }
        Ok(parts)
    }

    /// What has been drawn as one.
    fn painted(&self, wish: &Wish, mut parts: Vec<Picture>, reduction: u32, samples: u32) -> Result<Painted, RenderError> {
        let compare = wish.compare.reduced(reduction);
        let none = RenderError::NoPixels { width: 0, height: 0 };
        let picture = if parts.len() == 1 { parts.pop() } else { compare.join(&parts, 0.0) }.ok_or(none)?;
        let (joined, backend, adapter) = ((compare, 0), self.renderer.backend(), self.renderer.name());
        Ok(Painted { image: image(&picture), parts, picture, joined, reduction, samples, exposed: None, millis: 0.0, backend, adapter })
    }

    fn draw(&mut self, shared: &Shared, wish: &Wish, scene: &Scene, size: [u32; 2], sample: u32) -> Result<Picture, RenderError> {
        if self.lost.is_some_and(|since| since.elapsed() > AWAY) {
            self.look_for_card(shared);
        }
        if let Some(picture) = shared.desk().spare.take() {
            self.renderer.reuse(picture);
        }
        let mut drawn = self.renderer.sample(&wish.volumes, scene, size, sample);
        if let Err(e) = &drawn
            && self.renderer.backend() == Backend::Gpu
            && !e.is_solver()
        {
            shared.desk().notice = Some(format!("The graphics card failed: {e}. The processor draws instead."));
            // What the scan is too large for, it stays too large for.
            self.lost = e.is_lost_device().then(Instant::now);
            self.renderer = Box::new(CpuRenderer::default());
            drawn = self.renderer.sample(&wish.volumes, scene, size, sample);
        }
        drawn
    }

    fn look_for_card(&mut self, shared: &Shared) {
        let (renderer, _) = (self.open)();
        if renderer.backend() == Backend::Gpu {
            shared.desk().notice = Some("The graphics card is back and draws again.".into());
            (self.renderer, self.lost) = (renderer, None);
        } else {
            self.lost = Some(Instant::now());
        }
    }

    /// Half the pixels across where a frame took too long; twice as many where four times its time still fits.
    fn adapt(&mut self, reduction: u32, millis: f64) {
        if reduction == self.reduction && millis > FLUENT_MS {
            self.reduction = (reduction * 2).min(COARSEST);
        } else if reduction <= self.reduction && (millis * 4.0 < FLUENT_MS || reduction == 1 && millis <= FLUENT_MS) {
            self.reduction = if reduction == self.reduction { (reduction / 2).max(1) } else { reduction };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::Volume;
    use bregma_renderer::studio::Tracer;
    use bregma_renderer::{GpuError, Split};
    use bregma_session::{Compare, Opened};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Whether the card answers.
    static IS_THERE: AtomicBool = AtomicBool::new(true);

    /// A card that draws as the processor does while it is there, and else fails as a lost one does.
    struct Card(CpuRenderer);

    impl Renderer for Card {
        fn sample(&mut self, volumes: &[Arc<Volume>], scene: &Scene, size: [u32; 2], sample: u32) -> Result<Picture, RenderError> {
            if IS_THERE.load(Ordering::Relaxed) {
                return self.0.sample(volumes, scene, size, sample);
            }
            Err(GpuError::Failed { adapter: "card".into(), reason: "reset".into() }.into())
        }

        fn tracer(&mut self, volumes: &[Arc<Volume>], scene: &Scene, size: [u32; 2], seed: u32) -> Result<Tracer, RenderError> {
            self.0.tracer(volumes, scene, size, seed)
        }

        fn backend(&self) -> Backend {
            Backend::Gpu
        }

        fn name(&self) -> String {
            "card".into()
        }

        fn has(&self, solver: Solver) -> bool {
            self.0.has(solver)
        }

        fn bytes(&self) -> usize {
            self.0.bytes()
        }

        fn split(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
            self.0.split(volumes, scene, width, height)
        }
    }

    fn open() -> (Box<dyn Renderer>, Option<GpuError>) {
        if IS_THERE.load(Ordering::Relaxed) {
            (Box::new(Card(CpuRenderer::default())), None)
        } else {
            (Box::new(CpuRenderer::default()), None)
        }
    }

    #[test]
    fn a_lost_card_costs_no_picture_and_is_taken_up_again() {
        // Fails if a lost card leaves the window without a picture, is asked for at each frame, or is not used again when it is back.
        let opened = Opened::demo(16, &Default::default()).unwrap();
        let size = [16, 16];
        let wish = Wish {
            volumes: opened.volumes.clone(),
            scene: opened.scene.clone(),
            size,
            sizes: vec![size],
            compare: Compare::Off,
            pair: None,
            coat: None,
            samples: 1,
        };
        let shared = Shared::default();
        let mut worker = Worker::new(&shared, open, 4);
        let draw = |worker: &mut Worker| worker.draw(&shared, &wish, &wish.scene, size, 0).unwrap().rgba;
        let first = draw(&mut worker);
        IS_THERE.store(false, Ordering::Relaxed);
        assert_eq!(draw(&mut worker), first);
        assert!(worker.renderer.backend() == Backend::Cpu && shared.desk().notice.take().is_some_and(|n| n.contains("processor")));
        IS_THERE.store(true, Ordering::Relaxed);
        draw(&mut worker);
        assert_eq!(worker.renderer.backend(), Backend::Cpu, "not before it has been away for a while");
        worker.lost = Instant::now().checked_sub(2 * AWAY);
        assert_eq!(draw(&mut worker), first);
        assert!(worker.renderer.backend() == Backend::Gpu && worker.lost.is_none());
        assert!(shared.desk().notice.take().is_some_and(|n| n.contains("back")));
    }
}
