// The nodes of a slice: values on its plane, and where contours cross the ways between neighbours.
// The twin of renderer/src/cpu/slice.rs.

#import constants, line, volume, blocks, hits, cuts, interpolant, field_at, part_within

// The value at a point of the plane, if it has one.
struct Found {
    is_there: bool,
    value: f32,
}

// A point that lies a share of the way from a pixel to its neighbour along an axis: 0 to the right, 1 down.
fn moved(a: PixelAffine, from_pixel: Double, axis: u32, share: f32) -> Double {
    let step = select(a.per_x_hi + a.per_x_lo, a.per_y_hi + a.per_y_lo, axis == 1u);
    return two_sum(from_pixel.hi, from_pixel.lo + share * step);
}

fn value_at(pixel: vec2<u32>, axis: u32, share: f32, s: f32) -> Found {
    var line = line_of(pixel);
    line.origin = moved(params.origin, line.origin, axis, share);
    let at = line_at(line, s);
    let p = at.hi + at.lo;
    if any(p < vec3<f32>(-ON_FACE_VOXEL)) || any(p > vec3<f32>(params.dims - 1) + ON_FACE_VOXEL) {
        return Found(false, 0.0);
    }
    if params.cuts.count > 0u {
        var world = world_line_of(pixel);
        world.origin = moved(params.world_origin, world.origin, axis, share);
        let part = kept(world);
        if part.begin > s || part.end < s {
            return Found(false, 0.0);
        }
    }
    let cell = clamp(vec3<i32>(floor(p)), vec3<i32>(0), params.dims - 2);
    let local = clamp(relative_to(at, vec3<f32>(cell)), vec3<f32>(0.0), vec3<f32>(1.0));
    return Found(holds(cell, local), value_in(cell, local));
}

// Where the contour crosses the way from a pixel, whose value relative to it is known, to its neighbour along an axis.
fn crossing(pixel: vec2<u32>, axis: u32, s: f32, here: f32) -> f32 {
    let there = value_at(pixel + vec2<u32>(1u - axis, axis), axis, 0.0, s);
    if !there.is_there || inside(here) == inside(there.value - params.contour) {
        return NO_CROSSING;
    }
    var low = 0.0;
    var high = 1.0;
    var at_low = here;
    var at_high = there.value - params.contour;
    let low_is_inside = inside(at_low);
    // Which end moved last: −1 the low one, 1 the high one.
    var last = 0;
    for (var n = 0u; n < MOST_SLICE_STEPS; n++) {
        let least = min(0.5 * KNOWN_TO, (high - low) * 0.5);
        let share = min(max(low + (high - low) * (at_low / (at_low - at_high)), low + least), high - least);
        let value = value_at(pixel, axis, share, s).value - params.contour;
        if inside(value) == low_is_inside {
            if last < 0 {
                at_high *= 0.5;
            }
            low = share;
            at_low = value;
            last = -1;
        } else {
            if last > 0 {
                at_low *= 0.5;
            }
            high = share;
            at_high = value;
            last = 1;
        }
        if high - low <= KNOWN_TO {
            break;
        }
    }
    return low + (high - low) * (at_low / (at_low - at_high));
}

// For each node its value relative to the level, where the contour crosses the ways to its right and its lower neighbour, and whether it lies in
// the scan.
@compute @workgroup_size(BLOCK_PIXELS)
fn slice(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    read_params();
    let block = block_of(group.x);
    let pixel = block.pixel + pixel_in_block(n);
    let s = 0.5 * (block.span.x + block.span.y);
    let here = value_at(pixel, 0u, 0.0, s);
    var node = vec4<f32>(here.value, NO_CROSSING, NO_CROSSING, 0.0);
    if here.is_there {
        let value = here.value - params.contour;
        node = vec4<f32>(here.value, crossing(pixel, 0u, s, value), crossing(pixel, 1u, s, value), 1.0);
    }
    hits[params.pass_number * params.stride + group.x * BLOCK_PIXELS + n] = node;
}
