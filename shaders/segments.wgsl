// One solver on many segments of cells, for the stability table.

struct Segment {
    lower: vec4<f32>,
    upper: vec4<f32>,
    start: vec3<f32>,
    end: vec3<f32>,
}

@group(0) @binding(0) var<storage, read> segments: array<Segment>;
@group(0) @binding(1) var<storage, read_write> entries: array<f32>;

@compute @workgroup_size(64)
fn solve(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&segments) {
        let s = segments[id.x];
        entries[id.x] = first_entry(s.lower, s.upper, s.start, s.end);
    }
}
