//! Surfaces of triangles as files: PLY (text, and binary of either order of bytes) and STL (text and binary).

use crate::formats::{OpenError, ReadError};
use glam::DVec3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::collections::HashMap;
use std::fs;
use std::io::{Cursor, ErrorKind};
use std::path::Path;

/// A surface of triangles, in the millimetres and axes (LPS) of its file, which says neither.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Its corners, each place once.
    pub points_mm: Vec<DVec3>,
    /// Three numbers of corners each.
    pub triangles: Vec<[u32; 3]>,
}

/// Reads a surface. Faces of more than three corners become fans of triangles; corners at the same place become one.
pub fn read_mesh(path: &Path) -> Result<Mesh, OpenError> {
    let reason = |reason| OpenError { file: path.to_owned(), reason };
    let bytes = fs::read(path).map_err(|e| match e.kind() {
        ErrorKind::NotFound => reason(ReadError::NotFound),
        ErrorKind::IsADirectory => reason(ReadError::Directory),
        _ => reason(ReadError::Io(e)),
    })?;
    if bytes.is_empty() {
        return Err(reason(ReadError::Empty));
    }
    let soup = if bytes.starts_with(b"ply") { ply(&bytes) } else { stl(bytes) }.map_err(reason)?;
    welded(&soup).map_err(reason)
}

/// Corners of triangles, three and three.
fn welded(soup: &[DVec3]) -> Result<Mesh, ReadError> {
    if soup.is_empty() {
        return Err(ReadError::Unsupported("it has no triangles; save the surface, not its points alone".into()));
    }
    if soup.iter().any(|p| !p.is_finite()) {
        return Err(ReadError::Damaged("a corner of it lies nowhere".into()));
    }
    let mut mesh = Mesh { points_mm: vec![], triangles: Vec::with_capacity(soup.len() / 3) };
    let mut known = HashMap::new();
    let mut number = |p: DVec3| -> Option<u32> {
        // 0 and −0 are one place.
        let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
        let next = u32::try_from(mesh.points_mm.len()).ok()?;
        let number = *known.entry(key).or_insert(next);
        if number == next {
            mesh.points_mm.push(p);
        }
        Some(number)
    };
    for corners in soup.chunks_exact(3) {
        let [a, b, c] = [number(corners[0]), number(corners[1]), number(corners[2])];
        let all =
            a.zip(b).zip(c).ok_or_else(|| ReadError::Unsupported("it has more corners than 32 bits count; save it coarser".into()))?;
        mesh.triangles.push([all.0.0, all.0.1, all.1]);
    }
    Ok(mesh)
}

/// A point, or a face, of a PLY.
#[derive(Default)]
struct Element {
    place: DVec3,
    corners: Option<Vec<i64>>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match (name, number(&property)) {
            ("x", Some(x)) => self.place.x = x,
            ("y", Some(y)) => self.place.y = y,
            ("z", Some(z)) => self.place.z = z,
            ("vertex_indices" | "vertex_index", None) => self.corners = numbers(property),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn number(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(n) => n.into(),
        Property::UChar(n) => n.into(),
        Property::Short(n) => n.into(),
        Property::UShort(n) => n.into(),
        Property::Int(n) => n.into(),
        Property::UInt(n) => n.into(),
        Property::Float(n) => n.into(),
        Property::Double(n) => n,
        _ => return None,
    })
}

fn numbers(property: Property) -> Option<Vec<i64>> {
    fn all<N: Into<i64>>(list: Vec<N>) -> Option<Vec<i64>> {
        Some(list.into_iter().map(Into::into).collect())
    }
    match property {
        Property::ListChar(n) => all(n),
        Property::ListUChar(n) => all(n),
        Property::ListShort(n) => all(n),
        Property::ListUShort(n) => all(n),
        Property::ListInt(n) => all(n),
        Property::ListUInt(n) => all(n),
        _ => None,
    }
}

fn ply(bytes: &[u8]) -> Result<Vec<DVec3>, ReadError> {
    let damaged = |e: ParseError| ReadError::Damaged(e.to_string().lines().next().unwrap_or_default().trim_end_matches('.').to_owned());
    let (parser, mut reader) = (Parser::<Element>::new(), Reader::new(bytes));
    let header = parser.read_header(&mut reader).map_err(damaged)?;
    let (mut points, mut faces) = (vec![], vec![]);
    for (name, element) in &header.elements {
        let all = parser.read_payload_for_element(&mut reader, element, &header).map_err(damaged)?;
        match name.as_str() {
            "vertex" => points = all.into_iter().map(|element| element.place).collect::<Vec<_>>(),
            "face" => faces = all.into_iter().filter_map(|element| element.corners).collect(),
            _ => {}
        }
    }
    let mut soup = vec![];
    for face in faces {
        let corners = face.iter().map(|&n| usize::try_from(n).ok().and_then(|n| points.get(n)).copied());
        let corners = corners.collect::<Option<Vec<DVec3>>>();
        let corners = corners.ok_or_else(|| ReadError::Damaged("a face of it names a corner that is not there".into()))?;
        soup.extend(corners.windows(2).skip(1).flat_map(|pair| [corners[0], pair[0], pair[1]]));
    }
    Ok(soup)
}

/// Bytes before a binary file's triangles, and of each of these.
const STL_BYTES: [usize; 2] = [84, 50];

