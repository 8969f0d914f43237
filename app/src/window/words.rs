//! The libraries' sentences in the window's words: what to do on the command line is a deed of the hand here.

/// What they advise there, and what does the same here; the longer first where one is part of another.
const DEEDS: [(&str, &str); 29] = [
    ("pass --open to close it at the scan's box", "have it closed at the scan's box"),
    (" with --close ", " by the disc X,Y,Z,NX,NY,NZ,R: "),
    (" (--sphere-passes)", ""),
    ("; pass --spacing X,Y,Z if it is not so", "; correct it in the scan's panel if it is not so"),
    ("; pass --spacing X,Y,Z where it is 0", "; correct the header where it is 0"),
    ("; pass --spacing X,Y,Z", "; correct it in the scan's panel"),
    ("pass --uneven resample to have them interpolated", "have them interpolated"),
    ("a preview with --reduce", "a preview of one sample in"),
    ("describe a headerless file with --raw", "open a headerless file by itself, and say how its samples lie"),
    ("pass --raw WxHxD,u8|u16|i16|f32[,be][,skip=N]", "give it a name that does, such as skull_256x256x128_uint16.raw"),
    ("pass --raw if that is wrong", "rename it if that is wrong"),
    ("check --raw", "check the numbers in its name"),
    (": --transform, --spacing and --turn are for scans", ""),
    ("; pass it as --transform behind that scan", "; open it together with that scan alone"),
    ("what `bregma probe --format json` wrote", "a file of saved rays"),
    ("draw it without --reconstruction spline", "switch Spline off"),
    ("use --backend gpu or another --solver", "choose another in View › Speed and accuracy"),
    ("use another --solver", "choose another in View › Speed and accuracy"),
    ("use --backend cpu or a smaller --size", "make the window smaller"),
    ("--frankfurt holds the skull by its landmarks", "Measure › Hold upright… holds the skull by its landmarks"),
    (" (--ortho), or say --bar-at target", " (5: orthographic)"),
    ("add --ortho or --view, and leave --fov out", "draw along parallel rays (5: orthographic)"),
    ("give --window and --level", "give a window of values"),
    ("leave --bits out, or choose", "leave 16 bits out, or choose"),
    ("leave --icc out, or end", "end"),
    ("choose --ground white or a colour", "choose a white ground"),
    ("use --mode iso or overlay, without --reconstruction and --solver", "choose Isosurface or Overlay, the exact solver"),
    ("; give it one by --studio", ""),
    ("use --backend cpu", "let the processor draw"),
];

/// The type of samples.
pub fn type_words(name: &str) -> &'static str {
    match name {
        "u8" => "8 bits",
        "u16" => "16 bits, unsigned",
        "i16" => "16 bits, signed",
        _ => "32 bits, decimals",
    }
}

/// A sentence in the window's words.
pub fn in_the_window(sentence: &str) -> String {
    DEEDS.iter().fold(sentence.to_owned(), |text, (there, here)| text.replace(there, here))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The strings of a source that are not its tests'.
    fn strings(text: &str) -> impl Iterator<Item = &str> {
        let code = &text[..text.find("#[cfg(test)]").unwrap_or(text.len())];
        code.lines().filter(|line| !line.trim_start().starts_with("//")).flat_map(|line| line.split('"').skip(1).step_by(2))
    }

    fn check(folder: &Path, seen: &mut usize) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                check(&path, seen);
            } else if path.extension().is_some_and(|e| e == "rs")
                // What journals ask for is checked by the command line alone.
                && path.file_stem().is_some_and(|name| name != "tests" && name != "journals")
            {
                let text = std::fs::read_to_string(&path).unwrap();
                for sentence in strings(&text).filter(|s| s.contains("--") && s.contains(' ')) {
                    *seen += 1;
                    let here = in_the_window(sentence);
                    assert!(!here.contains("--"), "{}: {here:?}", path.display());
                }
            }
        }
    }

    #[test]
    fn no_sentence_speaks_of_the_command_line() {
        // Fails when a library advises an option that the window has no words for.
        let mut seen = 0;
        for library in ["volume", "field", "parts", "renderer", "measure", "register", "session"] {
            check(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(library).join("src"), &mut seen);
        }
        assert!(seen >= 15, "{seen} sentences");
    }
}
