//! Paths of light, from the eye to where it comes from (Kajiya 1986), sixteen at a time.
//!
//! At each vertex one ray goes to every lamp, and one along a direction of the surface's own, which stands for the sky, for light that comes over
//! other surfaces and, weighed by the power heuristic (Veach 1997), for lamps. Nothing is cut off: from the fourth surface on chance ends paths.
//!
//! The twin of `shaders/path.wgsl`.

use super::batch::{CAUGHT, COVERAGE, Found, LIT, Packet, Paths, Shadows};
use super::bone::{Bone, NEVER, Rays};
use super::bsdf::{Coat, Face, power};
use super::ground::Floor;
use super::lamps::{Disc, Dome};
use super::sampling::{Words, disc, key, pair, tent};
use crate::camera::PixelRays;
use crate::cpu::packets::Pixels;
use crate::lanes::{Doubles, Floats, LANES, Mask, Vecs, axes, dot, numbers};
use crate::skip::BLOCK;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Pixels of a block.
pub(crate) const PIXELS: usize = (BLOCK * BLOCK) as usize;
/// Samples of a block's pixels that are drawn at once: enough that packets stay full over many bounces, and few enough for a core's cache.
pub(crate) const AT_ONCE: u32 = 16;
/// Surfaces that every path comes over before chance may end it.
pub(crate) const SURE_BOUNCES: u32 = 3;

/// How lamps are sampled: all but the first are for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ways {
    Both,
    #[cfg(test)]
    Lamps,
    #[cfg(test)]
    Surfaces,
}

/// All that paths need.
#[derive(Debug)]
pub(crate) struct Stage {
    pub bone: Bone,
    pub lamps: Vec<Disc>,
    pub dome: Dome,
    pub floor: Option<Floor>,
    pub coat: Coat,
    pub bounces: u32,
    /// In the world, s = 0 at the eye.
    pub rays: PixelRays,
    pub size: [u32; 2],
    pub seed: u32,
    pub ways: Ways,
}

/// Memory for one block's paths.
pub(crate) struct Room {
    paths: [Paths; 2],
    shadows: Shadows,
    pub(super) found: Found,
}

impl Room {
    pub fn of(stage: &Stage) -> Self {
        let most = PIXELS * AT_ONCE as usize;
        Self { paths: [Paths::of(most), Paths::of(most)], shadows: Shadows::of(most * stage.lamps.len().max(1)), found: Found::of(most) }
    }
}

/// What vertices are.
struct Vertices<S: Simd> {
    at: [Doubles<S>; 3],
    geometric: Vecs<S>,
    face: Face<S>,
    is: Mask<S>,
    /// On a ground that only catches shadows.
    catches: Mask<S>,
}

impl Stage {
    /// Draws samples `first` to `first + count` (at most [`AT_ONCE`]) of the pixels of a block. Sample n of pixel p of the block is then number
    /// `(n − first) · PIXELS + p` in the room.
    #[inline(always)]
    pub fn draw<S: Simd>(&self, simd: S, room: &mut Room, block: [u32; 2], first: u32, count: u32) {
        let Room { paths: [paths, next], shadows, found } = room;
        let used = PIXELS * count as usize;
        found.light[..used].fill(Default::default());
        found.guides[..used].fill(Default::default());
        paths.count = 0;
        self.set_out(simd, paths, block, first, count);
        let mut depth = 0;
        while paths.count > 0 {
            next.count = 0;
            shadows.count = 0;
            for from in (0..paths.count).step_by(LANES) {
                self.step(simd, paths.packet(simd, from), depth, next, shadows, found);
            }
            self.arrive(simd, shadows, found);
            next.sort_into(paths);
            depth += 1;
        }
    }

