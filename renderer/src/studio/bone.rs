//! The surfaces that paths meet: those of the picture, found by its own walk, with its own normals.
//!
//! The twin of `shaders/bone.wgsl`.

use super::settings::StudioError;
use crate::RenderError;
use crate::cpu::brick::{FAR, Hit};
use crate::cpu::cuts::{Kept, kept};
use crate::cpu::gradient::both_gradients;
use crate::cpu::line::{Line, Part};
use crate::cpu::rim::rim;
use crate::cpu::samples::Source;
use crate::cpu::volume::Field;
use crate::lanes::{Doubles, Floats, Mask, Vecs, axes, dot};
use crate::roots::{Method, Solver};
use crate::scene::{CutFace, Normals, Scene};
use crate::skip::{CellMasks, DistanceMap, MapCache, Walked};
use bregma_field::{BRICK, IndexPoint, Surface, Volume};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DAffine3, DVec3, Mat3, Vec3};
use std::sync::Arc;

/// New rays start so far off a surface, in the finest voxel's length, along the surface's own normal: a hundred times what the walk's float32, which
/// is relative to a brick's corner, is off there, and far below what a picture shows.
const START_VOXEL: f64 = 1e-3;

/// One visible layer.
#[derive(Debug)]
pub(crate) struct Piece {
    pub surface: Surface,
    pub map: Arc<DistanceMap>,
    pub masks: Arc<CellMasks>,
    pub to_index: DAffine3,
    pub to_world: DAffine3,
    pub normal_to_world: Mat3,
    /// Linear.
    pub color: Vec3,
    /// How far behind the face of its solid normals are blended, in the solid's units.
    pub rim_units: f32,
}

/// All visible surfaces of a scene, opaque.
#[derive(Debug)]
pub(crate) struct Bone {
    pub pieces: Vec<Piece>,
    method: Method,
    pub normals: Normals,
    /// Middle and radius of a sphere around all cells that can hold a surface.
    pub middle_mm: DVec3,
    pub radius_mm: f64,
    /// How far off a surface rays start.
    pub start_mm: f64,
}

/// Whether a studio can light what a scene draws: opaque surfaces in their own colours.
pub fn can_light(scene: &Scene) -> Result<(), StudioError> {
    let shows_values = scene.cut_face != CutFace::Bone && !scene.clips.is_empty();
    let can = scene.draws_opaque() && scene.method() == Method::Solver(Solver::Exact) && !shows_values;
    if can { Ok(()) } else { Err(StudioError::Mode) }
}

impl Bone {
    /// The finest voxel's length.
    pub fn voxel_mm(&self) -> f64 {
        self.start_mm / START_VOXEL
    }
}

/// What rays meet first.
pub(super) struct Seen<S: Simd> {
    pub found: Mask<S>,
    /// Along the ray, mm.
    pub far: Floats<S>,
    /// In the world.
    pub at: [Doubles<S>; 3],
    /// Unit, of the surface itself and of its shading, both toward the viewer.
    pub geometric: Vecs<S>,
    pub shading: Vecs<S>,
    /// Linear.
    pub color: Vecs<S>,
}

/// Rays of the world: origins, and unit directions.
#[derive(Clone, Copy)]
pub(super) struct Rays<S: Simd> {
    pub origin: [Doubles<S>; 3],
    pub direction: Vecs<S>,
}

