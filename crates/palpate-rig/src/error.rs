//! Errors of a rig or study file: the problem, its place, and a remedy.

use std::fmt::Display;
use std::ops::Range;

use palpate_estimators::arrangement::ArrangementError;
use palpate_estimators::setup::SetupError;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{LayoutError, SensorKind};
use palpate_mechanics::surface::modal::ModalBeamError;
use palpate_mechanics::surface::{
    BeamError, DigitError, Extent, InsensitiveSensor, PlateError, SupportedBeamError,
};
use palpate_numerics::OutOfRange;
use serde::de::{Expected, Unexpected};

/// Error of a rig or study file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct RigError {
    /// The problem.
    pub problem: Box<RigProblem>,
    /// The bytes of the document at fault; `None` when something is missing.
    pub span: Option<Range<usize>>,
}

/// Problem of a rig or study file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigProblem {
    /// The text is not TOML.
    #[error("{}", .0.message())]
    Toml(toml::de::Error),
    /// A section is missing.
    #[error("section {section} is missing")]
    MissingSection {
        /// Name in brackets.
        section: &'static str,
    },
    /// A section lacks a key.
    #[error("{} has no `{key}`", if section.is_empty() { "the file".to_owned() } else { format!("[{section}]") })]
    MissingKey {
        /// The section and those around it, as in `surface.supports`; empty for the file itself.
        section: String,
        /// The key.
        key: String,
    },
    /// A key that the section does not have.
    #[error("{}", unknown_key(key, known, with.as_deref()))]
    UnknownKey {
        /// The key.
        key: String,
        /// The keys that can stand there.
        known: Vec<&'static str>,
        /// Key and value that restrict the section to these keys, as in `kind = "beam"`; `None` if they do not depend on a value.
        with: Option<String>,
    },
    /// A key that has no effect with the other keys.
    #[error("`{key}` does not go with {with}")]
    UnusedKey {
        /// The key.
        key: String,
        /// The other key or thing with which it conflicts.
        with: String,
    },
    /// A word that is not a value of the key.
    #[error("`{key}` is `{word}`{}", suggestion(word, known))]
    UnknownWord {
        /// The key.
        key: String,
        /// The word that stands there.
        word: String,
        /// The words that may stand there.
        known: Vec<&'static str>,
    },
    /// A text that is not a valid value of the key, such as a quantity in another unit.
    #[error("`{key}`: {reason}")]
    Invalid {
        /// The key.
        key: String,
        /// The reason.
        reason: String,
    },
    /// A value outside its bound.
    #[error("`{key}` is {value}; it must be {bound}")]
    OutOfRange {
        /// The key.
        key: String,
        /// Value, as written.
        value: String,
        /// The bound, in words.
        bound: String,
    },
    /// A surface with a side out of its range.
    #[error(transparent)]
    Extent(OutOfRange),
    /// A beam that cannot be computed.
    #[error(transparent)]
    Beam(BeamError),
    /// A beam on supports that cannot be computed.
    #[error(transparent)]
    SupportedBeam(SupportedBeamError),
    /// A plate that cannot be computed.
    #[error(transparent)]
    Plate(PlateError),
    /// A digit that cannot be computed.
    #[error(transparent)]
    Digit(DigitError),
    /// A beam with a motion that cannot be computed.
    #[error(transparent)]
    ModalBeam(ModalBeamError),
    /// A moving contact with a number out of its range.
    #[error(transparent)]
    Motion(OutOfRange),
    /// A sensor with a number out of its range.
    #[error(transparent)]
    Layout(LayoutError),
    /// Sensors or a force that do not go with the surface.
    #[error(transparent)]
    Setup(SetupError),
    /// Training positions that cannot be laid out.
    #[error(transparent)]
    Arrangement(ArrangementError),
    /// An insensitive sensor: its reading does not depend on the contact.
    #[error(
        "{kind} sensor {number} is at {} and would always read 0: {reason}",
        extent.place_in_words(*position)
    )]
    InsensitiveSensor {
        /// Number of the sensor in its section, from 1.
        number: usize,
        /// Kind.
        kind: SensorKind,
        /// Position.
        position: Position,
        /// The surface.
        extent: Extent,
        /// Why.
        reason: InsensitiveSensor,
    },
    /// A reaction sensor at a place without a support that takes up force.
    #[error(
        "reaction sensor {number} is at {}, where no support takes up force; {}",
        extent.place_in_words(*position),
        force_takers(*extent, supports)
    )]
    NoSupport {
        /// Number of the sensor in its section, from 1.
        number: usize,
        /// Position.
        position: Position,
        /// Positions of the supports that take up force.
        supports: Vec<Position>,
        /// The surface.
        extent: Extent,
    },
    /// The rig is to be simulated, but its force is unknown.
    #[error(
        "the surface is to be simulated at these training positions, but neither [training] nor [contact] has a `force`"
    )]
    NoForce,
}

