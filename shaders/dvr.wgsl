// What both integrators of direct volume rendering share.
// The twin of renderer/src/cpu/dvr.rs, which says what these numbers are.

const SEEN: f32 = 0.5;
const NODES = vec4<f32>(0.06943184420, 0.33000947821, 0.66999052179, 0.93056815580);
const WEIGHTS = vec4<f32>(0.17392742257, 0.32607257743, 0.32607257743, 0.17392742257);
// By columns: the integrals from 0 to each node that a value at one node has part in.
const UNTIL = mat4x4<f32>(
    vec4<f32>(0.08696371, 0.18811812, 0.16719192, 0.17748257),
    vec4<f32>(-0.02660418, 0.16303629, 0.35395301, 0.31344511),
    vec4<f32>(0.012627463, -0.027880428, 0.16303629, 0.35267676),
    vec4<f32>(-0.0035551497, 0.0067355007, -0.014190695, 0.08696371),
);
const THIN: f32 = 0.5;
const LEAST: f32 = 2.4e-7;
const CLEAREST: f32 = 1e-7;

// Adds light that is sent here, and the share of that from behind that is kept.
fn add(sent: vec3<f32>, opacity: f32, s: f32, id: u32) {
    let before = gathered.w;
    gathered += (1.0 - before) * vec4<f32>(sent, opacity);
    if before < SEEN && gathered.w >= SEEN {
        first_s = s;
        first_id = id;
    }
}
