//! The CPU renderer: the same algorithm as the GPU's, on all cores and for sixteen rays at once.

mod cells;
mod cuts;
pub(crate) mod dvr;
mod fetch;
pub(crate) mod gauss;
mod march;
mod pieces;
pub(crate) mod project;
pub(crate) mod segments;
pub(crate) mod shade;
pub(crate) mod shadows;
pub(crate) mod shells;
mod split;
mod steps;
pub(crate) mod walk;

use crate::camera::PixelAffine;
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, Vecs, axes, dot, numbers};
use crate::modes::{Gather, RayValue};
use crate::roots::{Method, Solver, spline, trilinear};
use crate::scene::{Integrator, Normals, Picture, Scene};
use crate::skip::{BLOCK, MapCache};
use crate::tone::colored;
use crate::{Backend, InstructionSet, RenderError, Renderer, Split};
use bregma_field::Volume;
use cuts::{Kept, kept};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use fetch::{Around, Source};
use glam::{Vec3, Vec4};
use march::{lines_of, march, world_lines};
use rayon::prelude::*;
use shade::{Drawn, color_in, encode, face_color, grey, nearest, phong};
use shadows::shadowed;
use shells::Gathered;
use std::mem::discriminant;
use std::sync::Arc;
use walk::{FAR, Field, Hits, Lines, Part};

/// Draws on the CPU. Keeps what stays valid between frames: the maps of the surfaces drawn last.
#[derive(Debug)]
pub struct CpuRenderer {
    maps: MapCache,
    level: Level,
}

impl Default for CpuRenderer {
    fn default() -> Self {
        Self::with_instructions(Level::new())
    }
}

impl CpuRenderer {
    /// A renderer that uses a set of vector instructions, one of [`CpuRenderer::instruction_sets`].
    pub fn with_instructions(level: InstructionSet) -> Self {
        Self { maps: MapCache::new(level), level }
    }

    /// The sets of vector instructions that this machine has, the best one first.
    pub fn instruction_sets() -> Vec<InstructionSet> {
        let best = Level::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        let lesser = [best.as_avx2().map(Level::Avx2), best.as_sse4_2().map(Level::Sse4_2), best.as_sse2().map(Level::Sse2)];
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        let lesser: [Option<Level>; 0] = [];
        let mut sets = vec![best];
        sets.extend(lesser.into_iter().flatten().filter(|set| discriminant(set) != discriminant(&best)));
        sets
    }
}

/// The name of a set of vector instructions, without what its token says beside it.
fn name_of(level: Level) -> String {
    format!("{level:?}").chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>().to_lowercase()
}

impl Renderer for CpuRenderer {
    fn name(&self) -> String {
        format!("cpu, {} threads, {}", rayon::current_num_threads(), name_of(self.level))
    }

    fn backend(&self) -> Backend {
        Backend::Cpu
    }

    fn has(&self, solver: Solver) -> bool {
        solver.on_cpu()
    }

    fn render(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        draw(self.level, &frame, scene, width, height)
    }

    fn bytes(&self) -> usize {
        self.maps.bytes()
    }

    fn split(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        split::split(self.level, &frame, scene, width, height)
    }
}

/// Draws band by band, of one row of blocks each, and in a band block by block: rays of one block touch the same bricks.
fn draw(level: Level, frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
    let goes_on = match scene.mode.gather() {
        Gather::Number(of) => return Ok(draw_projection(level, frame, scene, of, [width, height])),
        Gather::Crossings | Gather::Density => true,
        Gather::Nearest | Gather::FirstOfEach => false,
    };
    if !goes_on && scene.method() == Method::Solver(Solver::Filter) {
        return Err(RenderError::NeedsGpu(scene.solver));
    }
    let mut picture = Picture::of(encode(Vec4::ZERO, frame.background), width, height);
    let band = BLOCK as usize * width as usize;
    let pixels = (picture.rgba.par_chunks_mut(band), picture.depth_mm.par_chunks_mut(band), picture.volume_id.par_chunks_mut(band));
    pixels.into_par_iter().enumerate().for_each(|(row, (rgba, depth_mm, volume_id))| {
        let band = Band { width, y0: row as u32 * BLOCK, rgba, depth_mm, volume_id };
        if goes_on {
            dispatch!(level, simd => draw_through(simd, frame, scene, band));
        } else {
            dispatch!(level, simd => draw_band(simd, frame, scene, band));
        }
    });
    Ok(picture)
}