/// Place of a value in the document, and the text that is written there.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// Path of the value: its key after those of the tables around it, joined by dots. An element has the path of its list; the document has an
    /// empty one.
    pub path: String,
    /// Bytes in the document.
    pub span: Range<usize>,
    /// The value as messages quote it.
    pub written: String,
}

impl Place {
    pub fn key(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or_default()
    }

    /// The error for a value outside its bound.
    pub fn refuse(&self, bound: impl Display) -> RigError {
        self.refuse_as(&self.written, bound)
    }

    /// The error for a value outside its bound, quoted as `value` instead of as written.
    pub fn refuse_as(&self, value: impl Display, bound: impl Display) -> RigError {
        let (value, bound) = (value.to_string(), bound.to_string());
        RigProblem::OutOfRange { key: self.key().to_owned(), value, bound }.at_place(self)
    }

    /// The error for an invalid value of the key, with the reason.
    pub fn invalid(&self, reason: impl Display) -> RigError {
        RigProblem::Invalid { key: self.key().to_owned(), reason: reason.to_string() }.at_place(self)
    }

    /// The error for a table that lacks a key.
    pub fn missing(&self, key: &str) -> RigError {
        RigProblem::MissingKey { section: self.path.clone(), key: key.to_owned() }.at_place(self)
    }

    /// The error for a key that has no effect with the other keys.
    pub fn unused(&self, with: impl Display) -> RigError {
        RigProblem::UnusedKey { key: self.key().to_owned(), with: with.to_string() }.at_place(self)
    }
}

impl RigError {
    /// Remedy, if there is one beyond the message.
    pub fn help(&self) -> Option<String> {
        match &*self.problem {
            RigProblem::UnknownKey { key, known, .. } => {
                closest(key, known).map(|_| format!("known keys: {}", known.join(", ")))
            }
            RigProblem::UnknownWord { word, known, .. } => {
                closest(word, known).map(|_| format!("it can be: {}", known.join(", ")))
            }
            RigProblem::MissingSection { section } => Some(format!("add a section {section}")),
            RigProblem::MissingKey { key, .. } => Some(format!("add `{key} = …`")),
            RigProblem::NoForce => {
                Some("add `force = \"3 N\"` to [training] when later contacts have another, unknown force; to [contact] when they have the same".to_owned())
            }
            RigProblem::NoSupport { .. } => Some("a reaction sensor sits at a support".to_owned()),
            RigProblem::InsensitiveSensor { .. } => Some("move it off the support, or leave it out".to_owned()),
            RigProblem::SupportedBeam(error) => error.help().map(str::to_owned),
            _ => None,
        }
    }

    /// Sets key and place to those of the refused value, unless a value within it is named already.
    pub(crate) fn with_place(mut self, place: &Place) -> Self {
        if self.span.is_some() {
            return self;
        }
        match &mut *self.problem {
            RigProblem::OutOfRange { key, value, .. } => {
                place.key().clone_into(key);
                place.written.clone_into(value);
            }
            RigProblem::UnknownWord { key, .. } | RigProblem::Invalid { key, .. } => {
                place.key().clone_into(key);
            }
            RigProblem::MissingKey { section, .. } => place.path.clone_into(section),
            _ => {}
        }
        // A key that the file itself lacks has no place.
        self.span = (!place.path.is_empty()).then(|| place.span.clone());
        self
    }

