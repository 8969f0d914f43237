// The volumes that a pass goes through: where their rays are, and what they look like. One of them is at hand at a time.
// The twin of renderer/src/cpu/volume.rs; `TraceParams` is what it needs of a `FrameLayer` of renderer/src/frame.rs.

#import constants, line, blocks, volumes

// Some of the records of `extras`.
struct Part {
    first: u32,
    count: u32,
}

struct TraceParams {
    // The picture's rays in the world.
    world_origin: PixelAffine,
    world_direction: PixelAffine,
    // Toward the light, unit, in the world; and how far before a surface its shadow rays begin, mm.
    toward_light: vec3<f32>,
    shadow_start: f32,
    // Number of the pass, from 0, and of how many; hits of pass l start at l · stride.
    pass_number: u32,
    passes: u32,
    stride: u32,
    // 1 where only the nearest hit of all passes is drawn.
    only_nearest: u32,
    // Always 0; see line.wgsl.
    zero: u32,
    // 1 where the interpolant's own gradient shades.
    analytic_normals: u32,
    // Its number among the volumes that are drawn, from 0; and in the scene, from 1.
    number: u32,
    id: u32,

    // Placement: the pixel rays in the volume's index space.
    origin: PixelAffine,
    direction: PixelAffine,
    // And for rays that are no pixel's, which paths of light have.
    to_index: Affine,
    to_world: Affine,
    dims: vec3<i32>,
    level: f32,
    // Change in index space per mm toward the light.
    to_light: Double,
    // Index-space normals to the world.
    normal_to_world: mat3x3<f32>,
    // Gradients in index space to the world, in sample units per mm.
    gradient_to_world: mat3x3<f32>,

    // Skip: range bricks along each side. The sign turns bone's side of the level to be positive.
    bricks: vec3<i32>,
    sign: f32,
    // From index space to the column, the row and the depth of what the light sees.
    to_light_spans: mat3x3<f32>,
    light_spans_origin: vec3<f32>,
    // Blocks across and down that the light sees.
    light_blocks: vec2<u32>,
    // Cuts.
    cuts: Part,

    // Appearance, in the modes that go on behind a surface: the levels, the table of steps, the gradients with a factor, and the colours of
    // faces.
    levels: Part,
    table: Part,
    gradients: Part,
    face_colors: Part,
    // What turns a value into a brightness: a factor, and what is added.
    brightness: vec2<f32>,
    // Entries of the table for a sample unit.
    table_per_unit: f32,
    // 1 where cuts show values where there is no bone, too.
    shows_faces: u32,
    // Linear colour of surfaces from within; 1 where they have one.
    inner: vec3<f32>,
    has_inner: u32,
    // Linear colour.
    color: vec3<f32>,
    // The isovalue whose contour a slice shows, relative to the level.
    contour: f32,
    // Where the sides of the solid's bricks, the slots of its blocks, and its distances begin; and how far behind its face normals are blended, in its
    // units.
    solid: vec3<u32>,
    rim_units: f32,
}

@group(0) @binding(TRACE_PARAMS) var<storage, read> trace_params: array<TraceParams, VOLUMES>;
// Cuts, two records each; levels, two each; the table of steps; gradients; colours of faces: what cuts.wgsl, intervals.wgsl, dvr_steps.wgsl,
// dvr.wgsl and faces.wgsl say.
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