/// Draws the maximum, mean or integral along each ray.
fn draw_projection(level: Level, frame: &Frame, scene: &Scene, of: RayValue, [width, height]: [u32; 2]) -> Picture {
    let count = frame.layers.len();
    let mut gathered = vec![[f32::NAN; 2]; width as usize * height as usize * count];
    let band = BLOCK as usize * width as usize * count;
    gathered.par_chunks_mut(band.max(1)).enumerate().for_each(|(row, gathered)| {
        let y0 = row as u32 * BLOCK;
        dispatch!(level, simd => project_band(simd, frame, scene, of, [width, y0], gathered));
    });
    colored(frame, scene, of, [width, height], &gathered)
}

#[inline(always)]
fn project_band<S: Simd>(simd: S, frame: &Frame, scene: &Scene, of: RayValue, [width, y0]: [u32; 2], gathered: &mut [[f32; 2]]) {
    let count = frame.layers.len();
    let height = (gathered.len() / count) as u32 / width;
    for packet in packets(width, height) {
        let pixels = packet.pixels(simd, y0);
        for (n, layer) in frame.layers.iter().enumerate() {
            let [s_min, s_max] = layer.spans.at(packet.x0, y0);
            if s_min > s_max {
                continue;
            }
            let field = field_of(layer);
            let lines = lines_of(simd, layer, &pixels);
            let kept = kept(simd, &layer.surface.region, &world_lines(simd, frame, &pixels));
            let part = Part { begin: kept.begin, s_min: Floats::splat(simd, s_min), s_max: Floats::splat(simd, s_max).min(kept.end) };
            let of = simd.vectorize(
                #[inline(always)]
                || project::project(simd, (of, scene.of_gradient), layer, &field, &lines, &part, pixels.inside),
            );
            for lane in numbers(of.found) {
                gathered[packet.index(lane, width) * count + n] = [of.value[lane], of.depth[lane]];
            }
        }
    }
}

/// A row of blocks of the picture.
struct Band<'a> {
    width: u32,
    y0: u32,
    rgba: &'a mut [[u8; 4]],
    depth_mm: &'a mut [f32],
    volume_id: &'a mut [u8],
}

/// Draws what goes on behind the first surface: direct volume rendering, and transparent surfaces.
#[inline(always)]
fn draw_through<S: Simd>(simd: S, frame: &Frame, scene: &Scene, band: Band<'_>) {
    let Band { width, y0, rgba, depth_mm, volume_id } = band;
    let height = rgba.len() as u32 / width;
    for packet in packets(width, height) {
        if frame.layers.iter().all(|layer| is_empty(layer.spans.at(packet.x0, y0))) {
            continue;
        }
        let pixels = packet.pixels(simd, y0);
        let view = View::of(simd, frame, scene, &pixels);
        let gathered = simd.vectorize(
            #[inline(always)]
            || gather(simd, &packet, &pixels, &view, y0),
        );
        let depth = ((Doubles::splat(simd, frame.base_mm) + Doubles::of(gathered.s)) * view.length).to_floats();
        for lane in numbers(pixels.inside & gathered.color[3].simd_gt(0.0)) {
            let at = packet.index(lane, width);
            let color = Vec4::from_array(gathered.color.map(|part| part[lane]));
            rgba[at] = encode(color, frame.background);
            if gathered.id[lane] > 0.0 {
                depth_mm[at] = depth[lane];
                volume_id[at] = gathered.id[lane] as u8;
            }
        }
    }
}

