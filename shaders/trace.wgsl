// One pass for one volume over a batch of tiles: the first hit of every pixel, with its normal.

struct TraceParams {
    origin: PixelAffine,
    direction: PixelAffine,
    // Index-space normals to the world.
    normal_to_world: mat3x3<f32>,
    dims: vec3<i32>,
    level: f32,
    bricks: vec3<i32>,
    sign: f32,
    // Pixels of the tile.
    tile: vec2<u32>,
    // Number of the pass, from 0; hits of pass l start at l · stride.
    pass_number: u32,
    stride: u32,
    // 1 where only the nearest hit of all passes is drawn.
    only_nearest: u32,
    // Always 0; see `opaque`.
    zero: u32,
    // Blocks in a row of the picture.
    blocks_across: u32,
    // The tile's first block, from 0.
    block: vec2<u32>,
}

@group(0) @binding(0) var<storage, read> tiles: array<TraceParams>;
// Nearest and farthest depth of each block of 8 × 8 pixels of the picture; the first is the larger where there is nothing.
@group(0) @binding(6) var<storage, read> spans: array<vec2<f32>>;
// Those of this invocation's tile.
var<private> params: TraceParams;

// Outward world normal and s; s < 0 where nothing was hit, a zero normal where the eye is inside bone.
@group(0) @binding(3) var<storage, read_write> hits: array<vec4<f32>>;

// A tile has at most 256 × 256 pixels.
const TILE_PIXELS: u32 = 65536u;

@compute @workgroup_size(8, 8)
fn trace(@builtin(global_invocation_id) id: vec3<u32>) {
    params = tiles[id.z];
    if any(id.xy >= params.tile) {
        return;
    }
    let pixel = id.z * TILE_PIXELS + id.y * params.tile.x + id.x;
    let block = params.block + id.xy / 8u;
    let span = spans[block.y * params.blocks_across + block.x];
    if span.x > span.y {
        hits[params.pass_number * params.stride + pixel] = vec4<f32>(0.0, 0.0, 0.0, -1.0);
        return;
    }
    // What lies behind an opaque hit is not asked for.
    var s_max = span.y;
    if params.only_nearest == 1u {
        for (var l = 0u; l < params.pass_number; l++) {
            let s = hits[l * params.stride + pixel].w;
            s_max = select(s_max, min(s_max, s), s >= 0.0);
        }
    }
    let x = f32(id.x);
    let y = f32(id.y);
    let hit = first_hit(Line(at_pixel(params.origin, x, y), at_pixel(params.direction, x, y)), span.x, s_max);
    hits[params.pass_number * params.stride + pixel] = vec4<f32>(world_normal(hit), select(hit.s, -1.0, hit.met == MISSED));
}

fn world_normal(hit: Hit) -> vec3<f32> {
    var index = hit.face;
    if hit.met == MET_ISOSURFACE {
        index = -smooth_gradient(hit.cell, hit.local);
    } else if hit.met != MET_FACE {
        return vec3<f32>(0.0);
    }
    let world = params.normal_to_world * index;
    let size = length(world);
    if size > 0.0 {
        return world / size;
    }
    return vec3<f32>(0.0);
}
