// Rays through all volumes at once, from cell to cell of any of them. What is done along the way is `integrate` of transparent.wgsl, dvr_steps.wgsl
// or dvr_exact.wgsl. `each_` and the name of a function is that function for one volume after the other.
// The twin of renderer/src/cpu/march.rs.

#import constants, volume, blocks, walk, cuts, faces, traveller, ray, light, integrate
#each find_face, set_out, go_on_to_cell, reach, leave, add_own_face

// For each pixel its colour as sRGB with straight alpha, its depth behind the base plane, the volume's number, 0 where there is none, and
// whether there is anything.
@group(0) @binding(RECORDS) var<storage, read_write> records: array<vec4<u32>>;

// So much opacity hides all that lies behind it.
override ENOUGH: f32;

// The nearest face of a cut that shows values, where something is visible: its depth, its colour, and whose it is; and the faces of all.
struct NearestFace {
    s: f32,
    color: vec3<f32>,
    id: u32,
}

var<private> nearest_face: NearestFace;
var<private> cut_faces: array<Face, VOLUMES>;
// All of them at that depth.
var<private> faces_there: Faces;

@compute @workgroup_size(BLOCK_PIXELS)
fn march(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    read_params();
    shading = shade_params;
    look_through(group.x, block_of(group.x).pixel + pixel_in_block(n));
    nearest_face = NearestFace(FAR, vec3<f32>(0.0), 0u);
    each_find_face();
    each_set_out();
    begin_integral();
    var here = 0.0;
    loop {
        ray.from_s = FAR;
        each_go_on_to_cell();
        if ray.from_s == FAR {
            break;
        }
        ray.from_s = max(ray.from_s, here);
        ray.to_s = FAR;
        each_reach();
        integrate(ENOUGH);
        here = ray.to_s;
        each_leave();
        if ray.gathered.w >= ENOUGH {
            ray.gathered = ray.gathered / ray.gathered.w;
            break;
        }
    }
    // llvmpipe ends every loop once an invocation has gone some ten thousand times round all of its loops: then this one is not gone round twice.
    var rounds = 0u;
    while rounds < 2u + zero {
        rounds += 1u;
    }
    if nearest_face.id > 0u {
        faces_there = no_faces();
        each_add_own_face();
        if ray.first_id == 0u {
            ray.first_s = nearest_face.s;
            ray.first_id = nearest_face.id;
        }
        put_behind(color_of_faces(faces_there, nearest_face.color), 1.0);
    }
    let all = ray.gathered + shading.background * (1.0 - ray.gathered.w);
    var straight = vec3<f32>(0.0);
    if all.w > 0.0 {
        straight = all.rgb / all.w;
    }
    records[group.x * BLOCK_PIXELS + n] = vec4<u32>(
        pack4x8unorm(vec4<f32>(encode(straight), clamp(all.w, 0.0, 1.0))),
        bitcast<u32>(ray.first_s),
        ray.first_id,
        select(UNFINISHED, select(0u, 1u, ray.gathered.w > 0.0), rounds == 2u),
    );
}

fn find_face(v: u32) {
    turn_to(v);
    let part = kept(world_line_of(ray.pixel));
    travellers[v].part = part;
    let face = face_of(line_of(ray.pixel), part);
    cut_faces[v] = face;
    if face.is_face && face.value >= 0.0 && part.begin < nearest_face.s {
        let brightness = brightness_of(face);
        nearest_face = NearestFace(part.begin, vec3<f32>(0.0), params.id);
        if shading.cut_face == TRANSFER {
            nearest_face.color = face_color_at(brightness);
        } else {
            nearest_face.color = grey(brightness);
        }
    }
}

// To where it enters the volume.
fn set_out(v: u32) {
    turn_to(v);
    let whole = travellers[v].part;
    let part = Kept(whole.begin, min(whole.end, nearest_face.s), whole.is_cut, whole.normal);
    walks[v] = begin_travel(line_of(ray.pixel), part, block_of(ray.block).span);
    travellers[v].open = walks[v].s <= walks[v].s_out && part.begin < nearest_face.s;
}

// On to the volume's next cell, if there is none at hand; a stretch begins where the nearest does.
fn go_on_to_cell(v: u32) {
    if travellers[v].open && !travellers[v].has {
        turn_to(v);
        var t = travellers[v];
        var walk = walks[v];
        go_on(&t, &walk);
        travellers[v] = t;
        walks[v] = walk;
    }
    if travellers[v].has {
        ray.from_s = min(ray.from_s, travellers[v].way.s.x);
    }
}

// Where the stretch ends, and whether the volume's cell covers it.
fn reach(v: u32) {
    let s = travellers[v].way.s;
    if travellers[v].has {
        // A cell that is still ahead ends the stretch where it begins.
        ray.to_s = min(ray.to_s, select(s.y, s.x, s.x > ray.from_s));
    }
    covers[v] = travellers[v].has && s.x <= ray.from_s;
}

fn leave(v: u32) {
    travellers[v].fresh = travellers[v].fresh && !covers[v];
    travellers[v].has = travellers[v].has && travellers[v].way.s.y > ray.to_s;
}

fn add_own_face(v: u32) {
    if cut_faces[v].is_face && travellers[v].part.begin == nearest_face.s {
        turn_to(v);
        var all = faces_there;
        add_face(&all, brightness_of(cut_faces[v]), params.color);
        faces_there = all;
    }
}
