//! Slices that lie where they say become one grid: sorted along their normal, sheared where the gantry was tilted, even or not.

use super::{ReadError, Uneven};
use crate::{Grid, Progress};
use glam::{DAffine3, DMat3, DVec3};

/// Where a slice lies.
#[derive(Clone, Copy, Debug)]
pub struct Slice {
    /// World position of its first sample, LPS mm.
    pub position_mm: DVec3,
    /// World directions along which i and j grow, unit vectors.
    pub along: [DVec3; 2],
    /// Distance of samples along i and j.
    pub spacing_mm: [f64; 2],
    /// Samples along i and j.
    pub dims: [usize; 2],
}

/// A slice of the grid: slice `of` as it was given, or on its way to slice `and`, at `part` (0 to 1) of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    /// Number of the slice.
    pub of: usize,
    /// Number of the next slice.
    pub and: usize,
    /// How much of the next slice is in it.
    pub part: f64,
}

/// Slices put in order.
#[derive(Debug)]
pub struct Stack {
    /// Where the samples lie.
    pub grid: Grid,
    /// One for each k.
    pub mixes: Vec<Mix>,
    /// How far a slice lies from where the grid has it, at most, mm; 0 where slices were interpolated.
    pub off_mm: f64,
    /// What was unusual.
    pub warnings: Vec<String>,
}

/// Directions are written with 6 digits, or as float32; a thousandth of a radian moves the edge of 512 samples by half of one.
const DIRECTION: f64 = 1e-3;
/// Directions of three digits are off a right angle by 0.0015 at most (of 400,000 turns, rounded).
const PERPENDICULAR: f64 = 2e-3;
/// Spacings are written with at least 4 digits.
const SPACING: f64 = 1e-3;
/// Slices nearer to each other than this part of the distance of their samples are one place: no scanner cuts so thin, and positions that
/// are written again differ less.
const SAME_PLACE: f64 = 1e-2;
/// Kinds of slices that the most common one is found among. Each slice is compared with one of each kind, so that there must be few; what is
/// like none of the first of them is a stray.
const MOST_KINDS: usize = 256;
/// Slices within this part of a step of their even place are even: tables stop that well, and positions are rounded.
const EVEN: f64 = 0.02;

/// Slices within this part of a step of their place are taken as even, aloud: a twentieth of a sample is less than any edge is sharp.
const NEARLY_EVEN: f64 = 0.05;
/// Where a tenth of the gaps and more differ, it is how positions were written, or how the table moved, and no slice is missing. Such slices may be
/// off by more, since interpolating them would smooth the scan and place it no better: by this part of a step,
const JITTER: f64 = 0.15;
/// or by this many mm, which is what positions rounded to tenths can be off from the line of the first and the last, themselves rounded;
const ROUNDING_MM: f64 = 0.1;
/// but never by more than this part of a step: a missing slice moves others by half of one.
const MOST_JITTER: f64 = 0.4;

