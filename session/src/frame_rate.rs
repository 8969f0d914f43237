//! How many pictures come in a second, over one turn around what is seen.

use crate::compare::Part;
use bregma_field::{Cancelled, Progress, Volume};
use bregma_renderer::{Camera, RenderError, Renderer, Scene};
use glam::DQuat;
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Instant;
use thiserror::Error;

/// Pictures in a second, from the request to the pixels in memory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrameRate {
    /// Of the slowest picture.
    pub min_per_s: f64,
    /// All pictures over all their time.
    pub mean_per_s: f64,
    /// Of the fastest.
    pub max_per_s: f64,
}

/// Why pictures were not timed.
#[derive(Debug, Error)]
pub enum FrameRateError {
    /// One was not drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A clock counts in nanoseconds: no picture takes less.
const LEAST_MS: f64 = 1e-6;

impl FrameRate {
    /// Of pictures that took so long; none of no picture.
    pub fn of(frames_ms: &[f64]) -> Option<Self> {
        let times = || frames_ms.iter().map(|ms| ms.max(LEAST_MS));
        let (least, most) = (times().reduce(f64::min)?, times().reduce(f64::max)?);
        Some(Self { min_per_s: 1e3 / most, mean_per_s: 1e3 * frames_ms.len() as f64 / times().sum::<f64>(), max_per_s: 1e3 / least })
    }

    /// Of one turn of `frames` pictures about the axis that is up, from the view of `parts` on, which count as one picture; one more goes before
    /// them, for which what stays is made ready.
    pub fn of_turn(
        renderer: &mut dyn Renderer,
        volumes: &[Arc<Volume>],
        parts: &[Part],
        frames: u32,
        progress: &Progress,
    ) -> Result<Option<Self>, FrameRateError> {
        progress.begin(u64::from(frames) + 1);
        let mut draw = |angle_rad: f64| -> Result<f64, FrameRateError> {
            let begun = Instant::now();
            for (scene, [width, height]) in parts {
                let camera = turned(&scene.camera, angle_rad);
                renderer.render(volumes, &Scene { camera, ..scene.clone() }, *width, *height)?;
            }
            let ms = begun.elapsed().as_secs_f64() * 1e3;
            progress.advance(1)?;
            Ok(ms)
        };
        draw(0.0)?;
        let times = (0..frames).map(|n| draw(TAU * f64::from(n) / f64::from(frames)));
        Ok(Self::of(&times.collect::<Result<Vec<_>, _>>()?))
    }
}

/// A view turned about its target and the axis that is up in it.
fn turned(camera: &Camera, angle_rad: f64) -> Camera {
    let turn = DQuat::from_axis_angle(camera.up.try_normalize().unwrap_or(camera.basis().up), angle_rad);
    Camera { eye_mm: camera.target_mm + turn * (camera.eye_mm - camera.target_mm), ..*camera }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::Compare;
    use crate::opened::Opened;
    use bregma_renderer::CpuRenderer;

    #[test]
    fn the_mean_is_of_all_pictures_over_all_time() {
        // Fails if the mean is one of rates, which few fast pictures raise, or the ends are changed.
        let rate = FrameRate::of(&[10.0, 10.0, 40.0]).unwrap();
        assert_eq!((rate.min_per_s, rate.mean_per_s, rate.max_per_s), (25.0, 50.0, 100.0));
        assert_eq!(FrameRate::of(&[]), None);
        assert!(FrameRate::of(&[0.0]).unwrap().max_per_s.is_finite());
    }

    #[test]
    fn a_turn_is_timed_counted_and_stopped() {
        // Fails if frames are left out of the progress, the eye leaves its orbit, or a request to stop is not heard.
        let opened = Opened::demo(16, &Default::default()).unwrap();
        let (mut renderer, progress) = (CpuRenderer::default(), Progress::default());
        let mut of = |progress: &Progress| {
            let parts = Compare::SideBySide.parts(&opened.scene, opened.compared(), [32, 24]);
            FrameRate::of_turn(&mut renderer, &opened.volumes, &parts, 6, progress)
        };
        let rate = of(&progress).unwrap().unwrap();
        assert!(0.0 < rate.min_per_s && rate.min_per_s <= rate.mean_per_s && rate.mean_per_s <= rate.max_per_s, "{rate:?}");
        assert_eq!(progress.fraction(), 1.0);
        progress.cancel();
        assert!(matches!(of(&progress), Err(FrameRateError::Cancelled(_))));
        let (camera, half) = (opened.scene.camera, turned(&opened.scene.camera, TAU / 2.0));
        assert!((half.eye_mm.distance(half.target_mm) - camera.eye_mm.distance(camera.target_mm)).abs() < 1e-9);
        let level = |camera: &Camera| (camera.eye_mm - camera.target_mm).reject_from(camera.up);
        assert!((level(&half) + level(&camera)).length() < 1e-9);
    }
}
