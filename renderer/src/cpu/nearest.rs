//! What is drawn of each layer, and which of it is nearest.
//!
//! The twin of `shaders/nearest.wgsl`.

use crate::lanes::{Floats, Mask, Vecs, axes};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// What is drawn of one layer, or the nearest of several.
#[derive(Clone, Copy)]
pub(super) struct Drawn<S: Simd> {
    /// In which lanes there is anything.
    pub found: Mask<S>,
    /// Depth behind the base plane, mm; the nearest is drawn first.
    pub s: Floats<S>,
    /// In the world, toward the viewer, unit; zero where there is none.
    pub normal: Vecs<S>,
    /// Linear colour.
    pub color: Vecs<S>,
    /// Opacity where the mode draws it transparent.
    pub opacity: Floats<S>,
    /// 1-based layer.
    pub id: Floats<S>,
    /// Where it is the face of a cut that shows values; these as brightness, not yet kept between 0 and 1.
    pub is_face: Mask<S>,
    pub brightness: Floats<S>,
}

/// The nearest of each lane, leaving out that of the layer of number `skip`; of equal ones the first layer's.
#[inline(always)]
pub(super) fn nearest<S: Simd>(simd: S, hits: &[Drawn<S>], skip: Floats<S>) -> Drawn<S> {
    let zero = Floats::splat(simd, 0.0);
    let mut best = Drawn {
        found: Mask::splat(simd, false),
        s: zero,
        normal: [zero; 3],
        color: [zero; 3],
        opacity: zero,
        id: zero,
        is_face: Mask::splat(simd, false),
        brightness: zero,
    };
    for hit in hits {
        let nearer = hit.found & hit.id.simd_ne(skip) & (!best.found | hit.s.simd_lt(best.s));
        best.found |= nearer;
        best.s = nearer.select(hit.s, best.s);
        best.normal = axes!(a => nearer.select(hit.normal[a], best.normal[a]));
        best.color = axes!(a => nearer.select(hit.color[a], best.color[a]));
        best.opacity = nearer.select(hit.opacity, best.opacity);
        best.id = nearer.select(hit.id, best.id);
        best.is_face = (best.is_face & !nearer) | (hit.is_face & nearer);
        best.brightness = nearer.select(hit.brightness, best.brightness);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::Random;
    use fearless_simd::{Level, dispatch};

    #[test]
    fn the_nearest_is_found_but_never_the_one_that_is_skipped() {
        // Fails if a hit that is none counts, a farther one wins, an equal one's order changes, or a part is another hit's.
        let mut r = Random(1);
        for _ in 0..300 {
            let hits: Vec<(bool, f32, bool)> = (0..4).map(|_| (r.unit() < 0.7, (8.0 * r.unit()).floor() as f32, r.unit() < 0.5)).collect();
            let skip = (5.0 * r.unit()).floor() as f32;
            let found = dispatch!(Level::new(), simd => {
                let splat = |v| Floats::splat(simd, v);
                let drawn = |(n, &(found, s, is_face)): (usize, &(bool, f32, bool))| {
                    let id = (n + 1) as f32;
                    let (found, is_face) = (Mask::splat(simd, found), Mask::splat(simd, is_face));
                    let [v, w] = [splat(id), splat(-id)];
                    Drawn { found, s: splat(s), normal: [v; 3], color: [w; 3], opacity: v, id: v, is_face, brightness: w }
                };
                let hits: Vec<_> = hits.iter().enumerate().map(drawn).collect();
                let best = nearest(simd, &hits, splat(skip));
                best.found.test(0).then(|| ([best.s[0], best.id[0], best.normal[1][0], -best.color[2][0], best.opacity[0], -best.brightness[0]], best.is_face.test(0)))
            });
            let candidates = hits.iter().zip(1..).filter(|((found, ..), id)| *found && *id as f32 != skip);
            let expected = candidates.min_by(|a, b| a.0.1.total_cmp(&b.0.1)).map(|(&(_, s, is_face), id)| {
                let id = id as f32;
                ([s, id, id, id, id, id], is_face)
            });
            assert_eq!(found, expected, "{hits:?} without {skip}");
        }
    }
}
