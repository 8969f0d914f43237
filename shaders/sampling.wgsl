// The numbers that paths are drawn by, and what is made of them: points of pixels, discs, and directions.
// The twin of renderer/src/studio/sampling.rs, which says why each step is as it is; integers are the same to the bit.

#import constants

// What all bits of a number depend on alike.
fn mixed(v: u32) -> u32 {
    var x = v;
    x = (x ^ (x >> 16u)) * MIX.x;
    x = (x ^ (x >> 15u)) * MIX.y;
    return x ^ (x >> 16u);
}

// The key of a pixel's numbers in one of the two halves.
fn key(pixel: u32, seed: u32, half: u32) -> u32 {
    return mixed(pixel ^ mixed(seed * 2u + half));
}

// Each bit turned by a hash of those below it.
fn owen(v: u32, seed: u32) -> u32 {
    var x = v;
    x ^= x * OWEN.x;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * OWEN.y;
    return x ^ (x * OWEN.z);
}

// Pascal's triangle modulo 2 times a number: the second coordinate of Sobol's sequence, bits reversed.
fn pascal(v: u32) -> u32 {
    var x = v;
    x ^= x >> 16u;
    x ^= (x >> 8u) & 0x00ff00ffu;
    x ^= (x >> 4u) & 0x0f0f0f0fu;
    x ^= (x >> 2u) & 0x33333333u;
    return x ^ ((x >> 1u) & 0x55555555u);
}

// A number from 0 to 1, less than 1.
fn unit(x: u32) -> f32 {
    return f32(x >> 8u) / 16777216.0;
}

// Pair number `dimension` of the sample number `index` of a pixel with such a key.
fn pair(key: u32, index: u32, dimension: u32) -> vec2<f32> {
    let a = mixed(key + APART * (dimension + 1u));
    let b = a * PCG.x + PCG.y;
    let c = b * PCG.x + PCG.y;
    let r = reverseBits(owen(reverseBits(index), a));
    return vec2<f32>(unit(reverseBits(owen(r, b))), unit(reverseBits(owen(pascal(r), c))));
}

// From the middle of a pixel, by the tent that falls from there to the next pixels' middles.
fn tent(u: f32) -> f32 {
    let low = sqrt(2.0 * u) - 1.0;
    let high = 1.0 - sqrt(max(2.0 - 2.0 * u, 0.0));
    return select(high, low, u < 0.5);
}

// Evenly on the unit disc.
fn disc(numbers: vec2<f32>) -> vec2<f32> {
    let p = 2.0 * numbers - 1.0;
    let is_first = abs(p.x) > abs(p.y);
    let r = select(p.y, p.x, is_first);
    let other = select(p.x, p.y, is_first);
    var angle = 0.0;
    if r != 0.0 {
        angle = other / r * FRAC_PI_4;
    }
    let t = angle * angle;
    let sine = angle * (1.0 - t * (1.0 / 6.0) * (1.0 - t * (1.0 / 20.0) * (1.0 - t * (1.0 / 42.0) * (1.0 - t * (1.0 / 72.0)))));
    let cosine = 1.0 - t * 0.5 * (1.0 - t * (1.0 / 12.0) * (1.0 - t * (1.0 / 30.0) * (1.0 - t * (1.0 / 56.0) * (1.0 - t * (1.0 / 90.0)))));
    let along = r * cosine;
    let across = r * sine;
    return select(vec2<f32>(across, along), vec2<f32>(along, across), is_first);
}

// Two unit vectors across a unit one.
struct Across {
    u: vec3<f32>,
    v: vec3<f32>,
}

fn frame(n: vec3<f32>) -> Across {
    // Of negative zero, too, the sign is negative.
    let sign = select(1.0, -1.0, (bitcast<u32>(n.z) >> 31u) == 1u);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    return Across(
        vec3<f32>(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        vec3<f32>(b, sign + n.y * n.y * a, -n.y),
    );
}

// What has these coordinates along two vectors and a third.
fn combined(across: Across, w: vec3<f32>, p: vec3<f32>) -> vec3<f32> {
    return p.x * across.u + p.y * across.v + p.z * w;
}

// About a normal, by the cosine: straight up from the disc.
fn above_disc(p: vec2<f32>) -> f32 {
    return sqrt(max(1.0 - p.x * p.x - p.y * p.y, 0.0));
}

fn normalized(v: vec3<f32>) -> vec3<f32> {
    return v / sqrt(dot(v, v));
}
