// From hits to colours: Phong's reflection in linear light, and the overlay of two skulls.
// The twin of renderer/src/cpu/shade.rs.

struct ShadeParams {
    // World direction of pixel (0, 0), and its change per pixel.
    view_base: vec3<f32>,
    view_per_x: vec3<f32>,
    view_per_y: vec3<f32>,
    toward_light: vec3<f32>,
    ambient: f32,
    diffuse: f32,
    specular: f32,
    shininess: f32,
    // Hits of pass l start at l · stride.
    stride: u32,
    passes: u32,
    // 1 where the mode is overlay.
    overlay: u32,
    // 1 where light can be kept from what is drawn.
    shadows: u32,
}

struct ShadeLayer {
    // Linear colour and opacity.
    color: vec4<f32>,
    // 1-based number in the scene.
    id: u32,
}

@group(0) @binding(0) var<storage, read> shade_params: ShadeParams;
// The same, read once; see trace.wgsl.
var<private> params: ShadeParams;

@group(0) @binding(1) var<storage, read> hits: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> layers: array<ShadeLayer>;
@group(0) @binding(3) var<storage, read> blocks: array<Block>;
// For each pixel its colour in 24 bits with the volume's number above, 0 where nothing was hit, and the depth behind the base plane;
// the host makes that a distance along the ray, as float32 is short of digits for a far eye.
@group(0) @binding(4) var<storage, read_write> pixels: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read> shadows: array<u32>;

fn phong(color: vec3<f32>, normal: vec3<f32>, view: vec3<f32>, is_lit: bool) -> vec3<f32> {
    let cosine = dot(normal, params.toward_light);
    let lambert = select(0.0, max(cosine, 0.0), is_lit);
    let mirrored = 2.0 * cosine * normal - params.toward_light;
    var highlight = 0.0;
    let reflected = -dot(mirrored, view);
    if lambert > 0.0 && reflected > 0.0 {
        highlight = pow(reflected, params.shininess);
    }
    return color * (params.ambient + params.diffuse * lambert) + params.specular * highlight;
}

// The colour of a hit; `bit` says whether it lies in shadow.
fn light(index: u32, layer: u32, view: vec3<f32>, bit: u32) -> vec3<f32> {
    let normal = hits[layer * params.stride + index].xyz;
    let is_dark = params.shadows == 1u && (shadows[index] & bit) != 0u;
    return phong(layers[layer].color.rgb, select(normal, -view, all(normal == vec3<f32>(0.0))), view, !is_dark);
}

// A linear colour as sRGB.
fn encode(color: vec3<f32>) -> vec3<f32> {
    let c = clamp(color, vec3<f32>(0.0), vec3<f32>(1.0));
    let low = 12.92 * c;
    let high = 1.055 * pow(c, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(high, low, c <= vec3<f32>(0.0031308));
}

@compute @workgroup_size(64)
fn shade(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    params = shade_params;
    let index = group.x * BLOCK_PIXELS + n;
    let first = nearest(index, NONE);
    if first == NONE {
        pixels[index] = vec2<u32>(0u);
        return;
    }
    let p = vec2<f32>(blocks[group.x].pixel + pixel_in_block(n));
    let view = normalize(params.view_base + p.x * params.view_per_x + p.y * params.view_per_y);
    var color = light(index, first, view, FIRST_IS_DARK);
    if params.overlay == 1u {
        let second = nearest(index, first);
        if second != NONE {
            let opacity = layers[first].color.a;
            color = color * opacity + light(index, second, view, SECOND_IS_DARK) * (1.0 - opacity);
        }
    }
    let s = hits[first * params.stride + index].w;
    pixels[index] = vec2<u32>(pack4x8unorm(vec4<f32>(encode(color), 0.0)) | (layers[first].id << 24u), bitcast<u32>(s));
}
