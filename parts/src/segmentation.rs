//! Label maps as files: 3D Slicer's segmentations (`.seg.nrrd`), and images of whole numbers in any format that scans are read from.
//!
//! A segmentation is a NRRD whose key/value pairs say of each segment n its `Segmentn_Name`, `_Color`, `_LabelValue`, `_Layer` and more, as
//! `vtkMRMLSegmentationStorageNode` of 3D Slicer writes them; segments that overlap lie in layers, along a fourth axis of the kind `list`. Where
//! its samples lie is said by its origin and directions alone; it may hold less than the scan, or more.

use crate::error::PartsError;
use crate::labels::{Labels, Part, seen};
use bregma_field::formats::nrrd::{Compression, LAYERS};
use bregma_field::formats::{self, Hints};
use bregma_field::{Grid, Metadata, Progress, Sample, Samples, Store, Volume, WorldPoint, with_block};
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Whose numbers a file has.
struct Layer {
    grid: Grid,
    numbers: Vec<u16>,
}

/// A segment as the header has it.
struct Segment {
    layer: usize,
    value: u16,
    part: Part,
}

/// Reads a label map as one of `scan`, with a sentence for each thing that is not as in the file. A sample of the scan has the label of the file's
/// sample nearest to it: the one at its place, where both lie on one grid, however much of it each holds.
pub fn read(path: &Path, scan: &Volume, progress: &Progress) -> Result<(Labels, Vec<String>), PartsError> {
    let (first, metadata) = layer(path, 0, progress)?;
    let count = metadata.get(LAYERS).and_then(|count| count.parse().ok()).unwrap_or(1);
    let mut segments = segments(path, &metadata)?;
    let named = segments.iter().map(|segment| segment.layer + 1).max().unwrap_or(0);
    let mut layers = vec![first];
    for n in 1..named.max(count) {
        layers.push(layer(path, n, progress)?.0);
    }
    add_unnamed(&layers, &mut segments)?;
    renumber(&mut segments);
    let (numbers, warnings) = placed(path, scan, &layers, &segments)?;
    let parts: Vec<Part> = segments.into_iter().map(|segment| segment.part).collect();
    let is_small = parts.iter().all(|part| part.number <= u16::from(u8::MAX));
    let samples = if is_small { Samples::U8(numbers.par_iter().map(|&n| n as u8).collect()) } else { Samples::U16(numbers) };
    Ok((Labels::new(scan.grid().clone(), samples, parts)?, warnings))
}

fn layer(path: &Path, number: usize, progress: &Progress) -> Result<(Layer, Metadata), PartsError> {
    let volume = formats::open(path, &Hints { layer: Some(number), ..Hints::default() }, progress)?;
    let whole = |sample: f64| {
        let value = volume.value_of(sample);
        (value.fract() == 0.0 && (0.0..=f64::from(u16::MAX)).contains(&value)).then_some(value as u16)
    };
    let numbers: Option<Vec<u16>> =
        with_block!(Store::of(&volume).whole(), b => b.onward([0; 3]).par_iter().map(|s| whole(s.to_f64())).collect());
    let numbers = numbers.ok_or_else(|| PartsError::NotNumbers(path.to_owned()))?;
    Ok((Layer { grid: volume.grid().clone(), numbers }, volume.metadata().clone()))
}

/// The segments that a header names, in its order.
fn segments(path: &Path, metadata: &Metadata) -> Result<Vec<Segment>, PartsError> {
    let mut fields: BTreeMap<usize, Metadata> = BTreeMap::new();
    for (key, value) in metadata {
        let named = key.strip_prefix("Segment").and_then(|rest| rest.split_once('_'));
        if let Some((Ok(n), field)) = named.map(|(n, field)| (n.parse(), field)) {
            fields.entry(n).or_default().insert(field.to_owned(), value.clone());
        }
    }
    fields.into_iter().map(|(n, fields)| segment(path, n, fields)).collect()
}

