// Where light comes from: discs, and the sky. Points are relative to the bone's middle.
// The twin of renderer/src/studio/lamps.rs.

#import constants, sampling, stage

// What comes from a lamp to a point: along which direction, from how far, and how densely that direction is sampled.
struct FromLamp {
    toward: vec3<f32>,
    far: f32,
    density: f32,
    // It does not turn its back.
    is_lit: bool,
}

// Whether a ray meets a lamp's face, where, and how densely that direction is sampled.
struct MetLamp {
    is_met: bool,
    far: f32,
    density: f32,
}

// Density of directions from as far as `far` that meet the disc under this cosine, where its points are sampled evenly.
fn lamp_density(lamp: Disc, far_squared: f32, cosine: f32) -> f32 {
    return far_squared / (cosine * (PI * lamp.radius * lamp.radius));
}

// From a point to one of its own.
fn sample_lamp(lamp: Disc, p: vec3<f32>, numbers: vec2<f32>) -> FromLamp {
    let at = disc(numbers);
    let way = combined(Across(lamp.u, lamp.v), lamp.centre, vec3<f32>(at * lamp.radius, 1.0)) - p;
    let far_squared = dot(way, way);
    let far = sqrt(far_squared);
    let toward = way / far;
    let cosine = -dot(toward, lamp.normal);
    return FromLamp(toward, far, lamp_density(lamp, far_squared, max(cosine, GRAZING)), cosine > 0.0);
}

// Whether a ray from a point meets its face nearer than `far`.
fn met_lamp(lamp: Disc, p: vec3<f32>, direction: vec3<f32>, far: f32) -> MetLamp {
    let origin = p - lamp.centre;
    let cosine = -dot(direction, lamp.normal);
    let t = dot(origin, lamp.normal) / max(cosine, GRAZING);
    let at = origin + t * direction;
    let is_within = dot(at, at) <= lamp.radius * lamp.radius;
    let is_met = cosine > GRAZING && t > 0.0 && t < far && is_within;
    return MetLamp(is_met, t, lamp_density(lamp, t * t, max(cosine, GRAZING)));
}

// The sky's radiance along a direction.
fn light_of_sky(direction: vec3<f32>) -> vec3<f32> {
    return dot(direction, stage.up) * stage.sky_half + stage.sky_middle;
}
