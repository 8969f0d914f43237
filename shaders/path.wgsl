// Paths of light, from the eye to where it comes from: each invocation draws the samples of its pixel one after the other, so many vertices at
// a time that no dispatch takes long. A path that has ended makes room for the pixel's next; pixels that have all their samples are left out.
// The twin of renderer/src/studio/path.rs, which says why each step is as it is.

#import constants, line, volume, blocks, sampling, stage, lamps, ground, bsdf, bone

// What the samples of a block have found, as renderer/src/studio/accumulate.rs has it: both halves, and what is seen first.
struct BlockSums {
    sums: array<f32, SUMS_OF_BLOCK>,
    // Its first pixel, and which samples are drawn.
    pixel: vec2<u32>,
    first: u32,
    count: u32,
}

// A path on its way; one that has not yet set out where all of it is 0.
struct Path {
    origin: Double,
    direction: vec3<f32>,
    // How densely the direction was sampled.
    density: f32,
    // Share of the light that comes along the ray which reaches the eye.
    throughput: vec3<f32>,
    // Surfaces that it has come over.
    depth: u32,
    // What its sample has found so far; of a ground that only catches shadows the light that would come without bone.
    light: vec3<f32>,
    unlit: f32,
    // What is seen first: something that is drawn, or such a ground.
    covers: f32,
    is_caught: f32,
    // Of the block's samples, from 0.
    sample: u32,
    is_under_way: u32,
}

// A pixel of the batch: the paths' numbers are by block, and there as invocations lie.
struct UnderWay {
    count: atomic<u32>,
    // A driver has ended a loop.
    is_unfinished: atomic<u32>,
    numbers: array<u32>,
}

@group(0) @binding(SUMS) var<storage, read_write> blocks_of_paths: array<BlockSums>;
@group(0) @binding(PATHS) var<storage, read_write> paths: array<Path>;
// The pixels that have yet to go on, and those of the next dispatch.
@group(0) @binding(UNDER_WAY) var<storage, read> under_way: array<u32>;
@group(0) @binding(STILL_UNDER_WAY) var<storage, read_write> still: UnderWay;

// Vertices in one dispatch.
override STEPS: u32;
// Compiled in, as drivers go through code that nothing asks for, too.
override LAMPS: u32;
// NO_GROUND, SWEEP or CATCHER.
override GROUND: u32;

// The path at hand; the numbers of its sample; and its pixel in the block.
var<private> path: Path;
var<private> key_of_path: u32;
var<private> index_of_path: u32;
var<private> block_of_path: u32;
var<private> pixel_of_path: u32;

// What a vertex is.
struct Vertex {
    at: Double,
    geometric: vec3<f32>,
    face: Face,
    is_there: bool,
    // On a ground that only catches shadows.
    catches: bool,
}

// Goes on with the samples of pixels.
@compute @workgroup_size(BLOCK_PIXELS)
fn draw(@builtin(global_invocation_id) id: vec3<u32>) {
    read_params();
    stage = stage_params.stage;
    // As the next dispatch finds those that this one leaves: behind two numbers.
    if id.x >= under_way[0] {
        return;
    }
    let slot = under_way[2u + id.x];
    block_of_path = slot / BLOCK_PIXELS;
    let in_block = pixel_in_block(slot % BLOCK_PIXELS);
    let pixel = blocks_of_paths[block_of_path].pixel + in_block;
    let first = blocks_of_paths[block_of_path].first;
    let count = blocks_of_paths[block_of_path].count;
    path = paths[slot];
    pixel_of_path = (in_block.y * 8u + in_block.x) * CHANNELS;
    var steps = 0u;
    // llvmpipe goes through the body of a loop until no invocation is left: what ends it is asked for behind, and not before.
    loop {
        if path.is_under_way == 0u {
            // Samples that pass by the bone have nothing to add.
            loop {
                turn_to_sample(pixel, first);
                set_out(pixel);
                let passes_by = GROUND == NO_GROUND && passes();
                path.sample += select(0u, 1u, passes_by);
                continuing {
                    break if !passes_by || path.sample >= count;
                }
            }
        }
        turn_to_sample(pixel, first);
        if path.sample < count {
            step_on();
            if path.is_under_way == 0u {
                add((first + path.sample) & 1u);
            }
        }
        steps += 1u;
        continuing {
            break if steps >= STEPS || path.sample >= count;
        }
    }
    paths[slot] = path;
    if path.sample < count {
        still.numbers[atomicAdd(&still.count, 1u)] = slot;
    }
    // See march.wgsl.
    var rounds = 0u;
    while rounds < 2u + zero {
        rounds += 1u;
    }
    if rounds != 2u {
        atomicStore(&still.is_unfinished, 1u);
    }
}

