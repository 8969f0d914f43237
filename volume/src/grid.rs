//! Where samples lie: the map between index space and the world (LPS, millimetres).

use glam::{DAffine3, DMat3, DVec3};
use thiserror::Error;

/// A position in index space: sample (i, j, k) is the point (i, j, k); the interpolant lives on [0, n−1]³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexPoint(pub DVec3);

/// A position in the world: x to the left, y to the back, z to the top of the patient (LPS), in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldPoint(pub DVec3);

/// A grid of samples, possibly anisotropic, rotated, mirrored or sheared.
///
/// ```
/// use bregma_volume::{Grid, IndexPoint};
/// use glam::{DMat3, DVec3};
///
/// let grid = Grid::new([512, 512, 300], DVec3::new(0.5, 0.5, 0.7), DVec3::new(-128.0, -128.0, 0.0), DMat3::IDENTITY)?;
/// let p = grid.world(IndexPoint(DVec3::new(256.0, 256.0, 10.0)));
/// assert_eq!(p.0, DVec3::new(0.0, 0.0, 7.0));
/// assert_eq!(grid.index(p).0, DVec3::new(256.0, 256.0, 10.0));
/// # Ok::<(), bregma_volume::GridError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    dims: [usize; 3],
    index_to_world: DAffine3,
    world_to_index: DAffine3,
}

/// Why a grid cannot be used.
#[derive(Debug, Error, PartialEq)]
pub enum GridError {
    /// A dimension is zero.
    #[error("the grid is {0}×{1}×{2} samples; every side needs at least one")]
    Empty(usize, usize, usize),
    /// More samples than memory can address.
    #[error("the grid of {0}×{1}×{2} samples is larger than this machine can address")]
    TooLarge(usize, usize, usize),
    /// A spacing that is no length.
    #[error("the spacing along axis {axis} is {mm} mm; it must be a positive number")]
    Spacing {
        /// 0, 1 or 2 for i, j or k.
        axis: usize,
        /// The spacing as given.
        mm: f64,
    },
    /// A direction matrix that cannot be inverted, or numbers that are not finite.
    #[error("the directions of the grid axes are not three independent directions")]
    Singular,
}

impl Grid {
    /// A grid of `dims` samples whose sample (i, j, k) lies at `origin + direction·(spacing ∘ (i, j, k))`.
    /// The columns of `direction` are the world directions of the i, j and k axes.
    pub fn new(dims: [usize; 3], spacing_mm: DVec3, origin_mm: DVec3, direction: DMat3) -> Result<Self, GridError> {
        for axis in 0..3 {
            let mm = spacing_mm[axis];
            if !(mm.is_finite() && mm > 0.0) {
                return Err(GridError::Spacing { axis, mm });
            }
        }
        let matrix = direction * DMat3::from_diagonal(spacing_mm);
        Self::from_affine(dims, DAffine3::from_mat3_translation(matrix, origin_mm))
    }

    /// A grid with the given map of index to world mm (as NIfTI's sform or NRRD's space directions state it).
    pub fn from_affine(dims: [usize; 3], index_to_world: DAffine3) -> Result<Self, GridError> {
        let [nx, ny, nz] = dims;
        if dims.contains(&0) {
            return Err(GridError::Empty(nx, ny, nz));
        }
        // Eight bytes a sample is the widest type any reader meets.
        let bytes = nx.checked_mul(ny).and_then(|n| n.checked_mul(nz)).and_then(|n| n.checked_mul(8));
        if bytes.is_none_or(|n| n > isize::MAX as usize) {
            return Err(GridError::TooLarge(nx, ny, nz));
        }
        let m = index_to_world.matrix3;
        let lengths = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        // The determinant over the product of the column lengths is the sine-like volume of the unit axes: 1 for a
        // rectangular grid, 0.95 for a gantry tilted by 18.5°. Below 1e-6 the axes lie in a plane for any purpose here.
        let volume = m.determinant().abs() / lengths;
        if !index_to_world.is_finite() || volume.is_nan() || volume < 1e-6 {
            return Err(GridError::Singular);
        }
        Ok(Self { dims, index_to_world, world_to_index: index_to_world.inverse() })
    }

    /// Samples along i, j and k.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// False: a grid has at least one sample.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Cells along i, j and k: one fewer than samples.
    pub fn cells(&self) -> [usize; 3] {
        self.dims.map(|n| n - 1)
    }

