// What within.wgsl and what stands for it say of a way through a cell.

// A part of a way from u to u of [0, 1].
struct WayPart {
    from_u: f32,
    to_u: f32,
    // It begins at a face of the solid.
    at_face: bool,
    is_there: bool,
    // There is another behind it.
    has_more: bool,
}
