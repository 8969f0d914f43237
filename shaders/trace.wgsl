// The pass over one volume: the first hit of every pixel of a batch of blocks, with its normal.
// The twin of renderer/src/cpu/trace.rs.

#import constants, volume, blocks, hits, walk, cuts, faces, field_at, part_within

@compute @workgroup_size(BLOCK_PIXELS)
fn trace(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    read_params();
    let block = block_of(group.x);
    let index = group.x * BLOCK_PIXELS + n;
    // What lies behind an opaque hit is not asked for.
    var s_max = block.span.y;
    if params.only_nearest == 1u {
        for (var l = 0u; l < params.pass_number; l++) {
            let s = hits[l * params.stride + index].w;
            s_max = select(s_max, min(s_max, s), s >= 0.0);
        }
    }
    let pixel = block.pixel + pixel_in_block(n);
    let line = line_of(pixel);
    let part = kept(world_line_of(pixel));
    let face = face_of(line, part);
    if face.is_face {
        hits[params.pass_number * params.stride + index] = vec4<f32>(brightness_of(face), FACE, 0.0, part.begin);
        return;
    }
    let hit = first_hit(line, part.begin, block.span.x, min(s_max, part.end));
    hits[params.pass_number * params.stride + index] =
        vec4<f32>(world_normal(hit, line.direction.hi, part), select(hit.s, -1.0, hit.met == MISSED));
}

fn world_normal(hit: Hit, direction: vec3<f32>, part: Kept) -> vec3<f32> {
    if hit.met == MET_ISOSURFACE || hit.met == MET_SOLID {
        let surface = gradient_at(hit.cell, hit.local);
        return toward_viewer(rim(hit.cell, hit.local, surface, direction, hit.met == MET_SOLID, params.rim_units), direction);
    }
    if hit.met == MET_START && part.is_cut {
        return part.normal;
    }
    // Against the ray; none where the viewer stands inside bone.
    return toward_viewer(select(vec3<f32>(0.0), hit.face, hit.met == MET_FACE), direction);
}