fn is_empty([s_min, s_max]: [f32; 2]) -> bool {
    s_min > s_max
}

/// What a packet's rays gather on their whole way.
#[inline(always)]
fn gather<S: Simd>(simd: S, packet: &Packet, pixels: &Pixels<S>, view: &View<'_, S>, y0: u32) -> Gathered<S> {
    let View { frame, scene, .. } = *view;
    let lines: Vec<Lines<S>> = frame.layers.iter().map(|layer| lines_of(simd, layer, pixels)).collect();
    let faces = faces(simd, view, &lines);
    let face = nearest(simd, &faces, Floats::splat(simd, 0.0));
    let until = face.found.select(face.s, Floats::splat(simd, FAR));
    let block = [packet.x0, y0];
    let mut all = Gathered::nothing(simd);
    let enough = if scene.mode.gather() == Gather::Crossings {
        march(
            simd,
            frame,
            pixels,
            block,
            &lines,
            until,
            #[inline(always)]
            |travellers, stretch| shells::gather(simd, view, travellers, stretch, &mut all),
        );
        shells::ENOUGH
    } else if let Integrator::Steps { jitter, .. } = scene.integrator {
        let length = frame.step_mm / view.mm_per_depth;
        // Without jitter in the middle of the first step.
        let start = if jitter { pixels.noise(simd) } else { Floats::splat(simd, 0.5) };
        let mut steps = dvr::Steps { length, first: start * length, next: Floats::splat(simd, 0.0) };
        march(
            simd,
            frame,
            pixels,
            block,
            &lines,
            until,
            #[inline(always)]
            |travellers, stretch| dvr::gather_steps(simd, view, travellers, stretch, &mut steps, &mut all),
        );
        dvr::ENOUGH_IN_STEPS
    } else {
        march(
            simd,
            frame,
            pixels,
            block,
            &lines,
            until,
            #[inline(always)]
            |travellers, stretch| dvr::gather_exactly(simd, view, travellers, stretch, &mut all),
        );
        dvr::ENOUGH_EXACTLY
    };
    let mut all = all.filled(enough);
    if face.found.any_true() {
        let mut color = [Floats::splat(simd, 0.0); 3];
        paint_faces(simd, frame, scene, &faces, &face, &mut color);
        all.put_face(simd, &color, &face);
    }
    all
}

/// The faces of cuts that show values: of all volumes, of which those are found that a transfer function or a surface makes visible there.
#[inline(always)]
fn faces<S: Simd>(simd: S, view: &View<'_, S>, lines: &[Lines<S>]) -> Vec<Drawn<S>> {
    let View { frame, scene, pixels, .. } = *view;
    let mut faces = vec![];
    for (layer, lines) in frame.layers.iter().zip(lines).filter(|(layer, _)| layer.shows_faces) {
        let field = field_of(layer);
        let kept = kept(simd, &layer.surface.region, &world_lines(simd, frame, pixels));
        let face = face_of(simd, scene, layer, &field, lines, &kept, pixels.inside);
        let zero = Floats::splat(simd, 0.0);
        faces.push(Drawn {
            found: face.is & face.value.simd_ge(zero),
            s: kept.begin,
            normal: [zero; 3],
            color: axes!(a => Floats::splat(simd, layer.color[a])),
            opacity: zero,
            id: Floats::splat(simd, (layer.index + 1) as f32),
            is_face: face.is,
            brightness: face.brightness(layer),
        });
    }
    faces
}

/// How a packet's pixels look into the world.
struct View<'a, S: Simd> {
    frame: &'a Frame,
    scene: &'a Scene,
    pixels: &'a Pixels<S>,
    /// Unit.
    direction: Vecs<S>,
    /// Length of a ray for each mm of depth.
    length: Doubles<S>,
    mm_per_depth: Floats<S>,
}

