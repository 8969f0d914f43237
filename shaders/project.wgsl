// Maximum, minimum and integral of the interpolant along rays, or of its gradient's magnitude.
// The twin of renderer/src/cpu/project.rs, which takes all values in other ways: a packet of rays waits for its slowest, an invocation hardly does.

#import constants, line, volume, blocks, hits, walk, cells, cuts, cubic, bernstein, gradient, intervals

// 1 where it is the largest value, -1 where the smallest, 0 where it is the integral; and whether of the gradient's magnitude and not of the value.
override EXTREME: f32;
override OF_GRADIENT: bool;
// Whether only what has values in a range counts; compiled out where not, as walks take a third longer beside it.
override IN_RANGE: bool;

// What a cell gives: whether any of it counts, the extreme, times its side, or the mean, and the part of the way through it that counts; the
// mean is times this.
struct Projected {
    found: bool,
    value: f32,
    depth: f32,
}

// For each pixel the extreme value or the integral over depth, the depth over which that is, and whether the ray has met the volume; relative
// to the level, in sample units, and of gradients in these per mm.
@compute @workgroup_size(BLOCK_PIXELS)
fn project(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    read_params();
    let block = block_of(group.x);
    let pixel = block.pixel + pixel_in_block(n);
    let part = kept(world_line_of(pixel));
    var walk = begin_walk(line_of(pixel), part.begin, block.span.x, min(block.span.y, part.end));
    var value = 0.0;
    // What rounding has lost of it (Kahan 1965).
    var lost = 0.0;
    var depth = 0.0;
    var found = 0.0;
    if walk.s <= walk.s_out {
        while arrive(&walk) {
            var place = walk.place;
            let way = until(cross_cell(walk.pace, walk.at, &place), walk.s_max);
            walk.place = place;
            if !way.is_there {
                continue;
            }
            let length = way.s.y - way.s.x;
            var cell = Projected(true, 0.0, 1.0);
            if IN_RANGE {
                cell = within_range(way);
            } else if OF_GRADIENT {
                cell.value = of_gradient(way, 0.0, 1.0);
            } else {
                cell.value = of_values(way, value, found > 0.0);
            }
            if !cell.found {
                continue;
            }
            if EXTREME != 0.0 {
                value = select(value, cell.value, found == 0.0 || cell.value > value);
            } else {
                let added = cell.value * length - lost;
                let sum = opaque(vec3<f32>(value + added)).x;
                lost = opaque(vec3<f32>(sum - value)).x - added;
                value = sum;
                depth += cell.depth * length;
            }
            found = 1.0;
        }
    }
    if EXTREME != 0.0 {
        value *= EXTREME;
    }
    hits[params.pass_number * params.stride + group.x * BLOCK_PIXELS + n] = vec4<f32>(value, depth, 0.0, found);
}

// The extreme, times its side, or the mean of the values in a cell; an extreme that is not above a known one may be any that is not.
fn of_values(way: CellPass, known: f32, is_known: bool) -> f32 {
    let values = bernstein(way.lower, way.upper, way.start, way.end);
    if EXTREME == 0.0 {
        return (values.x + values.y + values.z + values.w) * 0.25;
    }
    let b = values * EXTREME;
    let ends = max(b.x, b.w);
    if max(b.y, b.z) <= select(ends, max(ends, known), is_known) {
        return ends;
    }
    let turns = turning_points(b);
    return max(ends, max(cubic_value(b, turns.x), cubic_value(b, turns.y)));
}

// What of a cell has values in the range, interval by interval.
fn within_range(way: CellPass) -> Projected {
    let b = bernstein(way.lower, way.upper, way.start, way.end);
    var all = Projected(false, 0.0, 0.0);
    var u = 0.0;
    var above = count_levels(b.x);
    var from_value = b.x;
    while u < 1.0 {
        let end = next_end(b, u, 1.0, above);
        let width = end.u - u;
        // Where an end of the range is passed the value is that end.
        var to_value = cubic_value(b, end.u);
        if end.passes {
            to_value = level_at(select(above - 1, above, end.rises));
        }
        if above == 1 {
            var here: f32;
            if OF_GRADIENT {
                here = of_gradient(way, u, width);
            } else if EXTREME != 0.0 {
                here = max(from_value * EXTREME, to_value * EXTREME);
            } else {
                here = (cubic_value(b, u + width * (0.5 - TWO_POINTS)) + cubic_value(b, u + width * (0.5 + TWO_POINTS))) * 0.5;
            }
            if EXTREME != 0.0 {
                all.value = select(all.value, here, !all.found || here > all.value);
            } else {
                all.value += here * width;
                all.depth += width;
            }
            all.found = true;
        }
        if end.passes {
            above += select(-1, 1, end.rises);
        }
        u = end.u;
        from_value = to_value;
    }
    return all;
}

// The extreme, times its side, or the mean of the gradient's magnitude in a part of the way through a cell, in sample units per mm.
fn of_gradient(way: CellPass, u: f32, width: f32) -> f32 {
    if EXTREME == 0.0 {
        let at = vec4<f32>(magnitude(way, u + width * GAUSS_NODES.x), magnitude(way, u + width * GAUSS_NODES.y), magnitude(way, u + width * GAUSS_NODES.z), magnitude(way, u + width * GAUSS_NODES.w));
        return dot(at, GAUSS_WEIGHTS);
    }
    let step = 1.0 / f32(INTERVALS);
    var before = EXTREME * magnitude(way, u);
    var here = EXTREME * magnitude(way, u + width * step);
    var largest = max(before, here);
    for (var n = 1u; n < INTERVALS; n++) {
        let after = EXTREME * magnitude(way, u + width * (f32(n + 1u) * step));
        let bend = before - 2.0 * here + after;
        var top = 0.0;
        if bend < 0.0 {
            top = clamp(0.5 * (before - after) / bend, -1.0, 1.0);
        }
        largest = max(largest, max(after, EXTREME * magnitude(way, u + width * ((top + f32(n)) * step))));
        before = here;
        here = after;
    }
    return largest;
}

fn magnitude(way: CellPass, u: f32) -> f32 {
    return length(params.gradient_to_world * gradient(way.lower, way.upper, way.start * (1.0 - u) + way.end * u));
}
