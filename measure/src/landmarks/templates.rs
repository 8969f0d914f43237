//! The usual craniometric points by name, and lists of one's own: landmarks to be set one after the other.
//!
//! The points are those of Howells (1973, "Cranial Variation in Man", Papers of the Peabody Museum 67) and of Buikstra and Ubelaker (1994,
//! "Standards for Data Collection from Human Skeletal Remains", Arkansas Archeological Survey Research Series 44), which follow Martin; what is
//! said of each here is a reminder, and the sources are the definitions.

use super::landmark::Landmark;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A point by its names, and what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Definition {
    /// Its name.
    pub name: &'static str,
    /// Its abbreviation.
    pub abbreviation: &'static str,
    /// There is one on each side.
    pub is_paired: bool,
    /// What it is, in short.
    pub what: &'static str,
}

const fn single(name: &'static str, abbreviation: &'static str, what: &'static str) -> Definition {
    Definition { name, abbreviation, is_paired: false, what }
}

const fn paired(name: &'static str, abbreviation: &'static str, what: &'static str) -> Definition {
    Definition { name, abbreviation, is_paired: true, what }
}

/// The usual points: of the midline from the face over the vault to the base and the jaws, then those of the sides.
pub const CRANIOMETRIC: [Definition; 36] = [
    single("nasion", "n", "where the suture between the nasal bones meets the frontal"),
    single("glabella", "g", "the most forward point of the frontal between the brow ridges, in the midline"),
    single("metopion", "m", "in the midline, where a line between the frontal eminences crosses it"),
    single("bregma", "b", "where the coronal and the sagittal suture meet"),
    single("vertex", "v", "the highest point of the vault in the midline, the skull in the Frankfurt plane"),
    single("lambda", "l", "where the sagittal and the lambdoid suture meet"),
    single("opisthocranion", "op", "the point of the occipital midline that is farthest from glabella"),
    single("inion", "i", "in the midline, where the superior nuchal lines meet at the external protuberance"),
    single("opisthion", "o", "the middle of the hind edge of the foramen magnum"),
    single("basion", "ba", "the middle of the front edge of the foramen magnum"),
    single("staphylion", "sta", "in the midline, on a line that touches the hind notches of the palate"),
    single("nasospinale", "ns", "in the midline, on a line between the lowest points of the nasal opening"),
    single("prosthion", "pr", "the most forward point of the upper alveolar edge between the central incisors"),
    single("infradentale", "id", "the highest point of the lower alveolar edge between the central incisors"),
    single("pogonion", "pg", "the most forward point of the chin, in the midline"),
    single("gnathion", "gn", "the lowest point of the mandible's edge, in the midline"),
    paired("dacryon", "d", "on the inner wall of the orbit, where frontal, lacrimal and maxilla meet"),
    paired("orbitale", "or", "the lowest point of the orbit's edge"),
    paired("ektokonchion", "ek", "on the outer edge of the orbit, farthest from its inner edge along its breadth"),
    paired("frontomalare temporale", "fmt", "the outermost point of the suture between frontal and zygomatic"),
    paired("frontotemporale", "ft", "the most forward and inward point of the temporal line on the frontal"),
    paired("zygion", "zy", "the outermost point of the zygomatic arch"),
    paired("zygomaxillare", "zm", "the lowest point of the suture between zygomatic and maxilla"),
    paired("alare", "al", "the outermost point of the edge of the nasal opening"),
    paired("ektomolare", "ecm", "the outermost point of the alveolar edge of the maxilla, beside the second molar"),
    paired("pterion", "pt", "the region where frontal, parietal, sphenoid and temporal come together; by its middle"),
    paired("stephanion", "st", "where the temporal line crosses the coronal suture"),
    paired("euryon", "eu", "the outermost point of the vault, by the greatest breadth"),
    paired("asterion", "ast", "where the lambdoid, parietomastoid and occipitomastoid sutures meet"),
    paired("porion", "po", "the highest point of the edge of the ear opening"),
    paired("auriculare", "au", "on the root of the zygomatic process, straight above the middle of the ear opening"),
    paired("mastoidale", "ms", "the lowest point of the mastoid process"),
    paired("condylion laterale", "cdl", "the outermost point of the mandible's condyle"),
    paired("gonion", "go", "the point of the mandible's angle that is lowest, hindmost and outermost"),
    paired("coronion", "cr", "the highest point of the coronoid process of the mandible"),
    paired("mentale", "ml", "the lowest point of the edge of the mental foramen"),
];

