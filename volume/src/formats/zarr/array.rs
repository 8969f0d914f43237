//! One array of a store: the only file that knows `zarrs`.

use super::super::ReadError;
use super::super::decode::SampleType;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::borrow::Cow;
use std::fmt::Display;
use std::io;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use zarrs::array::data_type::{
    Float16DataType, Float32DataType, Float64DataType, Int8DataType, Int16DataType, Int32DataType, Int64DataType, UInt8DataType,
    UInt16DataType, UInt32DataType, UInt64DataType,
};
use zarrs::array::{ArrayBytes, ArrayMetadata, ArrayShardedExt, ArraySubset, CodecOptions};
use zarrs::filesystem::FilesystemStore;

/// Chunks of so many bytes may be larger than their array.
const MOST_CHUNK: u64 = 1 << 28;

/// How many times more than is asked for a slab of chunks may take.
const MOST_TIMES: u64 = 8;

/// An array in a folder of its own, and whether all of its chunks are to be there.
pub struct Array(zarrs::array::Array<FilesystemStore>, bool);

/// What `zarrs` says is wrong; with a stranger's file that may also be a panic of a decoder.
fn guarded<T, E: Display>(work: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(done) => done.map_err(|e| e.to_string()),
        Err(_) => Err("a chunk of it cannot be decoded".to_owned()),
    }
}

fn damaged(what: String) -> ReadError {
    ReadError::Damaged(format!("as Zarr, {what}"))
}

impl Array {
    /// The array whose folder this is. Where it `is_whole`, each of its chunks has to be there; else those that are not are its fill value.
    pub fn open(folder: &Path, is_whole: bool) -> Result<Self, ReadError> {
        let store = Arc::new(guarded(|| FilesystemStore::new(folder)).map_err(damaged)?);
        let opened = guarded(|| zarrs::array::Array::open(store, "/"));
        let refused = |what: String| ReadError::Unsupported(format!("its array {} cannot be opened: {what}", folder.display()));
        let array = Self(opened.map_err(refused)?, is_whole);
        let metadata = serde_json::to_value(array.0.metadata()).unwrap_or_default();
        // Of version 2 all are even.
        if metadata.get("chunk_grid").is_some_and(|grid| grid.get("name").and_then(Value::as_str) != Some("regular")) {
            return Err(refused("its chunks are not of one size".to_owned()));
        }
        // A chunk is unpacked as a whole: a header must not ask for memory that the array itself would not.
        let inner = array.0.effective_subchunk_shape().map(|shape| shape.iter().map(|n| n.get()).collect()).or_else(|| array.outer());
        let bytes = |shape: &[u64]| shape.iter().fold(array.0.data_type().fixed_size().unwrap_or(1) as u64, |n, of| n.saturating_mul(*of));
        if inner.is_none_or(|inner| bytes(&inner) > bytes(array.shape()).saturating_mul(2).max(MOST_CHUNK)) {
            return Err(refused("its chunks are far larger than it".to_owned()));
        }
        Ok(array)
    }

    /// Numbers along each axis, the fastest last.
    pub fn shape(&self) -> &[u64] {
        self.0.shape()
    }

    /// What its axes are called, where it says.
    pub fn names(&self) -> Vec<Option<String>> {
        match self.0.dimension_names() {
            Some(names) => names.clone(),
            None => vec![None; self.0.dimensionality()],
        }
    }

    /// The type of its numbers, in this machine's byte order once they are read.
    pub fn sample_type(&self) -> Result<SampleType, ReadError> {
        let kind = self.0.data_type();
        let kinds = [
            (kind.is::<Int8DataType>(), SampleType::I8),
            (kind.is::<UInt8DataType>(), SampleType::U8),
            (kind.is::<Int16DataType>(), SampleType::I16),
            (kind.is::<UInt16DataType>(), SampleType::U16),
            (kind.is::<Int32DataType>(), SampleType::I32),
            (kind.is::<UInt32DataType>(), SampleType::U32),
            (kind.is::<Int64DataType>(), SampleType::I64),
            (kind.is::<UInt64DataType>(), SampleType::U64),
            (kind.is::<Float16DataType>(), SampleType::F16),
            (kind.is::<Float32DataType>(), SampleType::F32),
            (kind.is::<Float64DataType>(), SampleType::F64),
        ];
        let known = kinds.into_iter().find(|(is, _)| *is).map(|(_, known)| known);
        known.ok_or_else(|| ReadError::Unsupported(format!("its numbers are {kind}; integers and floats of 8 to 64 bits can be read")))
    }

