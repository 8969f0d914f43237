// How surfaces answer light: Lambert's law, under a coat of varnish where there is gloss.
// The twin of renderer/src/studio/bsdf.rs, which says why each step is as it is.

#import constants, sampling, stage

// Any surface has a gloss.
override HAS_COAT: bool;

// Share that a dielectric mirrors at a cosine.
fn fresnel(cosine: f32) -> f32 {
    let g = sqrt(ETA * ETA - 1.0 + cosine * cosine);
    let sum = g + cosine;
    let less = g - cosine;
    let a = less / sum;
    let b = (cosine * sum - 1.0) / (cosine * less + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}

// GGX's density of half vectors at the square of their cosine.
fn density(cosine_squared: f32) -> f32 {
    let k = 1.0 + cosine_squared * (ALPHA * ALPHA - 1.0);
    return ALPHA * ALPHA * FRAC_1_PI / (k * k);
}

// A direction's part of Smith's masking.
fn way_out(c: f32, d: f32) -> f32 {
    return d * sqrt(ALPHA * ALPHA + (1.0 - ALPHA * ALPHA) * c * c);
}

// Smith's masking of both directions together, over four times the product of their cosines.
fn visible(out: f32, into: f32) -> f32 {
    return 0.5 / (way_out(out, into) + way_out(into, out));
}

// A surface at a point.
struct Face {
    albedo: vec3<f32>,
    // That shades, and the way to the viewer; unit.
    normal: vec3<f32>,
    out: vec3<f32>,
    // 0 where it has no coat.
    gloss: f32,
}

// What a surface answers at a point.
struct Answer {
    // Reflected radiance of a light from there of 1 a steradian.
    light: vec3<f32>,
    // Density of sampling that direction.
    density: f32,
}

// What the coat reflects at a cosine, of a surface with a gloss.
fn coat_at(gloss: f32, cosine: f32) -> f32 {
    let place = clamp(cosine, 0.0, 1.0) * f32(COAT_ALBEDOS - 1u);
    let first = min(floor(place), f32(COAT_ALBEDOS - 2u));
    let low = stage_params.albedo[u32(first)];
    let high = stage_params.albedo[u32(first) + 1u];
    return gloss * (low + (high - low) * (place - first));
}

// The answer of a surface to light from `into`; none from behind.
fn answer(surface: Face, into: vec3<f32>) -> Answer {
    let gloss = surface.gloss;
    let cosine = max(dot(surface.normal, into), 0.0);
    if !HAS_COAT {
        let share = cosine * FRAC_1_PI;
        return Answer(surface.albedo * share, share);
    }
    let out_cosine = max(dot(surface.normal, surface.out), LEAST_COSINE);
    let kept_by_coat = coat_at(gloss, out_cosine);
    let half = normalized(surface.out + into);
    let n_h = max(dot(surface.normal, half), 0.0);
    let o_h = max(dot(surface.out, half), LEAST_HALF);
    let d = density(n_h * n_h);
    let mirrored = select(0.0, gloss * fresnel(o_h) * d * visible(out_cosine, max(cosine, LEAST_HALF)) * cosine, cosine > 0.0);
    let below = (1.0 - kept_by_coat) * (1.0 - coat_at(gloss, cosine)) / (1.0 - gloss * stage.coat_mean) * cosine * FRAC_1_PI;
    let density = kept_by_coat * d * n_h / (4.0 * o_h) + (1.0 - kept_by_coat) * cosine * FRAC_1_PI;
    return Answer(surface.albedo * below + mirrored, select(0.0, density, cosine > 0.0));
}

// A direction to follow, of a point on the disc and a number that chooses between coat and what is below.
fn sample_face(surface: Face, p: vec2<f32>, choice: f32) -> vec3<f32> {
    let across = frame(surface.normal);
    let below = combined(across, surface.normal, vec3<f32>(p, above_disc(p)));
    if !HAS_COAT {
        return below;
    }
    // GGX's half vectors: their cosine by the disc's radius, their way round by its angle.
    let r_squared = min(p.x * p.x + p.y * p.y, 1.0);
    let n_h = sqrt(max((1.0 - r_squared) / (1.0 + r_squared * (ALPHA * ALPHA - 1.0)), 0.0));
    var scale = 0.0;
    if r_squared > 0.0 {
        scale = sqrt(max(1.0 - n_h * n_h, 0.0) / r_squared);
    }
    let half = combined(across, surface.normal, vec3<f32>(p * scale, n_h));
    let o_h = dot(surface.out, half);
    let is_coat = choice < coat_at(surface.gloss, max(dot(surface.normal, surface.out), LEAST_COSINE));
    return select(below, 2.0 * o_h * half - surface.out, is_coat);
}

// The power heuristic: the share of a way of sampling of density `a` beside one of density `b`.
fn power(a: f32, b: f32) -> f32 {
    let sum = a * a + b * b;
    if sum > 0.0 {
        return a * a / sum;
    }
    return 0.0;
}
