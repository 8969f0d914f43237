// Passes for one volume over a batch of blocks: the first hit of every pixel, with its normal; and, once those of all volumes are known,
// whether this one keeps the light from them.

struct TraceParams {
    origin: PixelAffine,
    direction: PixelAffine,
    // The same rays in the world.
    world_origin: PixelAffine,
    world_direction: PixelAffine,
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
    // Change in index space per mm toward the light.
    to_light: Double,
    // The same direction in the world, unit.
    toward_light: vec3<f32>,
    // How far before a surface its shadow rays begin, mm.
    shadow_start: f32,
    // From index space to the column, the row and the depth of what the light sees.
    to_light_spans: mat3x3<f32>,
    light_spans_origin: vec3<f32>,
    passes: u32,
    // Blocks across and down that the light sees.
    light_blocks: vec2<u32>,
    // How many records of `extras` are cuts.
    cuts: u32,
    // 1 where the interpolant's own gradient shades.
    analytic_normals: u32,
    // In the modes that go on behind a surface: how many levels there are, entries of the table of steps, and gradients with a factor.
    levels: u32,
    table: u32,
    gradients: u32,
    // Entries of that table for a sample unit.
    table_per_unit: f32,
    // 1-based number in the scene.
    id: u32,
    // 1 where surfaces have another colour from within.
    has_inner: u32,
    // 1 where cuts show values where there is no bone, too; and what turns a value into a brightness there: a factor, and what is added.
    shows_faces: u32,
    brightness: vec2<f32>,
    inner: vec3<f32>,
    // Linear colour.
    color: vec3<f32>,
    // Gradients in index space to the world, in sample units per mm.
    gradient_to_world: mat3x3<f32>,
}

@group(0) @binding(0) var<storage, read> trace_params: TraceParams;
// The same, read once: llvmpipe reads a uniform for all invocations at once only where all of them are active.
var<private> params: TraceParams;
@group(0) @binding(6) var<storage, read> blocks: array<Block>;

// World normal toward the viewer and s; s < 0 where nothing was hit, a zero normal where there is none or the eye is inside bone. Of the face
// of a cut that shows values: brightness and FACE instead of the normal.
@group(0) @binding(3) var<storage, read_write> hits: array<vec4<f32>>;
// For each pixel FIRST_IS_DARK and SECOND_IS_DARK.
@group(0) @binding(7) var<storage, read_write> shadows: array<u32>;
// Depth at which each block's nearest brick begins, as the light sees it, row by row.
@group(0) @binding(8) var<storage, read> light_spans: array<f32>;

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
    let line = line_of(pixel);
    let part = kept(world_line_of(pixel));
    let face = face_of(line, part);
    if face.is_face {
        hits[params.pass_number * params.stride + index] = vec4<f32>(brightness_of(face), FACE, 0.0, part.begin);
        return;
    }
    let hit = first_hit(line, part.begin, block.span.x, min(s_max, part.end));
    hits[params.pass_number * params.stride + index] =
        vec4<f32>(world_normal(hit, line.direction.hi, part), select(hit.s, -1.0, hit.met == MISSED));
}

fn line_of(pixel: vec2<u32>) -> Line {
    return Line(at_pixel(params.origin, pixel), at_pixel(params.direction, pixel));
}

fn world_line_of(pixel: vec2<u32>) -> Line {
    return Line(at_pixel(params.world_origin, pixel), at_pixel(params.world_direction, pixel));
}

const ON_FACE_VOXEL: f32 = 1e-3;

// The face of a cut that shows values.
struct Face {
    is_face: bool,
    // Relative to the level, positive inside.
    value: f32,
}

fn brightness_of(face: Face) -> f32 {
    return face.value * params.brightness.x + params.brightness.y;
}

fn face_of(line: Line, part: Kept) -> Face {
    if params.shows_faces == 0u || !part.is_cut || part.begin > part.end {
        return Face(false, 0.0);
    }
    let at = line_at(line, part.begin);
    let p = at.hi + at.lo;
    if any(p < vec3<f32>(-ON_FACE_VOXEL)) || any(p > vec3<f32>(params.dims - 1) + ON_FACE_VOXEL) {
        return Face(false, 0.0);
    }
    let cell = clamp(vec3<i32>(floor(p)), vec3<i32>(0), params.dims - 2);
    let local = clamp(relative_to(at, vec3<f32>(cell)), vec3<f32>(0.0), vec3<f32>(1.0));
    return Face(true, value_in(cell, local));
}

fn world_normal(hit: Hit, direction: vec3<f32>, part: Kept) -> vec3<f32> {
    if hit.met == MET_ISOSURFACE {
        return toward_viewer(gradient_at(hit.cell, hit.local), direction);
    }
    if hit.met == MET_START && part.is_cut {
        return part.normal;
    }
    // Against the ray; none where the viewer stands inside bone.
    return toward_viewer(select(vec3<f32>(0.0), hit.face, hit.met == MET_FACE), direction);
}

// A normal of index space in the world, turned toward the viewer, who looks along `direction` of index space; unit, or zero as it is.
fn toward_viewer(index: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let world = params.normal_to_world * select(index, -index, dot(index, direction) > 0.0);
    let size = length(world);
    if size > 0.0 {
        return world / size;
    }
    return vec3<f32>(0.0);
}