/// Puts slices in order. `thickness_mm` is the distance to the next slice where there is only one.
pub fn build(slices: &[Slice], uneven: Uneven, thickness_mm: Option<f64>, progress: &Progress) -> Result<Stack, ReadError> {
    let mut warnings = vec![];
    let mut order = likest(slices, &mut warnings, progress)?;
    let first = slices[order[0]];
    let [i, j] = perpendicular(first.along)?;
    let normal = i.cross(j).normalize();
    let height = |n: usize| normal.dot(slices[n].position_mm);
    // Equal heights keep the order in which they came.
    order.sort_by(|&a, &b| height(a).total_cmp(&height(b)));
    let sample_mm = first.spacing_mm[0].min(first.spacing_mm[1]);
    leave_one_each(slices, &mut order, height, sample_mm, &mut warnings)?;
    let begin = slices[order[0]].position_mm;
    let end = slices[order[order.len() - 1]].position_mm;
    let gaps: Vec<f64> = order.windows(2).map(|w| height(w[1]) - height(w[0])).collect();
    let (count, step_mm) = match gaps.is_empty() {
        true => (1, thickness_mm.filter(|t| *t > 0.0 && t.is_finite()).unwrap_or(1.0) * normal),
        false => (order.len(), (end - begin) / gaps.len() as f64),
    };
    let off = |(k, &n): (usize, &usize)| slices[n].position_mm.distance(begin + step_mm * k as f64);
    let off_mm = order.iter().enumerate().map(off).fold(0.0, f64::max);
    let is_even = match off_mm <= EVEN * step_mm.length() {
        false if uneven == Uneven::Even && off_mm <= most_off_mm(&gaps, step_mm.length()) => {
            warnings.push(format!(
                "its slices are not quite even; they are taken as {} mm apart, none interpolated: at most {} mm from where they lie",
                short(step_mm.length()),
                short(off_mm)
            ));
            true
        }
        is_even => is_even,
    };
    let (count, step_mm) = match is_even {
        true => (count, step_mm),
        false => {
            let heights: Vec<f64> = order.iter().map(|&n| height(n)).collect();
            // The line from the first slice to the last must pass through all of them, or they are shifted sideways.
            let line = |k: usize| begin + (end - begin) * ((heights[k] - heights[0]) / normal.dot(end - begin));
            if order.iter().enumerate().any(|(k, &n)| slices[n].position_mm.distance(line(k)) > sample_mm) {
                return Err(sideways());
            }
            let steps = interpolated_steps(&gaps, uneven, &mut warnings)?;
            (steps + 1, (end - begin) / steps as f64)
        }
    };
    let mixes = match is_even {
        true => order.iter().map(|&n| Mix { of: n, and: n, part: 0.0 }).collect(),
        false => interpolated(&order, &order.iter().map(|&n| height(n)).collect::<Vec<_>>(), count),
    };
    let [di, dj] = first.spacing_mm;
    let map = DAffine3::from_mat3_translation(DMat3::from_cols(i * di, j * dj, step_mm), begin);
    let grid = Grid::from_affine([first.dims[0], first.dims[1], count], map)?;
    Ok(Stack { grid, mixes, off_mm: if is_even { off_mm } else { 0.0 }, warnings })
}

/// The two unit vectors at right angles that `along` are but for the rounding of their digits, which scales and shears no sample.
fn perpendicular([i, j]: [DVec3; 2]) -> Result<[DVec3; 2], ReadError> {
    if (i.length() - 1.0).abs() > DIRECTION || (j.length() - 1.0).abs() > DIRECTION || i.dot(j).abs() > PERPENDICULAR {
        let text = format!("its slices state directions that are no two perpendicular unit vectors, {i} and {j}");
        return Err(ReadError::Contradiction(text));
    }
    let [i, j] = [i.normalize(), j.normalize()];
    let half = i.dot(j) / 2.0;
    // Each gives up half of what they share.
    Ok([(i - half * j).normalize(), (j - half * i).normalize()])
}

/// Steps of even slices that stand in for those with `gaps`, where the person wants that.
fn interpolated_steps(gaps: &[f64], uneven: Uneven, warnings: &mut Vec<String>) -> Result<usize, ReadError> {
    let (usual, total) = (usual(gaps), gaps.iter().sum::<f64>());
    let list = list_gaps(gaps, usual);
    let steps = (total / usual).round();
    let more = (steps as usize).saturating_add(1);
    // What a stack of so many slices would need is bounded: no gap asks for more than is there.
    if uneven != Uneven::Resample || more > 16 * (gaps.len() + 1) {
        // To the nanometre: what is finer is only how positions were written.
        return Err(ReadError::Uneven { usual_mm: (usual * 1e6).round() / 1e6, gaps: list });
    }
    warnings.push(format!(
        "its slices are not even ({list}); they are interpolated linearly to {more} slices {} mm apart",
        short(total / steps)
    ));
    Ok(more - 1)
}

/// The gap in the middle of all by size; of two the smaller, as slices that are missing make gaps larger.
fn usual(gaps: &[f64]) -> f64 {
    let mut sorted = gaps.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[(sorted.len() - 1) / 2]
}