    /// Sets the place to that of an unknown key. `tag` is the key and value that determined the table's variant, and so its keys.
    pub(crate) fn at_key(mut self, span: Range<usize>, tag: Option<(&'static str, &str)>) -> Self {
        if let (RigProblem::UnknownKey { known, with, .. }, Some((key, word))) = (&mut *self.problem, tag) {
            known.insert(0, key);
            *with = Some(format!("{key} = \"{word}\""));
        }
        self.span = Some(span);
        self
    }
}

impl RigProblem {
    /// This problem, at a place of the document.
    pub(crate) fn at_place(self, place: &Place) -> RigError {
        RigError { problem: Box::new(self), span: Some(place.span.clone()) }
    }

    /// This problem, for something that is missing.
    pub(crate) fn without_place(self) -> RigError {
        RigError { problem: Box::new(self), span: None }
    }
}

/// Refusals by types; the caller of the deserializer adds the place.
impl serde::de::Error for RigError {
    fn custom<T: Display>(reason: T) -> Self {
        RigProblem::Invalid { key: String::new(), reason: reason.to_string() }.without_place()
    }

    fn invalid_type(_: Unexpected, expected: &dyn Expected) -> Self {
        let expected = expected.to_string();
        let bound = match expected.as_str() {
            "a sequence" => "a list",
            "a boolean" => "true or false",
            "a string" => "a text",
            "i64" => "a whole number",
            words if words.starts_with("struct ") || words.starts_with("enum ") => "a table",
            words => words,
        };
        RigProblem::OutOfRange { key: String::new(), value: String::new(), bound: bound.to_owned() }
            .without_place()
    }

    fn invalid_value(unexpected: Unexpected, expected: &dyn Expected) -> Self {
        Self::invalid_type(unexpected, expected)
    }

    fn invalid_length(_: usize, expected: &dyn Expected) -> Self {
        Self::invalid_type(Unexpected::Seq, expected)
    }

    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Self {
        RigProblem::UnknownWord { key: String::new(), word: word.to_owned(), known: known.to_vec() }
            .without_place()
    }

    fn unknown_field(key: &str, known: &'static [&'static str]) -> Self {
        RigProblem::UnknownKey { key: key.to_owned(), known: known.to_vec(), with: None }.without_place()
    }

    fn missing_field(key: &'static str) -> Self {
        RigProblem::MissingKey { section: String::new(), key: key.to_owned() }.without_place()
    }
}

/// Lists the supports that take up force: "those that do are at 0 mm and 400 mm".
fn force_takers(extent: Extent, supports: &[Position]) -> String {
    let places: Vec<String> = supports.iter().map(|support| extent.place_in_words(*support)).collect();
    match places.as_slice() {
        [] => "no support does".to_owned(),
        [only] => format!("the only one that does is at {only}"),
        [first @ .., last] => format!("those that do are at {} and {last}", first.join(", ")),
    }
}

fn unknown_key(key: &str, known: &[&'static str], with: Option<&str>) -> String {
    match with {
        Some(with) if closest(key, known).is_none() => {
            format!("`{key}` does not go with {with}; known are {}", known.join(", "))
        }
        _ => format!("unknown key `{key}`{}", suggestion(key, known)),
    }
}

/// ", did you mean `x`?" for the known word closest to `word`, or the list of known words if none is close.
fn suggestion(word: &str, known: &[&'static str]) -> String {
    match closest(word, known) {
        Some(other) => format!(", did you mean `{other}`?"),
        None => format!("; known are {}", known.join(", ")),
    }
}

/// Invalid words, each with the valid word that it stands for.
const RENAMED: [(&str, &str); 1] = [("from", "source")];

/// The known word that `word` stands for or is close to: at most one edit, and one more for every four letters.
fn closest(word: &str, known: &[&'static str]) -> Option<&'static str> {
    let renamed = RENAMED.iter().find(|(before, now)| *before == word && known.contains(now));
    if let Some((_, now)) = renamed {
        return Some(now);
    }
    let (distance, other) =
        known.iter().map(|other| (strsim::damerau_levenshtein(word, other), *other)).min()?;
    (distance <= 1 + word.chars().count() / 4).then_some(other)
}
