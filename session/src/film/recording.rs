//! What a person does while it is recorded, as keys of a film: noted at even distances of time, and thinned to what glides through it again.

use super::{Film, Key, glide, track};
use crate::opened::Opened;
use bregma_field::WorldPoint;
use bregma_renderer::Camera;

/// A key is noted so often, seconds: hands turn no faster than a glide through ten keys a second follows.
pub const EVERY_S: f64 = 0.1;
/// So many keys at most, ten minutes: what is longer ends there.
const MOST: usize = 6000;
/// A replayed view is nowhere farther off than this, in pixels of a picture of [`SIZE`]: less than is seen.
const OFF_PX: f64 = 0.5;
/// Pixels across and down of such a picture.
const SIZE: [u32; 2] = [1280, 720];
/// A replayed number is no farther off than this part of the way that it goes in the recording: finer than a hand moves a slider.
const OFF_PART: f64 = 1.0 / 200.0;

/// Keys on their way.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    noted: Vec<Key>,
}

impl Recording {
    /// Takes note of what is seen at a time of the recording, where that is far enough from the last one; whether more can be noted. A key has its
    /// frame's own time: what moves fast is many pixels elsewhere a hundredth of a second later.
    pub fn note(&mut self, opened: &Opened, at_s: f64) -> bool {
        // Rounding keeps no frame away.
        if self.noted.last().is_none_or(|last| at_s >= last.at_s + EVERY_S - 1e-6) {
            self.noted.push(Key::of(opened, at_s));
        }
        self.noted.len() < MOST
    }

    /// The film of what was noted, from its beginning to what is seen now, at a time of the recording; `None` where no time has passed. It glides
    /// through the keys that are left within half a pixel of what was noted, and numbers within a two-hundredth of their way.
    pub fn film(mut self, opened: &Opened, at_s: f64, fps: f64) -> Option<Film> {
        let first_s = self.noted.first()?.at_s;
        self.noted.retain(|key| key.at_s < at_s);
        self.noted.push(Key::of(opened, at_s));
        self.noted.iter_mut().for_each(|key| key.at_s -= first_s);
        let seconds = at_s - first_s;
        if seconds <= 0.0 {
            return None;
        }
        // Cuts and scans that came or went since have no place in keys.
        let is_alike = |key: &Key| numbers(key).len() == numbers(&self.noted[self.noted.len() - 1]).len();
        let noted: Vec<Key> = self.noted.iter().filter(|key| is_alike(key)).cloned().collect();
        let keys = thinned(&noted).into_iter().map(|n| noted[n].clone()).collect();
        Some(Film { seconds, fps, turns: None, keys })
    }
}

/// All numbers of a key but its camera's.
fn numbers(key: &Key) -> Vec<f64> {
    let lists = [&key.iso, &key.opacity, &key.cut_offsets_mm].into_iter().flatten().flatten().copied();
    lists.chain(key.light.iter().flat_map(|light| light.to_array())).chain(key.swipe).collect()
}

/// The numbers of the keys that stay: the ends, and, until a glide through them replays all others, the worst between each two.
fn thinned(noted: &[Key]) -> Vec<usize> {
    let all: Vec<Vec<f64>> = noted.iter().map(numbers).collect();
    let way = |c: usize| {
        let [low, high] = all.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v[c]), high.max(v[c])]);
        (high - low) * OFF_PART
    };
    let off: Vec<f64> = (0..all.first().map_or(0, Vec::len)).map(way).collect();
    let mut kept = vec![0, noted.len() - 1];
    loop {
        // A glide between two keys goes by these and their neighbours.
        let worst = |n: usize| {
            let near = &kept[n.saturating_sub(1)..(n + 3).min(kept.len())];
            let cameras: Vec<(f64, Camera)> = near.iter().filter_map(|n| Some((noted[*n].at_s, noted[*n].camera?))).collect();
            let track = |c: usize| near.iter().map(|n| (noted[*n].at_s, all[*n][c])).collect();
            let tracks: Vec<Vec<(f64, f64)>> = (0..off.len()).map(track).collect();
            // 1 is just good enough.
            let flaw = |n: usize| {
                let (key, t) = (&noted[n], noted[n].at_s);
                let camera = glide::camera(&cameras, t).zip(key.camera).map_or(0.0, |(glided, seen)| off_px(&seen, &glided) / OFF_PX);
                let number = |c: usize| {
                    let apart = track::at(&tracks[c], t).map_or(0.0, |v| (v - all[n][c]).abs());
                    // What does not move has no way.
                    if off[c] > 0.0 { apart / off[c] } else { 0.0 }
                };
                (0..off.len()).map(number).fold(camera, f64::max)
            };
            let within = (kept[n] + 1..kept[n + 1]).map(|n| (flaw(n), n));
            within.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(flaw, _)| *flaw > 1.0).map(|(_, n)| n)
        };
        let more: Vec<usize> = (0..kept.len() - 1).filter_map(worst).collect();
        if more.is_empty() {
            return kept;
        }
        kept.extend(more);
        kept.sort_unstable();
    }
}

