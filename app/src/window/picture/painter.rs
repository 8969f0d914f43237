//! Drawing on a thread of its own: the newest wish wins; a moving view is drawn in fewer pixels, a resting one exactly.

use bregma_field::Volume;
use bregma_renderer::{Backend, CpuRenderer, GpuError, Picture, RenderError, Renderer, Scene};
use bregma_session::thickness::Coat;
use bregma_session::thickness_picture::paint;
use bregma_session::{Compare, Machine, same_scans};
use egui::{Color32, ColorImage, Context};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What is to be seen.
#[derive(Clone, Debug)]
struct Wish {
    volumes: Vec<Arc<Volume>>,
    scene: Scene,
    /// Pixels of the whole, and of each picture that it consists of.
    size: [u32; 2],
    sizes: Vec<[u32; 2]>,
    compare: Compare,
    coat: Option<Arc<Coat>>,
}

/// A finished picture.
#[derive(Debug)]
pub struct Painted {
    /// The two pictures that are compared; none where nothing is.
    pub parts: Vec<Picture>,
    /// They as one, or the only one.
    pub picture: Picture,
    /// How they were put together, and at which turn.
    pub joined: (Compare, u64),
    /// The same for the screen, which takes it.
    pub image: ColorImage,
    /// One pixel stands for this many across and down; 1 is exact.
    pub reduction: u32,
    /// From the wish to the pixels.
    pub millis: f64,
    /// What drew it.
    pub backend: Backend,
    /// The same in words.
    pub adapter: String,
}

impl Painted {
    /// Puts the compared pictures together anew where the line, the squares or the turn are others. Gives what is to be seen then.
    pub fn join(&mut self, compare: Compare, at_s: f64) -> Option<ColorImage> {
        let compare = compare.reduced(self.reduction);
        // Pictures of another size, or one of all scans, are on their way.
        let is_side = |compare| compare == Compare::SideBySide;
        let fits = self.parts.len() == 2 && compare != Compare::Off && is_side(compare) == is_side(self.joined.0);
        let joined = (compare, compare.turn(at_s));
        self.picture = (fits && self.joined != joined).then(|| compare.join(&self.parts, at_s)).flatten()?;
        self.joined = joined;
        Some(image(&self.picture))
    }
}

/// What the two threads hand each other.
#[derive(Debug, Default)]
struct Desk {
    /// Number, contents, and whether all pixels are wanted.
    wish: Option<(u64, Wish, bool)>,
    done: Option<(u64, Result<Painted, String>)>,
    notice: Option<String>,
    closed: bool,
}

#[derive(Debug, Default)]
struct Shared {
    desk: Mutex<Desk>,
    news: Condvar,
}

impl Shared {
    /// A renderer that panicked leaves the desk in order: it never draws while holding it.
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The window's side of the drawing thread.
#[derive(Debug)]
pub struct Painter {
    shared: Arc<Shared>,
    wish: Option<Wish>,
    number: u64,
    answered: u64,
    /// The last wish was for all pixels or got them.
    exact: bool,
}

impl Painter {
    /// Starts the thread, with the best machine there is.
    pub fn new(ctx: &Context) -> Self {
        Self::by(ctx, Machine::auto, 4)
    }

    /// Starts the thread for slices, which the processor draws at once.
    pub fn of_slices(ctx: &Context) -> Self {
        Self::by(ctx, || (Box::new(CpuRenderer::default()), None), 1)
    }

    /// Draws by what `open` opens, and what moves at first with a pixel for so many across.
    fn by(ctx: &Context, open: Open, reduction: u32) -> Self {
        let shared = Arc::new(Shared::default());
        let (theirs, ctx) = (Arc::clone(&shared), ctx.clone());
        std::thread::spawn(move || Worker { reduction, ..Worker::new(&theirs, open) }.run(&theirs, &ctx));
        Self { shared, wish: None, number: 0, answered: 0, exact: false }
    }

    /// Says what should be seen: the scene, its pixels, how its scans are compared, and what it is painted with. Asks for a quick picture when
    /// it changed, and for the exact one once it rests.
    pub fn want(
        &mut self,
        volumes: &[Arc<Volume>],
        scene: &Scene,
        size: [u32; 2],
        compare: Compare,
        coat: Option<Arc<Coat>>,
        resting: bool,
    ) {
        let sizes = compare.sizes(scene, size);
        let is_same = |w: &Wish| {
            let same_coat = w.coat.as_ref().map(Arc::as_ptr) == coat.as_ref().map(Arc::as_ptr);
            // Where the line of a swipe stands is not drawn: the pictures are put together anew.
            same_coat && same_scans(&w.volumes, volumes) && w.sizes == sizes && w.scene == *scene
        };
        let same = self.wish.as_ref().is_some_and(is_same);
        let wish = match self.wish.take() {
            Some(wish) if same => wish,
            _ => Wish { volumes: volumes.to_vec(), scene: scene.clone(), size, sizes, compare, coat },
        };
        if !same || (resting && !self.exact && self.answered == self.number) {
            self.number += 1;
            self.exact = same;
            self.shared.desk().wish = Some((self.number, wish.clone(), self.exact));
            self.shared.news.notify_one();
        }
        self.wish = Some(wish);
    }

    /// The newest picture, if there is one since the last call, or one sentence about why there is none.
    pub fn poll(&mut self) -> Option<Result<Painted, String>> {
        let (number, result) = self.shared.desk().done.take()?;
        self.answered = number;
        // What failed once fails again: no second try before something changes.
        if number == self.number {
            self.exact = result.as_ref().map_or(true, |p| p.reduction == 1);
        }
        Some(result)
    }

