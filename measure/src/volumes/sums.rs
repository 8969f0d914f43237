//! What is added up over the cells of a solid: its volume, and integrals over its surface.

use glam::DVec3;
use std::ops::AddAssign;

/// Integrals over a surface, or the part of one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Skin {
    /// ∮ dA, mm².
    pub area_mm2: f64,
    /// ∮ dA/|∇f|: how the volume falls per sample unit that the level rises, mm³.
    pub per_level: f64,
    /// ∮ dA/|∇f|²: what noise acts through, mm⁴ per squared sample unit.
    pub per_noise: f64,
    /// ½∮ (κ₁ + κ₂) dA: how the volume falls per mm² of the variance of blur, by the surface's curvature; mm.
    pub per_blur: f64,
    /// How it has fallen by what linear interpolation between samples does as blur does, mm³.
    pub by_interpolation: f64,
    /// ∮ n dA, mm²: how the volume grows where the solid alone is moved, per mm.
    pub pull_mm2: DVec3,
    /// ∮ x × n dA, mm³.
    pub moment_mm3: DVec3,
}

impl Skin {
    /// All of it but a part.
    pub fn without(self, part: Self) -> Self {
        Self {
            area_mm2: (self.area_mm2 - part.area_mm2).max(0.0),
            per_level: (self.per_level - part.per_level).max(0.0),
            per_noise: (self.per_noise - part.per_noise).max(0.0),
            per_blur: self.per_blur - part.per_blur,
            by_interpolation: self.by_interpolation - part.by_interpolation,
            pull_mm2: self.pull_mm2 - part.pull_mm2,
            moment_mm3: self.moment_mm3 - part.moment_mm3,
        }
    }
}

impl AddAssign for Skin {
    fn add_assign(&mut self, other: Self) {
        self.area_mm2 += other.area_mm2;
        self.per_level += other.per_level;
        self.per_noise += other.per_noise;
        self.per_blur += other.per_blur;
        self.by_interpolation += other.by_interpolation;
        self.pull_mm2 += other.pull_mm2;
        self.moment_mm3 += other.moment_mm3;
    }
}

/// A volume added up by quadrature, and how far a coarser rule is off from it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Added {
    /// The volume, mm³.
    pub volume_mm3: f64,
    /// How much larger it is by the coarser rule.
    off_mm3: f64,
    /// The sum of the squares of that over cells.
    off_squared: f64,
}

impl Added {
    /// Adds what a cell has, as a part of itself by the finer and the coarser rule.
    pub fn cell(&mut self, fine: f64, coarse: f64) {
        self.volume_mm3 += fine;
        self.off_mm3 += coarse - fine;
        self.off_squared += (coarse - fine).powi(2);
    }

    /// From cells to mm³.
    pub fn scaled(self, cell_mm3: f64) -> Self {
        Self {
            volume_mm3: self.volume_mm3 * cell_mm3,
            off_mm3: self.off_mm3 * cell_mm3,
            off_squared: self.off_squared * cell_mm3 * cell_mm3,
        }
    }

    /// How far it may be off: as far as the coarser rule is from it, but no less than cells that are off each for itself come to in 95 of 100
    /// cases. The finer rule is nearer to the truth than that.
    pub fn error_mm3(&self) -> f64 {
        self.off_mm3.abs().max(1.96 * self.off_squared.sqrt())
    }
}

impl AddAssign for Added {
    fn add_assign(&mut self, other: Self) {
        self.volume_mm3 += other.volume_mm3;
        self.off_mm3 += other.off_mm3;
        self.off_squared += other.off_squared;
    }
}

/// What one pass over the cells of a solid finds.
#[derive(Clone, Debug, Default)]
pub struct Sums {
    /// Its volume.
    pub own: Added,
    /// The volume of it that is also in the other.
    pub shared: Added,
    /// The volume of it that is not.
    pub alone: Added,
    /// Its surface.
    pub skin: Skin,
    /// The part of its surface that lies in the other.
    pub shared_skin: Skin,
    /// Points of its surface with outward normals, one for each brick that it passes.
    pub points: Vec<(DVec3, DVec3)>,
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.own += other.own;
        self.shared += other.shared;
        self.alone += other.alone;
        self.skin += other.skin;
        self.shared_skin += other.shared_skin;
        self.points.extend(other.points);
    }
}
