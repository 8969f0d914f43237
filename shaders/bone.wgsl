// The surfaces that paths meet: those of the picture, found by its own walk, with its own normals.
// The twin of renderer/src/studio/bone.rs.

#import constants, line, volume, walk, cuts, interpolant, samples, gradient, part_within
#each first, is_between

// What a ray meets first.
struct Seen {
    is_seen: bool,
    // Along the ray, mm.
    far: f32,
    // In the world.
    at: Double,
    // Unit, of the surface itself and of its shading, both toward the viewer.
    geometric: vec3<f32>,
    shading: vec3<f32>,
    // Linear.
    color: vec3<f32>,
}

// A ray of the world: its origin, and its unit direction.
struct Rays {
    origin: Double,
    direction: vec3<f32>,
}

// The ray at hand, and what it has met so far; of a ray to a lamp how far it goes, and whether something is between.
var<private> rays: Rays;
var<private> seen: Seen;
var<private> until_lamp: f32;
var<private> is_dark: bool;

// Of a volume the first surface along the ray, if it is nearer than what is seen.
fn first(v: u32) {
    turn_to(v);
    let way = lines();
    let s_max = min(seen.far, way.part.end);
    if s_max >= way.part.begin {
        let hit = first_hit(way.line, way.part.begin, 0.0, s_max);
        if hit.met != MISSED {
            see(way, hit);
        }
    }
}

// Whether a surface of a volume lies between the ray's origin and the lamp.
fn is_between(v: u32) {
    turn_to(v);
    if !is_dark {
        let way = lines();
        let s_max = min(until_lamp, way.part.end);
        if s_max >= way.part.begin {
            is_dark = first_hit(way.line, way.part.begin, 0.0, s_max).met != MISSED;
        }
    }
}

// The ray in the index space of the volume at hand, and what cuts leave of it.
struct Lines {
    line: Line,
    part: Kept,
}

fn lines() -> Lines {
    let origin = moved(params.to_index, rays.origin);
    let direction = turned(params.to_index, Double(rays.direction, vec3<f32>(0.0)));
    return Lines(Line(origin, direction), kept(Line(rays.origin, Double(rays.direction, vec3<f32>(0.0)))));
}

// A vector in another space.
fn turned(by: Affine, v: Double) -> Double {
    let none = Double(vec3<f32>(0.0), vec3<f32>(0.0));
    return moved(Affine(by.x, by.y, by.z, none), v);
}

// A point in another space.
fn moved(by: Affine, p: Double) -> Double {
    let x = line_at(Line(by.at, by.x), p.hi.x);
    let y = line_at(Line(x, by.y), p.hi.y);
    let z = line_at(Line(y, by.z), p.hi.z);
    let small = p.lo.x * by.x.hi + p.lo.y * by.y.hi + p.lo.z * by.z.hi;
    return two_sum(z.hi, z.lo + small);
}

// Takes over what a hit is.
fn see(way: Lines, hit: Hit) {
    let lower = corners(hit.cell);
    let upper = corners(hit.cell + vec3<i32>(0, 0, 1));
    let along = way.line.direction.hi;
    let at_face = hit.met == MET_SOLID;
    let own = gradient(lower, upper, hit.local);
    seen.geometric = normal_of(way, hit, rim(hit.cell, hit.local, own, along, at_face, 0.0));
    if params.analytic_normals == 1u {
        seen.shading = normal_of(way, hit, rim(hit.cell, hit.local, own, along, at_face, params.rim_units));
    } else {
        let smoothed = smooth_gradient(hit.cell, hit.local);
        seen.shading = normal_of(way, hit, rim(hit.cell, hit.local, smoothed, along, at_face, params.rim_units));
    }
    // The cell's number is exact, and what lies within it is small.
    seen.at = moved(params.to_world, Double(vec3<f32>(hit.cell), hit.local));
    seen.color = params.color;
    seen.far = hit.s;
    seen.is_seen = true;
}

// The normal in the world: against the ray on the face of a box; on a cut that cut's own; against the ray where it begins in bone.
fn normal_of(way: Lines, hit: Hit, gradient: vec3<f32>) -> vec3<f32> {
    if hit.met == MET_START {
        return select(-rays.direction, way.part.normal, way.part.is_cut);
    }
    let normal = toward_viewer(select(gradient, hit.face, hit.met == MET_FACE), way.line.direction.hi);
    return select(-rays.direction, normal, any(normal != vec3<f32>(0.0)));
}
