// Direct volume rendering at points that lie evenly apart.
// The twin of renderer/src/cpu/dvr_steps.rs.

#import constants, volume, traveller, ray, light, dvr
#each add_own

// The depth between two points, the first one's, and the number of the next.
struct Steps {
    depth: f32,
    first: f32,
    number: f32,
}

var<private> steps: Steps;

// What all volumes show at one point: light that is sent, the share of that from behind that is let through, and the sum of the opacities;
// and the first volume that shows anything.
struct Sum {
    s: f32,
    sent: vec3<f32>,
    clear: f32,
    weight: f32,
    id: u32,
}

var<private> at_point: Sum;

fn begin_integral() {
    let depth = shading.step_mm / ray.mm_per_depth;
    steps = Steps(depth, select(0.5, fract(noise_at(ray.pixel) + shading.jitter), shading.jitter >= 0.0) * depth, 0.0);
}

// A number from 0 to 1 that looks like chance, for each pixel the same in every frame (O'Neill 2014, PCG).
fn noise_at(pixel: vec2<u32>) -> f32 {
    let state = (pixel.y << 16u | pixel.x) * PCG.x + PCG.y;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * PCG.z;
    return f32(((word >> 22u) ^ word) >> 8u) / 16777216.0;
}

fn integrate(enough: f32) {
    steps.number = max(steps.number, ceil((ray.from_s - steps.first) / steps.depth));
    while ray.gathered.w < enough {
        let s = steps.first + steps.number * steps.depth;
        if s >= ray.to_s {
            break;
        }
        at_point = Sum(s, vec3<f32>(0.0), 1.0, 0.0, 0u);
        each_add_own();
        if at_point.weight > 0.0 {
            // Of several volumes at one place each shows by its share of the opacity.
            add(at_point.sent * ((1.0 - at_point.clear) / at_point.weight), 1.0 - at_point.clear, s, at_point.id);
        }
        steps.number += 1.0;
    }
}

fn add_own(v: u32) {
    if !covers[v] {
        return;
    }
    turn_to(v);
    let t = travellers[v];
    let s = at_point.s;
    let u = share_at(t.way, s);
    var paint = looked_up(value_at(t.way, u));
    if paint.w > 0.0 {
        if params.gradients.count > 0u {
            paint.w = 1.0 - pow(max(1.0 - paint.w, CLEAREST), gradient_factor(t.way, u));
        }
        let normal = normal_behind_cut(t, walks[v].pace.direction, u, s, shading.skin_mm / ray.mm_per_depth);
        at_point.sent += lit(paint.rgb, normal, 1.0, s) * paint.w;
        at_point.clear *= 1.0 - paint.w;
        at_point.weight += paint.w;
        at_point.id = select(at_point.id, params.id, at_point.id == 0u);
    }
}

// Linear colour, and opacity of a step, of a value.
fn looked_up(v: f32) -> vec4<f32> {
    let n = clamp(i32(floor(v * params.table_per_unit + 0.5)), 0, i32(params.table.count) - 1);
    return extras[params.table.first + u32(n)];
}
