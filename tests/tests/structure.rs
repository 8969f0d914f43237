//! The sources as text: that functions stay short, files do not import each other in circles, and the two languages' twins know each other.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

const CRATES: [&str; 8] = ["volume", "field", "parts", "renderer", "measure", "datasets-synthetic", "session", "app"];
const LONGEST: usize = 60;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The files of a folder that end so, with what they hold, by their paths from the root of the repository.
fn files(folder: &str, ending: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(root().join(folder)).unwrap() {
        let path = entry.unwrap().path();
        let name = format!("{folder}/{}", path.file_name().unwrap().to_str().unwrap());
        if path.is_dir() {
            found.extend(files(&name, ending));
        } else if name.ends_with(ending) {
            found.insert(name, fs::read_to_string(&path).unwrap());
        }
    }
    found
}

/// The sources of a crate without its tests.
fn sources(name: &str) -> BTreeMap<String, String> {
    let mut all = files(&format!("{name}/src"), ".rs");
    all.retain(|path, _| !path.contains("/tests"));
    for text in all.values_mut() {
        text.truncate(text.find("#[cfg(test)]").unwrap_or(text.len()));
    }
    all
}

/// What a line declares as a word behind `keyword`, whatever its visibility.
fn declared<'a>(line: &'a str, keyword: &str) -> Option<&'a str> {
    let line = ["pub ", "pub(crate) ", "pub(super) "].iter().find_map(|p| line.strip_prefix(p)).unwrap_or(line);
    let line = line.strip_prefix("const ").filter(|_| keyword == "fn ").unwrap_or(line);
    line.strip_prefix(keyword)?.split(|c: char| !(c.is_alphanumeric() || c == '_')).next()
}

#[test]
fn functions_are_short_and_the_few_others_say_why() {
    // Fails when a sixth function is longer than a screen, or one of them does not say why it is in one piece.
    let mut long = vec![];
    for (path, text) in CRATES.iter().flat_map(|name| sources(name)).chain(files("shaders", ".wgsl")) {
        let lines: Vec<&str> = text.lines().collect();
        for (n, line) in lines.iter().enumerate() {
            let indent = &line[..line.len() - line.trim_start().len()];
            let Some(name) = declared(line.trim_start(), "fn ") else { continue };
            // A trait's function without a body ends at once.
            let opens = lines[n..].iter().position(|l| l.ends_with('{') || l.ends_with(';') || l.ends_with('}'));
            if opens.is_none_or(|o| !lines[n + o].ends_with('{')) {
                continue;
            }
            let length = lines[n..].iter().position(|l| *l == format!("{indent}}}")).unwrap() + 1;
            if length > LONGEST {
                let comments = lines[..n].iter().rev().take_while(|l| l.trim_start().starts_with("//"));
                assert!(
                    comments.into_iter().any(|l| l.contains("In one piece")),
                    "{path}:{}: {name} has {length} lines, and no reason",
                    n + 1
                );
                long.push(format!("{path}:{} {name}: {length} lines", n + 1));
            }
        }
    }
    println!("{}", long.join("\n"));
    assert!(long.len() <= 5, "{long:#?}");
}

/// The paths in a text that begin at the crate or beside or above a module, with lists in braces taken apart.
fn paths(text: &str) -> Vec<Vec<String>> {
    let code: String = text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join(" ");
    let mut found = vec![];
    for start in ["crate::", "super::"] {
        for (at, _) in code.match_indices(start) {
            // A second `super` of the same path is read with the first.
            if !code[..at].ends_with("::") && !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
                taken_apart(&code[at..], vec![], &mut found);
            }
        }
    }
    found
}

/// Reads one path, or the list in braces that ends it, and returns what follows.
fn taken_apart<'a>(mut rest: &'a str, mut path: Vec<String>, found: &mut Vec<Vec<String>>) -> &'a str {
    loop {
        rest = rest.trim_start();
        if let Some(mut list) = rest.strip_prefix('{') {
            loop {
                list = taken_apart(list, path.clone(), found).trim_start();
                list = match list.strip_prefix(',') {
                    Some(more) => more,
                    None => return list.strip_prefix('}').unwrap_or(""),
                };
            }
        }
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        path.push(rest[..end].to_owned());
        rest = &rest[end..];
        match rest.strip_prefix("::") {
            Some(more) => rest = more,
            None => break,
        }
    }
    // What it is called here is of no account.
    if let Some(renamed) = rest.strip_prefix(" as ") {
        rest = &renamed[renamed.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(renamed.len())..];
    }
    found.push(path);
    rest
}

/// The files of a crate by their modules' names.
fn modules(name: &str) -> BTreeMap<Vec<String>, (String, String)> {
    let module = |path: &str| {
        let inner = path.strip_prefix(&format!("{name}/src/")).unwrap().trim_end_matches(".rs").trim_end_matches("/mod");
        inner.split('/').filter(|part| !["lib", "main", "mod"].contains(part)).map(str::to_owned).collect()
    };
    sources(name).into_iter().map(|(path, text)| (module(&path), (path, text))).collect()
}

