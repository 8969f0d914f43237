//! What is kept of the surfaces drawn last, so that the next picture of them need not work it out again.

use super::occupancy::Occupancy;
use super::{CellMasks, DistanceMap, Walked};
use crate::InstructionSet;
use bregma_field::{AnyBlock, RangeBricks, Samples, Solid, Store, Surface, Volume, spline};
use std::sync::Arc;

/// What is known of the surfaces drawn last: where they can be.
#[derive(Debug)]
pub(crate) struct MapCache {
    /// What they are made with.
    instructions: InstructionSet,
    known: Vec<(Arc<Volume>, f64, Walked, Maps)>,
    /// What solids leave of these.
    within: Vec<(Arc<Solid>, Maps, Maps)>,
    /// Of the volumes that are drawn as splines the coefficients.
    splines: Vec<(Arc<Volume>, Arc<Volume>)>,
}

type Maps = (Arc<DistanceMap>, Arc<CellMasks>);

impl MapCache {
    /// With nothing known yet.
    pub fn new(instructions: InstructionSet) -> Self {
        Self { instructions, known: vec![], within: vec![], splines: vec![] }
    }

    /// The coefficients of the spline through a volume's samples.
    pub fn spline(&mut self, volume: &Arc<Volume>) -> Arc<Volume> {
        if let Some((_, known)) = self.splines.iter().find(|(of, _)| Arc::ptr_eq(of, volume)) {
            return Arc::clone(known);
        }
        let coefficients = Arc::new(spline::coefficients(volume));
        self.splines.push((Arc::clone(volume), Arc::clone(&coefficients)));
        coefficients
    }

    /// Where what is walked to of a surface can be.
    pub fn get(&mut self, surface: &Surface, what: &Walked) -> Maps {
        let whole = self.of_whole(surface, what);
        let Some(solid) = &surface.solid else { return whole };
        let is_same = |(of, from, _): &&(Arc<Solid>, Maps, Maps)| Arc::ptr_eq(of, solid) && Arc::ptr_eq(&from.1, &whole.1);
        if let Some((.., maps)) = self.within.iter().find(is_same) {
            return maps.clone();
        }
        // A solid that is worked on has another shape in each picture.
        self.within.retain(|(_, from, _)| !Arc::ptr_eq(&from.1, &whole.1));
        let (map, masks) = whole.1.within(&whole.0, solid, surface.volume.grid().dims());
        let maps = (Arc::new(map), Arc::new(masks));
        self.within.push((Arc::clone(solid), whole, maps.clone()));
        maps
    }

    /// The same, whatever cuts leave.
    fn of_whole(&mut self, surface: &Surface, what: &Walked) -> Maps {
        let known = self.known.iter().find(|(v, level, walked, _)| is_of(surface, v, *level) && walked == what);
        if let Some((.., maps)) = known {
            return maps.clone();
        }
        // Nothing else is asked for of the same surface as long as the view stays as it is.
        self.known.retain(|(v, level, ..)| !is_of(surface, v, *level));
        let (volume, level, sign) = (&surface.volume, surface.level as f32, surface.sign);
        let dims = volume.grid().dims();
        let of = |bricks: &RangeBricks, store: Store<'_>| {
            let occupancy = Occupancy::of(bricks, level, sign, what);
            let masks = || CellMasks::build(self.instructions, (store, bricks), &occupancy, [level, sign], what);
            let (map, masks) = rayon::join(|| DistanceMap::of(&occupancy), masks);
            (Arc::new(map), Arc::new(masks))
        };
        let store = Store::of(volume);
        let maps = match store.whole() {
            // A spline reaches beyond the corners of its cells.
            AnyBlock::F32(coefficients) if self.splines.iter().any(|(_, spline)| Arc::ptr_eq(spline, volume)) => {
                let hull = spline::hull(coefficients.onward([0; 3]), dims, sign);
                of(&RangeBricks::build(&hull, dims), Store::new(&Samples::F32(hull), dims))
            }
            _ => of(volume.bricks(), store),
        };
        self.known.push((Arc::clone(volume), surface.level, what.clone(), maps.clone()));
        maps
    }

    /// Memory that they take.
    pub fn bytes(&self) -> usize {
        let all = self.known.iter().map(|(.., maps)| maps).chain(self.within.iter().map(|(.., maps)| maps));
        let maps = all.map(|(map, masks)| map.bytes() + masks.bytes());
        let splines = self.splines.iter().map(|(_, spline)| spline.sample_bytes() + spline.index_bytes());
        maps.sum::<usize>() + splines.sum::<usize>()
    }

    /// Forgets all but what is known of some surfaces, and of splines through some volumes, which others may draw by turns.
    pub fn keep_only(&mut self, surfaces: &[(usize, Surface)], splines: &[Arc<Volume>]) {
        self.splines.retain(|(of, _)| splines.iter().any(|volume| Arc::ptr_eq(of, volume)));
        let is_spline = |volume: &Arc<Volume>| self.splines.iter().any(|(_, spline)| Arc::ptr_eq(spline, volume));
        let is_drawn = |volume: &Arc<Volume>, level| surfaces.iter().any(|(_, s)| is_of(s, volume, level));
        let has_newer = |volume: &Arc<Volume>| surfaces.iter().any(|(_, s)| Arc::ptr_eq(&s.volume, volume));
        self.known.retain(|(v, level, ..)| is_drawn(v, *level) || is_spline(v) && !has_newer(v));
        let known = &self.known;
        self.within.retain(|(_, from, _)| known.iter().any(|(.., maps)| Arc::ptr_eq(&maps.1, &from.1)));
    }
}

fn is_of(surface: &Surface, volume: &Arc<Volume>, level: f64) -> bool {
    Arc::ptr_eq(&surface.volume, volume) && surface.level == level
}
