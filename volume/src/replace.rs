//! Files that are either whole or not there.

use std::io;
use std::path::Path;

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
    let beside = target.with_file_name(format!(".bregma-{}.part", std::process::id()));
    let written = write(&beside).and_then(|()| std::fs::rename(&beside, &target));
    if written.is_err() {
        // It may not exist; there is nothing more to do about it if it does.
        drop(std::fs::remove_file(&beside));
    }
    written
}