// To the numbers of the path's sample.
fn turn_to_sample(pixel: vec2<u32>, first: u32) {
    let number = first + path.sample;
    key_of_path = key(pixel.y * stage.size.x + pixel.x, stage.seed, number & 1u);
    index_of_path = number >> 1u;
}

// Whether the ray is beside the sphere around all bone, or goes away from it.
fn passes() -> bool {
    let origin = relative(path.origin);
    let along = dot(origin, path.direction);
    let nearest = origin - along * path.direction;
    let square = stage.reach_mm * stage.reach_mm;
    return dot(nearest, nearest) > square || (along > 0.0 && dot(origin, origin) > square);
}

// A ray from the eye.
fn set_out(pixel: vec2<u32>) {
    let numbers = pair(key_of_path, index_of_path, 0u);
    let by = vec2<f32>(tent(numbers.x), tent(numbers.y));
    let along = between_pixels(stage.direction, pixel, by).hi;
    path = Path(
        between_pixels(stage.origin, pixel, by),
        normalized(along),
        0.0,
        vec3<f32>(1.0),
        0u,
        vec3<f32>(0.0),
        0.0,
        0.0,
        0.0,
        path.sample,
        1u,
    );
}

// The value beside the middle of a pixel.
fn between_pixels(a: PixelAffine, pixel: vec2<u32>, by: vec2<f32>) -> Double {
    let middle = at_pixel(a, pixel);
    return two_sum(middle.hi, middle.lo + (by.x * (a.per_x_hi + a.per_x_lo) + by.y * (a.per_y_hi + a.per_y_lo)));
}

// A point relative to the bone's middle.
fn relative(at: Double) -> vec3<f32> {
    return (at.hi - stage.middle.hi) + (at.lo - stage.middle.lo);
}

// To the next vertex, and on.
fn step_on() {
    let vertex = look();
    path.is_under_way = 0u;
    if vertex.is_there {
        go_on(vertex);
    }
}

// What the ray meets; the light of the sky and of lamps where it comes from these.
fn look() -> Vertex {
    let origin = relative(path.origin);
    let direction = path.direction;
    let is_catcher = GROUND == CATCHER;
    var far = FAR;
    var on_ground = false;
    if GROUND != NO_GROUND && (path.depth == 0u || !is_catcher) {
        let met = hit_ground(origin, direction);
        on_ground = met.is_met;
        far = select(FAR, met.far, met.is_met);
    }
    rays = Rays(path.origin, direction);
    seen = Seen(false, far, path.origin, vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0));
    each_first();
    on_ground = on_ground && !seen.is_seen;
    var is_there = seen.is_seen || on_ground;
    if path.depth > 0u {
        let catches = path.is_caught > 0.0;
        gather(origin, seen.far, is_there, catches);
        is_there = is_there && !catches;
    }
    var gloss = stage.gloss;
    if on_ground {
        let there = origin + seen.far * direction;
        seen.at = two_sum(there, stage.middle.hi);
        seen.at.lo += stage.middle.lo;
        seen.geometric = normal_of_ground(there);
        seen.shading = seen.geometric;
        seen.color = stage.ground_color;
        gloss = 0.0;
    }
    let catches = path.depth == 0u && is_catcher && on_ground;
    if path.depth == 0u && is_there {
        note_first(catches);
    }
    return Vertex(seen.at, seen.geometric, Face(seen.color, seen.shading, -direction, gloss), is_there, catches);
}

