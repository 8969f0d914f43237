// One pass for one volume over a batch of blocks: the first hit of every pixel, with its normal.

struct TraceParams {
    origin: PixelAffine,
    direction: PixelAffine,
    // Index-space normals to the world.
    normal_to_world: mat3x3<f32>,
    dims: vec3<i32>,
    level: f32,
    bricks: vec3<i32>,
    sign: f32,
    // Number of the pass, from 0; hits of pass l start at l · stride.
    pass_number: u32,
    stride: u32,
    // 1 where only the nearest hit of all passes is drawn.
    only_nearest: u32,
    // Always 0; see `opaque`.
    zero: u32,
}

@group(0) @binding(0) var<storage, read> trace_params: TraceParams;
// The same, read once: llvmpipe reads a uniform for all invocations at once only where all of them are active.
var<private> params: TraceParams;
@group(0) @binding(6) var<storage, read> blocks: array<Block>;

// Outward world normal and s; s < 0 where nothing was hit, a zero normal where the eye is inside bone.
@group(0) @binding(3) var<storage, read_write> hits: array<vec4<f32>>;

@compute @workgroup_size(64)
fn trace(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    params = trace_params;
    let block = blocks[group.x];
    let index = group.x * BLOCK_PIXELS + n;
    // What lies behind an opaque hit is not asked for.
    var s_max = block.span.y;
    if params.only_nearest == 1u {
        for (var l = 0u; l < params.pass_number; l++) {
            let s = hits[l * params.stride + index].w;
            s_max = select(s_max, min(s_max, s), s >= 0.0);
        }
    }
    let pixel = block.pixel + pixel_in_block(n);
    let hit = first_hit(Line(at_pixel(params.origin, pixel), at_pixel(params.direction, pixel)), block.span.x, s_max);
    hits[params.pass_number * params.stride + index] = vec4<f32>(world_normal(hit), select(hit.s, -1.0, hit.met == MISSED));
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
