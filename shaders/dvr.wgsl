// What both integrators of direct volume rendering share.
// The twin of renderer/src/cpu/dvr.rs.

#import constants, volume, cells, gradient, ray

// Adds light that is sent here, and the share of that from behind that is kept.
fn add(sent: vec3<f32>, opacity: f32, s: f32, id: u32) {
    let before = ray.gathered.w;
    ray.gathered += (1.0 - before) * vec4<f32>(sent, opacity);
    if before < SEEN && ray.gathered.w >= SEEN {
        ray.first_s = s;
        ray.first_id = id;
    }
}

// The factor of the extinction by the gradient's magnitude.
fn gradient_factor(way: CellPass, u: f32) -> f32 {
    let first = params.gradients.first;
    let local = way.start * (1.0 - u) + way.end * u;
    let magnitude = length(params.gradient_to_world * gradient(way.lower, way.upper, local));
    var below = extras[first].xy;
    if magnitude < below.x {
        return below.y;
    }
    for (var n = 1u; n < params.gradients.count; n++) {
        let above = extras[first + n].xy;
        if magnitude < above.x {
            return below.y + (above.y - below.y) * ((magnitude - below.x) / (above.x - below.x));
        }
        below = above;
    }
    return below.y;
}
