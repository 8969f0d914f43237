// The volumes that a pass goes through: where their rays are, and what they look like. One of them is at hand at a time.
// The twin of `FrameLayer` in renderer/src/frame.rs.

#import constants, line, blocks, volumes

// Some of the records of `extras`.
struct Part {
    first: u32,
    count: u32,
}

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
    // Always 0; see line.wgsl.
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
    // Cuts; and in the modes that go on behind a surface the levels, the table of steps, the gradients with a factor, and the colours of faces.
    cuts: Part,
    levels: Part,
    table: Part,
    gradients: Part,
    face_colors: Part,
    // Entries of the table for a sample unit.
    table_per_unit: f32,
    // 1 where the interpolant's own gradient shades.
    analytic_normals: u32,
    // 1-based number in the scene.
    id: u32,
    // 1 where surfaces have another colour from within.
    has_inner: u32,
    // 1 where cuts show values where there is no bone, too; and what turns a value into a brightness there: a factor, and what is added.
    shows_faces: u32,
    // Its number among the volumes that are drawn, from 0.
    number: u32,
    brightness: vec2<f32>,
    inner: vec3<f32>,
    // Linear colour.
    color: vec3<f32>,
    // Gradients in index space to the world, in sample units per mm.
    gradient_to_world: mat3x3<f32>,
}

@group(0) @binding(TRACE_PARAMS) var<storage, read> trace_params: array<TraceParams, VOLUMES>;
// Cuts, two records each; levels, two each; the table of steps; gradients; colours of faces: what cuts.wgsl, pieces.wgsl and faces.wgsl say.
@group(0) @binding(EXTRAS) var<storage, read> extras: array<vec4<f32>>;

// The number of the volume at hand, and its parameters, read once: llvmpipe reads a uniform for all invocations at once only where all of them
// are active.
var<private> volume: u32;
var<private> params: TraceParams;
var<private> all_params: array<TraceParams, VOLUMES>;

// Before anything else.
fn read_params() {
    for (var v = 0u; v < VOLUMES; v++) {
        all_params[v] = trace_params[v];
    }
    zero = all_params[0].zero;
    turn_to(0u);
}

// Takes a volume to hand.
fn turn_to(v: u32) {
    volume = v;
    params = all_params[v];
}

// A block of the batch as the volume at hand is seen in it.
fn block_of(n: u32) -> Block {
    return blocks[n * params.passes + params.number];
}

// The ray of a pixel in index space, and in the world.
fn line_of(pixel: vec2<u32>) -> Line {
    return Line(at_pixel(params.origin, pixel), at_pixel(params.direction, pixel));
}

fn world_line_of(pixel: vec2<u32>) -> Line {
    return Line(at_pixel(params.world_origin, pixel), at_pixel(params.world_direction, pixel));
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
