//! Real scans, read and compared with what SimpleITK 2.5 and numpy read from them. They are found through `BREGMA_DATA`.

use bregma_volume::formats::{Hints, open};
use bregma_volume::{Progress, Unit, Volume};
use glam::{DMat3, DVec3};
use std::path::PathBuf;

struct Expected {
    file: &'static str,
    dims: [usize; 3],
    spacing_mm: [f64; 3],
    origin_mm: [f64; 3],
    /// Signs of the axes in LPS: all these scans lie along them.
    signs: [f64; 3],
    samples: &'static str,
    unit: Unit,
    range: [f64; 2],
    sum: f64,
    values: &'static [([usize; 3], f64)],
    warnings: usize,
}

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("BREGMA_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: BREGMA_DATA is not set");
    }
    folder
}

fn sum(volume: &Volume) -> f64 {
    // Every partial sum is a whole number below 2⁵³, hence exact.
    (0..volume.samples().len()).map(|n| volume.samples().get_f64(n)).sum()
}

#[test]
fn scans_are_read_as_other_programs_read_them() {
    // Fails if any sample, size, spacing, origin or orientation of a scan is misread.
    let Some(data) = data() else { return };
    for e in EXPECTED {
        let v = open(&data.join(e.file), &Hints::default(), &Progress::default()).unwrap();
        let file = e.file;
        assert_eq!(v.grid().dims(), e.dims, "{file}");
        // ITK computes spacing and direction from float32 by a decomposition of its own: equal to about a float32 rounding.
        assert!(v.grid().spacing_mm().abs_diff_eq(e.spacing_mm.into(), 1e-7), "{file}: {:?}", v.grid());
        assert!(v.grid().origin_mm().abs_diff_eq(e.origin_mm.into(), 1e-7), "{file}: {:?}", v.grid());
        let direction = DMat3::from_diagonal(e.signs.into());
        assert!(v.grid().direction().abs_diff_eq(direction, 1e-7), "{file}: {:?}", v.grid());
        assert_eq!((v.samples().type_name(), v.unit(), v.range()), (e.samples, e.unit, e.range), "{file}");
        assert_eq!(v.warnings().len(), e.warnings, "{file}: {:?}", v.warnings());
        assert_eq!(sum(&v), e.sum, "{file}");
        for &([i, j, k], value) in e.values {
            assert_eq!(v.samples().get_f64((k * e.dims[1] + j) * e.dims[0] + i), value, "{file} at {i}, {j}, {k}");
        }
    }
}

#[test]
fn a_stated_spacing_replaces_one_without_unit() {
    // Fails if --spacing is ignored for the CThead, or changes a scan that states millimetres.
    let Some(data) = data() else { return };
    let hints = Hints { spacing_mm: Some(DVec3::new(0.9, 0.9, 1.8)), ..Hints::default() };
    let spacing = |file| open(&data.join(file), &hints, &Progress::default()).unwrap().grid().spacing_mm();
    assert_eq!(spacing("cthead-unc/CThead.nhdr"), DVec3::new(0.9, 0.9, 1.8));
    assert_eq!(spacing("classic/engine_256x256x110_uint8.raw"), DVec3::new(0.9, 0.9, 1.8));
    assert_eq!(spacing("cranium-invesalius/Cranium.nhdr"), DVec3::new(0.9570312, 0.9570312, 1.5));
}

#[test]
fn a_header_and_a_raw_layout_agree() {
    // Fails if --raw and the NRRD header of the same samples read them differently.
    let Some(data) = data() else { return };
    let hints = Hints { raw: Some("256x256x108,i16".parse().unwrap()), ..Hints::default() };
    let raw = open(&data.join("cranium-invesalius/matrix.dat"), &hints, &Progress::default()).unwrap();
    let nrrd = open(&data.join("cranium-invesalius/Cranium.nhdr"), &Hints::default(), &Progress::default()).unwrap();
    assert_eq!(raw.samples(), nrrd.samples());
}

