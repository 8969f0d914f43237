//! What need not be walked: claims about where a surface cannot be, each tested against walking everything.
//!
//! From coarse to fine: blocks of pixels and of the light's view (`spans`, `light_spans`), range bricks (`occupancy`), cells (`cell_masks`).

mod cell_masks;
mod light_spans;
mod maps;
mod occupancy;
mod spans;

use crate::camera::Raster;
use crate::scene::Scene;
use bregma_field::Surface;
use std::sync::Arc;

pub(crate) use cell_masks::{CellMasks, WORDS};
pub(crate) use light_spans::LightSpans;
pub(crate) use maps::MapCache;
pub use occupancy::DistanceMap;
pub(crate) use spans::{BLOCK, Spans};

/// What need not be walked of a layer.
#[derive(Debug)]
pub(crate) struct Skip {
    pub map: Arc<DistanceMap>,
    pub masks: Arc<CellMasks>,
    /// Which depths of each block of pixels can hold its surface.
    pub spans: Spans,
    /// Where it can cast shadows from; of nothing in a scene without.
    pub light_spans: LightSpans,
}

impl Skip {
    /// Of a surface in a picture, whose base plane and deepest corner lie at these depths; where cuts show values there may be
    /// something everywhere.
    pub fn of(
        maps: &mut MapCache,
        scene: &Scene,
        surface: &Surface,
        sees_everywhere: bool,
        [base_mm, deepest_mm]: [f64; 2],
        raster: Raster,
    ) -> Self {
        let (map, masks) = maps.get(surface);
        let spans = if sees_everywhere {
            Spans::everywhere(deepest_mm, raster.size)
        } else {
            Spans::of(&map, &masks, &surface.grid, &scene.camera, base_mm, raster, !surface.region.is_all())
        };
        let light_spans =
            if scene.shadows { LightSpans::of(&map, &masks, &surface.grid, scene.toward_light()) } else { LightSpans::default() };
        Self { map, masks, spans, light_spans }
    }
}
