// From hits to colours: Phong's reflection in linear light, and the overlay of two skulls.
// The twin of renderer/src/cpu/shade.rs.

struct ShadeParams {
    // World direction of pixel (0, 0) of the tile, and its change per pixel.
    view_base: vec3<f32>,
    view_per_x: vec3<f32>,
    view_per_y: vec3<f32>,
    toward_light: vec3<f32>,
    ambient: f32,
    // Linear, premultiplied.
    background: vec4<f32>,
    diffuse: f32,
    specular: f32,
    shininess: f32,
    // Hits of pass l start at l · stride.
    stride: u32,
    // First pixel of the tile in the picture, and its size.
    corner: vec2<u32>,
    tile: vec2<u32>,
    passes: u32,
    // 1 where the mode is overlay.
    overlay: u32,
}

struct ShadeLayer {
    // Linear colour and opacity.
    color: vec4<f32>,
    // 1-based number in the scene.
    id: u32,
}

@group(0) @binding(0) var<storage, read> tiles: array<ShadeParams>;
// Those of this invocation's tile.
var<private> params: ShadeParams;

@group(0) @binding(1) var<storage, read> hits: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> layers: array<ShadeLayer>;
@group(0) @binding(3) var color_out: texture_storage_2d<rgba8unorm, write>;
// Depth behind the base plane; the host makes it a distance along the ray, as float32 is short of digits for a far eye.
@group(0) @binding(4) var depth_out: texture_storage_2d<r32float, write>;
@group(0) @binding(5) var id_out: texture_storage_2d<r32uint, write>;

// Both sides of a surface are lit.
fn phong(color: vec3<f32>, normal: vec3<f32>, view: vec3<f32>) -> vec3<f32> {
    let n = select(normal, -normal, dot(normal, view) > 0.0);
    let lambert = max(dot(n, params.toward_light), 0.0);
    let mirrored = 2.0 * dot(n, params.toward_light) * n - params.toward_light;
    var highlight = 0.0;
    if lambert > 0.0 {
        highlight = pow(max(-dot(mirrored, view), 0.0), params.shininess);
    }
    return color * (params.ambient + params.diffuse * lambert) + params.specular * highlight;
}

const NONE: u32 = 0xffffffffu;
// WGSL has no NaN; the host turns this into one.
const NO_DEPTH: f32 = -1.0;

// The pass with the nearest hit, leaving out one; NONE when there is none.
fn nearest(pixel: u32, skip: u32) -> u32 {
    var best = NONE;
    var best_s = 0.0;
    for (var l = 0u; l < params.passes; l++) {
        let s = hits[l * params.stride + pixel].w;
        if l != skip && s >= 0.0 && (best == NONE || s < best_s) {
            best = l;
            best_s = s;
        }
    }
    return best;
}

fn shaded(pixel: u32, layer: u32, view: vec3<f32>) -> vec3<f32> {
    let normal = hits[layer * params.stride + pixel].xyz;
    return phong(layers[layer].color.rgb, select(normal, -view, all(normal == vec3<f32>(0.0))), view);
}

fn encode(color: vec4<f32>) -> vec4<f32> {
    let c = color + params.background * (1.0 - color.a);
    if c.a <= 0.0 {
        return vec4<f32>(0.0);
    }
    let straight = clamp(c.rgb / c.a, vec3<f32>(0.0), vec3<f32>(1.0));
    let low = 12.92 * straight;
    let high = 1.055 * pow(straight, vec3<f32>(1.0 / 2.4)) - 0.055;
    return vec4<f32>(select(high, low, straight <= vec3<f32>(0.0031308)), c.a);
}

// A tile has at most 256 × 256 pixels.
const TILE_PIXELS: u32 = 65536u;

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3<u32>) {
    params = tiles[id.z];
    if any(id.xy >= params.tile) {
        return;
    }
    let pixel = id.z * TILE_PIXELS + id.y * params.tile.x + id.x;
    let view = normalize(params.view_base + f32(id.x) * params.view_per_x + f32(id.y) * params.view_per_y);
    var color = vec4<f32>(0.0);
    var s = NO_DEPTH;
    var volume_id = 0u;
    let first = nearest(pixel, NONE);
    if first != NONE {
        color = vec4<f32>(shaded(pixel, first, view), 1.0);
        if params.overlay == 1u {
            let second = nearest(pixel, first);
            if second != NONE {
                let opacity = layers[first].color.a;
                color = vec4<f32>(color.rgb * opacity + shaded(pixel, second, view) * (1.0 - opacity), 1.0);
            }
        }
        s = hits[first * params.stride + pixel].w;
        volume_id = layers[first].id;
    }
    let at = params.corner + id.xy;
    textureStore(color_out, at, encode(color));
    textureStore(depth_out, at, vec4<f32>(s));
    textureStore(id_out, at, vec4<u32>(volume_id));
}