/// How far what a camera sees lies off where another one has it, pixels: the corners and the middle of the picture, before and behind its target.
fn off_px(seen: &Camera, other: &Camera) -> f64 {
    let [width, height] = SIZE;
    let places = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.5, 0.5)];
    let away_mm = seen.eye_mm.distance(seen.target_mm);
    let points = places.into_iter().flat_map(|(x, y)| [0.75, 1.25].map(|part| (x * f64::from(width), y * f64::from(height), part)));
    let off = |(x, y, part): (f64, f64, f64)| {
        let point = WorldPoint(seen.ray(x, y, width, height).at(part * away_mm).0);
        let there = other.project(point, width, height);
        there.map_or(f64::INFINITY, |(u, v)| (u - x).hypot(v - y))
    };
    points.map(off).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::{Bounds, Clip, Shape};
    use glam::DVec3;

    fn opened() -> Opened {
        let mut opened = Opened::demo(12, &Default::default()).unwrap();
        opened.scene.clips = vec![Clip::all(Shape::Plane { normal: DVec3::X, offset_mm: 1.0 })];
        opened
    }

    /// What a hand does: turns, rests, zooms, moves an isovalue and a cut, jumps.
    fn at(opened: &mut Opened, t: f64) {
        let bounds = Bounds { centre_mm: DVec3::ZERO, radius_mm: 100.0 };
        let turn = if t < 4.0 { 60.0 * (t * 1.3).sin() } else { 60.0 * (4.0_f64 * 1.3).sin() };
        let mut camera = Camera::orbit(&bounds, turn, 20.0 * (t * 0.7).cos());
        if t > 6.0 {
            camera.eye_mm = camera.target_mm + (camera.eye_mm - camera.target_mm) * (-(t - 6.0) * 0.2).exp();
        }
        if t > 9.0 {
            camera = Camera::orbit(&bounds, -90.0, 0.0);
        }
        opened.scene.camera = camera;
        opened.scene.layers[0].iso = 300.0 + if (2.0..5.0).contains(&t) { 40.0 * (t - 2.0) } else { 0.0 };
        if let Shape::Plane { offset_mm, .. } = &mut opened.scene.clips[0].shape {
            *offset_mm = (t * 0.9).sin();
        }
    }

    #[test]
    fn a_recording_replays_within_half_a_pixel_by_few_keys() {
        // Fails if a replayed view lies farther off than is seen, a number farther than its tolerance, keys are as many as were noted, or it ends early.
        let mut opened = opened();
        let mut recording = Recording::default();
        // Frames come unevenly.
        let times = (0..720).map(|n| f64::from(n) / 60.0 + 0.004 * f64::from(n % 3));
        for t in times {
            at(&mut opened, t);
            recording.note(&opened, t);
        }
        at(&mut opened, 12.0);
        let noted = recording.noted.clone();
        let apart_s = noted.windows(2).map(|pair| pair[1].at_s - pair[0].at_s);
        // A frame is a sixtieth of a second and some.
        assert!(apart_s.into_iter().all(|s| (EVERY_S - 1e-6..EVERY_S + 0.025).contains(&s)), "at even distances");
        let film = recording.film(&opened, 12.0, 30.0).unwrap();
        film.check(&opened).unwrap();
        let (mut off, mut iso, mut cut) = (0.0_f64, 0.0_f64, 0.0_f64);
        for key in &noted {
            let shown = film.at(&opened, key.at_s);
            off = off.max(off_px(&key.camera.unwrap(), &shown.scene.camera));
            iso = iso.max((shown.scene.layers[0].iso - key.iso.as_ref().unwrap()[0]).abs());
            let Shape::Plane { offset_mm, .. } = shown.scene.clips[0].shape else { panic!("the cut is a plane") };
            cut = cut.max((offset_mm - key.cut_offsets_mm.as_ref().unwrap()[0]).abs());
        }
        println!("{} keys of {} noted; off by {off:.2} px, isovalue {iso:.2} of 120, cut {cut:.4} of 2 mm", film.keys.len(), noted.len());
        assert!(off <= OFF_PX && iso <= 120.0 * OFF_PART + 1e-9 && cut <= 2.0 * OFF_PART + 1e-9);
        assert!(film.keys.len() < noted.len() * 3 / 4 && film.seconds == 12.0);
        // Nothing moved: the ends are enough.
        let mut still = Recording::default();
        assert!((0..100).all(|n| still.note(&opened, f64::from(n) / 20.0)));
        assert_eq!(still.film(&opened, 5.0, 30.0).unwrap().keys.len(), 2);
        assert!(Recording::default().film(&opened, 1.0, 30.0).is_none());
    }

    #[test]
    fn a_cut_that_comes_in_a_recording_costs_no_film() {
        // Fails if keys before it have too few numbers, so that the film cannot be shown.
        let mut opened = opened();
        let mut recording = Recording::default();
        for n in 0..40 {
            if n == 20 {
                opened.scene.clips.push(Clip::all(Shape::Plane { normal: DVec3::Z, offset_mm: 3.0 }));
            }
            recording.note(&opened, f64::from(n) * EVERY_S);
        }
        let film = recording.film(&opened, 4.0, 30.0).unwrap();
        film.check(&opened).unwrap();
    }

    #[test]
    fn ten_minutes_are_thinned_while_nobody_waits_long() {
        // Fails if the end of a long recording holds the window up.
        let mut opened = opened();
        let mut recording = Recording::default();
        for n in 0..MOST {
            let t = n as f64 * EVERY_S;
            at(&mut opened, t % 9.0);
            recording.note(&opened, t);
        }
        let begun = std::time::Instant::now();
        let film = recording.film(&opened, 600.0, 30.0).unwrap();
        let seconds = begun.elapsed().as_secs_f64();
        println!("{} keys of {MOST} in {seconds:.2} s", film.keys.len());
        // A twentieth of a second on a free core.
        assert!(seconds < 2.0, "{seconds} s");
    }
}
