//! From the numbers of a projection to a picture: the same for both renderers.

use crate::color::Color;
use crate::frame::{Frame, FrameLayer};
use crate::modes::RayValue;
use crate::picture::Picture;
use crate::scene::{Scene, Window};
use rayon::prelude::*;

/// What a pixel's ray has gathered of one layer, relative to its level and in sample units: the largest value or the integral over depth, and
/// the depth over which that was integrated. NaN where the ray has not met the volume.
pub(crate) type Gathered = [f32; 2];

/// A projection's value in a layer's values, the length that it is of, and what is seen of it: of an integral what is more than air's.
struct Value {
    value: f64,
    length_mm: f64,
    seen: f64,
}

/// Colours the picture of a projection; `gathered` holds for each pixel what each layer has given.
pub(crate) fn colored(frame: &Frame, scene: &Scene, of: RayValue, [width, height]: [u32; 2], gathered: &[Gathered]) -> Picture {
    let mut picture = Picture::of(scene.background_bytes(), width, height);
    picture.values = vec![f32::NAN; picture.rgba.len()];
    let count = frame.layers.len();
    if count == 0 {
        return picture;
    }
    let value = |n: usize, layer: &FrameLayer, [value, depth]: Gathered| -> Option<Value> {
        if value.is_nan() {
            return None;
        }
        let (at, depth) = (if scene.of_gradient { 0.0 } else { layer.appearance.value_at_level }, f64::from(depth));
        let value = f64::from(value) * layer.appearance.value_scale;
        let mm = frame.world_rays.direction.at(n as u32 % width, n as u32 / width).length();
        let length_mm = depth * mm;
        let value = match of {
            RayValue::Max | RayValue::Min => value + at,
            RayValue::Mean => at + if depth > 0.0 { value / depth } else { 0.0 },
            RayValue::Integral => (value + at * depth) * mm,
        };
        let air = if of == RayValue::Integral && !scene.of_gradient { layer.appearance.air } else { 0.0 };
        Some(Value { value, length_mm, seen: value - air * length_mm })
    };
    let values_of = |n: usize| {
        frame.layers.iter().zip(&gathered[n * count..]).map({
            let value = &value;
            move |(layer, g)| value(n, layer, *g)
        })
    };
    picture.values.par_iter_mut().enumerate().for_each(|(n, together)| *together = of_all(of, values_of(n).flatten()) as f32);
    let seen = (0..picture.rgba.len()).into_par_iter().flat_map_iter(|n| values_of(n).flatten().map(|v| [v.seen; 2]));
    let range = seen.reduce_with(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    let window = scene.window.unwrap_or_else(|| Window::between(range.unwrap_or([0.0, 1.0])));
    let brightness = |value: f64| {
        let b = window.brightness(value) as f32;
        // A film is the blacker, the less it was shielded (Beer); bone is white, as on a light box.
        if of == RayValue::Integral { (-FILM * b).exp_m1() / (-FILM).exp_m1() } else { b }
    };
    // Of several volumes the one with the extreme is named.
    let side = of.extreme().map_or(1.0, f64::from);
    picture.rgba.par_iter_mut().zip(&mut picture.volume_id).enumerate().for_each(|(n, (rgba, id))| {
        let (mut color, mut best) = ([0.0_f32; 3], None::<f64>);
        for (layer, value) in frame.layers.iter().zip(values_of(n)) {
            let Some(Value { seen: value, .. }) = value else { continue };
            if best.is_none_or(|b| side * value > side * b) {
                (best, *id) = (Some(value), (layer.placement.index + 1) as u8);
            }
            // One volume is grey; of several each has its colour, and they add up.
            let tint = if count == 1 { [1.0; 3] } else { scene.layers[layer.placement.index].color.0 };
            (0..3).for_each(|a| color[a] += tint[a] * brightness(value));
        }
        if best.is_some() {
            let [r, g, b] = Color(color).bytes();
            *rgba = [r, g, b, 255];
        }
    });
    picture
}

/// Optical depth of the brightest point of an X-ray: dark enough for contrast, and not yet black all over.
const FILM: f32 = 3.0;

/// The value of all volumes together.
fn of_all(of: RayValue, values: impl Iterator<Item = Value>) -> f64 {
    let (mut result, mut length_mm, mut any) = (0.0, 0.0, false);
    for one in values {
        match of {
            RayValue::Max => result = if any { one.value.max(result) } else { one.value },
            RayValue::Min => result = if any { one.value.min(result) } else { one.value },
            RayValue::Mean => result += one.value * one.length_mm,
            RayValue::Integral => result += one.value,
        }
        (length_mm, any) = (length_mm + one.length_mm, true);
    }
    match of {
        _ if !any => f64::NAN,
        RayValue::Mean if length_mm > 0.0 => result / length_mm,
        RayValue::Mean => f64::NAN,
        RayValue::Max | RayValue::Min | RayValue::Integral => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Projection;
    use crate::skip::MapCache;
    use crate::{InstructionSet, Mode};
    use bregma_field::Progress;
    use bregma_synthetic::{Random, Which, skull};
    use std::sync::Arc;

    const SOUGHT: [RayValue; 3] = [RayValue::Max, RayValue::Mean, RayValue::Integral];

    #[test]
    fn a_larger_number_is_never_darker() {
        // Fails if a window, the film's curve or a sign turns the order of brightnesses round, or the picture's own range is not all used.
        let volumes = [Arc::new(skull(Which::A, 12, &Progress::default()).unwrap())];
        let mut scene = Scene::of(&volumes);
        // All rays are equally long for each mm of depth.
        (scene.mode, scene.camera.projection) = (Mode::Max, Projection::Orthographic { height_mm: 100.0 });
        let frame = Frame::new(&mut MapCache::new(InstructionSet::new()), &volumes, &scene, [50, 2], 0).unwrap();
        let mut r = Random(1);
        for sought in SOUGHT {
            for n in 0..20 {
                let mut values: Vec<f32> = (0..99).map(|_| (4000.0 * r.unit() - 1000.0) as f32).collect();
                values.sort_by(f32::total_cmp);
                let gathered: Vec<Gathered> = values.iter().map(|v| [*v, 1.0]).chain([[f32::NAN, 0.0]]).collect();
                scene.window = (n > 0).then(|| Window { width: 3000.0 * r.unit(), level: 4000.0 * r.unit() - 1000.0 });
                let picture = colored(&frame, &scene, sought, [50, 2], &gathered);
                let grey: Vec<u8> = picture.rgba[..99].iter().map(|c| c[0]).collect();
                assert!(grey.is_sorted() && picture.values[..99].is_sorted(), "{sought:?} {:?}: {grey:?}", scene.window);
                assert!(n > 0 || (grey[0], grey[98]) == (0, 255), "{sought:?}: {grey:?}");
                // The last ray has met nothing.
                assert!(picture.values[99].is_nan() && picture.volume_id[99] == 0 && picture.rgba[99] == scene.background_bytes());
            }
        }
    }

    #[test]
    fn of_all_volumes_together_no_order_matters() {
        // Fails if the first volume counts otherwise than the others, or a mean is not by length.
        let mut r = Random(2);
        for _ in 0..1000 {
            let count = 1 + (4.0 * r.unit()) as usize;
            let all: Vec<[f64; 2]> = (0..count).map(|_| [2.0 * r.unit() - 1.0, 0.1 + r.unit()]).collect();
            let of = |sought, all: &[[f64; 2]]| of_all(sought, all.iter().map(|&[value, length_mm]| Value { value, length_mm, seen: 0.0 }));
            let turned: Vec<[f64; 2]> = all.iter().rev().copied().collect();
            let [low, high] = [f64::min, f64::max].map(|best| all.iter().map(|v| v[0]).reduce(best).unwrap());
            for sought in SOUGHT {
                let found = of(sought, &all);
                assert!((found - of(sought, &turned)).abs() < 1e-12, "{sought:?} {all:?}");
                assert!(of(sought, &[]).is_nan() && (of(sought, &all[..1]) - all[0][0]).abs() < 1e-12);
                // Twice the same says the same, but as a sum.
                let twice = of(sought, &[all.clone(), all.clone()].concat());
                let expected = if sought == RayValue::Integral { 2.0 * found } else { found };
                assert!((twice - expected).abs() < 1e-12, "{sought:?} {all:?}");
                assert!(sought == RayValue::Integral || low - 1e-12 <= found && found <= high + 1e-12, "{sought:?} {all:?}: {found}");
            }
            assert_eq!(of(RayValue::Max, &all), high);
        }
    }
}
