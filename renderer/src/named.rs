//! Choices that people make by name: on the command line, in files and in the window by the same.

/// One of some choices, each with a name.
pub trait Named: Copy + PartialEq + 'static {
    /// All of them.
    const ALL: &'static [Self];

    /// As options and files name it.
    fn name(self) -> &'static str;

    /// What it is, for people.
    fn what(self) -> &'static str;

    /// The one with a name.
    fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|one| one.name() == name)
    }
}

/// Declares an enum of unit variants with their names; what they are is what their documentation says.
#[macro_export]
macro_rules! named {
    (
        $(#[$meta:meta])*
        pub enum $type:ident {
            $($(#[doc = $what:literal])+ $(#[$other:ident])? $variant:ident = $name:literal,)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        pub enum $type {
            $($(#[doc = $what])+ $(#[$other])? #[serde(rename = $name)] $variant,)*
        }

        impl $crate::Named for $type {
            const ALL: &'static [Self] = &[$(Self::$variant),*];

            fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            fn what(self) -> &'static str {
                match self {
                    $(Self::$variant => concat!($($what),+).trim_ascii().trim_end_matches('.'),)*
                }
            }
        }
    };
}
