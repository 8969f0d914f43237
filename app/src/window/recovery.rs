//! The work as it is now, kept in a file beside the window's own memory, so that a kill or a crash costs a second or two of it.
//!
//! Each run of the program has a file of its own, and a lock that the system drops with the process: a file whose lock is free was left
//! behind, and is offered at the next start.

use super::document::session;
use super::measured::Work;
use bregma_field::Progress;
use bregma_session::{Measurement, Opened, PartOf, Session, Written};
use egui::Context;
use std::fs::{self, File};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// So often at most the file is written: half of what may be lost.
const PAUSE: Duration = Duration::from_millis(1000);

/// A file that is being written is no older.
const STALE: Duration = Duration::from_secs(60);

/// The file of this run.
#[derive(Debug, Default)]
pub struct Recovery {
    folder: Option<PathBuf>,
    own: Option<Kept>,
    /// What the file holds, and since when.
    written: Option<(Work, Instant)>,
    /// What this work was recovered from, until it is in this run's own file.
    from: Option<Kept>,
    /// Label maps that lie beside the file.
    labels: Written,
}

/// A file of work, held by its lock.
#[derive(Debug)]
pub struct Kept {
    /// The work, as a session.
    pub file: PathBuf,
    lock: File,
    lock_file: PathBuf,
}

impl Kept {
    fn named(file: PathBuf) -> Option<Self> {
        let lock_file = file.with_extension("lock");
        let lock = File::options().read(true).write(true).create(true).truncate(false).open(&lock_file).ok()?;
        lock.try_lock().ok()?;
        Some(Self { file, lock, lock_file })
    }

    /// The session that the work belongs to.
    pub fn belongs_to(&self) -> Option<PathBuf> {
        let mut text = String::new();
        (&self.lock).read_to_string(&mut text).ok()?;
        (!text.is_empty()).then(|| text.into())
    }

    /// What is in it, in words: its scans' names, and how long ago it was.
    pub fn what(&self) -> String {
        let session: Option<Session> = fs::read(&self.file).ok().and_then(|text| serde_json::from_slice(&text).ok());
        let names = session.into_iter().flat_map(|s| s.volumes).map(|v| v.name()).collect::<Vec<_>>().join(", ");
        let age = fs::metadata(&self.file).and_then(|m| m.modified()).ok().and_then(|at| at.elapsed().ok());
        let minutes = age.map_or(0, |age| age.as_secs() / 60);
        let ago = match minutes {
            0 | 1 => "a minute ago".to_owned(),
            2..=119 => format!("{minutes} minutes ago"),
            _ => format!("{} hours ago", minutes / 60),
        };
        format!("{names}, {ago}")
    }

    /// The label maps that were written beside it.
    fn label_maps(&self) -> Vec<PathBuf> {
        let begins = self.file.with_extension("").file_name().map(|name| format!("{}.", name.to_string_lossy())).unwrap_or_default();
        let beside = self.file.parent().and_then(|folder| fs::read_dir(folder).ok()).into_iter().flatten().flatten();
        let named = beside.map(|entry| (entry.file_name().to_string_lossy().into_owned(), entry.path()));
        named.filter(|(name, _)| name.starts_with(&begins) && name.ends_with(".seg.nrrd")).map(|(_, path)| path).collect()
    }

    /// Takes from work that was read from it what it would lose with these files: its label maps are in no file.
    pub fn release(&self, opened: &mut Opened) {
        let own = self.label_maps();
        let is_own = |part: &PartOf| own.contains(&part.file);
        let sources = opened.sources.iter_mut();
        sources.filter(|source| source.within.as_ref().is_some_and(is_own)).for_each(|source| source.within = None);
    }

    /// Removes all its files.
    pub fn discard(self) {
        // The lock goes last: a file without a lock would be offered again.
        let _ = fs::remove_file(&self.file);
        self.label_maps().iter().for_each(|file| _ = fs::remove_file(file));
        let _ = fs::remove_file(&self.lock_file);
    }
}

impl Recovery {
    /// Keeps the work in `folder`, if there is one.
    pub fn new(folder: Option<PathBuf>) -> Self {
        Self { folder: folder.map(|folder| folder.join("unsaved")), ..Self::default() }
    }

    /// What earlier runs left behind, the newest first.
    pub fn left_behind(&self) -> Vec<Kept> {
        let entries = self.folder.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten();
        let (parts, files): (Vec<_>, Vec<_>) =
            entries.map(|entry| entry.path()).partition(|path| path.extension().is_some_and(|e| e == "part"));
        // What a run was killed in the middle of writing; a live one needs it for less than a second.
        let is_old =
            |path: &PathBuf| fs::metadata(path).and_then(|m| m.modified()).is_ok_and(|at| at.elapsed().is_ok_and(|age| age > STALE));
        parts.iter().filter(|path| is_old(path)).for_each(|path| drop(fs::remove_file(path)));
        let files = files.into_iter().filter(|path| path.extension().is_some_and(|e| e == "json"));
        let mut kept: Vec<Kept> = files.filter_map(Kept::named).collect();
        let age = |kept: &Kept| fs::metadata(&kept.file).and_then(|m| m.modified()).unwrap_or(UNIX_EPOCH);
        kept.sort_by_key(|kept| std::cmp::Reverse(age(kept)));
        kept
    }

    /// This run goes on with what `kept` holds.
    pub fn go_on_from(&mut self, kept: Kept) {
        self.from = Some(kept);
    }

    /// Writes the work where it changed; comes back by itself when it is too early for that. `records` are its rays. Nothing is kept of what
    /// `is_saved`.
    pub fn keep(
        &mut self,
        ctx: &Context,
        work: &Work,
        is_saved: bool,
        belongs_to: Option<&Path>,
        records: impl FnOnce() -> Vec<Measurement>,
    ) {
        if is_saved && self.from.is_none() {
            self.forget();
            return;
        }
        if let Some((written, at)) = &self.written {
            if written.same(work) {
                return;
            }
            if let Some(left) = PAUSE.checked_sub(at.elapsed()) {
                ctx.request_repaint_after(left);
                return;
            }
        }
        if self.write(work, belongs_to, records()).is_some() {
            self.written = Some((work.clone(), Instant::now()));
            self.from.take().into_iter().for_each(Kept::discard);
        }
    }

    fn write(&mut self, work: &Work, belongs_to: Option<&Path>, records: Vec<Measurement>) -> Option<()> {
        let folder = self.folder.as_ref()?;
        if self.own.is_none() {
            fs::create_dir_all(folder).ok()?;
            let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_millis();
            self.own = Kept::named(folder.join(format!("{}-{since}.json", std::process::id())));
        }
        let own = self.own.as_ref()?;
        own.lock.set_len(0).ok()?;
        (&own.lock).rewind().ok()?;
        (&own.lock).write_all(belongs_to.map_or(String::new(), |file| file.to_string_lossy().into_owned()).as_bytes()).ok()?;
        let mut work = work.clone();
        work.opened.write_labels(&own.file, &mut self.labels, &Progress::default()).ok()?;
        work.opened.name_labels(&self.labels);
        // No folder is above all scans: their files are named from the root on.
        session(&work, Path::new(""), records).write(&own.file).ok()
    }

    /// Removes what is kept: it is saved, or not wanted.
    pub fn forget(&mut self) {
        self.own.take().into_iter().chain(self.from.take()).for_each(Kept::discard);
        (self.written, self.labels) = (None, vec![]);
    }
}
