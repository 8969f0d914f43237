//! The shaders of a pass, linked from the modules in `shaders/`.
//!
//! A module is a file of WGSL that names on lines of `#import` what it needs of others, by their files' names. Two modules are written from
//! Rust: `constants`, and `volumes`, the textures of the volumes that a pass goes through. A *slot* is an import that several files can fill,
//! such as the solver: a pass says which. On lines of `#each` a module names functions of a volume's number, and gets as many that call them for
//! every volume of the pass. What differs in numbers alone is an `override` of WGSL, set when the pipeline is made.

use super::bindings::{self, declared as binding_numbers};
use super::constants::constants;

/// How a pass reads the samples of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reads {
    /// Component type of their texture.
    pub component: Component,
    /// From an array of 2D textures, not from a 3D texture.
    pub in_layers: bool,
    /// Of what lies within a solid.
    pub is_cut: bool,
}

/// Component types of textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    U32,
    I32,
    F32,
}

macro_rules! modules {
    ($($name:literal),* $(,)?) => {
        /// Every file of `shaders/`.
        const MODULES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../../../shaders/", $name, ".wgsl")))),*];
    };
}

modules![
    "analytic",
    "bernstein",
    "blocks",
    "bone",
    "brick",
    "bsdf",
    "cells",
    "corner_cells",
    "corner_segments",
    "cubic",
    "cuts",
    "dvr",
    "dvr_exact",
    "dvr_steps",
    "exact",
    "faces",
    "filter",
    "filter_cells",
    "filter_segments",
    "filtered",
    "gradient",
    "ground",
    "hits",
    "interpolant",
    "intervals",
    "lamps",
    "let_through",
    "light",
    "line",
    "linear",
    "march",
    "marmitt",
    "nearest",
    "neubauer",
    "path",
    "project",
    "ray",
    "samples",
    "sampling",
    "segment_steps",
    "segments",
    "shade",
    "shadows",
    "slice",
    "spline",
    "stage",
    "steps",
    "to_light",
    "trace",
    "transparent",
    "traveller",
    "unread",
    "unsolved",
    "volume",
    "voxels",
    "walk",
    "way_part",
    "whole",
    "within",
];

/// Imports that several files can fill, and the file that does unless a pass says otherwise.
const SLOTS: &[(&str, &str)] = &[
    ("cell_entry", "corner_cells"),
    ("cubic_entry", "cubic"),
    ("field_at", "gradient"),
    ("in_brick", "cells"),
    ("integrate", "transparent"),
    ("part_within", "whole"),
    ("segment_entry", "corner_segments"),
    ("solver", "exact"),
];

/// The WGSL of module `root` with all that it imports, each once; `filled` says what fills slots, or stands for a file, in this pass over
/// volumes that are read so.
pub(super) fn link(root: &str, filled: &[(&str, &str)], volumes: &[Reads]) -> String {
    let cut = volumes.iter().any(|reads| reads.is_cut).then_some(("part_within", "within"));
    let filled = &[filled, cut.as_slice()].concat();
    let mut linker = Linker { filled, volumes, linked: vec![], source: String::new() };
    linker.add(root);
    linker.source
}

struct Linker<'a> {
    filled: &'a [(&'a str, &'a str)],
    volumes: &'a [Reads],
    linked: Vec<String>,
    source: String,
}

impl Linker<'_> {
    /// Writes a function that calls `function` with the number of one volume after the other. A loop over volumes would do the same, but drivers
    /// keep what is indexed by a variable in memory: of two volumes llvmpipe draws three times as long so.
    fn call_for_each(&mut self, function: &str) {
        let calls: String = (0..self.volumes.len()).map(|n| format!("    {function}({n}u);\n")).collect();
        self.source.push_str(&format!("fn each_{function}() {{\n{calls}}}\n"));
    }

    fn add(&mut self, import: &str) {
        let name = self.filled.iter().chain(SLOTS).find(|(slot, _)| *slot == import).map_or(import, |(_, file)| file);
        if self.linked.iter().any(|known| known == name) {
            return;
        }
        self.linked.push(name.to_owned());
        let text = match name {
            "constants" => format!("{}{}", constants(), binding_numbers()),
            "volumes" => volumes_source(self.volumes),
            // A test links every file.
            _ => MODULES
                .iter()
                .find(|(file, _)| *file == name)
                .map_or_else(|| panic!("no shader is called {name}"), |(_, text)| (*text).into()),
        };
        for line in text.lines() {
            let names = |directive| line.strip_prefix(directive).into_iter().flat_map(|names| names.split(',').map(str::trim));
            names("#import").for_each(|import| self.add(import));
            names("#each").for_each(|function| self.call_for_each(function));
        }
        text.lines().filter(|line| !line.starts_with('#')).for_each(|line| {
            self.source.push_str(line);
            self.source.push('\n');
        });
    }
}

