//! The solids that a picture's volumes are cut by, in one buffer, as `shaders/within.wgsl` reads them.

use super::buffers::filled_buffer;
use super::device::{Gpu, GpuError};
use super::layout::{NO_SOLID, SOLID_BOTH};
use bregma_field::Solid;
use bregma_field::solid::Side;
use std::sync::Arc;

fn number_of(side: Side) -> u8 {
    match side {
        Side::Outside => 0,
        Side::Inside => 1,
        Side::Both => SOLID_BOTH as u8,
    }
}

/// Solids on the GPU, and for each volume where its own begins: the sides of bricks, the slots of blocks, and distances.
#[derive(Debug)]
pub(super) struct Solids {
    of: Vec<Option<Arc<Solid>>>,
    pub buffer: wgpu::Buffer,
    pub places: Vec<[u32; 3]>,
}

impl Solids {
    /// Of volumes, some of which have one.
    pub fn new(gpu: &Gpu, of: Vec<Option<Arc<Solid>>>) -> Result<Self, GpuError> {
        let (mut words, mut places) = (vec![], vec![]);
        for solid in &of {
            let Some(solid) = solid else {
                places.push([NO_SOLID, 0, 0]);
                continue;
            };
            let first = words.len() as u32;
            words.extend(
                solid.sides().chunks(4).map(|some| (0..).zip(some).map(|(n, side)| u32::from(number_of(*side)) << (8 * n)).sum::<u32>()),
            );
            let slots = words.len() as u32;
            words.extend_from_slice(solid.slots());
            places.push([first, slots, words.len() as u32]);
            // Blocks have an even number of distances.
            words.extend(solid.distances().chunks_exact(2).map(|pair| u32::from(pair[0] as u16) | u32::from(pair[1] as u16) << 16));
        }
        // A buffer has at least one.
        words.push(0);
        let bytes = size_of_val(words.as_slice());
        if bytes as u64 > gpu.device.limits().max_storage_buffer_binding_size {
            return Err(GpuError::Memory { mib: bytes >> 20, adapter: gpu.info.name.clone() });
        }
        Ok(Self { of, buffer: filled_buffer(gpu, bytemuck::cast_slice(&words), wgpu::BufferUsages::STORAGE), places })
    }

    /// Whether these are of those volumes.
    pub fn are_of(&self, of: &[Option<Arc<Solid>>]) -> bool {
        let is_same = |(a, b): (&Option<Arc<Solid>>, &Option<Arc<Solid>>)| a.as_ref().map(Arc::as_ptr) == b.as_ref().map(Arc::as_ptr);
        self.of.len() == of.len() && self.of.iter().zip(of).all(is_same)
    }
}