    /// How many slices along an axis are decoded together: those of a chunk, which may be a shard of many, where a box of so many is not larger
    /// than `most` bytes, and those of one within a shard else; `slice_bytes` is what one slice takes. Fewer than a chunk has are taken only where that
    /// would be many times too much: each part of a chunk is decoded by itself, and its checksum is not compared.
    pub fn depth(&self, axis: usize, slice_bytes: u64, most: u64) -> u64 {
        let outer = self.outer().and_then(|shape| shape.get(axis).copied()).unwrap_or(1);
        let inner = self.0.effective_subchunk_shape().and_then(|shape| shape.get(axis).map(|n| n.get()));
        let fits = (most / slice_bytes.max(1)).max(1);
        let inner = inner.unwrap_or(outer);
        match () {
            () if outer <= fits => outer,
            () if inner <= MOST_TIMES * fits => inner,
            () => fits,
        }
    }

    fn outer(&self) -> Option<Vec<u64>> {
        let shape = self.0.chunk_shape(&vec![0; self.0.dimensionality()]).ok()?;
        Some(shape.iter().map(|n| n.get()).collect())
    }

    /// The numbers in a box, as bytes; those of chunks that are not there are the array's fill value.
    ///
    /// Chunks are decoded as a whole where the box has all of their slices: `zarrs` compares a checksum only then.
    pub fn slab(&self, ranges: &[Range<u64>]) -> Result<Vec<u8>, ReadError> {
        let (Some(outer), Some(size)) = (self.outer(), self.0.data_type().fixed_size()) else {
            return Err(damaged("its chunks have no even size".to_owned()));
        };
        let shape: Vec<usize> = ranges.iter().map(|r| (r.end - r.start) as usize).collect();
        let count = shape.iter().try_fold(size, |n, of| n.checked_mul(*of)).ok_or_else(|| damaged("it is too large".to_owned()))?;
        let mut all = Vec::new();
        all.try_reserve_exact(count)?;
        all.resize(count, 0);
        let chunks: Vec<Range<u64>> = ranges.iter().zip(&outer).map(|(r, n)| r.start / n..r.end.div_ceil(*n)).collect();
        let counts: Vec<u64> = chunks.iter().map(|c| c.end - c.start).collect();
        let read = |mut n: u64| -> Result<(Vec<Range<u64>>, Vec<u8>), ReadError> {
            let mut at = vec![0; counts.len()];
            for axis in (0..counts.len()).rev() {
                at[axis] = chunks[axis].start + n % counts[axis];
                n /= counts[axis];
            }
            let whole: Vec<Range<u64>> = at.iter().zip(&outer).map(|(c, n)| c * n..(c + 1).saturating_mul(*n)).collect();
            // Beyond the array's end a chunk has numbers that are none of it.
            let there: Vec<Range<u64>> = whole.iter().zip(self.shape()).map(|(w, n)| w.start..w.end.min(*n)).collect();
            let is_all = there.iter().zip(ranges).all(|(t, r)| t.start >= r.start && t.end <= r.end);
            if is_all && bytes_of(&whole, size) <= bytes_of(ranges, size).saturating_mul(2).max(MOST_CHUNK) {
                return Ok((whole, self.chunk(&at)?));
            }
            let part: Vec<Range<u64>> = there.iter().zip(ranges).map(|(t, r)| t.start.max(r.start)..t.end.min(r.end)).collect();
            let subset = ArraySubset::new_with_ranges(&part);
            Ok((part, self.decoded(|| self.0.retrieve_array_subset::<ArrayBytes<'_>>(&subset))?))
        };
        let every: Vec<u64> = (0..counts.iter().product()).collect();
        // So many at a time that all cores have work and few lie in memory.
        for some in every.chunks(rayon::current_num_threads()) {
            for chunk in some.par_iter().map(|n| read(*n)).collect::<Result<Vec<_>, _>>()? {
                if bytes_of(&chunk.0, size) != chunk.1.len() as u64 {
                    return Err(damaged("a chunk has another size than it says".to_owned()));
                }
                copy(&chunk.0, &chunk.1, ranges, &mut all, size);
            }
        }
        Ok(all)
    }

    /// All numbers of a chunk.
    fn chunk(&self, at: &[u64]) -> Result<Vec<u8>, ReadError> {
        if !self.1 {
            return self.decoded(|| self.0.retrieve_chunk::<ArrayBytes<'_>>(at));
        }
        let missing = || format!("its file {} is missing", self.0.chunk_key(at));
        self.decoded(|| {
            let found = self.0.retrieve_chunk_if_exists::<ArrayBytes<'_>>(at).map_err(|e| e.to_string())?;
            found.ok_or_else(missing)
        })
    }

    fn decoded<'a, E: Display>(&self, retrieve: impl FnOnce() -> Result<ArrayBytes<'a>, E>) -> Result<Vec<u8>, ReadError> {
        let bytes = guarded(|| retrieve().map_err(|e| e.to_string()).and_then(|b| b.into_fixed().map_err(|e| e.to_string())));
        bytes.map(Cow::into_owned).map_err(damaged)
    }

    /// A new array: zstd in blosc, the bytes or, of numbers with few bits, the bits of a chunk's numbers put side by side first.
    ///
    /// `shape` and the sizes of `shard` and `chunk` are those of z, y, x, with others before them.
    pub fn create(folder: &Path, about: &New<'_>) -> io::Result<Self> {
        let New { shape, shard, chunk, kind, names, few_bits } = *about;
        let bytes = kind.bytes();
        let little = json!({"name": "bytes", "configuration": {"endian": "little"}});
        let packed = json!({"name": "blosc", "configuration": {
            "cname": "zstd", "clevel": 1, "blocksize": 0, "typesize": bytes, "shuffle": if few_bits { "bitshuffle" } else { "shuffle" },
        }});
        let index = json!([little, {"name": "crc32c"}]);
        let codecs = json!([{"name": "sharding_indexed", "configuration": {
            "chunk_shape": chunk, "codecs": [little, packed, {"name": "crc32c"}], "index_codecs": index, "index_location": "end",
        }}]);
        let metadata = json!({
            "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": name_of(kind), "fill_value": 0,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": shard}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
            "codecs": codecs, "dimension_names": names,
        });
        Self::of(folder, metadata)
    }

    fn of(folder: &Path, metadata: Value) -> io::Result<Self> {
        let make = || {
            let metadata: ArrayMetadata = serde_json::from_value(metadata).map_err(|e| e.to_string())?;
            let store = FilesystemStore::new(folder).map_err(|e| e.to_string())?;
            let array = zarrs::array::Array::new_with_metadata(Arc::new(store), "/", metadata).map_err(|e| e.to_string())?;
            array.store_metadata().map_err(|e| e.to_string())?;
            Ok::<_, String>(Self(array, true))
        };
        guarded(make).map_err(io::Error::other)
    }

    /// Writes one shard, all numbers of it, in this machine's byte order.
    pub fn write(&self, shard: &[u64], numbers: &[u8]) -> io::Result<()> {
        // What is left out could not be told from what was lost.
        let options = CodecOptions::default().with_store_empty_chunks(true);
        guarded(|| self.0.store_chunk_opt(shard, ArrayBytes::new_flen(numbers), &options)).map_err(io::Error::other)
    }
}

fn bytes_of(ranges: &[Range<u64>], size: usize) -> u64 {
    ranges.iter().fold(size as u64, |n, r| n.saturating_mul(r.end.saturating_sub(r.start)))
}

/// Copies the numbers of a box that another has, too: `size` bytes each, the last axis fastest.
fn copy(from: &[Range<u64>], bytes: &[u8], to: &[Range<u64>], all: &mut [u8], size: usize) {
    let both: Vec<Range<u64>> = from.iter().zip(to).map(|(a, b)| a.start.max(b.start)..a.end.min(b.end)).collect();
    let Some((last, before)) = both.split_last() else { return };
    let rows: u64 = before.iter().map(|r| r.end.saturating_sub(r.start)).product();
    let run = last.end.saturating_sub(last.start) as usize * size;
    for row in 0..rows {
        let (mut n, mut at) = (row, vec![last.start; both.len()]);
        for axis in (0..before.len()).rev() {
            let count = before[axis].end - before[axis].start;
            at[axis] = before[axis].start + n % count;
            n /= count;
        }
        let number = |of: &[Range<u64>]| at.iter().zip(of).fold(0, |n, (at, r)| n * (r.end - r.start) + (at - r.start)) as usize * size;
        all[number(to)..][..run].copy_from_slice(&bytes[number(from)..][..run]);
    }
}

/// What a new array is to be.
#[derive(Clone, Copy)]
pub struct New<'a> {
    /// Numbers along each axis.
    pub shape: &'a [u64],
    /// Of a shard, which is a file.
    pub shard: &'a [u64],
    /// Of a chunk in it.
    pub chunk: &'a [u64],
    /// The type of a number.
    pub kind: SampleType,
    /// What the axes are called.
    pub names: &'a [&'a str],
    /// Its numbers are rounded, so that many of their bits are alike.
    pub few_bits: bool,
}

/// What Zarr calls a type.
fn name_of(kind: SampleType) -> &'static str {
    match kind {
        SampleType::I8 => "int8",
        SampleType::U8 => "uint8",
        SampleType::I16 => "int16",
        SampleType::U16 => "uint16",
        SampleType::I32 => "int32",
        SampleType::U32 => "uint32",
        SampleType::I64 => "int64",
        SampleType::U64 => "uint64",
        SampleType::F16 => "float16",
        SampleType::F32 => "float32",
        SampleType::F64 => "float64",
    }
}
