//! How a scan is turned whose file says wrongly how it lies: one of 24 turns by right angles, or one of their 24 mirror images.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A turn, by what the file's left, posterior and superior really are: `RAS` turns a scan that faces backward; `LPS` changes nothing. A mirror
/// image says so: `RPS,mirror`.
///
/// ```
/// use bregma_volume::Turn;
///
/// let backward: Turn = "RAS".parse()?;
/// assert!(!backward.is_mirror());
/// assert!("RPS".parse::<Turn>().unwrap_err().to_string().contains("mirror image"));
/// assert_eq!(backward.then(backward), Turn::default());
/// # Ok::<(), bregma_volume::TurnError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Turn([u8; 3]);

/// Why a text is no [`Turn`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum TurnError {
    /// Other letters, or two of one axis.
    #[error(
        "{0:?} names no turn; write what the file's left, posterior and superior really are, one of each of L/R, P/A and S/I, such as RAS"
    )]
    Letters(String),
    /// It would change sides, and nobody says that this is meant.
    #[error("{0} makes a mirror image of the scan: its right side becomes a left one; where that is meant, write {0},mirror")]
    Mirror(String),
    /// It is said to change sides, and does not.
    #[error("{0} turns the scan and mirrors nothing; leave \",mirror\" away")]
    NoMirror(String),
}

/// The letters of the directions, with the axis of LPS that each lies along, and the side of it.
const LETTERS: [(u8, usize, f64); 6] = [(b'L', 0, 1.0), (b'R', 0, -1.0), (b'P', 1, 1.0), (b'A', 1, -1.0), (b'S', 2, 1.0), (b'I', 2, -1.0)];

impl Default for Turn {
    /// As the file states.
    fn default() -> Self {
        Self(*b"LPS")
    }
}

impl Turn {
    /// All 48, mirror images too.
    pub fn all() -> impl Iterator<Item = Self> {
        let letters = || LETTERS.iter().map(|(letter, ..)| *letter);
        let threes = letters().flat_map(move |a| letters().flat_map(move |b| letters().map(move |c| Self([a, b, c]))));
        threes.filter(|turn| turn.matrix().determinant() != 0.0)
    }

    /// A turn by so many degrees, a multiple of 90, about a direction along an axis, by the right hand.
    pub fn about(axis: DVec3, degrees: i32) -> Self {
        let quarters = degrees.div_euclid(90).rem_euclid(4);
        let quarter = Self::of(DMat3::from_axis_angle(axis, std::f64::consts::FRAC_PI_2));
        (0..quarters).fold(Self::default(), |turn, _| turn.then(quarter))
    }

    /// The mirror image in which left and right change places.
    pub fn mirror() -> Self {
        Self(*b"RPS")
    }

    fn of(matrix: DMat3) -> Self {
        let letter = |column: DVec3| {
            let along = |(_, axis, side): &&(u8, usize, f64)| column[*axis] * side > 0.5;
            LETTERS.iter().find(along).map_or(b'L', |(letter, ..)| *letter)
        };
        Self([letter(matrix.x_axis), letter(matrix.y_axis), letter(matrix.z_axis)])
    }

    /// Where it leads a direction (LPS).
    pub fn matrix(self) -> DMat3 {
        let column = |letter: u8| {
            let along = LETTERS.iter().filter(|(l, ..)| *l == letter).map(|(_, axis, side)| DVec3::AXES[*axis] * *side);
            // Minus zero is no other number.
            along.sum::<DVec3>() + DVec3::ZERO
        };
        DMat3::from_cols(column(self.0[0]), column(self.0[1]), column(self.0[2]))
    }

    /// Whether left and right change places.
    pub fn is_mirror(self) -> bool {
        self.matrix().determinant() < 0.0
    }

    /// Whether nothing is turned.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// This turn, and then the other.
    pub fn then(self, next: Self) -> Self {
        Self::of(next.matrix() * self.matrix())
    }