/// The textures of the volumes of a pass, and how those of the volume at hand are read.
fn volumes_source(volumes: &[Reads]) -> String {
    let mut source = format!("const VOLUMES: u32 = {}u;\n", volumes.len());
    for (n, reads) in volumes.iter().enumerate() {
        let [samples, map, masks] = bindings::textures(n);
        let component = match reads.component {
            Component::U32 => "u32",
            Component::I32 => "i32",
            Component::F32 => "f32",
        };
        let texture = if reads.in_layers { "texture_2d_array" } else { "texture_3d" };
        source += &format!("@group(0) @binding({samples}) var samples_{n}: {texture}<{component}>;\n");
        source += "// For each brick its distance from the surface, and above 8 bits the number of its mask; and the box of the cells that this names.\n";
        source += &format!("@group(0) @binding({map}) var map_{n}: texture_storage_3d<rg32uint, read>;\n");
        source += "// 16 numbers for each mask, side by side, two for each layer of cells: bit x + 8y of a layer is cell (x, y).\n";
        source += &format!("@group(0) @binding({masks}) var masks_{n}: texture_storage_2d<r32uint, read>;\n");
    }
    if volumes.iter().any(|reads| reads.in_layers) {
        source += &format!("@group(0) @binding({}) var nearest_texels: sampler;\n", bindings::SAMPLER);
    }
    let all = |read: &dyn Fn(usize) -> String| {
        let cases = (0..volumes.len() - 1).map(|n| format!("        case {n}u: {{ return {}; }}\n", read(n)));
        let last = volumes.len() - 1;
        format!("    switch volume {{\n{}        default: {{ return {}; }}\n    }}\n", cases.collect::<String>(), read(last))
    };
    // The middle of four texels: no rounding comes near the next one. A layer beyond the grid is not clamped in every language that this is
    // turned into.
    let of_layers = |n: usize| {
        format!(
            "vec4<f32>(textureGather(0, samples_{n}, nearest_texels, vec2<f32>(at.xy + 1) / vec2<f32>(params.dims.xy), clamp(at.z, 0, params.dims.z - 1)).wzxy)"
        )
    };
    let of_3d = |n: usize| {
        let texel =
            |offset: &str| format!("f32(textureLoad(samples_{n}, clamp(at + vec3<i32>({offset}), vec3<i32>(0), params.dims - 1), 0).r)");
        format!("vec4<f32>({}, {}, {}, {})", texel("0"), texel("1, 0, 0"), texel("0, 1, 0"), texel("1, 1, 0"))
    };
    let texels = all(&|n| if volumes[n].in_layers { of_layers(n) } else { of_3d(n) });
    let map = all(&|n| format!("textureLoad(map_{n}, brick).rg"));
    let mask = all(&|n| format!("textureLoad(masks_{n}, at).r"));
    source += "// Samples at (0,0), (1,0), (0,1) and (1,1) from one in its layer; those beyond the grid are the nearest in it.\n";
    source
        + &format!(
            "fn texels(at: vec3<i32>) -> vec4<f32> {{\n{texels}}}\n\
         fn map_at(brick: vec3<i32>) -> vec2<u32> {{\n{map}}}\n\
         fn mask_word(at: vec2<i32>) -> u32 {{\n{mask}}}\n"
        )
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    const LAYERS: Reads = Reads { component: Component::I32, in_layers: true, is_cut: false };

    #[test]
    fn every_file_parses_with_what_it_imports() {
        // Fails when a file uses something that it does not import, or is not listed.
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shaders");
        let mut files: Vec<String> =
            std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned()).collect();
        files.sort();
        assert_eq!(files, MODULES.iter().map(|(name, _)| *name).collect::<Vec<_>>());
        for (name, _) in MODULES {
            let reads =
                if name.starts_with("filter") { Reads { component: Component::F32, in_layers: false, is_cut: false } } else { LAYERS };
            let reads = Reads { is_cut: *name == "within", ..reads };
            let filled = if ["spline", "voxels"].contains(name) { vec![("cell_entry", *name), ("field_at", *name)] } else { vec![] };
            let source = link(name, &filled, &[reads]);
            let module = naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&source)));
            let valid = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
            assert!(valid.is_ok(), "{name}: {valid:?}");
        }
    }

    #[test]
    fn no_number_is_written_in_both_languages() {
        // Fails when a shader declares a constant that Rust has under the same name, or has a number with more digits than one knows by heart:
        // these come from `constants`, so that the two renderers cannot come to differ.
        let rust = rust_constants(concat!(env!("CARGO_MANIFEST_DIR"), "/src").as_ref());
        for (name, text) in MODULES {
            for (n, line) in text.lines().enumerate() {
                let code = line.split("//").next().unwrap_or_default();
                if let Some(constant) = code.strip_prefix("const ").and_then(|rest| rest.split([':', ' ']).next()) {
                    assert!(!rust.contains(constant), "{name}.wgsl:{}: {constant} is a constant of Rust's too", n + 1);
                }
                for number in code
                    .split(|c: char| !(c.is_alphanumeric() || c == '.' || c == '_'))
                    .filter(|w| w.starts_with(|c: char| c.is_ascii_digit()))
                {
                    let digits = number.trim_end_matches(['u', 'f', 'i']);
                    let significant = digits.chars().filter(char::is_ascii_digit).collect::<String>();
                    let is_plain = significant.trim_matches('0').len() <= 2 || digits.starts_with("0x") || number == "16777216.0";
                    assert!(is_plain && !digits.contains('e'), "{name}.wgsl:{}: {number} belongs to constants.rs", n + 1);
                }
            }
        }
    }

    /// The names of all constants of the Rust files below a folder.
    fn rust_constants(folder: &std::path::Path) -> std::collections::HashSet<String> {
        let mut names = std::collections::HashSet::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                names.extend(rust_constants(&path));
            } else {
                let text = std::fs::read_to_string(&path).unwrap();
                let declared = text.lines().filter_map(|line| {
                    line.trim_start()
                        .trim_start_matches("pub")
                        .trim_start_matches("(super)")
                        .trim_start_matches("(crate)")
                        .trim_start()
                        .strip_prefix("const ")
                });
                names.extend(declared.filter_map(|rest| rest.split(':').next().map(|name| name.trim().to_owned())));
            }
        }
        names
    }
}
