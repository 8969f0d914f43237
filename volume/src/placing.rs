//! Where a scan's samples lie: as its file states it, and what the person corrected of that.

use crate::{Grid, GridError, IndexPoint, Turn};
use glam::{DAffine3, DMat3, DVec3};

/// What a person corrects of where a scan's samples lie. No sample moves in the file; only the grid does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// How far samples are apart, mm, instead of what the file states, or where it states nothing. The first sample and all directions stay.
    pub spacing_mm: Option<DVec3>,
    /// How the scan is turned about its middle.
    pub turn: Turn,
}

/// Where a scan's samples lie, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Placing {
    /// As the file states it, of all its samples.
    stated: Grid,
    states_spacing: bool,
    /// Only every step-th sample is kept.
    step: usize,
    correction: Correction,
    /// What follows.
    grid: Grid,
}

/// Spacings nearer to each other than this part are the same: files round them to seven digits.
const SAME_SPACING: f64 = 1e-6;

impl Placing {
    /// As the file states it; `states_spacing` is whether it says how far samples are apart.
    pub fn new(stated: Grid, states_spacing: bool, step: usize) -> Self {
        Self { grid: stated.every(step), stated, states_spacing, step, correction: Correction::default() }
    }

    /// The same with another correction in the place of this one.
    pub fn corrected(&self, correction: Correction) -> Result<Self, GridError> {
        let stated = &self.stated;
        let is_same = |mm: &DVec3| self.states_spacing && ((*mm / stated.spacing_mm()) - DVec3::ONE).abs().max_element() < SAME_SPACING;
        let correction = Correction { spacing_mm: correction.spacing_mm.filter(|mm| !is_same(mm)), ..correction };
        let spaced = match correction.spacing_mm {
            None => stated.clone(),
            Some(mm) => Grid::new(stated.dims(), mm, stated.origin_mm(), stated.direction())?,
        };
        let turned = if correction.turn.is_none() { spaced } else { spaced.moved(about_middle(&spaced, correction.turn.matrix()))? };
        Ok(Self { grid: turned.every(self.step), correction, ..self.clone() })
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Where all samples of the file lie by what it states, or is assumed where it does not.
    pub fn stated(&self) -> &Grid {
        &self.stated
    }

    /// How far all samples of the file are apart, mm, where one is kept of so many.
    pub fn spacing_mm(&self) -> DVec3 {
        self.grid.spacing_mm() / self.step as f64
    }

    /// One of so many samples is kept along each axis.
    pub fn step(&self) -> usize {
        self.step
    }

    /// What was corrected.
    pub fn correction(&self) -> Correction {
        self.correction
    }

    /// What the file states of the spacing, mm, where another was put in its place.
    pub fn overridden_mm(&self) -> Option<DVec3> {
        self.correction.spacing_mm.and(self.states_spacing.then(|| self.stated.spacing_mm()))
    }

    /// Whether the file, or the person, says how far samples are apart.
    pub fn spacing_is_stated(&self) -> bool {
        self.states_spacing || self.correction.spacing_mm.is_some()
    }

    /// What was corrected, each a sentence.
    pub fn notes(&self) -> Vec<String> {
        let Correction { turn, .. } = self.correction;
        let spacing = self.overridden_mm().map(|stated| {
            let [stated, taken] = [stated, self.spacing_mm()].map(lengths);
            format!("its file states that samples are {stated} mm apart; {taken} mm is taken instead, as was asked for")
        });
        let what = if turn.is_mirror() { "it is a mirror image of what its file states" } else { "it is turned" };
        let turned = format!("{what}: what its file calls left, posterior, superior is {} ({})", turn.words(), turn.letters());
        spacing.into_iter().chain((!turn.is_none()).then_some(turned)).collect()
    }

    /// `warnings` of a file, less those that are answered by what was corrected, and what was.
    pub fn warnings(&self, warnings: &[String]) -> Vec<String> {
        let is_open = |warning: &&String| self.correction.spacing_mm.is_none() || !warning.contains("--spacing");
        warnings.iter().filter(is_open).cloned().chain(self.notes()).collect()
    }
}

/// The turn about the middle of a grid.
fn about_middle(grid: &Grid, turn: DMat3) -> DAffine3 {
    let middle = grid.world(IndexPoint(0.5 * DVec3::from(grid.dims().map(|n| n as f64 - 1.0)))).0;
    DAffine3::from_mat3_translation(turn, middle - turn * middle)
}

/// The name of a scan of which every step-th sample is kept.
pub(crate) fn labelled(name: &str, step: usize) -> String {
    if step == 1 { name.to_owned() } else { format!("{name} (every {})", nth_sample(step)) }
}

/// `2nd sample`, `4th sample`.
pub(crate) fn nth_sample(step: usize) -> String {
    format!("{step}{} sample", if step == 2 { "nd" } else { "th" })
}

/// Three lengths, mm: to the nanometre, without zeros at their ends.
fn lengths(mm: DVec3) -> String {
    let short = |mm: f64| format!("{mm:.6}").trim_end_matches('0').trim_end_matches('.').to_owned();
    mm.to_array().map(short).join(" × ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placing() -> Placing {
        let shear = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(0.0, -0.3, 0.9));
        Placing::new(Grid::new([5, 6, 7], DVec3::new(0.5, 0.6, 2.5), DVec3::new(1.0, 2.0, 3.0), shear).unwrap(), true, 1)
    }

