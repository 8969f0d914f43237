// Direct volume rendering as the integral along a stretch, interval by interval.
// The twin of renderer/src/cpu/dvr_exact.rs, which says why each step is as it is.

#import constants, volume, traveller, intervals, cubic, ray, light, dvr
#each count_above, find_end, add_own, pass_end

// Of each volume the next end of an interval.
struct End {
    s: f32,
    passes: bool,
    rises: bool,
}

var<private> ends: array<End, VOLUMES>;
// The interval at hand of all of them.
var<private> interval_from: f32;
var<private> interval_to: f32;
// What all volumes show in it: for each node the extinction, and the light that is sent; and the volume that shows most.
var<private> extinction: vec4<f32>;
var<private> sent_at: array<vec3<f32>, 4>;
var<private> most_extinction: f32;
var<private> most_id: u32;

fn begin_integral() {}

fn integrate(enough: f32) {
    each_count_above();
    var s = ray.from_s;
    while s < ray.to_s && ray.gathered.w < enough {
        interval_from = s;
        interval_to = ray.to_s;
        each_find_end();
        interval_to = max(interval_to, s);
        let whole = interval_to;
        var sent: vec3<f32>;
        var depth: f32;
        loop {
            let length_mm = (interval_to - s) * ray.mm_per_depth;
            extinction = vec4<f32>(0.0);
            sent_at = array<vec3<f32>, 4>(vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0));
            most_extinction = 0.0;
            most_id = 0u;
            each_add_own();
            depth = dot(extinction, GAUSS_WEIGHTS) * length_mm;
            if depth > THIN && 0.5 * (s + interval_to) > s {
                interval_to = 0.5 * (s + interval_to);
                continue;
            }
            let until_node = (GAUSS_UNTIL * extinction) * length_mm;
            sent = vec3<f32>(0.0);
            for (var node = 0u; node < 4u; node++) {
                sent += exp(-until_node[node]) * GAUSS_WEIGHTS[node] * length_mm * sent_at[node];
            }
            break;
        }
        add(sent, 1.0 - exp(-depth), interval_to, most_id);
        if interval_to == whole {
            each_pass_end();
        }
        s = interval_to;
    }
}

fn count_above(v: u32) {
    if covers[v] {
        turn_to(v);
        let t = travellers[v];
        travellers[v].above = count_levels(cubic_value(t.cubic, share_at(t.way, ray.from_s)));
    }
}

fn find_end(v: u32) {
    ends[v] = End(ray.to_s, false, false);
    if !covers[v] {
        return;
    }
    turn_to(v);
    let t = travellers[v];
    let s = interval_from;
    let u_end = share_at(t.way, ray.to_s);
    let ahead = next_end(t.cubic, share_at(t.way, s), u_end, t.above);
    if ahead.passes || ahead.u < u_end {
        let at = t.way.s.x + ahead.u * (t.way.s.y - t.way.s.x);
        ends[v].s = min(select(max(at, s + abs(s) * LEAST), at, ahead.passes), ray.to_s);
    }
    ends[v].passes = ahead.passes;
    ends[v].rises = ahead.rises;
    interval_to = min(interval_to, ends[v].s);
}

fn add_own(v: u32) {
    if !covers[v] {
        return;
    }
    turn_to(v);
    let t = travellers[v];
    var all = 0.0;
    for (var node = 0u; node < 4u; node++) {
        let s = interval_from + (interval_to - interval_from) * GAUSS_NODES[node];
        let u = share_at(t.way, s);
        let paint = paint_between(t.above, cubic_value(t.cubic, u));
        if paint.w > 0.0 {
            var own = paint.w;
            if params.gradients.count > 0u {
                own *= gradient_factor(t.way, u);
            }
            let normal = normal_behind_cut(t, walks[v].pace.direction, u, s, shading.skin_mm / ray.mm_per_depth);
            sent_at[node] += own * lit(paint.rgb, normal, 1.0, s);
            extinction[node] += own;
            all += own;
        }
    }
    if all > most_extinction {
        most_extinction = all;
        most_id = params.id;
    }
}

fn pass_end(v: u32) {
    if ends[v].passes && ends[v].s <= interval_to {
        travellers[v].above += select(-1, 1, ends[v].rises);
    }
}
