//! Files that are either whole or not there.

use std::ffi::OsString;
use std::io;
use std::path::Path;

/// Lets `write` make a file beside `path`, then moves it there: what was at `path` is replaced whole or not at all.
pub fn replace_file(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let name = path.file_name().ok_or_else(|| io::Error::other("it names no file"))?;
    let mut beside = OsString::from(".");
    beside.push(name);
    beside.push(format!(".{}.part", std::process::id()));
    let beside = path.with_file_name(beside);
    let written = write(&beside).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        // It may not exist; there is nothing more to do about it if it does.
        drop(std::fs::remove_file(&beside));
    }
    written
}
