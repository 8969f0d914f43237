// What paths of light need to know beside volumes. The twin of renderer/src/gpu/stage.rs, which fills it.

#import constants, line

// A lamp in its place; see lamps.wgsl.
struct Disc {
    centre: vec3<f32>,
    radius: f32,
    // From the lamp to the bone, unit.
    normal: vec3<f32>,
    u: vec3<f32>,
    v: vec3<f32>,
    // Linear.
    radiance: vec3<f32>,
}

struct Stage {
    // The pixels' rays in the world, s = 0 at the eye.
    origin: PixelAffine,
    direction: PixelAffine,
    // The bone's.
    middle: Double,
    size: vec2<u32>,
    seed: u32,
    bounces: u32,
    // The sky's and the ground's.
    up: vec3<f32>,
    // How far off a surface rays start, mm.
    start_mm: f32,
    // Half the sum and half the difference of the sky's ends' light.
    sky_middle: vec3<f32>,
    gloss: f32,
    sky_half: vec3<f32>,
    // The mean of the coat's albedo.
    coat_mean: f32,
    // The ground, see ground.wgsl: where it looks and its linear colour.
    behind: vec3<f32>,
    height: f32,
    ground_color: vec3<f32>,
    corner: f32,
    radius: f32,
    // The radius of a sphere around all bone, with room for what is rounded.
    reach_mm: f32,
}

struct StageParams {
    stage: Stage,
    lamps: array<Disc, MOST_LAMPS>,
    // The coat's, by the cosine.
    albedo: array<f32, COAT_ALBEDOS>,
}

@group(0) @binding(STAGE_PARAMS) var<storage, read> stage_params: StageParams;

// Read once, as volumes' parameters are.
var<private> stage: Stage;
