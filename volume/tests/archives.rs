//! Scans inside of archives: the same samples on the same grid as without, nothing unpacked to disk, nothing held that does not fit.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod small;

use bregma_volume::formats::{Hints, OpenError, open, scan, series};
use bregma_volume::{Progress, ReadSamples, Volume};
use small::{Dicom, Folder, Small, dicom_files, enhanced, gzip, tar, zip};
use std::io::Write;
use std::path::Path;

fn try_open(path: &Path) -> Result<Volume, OpenError> {
    open(path, &Hints::default(), &Progress::default())
}

fn same(a: &Volume, b: &Volume) -> bool {
    let values = |v: &Volume| (0..v.samples().len()).map(|n| v.samples().get_f64(n)).collect::<Vec<_>>();
    values(a) == values(b) && a.grid() == b.grid() && a.format() == b.format()
}

/// It is an archive already.
fn is_packed(small: &Small) -> bool {
    [".zip", ".tgz", ".tar", ".dcm.gz"].iter().any(|end| small.files[0].0.ends_with(end))
}

/// What is sent beside a scan.
fn sent(small: &Small) -> Vec<(String, Vec<u8>)> {
    let own = small.files.iter().map(|(name, bytes)| (format!("media 1/{name}"), bytes.clone()));
    let others = ["manifest.csv", "__MACOSX/media 1/._x", "media 1/.DS_Store"].map(|name| (name.to_owned(), b"nothing".to_vec()));
    own.chain(others).collect()
}

#[test]
fn every_form_opens_inside_of_an_archive() {
    // Fails if a reader asks the disk for what is in an archive, for the header, the samples or a file beside.
    let folder = Folder::new("archives");
    // Chunks of Zarr are read where they lie on the disk.
    let is_tried = |small: &Small| !is_packed(small) && !small.name.contains("Zarr");
    for small in small::all().into_iter().chain(small::others()).filter(is_tried) {
        let plain = try_open(&small.write(&folder)).unwrap();
        let files = sent(&small);
        let zipped = zip(&files);
        let many = [
            ("a.zip", zipped.clone()),
            ("a.tar", tar(&files)),
            ("a.tar.gz", gzip(&tar(&files))),
            ("a.tgz", gzip(&tar(&files))),
            ("zip in a.zip", zip(&[("b/inner.zip".into(), zipped.clone()), ("readme.txt".into(), b"read me".to_vec())])),
            ("tgz in a.zip", zip(&[("readme.txt".into(), b"read me".to_vec()), ("b/inner.tar.gz".into(), gzip(&tar(&files)))])),
            ("three.tar", tar(&[("two.zip".into(), zip(&[("one.zip".into(), zipped)]))])),
        ];
        for (name, bytes) in many {
            let path = folder.put(name, &bytes);
            let opened = try_open(&path).unwrap_or_else(|e| panic!("{} in {name}: {e}", small.name));
            assert!(same(&opened, &plain), "{} in {name}", small.name);
            // Named by itself, too.
            if !small.open.is_empty() && name == "a.zip" {
                let opened =
                    try_open(&path.join("media 1").join(small.open)).unwrap_or_else(|e| panic!("{} named in {name}: {e}", small.name));
                assert!(same(&opened, &plain), "{} named in {name}", small.name);
            }
        }
    }
}

#[test]
fn one_file_may_be_gzipped() {
    let folder = Folder::new("gzipped");
    // Of a gzipped tar nobody knows that it is a project, and of samples that their name is their header.
    let others = ["InVesalius unpacked", "raw by its name"];
    for small in small::all().into_iter().filter(|s| s.files.len() == 1 && !is_packed(s) && !others.contains(&s.name)) {
        let plain = try_open(&small.write(&folder)).unwrap();
        let path = folder.put(&format!("{}.gz", small.open), &gzip(&small.files[0].1));
        let opened = try_open(&path).unwrap_or_else(|e| panic!("{}: {e}", small.name));
        assert!(same(&opened, &plain), "{}", small.name);
    }
    // A series of which each file is, by its folder and by one of them.
    let files: Vec<(String, Vec<u8>)> =
        dicom_files(Dicom::slice).into_iter().map(|(name, bytes)| (format!("g/{name}.dcm.gz"), gzip(&bytes))).collect();
    let paths: Vec<_> = files.iter().map(|(name, bytes)| folder.put(name, bytes)).collect();
    let plain = try_open(&Small { name: "p", files: dicom_files(Dicom::slice), open: "" }.write(&folder)).unwrap();
    assert!(same(&try_open(paths[0].parent().unwrap()).unwrap(), &plain));
    assert!(same(&try_open(&paths[2]).unwrap(), &plain));
    assert_eq!(series(&paths[2], &Progress::default()).unwrap(), []);
}

#[test]
fn gzipped_slices_in_an_archive_are_read() {
    // Fails if slices that were packed one by one and then sent in an archive are no DICOM, each by itself or all of them.
    let folder = Folder::new("gzipped-slices");
    let plain = try_open(&Small { name: "p", files: dicom_files(Dicom::slice), open: "" }.write(&folder)).unwrap();
    let files: Vec<(String, Vec<u8>)> = dicom_files(Dicom::slice).into_iter().map(|(n, b)| (format!("s/{n}.dcm.gz"), gzip(&b))).collect();
    // `zip` packs every second file and stores the others.
    for (name, bytes) in [("s.zip", zip(&files)), ("s.tar", tar(&files)), ("s.tgz", gzip(&tar(&files)))] {
        let path = folder.put(name, &bytes);
        for path in [path.clone(), path.join("s"), path.join("s/IM1.dcm.gz"), path.join("s/IM2.dcm.gz")] {
            let opened = try_open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert!(same(&opened, &plain), "{}", path.display());
        }
    }
    // Many frames in one file, which are asked for in any order, and an archive beside that is none.
    let frames = try_open(&folder.put("m.dcm", &enhanced().bytes())).unwrap();
    let files = [("m.dcm.gz".to_owned(), gzip(&enhanced().bytes())), ("b.tar.gz".into(), gzip(&tar(&[("readme.txt".into(), vec![1; 9])])))];
    let opened = try_open(&folder.put("m.zip", &zip(&files))).unwrap();
    assert!(same(&opened, &frames) && opened.warnings() == frames.warnings(), "{:?}", opened.warnings());
}