    #[test]
    fn a_turn_leaves_the_middle_and_every_distance() {
        // Fails if a scan is turned about something else than its middle, or moves, or if a turn changes a length; or if no turn changes a bit.
        let stated = placing();
        let middle = IndexPoint(DVec3::new(2.0, 2.5, 3.0));
        for turn in Turn::all() {
            let turned = stated.corrected(Correction { turn, ..Correction::default() }).unwrap();
            assert!((turned.grid().world(middle).0 - stated.grid().world(middle).0).length() < 1e-12, "{turn}");
            assert!((turned.grid().spacing_mm() - stated.grid().spacing_mm()).length() < 1e-12, "{turn}");
            let corner = |p: &Placing| p.grid().world(IndexPoint(DVec3::ZERO)).0 - p.grid().world(middle).0;
            assert!((corner(&turned) - turn.matrix() * corner(&stated)).length() < 1e-12, "{turn}");
            assert_eq!(turned.grid().index_to_world().matrix3.determinant() < 0.0, turn.is_mirror(), "{turn}");
            assert_eq!(turned.corrected(Correction::default()).unwrap(), stated);
        }
    }

    #[test]
    fn a_spacing_that_takes_the_place_of_another_is_told_with_it() {
        // Fails if a stated spacing is overridden in silence, if an equal one counts as another, or if a preview is told at its own spacing.
        let told = |placing: &Placing, mm: [f64; 3]| {
            let placed = placing.corrected(Correction { spacing_mm: Some(mm.into()), ..Correction::default() }).unwrap();
            (placed.grid().spacing_mm(), placed.notes(), placed.overridden_mm())
        };
        let stated = placing();
        let z = 2.5 * 0.9_f64.hypot(0.3);
        let (mm, notes, overridden) = told(&stated, [0.5, 0.6, 2.0]);
        assert!((mm - DVec3::new(0.5, 0.6, 2.0)).length() < 1e-12 && overridden.unwrap().z == stated.grid().spacing_mm().z);
        assert!(
            notes[0].starts_with("its file states that samples are 0.5 × 0.6 × 2.3717") && notes[0].contains("0.5 × 0.6 × 2 mm is taken")
        );
        let same = told(&stated, [0.5, 0.6, z * (1.0 + 1e-8)]);
        assert!(same.1.is_empty() && same.2.is_none());
        let half = Placing::new(stated.stated.clone(), true, 2);
        let (mm, notes, _) = told(&half, [0.25, 0.3, 1.0]);
        assert!((mm - DVec3::new(0.5, 0.6, 2.0)).length() < 1e-12 && notes[0].contains("0.25 × 0.3 × 1 mm is taken"), "{notes:?}");
        let silent = Placing::new(stated.stated.clone(), false, 1);
        let (mm, notes, overridden) = told(&silent, [0.5, 0.6, 2.0]);
        assert!((mm.z - 2.0).abs() < 1e-12 && notes.is_empty() && overridden.is_none());
        assert!(stated.corrected(Correction { spacing_mm: Some(DVec3::ZERO), ..Correction::default() }).is_err());
    }
}
