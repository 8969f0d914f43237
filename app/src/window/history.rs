//! Undo and redo: a stack of what the person made, opened and looked at.

use super::measured::Work;
use std::collections::HashMap;
use std::sync::Arc;

/// Steps kept; each is a few hundred bytes, as the samples are shared.
const STEPS: usize = 200;
/// Bytes that scans may hold which only undo would bring back: a closed scan of 512³ at 16 bits, twice.
const CLOSED_BYTES: usize = 1 << 29;

/// Earlier and later states of the work.
#[derive(Debug)]
pub struct History {
    past: Vec<Work>,
    present: Work,
    future: Vec<Work>,
    /// The newest step is one of looking only: what is looked at next joins it, so that undo does not go through every turn of the view.
    is_look: bool,
}

impl History {
    /// Begins with `work`.
    pub fn new(work: &Work) -> Self {
        Self { past: vec![], present: work.clone(), future: vec![], is_look: false }
    }

    /// Makes a step of what changed since the last one, if anything did.
    pub fn record(&mut self, work: &Work) {
        if self.present.same(work) {
            // Which ray is selected is remembered, but is no step.
            self.present.measured.selected = work.measured.selected;
            return;
        }
        let is_look = self.present.same_work(work);
        let before = std::mem::replace(&mut self.present, work.clone());
        if !(is_look && self.is_look) {
            self.past.push(before);
        }
        self.is_look = is_look;
        self.future.clear();
        while self.past.len() > STEPS || !self.past.is_empty() && self.closed_bytes() > CLOSED_BYTES {
            self.past.remove(0);
        }
    }

    /// Takes the view as it is, as no step: nobody moved it.
    pub fn look_along(&mut self, work: &Work) {
        self.present.opened.scene.camera = work.opened.scene.camera;
    }

    /// Bytes of the scans, label maps and parts' spaces that are in no present but in some other state.
    fn closed_bytes(&self) -> usize {
        let kept = || self.past.iter().chain(&self.future);
        let mut closed: HashMap<_, usize> = kept().flat_map(shared).collect();
        shared(&self.present).for_each(|(open, _)| _ = closed.remove(&open));
        closed.values().sum::<usize>() + self.label_bytes()
    }

    /// Bytes of label maps that one state does not share with the next.
    fn label_bytes(&self) -> usize {
        let states: Vec<&Work> = self.past.iter().chain([&self.present]).chain(self.future.iter().rev()).collect();
        let beside = |pair: &[&Work]| -> usize {
            let labels = |work: &Work, n: usize| work.opened.sources.get(n).and_then(|source| source.labels.clone());
            let both = (0..pair[0].opened.sources.len()).filter_map(|n| labels(pair[0], n).zip(labels(pair[1], n)));
            both.map(|(was, is)| was.bytes_beside(&is)).sum()
        };
        states.windows(2).map(beside).sum()
    }

    /// Changes all states alike: what is no step.
    pub fn change_all(&mut self, change: impl Fn(&mut Work)) {
        self.past.iter_mut().chain([&mut self.present]).chain(&mut self.future).for_each(change);
    }

    /// There is a step to take back.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// There is a step to take again.
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    /// Takes one step back.
    pub fn undo(&mut self, work: &mut Work) {
        self.record(work);
        if let Some(earlier) = self.past.pop() {
            self.future.push(std::mem::replace(&mut self.present, earlier));
            self.restore(work);
        }
    }

    /// Takes one step forward again.
    pub fn redo(&mut self, work: &mut Work) {
        self.record(work);
        if let Some(later) = self.future.pop() {
            self.past.push(std::mem::replace(&mut self.present, later));
            self.restore(work);
        }
    }

    fn restore(&mut self, work: &mut Work) {
        // A look after this is a step of its own.
        self.is_look = false;
        let (selected, count) = (work.measured.selected, work.measured.rays.len());
        *work = self.present.clone();
        // What is shown stays shown, unless a ray came or went.
        if work.measured.rays.len() == count {
            work.measured.selected = selected;
        }
    }
}

/// All that is large and that several states may share: where it is in memory, and its bytes.
fn shared(work: &Work) -> impl Iterator<Item = (*const (), usize)> {
    let opened = &work.opened;
    let solids = opened.scene.layers.iter().filter_map(|layer| layer.within.as_ref()?.solid.as_ref());
    let volumes = opened.volumes.iter().map(|volume| (volume.samples_id().cast(), volume.sample_bytes()));
    volumes.chain(solids.map(|solid| (Arc::as_ptr(solid).cast(), solid.bytes())))
}

#[cfg(test)]
mod tests {
    use super::super::measured::Measured;
    use super::*;
    use bregma_renderer::Mode;
    use bregma_session::Opened;
    use glam::DVec3;

    fn nothing() -> Work {
        Work { opened: Opened::new(vec![], vec![]), measured: Measured::default() }
    }

    #[test]
    fn undo_takes_back_works_one_by_one_and_looks_in_between_at_once() {
        // Fails if a turn of the view is not taken back, takes more than one step, or takes work with it.
        let mut work = nothing();
        let mut history = History::new(&work);
        work.opened.scene.mode = Mode::Overlay;
        history.record(&work);
        for turn in 1..=3 {
            work.opened.scene.camera.target_mm = DVec3::splat(f64::from(turn));
            history.record(&work);
        }
        work.opened.scene.background = None;
        // The last change was not recorded yet: it is a step of its own.
        history.undo(&mut work);
        assert!(work.opened.scene.background.is_some() && work.opened.scene.mode == Mode::Overlay);
        assert_eq!(work.opened.scene.camera.target_mm, DVec3::splat(3.0));
        history.undo(&mut work);
        assert!(work.opened.scene.camera.target_mm != DVec3::splat(2.0) && work.opened.scene.mode == Mode::Overlay);
        history.undo(&mut work);
        assert!(work.opened.scene.mode == Mode::Iso && !history.can_undo());
        history.redo(&mut work);
        assert!(work.opened.scene.mode == Mode::Overlay && history.can_redo());
        work.opened.scene.mode = Mode::Iso;
        history.record(&work);
        assert!(!history.can_redo());
    }

    #[test]
    fn openings_are_taken_back_as_far_as_memory_allows() {
        // Fails if undo does not bring a closed scan back, or keeps any number of closed scans.
        let mut work = nothing();
        let mut history = History::new(&work);
        let first = Opened::demo(16, &Default::default()).unwrap();
        work.opened = first.clone();
        history.record(&work);
        work.opened = Opened::demo(12, &Default::default()).unwrap();
        history.record(&work);
        history.undo(&mut work);
        assert!(Arc::ptr_eq(&work.opened.volumes[0], &first.volumes[0]));
        history.redo(&mut work);
        assert!(history.closed_bytes() > 0 && history.closed_bytes() < CLOSED_BYTES);
    }

    #[test]
    fn looking_at_another_ray_is_no_step() {
        // Fails if undo stops at a selection, or a step of something else shows another ray.
        let ray = bregma_renderer::Ray { origin: bregma_field::WorldPoint(DVec3::ZERO), direction: DVec3::Z };
        let mut work = nothing();
        let mut history = History::new(&work);
        work.measured.add_ray(ray);
        work.measured.add_ray(ray);
        history.record(&work);
        work.opened.scene.mode = Mode::Overlay;
        history.record(&work);
        work.measured.selected = 0;
        history.record(&work);
        history.undo(&mut work);
        assert!(work.opened.scene.mode == Mode::Iso && work.measured.selected == 0);
        history.undo(&mut work);
        assert!(work.measured.rays.is_empty());
    }
}
