// Phong's reflection in linear light, and what becomes of colours on their way.
// The twin of renderer/src/cpu/light.rs.

#import constants

struct ShadeParams {
    // World direction of pixel (0, 0), and its change per pixel.
    view_base: vec3<f32>,
    // How much of Lambert's part what lies in shadow loses.
    shadow: f32,
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
    // What the depth cue takes from a colour for each mm of depth.
    cue_per_mm: f32,
    // Linear and premultiplied.
    background: vec4<f32>,
    // Length of a step of direct volume rendering, and what is added to a pixel's own part of its first step, turned round at 1; −1 where first
    // steps begin in their middle.
    step_mm: f32,
    jitter: f32,
    // What cuts show: the bone's section, values as grey, all volumes' values added, or the first's less the second's.
    cut_face: u32,
    // So deep behind a cut its own normal shades.
    skin_mm: f32,
    // Linear colour of surfaces that agree, and within what they do.
    agreed: vec3<f32>,
    agreement_mm: f32,
    // How far apart surfaces lie at the ends of the colours for depths between them; 0 where these are not told.
    depth_range_mm: f32,
}

@group(0) @binding(SHADE_PARAMS) var<storage, read> shade_params: ShadeParams;
// The same, read once; see volume.wgsl.
var<private> shading: ShadeParams;

// Of a surface that a share of the light comes to.
fn phong(color: vec3<f32>, normal: vec3<f32>, view: vec3<f32>, share: f32) -> vec3<f32> {
    let cosine = dot(normal, shading.toward_light);
    let lambert = max(cosine, 0.0);
    let kept = 1.0 - (1.0 - share) * shading.shadow;
    let mirrored = 2.0 * cosine * normal - shading.toward_light;
    var highlight = 0.0;
    let reflected = -dot(mirrored, view);
    if lambert * share > 0.0 && reflected > 0.0 {
        highlight = pow(reflected, shading.shininess) * share;
    }
    return color * (shading.ambient + shading.diffuse * lambert * kept) + shading.specular * highlight;
}

// Where there is no normal: seen from the front.
fn known_normal(normal: vec3<f32>, view: vec3<f32>) -> vec3<f32> {
    return select(normal, -view, all(normal == vec3<f32>(0.0)));
}

// A colour at depth s on its way to the background's.
fn cued(color: vec3<f32>, s: f32) -> vec3<f32> {
    let share = clamp(s * shading.cue_per_mm, 0.0, 1.0);
    return color * (1.0 - share) + shading.background.rgb * share;
}

// A linear colour as sRGB.
fn encode(color: vec3<f32>) -> vec3<f32> {
    let c = clamp(color, vec3<f32>(0.0), vec3<f32>(1.0));
    let low = SRGB_SLOPE * c;
    let high = SRGB_SCALE * pow(c, vec3<f32>(SRGB_ROOT)) - SRGB_OFFSET;
    return select(high, low, c <= vec3<f32>(SRGB_LINEAR_LIGHT));
}

// An sRGB colour as light.
fn decode(color: vec3<f32>) -> vec3<f32> {
    return select(pow((color + SRGB_OFFSET) / SRGB_SCALE, vec3<f32>(SRGB_POWER)), color / SRGB_SLOPE, color <= vec3<f32>(SRGB_LINEAR));
}

// The light of a brightness, kept between 0 and 1.
fn grey(brightness: f32) -> vec3<f32> {
    return decode(vec3<f32>(clamp(brightness, 0.0, 1.0)));
}

// The volumes that a cut goes through at one place.
struct Faces {
    count: u32,
    // Their brightnesses in their colours, added.
    sum: vec3<f32>,
    // Of the first two.
    brightnesses: vec2<f32>,
}

fn no_faces() -> Faces {
    return Faces(0u, vec3<f32>(0.0), vec2<f32>(0.0));
}

fn add_face(cut: ptr<function, Faces>, brightness: f32, color: vec3<f32>) {
    (*cut).sum += color * grey(brightness);
    if (*cut).count == 0u {
        (*cut).brightnesses.x = brightness;
    } else if (*cut).count == 1u {
        (*cut).brightnesses.y = brightness;
    }
    (*cut).count += 1u;
}

// Their colour; `own` where only the nearest of them is shown.
fn color_of_faces(cut: Faces, own: vec3<f32>) -> vec3<f32> {
    if cut.count < 2u || shading.cut_face < BLEND || shading.cut_face == TRANSFER {
        return own;
    }
    if shading.cut_face == BLEND {
        return min(cut.sum, vec3<f32>(1.0));
    }
    return diverging(cut.brightnesses.x - cut.brightnesses.y);
}

// The linear colour of a difference from −1 to 1.
fn diverging(difference: f32) -> vec3<f32> {
    let end = select(DIVERGING_LOW, DIVERGING_HIGH, difference > 0.0);
    return decode(mix(DIVERGING_MIDDLE, end, min(abs(difference), 1.0)));
}
