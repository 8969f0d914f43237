//! Which of a folder's pictures are one stack, and whether some are missing, told from their names.

use super::super::ReadError;
use super::super::entries::in_folder;
use crate::Progress;
use std::collections::BTreeMap;
use std::path::Path;

/// Pictures of one stack.
#[derive(Debug, PartialEq)]
pub struct Stack {
    /// Their places among the names.
    pub members: Vec<usize>,
    /// The number of each; none where their names have none that counts slices.
    pub numbers: Vec<u128>,
}

/// Whether the picture at `path` is one of a stack in its folder.
pub fn is_one_of_many(path: &Path, progress: &Progress) -> Result<bool, ReadError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let (text, numbers) = parts(&name);
    let folder = path.parent().filter(|p| *p != Path::new("")).unwrap_or(Path::new("."));
    if numbers.is_empty() {
        return Ok(false);
    }
    let beside = in_folder(folder, false, progress, &mut vec![])?;
    Ok(beside.iter().filter(|e| parts(&e.name).0 == text).count() > 1)
}

/// A name's text with `#` for each number, and the numbers. Small and capital letters are the same.
pub fn parts(name: &str) -> (String, Vec<u128>) {
    let (mut text, mut numbers, mut in_number) = (String::new(), vec![], false);
    for c in name.to_lowercase().chars() {
        match (c.to_digit(10), in_number) {
            (Some(digit), true) => {
                if let Some(last) = numbers.last_mut() {
                    // Numbers beyond 128 bits are all the largest.
                    *last = u128::saturating_add(u128::saturating_mul(*last, 10), digit.into());
                }
            }
            (Some(digit), false) => {
                text.push('#');
                numbers.push(digit.into());
            }
            (None, _) => text.push(c),
        }
        in_number = c.is_ascii_digit();
    }
    (text, numbers)
}

/// The stacks among `names`, which are sorted: names that differ in numbers alone are of one. Of several numbers, the one that counts slices is
/// the last that is another in each name; where none is, the others tell stacks apart (`left1_0001`, `left2_0001`).
pub fn stacks(names: &[&str]) -> Vec<Stack> {
    let mut alike: BTreeMap<String, Vec<(usize, Vec<u128>)>> = BTreeMap::new();
    for (n, name) in names.iter().enumerate() {
        let (text, numbers) = parts(name);
        alike.entry(text).or_default().push((n, numbers));
    }
    alike.into_values().flat_map(by_number).collect()
}

fn by_number(group: Vec<(usize, Vec<u128>)>) -> Vec<Stack> {
    let count = group[0].1.len();
    let column = |at: usize| group.iter().map(|(_, numbers)| numbers[at]).collect::<Vec<_>>();
    let distinct = |at: usize| {
        let mut values = column(at);
        values.sort_unstable();
        values.dedup();
        values.len()
    };
    let varying: Vec<usize> = (0..count).filter(|&at| distinct(at) > 1).collect();
    let members = || group.iter().map(|(n, _)| *n).collect();
    let own = varying.iter().copied().filter(|&at| distinct(at) == group.len());
    // What counts without a gap, before what only differs, such as a time.
    let spread = |at: usize| {
        let values = column(at);
        values.iter().max().zip(values.iter().min()).map_or(0, |(max, min)| max - min)
    };
    match (own.min_by_key(|&at| (spread(at), std::cmp::Reverse(at))), varying.split_last()) {
        (Some(at), _) => vec![Stack { members: members(), numbers: column(at) }],
        (None, None) => vec![Stack { members: members(), numbers: vec![] }],
        (None, Some((&last, others))) => {
            let mut stacks: BTreeMap<Vec<u128>, Stack> = BTreeMap::new();
            for (n, numbers) in &group {
                let key = others.iter().map(|&at| numbers[at]).collect();
                let stack = stacks.entry(key).or_insert(Stack { members: vec![], numbers: vec![] });
                stack.members.push(*n);
                stack.numbers.push(numbers[last]);
            }
            stacks.into_values().collect()
        }
    }
}

/// What is missing where numbers go up by the same step for the most part but not always: how many steps lie before each but the first, and a list
/// of the gaps for people. `None` where nothing is missing, or the numbers count no slices.
pub fn gaps(numbers: &[u128]) -> Option<(Vec<u128>, String)> {
    /// Gaps that are listed.
    const MOST: usize = 5;
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable();
    let differences: Vec<u128> = sorted.windows(2).map(|w| w[1] - w[0]).collect();
    let mut counts: BTreeMap<u128, usize> = BTreeMap::new();
    differences.iter().for_each(|d| *counts.entry(*d).or_default() += 1);
    let (&step, &usual) = counts.iter().max_by_key(|(step, n)| (**n, std::cmp::Reverse(**step)))?;
    let is_counting = step > 0 && 2 * usual > differences.len() && differences.iter().all(|d| d % step == 0 && *d > 0);
    if usual == differences.len() || !is_counting {
        return None;
    }
    let odd = || sorted.windows(2).filter(|w| w[1] - w[0] != step);
    let mut list = odd().take(MOST).map(|w| format!("{} is followed by {}", w[0], w[1])).collect::<Vec<_>>().join(", ");
    if odd().count() > MOST {
        list += &format!(" and {} more", odd().count() - MOST);
    }
    Some((differences.iter().map(|d| d / step).collect(), list))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn members(names: &[&str]) -> Vec<Vec<usize>> {
        let mut found: Vec<Vec<usize>> = stacks(names).into_iter().map(|s| s.members).collect();
        found.sort();
        found
    }

    #[test]
    fn stacks_are_told_apart_by_their_names() {
        // Fails if two stacks become one, if an overview gets among slices, or if one stack with a second number is torn apart.
        assert_eq!(members(&["a1.png", "a2.png", "b1.png", "b2.png"]), [vec![0, 1], vec![2, 3]]);
        assert_eq!(members(&["s_rec01.bmp", "s_rec02.bmp", "s_rec_spr.bmp"]), [vec![0, 1], vec![2]]);
        assert_eq!(members(&["m1_01.tif", "m1_02.tif", "m2_01.tif", "m2_02.tif"]), [vec![0, 1], vec![2, 3]]);
        assert_eq!(members(&["2020_1_of_2.tif", "2020_2_of_2.tif"]), [vec![0, 1]]);
        assert_eq!(stacks(&["s1_093012.tif", "s2_093044.tif", "s3_093119.tif"])[0].numbers, [1, 2, 3]);
        assert_eq!(stacks(&["A1.TIF", "a2.tif"]).len(), 1);
        assert_eq!(members(&["x.png", "y.png"]), [vec![0], vec![1]]);
    }

    #[test]
    fn missing_numbers_are_found() {
        // Fails if a gap goes unseen, or if every second slice, or a time, is taken for one.
        assert_eq!(gaps(&[1, 2, 3, 7, 8]), Some((vec![1, 1, 4, 1], "3 is followed by 7".into())));
        assert_eq!(gaps(&[10, 0, 20, 40]), Some((vec![1, 1, 2], "20 is followed by 40".into())));
        for whole in [&[0, 5, 10, 15][..], &[3, 2, 1], &[1], &[], &[93012, 93044, 93119, 93150], &[1, 3]] {
            assert_eq!(gaps(whole), None, "{whole:?}");
        }
    }
}