    /// True when some axis has a single sample, so that the interpolant has no volume.
    pub fn is_flat(&self) -> bool {
        self.dims.contains(&1)
    }

    /// Distance between neighbouring samples along i, j and k, in mm.
    pub fn spacing_mm(&self) -> DVec3 {
        let m = self.index_to_world.matrix3;
        DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length())
    }

    /// World position of sample (0, 0, 0), in mm.
    pub fn origin_mm(&self) -> DVec3 {
        self.index_to_world.translation
    }

    /// Unit world directions of the grid axes, as columns.
    pub fn direction(&self) -> DMat3 {
        let m = self.index_to_world.matrix3;
        DMat3::from_cols(m.x_axis.normalize(), m.y_axis.normalize(), m.z_axis.normalize())
    }

    /// The map of index to world mm.
    pub fn index_to_world(&self) -> DAffine3 {
        self.index_to_world
    }

    /// The map of world mm to index.
    pub fn world_to_index(&self) -> DAffine3 {
        self.world_to_index
    }

    /// World position of a point in index space.
    pub fn world(&self, p: IndexPoint) -> WorldPoint {
        WorldPoint(self.index_to_world.transform_point3(p.0))
    }

    /// Index-space position of a point in the world.
    pub fn index(&self, p: WorldPoint) -> IndexPoint {
        IndexPoint(self.world_to_index.transform_point3(p.0))
    }

    /// The same samples moved by `transform` (world to world, mm).
    pub fn moved(&self, transform: DAffine3) -> Result<Self, GridError> {
        Self::from_affine(self.dims, transform * self.index_to_world)
    }

    /// The grid of every `step`-th sample along each axis, beginning with the first.
    pub fn every(&self, step: usize) -> Self {
        let matrix = self.index_to_world.matrix3 * step as f64;
        let map = DAffine3::from_mat3_translation(matrix, self.index_to_world.translation);
        Self { dims: self.dims.map(|n| n.div_ceil(step)), index_to_world: map, world_to_index: map.inverse() }
    }

    /// The eight corners of the box that the interpolant lives on, in world mm.
    pub fn corners_mm(&self) -> [DVec3; 8] {
        let [nx, ny, nz] = self.dims.map(|n| (n - 1) as f64);
        std::array::from_fn(|c| {
            let pick = |bit: usize, n: f64| if c >> bit & 1 == 1 { n } else { 0.0 };
            self.index_to_world.transform_point3(DVec3::new(pick(0, nx), pick(1, ny), pick(2, nz)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheared_grid_maps_there_and_back() {
        // Fails if spacing, direction or shear is applied in the wrong order.
        let shear = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(0.0, -0.3173, 0.9483));
        let grid = Grid::new([5, 6, 7], DVec3::new(0.5, 0.6, 2.5), DVec3::new(1.0, 2.0, 3.0), shear).unwrap();
        let p = IndexPoint(DVec3::new(1.5, 2.25, 3.0));
        let world = grid.world(p);
        assert!((world.0 - DVec3::new(1.75, 2.0 + 1.35 - 0.3173 * 7.5, 3.0 + 0.9483 * 7.5)).length() < 1e-12);
        assert!((grid.index(world).0 - p.0).length() < 1e-12);
        assert!((grid.spacing_mm() - DVec3::new(0.5, 0.6, 2.5 * shear.z_axis.length())).length() < 1e-12);
    }

    #[test]
    fn grids_that_cannot_be_are_refused() {
        let new = |dims, spacing, direction| Grid::new(dims, spacing, DVec3::ZERO, direction);
        assert_eq!(new([0, 1, 1], DVec3::ONE, DMat3::IDENTITY), Err(GridError::Empty(0, 1, 1)));
        assert!(matches!(new([2, 2, 2], DVec3::new(1.0, 0.0, 1.0), DMat3::IDENTITY), Err(GridError::Spacing { axis: 1, .. })));
        assert!(matches!(new([2, 2, 2], DVec3::new(1.0, f64::NAN, 1.0), DMat3::IDENTITY), Err(GridError::Spacing { axis: 1, .. })));
        assert_eq!(new([2, 2, 2], DVec3::ONE, DMat3::ZERO), Err(GridError::Singular));
        let flat = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::X + DVec3::Y);
        assert_eq!(new([2, 2, 2], DVec3::ONE, flat), Err(GridError::Singular));
        assert!(matches!(new([usize::MAX, 2, 2], DVec3::ONE, DMat3::IDENTITY), Err(GridError::TooLarge(..))));
    }
}