// Adds what comes along a ray that a surface chose: from the sky where it meets nothing, and from lamps before what it meets.
fn gather(origin: vec3<f32>, far: f32, is_hit: bool, catches: bool) {
    let sky = light_of_sky(path.direction) * path.throughput;
    if !is_hit {
        path.light += sky;
    }
    if catches {
        path.unlit += sky.x + sky.y + sky.z;
    }
    for (var n = 0u; n < LAMPS; n++) {
        let lamp = stage_params.lamps[n];
        let met = met_lamp(lamp, origin, path.direction, select(FAR, far, is_hit && !catches));
        if met.is_met {
            let light = path.throughput * (power(path.density, met.density) * lamp.radiance);
            if !(catches && is_hit && met.far >= far) {
                path.light += light;
            }
            if catches {
                path.unlit += light.x + light.y + light.z;
            }
        }
    }
}

// Rays from a vertex to all lamps, and along a direction of its own.
fn go_on(vertex: Vertex) {
    if path.depth > stage.bounces {
        return;
    }
    let start = two_sum(vertex.at.hi, vertex.at.lo + stage.start_mm * vertex.geometric);
    let origin = relative(start);
    let dimension = 1u + path.depth * (LAMPS + 2u);
    var n = 0u;
    loop {
        let lamp = stage_params.lamps[n];
        let way = sample_lamp(lamp, origin, pair(key_of_path, index_of_path, dimension + n));
        var is_lit = way.is_lit && dot(vertex.geometric, way.toward) > 0.0 && dot(vertex.face.normal, way.toward) > 0.0;
        if GROUND != NO_GROUND {
            is_lit = is_lit && before(origin + way.far * way.toward);
        }
        if is_lit {
            let answered = answer(vertex.face, way.toward);
            let share = power(way.density, answered.density) / way.density;
            let light = path.throughput * answered.light * (share * lamp.radiance);
            if vertex.catches {
                path.unlit += light.x + light.y + light.z;
            }
            arrive_from_lamp(start, way, light);
        }
        n += 1u;
        continuing {
            break if n >= LAMPS;
        }
    }
    let last = dimension + LAMPS;
    let numbers = pair(key_of_path, index_of_path, last + 1u);
    let direction = sample_face(vertex.face, disc(pair(key_of_path, index_of_path, last)), numbers.x);
    let answered = answer(vertex.face, direction);
    if dot(vertex.geometric, direction) > 0.0 && answered.density > 0.0 {
        path.throughput *= answered.light / answered.density;
        if path.depth < SURE_BOUNCES || by_chance(numbers.y) {
            path.origin = start;
            path.direction = direction;
            path.density = answered.density;
            path.depth += 1u;
            path.is_under_way = 1u;
        }
    }
}

// Adds the light of a lamp if nothing keeps it away.
fn arrive_from_lamp(start: Double, way: FromLamp, light: vec3<f32>) {
    rays = Rays(start, way.toward);
    until_lamp = way.far;
    is_dark = false;
    each_is_between();
    if !is_dark {
        path.light += light;
    }
}

// Ends a path by chance, the darker the likelier; the light of others stands for its own.
fn by_chance(chance: f32) -> bool {
    let share = min(max(path.throughput.x, max(path.throughput.y, path.throughput.z)), 1.0);
    path.throughput = path.throughput / share;
    return chance < share;
}

// Notes what is seen first.
fn note_first(catches: bool) {
    if catches {
        path.is_caught = 1.0;
    } else {
        path.covers = 1.0;
    }
    let at = pixel_of_path + GUIDES_OF_BLOCK;
    for (var a = 0u; a < 3u; a++) {
        add_number(at + a, seen.color[a]);
        add_number(at + 3u + a, seen.shading[a]);
    }
    add_number(at + 6u, seen.far);
}

// Adds a sample's numbers to its half, and makes room for the next. What a ground that only catches shadows shows is no light of the picture.
fn add(half: u32) {
    let at = pixel_of_path + half * HALF_OF_BLOCK;
    let is_caught = path.is_caught > 0.0;
    for (var a = 0u; a < 3u; a++) {
        add_number(at + a, select(path.light[a], 0.0, is_caught));
    }
    add_number(at + LIT, select(0.0, path.light.x + path.light.y + path.light.z, is_caught));
    add_number(at + COVERAGE, path.covers);
    add_number(at + UNLIT, path.unlit);
    add_number(at + CAUGHT, path.is_caught);
    path.sample += 1u;
}

fn add_number(at: u32, v: f32) {
    blocks_of_paths[block_of_path].sums[at] += v;
}
