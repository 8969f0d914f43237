//! What the work is saved as, and whether it is.

use super::measured::Work;
use bregma_session::{Measurement, Session};
use std::path::{Path, PathBuf};

/// The session that the work belongs to.
#[derive(Debug)]
pub struct Document {
    /// Its file, once it has one.
    pub file: Option<PathBuf>,
    saved: Work,
}

/// What takes the place of the work.
#[derive(Clone, Debug)]
pub enum Next {
    /// Scans or a session.
    Files(Vec<PathBuf>),
    /// The built-in pair.
    Demo,
    /// Nothing: the program ends.
    Quit,
}

impl Document {
    /// The work as it was opened.
    pub fn new(file: Option<PathBuf>, work: &Work) -> Self {
        Self { file, saved: work.clone() }
    }

    /// Changes what is saved as the work was changed: by what is none of the person's doing.
    pub fn change(&mut self, change: impl Fn(&mut Work)) {
        change(&mut self.saved);
    }

    /// Nothing of the work would be lost: how it was looked at last is no work.
    pub fn is_saved(&self, work: &Work) -> bool {
        work.opened.volumes.is_empty() || self.saved.same_work(work)
    }

    /// What the work is called: its file, or its scans.
    pub fn name(&self, work: &Work) -> String {
        match &self.file {
            Some(file) => file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            None => work.opened.volumes.iter().map(|v| v.name()).collect::<Vec<_>>().join(", "),
        }
    }

    /// The name, with a dot where something is unsaved.
    pub fn title(&self, work: &Work) -> String {
        format!("{}{}", self.name(work), if self.is_saved(work) { "" } else { " •" })
    }
}

/// The session of the work, with files named from `folder` on; `records` are its rays.
pub fn session(work: &Work, folder: &Path, records: Vec<Measurement>) -> Session {
    let session = Session::of(&work.opened, folder);
    let measurements = records.into_iter().chain(session.measurements).collect();
    Session { measurements, landmarks: work.measured.landmarks.clone(), ..session }
}
