//! The text header: lines `field: value`, `key:=value` and comments, up to an empty line or the end of the file.

use super::super::{ReadError, bad};
use glam::DVec3;
use std::collections::HashMap;
use std::io::{BufRead, Read};
use std::str::FromStr;

/// Room for the names of 100,000 data files; a header that is longer is none.
const MOST_BYTES: u64 = 16 << 20;

/// The header as text.
#[derive(Debug)]
pub struct Header {
    /// Value and whole line by the field's name, lower case.
    fields: HashMap<String, (String, String)>,
    /// Key/value pairs.
    pub keys: HashMap<String, String>,
    /// The names after `data file: LIST`.
    pub list: Vec<String>,
    /// Length in the file, the empty line included.
    pub bytes: u64,
    /// It ended with an empty line, so that samples may follow.
    pub ended: bool,
}

impl Header {
    /// Reads the header and leaves `source` at what follows it.
    pub fn read(source: &mut impl BufRead) -> Result<Self, ReadError> {
        let mut source = source.take(MOST_BYTES);
        let mut bytes = 0;
        let mut line = || -> Result<Option<String>, ReadError> {
            let mut line = vec![];
            let n = source.read_until(b'\n', &mut line)?;
            bytes += n as u64;
            Ok((n > 0).then(|| String::from_utf8_lossy(&line).trim_end().to_owned()))
        };
        let magic = line()?.unwrap_or_default();
        if !matches!(magic.strip_prefix("NRRD000"), Some("1" | "2" | "3" | "4" | "5")) {
            return Err(bad("first line", &magic, "it must be NRRD0001 to NRRD0005"));
        }
        let mut header = Self { fields: HashMap::new(), keys: HashMap::new(), list: vec![], bytes: 0, ended: false };
        let mut listing = false;
        while let Some(line) = line()? {
            if line.is_empty() {
                header.ended = true;
                break;
            }
            if listing {
                header.list.push(line);
            } else if !line.starts_with('#') {
                listing = header.add(line)?;
            }
        }
        header.bytes = bytes;
        Ok(header)
    }

    /// Takes one line; true when a list of file names follows it.
    fn add(&mut self, line: String) -> Result<bool, ReadError> {
        let wrong = |problem| Err(bad("line", &line, problem));
        match line.split_once(':') {
            Some((key, value)) if value.starts_with('=') => {
                self.keys.insert(key.to_owned(), value[1..].to_owned());
                Ok(false)
            }
            Some((field, value)) => {
                let name = match field.trim().to_lowercase().as_str() {
                    "datafile" => "data file".to_owned(),
                    "byteskip" => "byte skip".to_owned(),
                    "lineskip" => "line skip".to_owned(),
                    "axismins" => "axis mins".to_owned(),
                    "centerings" => "centers".to_owned(),
                    name => name.to_owned(),
                };
                let value = value.trim().to_owned();
                let listing = name == "data file" && value.split_whitespace().next() == Some("LIST");
                if self.fields.contains_key(&name) {
                    return wrong("the field is there twice");
                }
                self.fields.insert(name, (value, line));
                Ok(listing)
            }
            None => wrong("it is neither `field: value` nor `key:=value`"),
        }
    }

    /// The text of a field.
    pub fn value(&self, field: &str) -> Option<&str> {
        self.fields.get(field).map(|(value, _)| value.as_str())
    }

    /// The text of a field that has to be there.
    pub fn required(&self, field: &'static str) -> Result<&str, ReadError> {
        self.value(field).ok_or(ReadError::MissingField(field))
    }

    /// The error that `field` is bad.
    pub fn bad(&self, field: &str, problem: &str) -> ReadError {
        bad(field, self.fields.get(field).map_or("", |(_, line)| line), problem)
    }

    /// A field that is one number.
    pub fn number<T: FromStr>(&self, field: &str) -> Result<Option<T>, ReadError> {
        self.value(field).map(|v| v.parse().map_err(|_| self.bad(field, "it must be a whole number"))).transpose()
    }

    /// A field that has `count` numbers.
    pub fn numbers<T: FromStr>(&self, field: &str, count: usize) -> Result<Option<Vec<T>>, ReadError> {
        let Some(text) = self.value(field) else { return Ok(None) };
        let numbers: Option<Vec<T>> = text.split_whitespace().map(|n| n.parse().ok()).collect();
        match numbers.filter(|n| n.len() == count) {
            Some(numbers) => Ok(Some(numbers)),
            None => Err(self.bad(field, &format!("it must be {count} numbers"))),
        }
    }

    /// A field that has `count` vectors `(x,y,z)` or `none`.
    pub fn vectors(&self, field: &str, count: usize) -> Result<Option<Vec<Option<DVec3>>>, ReadError> {
        let Some(text) = self.value(field) else { return Ok(None) };
        match parse_vectors(text).filter(|v| v.len() == count) {
            Some(vectors) => Ok(Some(vectors)),
            None => Err(self.bad(field, &format!("it must be {count} times `(x,y,z)` or `none`"))),
        }
    }

    /// A field of quoted or bare words, one an axis.
    pub fn words(&self, field: &str) -> Option<Vec<&str>> {
        let text = self.value(field)?;
        let quoted: Vec<&str> = text.split('"').skip(1).step_by(2).collect();
        Some(if quoted.is_empty() { text.split_whitespace().collect() } else { quoted })
    }
}

fn parse_vectors(text: &str) -> Option<Vec<Option<DVec3>>> {
    let mut rest = text.trim();
    let mut vectors = vec![];
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            vectors.push(None);
            rest = after.trim_start();
        } else {
            let (inside, after) = rest.strip_prefix('(')?.split_once(')')?;
            let numbers: Option<Vec<f64>> = inside.split(',').map(|n| n.trim().parse().ok()).collect();
            let numbers: [f64; 3] = numbers?.try_into().ok()?;
            vectors.push(Some(numbers.into()));
            rest = after.trim_start();
        }
    }
    Some(vectors)
}