/// A list of points to be set, each by its name and its abbreviation, which may be empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Template {
    /// Names and abbreviations, in order.
    pub points: Vec<(String, String)>,
}

/// Why a list of names is none.
#[derive(Debug, Error)]
#[error("{}: {reason}", file.display())]
pub struct TemplateError {
    file: PathBuf,
    reason: String,
}

impl Template {
    /// The usual points; of paired ones first the left, then the right.
    pub fn craniometric() -> Self {
        let point = |d: &Definition| {
            let side = |name: &str, letter: &str| (format!("{} {name}", d.name), format!("{} {letter}", d.abbreviation));
            if d.is_paired { vec![side("left", "L"), side("right", "R")] } else { vec![(d.name.to_owned(), d.abbreviation.to_owned())] }
        };
        Self { points: CRANIOMETRIC.iter().flat_map(point).collect() }
    }

    /// A list of one's own: a name on each line, or a name, a comma and its abbreviation; `#` begins a remark.
    pub fn read(file: &Path) -> Result<Self, TemplateError> {
        let fail = |reason: String| TemplateError { file: file.to_owned(), reason };
        let text = std::fs::read_to_string(file).map_err(|e| fail(format!("cannot be read ({e}); check its name and permissions")))?;
        let mut points: Vec<(String, String)> = vec![];
        for (n, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let line = line.split('#').next().unwrap_or_default().trim();
            let (name, abbreviation) = line.split_once(',').map_or((line, ""), |(name, short)| (name.trim(), short.trim()));
            if line.is_empty() {
                continue;
            }
            if name.is_empty() {
                return Err(fail(format!("line {} has no name before its comma; write one", n + 1)));
            }
            if points.iter().any(|(known, _)| known == name) {
                return Err(fail(format!("line {} names {name} a second time; remove one", n + 1)));
            }
            points.push((name.to_owned(), abbreviation.to_owned()));
        }
        if points.is_empty() { Err(fail("names no landmarks; write a name on each line".into())) } else { Ok(Self { points }) }
    }

    /// All of them as landmarks of a scan that are still missing.
    pub fn landmarks(&self, scan: Option<&str>) -> Vec<Landmark> {
        self.points.iter().map(|(name, _)| Landmark { scan: scan.map(str::to_owned), ..Landmark::missing(name) }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_point_has_its_own_name_and_both_sides() {
        // Fails if two points share a name or an abbreviation, one is not described, or a side is missing.
        let points = Template::craniometric().points;
        assert_eq!(points.len(), 16 + 2 * 20);
        for (n, (name, abbreviation)) in points.iter().enumerate() {
            assert!(
                !name.is_empty() && !abbreviation.is_empty() && points[..n].iter().all(|(a, b)| a != name && b != abbreviation),
                "{name}"
            );
        }
        assert!(CRANIOMETRIC.iter().all(|d| d.what.len() > 20));
        assert!(points.contains(&("zygion left".into(), "zy L".into())) && points.contains(&("basion".into(), "ba".into())));
        assert!(
            Template::craniometric()
                .landmarks(Some("skull A"))
                .iter()
                .all(|l| l.point_mm.is_none() && l.scan.as_deref() == Some("skull A"))
        );
    }

    #[test]
    fn a_list_of_ones_own_is_read_and_its_mistakes_named() {
        let file = std::env::temp_dir().join(format!("bregma-template-{}.txt", std::process::id()));
        let read = |text: &str| {
            std::fs::write(&file, text).unwrap();
            Template::read(&file).map(|t| t.points).map_err(|e| e.to_string())
        };
        let own = read("\u{feff}# my points\nnasion, n\r\n\ninner table 3  # on the right\n").unwrap();
        assert_eq!(own, [("nasion".into(), "n".into()), ("inner table 3".into(), String::new())]);
        for (text, part) in [("", "no landmarks"), ("a\na, b\n", "line 2 names a"), (", b\n", "line 1 has no name")] {
            assert!(read(text).unwrap_err().contains(part));
        }
        std::fs::remove_file(&file).unwrap();
    }
}
