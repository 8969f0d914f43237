// Transparent isosurfaces: every crossing along a stretch of a ray, from front to back.
// The twin of renderer/src/cpu/transparent.rs, where each volume is taken to its next crossing whatever the others do: it shades more rays of a packet
// at once. Here all modes that go on share the stretches of march.wgsl.

#import constants, volume, traveller, intervals, let_through, ray, light
#each find_next, compare_next, pass_next, keep_light

// Whether surfaces keep the light from each other.
override HAS_SHADOWS: bool;

// Of each volume its next crossing, and whether it is at the entry of the cell.
var<private> next: array<Next, VOLUMES>;
var<private> at_entry: array<bool, VOLUMES>;
// The nearest of them, and whose it is; VOLUMES where there is none.
var<private> next_s: f32;
var<private> next_of: u32;
// Of the light at a crossing.
var<private> light_share: f32;

fn begin_integral() {}

fn integrate(enough: f32) {
    each_find_next();
    while ray.gathered.w < enough {
        next_s = FAR;
        next_of = VOLUMES;
        each_compare_next();
        if next_of == VOLUMES {
            break;
        }
        each_pass_next();
    }
}

fn find_next(v: u32) {
    next[v] = Next(0.0, false, false);
    at_entry[v] = false;
    if covers[v] {
        turn_to(v);
        let t = travellers[v];
        next[v] = next_crossing(t.cubic, t.above, share_at(t.way, ray.from_s), share_at(t.way, ray.to_s), t.fresh);
        at_entry[v] = next[v].passes && t.fresh && count_levels(t.cubic.x) != t.above;
    }
}

// Of equal ones the first volume's is passed first.
fn compare_next(v: u32) {
    let way = travellers[v].way;
    let s = way.s.x + next[v].u * (way.s.y - way.s.x);
    if next[v].passes && s < next_s {
        next_s = s;
        next_of = v;
    }
}

fn pass_next(v: u32) {
    if next_of != v {
        return;
    }
    turn_to(v);
    let t = travellers[v];
    let rises = next[v].rises;
    let paint = paint_at(select(t.above - 1, t.above, rises));
    let base = select(paint.rgb, params.inner, vec3<bool>(!rises && params.has_inner == 1u));
    var normal: vec3<f32>;
    if at_entry[v] {
        normal = closing_normal(t, walks[v]);
    } else {
        normal = normal_at(t.way, walks[v].pace.direction, next[v].u);
    }
    if ray.first_id == 0u && paint.w > 0.0 {
        ray.first_s = next_s;
        ray.first_id = params.id;
    }
    light_share = 1.0;
    if HAS_SHADOWS && dot(known_normal(normal, ray.view), shading.toward_light) > 0.0 {
        find_share_of_light();
        turn_to(v);
    }
    put_behind(lit(base, normal, light_share, next_s), paint.w);
    travellers[v].above += select(-1, 1, rises);
    let fresh = at_entry[v];
    next[v] = next_crossing(t.cubic, travellers[v].above, next[v].u, share_at(t.way, ray.to_s), fresh);
    at_entry[v] = fresh && next[v].passes && count_levels(t.cubic.x) != travellers[v].above;
}

// The share of the light that comes to a crossing: each surface on the way keeps of it what it keeps of all that lies behind it.
fn find_share_of_light() {
    each_keep_light();
    light_share = select(0.0, light_share, light_share > DARK);
}

fn keep_light(v: u32) {
    turn_to(v);
    light_share = let_through(ray.pixel, next_s, light_share);
}