impl Bone {
    /// Of the visible layers of a scene, of whose `volumes` some may be smoothed.
    pub fn of(maps: &mut MapCache, volumes: &[Arc<Volume>], scene: &Scene) -> Result<Self, RenderError> {
        can_light(scene)?;
        let piece = |(index, surface): (usize, Surface)| {
            let (map, masks) = maps.get(&surface, &Walked::Inside);
            let to_index = surface.grid.world_to_index();
            let normals = to_index.matrix3.transpose();
            let largest = normals.to_cols_array().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            Piece {
                map,
                masks,
                to_index,
                to_world: surface.grid.index_to_world(),
                normal_to_world: (normals * (1.0 / largest)).as_mat3(),
                color: scene.layers[index].color.linear(),
                rim_units: surface.solid.as_ref().map_or(0.0, |solid| (scene.layers[index].rim_mm() / solid.unit_mm()) as f32),
                surface,
            }
        };
        let pieces: Vec<Piece> = scene.surfaces(volumes)?.into_iter().map(piece).collect();
        let finest_mm = pieces.iter().map(|p| p.surface.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
        let (low, high) = pieces.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), piece| {
            let [a, b] = piece.box_mm();
            (low.min(a), high.max(b))
        });
        let (middle_mm, radius_mm) =
            if low.cmple(high).all() { ((low + high) / 2.0, (high - low).length() / 2.0) } else { (DVec3::ZERO, 1.0) };
        let start_mm = if finest_mm.is_finite() { START_VOXEL * finest_mm } else { START_VOXEL };
        Ok(Self { pieces, method: scene.method(), normals: scene.normals, middle_mm, radius_mm: radius_mm.max(1e-3), start_mm })
    }

    /// The first surfaces along rays, of those of `asked`, nearer than `far`.
    #[inline(always)]
    pub(super) fn first<S: Simd>(&self, simd: S, rays: &Rays<S>, far: Floats<S>, asked: Mask<S>) -> Seen<S> {
        let zero = Floats::splat(simd, 0.0);
        let mut seen =
            Seen { found: Mask::splat(simd, false), far, at: rays.origin, geometric: [zero; 3], shading: [zero; 3], color: [zero; 3] };
        for piece in &self.pieces {
            let (lines, kept) = piece.lines(simd, rays);
            let part = Part { begin: kept.begin, s_min: zero, s_max: seen.far.min(kept.end) };
            let hit = piece.field().first_hits(simd, Some(self.method), &lines, &part, asked & part.s_max.simd_ge(kept.begin));
            if hit.found.any_true() {
                simd.vectorize(
                    #[inline(always)]
                    || piece.see(simd, self.normals, rays, (&lines, &kept), &hit, &mut seen),
                );
            }
        }
        seen
    }

    /// Which rays of `asked` meet a surface nearer than `far`.
    #[inline(always)]
    pub(super) fn is_between<S: Simd>(&self, simd: S, rays: &Rays<S>, far: Floats<S>, asked: Mask<S>) -> Mask<S> {
        let zero = Floats::splat(simd, 0.0);
        let mut dark = Mask::splat(simd, false);
        for piece in &self.pieces {
            let (lines, kept) = piece.lines(simd, rays);
            let part = Part { begin: kept.begin, s_min: zero, s_max: far.min(kept.end) };
            let asked = asked & !dark & part.s_max.simd_ge(kept.begin);
            if asked.any_true() {
                dark |= piece.field().first_hits(simd, Some(self.method), &lines, &part, asked).found;
            }
        }
        dark
    }
}