impl<'a, S: Simd> View<'a, S> {
    #[inline(always)]
    fn of(simd: S, frame: &'a Frame, scene: &'a Scene, pixels: &'a Pixels<S>) -> Self {
        let world = pixels.at(simd, &frame.world_rays.direction);
        let length = (world[0] * world[0] + world[1] * world[1] + world[2] * world[2]).sqrt();
        Self { frame, scene, pixels, direction: normalized(&axes!(a => world[a].to_floats())), length, mm_per_depth: length.to_floats() }
    }

    /// The colours of what has a colour (linear) and a normal at depth s, where a share of the light comes.
    #[inline(always)]
    fn lit(&self, simd: S, color: &Vecs<S>, normal: &Vecs<S>, share: Floats<S>, s: Floats<S>) -> Vecs<S> {
        simd.vectorize(
            #[inline(always)]
            || {
                let normal = self.known(simd, normal);
                let toward = axes!(a => Floats::splat(simd, self.frame.toward_light[a]));
                let color = phong(simd, &self.scene.light, color, &normal, &self.direction, &toward, share);
                cued(simd, self.frame, &color, s)
            },
        )
    }

    /// Normals, where there are any; elsewhere what is seen is seen from the front.
    #[inline(always)]
    fn known(&self, simd: S, normal: &Vecs<S>) -> Vecs<S> {
        let unknown = dot(normal, normal).simd_eq(Floats::splat(simd, 0.0));
        axes!(a => unknown.select(-self.direction[a], normal[a]))
    }
}

/// Colours at depth s on their way to the background's.
#[inline(always)]
fn cued<S: Simd>(simd: S, frame: &Frame, color: &Vecs<S>, s: Floats<S>) -> Vecs<S> {
    if frame.cue_per_mm == 0.0 {
        return *color;
    }
    let share = (s * frame.cue_per_mm).max(0.0).min(1.0);
    axes!(a => color[a] * (1.0 - share) + Floats::splat(simd, frame.background[a]) * share)
}

#[inline(always)]
fn draw_band<S: Simd>(simd: S, frame: &Frame, scene: &Scene, band: Band<'_>) {
    let Band { width, y0, rgba, depth_mm, volume_id } = band;
    let height = rgba.len() as u32 / width;
    let mut hits = vec![];
    for packet in packets(width, height) {
        let pixels = packet.pixels(simd, y0);
        hits.clear();
        for layer in &frame.layers {
            hits.extend(trace(simd, frame, scene, layer, layer.spans.at(packet.x0, y0), &pixels, &hits));
        }
        let first = nearest(simd, &hits, Floats::splat(simd, 0.0));
        if !first.found.any_true() {
            continue;
        }
        let view = View::of(simd, frame, scene, &pixels);
        let mut color = light(simd, &view, &first);
        paint_faces(simd, frame, scene, &hits, &first, &mut color);
        if scene.mode.gather() == Gather::FirstOfEach {
            let second = nearest(simd, &hits, first.id);
            let mut behind = light(simd, &view, &second);
            paint_faces(simd, frame, scene, &hits, &second, &mut behind);
            let opacity = second.found.select(first.opacity, Floats::splat(simd, 1.0));
            color = axes!(a => color[a] * opacity + behind[a] * (1.0 - opacity));
        }
        let depth = ((Doubles::splat(simd, frame.base_mm) + Doubles::of(first.s)) * view.length).to_floats();
        for lane in numbers(first.found) {
            let at = packet.index(lane, width);
            let color = Vec3::from_array(axes!(a => color[a][lane]));
            rgba[at] = encode(color.extend(1.0), frame.background);
            depth_mm[at] = depth[lane];
            volume_id[at] = first.id[lane] as u8;
        }
    }
}

/// Pixels across and down a packet.
const SIDE: u32 = 4;
const _: () = assert!((SIDE * SIDE) as usize == LANES);

/// Sixteen pixels of a band that lie together; some may lie outside.
#[derive(Clone, Copy)]
struct Packet {
    x0: u32,
    /// In the band.
    y0: u32,
    width: u32,
    height: u32,
}

