// One solver on many segments of cells, for the stability table. The twin of renderer/src/cpu/segments.rs, which says why. What a
// solver makes of a cell is `entry_of` of corner_segments.wgsl or filter_segments.wgsl.

#import constants, segment_entry

struct Segment {
    lower: vec4<f32>,
    upper: vec4<f32>,
    start: vec3<f32>,
    end: vec3<f32>,
}

struct Solved {
    // Negative where there is none.
    entry: f32,
    entries: u32,
}

@group(0) @binding(SEGMENTS) var<storage, read> segments: array<Segment>;
@group(0) @binding(SOLVED) var<storage, read_write> solved: array<Solved>;

@compute @workgroup_size(BLOCK_PIXELS)
fn solve(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&segments) {
        return;
    }
    let s = segments[id.x];
    let beyond = DECIDED_VOXEL / distance(s.start, s.end);
    var found = Solved(-1.0, 0u);
    var at = 0.0;
    var sign = 1.0;
    for (var root = 0u; root < MOST_ROOTS && at < 1.0; root++) {
        let part = entry_of(id.x, sign, s.start * (1.0 - at) + s.end * at, s.end);
        if part < 0.0 {
            break;
        }
        let u = at + part * (1.0 - at);
        if root == 0u {
            found.entry = u;
        }
        found.entries += select(0u, 1u, sign > 0.0);
        at = u + beyond;
        sign = -sign;
    }
    solved[id.x] = found;
}