    /// Rays from the eye, four by four pixels side by side.
    #[inline(always)]
    fn set_out<S: Simd>(&self, simd: S, paths: &mut Paths, [x0, y0]: [u32; 2], first: u32, count: u32) {
        const SIDE: u32 = 4;
        let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
        for n in 0..count {
            for part in 0..(PIXELS / LANES) as u32 {
                let (mut x, mut y, mut bits) = ([0.0; LANES], [0.0; LANES], 0);
                let (mut keys, mut slot) = ([0; LANES], [0; LANES]);
                for lane in 0..LANES as u32 {
                    let [px, py] = [part % 2 * SIDE + lane % SIDE, part / 2 * SIDE + lane / SIDE];
                    let [wx, wy] = [x0 + px, y0 + py];
                    (x[lane as usize], y[lane as usize]) = (wx as f32, wy as f32);
                    keys[lane as usize] = key(wy.wrapping_mul(self.size[0]).wrapping_add(wx), self.seed, (first + n) & 1);
                    slot[lane as usize] = n * PIXELS as u32 + py * BLOCK + px;
                    bits |= u64::from(wx < self.size[0] && wy < self.size[1]) << lane;
                }
                let is = Mask::from_bitmask(simd, bits);
                let (key, index) = (Words::load_array(simd, keys), Words::splat(simd, (first + n) >> 1));
                let [u, v] = pair(key, index, 0);
                let moved = |at: [f32; LANES], by: Floats<S>| Doubles::of(Floats::load_array(simd, at)) + Doubles::of(tent(by));
                let pixels = Pixels { x: moved(x, u), y: moved(y, v), inside: is };
                let along = pixels.at(simd, &self.rays.direction);
                let length = (along[0] * along[0] + along[1] * along[1] + along[2] * along[2]).sqrt().to_floats();
                let direction = axes!(a => along[a].to_floats() / length);
                let rays = Rays { origin: pixels.at(simd, &self.rays.origin), direction };
                paths.push(&Packet { is, slot, key, index, rays, throughput: [one; 3], density: zero }, is);
            }
        }
    }

    /// Points relative to the bone's middle.
    #[inline(always)]
    fn relative<S: Simd>(&self, simd: S, at: &[Doubles<S>; 3]) -> Vecs<S> {
        axes!(a => (at[a] - Doubles::splat(simd, self.bone.middle_mm[a])).to_floats())
    }

    /// One packet to its next vertices, and on.
    #[inline(always)]
    fn step<S: Simd>(&self, simd: S, packet: Packet<S>, depth: u32, next: &mut Paths, shadows: &mut Shadows, found: &mut Found) {
        let vertices = simd.vectorize(
            #[inline(always)]
            || self.look(simd, &packet, depth, found),
        );
        if vertices.is.any_true() {
            simd.vectorize(
                #[inline(always)]
                || self.go_on(simd, packet, &vertices, depth, next, shadows, found),
            );
        }
    }

    /// What rays meet; the light of the sky and of lamps where they come from these.
    #[inline(always)]
    fn look<S: Simd>(&self, simd: S, packet: &Packet<S>, depth: u32, found: &mut Found) -> Vertices<S> {
        let none = Mask::splat(simd, false);
        let from = self.relative(simd, &packet.rays.origin);
        let direction = &packet.rays.direction;
        let mut far = Floats::splat(simd, NEVER);
        let mut on_floor = none;
        let is_catcher = self.floor.as_ref().is_some_and(|floor| floor.is_catcher);
        if let Some(floor) = self.floor.as_ref().filter(|_| depth == 0 || !is_catcher) {
            let met = floor.hit(simd, &from, direction);
            (on_floor, far) = (packet.is & met.found, met.found.select(met.far, far));
        }
        let seen = self.bone.first(simd, &packet.rays, far, packet.is);
        on_floor &= !seen.found;
        let mut is = seen.found | on_floor;
        if depth > 0 {
            let catches = if is_catcher { self.caught(simd, packet, found) } else { none };
            self.gather(simd, packet, (&from, seen.far, is), catches, found);
            is &= !catches;
        }
        let (mut at, mut geometric, mut shading, mut color) = (seen.at, seen.geometric, seen.shading, seen.color);
        let mut gloss = Floats::splat(simd, self.coat.gloss);
        if let Some(floor) = self.floor.as_ref().filter(|_| on_floor.any_true()) {
            let there = axes!(a => from[a] + seen.far * direction[a]);
            let normal = floor.normal(simd, &there);
            for a in 0..3 {
                at[a] = (Doubles::of(there[a]) + Doubles::splat(simd, self.bone.middle_mm[a])).chosen(on_floor, at[a]);
                geometric[a] = on_floor.select(normal[a], geometric[a]);
                shading[a] = on_floor.select(normal[a], shading[a]);
                color[a] = on_floor.select(Floats::splat(simd, floor.color[a]), color[a]);
            }
            gloss = on_floor.select(Floats::splat(simd, 0.0), gloss);
        }
        let catches = if depth == 0 && is_catcher { on_floor } else { none };
        if depth == 0 {
            note_first(packet, (is, catches), (&color, &shading, seen.far), found);
        }
        let out = axes!(a => -direction[a]);
        Vertices { at, geometric, face: Face { albedo: color, normal: shading, out, gloss }, is, catches }
    }