/// How far slices may be from their even places, and still be taken as even.
fn most_off_mm(gaps: &[f64], step_mm: f64) -> f64 {
    let usual = usual(gaps);
    let odd = gaps.iter().filter(|gap| (**gap - usual).abs() > EVEN * usual).count();
    // No gap has room for a slice, none is hardly there.
    let is_whole = gaps.iter().all(|gap| (0.5..1.5).contains(&(gap / step_mm)));
    match odd > 1 && 10 * odd >= gaps.len() {
        _ if !is_whole => 0.0,
        true => (JITTER * step_mm).max(ROUNDING_MM).min(MOST_JITTER * step_mm),
        false => NEARLY_EVEN * step_mm,
    }
}

fn sideways() -> ReadError {
    ReadError::Contradiction("its slices are shifted sideways against each other, as if they were of several scans".into())
}

/// Leaves the first of the slices that lie at one place, of such as are in order by `height`.
fn leave_one_each(
    slices: &[Slice],
    order: &mut Vec<usize>,
    height: impl Fn(usize) -> f64,
    sample_mm: f64,
    warnings: &mut Vec<String>,
) -> Result<(), ReadError> {
    let all = order.len();
    let mut is_beside = false;
    order.dedup_by(|b, a| {
        let same_height = height(*b) - height(*a) < SAME_PLACE * sample_mm;
        is_beside |= same_height && slices[*a].position_mm.distance(slices[*b].position_mm) > sample_mm;
        same_height
    });
    if is_beside {
        return Err(sideways());
    }
    if order.len() < all {
        let n = all - order.len();
        warnings.push(format!("{n} of {all} slices lie where another one does and are left out: of each place the first image is read"));
    }
    Ok(())
}

/// The slices of the most common size, directions and spacing.
fn likest(slices: &[Slice], warnings: &mut Vec<String>, progress: &Progress) -> Result<Vec<usize>, ReadError> {
    let like = |a: &Slice, b: &Slice| {
        a.dims == b.dims
            && (0..2).all(|n| a.along[n].distance(b.along[n]) < DIRECTION)
            && (0..2).all(|n| (a.spacing_mm[n] / b.spacing_mm[n] - 1.0).abs() < SPACING)
    };
    let mut groups: Vec<Vec<usize>> = vec![];
    for (n, slice) in slices.iter().enumerate() {
        progress.advance(0)?;
        match groups.iter().position(|g| like(&slices[g[0]], slice)) {
            Some(group) => groups[group].push(n),
            None if groups.len() < MOST_KINDS => groups.push(vec![n]),
            None => {}
        }
    }
    // The first of the largest.
    let most = groups.iter().map(Vec::len).max().unwrap_or(0);
    let group = groups.into_iter().find(|g| g.len() == most).ok_or(ReadError::NoImages)?;
    if group.len() < slices.len() {
        let (n, all) = (slices.len() - group.len(), slices.len());
        warnings.push(format!("{n} of {all} slices differ in size, direction or spacing from the others and are left out"));
    }
    Ok(group)
}

fn list_gaps(gaps: &[f64], usual: f64) -> String {
    const MOST: usize = 5;
    let odd = || gaps.iter().enumerate().filter(|(_, g)| (**g - usual).abs() > EVEN * usual);
    let one = |(k, gap): (usize, &f64)| format!("{} mm between slices {} and {}", short(*gap), k + 1, k + 2);
    let list = odd().take(MOST).map(one).collect::<Vec<_>>().join(", ");
    match odd().count().saturating_sub(MOST) {
        0 if list.is_empty() => "each gap a little".into(),
        0 => list,
        more => format!("{list} and {more} more"),
    }
}

fn interpolated(order: &[usize], heights: &[f64], count: usize) -> Vec<Mix> {
    let (low, high) = (heights[0], heights[heights.len() - 1]);
    let at = |k: usize| {
        let height = low + (high - low) * k as f64 / (count - 1) as f64;
        let next = heights.partition_point(|&h| h < height).clamp(1, heights.len() - 1);
        let part = ((height - heights[next - 1]) / (heights[next] - heights[next - 1])).clamp(0.0, 1.0);
        Mix { of: order[next - 1], and: order[next], part }
    };
    (0..count).map(at).collect()
}

