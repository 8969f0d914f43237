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

/// What is walked to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Walked {
    /// All that lies inside of a surface.
    Inside,
    /// Only what the surfaces at some levels can pass, and what lies inside where the volume ends: by the values around each level, relative to
    /// the lowest one, positive inside. Whoever begins outside of the volume meets all crossings there.
    Crossings(Vec<[f32; 2]>),
}

/// Of a level: by so much more than interpolating between equal numbers rounds, a value next to a level counts as one on either side of it.
const LEVEL_MARGIN: f32 = 1e-6;

impl Walked {
    /// Of a surface whose layer has these levels.
    fn of(scene: &Scene, surface: &Surface, levels: &[f32]) -> Self {
        // Rays that begin within bone know by the cells that they begin in on which side of each level they are.
        let begins_inside = scene.shadows || !surface.is_whole() || spans::begins_inside(&surface.grid, &scene.camera);
        if !scene.goes_through_surfaces() || begins_inside {
            return Self::Inside;
        }
        Self::Crossings(levels.iter().map(|level| [-1.0, 1.0].map(|side| level + side * LEVEL_MARGIN * level.abs())).collect())
    }
}

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
    /// Of a surface with other `levels` inside of it in a picture whose base plane and deepest corner lie at these depths; where cuts show values
    /// there may be something everywhere.
    pub fn of(
        maps: &mut MapCache,
        scene: &Scene,
        (surface, levels): (&Surface, &[f32]),
        sees_everywhere: bool,
        [base_mm, deepest_mm]: [f64; 2],
        raster: Raster,
    ) -> Self {
        let (map, masks) = maps.get(surface, &Walked::of(scene, surface, levels));
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