/// The packets of a band, block by block.
fn packets(width: u32, height: u32) -> impl Iterator<Item = Packet> {
    let block = |x: u32| (0..BLOCK * BLOCK / LANES as u32).map(move |n| [x + n % 2 * SIDE, n / 2 * SIDE]);
    let corners = (0..width).step_by(BLOCK as usize).flat_map(block).filter(move |[x, y]| *x < width && *y < height);
    corners.map(move |[x0, y0]| Packet { x0, y0, width: SIDE.min(width - x0), height: SIDE.min(height - y0) })
}

impl Packet {
    /// Its pixels, where the band begins at row `y0` of the picture.
    #[inline(always)]
    fn pixels<S: Simd>(&self, simd: S, y0: u32) -> Pixels<S> {
        let (mut x, mut y, mut bits) = ([0.0; LANES], [0.0; LANES], 0);
        for lane in 0..LANES as u32 {
            let [dx, dy] = [lane % SIDE, lane / SIDE];
            (x[lane as usize], y[lane as usize]) = ((self.x0 + dx) as f32, (y0 + self.y0 + dy) as f32);
            bits |= u64::from(dx < self.width && dy < self.height) << lane;
        }
        let doubles = |v| Doubles::of(Floats::load_array(simd, v));
        Pixels { x: doubles(x), y: doubles(y), inside: Mask::from_bitmask(simd, bits) }
    }

    /// The pixel of a lane in the band.
    fn index(&self, lane: usize, width: u32) -> usize {
        let lane = lane as u32;
        ((self.y0 + lane / SIDE) * width + self.x0 + lane % SIDE) as usize
    }
}

/// The pixels of a packet.
struct Pixels<S: Simd> {
    /// Columns and rows of the picture.
    x: Doubles<S>,
    y: Doubles<S>,
    /// Which lie in the picture.
    inside: Mask<S>,
}

/// The factors and the sum of a permuted congruential generator (O'Neill 2014, PCG RXS M XS 32).
pub(crate) const PCG: [u32; 3] = [747_796_405, 2_891_336_453, 277_803_737];

/// A number from 0 to 1 that looks like chance, for each pixel the same in every frame (O'Neill 2014, PCG).
fn noise_at(x: u32, y: u32) -> f32 {
    let state = (y << 16 | x).wrapping_mul(PCG[0]).wrapping_add(PCG[1]);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(PCG[2]);
    // 24 bits, which float32 holds.
    ((word >> 22 ^ word) >> 8) as f32 / 16_777_216.0
}

impl<S: Simd> Pixels<S> {
    /// A number from 0 to 1 for each that looks like chance.
    #[inline(always)]
    fn noise(&self, simd: S) -> Floats<S> {
        let (x, y) = (self.x.to_floats().to_array(), self.y.to_floats().to_array());
        Floats::load_array(simd, std::array::from_fn(|lane| noise_at(x[lane] as u32, y[lane] as u32)))
    }

    /// What moves with the pixel, at each.
    #[inline(always)]
    fn at(&self, simd: S, of: &PixelAffine) -> [Doubles<S>; 3] {
        let splat = |v| Doubles::splat(simd, v);
        axes!(a => splat(of.base[a]) + self.x * splat(of.per_x[a]) + self.y * splat(of.per_y[a]))
    }
}

