//! What is asked of a person who is to name files.

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Ask {
    /// What the person is to choose.
    pub title: &'static str,
    /// Files or folders that are there, or one that is not there yet.
    pub kind: Kind,
    /// The forms that it can have: each with its endings.
    pub forms: &'static [(&'static str, &'static [&'static str])],
    /// What a new file is called unless the person says otherwise.
    pub name: &'static str,
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Files that are there.
    Files,
    /// Folders that are there.
    Folders,
    /// A file to write.
    Save,
}

impl Ask {
    /// For files or folders to open.
    pub const fn open(title: &'static str, kind: Kind) -> Self {
        Self { title, kind, forms: &[], name: "" }
    }
}
