//! Real scans, read and compared with what SimpleITK 2.5 and numpy read from them. They are found through `BREGMA_DATA`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_volume::formats::{Hints, open, scan};
use bregma_volume::{IndexPoint, Progress, ReadSamples, Unit, Volume, WorldPoint};
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
fn a_given_spacing_takes_the_place_of_another_aloud() {
    // Fails if --spacing is ignored, or takes the place of stated millimetres without a word.
    let Some(data) = data() else { return };
    let mm = DVec3::new(0.9, 0.9, 1.8);
    let hints = Hints { spacing_mm: Some(mm), ..Hints::default() };
    for file in
        ["cthead-unc/CThead.nhdr", "classic/engine_256x256x110_uint8.raw", "cranium-invesalius/Cranium.nhdr", "phantom-philips/tilted"]
    {
        let volume = open(&data.join(file), &hints, &Progress::default()).unwrap();
        assert!((volume.grid().spacing_mm() - mm).length() < 1e-12, "{file}: {:?}", volume.grid());
        let is_told = volume.warnings().iter().any(|warning| warning.contains("0.9 × 0.9 × 1.8 mm is taken instead"));
        assert_eq!(is_told, !file.contains("engine"), "{file}: {:?}", volume.warnings());
    }
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

#[test]
fn what_streams_by_is_what_is_read() {
    // Fails if info and an opened scan disagree about any real scan.
    let Some(data) = data() else { return };
    let files = EXPECTED.iter().map(|e| e.file).chain(["phantom-philips/straight", "phantom-philips/tilted"]);
    for file in files {
        let path = data.join(file);
        let v = open(&path, &Hints::default(), &Progress::default()).unwrap();
        let survey = scan(&path, &Hints::default(), &Progress::default()).unwrap().survey(&Progress::default()).unwrap();
        assert_eq!((survey.type_name, &survey.warnings[..]), (v.samples().type_name(), v.warnings()), "{file}");
        assert_eq!(&survey.summary.histogram, v.histogram(), "{file}");
        assert_eq!((survey.summary.unit, survey.summary.otsu()), (v.unit(), v.otsu()), "{file}");
    }
}

/// The phantom's two series.
fn phantoms() -> Option<[Volume; 2]> {
    let data = data()?;
    Some(["straight", "tilted"].map(|s| open(&data.join("phantom-philips").join(s), &Hints::default(), &Progress::default()).unwrap()))
}

#[test]
fn dicom_series_are_read_as_other_programs_read_them() {
    // Fails if a slice is out of place or order, the tilt is squared, or a sample misread. Numbers by pydicom 3.0.2.
    let Some([straight, tilted]) = phantoms() else { return };
    for (v, dims, spacing_mm, origin_mm, expected_sum, values) in [
        (&straight, [512, 512, 140], DVec3::new(0.451171875, 0.451171875, 1.0), DVec3::new(-115.5, -1.85, 694.21), STRAIGHT_SUM, STRAIGHT),
        (
            &tilted,
            [512, 512, 54],
            DVec3::new(0.482421875, 0.482421875, 2.5),
            DVec3::new(-123.5, -15.64097, 742.345191756896),
            TILTED_SUM,
            TILTED,
        ),
    ] {
        assert_eq!((v.grid().dims(), v.samples().type_name(), v.unit(), v.intercept()), (dims, "u16", Unit::Hounsfield, -1024.0));
        // The direction of j is written with 7 digits, so its length is 1 to 1e-7, which scales no spacing.
        assert!(
            v.grid().spacing_mm().abs_diff_eq(spacing_mm, 1e-12) && v.grid().origin_mm().abs_diff_eq(origin_mm, 1e-9),
            "{:?}",
            v.grid()
        );
        assert_eq!(sum(v), expected_sum, "{}", v.name());
        for &([i, j, k], value) in values {
            assert_eq!(v.samples().get_f64((k * dims[1] + j) * dims[0] + i), value, "{} at {i}, {j}, {k}", v.name());
        }
        assert!(v.warnings().is_empty(), "{:?}", v.warnings());
        assert!(v.metadata().keys().all(|key| !key.contains("Patient")), "{:?}", v.metadata());
    }
    let m = tilted.grid().index_to_world().matrix3;
    assert!((m.z_axis - DVec3::new(0.0, 0.0, 2.5)).length() < 1e-9, "{m}");
    assert!((m.y_axis - 0.482421875 * DVec3::new(0.0, 0.9483237, -0.3173047).normalize()).length() < 1e-9, "{m}");
}

/// The trilinear value at a point of index space; `None` outside.
fn value(v: &Volume, p: DVec3) -> Option<f64> {
    let [nx, ny, nz] = v.grid().dims();
    let most = DVec3::new(nx as f64, ny as f64, nz as f64) - DVec3::ONE;
    if p.cmplt(DVec3::ZERO).any() || p.cmpgt(most).any() {
        return None;
    }
    let cell = p.floor().min(most - DVec3::ONE);
    let (f, [i, j, k]) = (p - cell, cell.to_array().map(|c| c as usize));
    let at = |a: usize, b: usize, c: usize| v.samples().get_f64(((k + c) * ny + j + b) * nx + i + a);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let x = |b, c| mix(at(0, b, c), at(1, b, c), f.x);
    Some(v.value_of(mix(mix(x(0, 0), x(1, 0), f.y), mix(x(0, 1), x(1, 1), f.y), f.z)))
}

fn value_in_world(v: &Volume, p: DVec3) -> Option<f64> {
    value(v, v.grid().index(WorldPoint(p)).0)
}

/// PCG (O'Neill 2014): uniform in [0, 1).
fn unit(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    let x = (((*state >> 18) ^ *state) >> 27) as u32;
    f64::from(x.rotate_right((*state >> 59) as u32)) / 4_294_967_296.0
}

#[test]
fn the_two_series_of_the_phantom_land_on_each_other() {
    // Fails if either series is mirrored, shifted, squared or scaled. Read as if its slices were square, the tilted one correlates at 0.34.
    let Some([straight, tilted]) = phantoms() else { return };
    let (mut state, mut pairs) = (1, vec![]);
    let most = DVec3::from(straight.grid().dims().map(|n| n as f64 - 1.0));
    while pairs.len() < 200_000 {
        let p = most * DVec3::new(unit(&mut state), unit(&mut state), unit(&mut state));
        let world = straight.grid().world(IndexPoint(p)).0;
        if let (Some(a), Some(b)) = (value(&straight, p), value_in_world(&tilted, world)) {
            pairs.push([a, b]);
        }
    }
    let mean = |n: usize| pairs.iter().map(|p| p[n]).sum::<f64>() / pairs.len() as f64;
    let means = [mean(0), mean(1)];
    let moment = |a: usize, b: usize| pairs.iter().map(|p| (p[a] - means[a]) * (p[b] - means[b])).sum::<f64>();
    let correlation = moment(0, 1) / (moment(0, 0) * moment(1, 1)).sqrt();

    // As the files say, and with the phantom moved by what lies between the two scans, which no header tells.
    let stated = surface_distances(&straight, &tilted, DVec3::ZERO);
    let moved_mm = fit(&stated);
    let fitted = surface_distances(&straight, &tilted, moved_mm);
    let (n, [before, after]) = (pairs.len(), [&stated, &fitted].map(|d| median_mm(d)));
    // What would explain most of it: the tilted planes pass their SliceLocation at y = 115.43 mm, and from there the middle of the image is 14.71 mm
    // along its columns, 13.95 mm in y. Had the scanner meant 13.95 mm along the columns, the image would lie this much lower.
    let column = tilted.grid().direction().y_axis;
    let explained = median_mm(&surface_distances(&straight, &tilted, -(14.71 - 13.95) * column));
    println!(
        "phantom: correlation {correlation:.4} of {n} samples; 300 HU surfaces, median distance of {} points {before:.3} mm",
        stated.len()
    );
    println!("phantom: shifted by {moved_mm:.2} mm, which no header states, the median distance is {after:.3} mm");
    println!("phantom: shifted by 0.76 mm along the tilted columns alone, it is {explained:.3} mm");
    assert!(explained < 0.3, "{explained}");
    assert!(correlation >= 0.955 && before < 0.5, "{correlation} {before}");
    assert!(moved_mm.length() < 1.0 && after < 0.3, "{moved_mm} {after}");
}

/// From points of one 300 HU surface, on edges of the grid, where the interpolant is linear: the normal there, and how far along it the
/// other surface lies once that is moved by `moved_mm`; 5 mm where it has none so near.
fn surface_distances(of: &Volume, to: &Volume, moved_mm: DVec3) -> Vec<(DVec3, f64)> {
    const ISO: f64 = 300.0;
    const FAR_MM: f64 = 5.0;
    const STEP_MM: f64 = 0.05;
    let dims = of.grid().dims();
    let (mut state, mut found) = (2, vec![]);
    while found.len() < 20_000 {
        let corner = DVec3::from([0, 1, 2].map(|a| (unit(&mut state) * (dims[a] - 1) as f64).floor()));
        let axis = (unit(&mut state) * 3.0) as usize;
        let end = corner + [DVec3::X, DVec3::Y, DVec3::Z][axis];
        let (Some(a), Some(b)) = (value(of, corner), value(of, end)) else { continue };
        if (a < ISO) == (b < ISO) {
            continue;
        }
        let p = of.grid().world(IndexPoint(corner + (end - corner) * ((ISO - a) / (b - a)))).0;
        let slope = |d: DVec3| Some(value_in_world(of, p + d)? - value_in_world(of, p - d)?);
        let gradient = || Some(DVec3::new(slope(DVec3::X * 0.5)?, slope(DVec3::Y * 0.5)?, slope(DVec3::Z * 0.5)?).normalize());
        let (Some(n), Some(here)) = (gradient(), value_in_world(to, p + moved_mm)) else { continue };
        let toward = |sign: f64| {
            let mut before = here;
            (1..=(FAR_MM / STEP_MM) as usize).find_map(|s| {
                let t = s as f64 * STEP_MM;
                let now = value_in_world(to, p + moved_mm + n * (sign * t))?;
                let hit = ((before < ISO) != (now < ISO)).then(|| sign * (t - STEP_MM * (ISO - now) / (before - now)));
                before = now;
                hit
            })
        };
        let nearest = [toward(1.0), toward(-1.0)].into_iter().flatten().min_by(|a, b| a.abs().total_cmp(&b.abs()));
        found.push((n, nearest.unwrap_or(FAR_MM)));
    }
    found
}

fn median_mm(distances: &[(DVec3, f64)]) -> f64 {
    let mut sorted: Vec<f64> = distances.iter().map(|(_, t)| t.abs()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// The translation that explains the distances best: least squares of n·m − t over the surfaces that are near each other.
fn fit(distances: &[(DVec3, f64)]) -> DVec3 {
    let near = || distances.iter().filter(|(_, t)| t.abs() < 3.0);
    let matrix = near().map(|(n, _)| DMat3::from_cols(*n * n.x, *n * n.y, *n * n.z)).fold(DMat3::ZERO, |a, b| a + b);
    matrix.inverse() * near().map(|(n, t)| *n * *t).sum::<DVec3>()
}

const STRAIGHT_SUM: f64 = 7090261909.0;
const STRAIGHT: &[([usize; 3], f64)] = &[
    ([242, 395, 26], 1720.0),
    ([338, 311, 12], 1746.0),
    ([249, 152, 34], 1698.0),
    ([481, 290, 46], 1030.0),
    ([173, 402, 84], 1545.0),
    ([320, 109, 100], 950.0),
];
const TILTED_SUM: f64 = 2381844260.0;
const TILTED: &[([usize; 3], f64)] = &[
    ([221, 170, 5], 1710.0),
    ([129, 191, 28], 1774.0),
    ([338, 311, 4], 1651.0),
    ([31, 246, 26], 1399.0),
    ([361, 298, 9], 1746.0),
    ([226, 317, 5], 1122.0),
];

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