/// The hits of one layer in a packet, of those that are nearer than `hits` where only the nearest is drawn.
#[inline(always)]
fn trace<S: Simd>(
    simd: S,
    frame: &Frame,
    scene: &Scene,
    layer: &FrameLayer,
    [s_min, s_max]: [f32; 2],
    pixels: &Pixels<S>,
    hits: &[Drawn<S>],
) -> Option<Drawn<S>> {
    if s_min > s_max {
        return None;
    }
    let field = field_of(layer);
    let lines = lines_of(simd, layer, pixels);
    let kept = kept(simd, &layer.surface.region, &world_lines(simd, frame, pixels));
    let splat = |v| Floats::splat(simd, v);
    let id = splat((layer.index + 1) as f32);
    let face = face_of(simd, scene, layer, &field, &lines, &kept, pixels.inside);
    let mut s_far = splat(s_max).min(kept.end);
    if frame.only_nearest {
        // What lies behind an opaque hit is not asked for.
        for hit in hits {
            s_far = hit.found.select(s_far.min(hit.s), s_far);
        }
    }
    let part = Part { begin: kept.begin, s_min: Floats::splat(simd, s_min), s_max: s_far };
    let found = field.first_hits(simd, Some(scene.method()), &lines, &part, pixels.inside & !face.is);
    if !(found.found | face.is).any_true() {
        return None;
    }
    let normal = normals(simd, scene, &field, layer, &lines, &found, &kept);
    Some(Drawn {
        found: found.found | face.is,
        s: face.is.select(kept.begin, found.s),
        normal,
        color: axes!(a => splat(layer.color[a])),
        opacity: splat(layer.opacity),
        id,
        is_face: face.is,
        brightness: face.brightness(layer),
    })
}

/// A cut may lie in the box's own face: so far beside it, which is more than rounding and less than a pixel shows, it is in the volume.
pub(crate) const ON_FACE_VOXEL: f32 = 1e-3;

/// Where cuts show the values of a volume.
struct Face<S: Simd> {
    is: Mask<S>,
    /// Relative to the level, positive inside.
    value: Floats<S>,
}

impl<S: Simd> Face<S> {
    #[inline(always)]
    fn brightness(&self, layer: &FrameLayer) -> Floats<S> {
        let [gain, offset] = layer.brightness;
        self.value * gain + offset
    }
}

#[inline(always)]
fn face_of<S: Simd>(
    simd: S,
    scene: &Scene,
    layer: &FrameLayer,
    field: &Field<'_>,
    lines: &Lines<S>,
    kept: &Kept<S>,
    of: Mask<S>,
) -> Face<S> {
    let none = Face { is: Mask::splat(simd, false), value: Floats::splat(simd, 0.0) };
    if !layer.shows_faces || layer.surface.grid.is_flat() {
        return none;
    }
    simd.vectorize(
        #[inline(always)]
        || {
            let at = lines.at(kept.begin);
            let p = axes!(a => at[a].to_floats());
            let dims = field.dims;
            let within = axes!(a => p[a].simd_ge(-ON_FACE_VOXEL) & p[a].simd_le((dims[a] - 1) as f32 + ON_FACE_VOXEL));
            let is = of & kept.is_cut & kept.begin.simd_le(kept.end) & within[0] & within[1] & within[2];
            if !is.any_true() {
                return none;
            }
            let cell = axes!(a => p[a].floor().to_int::<Ints<S>>().max(0).min(dims[a] - 2));
            let local = axes!(a => (at[a] - Doubles::of(cell[a].to_float())).to_floats().max(0.0).min(1.0));
            let value = match scene.method() {
                Method::Spline => {
                    let (value, _) = spline::value_and_gradient(simd, &field.source.taps(dims, &cell, is), &local);
                    field.sign * (value - field.level)
                }
                Method::Solver(_) => trilinear(&field.corners(simd, &cell, is), &local),
            };
            Face { is, value }
        },
    )
}

/// Paints the faces of cuts among what is drawn first: with the values of all volumes that are cut there.
#[inline(always)]
fn paint_faces<S: Simd>(simd: S, frame: &Frame, scene: &Scene, hits: &[Drawn<S>], first: &Drawn<S>, color: &mut Vecs<S>) {
    let faces = first.found & first.is_face;
    if !faces.any_true() {
        return;
    }
    let mut lanes = color.map(|c| c.to_array());
    for lane in numbers(faces) {
        // A plane's face is at the same depth in all of them.
        let there = hits.iter().filter(|h| h.is_face.test(lane) && (h.s[lane] == first.s[lane] || h.id[lane] == first.id[lane]));
        let cut: Vec<(f32, Vec3)> = there.map(|h| (h.brightness[lane], Vec3::from_array(axes!(a => h.color[a][lane])))).collect();
        let layer = frame.layers.iter().find(|l| l.index + 1 == first.id[lane] as usize);
        let own = match layer {
            Some(layer) if !layer.face_colors.is_empty() => color_in(&layer.face_colors, first.brightness[lane]),
            _ => grey(first.brightness[lane]),
        };
        let painted = face_color(scene.cut_face, own, &cut);
        (0..3).for_each(|a| lanes[a][lane] = painted[a]);
    }
    *color = lanes.map(|c| Floats::load_array(simd, c));
}

