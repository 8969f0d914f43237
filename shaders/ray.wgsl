// A pixel's ray in the world, and what it has gathered on its way.
// The twin of renderer/src/cpu/ray.rs, where its two halves are `View` and `Gathered`.

#import constants, light, traveller

struct Ray {
    // The number of its block in the batch.
    block: u32,
    pixel: vec2<u32>,
    // Its direction in the world, unit; and its length for each mm of depth.
    view: vec3<f32>,
    mm_per_depth: f32,
    // Premultiplied linear colour and opacity; depth and volume of what is drawn first.
    gathered: vec4<f32>,
    first_s: f32,
    first_id: u32,
    // The stretch at hand: between these depths every volume has one cell or none.
    from_s: f32,
    to_s: f32,
}

var<private> ray: Ray;

// A ray that has gathered nothing yet.
fn look_through(block: u32, pixel: vec2<u32>) {
    let direction = shading.view_base + f32(pixel.x) * shading.view_per_x + f32(pixel.y) * shading.view_per_y;
    let mm_per_depth = length(direction);
    ray = Ray(block, pixel, direction / mm_per_depth, mm_per_depth, vec4<f32>(0.0), 0.0, 0u, 0.0, 0.0);
}

// Colour over what is behind it.
fn put_behind(color: vec3<f32>, opacity: f32) {
    ray.gathered += (1.0 - ray.gathered.w) * opacity * vec4<f32>(color, 1.0);
}

// The colour of what has a linear colour and a normal at depth s, where a share of the light comes.
fn lit(color: vec3<f32>, normal: vec3<f32>, share: f32, s: f32) -> vec3<f32> {
    return cued(phong(color, known_normal(normal, ray.view), ray.view, share), s);
}

// All volumes on its way, and which of them have a cell where it is.
var<private> travellers: array<Traveller, VOLUMES>;
var<private> walks: array<Walk, VOLUMES>;
var<private> covers: array<bool, VOLUMES>;
