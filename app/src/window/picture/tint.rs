//! The colours of parts over a view, while they are made by hand: a picture of its own that follows the brush at once.

use super::marks::Screen;
use super::navigate::mm_per_pixel_at;
use super::part_hand::PartHand;
use bregma_renderer::Camera;
use egui::{Color32, ColorImage, Context, Painter, Pos2, Rect, TextureHandle, TextureOptions};
use glam::DVec3;
use rayon::prelude::*;

/// What a tint was made of: the view, the picture in it by its number, its pixels, and the changes of the labels.
type Made = (Camera, u64, [usize; 2], u64);

/// The colours over one view.
#[derive(Default)]
pub struct Tint {
    texture: Option<TextureHandle>,
    made: Option<Made>,
}

/// What is under a pixel in the world, by its column and row.
pub type Under<'a> = &'a (dyn Fn(usize, usize) -> Option<DVec3> + Sync);

/// Beyond the rim of a touch pixels may change by so many, as samples are coarser than they.
const RIM: f64 = 4.0;

impl Tint {
    /// Shows the colours of parts over a view whose picture is number `picture` and has `size` pixels.
    pub fn show(
        &mut self,
        (ctx, painter): (&Context, &Painter),
        screen: &Screen<'_>,
        (picture, size): (u64, [usize; 2]),
        hand: &PartHand,
        color: impl Fn(DVec3) -> Option<Color32> + Sync,
        under: Under<'_>,
    ) {
        let made = (*screen.camera, picture, size, hand.changes());
        if self.made != Some(made) {
            let same_view = |was: &Made| (was.0, was.1, was.2) == (made.0, made.1, made.2);
            let touches = self.made.filter(same_view).and_then(|was| hand.touches_since(was.3));
            let box_mm = |(_, at, radius_mm): &(u64, DVec3, f64)| {
                let scale = size[1] as f64 / f64::from(screen.rect.height());
                let reach = radius_mm / mm_per_pixel_at(screen.camera, *at, size[1] as f64) + RIM;
                let at = screen.point(*at)? - screen.rect.min;
                Some([at.x, at.y].map(|x| [f64::from(x) * scale - reach, f64::from(x) * scale + reach]))
            };
            let boxes: Option<Vec<_>> = touches.map(|touches| touches.iter().filter_map(box_mm).collect());
            let whole = [[0.0, size[0] as f64], [0.0, size[1] as f64]];
            let span = boxes
                .map_or(Some(whole), |boxes| boxes.into_iter().reduce(|a, b| [0, 1].map(|n| [a[n][0].min(b[n][0]), a[n][1].max(b[n][1])])));
            if let Some(span) = span {
                let [x, y] = [0, 1].map(|n| span[n].map(|v| (v.max(0.0) as usize).min(size[n])));
                self.paint(ctx, [x, y], size, |x, y| under(x, y).and_then(&color).unwrap_or(Color32::TRANSPARENT));
            }
            self.made = Some(made);
        }
        if let Some(texture) = &self.texture {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            painter.image(texture.id(), screen.rect, whole, Color32::WHITE);
        }
    }

    fn paint(&mut self, ctx: &Context, [x, y]: [[usize; 2]; 2], size: [usize; 2], color: impl Fn(usize, usize) -> Color32 + Sync) {
        let wide = x[1].saturating_sub(x[0]);
        if wide == 0 || y[1] <= y[0] {
            return;
        }
        let pixels: Vec<Color32> = (y[0]..y[1])
            .into_par_iter()
            .flat_map_iter(|row| (x[0]..x[1]).map(move |column| (column, row)))
            .map(|(column, row)| color(column, row))
            .collect();
        let image = ColorImage::new([wide, y[1] - y[0]], pixels);
        match &mut self.texture {
            Some(texture) if [wide, y[1] - y[0]] == size => texture.set(image, TextureOptions::NEAREST),
            Some(texture) => texture.set_partial([x[0], y[0]], image, TextureOptions::NEAREST),
            none => *none = Some(ctx.load_texture("parts", image, TextureOptions::NEAREST)),
        }
    }
}
