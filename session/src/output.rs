//! Files that are either whole or not there: everything is written beside its place and then moved into it.

use bregma_field::replace_file;
use bregma_renderer::Picture;
use std::fs::File;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file that could not be written; what was there before is untouched.
#[derive(Debug, Error)]
#[error("{}: cannot be written ({reason}); check the folder, its permissions and the space on the disk", file.display())]
pub struct OutputError {
    file: PathBuf,
    reason: io::Error,
}

/// A folder that could not be made.
#[derive(Debug, Error)]
#[error("{}: cannot be made ({reason}); choose another folder", folder.display())]
pub struct FolderError {
    folder: PathBuf,
    reason: io::Error,
}

/// Makes a folder for outputs, and those that it lies in, if they are not there.
pub fn make_folder(folder: &Path) -> Result<(), FolderError> {
    std::fs::create_dir_all(folder).map_err(|reason| FolderError { folder: folder.to_owned(), reason })
}

/// Writes `bytes` to `file`.
pub fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_by(file, |beside| std::fs::write(beside, bytes))
}

/// Lets `write` make a file beside `file`, and puts it there when it is whole.
pub fn write_by(file: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> Result<(), OutputError> {
    replace_file(file, write).map_err(|reason| OutputError { file: file.to_owned(), reason })
}

/// A figure that was written as PNG: RGB, 8 bits.
pub fn read_figure(file: &Path) -> Result<(Vec<u8>, u32, u32), png::DecodingError> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(file)?)).read_info()?;
    let mut rgb = vec![0; reader.output_buffer_size().unwrap_or_default()];
    let info = reader.next_frame(&mut rgb)?;
    let is_figure = (info.color_type, info.bit_depth) == (png::ColorType::Rgb, png::BitDepth::Eight);
    if is_figure { Ok((rgb, info.width, info.height)) } else { Err(io::Error::other("it is no figure of this program").into()) }
}

/// Writes a [height, width] array as NPY 1.0; `kind` is NumPy's type, such as `<f4` or `|u1`, and `bytes` are its rows.
pub fn write_npy(file: &Path, kind: &str, width: u32, height: u32, bytes: &[u8]) -> Result<(), OutputError> {
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({height}, {width}), }}");
    // Magic, version and length take 10 bytes; the array starts at a multiple of 64, after a line feed.
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
    header.push_str(&" ".repeat(padded - header.len() - 1));
    header.push('\n');
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend((padded as u16).to_le_bytes());
    npy.extend(header.as_bytes());
    npy.extend(bytes);
    write_whole(file, &npy)
}

/// Writes the depths of a picture: float32, NaN where nothing is hit.
pub fn write_depth(file: &Path, picture: &Picture) -> Result<(), OutputError> {
    let bytes: Vec<u8> = picture.depth_mm.iter().flat_map(|d| d.to_le_bytes()).collect();
    write_npy(file, "<f4", picture.width, picture.height, &bytes)
}

/// Writes what a projection computed: float32, NaN where a ray meets no volume.
pub fn write_values(file: &Path, picture: &Picture) -> Result<(), OutputError> {
    let bytes: Vec<u8> = picture.values.iter().flat_map(|v| v.to_le_bytes()).collect();
    write_npy(file, "<f4", picture.width, picture.height, &bytes)
}

/// Writes the volume numbers of a picture: uint8, 0 where nothing is hit.
pub fn write_volume_id(file: &Path, picture: &Picture) -> Result<(), OutputError> {
    write_npy(file, "|u1", picture.width, picture.height, &picture.volume_id)
}