fn segment(path: &Path, n: usize, mut fields: Metadata) -> Result<Segment, PartsError> {
    let bad =
        |field, value: &str, problem| PartsError::Segment { file: path.to_owned(), segment: n, field, value: value.to_owned(), problem };
    // Before there were layers of several segments, each had one of its own, of ones.
    let before = if fields.contains_key("LabelValue") { "0".to_owned() } else { n.to_string() };
    let layer = fields.remove("Layer").unwrap_or(before);
    let value = fields.remove("LabelValue").unwrap_or("1".to_owned());
    let number = value.trim().parse().ok().filter(|value| *value > 0);
    let number = number.ok_or_else(|| bad("LabelValue", &value, "must be a whole number from 1 to 65535"))?;
    // An axis of more layers than this is none: each is read by itself.
    let layer = layer.trim().parse().ok().filter(|layer| *layer < 1 << 16).ok_or_else(|| bad("Layer", &layer, "must be a whole number"))?;
    let mut part = Part::new(number, fields.remove("Name").unwrap_or_else(|| format!("Segment {n}")));
    if let Some(text) = fields.remove("Color") {
        let color: Vec<f32> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let color: Option<[f32; 3]> = color.try_into().ok().filter(|color: &[f32; 3]| color.iter().all(|c| (0.0..=1.0).contains(c)));
        part.color = color.ok_or_else(|| bad("Color", &text, "must be three numbers from 0 to 1"))?;
    }
    // It is worked out anew when it is written.
    fields.remove("Extent");
    part.fields = fields;
    Ok(Segment { layer, value: number, part })
}

/// Numbers of samples that no segment has become parts of that name.
fn add_unnamed(layers: &[Layer], segments: &mut Vec<Segment>) -> Result<(), PartsError> {
    for (layer, Layer { numbers, .. }) in layers.iter().enumerate() {
        let mut is_there = seen(numbers);
        segments.iter().filter(|segment| segment.layer == layer).for_each(|segment| is_there[usize::from(segment.value)] = false);
        let unnamed = (1..=u16::MAX).filter(|&n| is_there[usize::from(n)]);
        segments.extend(unnamed.map(|value| Segment { layer, value, part: Part::new(value, value.to_string()) }));
    }
    if segments.len() > usize::from(u16::MAX) { Err(PartsError::TooMany) } else { Ok(()) }
}

/// Parts keep the values of their segments where each of these is one's own; else they are numbered in order.
fn renumber(segments: &mut [Segment]) {
    let mut values: Vec<u16> = segments.iter().map(|segment| segment.value).collect();
    values.sort_unstable();
    if values.windows(2).any(|pair| pair[0] == pair[1]) {
        segments.iter_mut().zip(1..).for_each(|(segment, number)| segment.part.number = number);
    }
}

/// A hundredth of a sample: files round positions, NIfTI to seven digits.
const SAME_PLACE: f64 = 0.01;

/// Index of a scan to index of a label map, and whether each sample of the scan lies at one of the map's.
fn mapping(scan: &Grid, labels: &Grid) -> (DAffine3, bool) {
    let map = labels.world_to_index() * scan.index_to_world();
    let columns = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(DVec3::round);
    let round = DAffine3::from_mat3_translation(DMat3::from_cols(columns[0], columns[1], columns[2]), map.translation.round());
    let off = |corner: DVec3| (map.transform_point3(corner) - round.transform_point3(corner)).abs().max_element();
    let corners = scan.corners_mm().map(|mm| scan.index(WorldPoint(mm)).0);
    if corners.into_iter().all(|corner| off(corner) < SAME_PLACE) { (round, true) } else { (map, false) }
}

/// The numbers of parts at the samples of the scan, and what is to be said of them.
fn placed(path: &Path, scan: &Volume, layers: &[Layer], segments: &[Segment]) -> Result<(Vec<u16>, Vec<String>), PartsError> {
    // A map may have been drawn where the file of the scan has it, and not where the person corrected it to be.
    let stated = scan.placing().stated().every(scan.placing().step());
    let (map, is_same) = [scan.grid(), &stated]
        .into_iter()
        .map(|grid| mapping(grid, &layers[0].grid))
        .find(|(_, is_same)| *is_same)
        .unwrap_or_else(|| mapping(scan.grid(), &layers[0].grid));
    let mut numbers = vec![0_u16; scan.grid().len()];
    let [mut labelled, mut within, mut twice] = [0; 3];
    for (n, layer) in layers.iter().enumerate() {
        let mut number_of = vec![0; 1 << 16];
        // Of two segments of one value the first has it.
        let own = segments.iter().rev().filter(|segment| segment.layer == n);
        own.for_each(|segment| number_of[usize::from(segment.value)] = segment.part.number);
        labelled += layer.numbers.par_iter().filter(|n| **n > 0).count();
        let [found, again] = laid(&mut numbers, scan.grid().dims(), layer, map, &number_of);
        within += found;
        twice += again;
    }
    let mut warnings = vec![];
    let mut warn = |sentence: String| warnings.push(format!("{}: {sentence}", path.display()));
    if labelled > 0 && within == 0 {
        return Err(PartsError::Elsewhere { file: path.to_owned(), scan: scan.name().to_owned() });
    }
    let is_one_to_one = is_same && (map.matrix3.determinant().abs() - 1.0).abs() < SAME_PLACE;
    if !is_same {
        warn("its samples lie between those of the scan; each sample of the scan takes the label that is nearest".into());
    } else if is_one_to_one && within < labelled {
        warn(format!("{} of its {labelled} labelled samples lie outside of the scan and are left out", labelled - within));
    }
    if twice > 0 {
        warn(format!("{twice} samples belong to several segments; each is taken as the last one's"));
    }
    Ok((numbers, warnings))
}

