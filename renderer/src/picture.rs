//! Pictures in memory.

use crate::slice::Contour;
use rayon::prelude::*;

impl Picture {
    /// Of nothing but `background` (sRGB with straight alpha).
    pub(crate) fn of(background: [u8; 4], width: u32, height: u32) -> Self {
        let count = width as usize * height as usize;
        let (rgba, depth_mm) = (filled(background, count), filled(f32::NAN, count));
        Self { width, height, rgba, depth_mm, volume_id: vec![0; count], values: vec![], contours: vec![] }
    }
}

impl Picture {
    /// Of a size, in the memory of `spare` if that is of the same; its pixels are yet to be filled. New memory is not touched here: by whom it first is
    /// fetches it, as long as that takes.
    pub(crate) fn blank(spare: Option<Self>, [width, height]: [u32; 2], has_values: bool) -> Self {
        let count = width as usize * height as usize;
        let values = if has_values { count } else { 0 };
        let fits = |spare: &Self| spare.rgba.len() == count && spare.values.len() == values;
        match spare.filter(fits) {
            Some(spare) => Self { width, height, contours: vec![], ..spare },
            None => Self {
                width,
                height,
                rgba: vec![[0; 4]; count],
                depth_mm: vec![0.0; count],
                volume_id: vec![0; count],
                values: vec![0.0; values],
                contours: vec![],
            },
        }
    }
}

/// As many of the same, by all cores: memory that is new takes as long to come as a picture to be drawn.
pub(crate) fn filled<T: Copy + Send>(value: T, count: usize) -> Vec<T> {
    rayon::iter::repeat_n(value, count).collect()
}

/// Pictures number volumes by a byte, 0 standing for none.
pub const MOST_VOLUMES: usize = 255;

/// A picture in memory, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// sRGB with straight alpha.
    pub rgba: Vec<[u8; 4]>,
    /// Distance along the unit pixel ray to the first surface drawn, mm; NaN where none.
    pub depth_mm: Vec<f32>,
    /// 1-based layer of that surface; 0 where none.
    pub volume_id: Vec<u8>,
    /// What [`Mode::Max`](crate::Mode::Max), [`Mode::Mean`](crate::Mode::Mean) or [`Mode::Xray`](crate::Mode::Xray) computes, of the volumes together, or [`Mode::Slice`](crate::Mode::Slice) of the first; NaN where a ray
    /// meets none. Empty in other modes.
    pub values: Vec<f32>,
    /// The contours of [`Mode::Slice`](crate::Mode::Slice), of each layer that is drawn; none in other modes.
    pub contours: Vec<Contour>,
}
