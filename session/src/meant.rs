//! What of the scans that are open is meant: measured as scans of its own, and kept in files beside a session.

use crate::labelled::Labelled;
use crate::measurement::Measurement;
use crate::opened::Opened;
use crate::parts::PartOf;
use crate::shelf::safe_name;
use crate::source::Source;
use bregma_field::{Progress, Solid, Volume, within};
use bregma_parts::PartsError;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// A scan, a solid on its samples, and what that leaves of it; each as long as somebody has it.
type Left = (Weak<Volume>, Weak<Solid>, Weak<Volume>);

/// What solids left of scans: measurements know scans by where they are in memory, so the same must be the same.
static LEFT: Mutex<Vec<Left>> = Mutex::new(vec![]);

/// What is known to be left of a scan.
fn known_left(known: &[Left], volume: &Arc<Volume>, solid: &Arc<Solid>) -> Option<Arc<Volume>> {
    let is_same = |(v, s, _): &&Left| v.as_ptr() == Arc::as_ptr(volume) && s.as_ptr() == Arc::as_ptr(solid);
    known.iter().find(is_same).and_then(|(.., left)| left.upgrade())
}

fn left_of(volume: &Arc<Volume>, solid: &Arc<Solid>) -> Arc<Volume> {
    let mut known = LEFT.lock().unwrap_or_else(PoisonError::into_inner);
    known.retain(|(volume, solid, left)| [volume.strong_count(), solid.strong_count(), left.strong_count()].iter().all(|n| *n > 0));
    known_left(&known, volume, solid).unwrap_or_else(|| {
        let left = Arc::new(within(volume, solid));
        known.push((Arc::downgrade(volume), Arc::downgrade(solid), Arc::downgrade(&left)));
        left
    })
}

impl Opened {
    /// What maps, volumes and registrations measure: of scans of which a part is meant, what lies in it, as scans of their own. Rays are cut by the part
    /// itself, and take what is open.
    pub fn measured(&self) -> Cow<'_, Self> {
        if self.scene.layers.iter().all(|layer| layer.measured_solid().is_none()) {
            return Cow::Borrowed(self);
        }
        let mut measured = self.clone();
        for (volume, layer) in measured.volumes.iter_mut().zip(&mut measured.scene.layers) {
            if let Some(solid) = layer.measured_solid() {
                *volume = left_of(volume, &solid);
                layer.within = None;
            }
        }
        Cow::Owned(measured)
    }

    /// Whether `volume` is what is measured of scan number `n`; asked for each picture, it makes nothing.
    pub fn is_measured(&self, n: usize, volume: &Arc<Volume>) -> bool {
        let Some((open, layer)) = self.volumes.get(n).zip(self.scene.layers.get(n)) else { return false };
        match layer.measured_solid() {
            Some(solid) => {
                let known = LEFT.lock().unwrap_or_else(PoisonError::into_inner);
                known_left(&known, open, &solid).is_some_and(|left| Arc::ptr_eq(&left, volume))
            }
            None => Arc::ptr_eq(open, volume),
        }
    }
}

/// Label maps, and the files that they are in.
pub type Written = Vec<(Labelled, PathBuf)>;

impl Opened {
    /// Where scans came from, and those that something was measured on.
    fn all_sources(&mut self) -> impl Iterator<Item = &mut Source> {
        let origins = self.measurements.iter_mut().filter_map(Measurement::origin_mut);
        self.sources.iter_mut().chain(origins.flat_map(|origin| &mut origin.scans).map(|scan| &mut scan.source))
    }

    /// Writes the label maps that are in no file yet beside a session, as `SESSION.SCAN.seg.nrrd`. A file that is there stays: an earlier record may be
    /// of it.
    pub fn write_labels(&mut self, session: &Path, written: &mut Written, progress: &Progress) -> Result<(), PartsError> {
        let stem = session.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for source in self.all_sources().filter(|source| source.within.is_none()) {
            let Some(labelled) = &source.labels else { continue };
            if written.iter().any(|(known, _)| known.is_same_map(labelled)) {
                continue;
            }
            let name = format!("{stem}.{}", safe_name(&source.name()));
            let named = |n: usize| if n == 1 { format!("{name}.seg.nrrd") } else { format!("{name}-{n}.seg.nrrd") };
            let free = (1..).map(|n| session.with_file_name(named(n))).find(|file| !file.exists());
            let Some(file) = free else { continue };
            labelled.write(&file, progress)?;
            written.push((labelled.clone(), file));
        }
        Ok(())
    }

    /// Names the files that label maps are in.
    pub fn name_labels(&mut self, written: &Written) {
        for source in self.all_sources().filter(|source| source.within.is_none()) {
            let Some(labelled) = &source.labels else { continue };
            let file = written.iter().find(|(known, _)| known.is_same_map(labelled)).map(|(_, file)| file.clone());
            source.within = file.map(|file| PartOf::kept_of(labelled, file));
        }
    }
}