impl Piece {
    fn field(&self) -> Field<'_> {
        Field {
            source: Source::of(&self.surface),
            dims: self.surface.grid.dims().map(|n| n as i32),
            map: &self.map,
            masks: &self.masks,
            level: self.surface.level as f32,
            sign: self.surface.sign,
            solid: self.surface.solid.as_deref(),
        }
    }

    /// The box along the world's axes of its cells that can hold the surface; of none, one that begins behind its end.
    fn box_mm(&self) -> [DVec3; 2] {
        let [nx, ny, _] = self.map.dims();
        let mut ends = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for brick in self.map.occupied() {
            let n = brick as usize;
            let corner = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64) * BRICK as f64;
            let [first, end] = self.masks.cells(brick).map(|cell| DVec3::from(cell.map(f64::from)));
            for bits in 0..8 {
                let choose = |a: usize| if bits >> a & 1 == 1 { end[a] } else { first[a] };
                let at = self.surface.grid.world(IndexPoint(corner + DVec3::new(choose(0), choose(1), choose(2)))).0;
                ends = [ends[0].min(at), ends[1].max(at)];
            }
        }
        ends
    }

    /// Rays in its index space, and what cuts leave of them.
    #[inline(always)]
    fn lines<S: Simd>(&self, simd: S, rays: &Rays<S>) -> (Line<S>, Kept<S>) {
        let direction = axes!(a => Doubles::of(rays.direction[a]));
        let kept = kept(simd, &self.surface.region, &Line { origin: rays.origin, direction });
        let m = self.to_index.matrix3.to_cols_array_2d();
        let t = self.to_index.translation;
        let turned = |v: &[Doubles<S>; 3], a: usize| {
            v[0] * Doubles::splat(simd, m[0][a]) + v[1] * Doubles::splat(simd, m[1][a]) + v[2] * Doubles::splat(simd, m[2][a])
        };
        let origin = axes!(a => turned(&rays.origin, a) + Doubles::splat(simd, t[a]));
        (Line { origin, direction: axes!(a => turned(&direction, a)) }, kept)
    }

    /// Takes over what its hits are.
    #[inline(always)]
    fn see<S: Simd>(
        &self,
        simd: S,
        normals: Normals,
        rays: &Rays<S>,
        (lines, kept): (&Line<S>, &Kept<S>),
        hit: &Hit<S>,
        seen: &mut Seen<S>,
    ) {
        let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
        let field = self.field();
        let [own, smooth] = both_gradients(simd, field.source, field.dims, &hit.cell, &hit.local, hit.found, normals == Normals::Smooth);
        let is_surface = hit.met.is_isosurface() | hit.met.solid;
        let along = axes!(a => lines.direction[a].to_floats());
        let [own, smooth] = match field.solid {
            Some(solid) => {
                let of_face = |surface: &Vecs<S>, rim_units: f32| {
                    rim(simd, (solid, rim_units), (&hit.cell, &hit.local), surface, (&along, hit.met.solid), hit.found)
                };
                [of_face(&own, 0.0), of_face(&smooth, self.rim_units)]
            }
            None => [own, smooth],
        };
        // Against the ray on the face of a box; on a cut that cut's own; against the ray where it begins in bone.
        let in_world = |gradient: &Vecs<S>| {
            let index = axes!(a => is_surface.select(gradient[a], hit.met.face[a].select(one.copysign(-along[a]), zero)));
            let away = dot(&index, &along).simd_gt(zero);
            let index = axes!(a => away.select(-index[a], index[a]));
            let m = &self.normal_to_world;
            let world = axes!(a => m.x_axis[a] * index[0] + m.y_axis[a] * index[1] + m.z_axis[a] * index[2]);
            let length = dot(&world, &world).sqrt();
            let is_known = length.simd_gt(zero) & !hit.met.start;
            let world = axes!(a => is_known.select(world[a] / length, -rays.direction[a]));
            let is_cut = hit.met.start & kept.is_cut;
            axes!(a => is_cut.select(kept.normal[a], world[a]))
        };
        let (geometric, shading) = (in_world(&own), in_world(&smooth));
        let found = hit.found;
        let m = self.to_world.matrix3.to_cols_array_2d();
        let t = self.to_world.translation;
        let index = axes!(a => Doubles::of(hit.cell[a].to_float::<Floats<S>>()) + Doubles::of(hit.local[a]));
        for a in 0..3 {
            let [x, y, z] = [0, 1, 2].map(|b| Doubles::splat(simd, m[b][a]));
            let at = index[0] * x + index[1] * y + index[2] * z + Doubles::splat(simd, t[a]);
            seen.at[a] = at.chosen(found, seen.at[a]);
            seen.geometric[a] = found.select(geometric[a], seen.geometric[a]);
            seen.shading[a] = found.select(shading[a], seen.shading[a]);
            seen.color[a] = found.select(Floats::splat(simd, self.color[a]), seen.color[a]);
        }
        seen.far = found.select(hit.s, seen.far);
        seen.found |= found;
    }
}

/// Of a ray that meets nothing.
pub(super) const NEVER: f32 = FAR;
