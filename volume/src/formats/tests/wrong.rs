//! Files that are wrong: each is refused with a sentence that says why.

use super::*;

const RAW: &str = "endian: little\nencoding: raw";

#[test]
fn each_fault_has_its_sentence() {
    // Fails if a fault goes unnoticed, or is reported as another.
    let folder = Folder::new("faults");
    let open_path = |path: &Path| open(path, &Hints::default(), &Progress::default()).unwrap_err().to_string();
    assert!(open_path(&folder.0.join("nothing.nrrd")).contains("nothing.nrrd: there is no such file"));
    assert!(open_path(&folder.0).contains("it is a folder"));
    assert!(folder.error("e.nrrd", b"").contains("e.nrrd: it is empty"));
    assert!(folder.error("e.txt", b"hello").contains("none of the formats known here (NRRD, NIfTI, "));
    assert!(folder.error("e.nii", b"hello").contains("header is not complete"));
    assert!(folder.error("e.nrrd", b"NRRD0009\n").contains("NRRD0001 to NRRD0005"));

    let nrrd = |kind: &str, fields: &str| folder.error("f.nrrd", &nrrd_file(kind, fields, &[1; 12]));
    let cases = [
        ("uint8", "encoding: bzip2", "encoding \"bzip2\""),
        ("uint8", "encoding: ascii", "encoding \"ascii\""),
        ("uint8", "content: x", "no \"encoding\""),
        ("int16", "encoding: raw", "no \"endian\""),
        ("int16", RAW, "24 bytes of samples are needed, 12 are there"),
        ("block", RAW, "`block`"),
        ("char", RAW, "none of NRRD's sample types"),
        ("uint8", "encoding: raw\nencoding: raw", "twice"),
        ("uint8", "encoding: raw\nnonsense", "\"nonsense\": it is neither"),
        ("uint8", "encoding: raw\nspacings: 1 1", "it must be 3 numbers"),
        ("uint8", "encoding: raw\nspacings: 1 0 1", "spacing along axis 1 is 0 mm"),
        ("uint8", "encoding: raw\nspacings: 1 1 -2", "spacing along axis 2 is -2 mm"),
        ("uint8", "encoding: raw\nspace: moon", "\"moon\""),
        ("uint8", "encoding: raw\nspace: LPS\nspace directions: (1,0,0) (0,1,0)", "3 times `(x,y,z)`"),
        ("uint8", "encoding: raw\nspace: LPS\nspace directions: (1,0,0) (0,1,0) (1,1,0)", "three independent directions"),
        ("uint8", "encoding: raw\nspace: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,nan)", "three independent directions"),
        ("uint8", "encoding: raw\nspace: LPS\nspace directions: none (0,1,0) (0,0,1)", "three axes of space"),
        ("uint8", "encoding: raw\nbyte skip: -2", "byte skip"),
        ("uint8", "encoding: raw\nslope:=steep", "no number"),
        ("uint8", "encoding: raw\nslope:=0", "slope not zero"),
    ];
    for (kind, fields, want) in cases {
        let error = nrrd(kind, fields);
        assert!(error.contains(want) && error.contains("f.nrrd"), "{fields}: {error}");
    }
    for (sizes, kinds) in [("3 2 2 2", "list domain domain domain"), ("3 2 2 1", "vector domain domain domain")] {
        let colour = format!("NRRD0004\ntype: uchar\ndimension: 4\nsizes: {sizes}\nkinds: {kinds}\nencoding: raw\n\n");
        assert!(folder.error("c.nrrd", colour.as_bytes()).contains(kinds));
    }
    let unended = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n";
    assert!(folder.error("c.nrrd", unended).contains("names no data file"));

    for (datatype, want) in [(128, "RGB24"), (32, "complex"), (1536, "float128"), (7, "none of NIfTI's")] {
        assert!(folder.error("t.nii", &nifti_1(datatype, false, &[0; 400])).contains(want));
    }
    let broken = |at: usize, with: &[u8]| {
        let mut file = nifti_1(2, false, &[1; 12]);
        file[at..at + with.len()].copy_from_slice(with);
        folder.error("t.nii", &file)
    };
    assert!(broken(344, b"ni1\0").contains("put the .img beside it"));
    assert!(broken(40, &[2]).contains("three axes"));
    assert!(broken(40, &[4, 0, 2, 0, 3, 0, 2, 0, 5]).contains("three axes"));
    assert!(broken(42, &[0xff, 0xff]).contains("negative"));
    assert!(broken(42, &[0, 0]).contains("at least one"));
    assert!(broken(108, &f32::NAN.to_le_bytes()).contains("vox_offset"));
    assert!(broken(108, &8_f32.to_le_bytes()).contains("vox_offset"));
    assert!(folder.error("pair.img", &[0; 12]).contains("pair.hdr: there is no such file"));
}