    /// What the person should know about the backend, once.
    pub fn notice(&self) -> Option<String> {
        self.shared.desk().notice.take()
    }

    /// The last wish has all its pixels.
    pub fn is_settled(&self) -> bool {
        self.answered == self.number && self.exact
    }
}

impl Drop for Painter {
    fn drop(&mut self) {
        self.shared.desk().closed = true;
        self.shared.news.notify_one();
    }
}

/// A moving picture is meant to take no longer than this.
const FLUENT_MS: f64 = 40.0;
/// Fewer pixels than an eighth across show no skull.
const COARSEST: u32 = 8;

/// A card that was lost is looked for again after so long.
const AWAY: Duration = Duration::from_secs(5);

/// What there is to draw by, and why that is no graphics card where there is one.
type Open = fn() -> (Box<dyn Renderer>, Option<GpuError>);

struct Worker {
    renderer: Box<dyn Renderer>,
    open: Open,
    /// When the graphics card was lost, or last looked for, while the processor stands in for it.
    lost: Option<Instant>,
    reduction: u32,
}

impl Worker {
    fn new(shared: &Shared, open: Open) -> Self {
        let (renderer, unused) = open();
        if let Some(e) = unused {
            shared.desk().notice = Some(format!("The graphics card is not used: {e}. The processor draws instead."));
        }
        Self { renderer, open, lost: None, reduction: 4 }
    }

    fn run(&mut self, shared: &Shared, ctx: &Context) {
        loop {
            let (number, wish, exact) = {
                let mut desk = shared.desk();
                loop {
                    if desk.closed {
                        return;
                    }
                    if let Some(wish) = desk.wish.take() {
                        break wish;
                    }
                    desk = shared.news.wait(desk).unwrap_or_else(PoisonError::into_inner);
                }
            };
            let sentence = |e: RenderError| {
                let way_out = || format!("Nothing here draws by the solver {}; View › Draw by the exact solver does.", wish.scene.solver);
                if e.is_solver() { way_out() } else { e.to_string() }
            };
            let result = self.paint(shared, &wish, exact).map_err(sentence);
            shared.desk().done = Some((number, result));
            ctx.request_repaint();
        }
    }

    fn paint(&mut self, shared: &Shared, wish: &Wish, exact: bool) -> Result<Painted, RenderError> {
        let reduction = if exact { 1 } else { self.reduction };
        let begun = Instant::now();
        let parts = wish.compare.parts(&wish.scene, wish.size);
        let parts = parts.iter().map(|(scene, size)| self.draw(shared, wish, scene, size.map(|n| n.div_ceil(reduction))));
        let mut parts = parts.collect::<Result<Vec<_>, _>>()?;
        if let (Some(coat), Some(picture)) = (&wish.coat, parts.first_mut()) {
            paint(picture, &wish.scene, &coat.map.surface, &coat.map.mesh, &coat.map.values, &coat.scale);
        }
        let compare = wish.compare.reduced(reduction);
        let none = RenderError::NoPixels { width: 0, height: 0 };
        let picture = if parts.len() == 1 { parts.pop() } else { compare.join(&parts, 0.0) }.ok_or(none)?;
        let joined = (compare, 0);
        let millis = begun.elapsed().as_secs_f64() * 1e3;
        self.adapt(reduction, millis);
        let (backend, adapter) = (self.renderer.backend(), self.renderer.name());
        Ok(Painted { image: image(&picture), parts, picture, joined, reduction, millis, backend, adapter })
    }

    fn draw(&mut self, shared: &Shared, wish: &Wish, scene: &Scene, [width, height]: [u32; 2]) -> Result<Picture, RenderError> {
        if self.lost.is_some_and(|since| since.elapsed() > AWAY) {
            self.look_for_card(shared);
        }
        let mut drawn = self.renderer.render(&wish.volumes, scene, width, height);
        if let Err(e) = &drawn
            && self.renderer.backend() == Backend::Gpu
            && !e.is_solver()
        {
            shared.desk().notice = Some(format!("The graphics card failed: {e}. The processor draws instead."));
            // What the scan is too large for, it stays too large for.
            self.lost = e.is_lost_device().then(Instant::now);
            self.renderer = Box::new(CpuRenderer::default());
            drawn = self.renderer.render(&wish.volumes, scene, width, height);
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

/// A picture for the screen.
pub fn image(picture: &Picture) -> ColorImage {
    let color = |&[r, g, b, a]: &[u8; 4]| Color32::from_rgba_unmultiplied(r, g, b, a);
    ColorImage::new([picture.width as usize, picture.height as usize], picture.rgba.iter().map(color).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::{Solver, Split};
    use bregma_session::Opened;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Whether the card answers.
    static IS_THERE: AtomicBool = AtomicBool::new(true);

    /// A card that draws as the processor does while it is there, and else fails as a lost one does.
    struct Card(CpuRenderer);

    impl Renderer for Card {
        fn render(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
            if IS_THERE.load(Ordering::Relaxed) {
                return self.0.render(volumes, scene, width, height);
            }
            Err(GpuError::Failed { adapter: "card".into(), reason: "reset".into() }.into())
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
            coat: None,
        };
        let shared = Shared::default();
        let mut worker = Worker::new(&shared, open);
        let draw = |worker: &mut Worker| worker.draw(&shared, &wish, &wish.scene, size).unwrap().rgba;
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
