//! The window's side of drawing: the newest wish wins; a moving view is drawn in fewer pixels, a resting one exactly.

use super::desk::{Open, Painted, Shared, Wish};
use super::drawing::Worker;
use super::exposer::{Exposer, Round, is_lit};
use bregma_field::Volume;
use bregma_renderer::{CpuRenderer, Scene};
use bregma_session::coat::Coat;
use bregma_session::{Compare, Machine, same_scans};
use egui::Context;
use std::sync::Arc;

/// The window's side of the drawing thread.
#[derive(Debug)]
pub struct Painter {
    /// Points of each pixel that pictures at rest are the mean of.
    pub samples_at_rest: u32,
    shared: Arc<Shared>,
    wish: Option<Wish>,
    number: u64,
    answered: u64,
    /// The last wish was for all pixels or got them.
    exact: bool,
    /// Draws what rests under studio light.
    exposer: Exposer,
    /// When the wish last changed, in the window's seconds; not yet known where absent.
    changed_at: Option<f64>,
}

/// What has not changed for so long comes into studio light, seconds: a hand that moves in steps does not have it begin in vain.
const LIT_AFTER_S: f64 = 0.3;

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
        std::thread::spawn(move || Worker::new(&theirs, open, reduction).run(&theirs, &ctx));
        let exposer = Exposer::new(open);
        Self { samples_at_rest: 1, shared, wish: None, number: 0, answered: 0, exact: false, exposer, changed_at: None }
    }

    /// Says what should be seen: the scene, its pixels, how its scans are compared, and what it is painted with. Asks for a quick picture when
    /// it changed, and for the exact one once it rests.
    pub fn want(
        &mut self,
        volumes: &[Arc<Volume>],
        scene: &Scene,
        size: [u32; 2],
        (compare, pair): (Compare, Option<[usize; 2]>),
        coat: Option<(usize, Arc<dyn Coat>)>,
        resting: bool,
    ) {
        let sizes = compare.sizes(pair, size);
        let is_same = |w: &Wish| {
            let coat_of = |coat: &Option<(usize, Arc<dyn Coat>)>| coat.as_ref().map(|(n, coat)| (*n, Arc::as_ptr(coat).cast::<()>()));
            let same_coat = coat_of(&w.coat) == coat_of(&coat);
            // Where the line of a swipe stands is not drawn: the pictures are put together anew.
            same_coat
                && same_scans(&w.volumes, volumes)
                && w.sizes == sizes
                && w.pair == pair
                && w.scene == *scene
                && w.samples == self.samples_at_rest
        };
        let same = self.wish.as_ref().is_some_and(is_same);
        let wish = match self.wish.take() {
            Some(wish) if same => wish,
            _ => Wish { volumes: volumes.to_vec(), scene: scene.clone(), size, sizes, compare, pair, coat, samples: self.samples_at_rest },
        };
        if !same {
            self.exposer.stop();
            self.changed_at = None;
        }
        if !same || (resting && !self.exact && self.answered == self.number) {
            self.number += 1;
            self.exact = same;
            self.shared.desk().wish = Some((self.number, wish.clone(), self.exact));
            self.shared.news.notify_one();
        }
        self.wish = Some(wish);
    }

    /// Lets a studio light what was asked for last, once it rests and has all its pixels.
    pub fn expose(&mut self, ctx: &Context, resting: bool) {
        let Some(wish) = self.wish.as_ref().filter(|wish| is_lit(wish)) else {
            self.exposer.forget();
            return;
        };
        let changed_at = *self.changed_at.get_or_insert(ctx.time());
        if self.exposer.has_begun() || !resting || !self.is_settled() {
            return;
        }
        let left = changed_at + LIT_AFTER_S - ctx.time();
        if left > 0.0 {
            ctx.request_repaint_after_secs(left as f32);
        } else {
            self.exposer.begin(ctx, wish);
        }
    }

    /// What was asked for last is lit by a studio, as far as the view shows that.
    pub fn is_lit(&self) -> bool {
        self.wish.as_ref().is_some_and(is_lit)
    }

    /// Studio light has come to its end: the picture is good enough, or was not to be had.
    pub fn is_exposed(&self) -> bool {
        self.exposer.has_ended()
    }

    /// The newest picture under studio light, if there is one since the last call, or one sentence about why there is none.
    pub fn poll_light(&mut self) -> Option<Result<Round, String>> {
        self.exposer.poll()
    }

    /// What is asked for.
    pub fn wished(&self) -> Option<&Scene> {
        self.wish.as_ref().map(|wish| &wish.scene)
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

    /// Gives back a picture that another one has taken the place of, for the next one to lie in its memory.
    pub fn give_back(&self, painted: Painted) {
        self.shared.desk().spare = Some(painted.picture);
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