fn stl(mut bytes: Vec<u8>) -> Result<Vec<DVec3>, ReadError> {
    let count = bytes.get(80..84).map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    let is_binary = count.is_some_and(|count| STL_BYTES[0] as u64 + STL_BYTES[1] as u64 * count as u64 == bytes.len() as u64);
    if is_binary {
        // What precedes its triangles may be called a solid, as text is.
        bytes[0] = 0;
    } else if bytes.starts_with(b"solid") {
        // Text may have no name, and the reader wants one.
        let end = bytes.iter().position(|b| *b == b'\n').unwrap_or(bytes.len());
        bytes.splice(..end, *b"solid -");
    } else if count.is_none_or(|count| count as u64 * STL_BYTES[1] as u64 + STL_BYTES[0] as u64 > bytes.len() as u64) {
        return Err(ReadError::Unsupported("it is no surface that is read here; save it as PLY or STL".into()));
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| ReadError::Damaged(e.to_string()))?;
    let place = |n: usize| DVec3::from(mesh.vertices[n].0.map(f64::from));
    Ok(mesh.faces.iter().flat_map(|face| face.vertices.map(place)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 3]; 5] = [[0.0, 0.0, 0.0], [2.5, 0.0, 0.0], [2.5, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, -3.25]];

    /// A pyramid: its base has four corners.
    fn expected() -> Vec<[DVec3; 3]> {
        let all = [[3, 2, 1], [3, 1, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        all.map(|t| t.map(|n: usize| DVec3::from(CORNERS[n].map(f64::from)))).to_vec()
    }

    fn read(name: &str, bytes: &[u8]) -> Result<Vec<[DVec3; 3]>, String> {
        let file = std::env::temp_dir().join(format!("bregma-mesh-{}-{name}", std::process::id()));
        fs::write(&file, bytes).unwrap();
        let mesh = read_mesh(&file).map_err(|e| e.to_string());
        fs::remove_file(&file).unwrap();
        mesh.map(|mesh| mesh.triangles.iter().map(|t| t.map(|n| mesh.points_mm[n as usize])).collect())
    }

    fn ply_of(form: &str, payload: Vec<u8>) -> Vec<u8> {
        let text = format!(
            "ply\nformat {form} 1.0\ncomment by hand\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
             element face 5\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int a\nend_header\n"
        );
        [text.into_bytes(), payload].concat()
    }

    const FACES: [&[i32]; 5] = [&[3, 2, 1, 0], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];

    #[test]
    fn each_form_of_each_format_is_the_same_surface() {
        // Fails if an order of bytes, a property beside those that are read, a face of four corners, a name that is missing or that a binary file begins with is
        // taken wrongly.
        let mut text = CORNERS.map(|[x, y, z]| format!("{x} {y} {z} 200\n")).concat();
        for face in FACES {
            text += &format!("{} {}\n", face.len(), face.iter().map(i32::to_string).collect::<Vec<_>>().join(" "));
        }
        assert_eq!(read("text.ply", &ply_of("ascii", (text + "7\n").into_bytes())).unwrap(), expected());
        for (form, is_big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
            let four = |bytes: [u8; 4]| if is_big { bytes.into_iter().rev().collect() } else { bytes.to_vec() };
            let mut payload = vec![];
            CORNERS.iter().for_each(|p| {
                payload.extend(p.iter().flat_map(|x| four(x.to_le_bytes())));
                payload.push(200);
            });
            FACES.iter().for_each(|face| {
                payload.push(face.len() as u8);
                payload.extend(face.iter().flat_map(|n| four(n.to_le_bytes())));
            });
            payload.extend(four(7_i32.to_le_bytes()));
            assert_eq!(read("binary.ply", &ply_of(form, payload)).unwrap(), expected(), "{form}");
        }
        let facet = |t: &[DVec3; 3]| {
            let corners = t.map(|p| format!("vertex {:e} {:e} {:e}\n", p.x, p.y, p.z)).concat();
            format!("facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n")
        };
        let facets: String = expected().iter().map(facet).collect();
        for first in ["solid\n", "solid a name\n"] {
            assert_eq!(read("text.stl", format!("{first}{facets}endsolid\n").as_bytes()).unwrap(), expected(), "{first:?}");
        }
        for first in [*b"solid", *b"made "] {
            let mut bytes = [&first[..], &[b' '; 75], &6_u32.to_le_bytes()].concat();
            for t in expected() {
                bytes.extend([0; 12]);
                bytes.extend(t.iter().flat_map(|p| p.to_array()).flat_map(|x| (x as f32).to_le_bytes()));
                bytes.extend([0; 2]);
            }
            assert_eq!(read("binary.stl", &bytes).unwrap(), expected());
        }
    }

    #[test]
    fn what_is_no_surface_is_told_in_one_sentence() {
        // Fails if a file that is cut off, empty, of something else, or that names corners that it has not panics or is taken.
        let cases: [(&str, Vec<u8>, &str); 7] = [
            ("empty.stl", vec![], "it is empty"),
            ("other.stl", b"this is a letter to you, which is longer than eighty-four bytes, so that a number would be read there".to_vec(), "no surface"),
            ("short.stl", b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 1 2\n".to_vec(), "it is damaged"),
            ("none.stl", b"solid x\nendsolid x\n".to_vec(), "no triangles"),
            ("far.stl", b"solid x\nfacet normal 0 0 1\nouter loop\nvertex nan 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n".to_vec(), "it is damaged"),
            ("cut.ply", ply_of("binary_little_endian", vec![0; 20]), "it is damaged"),
            (
                "points.ply",
                b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n3 0 1 2\n".to_vec(),
                "names a corner that is not there",
            ),
        ];
        for (name, bytes, expected) in cases {
            let told = read(name, &bytes).unwrap_err();
            println!("{told}");
            assert!(told.contains(expected) && !told.contains('\n'), "{told}");
        }
        assert!(read_mesh(Path::new("/nowhere/there.ply")).unwrap_err().to_string().contains("there is no such file"));
    }
}