/// Lays a layer over `numbers`; gives how many samples it labels, and how many of these another one labelled before.
fn laid(numbers: &mut [u16], [nx, ny, _]: [usize; 3], layer: &Layer, map: DAffine3, number_of: &[u16]) -> [usize; 2] {
    let [mx, my, mz] = layer.grid.dims();
    let row = |(row, numbers): (usize, &mut [u16])| {
        let [mut found, mut again] = [0; 2];
        let first = map.transform_point3(DVec3::new(0.0, (row % ny) as f64, (row / ny) as f64));
        for (i, number) in numbers.iter_mut().enumerate() {
            let at = (first + map.matrix3.x_axis * i as f64).round();
            if at.min_element() < 0.0 || at.x >= mx as f64 || at.y >= my as f64 || at.z >= mz as f64 {
                continue;
            }
            let value = layer.numbers[at.x as usize + mx * (at.y as usize + my * at.z as usize)];
            let label = number_of[usize::from(value)];
            if label > 0 {
                found += 1;
                again += usize::from(*number > 0);
                *number = label;
            }
        }
        [found, again]
    };
    numbers.par_chunks_mut(nx).enumerate().map(row).reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}

/// Writes a label map; a name that ends in `.nrrd` keeps names and colours as 3D Slicer does, which reads `.seg.nrrd` as a segmentation, other forms
/// keep the numbers. Gives a sentence for each thing that the form cannot hold.
pub fn write(path: &Path, labels: &Labels, progress: &Progress) -> Result<Vec<String>, PartsError> {
    if !path.to_string_lossy().to_lowercase().ends_with(".nrrd") {
        let mut lost = formats::write(path, &labels.volume(), progress)?;
        lost.push("it has the numbers of parts; their names and colours are kept in .seg.nrrd alone".into());
        return Ok(lost);
    }
    let volume = labels.volume();
    let header = header(labels, &volume);
    let volume = volume.with_metadata(header);
    formats::nrrd::write(path, &volume, Compression::Gzip, progress)?;
    Ok(vec![])
}

/// What 3D Slicer writes of segments.
fn header(labels: &Labels, volume: &Volume) -> Metadata {
    let form = [
        ("Segmentation_ContainedRepresentationNames", "Binary labelmap|"),
        // Its name before version 5.
        ("Segmentation_MasterRepresentation", "Binary labelmap"),
        ("Segmentation_SourceRepresentation", "Binary labelmap"),
        ("Segmentation_ReferenceImageExtentOffset", "0 0 0"),
    ];
    let mut header: Metadata = form.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
    for (n, (part, found)) in labels.parts().iter().zip(labels.statistics(volume)).enumerate() {
        let extent = found.extent.map_or("0 -1 0 -1 0 -1".to_owned(), |[low, high]| {
            (0..3).map(|a| format!("{} {}", low[a], high[a])).collect::<Vec<_>>().join(" ")
        });
        let [red, green, blue] = part.color;
        let own =
            [("ID", format!("Segment_{}", part.number)), ("NameAutoGenerated", "0".to_owned()), ("ColorAutoGenerated", "0".to_owned())];
        let kept = own.map(|(field, value)| (field.to_owned(), value)).into_iter().chain(part.fields.clone());
        let said = [
            ("Name", part.name.clone()),
            ("Color", format!("{red} {green} {blue}")),
            ("LabelValue", part.number.to_string()),
            ("Layer", "0".to_owned()),
            ("Extent", extent),
        ];
        let all = kept.chain(said.map(|(field, value)| (field.to_owned(), value)));
        header.extend(all.map(|(field, value)| (format!("Segment{n}_{field}"), value)));
    }
    header
}

#[cfg(test)]
mod tests;