/// Three digits after the point at most.
fn short(mm: f64) -> String {
    let text = format!("{mm:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(slices: &[Slice], uneven: Uneven, thickness_mm: Option<f64>) -> Result<Stack, ReadError> {
        super::build(slices, uneven, thickness_mm, &Progress::default())
    }

    fn slice(z: f64) -> Slice {
        Slice { position_mm: DVec3::new(1.0, 2.0, z), along: [DVec3::X, DVec3::Y], spacing_mm: [0.5, 0.6], dims: [4, 5] }
    }

    fn at(heights: &[f64]) -> Vec<Slice> {
        heights.iter().map(|&z| slice(z)).collect()
    }

    #[test]
    fn slices_are_sorted_along_their_normal() {
        // Fails if the order of files, or a thickness, decides the geometry.
        let stack = build(&at(&[4.0, 0.0, 2.0]), Uneven::Refuse, Some(9.0)).unwrap();
        assert_eq!(stack.mixes.iter().map(|m| m.of).collect::<Vec<_>>(), [1, 2, 0]);
        assert_eq!(stack.grid.spacing_mm(), DVec3::new(0.5, 0.6, 2.0));
        assert_eq!(stack.grid.origin_mm(), DVec3::new(1.0, 2.0, 0.0));
        let flat = build(&at(&[7.0]), Uneven::Refuse, Some(9.0)).unwrap();
        assert_eq!(flat.grid.spacing_mm().z, 9.0);
    }

    #[test]
    fn a_tilted_gantry_is_a_sheared_grid() {
        // Fails if slices are assumed to be stacked along their normal.
        let along = [DVec3::X, DVec3::new(0.0, 0.9483237, -0.3173047)];
        let slices: Vec<Slice> = (0..5).map(|k| Slice { along, ..slice(2.5 * f64::from(k)) }).collect();
        let stack = build(&slices, Uneven::Refuse, None).unwrap();
        assert!((stack.grid.index_to_world().matrix3.z_axis - DVec3::new(0.0, 0.0, 2.5)).length() < 1e-12);
        assert!(stack.warnings.is_empty());
    }

    #[test]
    fn strays_and_doubles_are_left_out_aloud() {
        let mut slices = at(&[0.0, 1.0, 1.0, 2.0, 3.0]);
        slices.push(Slice { along: [DVec3::Y, DVec3::Z], ..slice(9.0) });
        slices.push(Slice { dims: [9, 9], ..slice(8.0) });
        slices.push(Slice { spacing_mm: [1.0, 1.0], ..slice(7.0) });
        let stack = build(&slices, Uneven::Refuse, None).unwrap();
        assert_eq!((stack.grid.dims(), stack.warnings.len()), ([4, 5, 4], 2));
        assert!(stack.warnings[0].starts_with("3 of 8 slices differ"), "{:?}", stack.warnings);
        assert!(stack.warnings[1].starts_with("1 of 5 slices lie where"), "{:?}", stack.warnings);
    }

    #[test]
    fn only_the_same_place_is_the_same_place() {
        // Fails if slices of a micrometre are one place, or if slices beside each other are.
        let fine: Vec<Slice> = (0..5).map(|k| Slice { spacing_mm: [1e-3, 1e-3], ..slice(5e-4 * f64::from(k)) }).collect();
        let stack = build(&fine, Uneven::Refuse, None).unwrap();
        assert_eq!((stack.grid.dims()[2], stack.warnings.len()), (5, 0));
        let mut again = at(&[0.0, 1.0, 1.0 + 1e-7, 2.0]);
        assert_eq!(build(&again, Uneven::Refuse, None).unwrap().grid.dims()[2], 3);
        again[2].position_mm.x += 3.0;
        assert!(build(&again, Uneven::Resample, None).unwrap_err().to_string().contains("sideways"));
    }

    #[test]
    fn many_kinds_of_slices_take_no_time() {
        // Fails if every slice is compared with every other, which takes minutes here, or if that cannot be stopped.
        let turned = |n: usize| Slice { spacing_mm: [1.0, 1.0 + 0.01 * n as f64], ..slice(n as f64) };
        let slices: Vec<Slice> = (0..200_000).map(turned).collect();
        let begun = std::time::Instant::now();
        assert_eq!(build(&slices, Uneven::Refuse, None).unwrap().grid.dims()[2], 1);
        assert!(begun.elapsed().as_secs_f64() < 5.0, "{:?}", begun.elapsed());
        let stopped = Progress::default();
        stopped.cancel();
        assert!(matches!(super::build(&slices, Uneven::Refuse, None, &stopped), Err(ReadError::Cancelled(_))));
    }

    #[test]
    fn slices_that_jitter_are_even_aloud() {
        // Fails if rounded or slightly moved positions refuse a sound scan, if its slices are interpolated, or if a real gap passes for jitter.
        let rounded = |step: f64| at(&(0..40).map(|k| (f64::from(k) * step * 10.0).round() / 10.0).collect::<Vec<_>>());
        for step in [0.625, 0.45, 0.312, 0.9375] {
            let stack = build(&rounded(step), Uneven::Even, None).unwrap();
            assert!(stack.mixes.iter().enumerate().all(|(k, mix)| *mix == Mix { of: k, and: k, part: 0.0 }), "{step}");
            assert!((stack.grid.spacing_mm().z - step).abs() < 0.1 / 39.0 + 1e-9, "{step}: {}", stack.grid.spacing_mm().z);
            assert!(stack.off_mm > 0.02 && stack.off_mm <= 0.1 + 1e-9, "{step}: {}", stack.off_mm);
            assert!(
                stack.warnings[0].contains("not quite even") && stack.warnings[0].contains("mm from where they lie"),
                "{:?}",
                stack.warnings
            );
        }
        // By a few per cent, all of them or one alone.
        let moved: Vec<f64> =
            (0..30).map(|k| f64::from(k) + [0.0, 0.07, -0.06, 0.03][k as usize % 4] * f64::from(u8::from(k < 29))).collect();
        let one: Vec<f64> = (0..30).map(|k| f64::from(k) + if k == 7 { 0.04 } else { 0.0 }).collect();
        for heights in [moved, one] {
            let stack = build(&at(&heights), Uneven::Even, None).unwrap();
            assert_eq!((stack.grid.dims()[2], stack.warnings.len()), (30, 1));
            // Who asks for it has them refused, or interpolated.
            assert!(build(&at(&heights), Uneven::Refuse, None).is_err());
            let interpolated = build(&at(&heights), Uneven::Resample, None).unwrap();
            assert!(interpolated.warnings[0].contains("interpolated") && interpolated.off_mm == 0.0);
        }
        // One odd gap at the end; a missing slice in a scan that is rounded, and in one of few slices.
        let mut last: Vec<f64> = (0..16).map(|k| 0.5 * f64::from(k)).collect();
        last[15] = 7.4;
        let error = build(&at(&last), Uneven::Even, None).unwrap_err().to_string();
        assert!(error.contains("0.4 mm between slices 15 and 16"), "{error}");
        for missing in [1, 20, 38] {
            let mut gone = rounded(0.625);
            gone.remove(missing);
            assert!(build(&gone, Uneven::Even, None).is_err(), "{missing}");
        }
        assert!(build(&at(&[0.0, 1.0, 3.0]), Uneven::Even, None).is_err());
    }

    #[test]
    fn gaps_are_listed_or_filled() {
        // Fails if a missing slice passes in silence and the rest is squeezed.
        let slices = at(&[0.0, 2.0, 4.0, 8.0, 10.0]);
        let error = build(&slices, Uneven::Refuse, None).unwrap_err().to_string();
        assert!(error.contains("4 mm between slices 3 and 4") && error.contains("--uneven resample"), "{error}");
        let stack = build(&slices, Uneven::Resample, None).unwrap();
        assert_eq!(stack.grid.dims(), [4, 5, 6]);
        assert_eq!(stack.grid.spacing_mm().z, 2.0);
        assert_eq!(stack.mixes[3], Mix { of: 2, and: 3, part: 0.5 });
        assert!((stack.mixes[4].part - 1.0).abs() < 1e-12 && stack.mixes[4].and == 3);
        for height in [1e9, 1e300] {
            assert!(build(&at(&[0.0, 1.0, 2.0, height]), Uneven::Resample, None).is_err());
        }
        let mut sideways = at(&[0.0, 1.0, 2.0, 3.0]);
        sideways[2].position_mm.x += 5.0;
        assert!(build(&sideways, Uneven::Resample, None).unwrap_err().to_string().contains("sideways"));
        assert!(build(&[], Uneven::Refuse, None).is_err());
    }
}
