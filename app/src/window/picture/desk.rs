//! What the window and the drawing thread hand each other: wishes one way, pictures the other.

use bregma_field::Volume;
use bregma_renderer::{Backend, GpuError, Picture, Renderer, Scene};
use bregma_session::Compare;
use bregma_session::coat::Coat;
use bregma_session::studio::Told;
use egui::{Color32, ColorImage};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// What there is to draw by, and why that is no graphics card where there is one.
pub(super) type Open = fn() -> (Box<dyn Renderer>, Option<GpuError>);

/// What is to be seen.
#[derive(Clone, Debug)]
pub(super) struct Wish {
    pub volumes: Vec<Arc<Volume>>,
    pub scene: Scene,
    /// Pixels of the whole, and of each picture that it consists of.
    pub size: [u32; 2],
    pub sizes: Vec<[u32; 2]>,
    pub compare: Compare,
    /// The scans that are compared.
    pub pair: Option<[usize; 2]>,
    /// What a surface wears, and the number of the scan that it is of.
    pub coat: Option<(usize, Arc<dyn Coat>)>,
    /// Points of each pixel once it rests.
    pub samples: u32,
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
    /// Points of each pixel that it is the mean of.
    pub samples: u32,
    /// How far it is under studio light, once that is seen, and whether its noise was taken away by a filter.
    pub exposed: Option<(Told, bool)>,
    /// From the wish to the pixels, of one point each.
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
pub(super) struct Desk {
    /// Number, contents, and whether all pixels are wanted.
    pub wish: Option<(u64, Wish, bool)>,
    pub done: Option<(u64, Result<Painted, String>)>,
    /// A picture that nobody needs.
    pub spare: Option<Picture>,
    pub notice: Option<String>,
    pub closed: bool,
}

#[derive(Debug, Default)]
pub(super) struct Shared {
    desk: Mutex<Desk>,
    pub news: Condvar,
}

impl Shared {
    /// A renderer that panicked leaves the desk in order: it never draws while holding it.
    pub fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A picture for the screen.
pub fn image(picture: &Picture) -> ColorImage {
    let color = |&[r, g, b, a]: &[u8; 4]| Color32::from_rgba_unmultiplied(r, g, b, a);
    ColorImage::new([picture.width as usize, picture.height as usize], picture.rgba.iter().map(color).collect())
}
