// What of a ray's way through a cell lies within the solid that a volume is cut by, and the faces that this leaves.
// The twin of renderer/src/cpu/within.rs.

#import constants, way_part, volume, interpolant, bernstein, cubic

// For each solid the sides of bricks, four to a number; for each block of samples 0 where it is outside, 1 inside, and else 2 and the number of its
// distances; and these, two to a number.
@group(0) @binding(SOLIDS) var<storage, read> solids: array<u32>;

// On which side the cells of a cell's brick lie.
fn side_at(cell: vec3<i32>) -> u32 {
    let brick = cell / BRICK;
    let n = u32((brick.z * params.bricks.y + brick.y) * params.bricks.x + brick.x);
    return (solids[params.solid.x + n / 4u] >> (n % 4u * 8u)) & 0xffu;
}

// How far within the solid a sample is, in units.
fn units_at(sample: vec3<i32>) -> f32 {
    let blocks = (params.dims + BRICK - 1) / BRICK;
    let block = sample / BRICK;
    let slot = solids[params.solid.y + u32((block.z * blocks.y + block.y) * blocks.x + block.x)];
    if slot < SOLID_FIRST {
        return select(-SOLID_FARTHEST, SOLID_FARTHEST, slot == SOLID_INSIDE);
    }
    let local = sample % BRICK;
    let n = u32((local.z * BRICK + local.y) * BRICK + local.x);
    let word = solids[params.solid.z + (slot - SOLID_FIRST) * u32(BRICK * BRICK * BRICK / 2) + n / 2u];
    return f32(bitcast<i32>(word << (16u - n % 2u * 16u)) >> 16u);
}

// Of the corners of a cell those with z = 0 or 1.
fn units_around(cell: vec3<i32>) -> vec4<f32> {
    return vec4<f32>(
        units_at(cell),
        units_at(cell + vec3<i32>(1, 0, 0)),
        units_at(cell + vec3<i32>(0, 1, 0)),
        units_at(cell + vec3<i32>(1, 1, 0)),
    );
}

// Whether the surface of the solid may pass the cells of a cell's brick.
fn is_near(cell: vec3<i32>) -> bool {
    return params.solid.x != NO_SOLID && side_at(cell) == SOLID_BOTH;
}

// The first part of a way, or the second.
fn part_within(cell: vec3<i32>, start: vec3<f32>, end: vec3<f32>, is_second: bool) -> WayPart {
    if !is_near(cell) {
        return WayPart(0.0, 1.0, false, true, false);
    }
    let b = bernstein(units_around(cell), units_around(cell + vec3<i32>(0, 0, 1)), start, end);
    // Between two of these the cubic does not turn.
    let turns = turning_points(b);
    // Where it changes sides: at most three times.
    var roots = vec3<f32>(NO_PART);
    var count = 0u;
    var from_u = 0.0;
    var from_value = b.x;
    for (var n = 0u; n < 3u; n++) {
        let to_u = select(select(1.0, turns.y, n == 1u), turns.x, n == 0u);
        let to_value = select(b.w, cubic_value(b, to_u), n < 2u);
        if inside(from_value) != inside(to_value) {
            let side = select(1.0, -1.0, inside(from_value));
            let root = refine(b * side, from_u, from_value * side, to_u, to_value * side);
            roots = select(roots, vec3<f32>(root), vec3<u32>(0u, 1u, 2u) == vec3<u32>(count));
            count += 1u;
        }
        from_u = to_u;
        from_value = to_value;
    }
    let begins = inside(b.x);
    let second = select(vec2<f32>(roots.z, 1.0), vec2<f32>(roots.y, min(roots.z, 1.0)), begins);
    if is_second {
        return WayPart(second.x, second.y, second.x > 0.0, second.x < NO_PART, false);
    }
    let first = select(vec2<f32>(roots.x, min(roots.y, 1.0)), vec2<f32>(0.0, min(roots.x, 1.0)), begins);
    let is_there = first.x < NO_PART;
    return WayPart(first.x, first.y, !begins || b.x < AT_FACE_UNITS, is_there, is_there && second.x < NO_PART);
}

// Whether a point of a cell lies within the solid.
fn holds(cell: vec3<i32>, local: vec3<f32>) -> bool {
    if params.solid.x == NO_SOLID {
        return true;
    }
    let side = side_at(cell);
    if side != SOLID_BOTH {
        return side == SOLID_INSIDE;
    }
    return inside(trilinear(units_around(cell), units_around(cell + vec3<i32>(0, 0, 1)), local));
}

fn unit_toward(v: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let size = length(v);
    if size > 0.0 {
        return v * select(1.0 / size, -1.0 / size, dot(v, direction) > 0.0);
    }
    return vec3<f32>(0.0);
}

// The normal where the solid cuts bone: its own at its face, and for `rim_units` behind it a blend with the surface's, both in index space and toward
// the viewer, who looks along `direction`.
fn rim(cell: vec3<i32>, local: vec3<f32>, surface: vec3<f32>, direction: vec3<f32>, at_face: bool, rim_units: f32) -> vec3<f32> {
    if !is_near(cell) {
        return surface;
    }
    let lower = units_around(cell);
    let upper = units_around(cell + vec3<i32>(0, 0, 1));
    let share = select(clamp(trilinear(lower, upper, local) / max(rim_units, SMALLEST), 0.0, 1.0), 0.0, at_face);
    if share >= 1.0 {
        return surface;
    }
    return unit_toward(gradient(lower, upper, local), direction) * (1.0 - share) + unit_toward(surface, direction) * share;
}
