//! What the documents name is there, and the examples do what they say.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(document: &Path) -> String {
    fs::read_to_string(document).unwrap_or_else(|e| panic!("{}: {e}", document.display()))
}

/// The names in a folder, in the order of the alphabet.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn every_path_that_the_map_and_the_lists_name_is_there() {
    // Fails if a file that ARCHITECTURE.md or CONTRIBUTING.md names was moved, renamed or never there.
    let root = root();
    // The map names files of a package without its folder.
    let folders = names(&root).into_iter().filter(|name| !name.starts_with('.') && name != "target").map(|name| root.join(name));
    let within: Vec<PathBuf> = folders.flat_map(|folder| [folder.clone(), folder.join("src"), folder.join("tests")]).collect();
    let is_path = |word: &&str| {
        let is_name = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
        let ends = [".rs", ".wgsl", ".md", ".py", "/"];
        word.chars().all(is_name) && (ends.iter().any(|end| word.ends_with(end)) || word.contains('/'))
    };
    for (document, least) in [("ARCHITECTURE.md", 40), ("CONTRIBUTING.md", 30)] {
        let text = read(&root.join(document));
        // Between backticks stands every other part.
        let paths: Vec<&str> = text.split('`').skip(1).step_by(2).filter(is_path).collect();
        assert!(paths.len() >= least, "{document} names {} paths only: {paths:?}", paths.len());
        let is_there =
            |path: &str| root.join(path).exists() || document == "ARCHITECTURE.md" && within.iter().any(|f| f.join(path).exists());
        let lost: Vec<&str> = paths.into_iter().filter(|path| !is_there(path)).collect();
        assert!(lost.is_empty(), "{document} names what is not there: {lost:?}");
    }
}

#[test]
fn the_map_says_of_each_dependency_why() {
    // Fails if a dependency comes without a reason, or a reason stays when its dependency is gone.
    let root = root();
    let [manifest, volume, map] = ["Cargo.toml", "volume/Cargo.toml", "ARCHITECTURE.md"].map(|file| read(&root.join(file)));
    let section = manifest.split("[workspace.dependencies]").nth(1).unwrap().split("\n[").next().unwrap();
    let only_there = volume.split("[dev-dependencies]").nth(1).unwrap();
    let lines = section.lines().chain(only_there.lines()).filter_map(|line| line.split_once(" = "));
    let mut used: Vec<&str> = lines.map(|(name, _)| name).filter(|name| !name.starts_with("bregma-")).collect();
    let rows = map.split("## Dependencies").nth(1).unwrap().lines().filter_map(|line| line.strip_prefix("| ")?.split(" |").next());
    let mut told: Vec<&str> = rows.flat_map(|row| row.split('`').skip(1).step_by(2)).collect();
    used.sort();
    told.sort();
    assert_eq!(used, told);
}

#[test]
fn every_link_between_documents_leads_somewhere() {
    // Fails if a document links to a file that is not there.
    let root = root();
    let documents = [root.clone(), root.join("docs")].map(|folder| {
        let documents = names(&folder).into_iter().filter(|name| name.ends_with(".md"));
        documents.map(|name| folder.join(name)).collect::<Vec<_>>()
    });
    let mut count = 0;
    for document in documents.concat() {
        let text = read(&document);
        for link in text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next()).filter(|link| !link.contains("://")) {
            assert!(document.with_file_name("").join(link).exists(), "{}: {link} is not there", document.display());
            count += 1;
        }
    }
    assert!(count > 20, "only {count} links were found");
}

/// What an example prints, run in a folder of its own.
fn example(name: &str, arguments: &[&str]) -> (PathBuf, String) {
    let folder = std::env::temp_dir().join(format!("bregma-{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    // Tests lie in target/PROFILE/deps, examples in target/PROFILE/examples.
    let built = std::env::current_exe().unwrap().parent().unwrap().with_file_name("examples");
    let program = built.join(name).with_extension(std::env::consts::EXE_EXTENSION);
    assert!(program.exists(), "{} is not built: run tests/run, or cargo build --release --examples", program.display());
    let out = Command::new(program).args(arguments).current_dir(&folder).env("TMPDIR", &folder).output().unwrap();
    let [printed, wrong] = [out.stdout, out.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert!(out.status.success(), "{name}: {wrong}");
    (folder, printed)
}

/// The numbers in a text.
fn numbers(text: &str) -> Vec<f64> {
    text.split([' ', ',', '[', ']']).filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn examples_do_what_they_say() {
    // Fails if an example no longer runs on the demo pair, draws or measures nothing, or one is not looked at here.
    let examples = ["compare_two_scans", "draw_a_picture", "measure_a_ray", "read_a_header"];
    assert_eq!(names(&root().join("examples")), examples.map(|name| format!("{name}.rs")));

    let (folder, printed) = example("draw_a_picture", &["skulls.png"]);
    let pixels = numbers(&printed);
    assert!(pixels.len() == 2 && pixels[0] > 0.05 * pixels[1] && pixels[0] < pixels[1], "{printed}");
    let png = fs::read(folder.join("skulls.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));

    let (_, printed) = example("measure_a_ray", &[]);
    for skull in ["skull A", "skull B"] {
        // The frontal and the occipital bone.
        let bones: Vec<Vec<f64>> = printed.lines().filter(|line| line.starts_with(skull)).map(numbers).collect();
        assert!(bones.len() >= 2 && bones.iter().all(|bone| bone[0] > 2.0 && bone[0] < 40.0 && bone[1] > 0.0), "{printed}");
    }

    let (_, printed) = example("read_a_header", &[]);
    assert!(printed.contains("NRRD") && numbers(&printed).contains(&32.0), "{printed}");

    let (_, printed) = example("compare_two_scans", &[]);
    let lines: Vec<Vec<f64>> = printed.lines().map(numbers).collect();
    let [both, only_first, only_second] = [*lines[0].last().unwrap(), lines[1][0], lines[1][1]];
    assert!((both + only_first + only_second - 100.0).abs() < 0.2 && both > 20.0 && only_second > 0.0, "{printed}");
}
