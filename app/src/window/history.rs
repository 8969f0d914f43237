//! Undo and redo: a stack of what the person made, without the camera and how scans are compared.

use super::measured::Work;

/// Steps kept; each is a few hundred bytes, as the samples are shared.
const STEPS: usize = 200;

/// Earlier and later states of the work.
#[derive(Debug)]
pub struct History {
    past: Vec<Work>,
    present: Work,
    future: Vec<Work>,
}

impl History {
    /// Begins with `work`.
    pub fn new(work: &Work) -> Self {
        Self { past: vec![], present: work.clone(), future: vec![] }
    }

    /// Makes a step of what changed since the last one, if anything did.
    pub fn record(&mut self, work: &Work) {
        // The camera is no step, and is not compared.
        self.present.opened.scene.camera = work.opened.scene.camera;
        if !self.present.same(work) {
            self.past.push(std::mem::replace(&mut self.present, work.clone()));
            self.future.clear();
            if self.past.len() > STEPS {
                self.past.remove(0);
            }
        }
    }

    /// There is a step to take back.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// There is a step to take again.
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    /// Takes one step back; the view stays.
    pub fn undo(&mut self, work: &mut Work) {
        self.record(work);
        if let Some(earlier) = self.past.pop() {
            self.future.push(std::mem::replace(&mut self.present, earlier));
            self.restore(work);
        }
    }

    /// Takes one step forward again; the view stays.
    pub fn redo(&mut self, work: &mut Work) {
        self.record(work);
        if let Some(later) = self.future.pop() {
            self.past.push(std::mem::replace(&mut self.present, later));
            self.restore(work);
        }
    }

    fn restore(&self, work: &mut Work) {
        let (camera, compare) = (work.opened.scene.camera, work.opened.compare);
        let (selected, count) = (work.measured.selected, work.measured.rays.len());
        *work = self.present.clone();
        (work.opened.scene.camera, work.opened.compare) = (camera, compare);
        // What is shown stays shown, unless a ray came or went.
        if work.measured.rays.len() == count {
            work.measured.selected = selected;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::measured::Measured;
    use super::*;
    use bregma_renderer::Mode;
    use bregma_session::Opened;
    use glam::DVec3;

    #[test]
    fn undo_takes_back_steps_but_not_the_view() {
        let mut work = Work { opened: Opened::new(vec![], vec![]), measured: Measured::default() };
        let mut history = History::new(&work);
        work.opened.scene.mode = Mode::Overlay;
        history.record(&work);
        work.opened.scene.camera.target_mm = DVec3::ONE;
        history.record(&work);
        work.opened.scene.background = None;
        // The last change was not recorded yet: it is a step of its own.
        history.undo(&mut work);
        assert!(work.opened.scene.background.is_some() && work.opened.scene.mode == Mode::Overlay);
        history.undo(&mut work);
        assert!(work.opened.scene.mode == Mode::Iso && !history.can_undo());
        assert_eq!(work.opened.scene.camera.target_mm, DVec3::ONE);
        history.redo(&mut work);
        assert!(work.opened.scene.mode == Mode::Overlay && history.can_redo());
        work.opened.scene.mode = Mode::Iso;
        history.record(&work);
        assert!(!history.can_redo());
    }

    #[test]
    fn looking_at_another_ray_is_no_step() {
        // Fails if undo stops at a selection, or a step of something else shows another ray.
        let ray = bregma_renderer::Ray { origin: bregma_field::WorldPoint(DVec3::ZERO), direction: DVec3::Z };
        let mut work = Work { opened: Opened::new(vec![], vec![]), measured: Measured::default() };
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
