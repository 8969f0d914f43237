// What both integrators of direct volume rendering share.
// The twin of renderer/src/cpu/dvr.rs.

#import constants, ray

// Adds light that is sent here, and the share of that from behind that is kept.
fn add(sent: vec3<f32>, opacity: f32, s: f32, id: u32) {
    let before = ray.gathered.w;
    ray.gathered += (1.0 - before) * vec4<f32>(sent, opacity);
    if before < SEEN && ray.gathered.w >= SEEN {
        ray.first_s = s;
        ray.first_id = id;
    }
}
