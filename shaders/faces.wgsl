// The faces of cuts that show values.
// The twin of renderer/src/cpu/faces.rs.

#import constants, line, volume, cuts, field_at

// The face of a cut that shows values.
struct Face {
    is_face: bool,
    // Relative to the level, positive inside.
    value: f32,
}

fn brightness_of(face: Face) -> f32 {
    return face.value * params.brightness.x + params.brightness.y;
}

fn face_of(line: Line, part: Kept) -> Face {
    if params.shows_faces == 0u || !part.is_cut || part.begin > part.end {
        return Face(false, 0.0);
    }
    let at = line_at(line, part.begin);
    let p = at.hi + at.lo;
    if any(p < vec3<f32>(-ON_FACE_VOXEL)) || any(p > vec3<f32>(params.dims - 1) + ON_FACE_VOXEL) {
        return Face(false, 0.0);
    }
    let cell = clamp(vec3<i32>(floor(p)), vec3<i32>(0), params.dims - 2);
    let local = clamp(relative_to(at, vec3<f32>(cell)), vec3<f32>(0.0), vec3<f32>(1.0));
    return Face(true, value_in(cell, local));
}

// What lies among the colours of faces at a brightness.
fn face_color_at(brightness: f32) -> vec3<f32> {
    let place = clamp(brightness, 0.0, 1.0) * f32(FACE_COLORS - 1u);
    let below = min(u32(place), FACE_COLORS - 2u);
    let first = params.face_colors.first + below;
    return mix(extras[first], extras[first + 1u], place - f32(below)).rgb;
}
