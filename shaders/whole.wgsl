// Stands for within.wgsl where no volume of a pass is cut by a solid.

#import way_part

fn part_within(cell: vec3<i32>, start: vec3<f32>, end: vec3<f32>, is_second: bool) -> WayPart {
    return WayPart(0.0, 1.0, false, true, false);
}

fn holds(cell: vec3<i32>, local: vec3<f32>) -> bool {
    return true;
}

fn rim(cell: vec3<i32>, local: vec3<f32>, surface: vec3<f32>, direction: vec3<f32>, at_face: bool, rim_units: f32) -> vec3<f32> {
    return surface;
}
