// What the passes over volumes leave of each pixel, one record for each.

#import constants

// In the numbers that shadow rays leave.
const FIRST_IS_DARK: u32 = 1u;
const SECOND_IS_DARK: u32 = 2u;

// Greater than any part of a normal: what was hit is the face of a cut that shows values.
const FACE: f32 = 8.0;

// World normal toward the viewer and s; s < 0 where nothing was hit, a zero normal where there is none or the eye is inside bone. Of the face
// of a cut that shows values: brightness and FACE instead of the normal.
@group(0) @binding(HITS) var<storage, read_write> hits: array<vec4<f32>>;
