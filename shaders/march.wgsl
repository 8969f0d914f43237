// Rays through all volumes at once, from cell to cell of any of them. What stands between EACH and END is there for each volume, with the
// number of its pass for LAYER; what belongs to a volume is named so. What is done along the way stands in shells.wgsl, dvr_steps.wgsl and
// dvr_exact.wgsl.
// The twin of `march` in renderer/src/cpu/march.rs.

// For each pixel its colour as sRGB with straight alpha, its depth behind the base plane, the volume's number, 0 where there is none, and
// whether there is anything.
@group(0) @binding(4) var<storage, read_write> pixels: array<vec4<u32>>;

const ALL_FAR: f32 = 1e30;
const UNFINISHED: u32 = 2u;

// What a ray has gathered: premultiplied linear colour and opacity; depth and volume of what is drawn first.
var<private> gathered: vec4<f32>;
var<private> first_s: f32;
var<private> first_id: u32;

// Colour over what is behind it.
fn put_behind(color: vec3<f32>, opacity: f32) {
    gathered += (1.0 - gathered.w) * opacity * vec4<f32>(color, 1.0);
}

// The colour of what has a linear colour and a normal at depth s, where a share of the light comes.
fn lit(color: vec3<f32>, normal: vec3<f32>, view: vec3<f32>, share: f32, s: f32) -> vec3<f32> {
    return cued(phong(color, known_normal(normal, view), view, share), s);
}

// The share of the light that comes to a crossing at depth s: each surface on the way keeps of it what it keeps of all that lies behind it.
// The twin of `share_of_light` in renderer/src/cpu/shadows.rs.
fn share_of_light(pixel: vec2<u32>, s: f32) -> f32 {
    var share = 1.0;
    //EACH
    share = let_through_LAYER(pixel, s, share);
    //END
    return select(0.0, share, share > DARK);
}

const DARK: f32 = 1.5e-4;

// A number from 0 to 1 that looks like chance, for each pixel the same in every frame (O'Neill 2014, PCG).
fn noise_at(pixel: vec2<u32>) -> f32 {
    let state = (pixel.y << 16u | pixel.x) * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return f32(((word >> 22u) ^ word) >> 8u) / 16777216.0;
}

@compute @workgroup_size(64)
fn march(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    params = shade_params;
    let pixel = blocks_0[group.x].pixel + pixel_in_block_0(n);
    let ray = params.view_base + f32(pixel.x) * params.view_per_x + f32(pixel.y) * params.view_per_y;
    let mm_per_depth = length(ray);
    let view = ray / mm_per_depth;
    // The nearest face of a cut that shows values, where something is visible.
    var until = ALL_FAR;
    var own = vec3<f32>(0.0);
    var face_id = 0u;
    //EACH
    params_LAYER = trace_params_LAYER;
    var t_LAYER: Traveller_LAYER;
    let line_LAYER = line_of_LAYER(pixel);
    t_LAYER.part = kept_LAYER(world_line_of_LAYER(pixel));
    let face_LAYER = face_of_LAYER(line_LAYER, t_LAYER.part);
    if face_LAYER.is_face && face_LAYER.value >= 0.0 && t_LAYER.part.begin < until {
        until = t_LAYER.part.begin;
        let brightness = brightness_of_LAYER(face_LAYER);
        if params.cut_face == TRANSFER {
            own = face_color_at_LAYER(brightness);
        } else {
            own = grey(brightness);
        }
        face_id = params_LAYER.id;
    }
    //END
    //EACH
    let part_LAYER = Kept_LAYER(t_LAYER.part.begin, min(t_LAYER.part.end, until), t_LAYER.part.is_cut, t_LAYER.part.normal);
    var walk_LAYER = begin_travel_LAYER(line_LAYER, part_LAYER, blocks_LAYER[group.x].span);
    t_LAYER.open = walk_LAYER.s <= walk_LAYER.s_out && part_LAYER.begin < until;
    //END
    var here = 0.0;
    //BEGIN
    loop {
        var from_s = ALL_FAR;
        //EACH
        if t_LAYER.open && !t_LAYER.has {
            go_on_LAYER(&t_LAYER, &walk_LAYER);
        }
        if t_LAYER.has {
            from_s = min(from_s, t_LAYER.way.s.x);
        }
        //END
        if from_s == ALL_FAR {
            break;
        }
        from_s = max(from_s, here);
        var to_s = ALL_FAR;
        //EACH
        if t_LAYER.has {
            // A cell that is still ahead ends the stretch where it begins.
            to_s = min(to_s, select(t_LAYER.way.s.y, t_LAYER.way.s.x, t_LAYER.way.s.x > from_s));
        }
        let covers_LAYER = t_LAYER.has && t_LAYER.way.s.x <= from_s;
        //END
        //INTEGRATE
        here = to_s;
        //EACH
        t_LAYER.fresh = t_LAYER.fresh && !covers_LAYER;
        t_LAYER.has = t_LAYER.has && t_LAYER.way.s.y > to_s;
        //END
        if gathered.w >= ENOUGH {
            gathered = gathered / gathered.w;
            break;
        }
    }
    // llvmpipe ends every loop once an invocation has gone some ten thousand times round all of its loops: then this one is not gone round twice.
    var rounds = 0u;
    while rounds < 2u + params_0.zero {
        rounds += 1u;
    }
    if face_id > 0u {
        var cut = no_faces();
        //EACH
        if face_LAYER.is_face && t_LAYER.part.begin == until {
            add_face(&cut, brightness_of_LAYER(face_LAYER), params_LAYER.color);
        }
        //END
        if first_id == 0u {
            first_s = until;
            first_id = face_id;
        }
        put_behind(color_of_faces(cut, own), 1.0);
    }
    let all = gathered + params.background * (1.0 - gathered.w);
    var straight = vec3<f32>(0.0);
    if all.w > 0.0 {
        straight = all.rgb / all.w;
    }
    pixels[group.x * 64u + n] = vec4<u32>(
        pack4x8unorm(vec4<f32>(encode(straight), clamp(all.w, 0.0, 1.0))),
        bitcast<u32>(first_s),
        first_id,
        select(UNFINISHED, select(0u, 1u, gathered.w > 0.0), rounds == 2u),
    );
}