    /// Which of a packet's samples are of a ground that only catches shadows.
    #[inline(always)]
    fn caught<S: Simd>(&self, simd: S, packet: &Packet<S>, found: &Found) -> Mask<S> {
        let bits =
            numbers(packet.is).filter(|lane| found.light[packet.slot[*lane] as usize][CAUGHT] > 0.0).fold(0, |bits, lane| bits | 1 << lane);
        Mask::from_bitmask(simd, bits)
    }

    /// Adds what comes along rays that surfaces chose: from the sky where they meet nothing, and from lamps before what they meet.
    #[inline(always)]
    fn gather<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        (from, far, is_hit): (&Vecs<S>, Floats<S>, Mask<S>),
        catches: Mask<S>,
        found: &mut Found,
    ) {
        let direction = &packet.rays.direction;
        let endless = Floats::splat(simd, NEVER);
        let sky = self.dome.light(direction);
        let light = axes!(a => sky[a] * packet.throughput[a]);
        found.add(&packet.slot, &light, packet.is & !is_hit);
        found.add_unlit(&packet.slot, &light, catches);
        for lamp in &self.lamps {
            let (met, at, density) = lamp.met(simd, from, direction, catches.select(endless, is_hit.select(far, endless)));
            let met = met & packet.is;
            if met.any_true() {
                let share = match self.ways {
                    Ways::Both => power(packet.density, density),
                    #[cfg(test)]
                    Ways::Lamps => Floats::splat(simd, 0.0),
                    #[cfg(test)]
                    Ways::Surfaces => Floats::splat(simd, 1.0),
                };
                let radiance = lamp.radiance;
                let light = axes!(a => packet.throughput[a] * (share * radiance[a]));
                found.add(&packet.slot, &light, met & !(catches & is_hit & at.simd_ge(far)));
                found.add_unlit(&packet.slot, &light, met & catches);
            }
        }
    }

    /// Rays from vertices to all lamps, and along a direction of their own.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "a packet's step has these, and a struct for them would be taken apart at once")]
    fn go_on<S: Simd>(
        &self,
        simd: S,
        packet: Packet<S>,
        vertices: &Vertices<S>,
        depth: u32,
        next: &mut Paths,
        shadows: &mut Shadows,
        found: &mut Found,
    ) {
        if depth > self.bounces {
            return;
        }
        let Vertices { geometric, face, is, catches, .. } = vertices;
        let start = Doubles::splat(simd, self.bone.start_mm);
        let origin = axes!(a => vertices.at[a] + start * Doubles::of(geometric[a]));
        let from = self.relative(simd, &origin);
        let dimension = 1 + depth * (self.lamps.len() as u32 + 2);
        for (lamp, n) in self.lamps.iter().zip(0..) {
            let way = lamp.sample(simd, &from, pair(packet.key, packet.index, dimension + n));
            let mut lit = *is & way.is_lit & dot(geometric, &way.toward).simd_gt(0.0) & dot(&face.normal, &way.toward).simd_gt(0.0);
            if let Some(floor) = &self.floor {
                lit &= floor.before(simd, &axes!(a => from[a] + way.far * way.toward[a]));
            }
            if !lit.any_true() {
                continue;
            }
            let answer = self.coat.answer(face, &way.toward);
            let share = match self.ways {
                Ways::Both => power(way.density, answer.density),
                #[cfg(test)]
                Ways::Lamps => Floats::splat(simd, 1.0),
                #[cfg(test)]
                Ways::Surfaces => Floats::splat(simd, 0.0),
            };
            let (radiance, share) = (lamp.radiance, share / way.density);
            let light = axes!(a => packet.throughput[a] * answer.light[a] * (share * radiance[a]));
            found.add_unlit(&packet.slot, &light, lit & *catches);
            shadows.push(&packet.slot, &Rays { origin, direction: way.toward }, way.far, &light, lit);
        }
        let last = dimension + self.lamps.len() as u32;
        let [choice, chance] = pair(packet.key, packet.index, last + 1);
        let direction = self.coat.sample(face, disc(pair(packet.key, packet.index, last)), choice);
        let answer = self.coat.answer(face, &direction);
        let goes = *is & dot(geometric, &direction).simd_gt(0.0) & answer.density.simd_gt(0.0);
        let throughput = axes!(a => packet.throughput[a] * (answer.light[a] / answer.density));
        let (throughput, goes) = if depth >= SURE_BOUNCES { by_chance(simd, &throughput, chance, goes) } else { (throughput, goes) };
        next.push(&Packet { rays: Rays { origin, direction }, throughput, density: answer.density, ..packet }, goes);
    }

    /// Adds the light of lamps that nothing keeps away.
    #[inline(always)]
    fn arrive<S: Simd>(&self, simd: S, shadows: &Shadows, found: &mut Found) {
        for from in (0..shadows.count).step_by(LANES) {
            let (is, rays, far) = shadows.packet(simd, from);
            let lit = is & !self.bone.is_between(simd, &rays, far, is);
            for lane in numbers(lit) {
                let (sum, light) = (&mut found.light[shadows.slot[from + lane] as usize], shadows.light(from + lane));
                (0..3).for_each(|a| sum[a] += light[a]);
            }
        }
    }
}