    /// What the file's left, posterior and superior really are, in words.
    pub fn words(self) -> String {
        let word = |letter: u8| match letter {
            b'L' => "left",
            b'R' => "right",
            b'P' => "posterior",
            b'A' => "anterior",
            b'S' => "superior",
            _ => "inferior",
        };
        self.0.map(word).join(", ")
    }

    /// What the file's left, posterior and superior really are, as three letters alone.
    pub fn letters(self) -> String {
        self.0.map(char::from).into_iter().collect()
    }
}

impl FromStr for Turn {
    type Err = TurnError;

    fn from_str(text: &str) -> Result<Self, TurnError> {
        let (letters, mirror) = text.split_once(',').map_or((text, None), |(letters, word)| (letters, Some(word.trim())));
        let wrong = || TurnError::Letters(text.to_owned());
        let three: [u8; 3] = letters.trim().to_ascii_uppercase().into_bytes().try_into().map_err(|_| wrong())?;
        let turn = Self(three);
        if turn.matrix().determinant() == 0.0 || mirror.is_some_and(|word| !word.eq_ignore_ascii_case("mirror")) {
            return Err(wrong());
        }
        match (turn.is_mirror(), mirror) {
            (true, None) => Err(TurnError::Mirror(turn.letters())),
            (false, Some(_)) => Err(TurnError::NoMirror(turn.letters())),
            _ => Ok(turn),
        }
    }
}

impl fmt::Display for Turn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.letters(), if self.is_mirror() { ",mirror" } else { "" })
    }
}

impl TryFrom<String> for Turn {
    type Error = TurnError;

    fn try_from(text: String) -> Result<Self, TurnError> {
        text.parse()
    }
}

impl From<Turn> for String {
    fn from(turn: Turn) -> Self {
        turn.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_24_turns_and_their_mirror_images() {
        // Fails if a turn is missing, is no turn by right angles, or a mirror image passes for one.
        let all: Vec<Turn> = Turn::all().collect();
        assert_eq!((all.len(), all.iter().filter(|t| t.is_mirror()).count()), (48, 24));
        for turn in all {
            let m = turn.matrix();
            assert_eq!(m * m.transpose(), DMat3::IDENTITY, "{turn}");
            assert_eq!(turn.to_string().parse(), Ok(turn));
            assert_eq!(Turn::of(m), turn);
        }
    }

    #[test]
    fn turns_follow_each_other_and_their_letters_say_where_they_lead() {
        // Fails if letters name the inverse, or if turns are put together in the wrong order.
        let turn: Turn = "PLI".parse().unwrap();
        assert_eq!(turn.matrix() * DVec3::X, DVec3::Y);
        assert_eq!(turn.matrix() * DVec3::Z, DVec3::NEG_Z);
        let (tip, roll) = (Turn::about(DVec3::X, 90), Turn::about(DVec3::Z, 90));
        assert_eq!(tip.matrix() * DVec3::Y, DVec3::Z);
        assert_eq!(tip.then(roll).matrix(), roll.matrix() * tip.matrix());
        assert_eq!(Turn::about(DVec3::Z, 180).to_string(), "RAS");
        assert_eq!(Turn::about(DVec3::Z, -90).then(roll), Turn::default());
        assert_eq!(Turn::mirror().then(Turn::about(DVec3::Z, 180)).to_string(), "LAS,mirror");
    }

    #[test]
    fn what_is_no_turn_is_refused_in_a_sentence() {
        // Fails if a mirror image is made by a slip, or two letters of one axis flatten a scan.
        for (text, what) in [
            ("", "names no turn"),
            ("RA", "names no turn"),
            ("LRS", "names no turn"),
            ("LPX", "names no turn"),
            ("RAS,mirror image", "names no turn"),
            ("RPS", "write RPS,mirror"),
            ("RAS,mirror", "mirrors nothing"),
        ] {
            let error = text.parse::<Turn>().unwrap_err().to_string();
            assert!(error.contains(what), "{text}: {error}");
        }
        assert_eq!("ras".parse::<Turn>().unwrap().to_string(), "RAS");
        assert!("rps, mirror".parse::<Turn>().unwrap().is_mirror());
    }
}
