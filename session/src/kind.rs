//! What a file that a person names is.

use crate::source::Source;
use serde_json::Value;
use std::path::Path;

/// What a file that a person names is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A scan, or what is looked into as one.
    Scan,
    /// A session.
    Session,
    /// Landmarks.
    Landmarks,
    /// A registration.
    Registration,
}

/// A larger file is no registration or session that anyone wrote, so its text is not read.
const MOST_BYTES: u64 = 64 << 20;

impl Kind {
    /// By the name of the file, and where that says too little, by what is in it. What cannot be read is told when its turn comes.
    pub fn of(source: &Source) -> Self {
        let file = source.file.as_path();
        if source.raw.is_some() || file.is_dir() {
            return Self::Scan;
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
        if ends(&[".mrk.json", ".fcsv", ".tps", ".csv"]) {
            Self::Landmarks
        } else if ends(&[".tfm", ".h5"]) {
            Self::Registration
        } else if ends(&[".json"]) {
            of_json(file)
        } else if ends(&[".txt"]) {
            of_text(file)
        } else if file.to_string_lossy().contains(".json#") && !file.exists() {
            // One of several pairs, by its name.
            Self::Registration
        } else {
            Self::Scan
        }
    }
}

fn text(file: &Path) -> Option<String> {
    let is_small = std::fs::metadata(file).is_ok_and(|m| m.is_file() && m.len() <= MOST_BYTES);
    is_small.then(|| std::fs::read_to_string(file).ok()).flatten()
}

/// What begins no registration and no list of landmarks is taken for a session, which says what is wrong with it.
fn of_json(file: &Path) -> Kind {
    let json: Option<Value> = text(file).and_then(|text| serde_json::from_str(&text).ok());
    match json {
        Some(Value::Array(_)) => Kind::Registration,
        Some(json) if json.get("bregma_session").is_some() => Kind::Session,
        Some(json) if json.get("markups").is_some() => Kind::Landmarks,
        // What a ray measured has pairs, too, in a list.
        Some(json) if json.get("pairs").is_some_and(Value::is_object) || json.get("R").is_some() => Kind::Registration,
        _ => Kind::Session,
    }
}

/// By its first line.
fn of_text(file: &Path) -> Kind {
    let text = text(file).unwrap_or_default();
    match text.trim_start() {
        text if text.starts_with("#Insight Transform File") => Kind::Registration,
        // Morphologika.
        text if text.starts_with("[individuals]") => Kind::Landmarks,
        _ => Kind::Scan,
    }
}
