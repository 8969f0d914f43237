//! What of a scan was kept when it was saved: all of it, only what surfaces between two isovalues need, or samples within an error.

use std::collections::BTreeMap;
use thiserror::Error;

/// What of a scan is kept. Its metadata says it, so that every form that it is converted to does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Keep {
    /// Surfaces of isovalues from the first to the second; all where there is none.
    pub surfaces: Option<[f64; 2]>,
    /// How far values may be off, in the scan's values.
    pub error: f64,
}

/// What cannot be kept.
#[derive(Debug, Error, PartialEq)]
pub enum KeepError {
    /// No interval.
    #[error("surfaces from {0} to {1} are none; name the lower isovalue first, as in 100..400")]
    Interval(f64, f64),
    /// No error.
    #[error("an error of {0} is none; it must be 0 or more, in the scan's values")]
    Error(f64),
    /// More than there is.
    #[error(
        "the scan has only surfaces of isovalues {0}..{1}, less the error at either end; choose within these, or take the scan that it was saved from"
    )]
    Before(f64, f64),
}

const SURFACES: &str = "SurfacesKept";
const ERROR: &str = "ValuesOffBy";

impl Keep {
    /// Refuses what is no interval and no error.
    pub fn check(&self) -> Result<(), KeepError> {
        match self.surfaces {
            Some([low, high]) if !(low.is_finite() && high.is_finite() && low <= high) => Err(KeepError::Interval(low, high)),
            _ if !(self.error.is_finite() && self.error >= 0.0) => Err(KeepError::Error(self.error)),
            _ => Ok(()),
        }
    }

    /// What `metadata` says; all, where it says nothing that can be.
    pub fn noted(metadata: &BTreeMap<String, String>) -> Self {
        let surfaces = metadata.get(SURFACES).and_then(|said| {
            let (low, high) = said.split_once("..")?;
            Some([low.parse().ok()?, high.parse().ok()?])
        });
        let error = metadata.get(ERROR).and_then(|said| said.parse().ok()).unwrap_or(0.0);
        // Anyone can write metadata.
        let of_surfaces = Some(Self { surfaces, error: 0.0 }).filter(|keep| keep.check().is_ok()).unwrap_or_default();
        Some(Self { error, ..of_surfaces }).filter(|keep| keep.check().is_ok()).unwrap_or(of_surfaces)
    }

    /// The same of a scan of which no more than `before` was kept. Errors add up; and as samples that stand for others may come as much nearer, the
    /// surfaces that are left are those by the error within the interval.
    pub fn of(self, before: Self) -> Result<Self, KeepError> {
        self.check()?;
        let left = before.surfaces.map(|[low, high]| [low + self.error, high - self.error]);
        let surfaces = self.surfaces.or(left);
        if let (Some([low, high]), Some([least, most])) = (surfaces, left)
            && (low < least || high > most || low > high)
        {
            let [low, high] = before.surfaces.unwrap_or_default();
            return Err(KeepError::Before(low, high));
        }
        Ok(Self { surfaces, error: self.error + before.error })
    }

    /// Notes it in `metadata`.
    pub fn note(&self, metadata: &mut BTreeMap<String, String>) {
        metadata.extend(self.surfaces.map(|[low, high]| (SURFACES.to_owned(), format!("{low}..{high}"))));
        metadata.extend((self.error > 0.0).then(|| (ERROR.to_owned(), self.error.to_string())));
    }

    /// A sentence for each thing that is not kept.
    pub fn sentences(&self) -> Vec<String> {
        let surfaces = self.surfaces.map(|[low, high]| {
            format!("only its surfaces of isovalues {low}..{high} are those of the scan that it was saved from: elsewhere samples stand for what was left out")
        });
        let error = (self.error > 0.0).then(|| format!("its values are off by up to {}, as it was saved so", self.error));
        surfaces.into_iter().chain(error).collect()
    }

    /// Whether the surface of an isovalue was kept.
    pub fn has_surface(&self, iso: f64) -> bool {
        self.surfaces.is_none_or(|[low, high]| (low..=high).contains(&iso))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_noted_is_read_again_and_nonsense_is_nothing() {
        // Fails if an interval or an error is lost on its way, a reversed one is believed, or errors of two savings do not add up.
        let keep = Keep { surfaces: Some([-20.5, 300.0]), error: 8.0 };
        let mut metadata = BTreeMap::new();
        keep.note(&mut metadata);
        assert_eq!(Keep::noted(&metadata), keep);
        let of = |surfaces: Option<[f64; 2]>, error: f64| Keep { surfaces, error }.of(keep);
        assert_eq!(of(Some([0.0, 299.0]), 1.0), Ok(Keep { surfaces: Some([0.0, 299.0]), error: 9.0 }));
        // A sample that stands for one below −20.5 may be rounded to −19.5.
        assert_eq!(of(None, 1.0), Ok(Keep { surfaces: Some([-19.5, 299.0]), error: 9.0 }));
        for wrong in [of(Some([0.0, 400.0]), 0.0), of(Some([0.0, 299.5]), 1.0), of(Some([400.0, 500.0]), 0.0), of(None, 161.0)] {
            assert_eq!(wrong, Err(KeepError::Before(-20.5, 300.0)));
        }
        for (key, nonsense) in [(SURFACES, "9..1"), (SURFACES, "x"), (SURFACES, "NaN..1"), (ERROR, "-1"), (ERROR, "inf"), (ERROR, "")] {
            assert_eq!(Keep::noted(&[(key.to_owned(), nonsense.to_owned())].into()), Keep::default(), "{nonsense}");
        }
        assert!(keep.has_surface(300.0) && !keep.has_surface(300.1) && Keep::default().has_surface(1e9));
    }
}