/// Ends paths by chance, the darker the likelier; the light of others stands for theirs.
#[inline(always)]
fn by_chance<S: Simd>(simd: S, throughput: &Vecs<S>, chance: Floats<S>, goes: Mask<S>) -> (Vecs<S>, Mask<S>) {
    let share = throughput[0].max(throughput[1]).max(throughput[2]).min(Floats::splat(simd, 1.0));
    (axes!(a => throughput[a] / share), goes & chance.simd_lt(share))
}

/// Notes what is seen first.
#[inline(always)]
fn note_first<S: Simd>(
    packet: &Packet<S>,
    (is, catches): (Mask<S>, Mask<S>),
    (color, normal, far): (&Vecs<S>, &Vecs<S>, Floats<S>),
    found: &mut Found,
) {
    let (color, normal, far) = (axes!(a => color[a].to_array()), axes!(a => normal[a].to_array()), far.to_array());
    for lane in numbers(is) {
        let slot = packet.slot[lane] as usize;
        let is_caught = catches.test(lane);
        found.light[slot][if is_caught { CAUGHT } else { COVERAGE }] = 1.0;
        found.guides[slot] = [color[0][lane], color[1][lane], color[2][lane], normal[0][lane], normal[1][lane], normal[2][lane], far[lane]];
    }
}

impl Room {
    /// The numbers of sample `n` of pixel `p`. What a ground that only catches shadows shows is no light of the picture.
    pub(super) fn light(&self, n: u32, p: usize) -> [f32; super::batch::CHANNELS] {
        let mut light = self.found.light[n as usize * PIXELS + p];
        if light[CAUGHT] > 0.0 {
            light[LIT] = light[0] + light[1] + light[2];
            light[..3].fill(0.0);
        }
        light
    }

    /// What sample `n` of pixel `p` sees first.
    pub(super) fn guide(&self, n: u32, p: usize) -> [f32; super::batch::GUIDES] {
        self.found.guides[n as usize * PIXELS + p]
    }
}
