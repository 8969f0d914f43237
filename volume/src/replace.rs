//! Files that are either whole or not there.

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Lets `write` make a file beside `path`, then moves it there: what was at `path` is replaced whole or not at all. A link is followed;
/// what is no regular file (a device, a pipe) is written to as it is.
pub fn replace_file(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if target.metadata().is_ok_and(|m| !m.is_file()) {
        return write(&target);
    }
    if target.file_name().is_none() {
        return Err(io::Error::other("it names no file"));
    }
    // A short name, as one made from a long file name could be too long for the disk.
    // Two threads may write into one folder.
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let n = COUNT.fetch_add(1, Ordering::Relaxed);
    let beside = target.with_file_name(format!(".bregma-{}-{n}.part", std::process::id()));
    let written = write(&beside).and_then(|()| std::fs::rename(&beside, &target));
    if written.is_err() {
        // It may not exist; there is nothing more to do about it if it does.
        drop(std::fs::remove_file(&beside));
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_that_write_into_one_folder_do_not_meet() {
        // Fails if what one writes beside its file is what another renames.
        let folder = std::env::temp_dir().join(format!("bregma-replace-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::thread::scope(|scope| {
            for n in 0..4 {
                let file = folder.join(format!("{n}"));
                scope.spawn(move || (0..100).for_each(|_| replace_file(&file, |to| std::fs::write(to, n.to_string())).unwrap()));
            }
        });
        assert!((0..4).all(|n| std::fs::read_to_string(folder.join(format!("{n}"))).unwrap() == n.to_string()));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