const EXPECTED: &[Expected] = &[
    Expected {
        file: "classic/bonsai.nii.gz",
        dims: [256, 256, 256],
        spacing_mm: [1.0, 1.0, 1.0],
        origin_mm: [127.0, 127.0, -128.0],
        signs: [-1.0, -1.0, 1.0],
        samples: "u8",
        unit: Unit::Value,
        range: [0.0, 255.0],
        sum: 225901147.0,
        values: &[
            ([204, 123, 48], 3.0),
            ([139, 124, 54], 165.0),
            ([159, 79, 126], 20.0),
            ([166, 96, 201], 54.0),
            ([222, 41, 2], 35.0),
            ([85, 128, 255], 0.0),
        ],
        warnings: 0,
    },
    Expected {
        file: "classic/engine_256x256x110_uint8.raw",
        dims: [256, 256, 110],
        spacing_mm: [1.0, 1.0, 1.0],
        origin_mm: [0.0, 0.0, 0.0],
        signs: [1.0, 1.0, 1.0],
        samples: "u8",
        unit: Unit::Value,
        range: [0.0, 255.0],
        sum: 187475047.0,
        values: &[
            ([169, 156, 47], 141.0),
            ([153, 114, 52], 150.0),
            ([100, 164, 80], 11.0),
            ([70, 130, 104], 8.0),
            ([123, 188, 2], 150.0),
            ([85, 128, 109], 0.0),
        ],
        warnings: 2,
    },
    Expected {
        file: "classic/headsq/quarter.nhdr",
        dims: [64, 64, 93],
        spacing_mm: [3.2, 3.2, 1.5],
        origin_mm: [0.0, 0.0, 0.0],
        signs: [1.0, 1.0, 1.0],
        samples: "i16",
        unit: Unit::Value,
        range: [0.0, 3926.0],
        sum: 193392317.0,
        values: &[
            ([14, 24, 33], 1097.0),
            ([41, 47, 36], 1086.0),
            ([36, 27, 62], 1092.0),
            ([37, 40, 86], 1068.0),
            ([35, 9, 2], 2261.0),
            ([21, 32, 92], 405.0),
        ],
        warnings: 2,
    },
    Expected {
        file: "cranium-invesalius/Cranium.nhdr",
        dims: [256, 256, 108],
        spacing_mm: [0.9570312, 0.9570312, 1.5],
        origin_mm: [0.0, 0.0, 0.0],
        signs: [1.0, 1.0, 1.0],
        samples: "i16",
        unit: Unit::Hounsfield,
        range: [-1024.0, 2986.0],
        sum: -4147325847.0,
        values: &[
            ([74, 99, 46], 25.0),
            ([170, 140, 49], 2.0),
            ([106, 200, 69], -5.0),
            ([139, 56, 91], 742.0),
            ([94, 184, 3], 13.0),
            ([85, 128, 107], -997.0),
        ],
        warnings: 0,
    },
    Expected {
        file: "cthead-unc/CThead.nhdr",
        dims: [256, 256, 113],
        spacing_mm: [1.0, 1.0, 2.0],
        origin_mm: [0.0, 0.0, 0.0],
        signs: [1.0, 1.0, 1.0],
        samples: "u16",
        unit: Unit::Value,
        range: [0.0, 3272.0],
        sum: 2810724494.0,
        values: &[
            ([17, 151, 51], 904.0),
            ([119, 170, 54], 1081.0),
            ([134, 96, 76], 1024.0),
            ([93, 183, 102], 1118.0),
            ([102, 200, 10], 1277.0),
            ([85, 128, 112], 1095.0),
        ],
        warnings: 2,
    },
    Expected {
        file: "mouse/35_mic_23strain_mus_template_UCHAR-label.nii.gz",
        dims: [520, 824, 456],
        spacing_mm: [0.03527835011482239, 0.03527835011482239, 0.03527835011482239],
        origin_mm: [0.0, 0.0, 0.0],
        signs: [-1.0, -1.0, 1.0],
        samples: "i16",
        unit: Unit::Value,
        range: [0.0, 21.0],
        sum: 176450534.0,
        values: &[
            ([406, 269, 215], 1.0),
            ([130, 262, 222], 15.0),
            ([391, 302, 268], 1.0),
            ([295, 406, 316], 15.0),
            ([293, 506, 83], 2.0),
            ([173, 412, 455], 0.0),
        ],
        warnings: 0,
    },
    Expected {
        file: "mouse/C57BL6_J_.nii.gz",
        dims: [170, 170, 147],
        spacing_mm: [0.14111340045928955, 0.14111340045928955, 0.14087341725826263],
        origin_mm: [0.05291752517223358, 0.05291752517223358, 0.052797529846429825],
        signs: [1.0, 1.0, 1.0],
        samples: "u8",
        unit: Unit::Value,
        range: [0.0, 255.0],
        sum: 17378915.0,
        values: &[
            ([120, 93, 43], 7.0),
            ([33, 55, 47], 6.0),
            ([46, 56, 73], 8.0),
            ([78, 97, 106], 109.0),
            ([110, 69, 3], 7.0),
            ([56, 85, 146], 0.0),
        ],
        warnings: 0,
    },
    Expected {
        file: "mouse/C57BL_6NJ_.nii.gz",
        dims: [170, 170, 143],
        spacing_mm: [0.14111340045928955, 0.14111340045928955, 0.14111340045928955],
        origin_mm: [0.05291752517223358, 0.05291752517223358, 0.05291752517223358],
        signs: [1.0, 1.0, 1.0],
        samples: "u8",
        unit: Unit::Value,
        range: [0.0, 254.0],
        sum: 17542926.0,
        values: &[
            ([104, 88, 41], 1.0),
            ([159, 83, 45], 7.0),
            ([54, 156, 71], 1.0),
            ([31, 63, 104], 5.0),
            ([38, 111, 2], 18.0),
            ([56, 85, 142], 0.0),
        ],
        warnings: 0,
    },
    Expected {
        file: "mouse/DBA_2J_.nii.gz",
        dims: [163, 163, 143],
        spacing_mm: [0.14111340045928955, 0.14111340045928955, 0.14111340045928955],
        origin_mm: [0.05291752517223358, 0.05291752517223358, 0.05291752517223358],
        signs: [1.0, 1.0, 1.0],
        samples: "u8",
        unit: Unit::Value,
        range: [0.0, 255.0],
        sum: 15011776.0,
        values: &[
            ([27, 109, 47], 6.0),
            ([53, 121, 51], 10.0),
            ([51, 107, 78], 9.0),
            ([88, 77, 110], 77.0),
            ([33, 81, 3], 8.0),
            ([54, 81, 142], 0.0),
        ],
        warnings: 0,
    },
    Expected {
        file: "mouse/low_res_template_UCHAR-label.nii.gz",
        dims: [130, 206, 114],
        spacing_mm: [0.14111340045928955, 0.14111340045928955, 0.14111340045928955],
        origin_mm: [-0.05291752517223358, -0.05291752517223358, 0.05291752517223358],
        signs: [-1.0, -1.0, 1.0],
        samples: "u8",
        unit: Unit::Value,
        range: [0.0, 21.0],
        sum: 2757058.0,
        values: &[
            ([60, 87, 53], 15.0),
            ([81, 65, 55], 15.0),
            ([57, 165, 66], 1.0),
            ([78, 55, 79], 1.0),
            ([76, 128, 20], 2.0),
            ([43, 103, 113], 0.0),
        ],
        warnings: 0,
    },
    Expected {
        file: "mouse/low_res_template_UCHAR.nii.gz",
        dims: [130, 206, 114],
        spacing_mm: [0.14111340045928955, 0.14111340045928955, 0.14111340045928955],
        origin_mm: [-0.05291752517223358, -0.05291752517223358, 0.05291752517223358],
        signs: [-1.0, -1.0, 1.0],
        samples: "u8",
        unit: Unit::Value,
        range: [0.0, 87.0],
        sum: 3396279.0,
        values: &[
            ([29, 40, 47], 1.0),
            ([78, 94, 49], 6.0),
            ([47, 39, 66], 5.0),
            ([70, 70, 81], 5.0),
            ([84, 121, 13], 3.0),
            ([43, 103, 113], 0.0),
        ],
        warnings: 0,
    },
];
