//! Where a pass finds what it reads and writes: numbers that shaders know by the same names.

macro_rules! bindings {
    ($($number:literal $name:ident: $what:literal;)*) => {
        $(#[doc = $what] pub const $name: u32 = $number;)*

        /// The numbers as WGSL.
        pub fn declared() -> String {
            [$(concat!("const ", stringify!($name), ": u32 = ", $number, "u;\n")),*].concat()
        }
    };
}

bindings! {
    0 TRACE_PARAMS: "A `TraceParams` for each volume.";
    1 SHADE_PARAMS: "`ShadeParams`.";
    2 BLOCKS: "The blocks of a batch.";
    3 EXTRAS: "What volumes have any number of.";
    4 HITS: "What passes over volumes leave of each pixel.";
    5 SHADOWS: "Which hits lie in shadow.";
    6 LIGHT_SPANS: "How far the light sees.";
    7 LAYERS: "A `ShadeLayer` for each volume.";
    8 FACE_COLORS_OF_LAYERS: "The colours of faces of cuts.";
    9 PIXELS: "The picture of the shading pass.";
    10 RECORDS: "The picture of a march.";
    11 SAMPLER: "How texels are fetched.";
    12 SEGMENTS: "Segments of cells to solve.";
    13 SOLVED: "What is found in them.";
    14 SEGMENT_CELLS: "Their corners as a texture.";
    15 SOLIDS: "The solids that volumes are cut by.";
    16 STAGE_PARAMS: "`StageParams` of paths.";
    17 PATHS: "Paths on their way.";
    18 SUMS: "What samples have found.";
    19 UNDER_WAY: "The pixels that have yet to go on.";
    20 STILL_UNDER_WAY: "Those of the next dispatch.";
}

/// Behind all others: three for each volume.
const FIRST_TEXTURE: u32 = 21;

/// Of the samples, the map of bricks and the masks of cells of volume `n`.
pub fn textures(n: usize) -> [u32; 3] {
    [0, 1, 2].map(|which| FIRST_TEXTURE + 3 * n as u32 + which)
}