#[test]
fn a_small_file_that_claims_terabytes_is_refused_at_once() {
    // Fails if memory is asked for before the file's own length is looked at.
    let folder = Folder::new("huge");
    let header = |sizes: &str, encoding: &str| format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: {sizes}\nencoding: {encoding}\n\n");
    let huge = "20000 20000 25000";
    assert!(folder.error("h.nrrd", header(huge, "raw").as_bytes()).contains("10000000000000 bytes of samples are needed, 0 are there"));
    let zipped = [header(huge, "gzip").into_bytes(), gzip(&[0; 100])].concat();
    assert!(folder.error("h.nrrd", &zipped).contains("compressed bytes can hold"));
    assert!(folder.error("h.nrrd", header("9999999999 9999999999 9999999999", "raw").as_bytes()).contains("any machine"));
    let mut nifti = nifti_1(2, false, &[0; 12]);
    nifti[42..48].copy_from_slice(&[0xff, 0x7f, 0xff, 0x7f, 0xff, 0x7f]);
    assert!(folder.error("h.nii", &nifti).contains("12 are there"));
    assert!(folder.error("h.nii.gz", &gzip(&nifti)).contains("compressed bytes can hold"));
    // A gigabyte that 1 MiB of gzip could hold but does not: memory grows with what arrives.
    let noise: Vec<u8> = (0..1 << 20).scan(1_u32, |s, _| Some(lcg(s) as u8)).collect();
    let zipped = [header("1000 1000 1000", "gzip").into_bytes(), gzip(&noise)].concat();
    assert!(folder.error("h.nrrd", &zipped).contains("1000000000 bytes of samples are needed, 1048576 are there"));
}

#[test]
fn damaged_gzip_is_told_apart_from_short_gzip() {
    // Fails if a checksum is not compared or a short stream is taken for a whole one.
    let folder = Folder::new("gzip");
    let whole = gzip(&nifti_1(2, false, &[3; 12]));
    assert!(folder.open("g.nii.gz", &whole).is_ok());
    let mut damaged = whole.clone();
    let at = damaged.len() - 8;
    damaged[at] ^= 1;
    assert!(folder.error("g.nii.gz", &damaged).contains("checksum"));
    let zipped = [nrrd_file("uchar", "encoding: gz", &[]), gzip(&[1; 11])].concat();
    assert!(folder.error("g.nrrd", &zipped).contains("12 bytes of samples are needed, 11 are there"));
    let zipped = [nrrd_file("uchar", "encoding: gz", &[]), gzip(&[1; 7]), gzip(&[1; 6])].concat();
    let two_members = folder.open("g.nrrd", &zipped).unwrap();
    assert!(two_members.warnings().iter().any(|w| w == part::MORE_BYTES));
}

#[test]
fn one_sample_and_samples_that_are_no_numbers_are_read() {
    // Fails if a degenerate but legal file is refused.
    let folder = Folder::new("odd");
    let one = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\n\x05";
    assert_eq!(folder.open("one.nrrd", one).unwrap().range(), [5.0, 5.0]);
    let mut data: Vec<u8> = (0..12).flat_map(|v| (v as f32).to_le_bytes()).collect();
    data[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let odd = folder.open("nan.nrrd", &nrrd_file("float", &format!("{RAW}\n{LPS}"), &data)).unwrap();
    assert_eq!(odd.range(), [1.0, 11.0]);
    assert!(odd.warnings()[0].starts_with("1 samples are NaN"));
    assert!(folder.error("nan.nrrd", &nrrd_file("float", RAW, &[0xff; 48])).contains("no sample is a finite number"));
}

#[test]
fn reading_stops_when_asked() {
    // Fails if a cancelled read goes on, or is reported as a fault of the file.
    let folder = Folder::new("cancel");
    let stopped = Progress::default();
    stopped.cancel();
    for (name, bytes) in [
        ("a.nrrd", nrrd_file("uchar", "encoding: raw", &[1; 12])),
        ("a.nii.gz", gzip(&nifti_1(2, false, &[1; 12]))),
        ("a_2x3x2_u8.raw", vec![1; 12]),
    ] {
        let error = open(&folder.file(name, &bytes), &Hints::default(), &stopped).unwrap_err();
        assert!(matches!(error.reason, ReadError::Cancelled(_)), "{error}");
    }
}

/// Numerical Recipes' linear congruential generator; its high bits.
fn lcg(state: &mut u32) -> u32 {
    *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    *state >> 8
}

#[test]
fn no_damage_makes_a_reader_panic() {
    // Fails if any byte of a header is trusted: an index, an overflow, an endless loop.
    let folder = Folder::new("damage");
    folder.file("s1", &[1; 6]);
    folder.file("s2", &[2; 6]);
    let space = format!("{LPS}\nspace origin: (1,2,3)\nspace units: \"mm\" \"mm\" \"mm\"\nbyte skip: 0\nslope:=2");
    let files = [
        ("a.nrrd", nrrd_file("uchar", &format!("encoding: raw\n{space}"), &[1; 12])),
        (
            "b.nrrd",
            nrrd_file("short", "endian: big\nencoding: gzip\nspacings: 1 2 3\naxis mins: 1 2 3\ncenters: cell cell cell", &gzip(&[1; 24])),
        ),
        ("c.nhdr", nrrd_file("uchar", "encoding: raw\ndata file: s%d 1 2 1 2", &[])),
        ("d.nhdr", nrrd_file("uchar", "encoding: raw\ndata file: LIST 2\ns1\ns2", &[])),
        ("e.nii", nifti_1(4, true, &[1; 24])),
        ("f.nii.gz", gzip(&nifti_1(64, false, &[1; 96]))),
    ];
    let mut state = 7;
    for (name, bytes) in files {
        assert!(folder.open(name, &bytes).is_ok(), "{name} is right before it is damaged");
        for n in 0..bytes.len() {
            let _ = folder.open(name, &bytes[..n]);
        }
        for _ in 0..2000 {
            let mut damaged = bytes.clone();
            for _ in 0..=lcg(&mut state) % 3 {
                let at = lcg(&mut state) as usize % damaged.len();
                damaged[at] = lcg(&mut state) as u8;
            }
            let _ = folder.open(name, &damaged);
        }
    }
}
