//! What some slices of a series do not state, though the others do, and alike: a scale or a spacing that an export lost.

/// Fills in what most of `stated` agree in where it is not stated; how often.
pub fn fill_in<T: Copy + PartialEq>(stated: &mut [Option<T>]) -> usize {
    let Some(first) = stated.iter().find_map(|value| *value) else { return 0 };
    let missing = stated.iter().filter(|value| value.is_none()).count();
    if 2 * missing >= stated.len() || stated.iter().flatten().any(|value| *value != first) {
        return 0;
    }
    stated.iter_mut().for_each(|value| *value = Some(first));
    missing
}

/// The sentence about `count` slices that do not state `what`, which is filled in.
pub fn warning(count: usize, what: &str) -> Option<String> {
    let verb = if count == 1 { "does" } else { "do" };
    (count > 0).then(|| format!("{count} of its slices {verb} not state {what}; it is taken as that of the others"))
}

#[cfg(test)]
mod tests {
    use super::fill_in;

    #[test]
    fn only_what_most_agree_in_is_filled_in() {
        // Fails if what is not stated is taken from slices that differ, or from a few that state it.
        let filled = |mut stated: Vec<Option<i32>>| (fill_in(&mut stated), stated);
        assert_eq!(filled(vec![Some(1), None, Some(1)]), (1, vec![Some(1); 3]));
        assert_eq!(filled(vec![Some(1), None, Some(2)]), (0, vec![Some(1), None, Some(2)]));
        assert_eq!(filled(vec![Some(1), None]), (0, vec![Some(1), None]));
        assert_eq!(filled(vec![None, None]), (0, vec![None, None]));
    }
}
