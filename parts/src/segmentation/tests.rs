use super::*;
use bregma_field::{Raster, Unit};
use std::path::PathBuf;

/// A scan of 6 × 5 × 4 samples, 2 mm apart, from (10, 20, 30) on.
fn scan() -> Volume {
    let grid = Grid::new([6, 5, 4], DVec3::splat(2.0), DVec3::new(10.0, 20.0, 30.0), DMat3::IDENTITY).unwrap();
    let samples = Samples::I16((0..120).collect());
    let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
    Volume::new("scan".into(), "test", raster).unwrap()
}

fn file(name: &str, header: &str, samples: &[u8]) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("bregma-segmentation-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    let mut bytes = format!("NRRD0004\ntype: uint8\nencoding: raw\nspace: left-posterior-superior\n{header}\n\n").into_bytes();
    bytes.extend(samples);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn opened(path: &Path) -> (Labels, Vec<String>) {
    read(path, &scan(), &Progress::default()).unwrap()
}

fn refused(path: &Path) -> String {
    read(path, &scan(), &Progress::default()).unwrap_err().to_string()
}

const SMALL: &str = "dimension: 3\nsizes: 2 2 1\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (14,22,34)";

#[test]
fn a_smaller_map_lies_at_the_samples_that_it_was_drawn_on() {
    // Fails if the origin of a cropped map is not taken, its axes are turned round, or a name, colour or tag is lost.
    let path = file(
        "small.seg.nrrd",
        &format!(
            "{SMALL}\nSegment0_Name:=Left: jaw\nSegment0_Color:=0.5 0.25 1\nSegment0_LabelValue:=3\nSegment0_Layer:=0\nSegment0_Tags:=A:b|\nSegment1_Name:=empty\nSegment1_LabelValue:=5"
        ),
        &[0, 3, 7, 3],
    );
    let (labels, warnings) = opened(&path);
    assert!(warnings.is_empty(), "{warnings:?}");
    let names: Vec<(u16, &str)> = labels.parts().iter().map(|part| (part.number, part.name.as_str())).collect();
    assert_eq!(names, [(3, "Left: jaw"), (5, "empty"), (7, "7")]);
    assert_eq!((labels.parts()[0].color, labels.parts()[0].fields["Tags"].as_str()), ([0.5, 0.25, 1.0], "A:b|"));
    assert_eq!([[3, 1, 2], [2, 2, 2], [3, 2, 2], [2, 1, 2]].map(|at| labels.number(at)), [3, 7, 3, 0]);
    let found: Vec<(u64, Option<f64>)> = labels.statistics(&scan()).iter().map(|s| (s.samples, s.mean)).collect();
    assert_eq!(found, [(2, Some(72.0)), (0, None), (1, Some(74.0))]);
    // And again, by what is written of it.
    let again = path.with_file_name("again.seg.nrrd");
    assert!(write(&again, &labels, &Progress::default()).unwrap().is_empty());
    let (read_again, warnings) = opened(&again);
    assert!(warnings.is_empty() && read_again.parts().len() == 3, "{warnings:?}");
    assert_eq!(read_again.parts()[0].color, labels.parts()[0].color);
    assert_eq!(read_again.parts()[0].fields["Tags"], "A:b|");
    assert!((0..120).all(|n| labels.number([n % 6, n / 6 % 5, n / 30]) == read_again.number([n % 6, n / 6 % 5, n / 30])));
}

#[test]
fn layers_are_all_read_wherever_their_axis_lies() {
    // Fails if a layer is taken for another, one that no segment names is left out, segments of one value in two layers become one, or samples that two
    // of them have are not told of.
    let rest = "space origin: (10,20,30)\nSegment0_LabelValue:=1\nSegment0_Layer:=1\nSegment0_Name:=b\nSegment1_LabelValue:=1\nSegment1_Layer:=0\nSegment1_Name:=a";
    let first =
        format!("dimension: 4\nsizes: 3 2 1 1\nkinds: list domain domain domain\nspace directions: none (2,0,0) (0,2,0) (0,0,2)\n{rest}");
    let last =
        format!("dimension: 4\nsizes: 2 1 1 3\nkinds: domain domain domain list\nspace directions: (2,0,0) (0,2,0) (0,0,2) none\n{rest}");
    for (name, header, samples) in [("first.seg.nrrd", first, [1, 1, 0, 0, 1, 4]), ("last.seg.nrrd", last, [1, 0, 1, 1, 0, 4])] {
        let (labels, warnings) = opened(&file(name, &header, &samples));
        let names: Vec<&str> = labels.parts().iter().map(|part| part.name.as_str()).collect();
        assert_eq!(names, ["b", "a", "4"], "{name}");
        assert_eq!([labels.number([0, 0, 0]), labels.number([1, 0, 0])], [1, 3], "{name}");
        assert!(
            warnings.len() == 1 && warnings[0].ends_with("2 samples belong to several segments; each is taken as the last one's"),
            "{warnings:?}"
        );
    }
}

#[test]
fn other_grids_take_the_nearest_label_and_say_so() {
    // Fails if a grid between the samples is taken without a word, samples beyond the scan vanish in silence, or a turned grid is not turned.
    let finer = file(
        "finer.nrrd",
        "dimension: 3\nsizes: 2 1 1\nspace directions: (1.5,0,0) (0,1.5,0) (0,0,1.5)\nspace origin: (10.4,20.1,30)",
        &[1, 2],
    );
    let (labels, warnings) = opened(&finer);
    assert_eq!([labels.number([0, 0, 0]), labels.number([1, 0, 0]), labels.number([2, 0, 0])], [1, 2, 0]);
    assert!(warnings.len() == 1 && warnings[0].contains("takes the label that is nearest"), "{warnings:?}");
    let out = file("out.nrrd", "dimension: 3\nsizes: 2 1 1\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (20,20,30)", &[1, 2]);
    let (labels, warnings) = opened(&out);
    // The part that lies outside is there, without a sample.
    assert_eq!((labels.number([5, 0, 0]), labels.parts().len()), (1, 2));
    assert!(warnings[0].ends_with("1 of its 2 labelled samples lie outside of the scan and are left out"), "{warnings:?}");
    let turned = file(
        "turned.nrrd",
        "dimension: 3\nsizes: 2 3 1\nspace directions: (0,2,0) (-2,0,0) (0,0,2)\nspace origin: (20,20,30)",
        &[1, 2, 0, 0, 0, 3],
    );
    let (labels, warnings) = opened(&turned);
    assert_eq!(([[5, 0, 0], [5, 1, 0], [3, 1, 0]].map(|at| labels.number(at)), warnings.len()), ([1, 2, 3], 0));
    let elsewhere =
        file("elsewhere.nrrd", "dimension: 3\nsizes: 2 1 1\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (90,20,30)", &[1, 2]);
    assert!(refused(&elsewhere).ends_with("it labels nothing within scan; name the label map of this scan"));
}

#[test]
fn whatever_is_wrong_is_a_sentence() {
    // Fails if any of these panics, or passes.
    let of = |name: &str, more: &str| refused(&file(name, &format!("{SMALL}\n{more}"), &[1; 4]));
    assert!(
        of("value.seg.nrrd", "Segment0_LabelValue:=0")
            .ends_with("its segment 0 has LabelValue \"0\", which must be a whole number from 1 to 65535; correct the header")
    );
    assert!(
        of("color.seg.nrrd", "Segment2_Color:=1 2")
            .ends_with("its segment 2 has Color \"1 2\", which must be three numbers from 0 to 1; correct the header")
    );
    assert!(
        of("layer.seg.nrrd", "Segment0_LabelValue:=1\nSegment0_Layer:=2")
            .contains("a segment of it is in layer 1, but it has 1, counted from 0")
    );
    let short = file("short.seg.nrrd", SMALL, &[1; 3]);
    assert!(refused(&short).contains("it ends too early: 4 bytes of samples are needed, 3 are there"));
    let (empty, warnings) = opened(&file("empty.seg.nrrd", SMALL, &[0; 4]));
    assert!(empty.parts().is_empty() && warnings.is_empty());
    let float = file("float.nrrd", "", &[]);
    let mut bytes =
        format!("NRRD0004\ntype: float\nendian: little\nencoding: raw\nspace: left-posterior-superior\n{SMALL}\n\n").into_bytes();
    bytes.extend([1.0_f32, 2.5, 0.0, 0.0].iter().flat_map(|v| v.to_le_bytes()));
    std::fs::write(&float, bytes).unwrap();
    assert!(refused(&float).contains("not all whole numbers from 0 to 65535"));
    let all =
        file("255.nrrd", "dimension: 3\nsizes: 6 5 4\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (10,20,30)", &[255; 120]);
    let (labels, _) = opened(&all);
    assert_eq!((labels.parts()[0].number, labels.volume().type_name(), labels.parts().len()), (255, "u8", 1));
}
