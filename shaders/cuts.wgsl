// Where cuts let rays begin and end.
// The twin of renderer/src/cpu/cuts.rs.

#import constants, line, volume

// A cut: its normal and its offset, mm. A cylinder or a sphere has three, one for each direction across it.
fn cut_at(n: u32) -> vec4<f32> {
    return extras[params.cuts.first + 2u * n];
}

// The radius of a cylinder or a sphere, or −1 for a plane, and what float32 lacks of the offset.
fn rest_of_cut(n: u32) -> vec2<f32> {
    return extras[params.cuts.first + 2u * n + 1u].xy;
}

// The part of a ray that cuts leave.
struct Kept {
    // Where it begins, and where it ends; the first is the larger where nothing is left.
    begin: f32,
    end: f32,
    // It begins at a cut, and not at the eye.
    is_cut: bool,
    // Of that cut, outward, unit, in the world.
    normal: vec3<f32>,
}

// What is left of a line of the world from s = 0 on.
fn kept(line: Line) -> Kept {
    var part = Kept(0.0, FAR, false, vec3<f32>(0.0));
    var n = 0u;
    while n < params.cuts.count {
        let normal = cut_at(n).xyz;
        let radius = rest_of_cut(n).x;
        let along = along_cut(line, n);
        if radius < 0.0 {
            if along.y < 0.0 {
                enter(&part, -along.x / along.y, normal);
            } else if along.y > 0.0 {
                part.end = min(part.end, -along.x / along.y);
            } else if along.x > 0.0 {
                part.end = -FAR;
            }
            n += 1u;
        } else {
            let second = along_cut(line, n + 1u);
            let third = along_cut(line, n + 2u);
            let a = along.y * along.y + second.y * second.y + third.y * third.y;
            let b = along.x * along.y + second.x * second.y + third.x * third.y;
            let c = along.x * along.x + second.x * second.x + third.x * third.x - radius * radius;
            let discriminant = b * b - a * c;
            if a > 0.0 && discriminant > 0.0 {
                let root = sqrt(discriminant);
                let k = select(-(b + root), root - b, b < 0.0);
                let first = min(k / a, c / k);
                let x = (along.x + first * along.y) / radius;
                let y = (second.x + first * second.y) / radius;
                let z = (third.x + first * third.y) / radius;
                enter(&part, first, x * normal + y * cut_at(n + 1u).xyz + z * cut_at(n + 2u).xyz);
                part.end = min(part.end, max(k / a, c / k));
            } else if c > 0.0 {
                part.end = -FAR;
            }
            n += 3u;
        }
    }
    return part;
}

// How far beyond a cut a line begins, and by how much farther it gets with s.
fn along_cut(line: Line, n: u32) -> vec2<f32> {
    let cut = cut_at(n);
    let origin = (dot(cut.xyz, line.origin.hi) - cut.w) + (dot(cut.xyz, line.origin.lo) - rest_of_cut(n).y);
    return vec2<f32>(origin, dot(cut.xyz, line.direction.hi));
}

fn enter(part: ptr<function, Kept>, s: f32, normal: vec3<f32>) {
    if s > (*part).begin {
        (*part).begin = s;
        (*part).is_cut = true;
        (*part).normal = normal;
    }
}