/// The colours of what is drawn, where there is anything.
#[inline(always)]
fn light<S: Simd>(simd: S, view: &View<'_, S>, drawn: &Drawn<S>) -> Vecs<S> {
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let mut share = one;
    if view.scene.shadows {
        let normal = view.known(simd, &drawn.normal);
        let toward = axes!(a => Floats::splat(simd, view.frame.toward_light[a]));
        let lit = drawn.found & !drawn.is_face & dot(&normal, &toward).simd_gt(zero);
        if lit.any_true() {
            share = shadowed(simd, view, drawn.s, lit).select(zero, one);
        }
    }
    view.lit(simd, &drawn.color, &drawn.normal, share, drawn.s)
}

fn field_of(layer: &FrameLayer) -> Field<'_> {
    let source = Source::of(&layer.surface);
    let dims = layer.surface.grid.dims().map(|n| n as i32);
    Field { source, dims, map: &layer.map, masks: &layer.masks, level: layer.level, sign: layer.surface.sign }
}

#[inline(always)]
fn normalized<S: Simd>(v: &Vecs<S>) -> Vecs<S> {
    let length = dot(v, v).sqrt();
    axes!(a => v[a] / length)
}

/// Normals in the world that face the viewer, unit; zero where the viewer stands inside bone, or there is no gradient.
#[inline(always)]
fn normals<S: Simd>(
    simd: S,
    scene: &Scene,
    field: &Field<'_>,
    layer: &FrameLayer,
    lines: &Lines<S>,
    hits: &Hits<S>,
    kept: &Kept<S>,
) -> Vecs<S> {
    let surface = match scene.normals {
        _ if scene.draws_spline() => {
            spline::value_and_gradient(simd, &field.source.taps(field.dims, &hits.cell, hits.found), &hits.local).1
        }
        Normals::Smooth => field.source.smooth_gradient(simd, field.dims, &hits.cell, &hits.local, hits.found, &mut Around::unknown(simd)),
        Normals::Analytic => project::gradient(&field.corners(simd, &hits.cell, hits.found), &hits.local),
    };
    // Of the box's face: against the ray.
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let is_surface = hits.met.is_isosurface();
    let direction = axes!(a => lines.direction[a].to_floats());
    let index = axes!(a => {
        let face = hits.met.face[a].select(one.copysign(-direction[a]), zero);
        is_surface.select(surface[a], face)
    });
    let world = toward_viewer(simd, layer, &index, &direction);
    let cut = hits.met.start & kept.is_cut;
    axes!(a => cut.select(kept.normal[a], hits.met.start.select(zero, world[a])))
}

/// Normals of index space in the world, turned toward the viewer, who looks along `direction` of index space; unit, or zero as they are.
#[inline(always)]
fn toward_viewer<S: Simd>(simd: S, layer: &FrameLayer, index: &Vecs<S>, direction: &Vecs<S>) -> Vecs<S> {
    let zero = Floats::splat(simd, 0.0);
    // Both sides of a surface are lit: the smooth normal may turn away where the surface does not.
    let away = dot(index, direction).simd_gt(zero);
    let index = axes!(a => away.select(-index[a], index[a]));
    let m = &layer.normal_to_world;
    let world = axes!(a => m.x_axis[a] * index[0] + m.y_axis[a] * index[1] + m.z_axis[a] * index[2]);
    let length = dot(&world, &world).sqrt();
    let known = length.simd_gt(zero);
    axes!(a => known.select(world[a] / length, zero))
}
