// From hits to colours, and the overlay of two skulls.
// The twin of renderer/src/cpu/shade.rs.

#import constants, blocks, hits, nearest, light

struct ShadeLayer {
    // Linear colour and opacity.
    color: vec4<f32>,
    // 1-based number in the scene.
    id: u32,
}

@group(0) @binding(LAYERS) var<storage, read> layers: array<ShadeLayer>;
// For each pixel its colour in 24 bits with the volume's number above, 0 where nothing was hit, and the depth behind the base plane;
// the host makes that a distance along the ray, as float32 is short of digits for a far eye.
@group(0) @binding(PIXELS) var<storage, read_write> pixels: array<vec2<u32>>;
@group(0) @binding(SHADOWS) var<storage, read> shadows: array<u32>;

// Whether the nearest hit and the second one of an overlay are one: how far apart they are across the surface.
fn agree(index: u32, first: u32, second: u32, view: vec3<f32>, mm_per_depth: f32) -> bool {
    let a = hits[first * shading.stride + index];
    let b = hits[second * shading.stride + index];
    let apart_mm = (b.w - a.w) * mm_per_depth * max(abs(dot(a.xyz, view)), abs(dot(b.xyz, view)));
    return a.y != FACE && b.y != FACE && apart_mm <= shading.agreement_mm;
}

// Of what agrees the mean of both, so that it does not matter which is the nearer one.
fn agreed_normal(index: u32, first: u32, second: u32) -> vec3<f32> {
    let own = hits[first * shading.stride + index].xyz;
    let both = own + hits[second * shading.stride + index].xyz;
    let size = length(both);
    if size > 0.0 {
        return both / size;
    }
    return own;
}

// The colour for how far behind the nearest hit the second one lies: more than none where the second volume is the nearer one.
fn depth_color(index: u32, first: u32, second: u32, mm_per_depth: f32) -> vec3<f32> {
    let a = hits[first * shading.stride + index];
    let b = hits[second * shading.stride + index];
    if a.y == FACE || b.y == FACE {
        return layers[first].color.rgb;
    }
    let apart_mm = (b.w - a.w) * mm_per_depth;
    return diverging(select(-apart_mm, apart_mm, layers[first].id > layers[second].id) / shading.depth_range_mm);
}

// The colour of a hit on a surface of some colour, with a normal; `bit` says whether it lies in shadow.
fn light(index: u32, layer: u32, own: vec3<f32>, normal: vec3<f32>, view: vec3<f32>, bit: u32) -> vec3<f32> {
    if normal.y == FACE {
        return face_color(index, layer);
    }
    let share = select(1.0, 0.0, shading.shadows == 1u && (shadows[index] & bit) != 0u);
    let color = phong(own, known_normal(normal, view), view, share);
    return cued(color, hits[layer * shading.stride + index].w);
}

// For each layer FACE_COLORS linear colours, where cuts show them.
@group(0) @binding(FACE_COLORS_OF_LAYERS) var<storage, read> face_colors: array<vec4<f32>>;

// Of the face of one layer's cut.
fn own_color(layer: u32, brightness: f32) -> vec3<f32> {
    if shading.cut_face != TRANSFER {
        return grey(brightness);
    }
    let place = clamp(brightness, 0.0, 1.0) * f32(FACE_COLORS - 1u);
    let below = min(u32(place), FACE_COLORS - 2u);
    let first = layer * FACE_COLORS + below;
    return mix(face_colors[first], face_colors[first + 1u], place - f32(below)).rgb;
}

// The colour of the face of a cut.
fn face_color(index: u32, drawn: u32) -> vec3<f32> {
    let own = hits[drawn * shading.stride + index];
    var cut = no_faces();
    for (var l = 0u; l < shading.passes; l++) {
        // A plane's face is at the same depth in all of them.
        let hit = hits[l * shading.stride + index];
        if hit.y == FACE && hit.w == own.w {
            add_face(&cut, hit.x, layers[l].color.rgb);
        }
    }
    return color_of_faces(cut, own_color(drawn, own.x));
}

@compute @workgroup_size(BLOCK_PIXELS)
fn shade(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    shading = shade_params;
    let index = group.x * BLOCK_PIXELS + n;
    let first = nearest(index, NO_PASS, shading.passes, shading.stride);
    if first == NO_PASS {
        pixels[index] = vec2<u32>(0u);
        return;
    }
    let p = vec2<f32>(blocks[group.x * shading.passes].pixel + pixel_in_block(n));
    let direction = shading.view_base + p.x * shading.view_per_x + p.y * shading.view_per_y;
    let mm_per_depth = length(direction);
    let view = direction / mm_per_depth;
    var second = NO_PASS;
    if shading.overlay == 1u {
        second = nearest(index, first, shading.passes, shading.stride);
    }
    var color: vec3<f32>;
    if second != NO_PASS && shading.depth_range_mm > 0.0 {
        let own = depth_color(index, first, second, mm_per_depth);
        color = light(index, first, own, hits[first * shading.stride + index].xyz, view, FIRST_IS_DARK);
    } else if second != NO_PASS && agree(index, first, second, view, mm_per_depth) {
        color = light(index, first, shading.agreed, agreed_normal(index, first, second), view, FIRST_IS_DARK);
    } else {
        color = light(index, first, layers[first].color.rgb, hits[first * shading.stride + index].xyz, view, FIRST_IS_DARK);
        if second != NO_PASS {
            let opacity = layers[first].color.a;
            let normal = hits[second * shading.stride + index].xyz;
            color = color * opacity + light(index, second, layers[second].color.rgb, normal, view, SECOND_IS_DARK) * (1.0 - opacity);
        }
    }
    let s = hits[first * shading.stride + index].w;
    pixels[index] = vec2<u32>(pack4x8unorm(vec4<f32>(encode(color), 0.0)) | (layers[first].id << 24u), bitcast<u32>(s));
}