#[test]
fn series_in_an_archive_are_offered() {
    // Fails if an archive has no series to choose from, or one of them cannot be named.
    let folder = Folder::new("archived-series");
    let other =
        |k: usize| Dicom::slice(k).with((0x20, 0x0e), "UI", "1.2.4").with((0x20, 0x11), "IS", "9").with((0x28, 0x1052), "DS", "-1000");
    let named =
        |name: &str, files: Vec<(String, Vec<u8>)>| files.into_iter().map(move |(n, b)| (format!("{name}/{n}"), b)).collect::<Vec<_>>();
    let files = [named("a", dicom_files(Dicom::slice)), named("b", dicom_files(other))].concat();
    for (name, bytes) in [("s.zip", zip(&files)), ("s.tar.gz", gzip(&tar(&files)))] {
        let path = folder.put(name, &bytes);
        let keys: Vec<String> = series(&path, &Progress::default()).unwrap().into_iter().map(|s| s.key).collect();
        assert_eq!(keys, ["7", "9"], "{name}");
        let second = try_open(format!("{}#9", path.display()).as_ref()).unwrap();
        assert_eq!(second.intercept(), -1000.0);
        // A folder inside, and one file.
        assert_eq!(try_open(&path.join("b")).unwrap().intercept(), -1000.0);
        let one = try_open(&path.join("a").join("IM2")).unwrap();
        assert_eq!((one.intercept(), one.grid().dims()), (-1024.0, small::DIMS));
    }
}

#[test]
fn many_frames_in_a_packed_file_are_read() {
    let folder = Folder::new("archived-frames");
    let plain = try_open(&folder.put("m.dcm", &enhanced().bytes())).unwrap();
    for (name, bytes) in [("m.zip", zip(&[("m.dcm".into(), enhanced().bytes())])), ("m.dcm.gz", gzip(&enhanced().bytes()))] {
        assert!(same(&try_open(&folder.put(name, &bytes)).unwrap(), &plain), "{name}");
    }
}

#[test]
fn what_is_in_an_archive_is_said() {
    let folder = Folder::new("archived-said");
    let nrrd = small::all().swap_remove(0).files.swap_remove(0).1;
    let warnings = |path: &Path| try_open(path).unwrap().warnings().join("; ");
    assert!(
        warnings(&folder.put("one.zip", &zip(&[("d/a.nrrd".into(), nrrd.clone()), ("b.pdf".into(), vec![1])])))
            .contains("d/a.nrrd in it is read")
    );
    let two = folder.put("two.zip", &zip(&[("a.nrrd".into(), nrrd.clone()), ("b.nrrd".into(), nrrd.clone())]));
    let error = try_open(&two).unwrap_err().to_string();
    assert!(error.contains("2 scans, from a.nrrd to b.nrrd; name one, as ARCHIVE/a.nrrd"), "{error}");
    try_open(&two.join("b.nrrd")).unwrap();
    assert!(try_open(&two.join("c.nrrd")).unwrap_err().to_string().contains("no such file"));
    // What leads out of an archive does not lead to the disk.
    folder.put("samples.raw", &small::samples(false));
    let out = small::nrrd("encoding: raw\ndata file: ../samples.raw", &[]);
    assert!(try_open(&folder.put("out.zip", &zip(&[("a.nhdr".into(), out)]))).unwrap_err().to_string().contains("no such file"));
}

#[test]
fn no_archive_takes_more_than_it_can_hold() {
    // Fails if something is unpacked for its own word, or without end.
    let folder = Folder::new("bombs");
    let mut blank = flate2::write::GzEncoder::new(vec![], flate2::Compression::best());
    (0..64).for_each(|_| blank.write_all(&vec![0; 1 << 20]).unwrap());
    let blank = blank.finish().unwrap();
    // As long as free memory is, by its own word: the last four bytes.
    let mut large = gzip(&vec![1; 4096]);
    let at = large.len() - 4;
    large[at..].copy_from_slice(&u32::MAX.to_le_bytes());
    for (name, bytes) in [("blank.gz", blank), ("large.gz", large)] {
        assert!(try_open(&folder.put(name, &bytes)).is_err(), "{name}");
    }
    // Archives in archives, beyond what anyone sends.
    let deep = (0..9).fold(zip(&[("a.txt".into(), vec![1])]), |inner, _| zip(&[("b.zip".into(), inner)]));
    let error = try_open(&folder.put("deep.zip", &deep)).unwrap_err().to_string();
    assert!(error.contains("more than 4 deep"), "{error}");
}

#[test]
fn an_archive_that_changes_is_read_anew() {
    // Fails if what an archive held before is taken for what it holds now.
    let folder = Folder::new("changes");
    let zipped = |k: u8| zip(&[("a.nrrd".into(), small::nrrd("encoding: raw", &vec![k; 384])), ("more".into(), vec![1; k.into()])]);
    let path = folder.put("a.zip", &zipped(1));
    // Held, so that its archive is in use.
    let first = scan(&path, &Hints::default(), &Progress::default()).unwrap();
    folder.put("a.zip", &zipped(200));
    assert_eq!(try_open(&path).unwrap().samples().get_f64(0), f64::from(200 * 257));
    drop(first);
}
