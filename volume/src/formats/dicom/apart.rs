//! Several scans under the identifier of one series: reconstructions by two kernels, repeated or timed acquisitions. They are told apart by
//! what their images state, so that no slice of one gets between those of another.

use super::header::Header;
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// What images of different scans differ by, in the order in which it is looked at.
const APART: [(&str, Tag); 14] = [
    ("kernel", tags::CONVOLUTION_KERNEL),
    ("image type", tags::IMAGE_TYPE),
    ("description", tags::SERIES_DESCRIPTION),
    ("series number", tags::SERIES_NUMBER),
    ("temporal position", tags::TEMPORAL_POSITION_INDEX),
    ("temporal position", tags::TEMPORAL_POSITION_IDENTIFIER),
    ("acquisition", tags::ACQUISITION_NUMBER),
    ("kV", tags::KVP),
    ("echo time", tags::ECHO_TIME),
    ("trigger time", tags::TRIGGER_TIME),
    ("b-value", tags::DIFFUSION_B_VALUE),
    ("slice thickness", tags::SLICE_THICKNESS),
    ("acquisition time", tags::ACQUISITION_TIME),
    ("frame of reference", tags::FRAME_OF_REFERENCE_UID),
];

/// Images of one scan, and by what it differs from others of its series.
pub struct Scan {
    /// Its files.
    pub headers: Vec<Header>,
    /// What it states and they do not, such as `kernel H60s`.
    pub apart: Vec<String>,
}

/// The scans that the files of one series make up.
pub fn told_apart(headers: Vec<Header>) -> Vec<Scan> {
    split(Scan { headers, apart: vec![] })
}

fn split(scan: Scan) -> Vec<Scan> {
    let Some((what, tag)) = APART.into_iter().find(|&(_, tag)| tells_apart(&scan.headers, tag)) else { return vec![scan] };
    let (slices, others): (Vec<Header>, Vec<Header>) = scan.headers.into_iter().partition(|h| place(h).is_some());
    let mut groups: BTreeMap<String, Vec<Header>> = BTreeMap::new();
    slices.into_iter().for_each(|h| groups.entry(stated(&h, tag)).or_default().push(h));
    let mut scans: Vec<Scan> = groups
        .into_iter()
        .map(|(value, headers)| {
            let value = if value.is_empty() { format!("no {what}") } else { format!("{what} {value}") };
            Scan { headers, apart: scan.apart.iter().cloned().chain([value]).collect() }
        })
        .collect();
    // Localizers and reports go with the first of the largest.
    let most = scans.iter().map(|s| s.headers.len()).max().unwrap_or(0);
    if let Some(largest) = scans.iter_mut().find(|s| s.headers.len() == most) {
        largest.headers.extend(others);
    }
    scans.into_iter().flat_map(split).collect()
}

fn stated(header: &Header, tag: Tag) -> String {
    header.text(tag, 0).unwrap_or_default().to_owned()
}

/// Position to 0.01 mm and directions to 0.001 of an image that is one slice.
fn place(header: &Header) -> Option<[i64; 9]> {
    let is_localizer = header.text(tags::IMAGE_TYPE, 0).is_some_and(|kind| kind.split('\\').any(|k| k == "LOCALIZER"));
    if header.pixels.is_none() || header.frames() != 1 || is_localizer {
        return None;
    }
    let (position, along) = header.place(0)?;
    let mut key = [0; 9];
    position.iter().map(|v| v * 1e2).chain(along.iter().map(|v| v * 1e3)).zip(&mut key).for_each(|(v, k)| *k = v.round() as i64);
    Some(key)
}

/// Whether the values of `tag` are those of several scans. Kernels always are, and others whose slices take turns. Else they must tell apart what
/// lies at one place: they have as many
/// values as there are images at a place at most (what differs from slice to slice tells nothing), and more than half of the smallest scan lies
/// where another does (two ranges that overlap in a few slices are one scan).
fn tells_apart(headers: &[Header], tag: Tag) -> bool {
    let mut values: HashMap<String, HashMap<[i64; 9], usize>> = HashMap::new();
    let mut places: HashMap<[i64; 9], usize> = HashMap::new();
    for (header, place) in headers.iter().filter_map(|h| Some((h, place(h)?))) {
        *values.entry(stated(header, tag)).or_default().entry(place).or_default() += 1;
        *places.entry(place).or_default() += 1;
    }
    if values.len() < 2 {
        return false;
    }
    if tag == tags::CONVOLUTION_KERNEL {
        return values.values().all(|places| places.len() > 1);
    }
    if TAKE_TURNS.contains(&tag) && values.values().all(|places| places.len() > 2) && take_turns(headers, tag) {
        return true;
    }
    let doubles = |places: &HashMap<[i64; 9], usize>| places.values().map(|n| n - 1).sum::<usize>();
    let most = places.values().copied().max().unwrap_or(0);
    let told = doubles(&places) - values.values().map(doubles).sum::<usize>();
    let smallest = values.values().map(|places| places.values().sum::<usize>()).min().unwrap_or(0);
    values.len() <= most && 2 * told > smallest
}

/// What slices of one scan never take turns in.
const TAKE_TURNS: [Tag; 5] =
    [tags::IMAGE_TYPE, tags::TEMPORAL_POSITION_INDEX, tags::TEMPORAL_POSITION_IDENTIFIER, tags::ACQUISITION_NUMBER, tags::KVP];

/// Whether of slices that lie next to each other most differ in `tag`: two scans with an offset, as the parts of one follow each other.
fn take_turns(headers: &[Header], tag: Tag) -> bool {
    let slices = || headers.iter().filter(|h| place(h).is_some()).filter_map(|h| Some((h, h.place(0)?)));
    let Some((_, (_, [a, b, c, d, e, f]))) = slices().next() else { return false };
    let normal = DVec3::new(a, b, c).cross(DVec3::new(d, e, f));
    let mut heights: Vec<(f64, String)> = slices().map(|(h, (position, _))| (normal.dot(position.into()), stated(h, tag))).collect();
    heights.sort_by(|a, b| a.0.total_cmp(&b.0));
    let turns = heights.windows(2).filter(|w| w[0].1 != w[1].1).count();
    2 * turns > heights.len()
}