/// The file in which a path ends: through what is re-exported, to where the item is.
fn home(modules: &BTreeMap<Vec<String>, (String, String)>, from: &[String], path: &[String]) -> Option<Vec<String>> {
    let mut at = from.to_vec();
    let mut rest = path;
    while let Some((first, others)) = rest.split_first() {
        match first.as_str() {
            "crate" => at.clear(),
            "super" => drop(at.pop()),
            "self" => {}
            name => {
                let child: Vec<String> = at.iter().cloned().chain([name.to_owned()]).collect();
                if modules.contains_key(&child) {
                    at = child;
                } else {
                    let (_, text) = modules.get(&at)?;
                    let uses = text.split("pub use ").chain(text.split("pub(crate) use ")).chain(text.split("pub(super) use ")).skip(1);
                    let exported = uses.filter_map(|part| part.split(';').next()).find_map(|part| {
                        let mut all = vec![];
                        taken_apart(part, vec![], &mut all);
                        all.into_iter().find(|path| path.last().is_some_and(|last| last == name) && path.len() > 1)
                    });
                    return exported.filter(|_| others.len() < 2).map_or(Some(at.clone()), |path| home(modules, &at, &path));
                }
            }
        }
        rest = others;
    }
    Some(at)
}

#[test]
fn files_do_not_import_each_other_in_circles() {
    // Fails when a third group of files cannot be read one after the other, because each of them needs what another one says.
    let mut circles = vec![];
    for name in CRATES {
        let modules = modules(name);
        let mut reach: BTreeMap<&Vec<String>, BTreeSet<&Vec<String>>> = BTreeMap::new();
        for (from, (_, text)) in &modules {
            let homes = paths(text).iter().filter_map(|path| home(&modules, from, path)).collect::<Vec<_>>();
            let known = homes.iter().filter_map(|to| modules.get_key_value(to)).map(|(to, _)| to).filter(|to| *to != from);
            reach.insert(from, known.collect());
        }
        for _ in 0..modules.len() {
            for from in modules.keys() {
                let farther: Vec<_> = reach[from].iter().flat_map(|to| reach[to].iter().copied()).collect();
                reach.get_mut(from).unwrap().extend(farther);
            }
        }
        let mut of: BTreeSet<Vec<&str>> = BTreeSet::new();
        for from in modules.keys().filter(|from| reach[from].contains(from)) {
            let ring = modules.iter().filter(|(to, _)| reach[from].contains(to) && reach[to].contains(from));
            of.insert(ring.map(|(_, (path, _))| path.as_str()).collect());
        }
        circles.extend(of.into_iter().map(|ring| ring.join(" ↔ ")));
    }
    println!("{}", circles.join("\n"));
    assert!(circles.len() <= 2, "{circles:#?}");
}

#[test]
fn twins_name_each_other_and_have_their_parts_in_the_same_order() {
    // Fails when one of a pair is moved or renamed alone, or its parts in one language come in another order.
    // What only a graphics card has, or needs to put a pass together.
    const ALONE: [&str; 11] = [
        "corner_cells",
        "corner_segments",
        "filter",
        "filter_cells",
        "filter_segments",
        "filtered",
        "hits",
        "unread",
        "unsolved",
        "way_part",
        "whole",
    ];
    for (path, text) in files("shaders", ".wgsl") {
        let name = path.trim_start_matches("shaders/").trim_end_matches(".wgsl");
        let head: String = text.lines().take_while(|l| l.starts_with("//")).collect::<Vec<_>>().join(" ").replace("// ", "");
        let twin = head.split("The twin of ").nth(1).and_then(|rest| rest.split([' ', ',', ';']).next()).map(|t| t.trim_end_matches('.'));
        assert_eq!(twin.is_none(), ALONE.contains(&name), "{path} names {twin:?}");
        let Some(twin) = twin else { continue };
        let twin = if twin.ends_with(".rs") { twin.to_owned() } else { format!("{twin}.rs") };
        let rust = fs::read_to_string(root().join(&twin)).unwrap_or_else(|_| panic!("{path} names {twin}, which is not there"));
        let rust_head = rust.lines().take_while(|l| l.starts_with("//!")).collect::<Vec<_>>().join(" ");
        assert!(rust_head.contains(&format!("`shaders/{name}.wgsl`")), "{twin} does not name {path}");
        for keyword in ["fn ", "struct "] {
            let of = |text: &str| -> Vec<String> { text.lines().filter_map(|l| declared(l, keyword)).map(str::to_owned).collect() };
            let (a, b) = (of(&text), of(&rust));
            let both = |these: &[String], others: &[String]| these.iter().filter(|n| others.contains(n)).cloned().collect::<Vec<_>>();
            assert_eq!(both(&a, &b), both(&b, &a), "{path} and {twin}: the order of what both have");
        }
    }
}

#[test]
fn shaders_are_linked_and_not_edited_and_few_files_ask_for_the_mode() {
    // Fails when shader text is changed by hand again, or knowledge of modes leaves their table.
    let renderer = sources("renderer");
    let edits: Vec<_> =
        renderer.iter().filter(|(path, text)| path.contains("/gpu/") && text.contains(".replace(")).map(|(path, _)| path).collect();
    assert!(edits.is_empty(), "{edits:?}");
    let asks = |text: &str| {
        [".gather()", ".uses(Setting", ".uses(modes::Setting", "mode ==", "mode !="].iter().any(|ask| text.contains(ask))
            || text.lines().any(|l| l.trim_start().contains("match ") && l.trim_end().ends_with("mode {"))
    };
    let all = CRATES.iter().flat_map(|name| sources(name));
    // The table itself, and the panel that shows it.
    const OWNERS: [&str; 2] = ["renderer/src/modes.rs", "app/src/window/panels/look.rs"];
    let asking: Vec<String> = all.filter(|(path, text)| !OWNERS.contains(&path.as_str()) && asks(text)).map(|(path, _)| path).collect();
    println!("{}", asking.join("\n"));
    assert!(asking.len() <= 8, "{asking:#?}");
}
